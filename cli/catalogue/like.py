"""`metamer catalogue like`: what looks like a material, or like it but warmer and glossier."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...calibration.report.text_tables import columns
from ...runtime.wording import counted
from ..options import (
    add_catalogue_argument,
    add_json_option,
    add_renderer_option,
    amounts,
    open_catalogue,
    positive_count,
    renderer_for,
)
from ..output import on_standard_output, say, write_json
from ..progress.lines import progress_bar

if TYPE_CHECKING:
    from ...materials.catalogue.catalogue import Catalogue
    from ...materials.search.appearance_offset import Appearance
    from ...materials.search.neighbours import Neighbour, Neighbours


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `like`."""
    parser = verbs.add_parser(
        "like",
        help="neighbours of a material: like this, but warmer and glossier",
        description="Find materials that look like one of them, but for what is wished. Words: lighter, darker, "
        "redder, greener, yellower, bluer, warmer, cooler, stronger, greyer, in units of CIELAB (45:0, D65), "
        "and glossier, duller, in stops, each of which doubles the image of a lamp.",
    )
    parser.add_argument("id", metavar="ID", help='such as "colorchecker/red-gloss"')
    add_catalogue_argument(parser)
    parser.add_argument("--but", type=amounts, default={}, metavar="WORD=N,...", help="such as warmer=10,glossier=1")
    parser.add_argument("-n", "--limit", type=positive_count, default=12, metavar="N", help="so many (default: 12)")
    parser.add_argument(
        "--stop", type=float, metavar="D", help="what a stop of gloss counts, in units of CIELAB (default: 5)"
    )
    add_json_option(parser)
    parser.add_argument("--strip", type=Path, metavar="FILE", help="also a PNG of them in a row, itself first")
    add_renderer_option(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Find and print; 0, or 4 where a file could not be used."""
    from ...materials.search.appearance_offset import STOP
    from ...materials.search.neighbours import like
    from ...runtime.errors import UsageError
    from ...runtime.files import check_writable

    if args.strip is not None:
        if args.strip.suffix.lower() != ".png":
            raise UsageError(f"{args.strip}: a strip is written as .png")
        check_writable(args.strip)
    catalogue = open_catalogue(args.catalogue)
    found = like(catalogue, args.id, args.but, args.limit, STOP if args.stop is None else args.stop, say)
    problems = list(map(str, found.unusable))
    if args.strip is not None:
        problems += _write_strip(args.strip, catalogue, found, args.renderer)
    if args.json is not None:
        write_json(args.json, _figures(catalogue, found))
    if not on_standard_output(args.json):
        _print(found)
        if args.strip is not None:
            print(args.strip)
        for problem in problems:
            print(problem)
    return 4 if problems else 0


def _print(found: Neighbours) -> None:
    wish = found.wish
    print(f"{found.of.id}: {_words(wish.start)}; {found.of.standing}")
    if wish.amounts:
        print(f"asked for: {', '.join(f'{word} {amount:g}' for word, amount in wish.amounts.items())}")
    if found.found:
        headings = [
            "material",
            "standing",
            "distance",
            "L*",
            "a*",
            "b*",
            "60° gloss",
            "stops",
            *wish.amounts,
            "besides",
        ]
        print(columns(headings, [_row(one, found) for one in found.found], left=2))
    else:
        nearer = "is nearer to that than it is itself" if wish.amounts else "can be compared with it"
        print(f"no other material here {nearer}")
    reasons: dict[str, list[str]] = {}
    for name, reason in found.left_out.items():
        reasons.setdefault(reason, []).append(name)
    for reason, names in sorted(reasons.items()):
        print(f"left out, {reason}: {', '.join(names)}")
    made_up = sum(one.summary.standing in ("uplifted", "reconstructed") for one in found.found)
    if made_up:
        print(f"{counted(made_up, 'material')} uplifted or reconstructed: a small distance is no match of colour")
    print("distance: ΔE94 from what was asked for, and gloss; 45:0, D65, 1931 2 degrees, as fast forms have it")


def _row(one: Neighbour, found: Neighbours) -> list[str]:
    numbers = [f"{value:.1f}" for value in one.look.lab]
    got = [f"{value:+.1f}" for value in found.wish.got(one.look).values()]
    besides = ", ".join(f"{word} {value:.1f}" for word, value in found.wish.besides(one.look).items() if value >= 0.05)
    gloss = [f"{one.look.gloss_units:.1f}", f"{one.look.gloss:.1f}"]
    return [one.summary.id, one.summary.standing, f"{one.distance:.2f}", *numbers, *gloss, *got, besides]


def _words(look: Appearance) -> str:
    lab = " ".join(f"{value:.1f}" for value in look.lab)
    return f"L*a*b* {lab}, 60° gloss {look.gloss_units:.1f} gloss units ({look.gloss:.1f} stops)"


def _write_strip(path: Path, catalogue: Catalogue, found: Neighbours, renderer: str) -> list[str]:
    """Write the thumbnails in a row; return the errors of files that could not be drawn."""
    from ...viewer.sheets.preview import contact_sheet, thumbnail_scene, thumbnails, write_sheet

    shown = [found.of, *(one.summary for one in found.found)]
    captions = [_caption(found.wish.start), *(_caption(one.look) for one in found.found)]
    with renderer_for(renderer) as drawing, progress_bar("drawing") as progress:
        scenes = [thumbnail_scene(model) for model in ("", "btf")]
        drawn = list(thumbnails(catalogue, shown, scenes[0], drawing, 128, progress, scenes[1]))
    asked = ", ".join(f"{word} {amount:g}" for word, amount in found.wish.amounts.items())
    title = f"{found.of.id}, and {asked or 'neighbours'}"
    write_sheet(path, contact_sheet(drawn, len(drawn), title, captions))
    return [one.reason for one in drawn if one.reason]


def _caption(look: Appearance) -> str:
    return f"gloss {look.gloss_units:.0f}, L* {look.lab[0]:.0f}"


def _figures(catalogue: Catalogue, found: Neighbours) -> dict[str, Any]:
    """Collect the figures that `--json` prints."""
    wish = found.wish
    return {
        "catalogue": str(catalogue.folder),
        "material": {
            "id": found.of.id,
            "standing": found.of.standing,
            **_look(wish.start),
            "distance": found.own_distance,
        },
        "asked": {"wish": dict(wish.amounts), "lab": list(wish.to.lab), "gloss_stops": wish.to.gloss},
        "neighbours": [
            {
                "id": one.summary.id,
                "standing": one.summary.standing,
                "distance": one.distance,
                **_look(one.look),
                "got": wish.got(one.look),
                "besides": wish.besides(one.look),
            }
            for one in found.found
        ],
        "looked_at": found.looked_at,
        "left_out": found.left_out,
        "unusable": [str(reason) for reason in found.unusable],
    }


def _look(look: Appearance) -> dict[str, Any]:
    return {"lab": list(look.lab), "gloss_stops": look.gloss, "gloss_units": look.gloss_units}
