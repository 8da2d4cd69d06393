"""`metamer transfer show`: the number of bounces a scene needs, and the light that each part casts on each other."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...runtime.wording import counted
from ..options import add_catalogue_option, add_illuminant_option, add_json_option, catalogue_for
from ..output import figures_file, say, write_json
from ..progress.lines import progress_bar
from .build import add_kept_options

if TYPE_CHECKING:
    from ...lighting.scene import Scene
    from ...lighting.transfer.influence import Influence, ShownInfluence

# Differences that are smaller, on average and at the 95th percentile, are left out of the table: nobody sees them.
_SAID_FROM = 0.1


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `transfer show`."""
    show = kinds.add_parser(
        "show",
        help="how many bounces a scene needs, and what each part puts on each other",
        description="Follow light from part to part until no further bounce changes a colour by ΔE94 0.1, and say what "
        "that changes: on each part as a whole, and by each other part. Every material counts as a matt surface that "
        "reflects as much as it does of even light.",
    )
    show.add_argument("scene", type=Path, metavar="SCENE", help="scene.toml")
    add_kept_options(show)
    add_illuminant_option(show)
    add_json_option(show)
    add_catalogue_option(show)
    show.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Follow and print; 0."""
    from ...lighting.scene_file.files import load_scene, scene_file
    from ...lighting.transfer.influence import influence
    from ...lighting.visibility.cache_limits import transfer_folder
    from ...runtime.files import check_writable
    from ...runtime.worker_pool import usable_cores
    from ...viewer.picture import lit_by

    scene_file(args.scene)
    for path in figures_file(args.json):
        check_writable(path)
    catalogue = catalogue_for(args.catalogue, 1)
    scene = lit_by(load_scene(args.scene, catalogue, say), args.illuminant)
    surfaces = {name: catalogue.surface(name).drawn() for name in scene.material_ids}
    with progress_bar("Following light") as progress:
        folder, jobs = args.kept or transfer_folder(), args.jobs or usable_cores()
        found = influence(scene, surfaces, args.rays, progress=progress, folder=folder, jobs=jobs, say=say)
    for note in scene.notes:
        print(note)
    print(_words(scene, found))
    if args.json is not None:
        write_json(args.json, _figures(scene, found))
        for path in figures_file(args.json):
            print(path)
    return 0


def _words(scene: Scene, found: Influence) -> str:
    from ...calibration.report.text_tables import columns

    names = [part.name for part in scene.parts]
    needs = f"this scene needs {counted(found.bounces, 'bounce') if found.bounces else 'no bounce'}"
    size = f"{found.sites:,} vertices of {found.rays} rays, {found.nbytes / 1e6:.1f} MB"
    between = found.between
    lines = [
        f"{scene.name}: {needs}; further ones change no colour by more than ΔE94 {found.left:.2g} ({size})",
        f"between vertices, of which {found.added:,} were added where light is not linear, colours are off by ΔE94 "
        f"{between.mean:.2f} on average, p95 {between.p95:.2f}, max {between.maximum:.1f}",
    ]
    rows = [
        [name, part.material, f"{y:.2f}", *_numbers(shown)]
        for name, part, y, shown in zip(names, scene.parts, found.albedo_y, found.all, strict=True)
    ]
    head = ["part", "material", "Y", "ΔE94 mean", "p95", "max"]
    lines += ["", "what light that is passed on changes on each part", columns(head, rows, left=2)]
    pairs = [
        (shown, names[on], names[by])
        for on, row in enumerate(found.of)
        for by, shown in enumerate(row)
        if max(shown.mean, shown.p95) >= _SAID_FROM
    ]
    pairs.sort(key=lambda pair: -pair[0].mean)
    if pairs:
        head = ["on", "by", "ΔE94 mean", "p95", "max"]
        rows = [[on, by, *_numbers(shown)] for shown, on, by in pairs]
        lines += ["", "what a part puts on another, or on itself", columns(head, rows, left=2)]
    else:
        lines += ["", f"no part changes the colour of another by ΔE94 {_SAID_FROM:g} or more"]
    return "\n".join(lines)


def _numbers(shown: ShownInfluence) -> list[str]:
    return [f"{value:.2f}" for value in (shown.mean, shown.p95, shown.maximum)]


def _figures(scene: Scene, found: Influence) -> dict[str, Any]:
    """Collect the figures of `--json`."""

    def numbers(shown: ShownInfluence) -> dict[str, float]:
        return {"mean": shown.mean, "p95": shown.p95, "max": shown.maximum}

    names = [part.name for part in scene.parts]
    parts = [
        {"part": part.name, "material": part.material, "albedo_y": y, "delta_e94": numbers(shown)}
        for part, y, shown in zip(scene.parts, found.albedo_y, found.all, strict=True)
    ]
    pairs = [
        {"on": names[on], "by": names[by], "delta_e94": numbers(shown)}
        for on, row in enumerate(found.of)
        for by, shown in enumerate(row)
    ]
    size = {
        "vertices": found.sites,
        "added_vertices": found.added,
        "rays": found.rays,
        "bytes": found.nbytes,
        "between_vertices_delta_e94": numbers(found.between),
    }
    return {
        "scene": scene.name,
        "bounces": found.bounces,
        "left_delta_e94": found.left,
        **size,
        "parts": parts,
        "pairs": pairs,
    }
