"""`metamer display proof`: the parts of a picture out of a display's gamut."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ..options import (
    add_catalogue_option,
    add_illuminant_option,
    add_output_option,
    add_renderer_option,
    catalogue_for,
    renderer_for,
)
from ..output import say, warn
from ..progress.lines import progress_bar

if TYPE_CHECKING:
    import numpy as np

    from ...calibration.display.proof import ProofStatistics

    # From a picture in XYZ-D65 and whom it is for ("": whom the display is) to the display in words, and the figures.
    Prover = Callable[[np.ndarray, str], tuple[str, ProofStatistics]]

_PROFILES = (".icc", ".icm")


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `display proof`."""
    verb = kinds.add_parser(
        "proof",
        help="what of a picture or a scene a display cannot show, and where",
        description="Count the pixels of a picture, or of a scene that is rendered for it, which the display cannot "
        "show to within ΔE94 0.5, say how far off what it shows is, and mark them. Exit code 1 where there are any.",
    )
    verb.add_argument(
        "display",
        metavar="DISPLAY",
        help="display.json beside a configuration, for the white, luminance and black that it aims at; what `display "
        "characterise` wrote, for D65; or the display's profile, PROFILE.icc, or icc:screen for the one that the "
        "system has",
    )
    verb.add_argument(
        "picture",
        type=Path,
        metavar="PICTURE|SCENE",
        help="PNG or JPEG, sRGB unless its profile says something else; or scene.toml",
    )
    verb.add_argument("--luminance", type=float, metavar="L", help="cd/m2 of white (default: as of the configuration)")
    verb.add_argument(
        "--black",
        choices=("absolute", "bpc"),
        help="of pictures: as it is, or moved (default: as of the configuration)",
    )
    verb.add_argument("--camera", metavar="NAME", help="of a scene (default: its first)")
    add_illuminant_option(verb, "in place of the spectra of a scene's lights")
    add_output_option(verb, "the picture in grey, what is lost in magenta", metavar="F.png")
    add_catalogue_option(verb)
    add_renderer_option(verb)
    verb.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Look and print; 0, or 1 where something cannot be shown."""
    from ...calibration.display.icc_profile import PREFIX
    from ...runtime.errors import UsageError
    from ...runtime.files import check_outputs, written_whole
    from ...viewer.display.received_picture import read_picture

    is_scene = args.picture.suffix.lower() == ".toml"
    is_profile = args.display.startswith(PREFIX) or args.display.lower().endswith(_PROFILES)
    for option in ("camera", "illuminant", "catalogue"):
        if not is_scene and getattr(args, option) is not None:
            raise UsageError(f"--{option} is of scenes: leave it out for {args.picture}")
    for option in ("luminance", "black"):
        if is_profile and getattr(args, option) is not None:
            raise UsageError(f"--{option} is of DISPLAY.json: a profile says its white and black itself")
    if args.out is not None:
        if args.out.suffix.lower() != ".png":
            raise UsageError(f"{args.out}: the marked picture is written as .png")
        check_outputs([args.out], [Path(args.display.removeprefix(PREFIX)), args.picture])
    prove = _profile(args.display) if is_profile else _characterised(args)
    if is_scene:
        pixels, xyz, seen_by = _rendered(args)
    else:
        (pixels, xyz, stated), seen_by = read_picture(args.picture), ""
        if stated:
            warn(f"{args.picture} says {', '.join(stated)}, which is not applied: it is taken as sRGB")
    words, found = prove(xyz, seen_by)
    count, pixel_count = int(found.lost.sum()), found.lost.size
    dark = int((found.lost & found.darker).sum())
    darker = f", {dark} of them darker than its black" if dark else ""
    share = f"{count} of {pixel_count} pixels ({count / pixel_count:.2%})"
    print(f"{args.picture}: {share} cannot be shown on {words}{darker}")
    if count:
        off = found.delta_e[found.lost]
        warn(f"where they are, what is shown is off by ΔE94 {off.mean():.2f} on average, at most {off.max():.1f}")
    if args.out is not None:
        from PIL import Image

        marked = pixels.copy()
        marked[...] = marked.mean(axis=-1, keepdims=True)
        marked[found.lost] = (255, 0, 255)
        with written_whole(args.out) as beside:
            Image.fromarray(marked).save(beside, format="PNG")
        print(f"Written: {args.out}")
    return 1 if count else 0


def _profile(named: str) -> Prover:
    """Return the proof of a picture in XYZ-D65 for the display of an ICC profile."""
    from ...calibration.display.icc_profile import PREFIX
    from ...viewer.display.proof import Proof
    from ...viewer.display.transform import DisplayTransform

    display = DisplayTransform(PREFIX + named.removeprefix(PREFIX))
    return lambda xyz, seen_by: (display.name + _still(seen_by, display.aimed_for), Proof(display).statistics(xyz))


def _characterised(args: argparse.Namespace) -> Prover:
    """Return the proof for a characterised display, aimed for the observer of the picture if possible."""
    from dataclasses import replace

    from ...calibration.display.cube import make_cube
    from ...calibration.display.observer_aims import observer_aims
    from ...calibration.display.proof import proofed
    from ...calibration.display.record import read_record

    record = read_record(args.display)
    asked = {name: value for name in ("luminance", "black") if (value := getattr(args, name)) is not None}
    record = replace(record, settings=replace(record.settings, **asked))
    aim, black, cube = record.aim, record.settings.black, make_cube(record.model)
    moved = ", black moved to its own" if black == "bpc" else ""

    def prove(xyz: np.ndarray, seen_by: str) -> tuple[str, ProofStatistics]:
        for one in observer_aims(record) if seen_by else ():
            if one.observer == seen_by:
                words = f"{record.name}, for {seen_by}, white {one.aim.words}{moved}"
                return words, proofed(record.model, cube, aim, one.for_first(xyz, black))
        words = f"{record.name}, white {aim.words}{moved}{_still(seen_by, record.readings.observer)}"
        return words, proofed(record.model, cube, aim, xyz, black)

    return prove


def _still(seen_by: str, aimed_for: str) -> str:
    return f", still aimed for {aimed_for}" if seen_by not in ("", aimed_for) else ""


def _rendered(args: argparse.Namespace) -> tuple[np.ndarray, np.ndarray, str]:
    """Render a scene: codes of its display, XYZ-D65, and its observer."""
    from ...lighting.scene_file.files import load_scene, scene_file
    from ...spectral.observers import observer_name
    from ...viewer.picture import lit_by, picture
    from ...viewer.render.picture_cost import picture_cost

    scene_file(args.picture)
    catalogue = catalogue_for(args.catalogue, 1)
    scene = lit_by(load_scene(args.picture, catalogue, say), args.illuminant)
    view = scene.camera(args.camera)
    picture_cost(scene, view, "picture").check_room(scene, view)
    with renderer_for(args.renderer) as renderer, progress_bar("Rendering", after=2.0) as progress:
        renderer.configure(on_progress=progress, on_message=say)
        made = picture(scene, catalogue, args.camera, renderer, warn)
    for note in scene.notes:
        say(note)
    return made.rgb(), made.display_xyz(), observer_name(scene.observer.name)
