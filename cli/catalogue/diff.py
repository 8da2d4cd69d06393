"""`metamer catalogue diff`: what changed between two catalogues or two materials, in ΔE94."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

from ...calibration.report.text_tables import columns
from ...runtime.remote import place
from ..options import (
    add_json_option,
    add_lights_options,
    open_catalogue,
    positive_count,
    positive_delta_e,
)
from ..output import on_standard_output, write_json
from ..progress.lines import progress_bar

if TYPE_CHECKING:
    from ...materials.catalogue.compare import CatalogueComparison
    from ...materials.records.material import MaterialRecord


# Less than this is shown as 0.000: packs of other bytes that look the same, or only other words.
_NONE = 0.0005


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `diff`."""
    diff = verbs.add_parser(
        "diff",
        help="what changed between two catalogues or two materials",
        description="Materials added, removed and changed, and by how much; A is the reference of every ΔE94. Exit "
        "code 2 where --fail is exceeded, 3 where nothing can be compared, 4 where a file is unusable.",
    )
    for side in ("A", "B"):
        diff.add_argument(side.lower(), metavar=side, help="catalogue folder, material file, or id of a material")
    diff.add_argument("--catalogue", type=place, metavar="CAT", help="where ids are looked up (default: as for list)")
    add_lights_options(diff, "under which materials are compared")
    diff.add_argument(
        "--of",
        choices=("packs", "original"),
        default="packs",
        help="compare what pictures show (packs: fast forms, the default) or what was measured",
    )
    diff.add_argument("--fail", type=positive_delta_e, metavar="D", help="end with 2 where a ΔE94 p99 is above D")
    diff.add_argument("--jobs", type=positive_count, metavar="N", help="processes; default: one a core")
    add_json_option(diff)
    diff.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Compare; the exit code is in the command's description."""
    found = _catalogues(args) if _is_folder(args.a) and _is_folder(args.b) else _materials(args)
    if args.json is not None:
        figures = {**dataclasses.asdict(found), "protocol": found.protocol, "largest": found.largest}
        write_json(args.json, figures)
    if not on_standard_output(args.json):
        _print(found)
    if args.fail is not None and found.largest > args.fail:
        if not on_standard_output(args.json):
            print(f"over ΔE94 {args.fail:g}: {found.largest:.3f}")
        return 2
    if found.count("unusable"):
        return 4
    return 0 if found.count("same") or found.count("changed") else 3


def _is_folder(text: str) -> bool:
    return place(text).is_dir()


def _catalogues(args: argparse.Namespace) -> CatalogueComparison:
    from ...materials.catalogue.compare import compare_catalogues

    a, b = open_catalogue(place(args.a)), open_catalogue(place(args.b))
    with progress_bar("Comparing", quiet=on_standard_output(args.json)) as progress:
        return compare_catalogues(
            a,
            b,
            illuminants=args.illuminants,
            observer_name=args.observer,
            of=args.of,
            jobs=args.jobs,
            progress=progress,
        )


def _materials(args: argparse.Namespace) -> CatalogueComparison:
    from ...materials.catalogue.compare import CatalogueComparison, compare_records
    from ...runtime.errors import UsageError

    for side in (args.a, args.b):
        if _is_folder(side):
            raise UsageError(f"{side} is a folder and the other side is not: name two catalogues or two materials")
    a, b = (_record(side, args.catalogue) for side in (args.a, args.b))
    found = compare_records(a, b, illuminants=args.illuminants, observer_name=args.observer, of=args.of)
    return CatalogueComparison((found,), args.of, args.illuminants, args.observer)


def _record(text: str, catalogue: Path | None) -> MaterialRecord:
    from ...materials.records.record import read_record

    path = place(text)
    return read_record(path) if path.is_file() else open_catalogue(catalogue).load(text)


def _print(found: CatalogueComparison) -> None:
    # Two materials: every light. Two catalogues: a line each, the largest difference first.
    whole = len(found.differences) == 1
    shown = [
        (one, light)
        for one in found.differences
        for light in (one.lights if whole else [one.worst])
        if light is not None
    ]
    alike = [] if whole else [one for one, light in shown if light.maximum < _NONE and not one.words]
    if not whole:
        shown = [pair for pair in shown if pair[0] not in alike]
        shown.sort(key=lambda pair: -pair[1].p99)
    rows = []
    for one, light in shown:
        figures = (light.mean, light.p95, light.p99, light.maximum)
        rows.append([one.id, light.light, *(f"{value:.3f}" for value in figures), one.words])
    if rows:
        headings = ("material", "light" if whole else "worst light", "mean", "p95", "p99", "max", "")
        print(columns(headings, rows, left=2, words=True))
    for status in ("added", "removed", "not comparable", "unusable"):
        for one in found.differences:
            if one.status == status:
                print(f"{status}: {one.id}{f': {one.words}' if one.words else ''}")
    if rows or alike:
        print(found.protocol)
    _print_texels(found)
    if alike:
        print(f"{len(alike)} of the changed ones look the same, ΔE94 below {_NONE:g} everywhere, and are not listed")
    counts = [f"{found.count(status)} {status}" for status in ("changed", "same", "added", "removed")]
    for status in ("not comparable", "unusable"):
        if found.count(status):
            counts.append(f"{found.count(status)} {status}")
    print(", ".join(counts))


def _print_texels(found: CatalogueComparison) -> None:
    """Print single texels of BTFs as both fast forms have them, under every light."""
    shown = [(one, light) for one in found.differences for light in one.texels]
    if shown:
        rows = []
        for one, light in shown:
            figures = (light.mean, light.p95, light.p99, light.maximum)
            rows.append([one.id, light.light, *(f"{value:.3f}" for value in figures), light.where])
        print(columns(("texels of", "light", "mean", "p95", "p99", "max", "the largest"), rows, left=2, words=True))
