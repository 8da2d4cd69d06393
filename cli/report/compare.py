"""`metamer report compare`: two files or folders of anything comparable."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..options import add_across_option, add_answer_options, add_lights_options, answer_of
from ..output import on_standard_output
from ..progress.lines import progress_bar
from .output import EXIT_CODES, add_output_options, check_output_options, report_result

if TYPE_CHECKING:
    from ...calibration.regression.picture_files import SeenSpectra
    from ...calibration.regression.row import ComparedSide


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `compare`."""
    compare = verbs.add_parser(
        "compare",
        help="what moved between two files or folders",
        description="Compare reviews, pictures in XYZ or spectra (EXR), PNG of a stated display, readings (CxF, CGATS, "
        f"...) or catalogues. A is the reference of every ΔE. {EXIT_CODES}",
    )
    for side in ("A", "B"):
        compare.add_argument(side.lower(), metavar=side, type=Path, help="file or folder")
    compare.add_argument("--criteria", type=Path, metavar="FILE", help="TOML with [[criteria]]; docs/regression.md")
    add_side_options(compare)
    add_across_option(compare)
    add_output_options(compare)
    compare.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Compare; the exit code is in the command's description."""
    from ...calibration.regression.baseline import as_recorded
    from ...calibration.regression.comparison import compare
    from ...calibration.regression.criteria import default_criteria, read_criteria

    criteria = read_criteria(args.criteria) if args.criteria else default_criteria()
    seen = seen_by(args)
    check_output_options(args)
    before, after = (side_at(path, seen, args.display) for path in (args.a, args.b))
    if "baseline" in (before.kind, after.kind):
        before, after = as_recorded(before), as_recorded(after)
    with progress_bar("Comparing", quiet=on_standard_output(args.json), after=1.0) as progress:
        result = compare(before, after, criteria, progress, args.across)
    return report_result(result, before, after, args)


def add_side_options(command: argparse.ArgumentParser) -> None:
    """Add options for information that files lack."""
    add_lights_options(command, "under which spectra, readings and catalogues are seen; pictures in XYZ have theirs")
    command.add_argument(
        "--display", choices=("sRGB",), metavar="NAME", help="that PNG pictures are for, where they do not say: sRGB"
    )
    add_answer_options(command)


def seen_by(args: argparse.Namespace) -> SeenSpectra:
    """Return lights and observer; unknown names are refused before any file is opened."""
    from ...calibration.regression.picture_files import SeenSpectra
    from ...spectral.illuminants import illuminant
    from ...spectral.observers import observer

    for name in args.illuminants:
        illuminant(name)
    observer(args.observer)
    if args.colours_for is not None:
        illuminant(args.colours_for[0])
        observer(args.colours_for[1])
    return SeenSpectra(tuple(args.illuminants), args.observer, answer_of(args))


def side_at(path: Path, seen: SeenSpectra, display: str | None) -> ComparedSide:
    """Return the side at a path; a folder of materials is a catalogue."""
    from ...calibration.regression.sources import side_of
    from ...viewer.catalogue_side import catalogue_side, is_catalogue

    return catalogue_side(path, seen) if is_catalogue(path) else side_of(path, seen, display)
