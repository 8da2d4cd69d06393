"""`metamer display config`: a characterised display as a configuration of OpenColorIO."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Literal

from ..options import add_output_option


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display config`."""
    verb = kinds.add_parser(
        "config",
        help="a configuration of OpenColorIO that drives the display",
        description="Write the pinned configuration of OpenColorIO with this display first: a folder with config.ocio, "
        "and the same as one .ocioz. Its views: colorimetric, and with the black of pictures moved to the display's.",
    )
    verb.add_argument("display", type=Path, metavar="DISPLAY.json", help="what `display characterise` wrote")
    verb.add_argument(
        "--white",
        type=_white,
        default="d65",
        metavar="d65|native|X,Y",
        help="what the white of pictures becomes (default: d65)",
    )
    verb.add_argument("--luminance", type=float, metavar="L", help="cd/m2 of that white (default: as much as there is)")
    verb.add_argument("--black", choices=("absolute", "bpc"), default="absolute", help="which view comes first")
    verb.add_argument("--name", metavar="WORDS", help="of the display in the configuration (default: its own)")
    verb.add_argument("--icc", action="store_true", help="also write a matrix profile (ICC version 2)")
    add_output_option(verb, "folder that is made for the configuration", metavar="DIR", required=True)
    verb.set_defaults(run=run)


def _white(text: str) -> Literal["d65", "native"] | tuple[float, float]:
    if text in ("d65", "native"):
        return text
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"d65, native or a chromaticity such as 0.3127,0.329, not {text}") from None
    return x, y


def run(args: argparse.Namespace) -> int:
    """Write and print; 0, 1 where the profile cannot follow the display."""
    from dataclasses import replace

    from ...calibration.display.aim import AimSettings
    from ...calibration.display.cube import make_cube
    from ...calibration.display.observer_aims import observer_aims
    from ...calibration.display.record import read_record
    from ...viewer.display.config import file_stem, write_config
    from ...viewer.display.transform import DEFAULT_VIEW, DisplayTransform
    from ..output import warn

    record = replace(read_record(args.display), settings=AimSettings(args.white, args.luminance, args.black))
    aim = record.aim
    cube = make_cube(record.model)
    name = args.name or record.name
    others, seen_by = observer_aims(record), record.readings.observer
    written = write_config(args.out, name, record.model, cube, aim, args.black, seen_by, others)
    record.write(args.out / "display.json")
    print(f"{name}: white {aim.words}; model {record.model.name}")
    for words in DisplayTransform(name, DEFAULT_VIEW, str(written.config)).describe()[2:]:
        print(words)
    for one in others:
        print(f"For observer {one.observer}: white {one.words}")
    if not others:
        print(
            f"For observer {seen_by} alone: the readings have no spectra "
            "(`metamer display characterise --primaries FILE.ccss` takes those of the display)"
        )
    code = 0
    if args.icc:
        from ...calibration.display.icc import matrix_profile, profile_error, write_profile

        path = args.out / f"{file_stem(name)}.icc"
        profile = matrix_profile(record.readings, name)
        write_profile(path, profile)
        mean, worst = profile_error(profile, record.readings)
        print(f"{path}: a matrix profile, ΔE94 {mean:.2f} from the readings on average, {worst:.1f} at most")
        if record.additivity.refuses:
            warn(f"{path}: no matrix profile can follow this display; {record.additivity.words}")
            code = 1
    print(f"Written: {written.config}, {written.archive}")
    print(f'To use it, in [viewing] of a scene: display = "{name}" and ocio_config = "{written.config}"')
    print(f"In other programs: OCIO={written.archive}, and its display {name!r}")
    return code
