"""`metamer render`: one picture of a scene."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from ..runtime.errors import UsageError
from ..runtime.progress import TimeLeft
from .options import (
    add_catalogue_option,
    add_display_option,
    add_illuminant_option,
    add_renderer_option,
    catalogue_for,
    check_display_option,
    positive_count,
    positive_delta_e,
    renderer_for,
)
from .output import say, warn
from .progress.lines import progress_bar

# Seconds that a picture which should be quick has before it says how far it is.
_LATE = 2.0


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `render`."""
    command = subparsers.add_parser(
        "render",
        help="one picture of a scene",
        description="Render one picture of a scene from fast forms, or from the original data with --reference: XYZ "
        "or spectra as OpenEXR, or a PNG for the scene's display.",
    )
    command.add_argument("scene", type=Path, metavar="SCENE", help="scene.toml")
    command.add_argument("-o", "--output", type=Path, required=True, metavar="OUT", help="OUT.exr (XYZ) or OUT.png")
    command.add_argument("--spectral", action="store_true", help="a spectral EXR in place of XYZ")
    add_illuminant_option(command)
    command.add_argument("--camera", metavar="NAME", help="default: the scene's first")
    command.add_argument("--reference", action="store_true", help="the slow truth in place of the fast picture")
    command.add_argument(
        "--bounces",
        type=_bounces,
        metavar="N",
        help="light also comes by way of up to N other surfaces; auto: of as many as can be seen (default: what the "
        "scene says, else 0)",
    )
    command.add_argument(
        "--noise",
        type=positive_delta_e,
        metavar="DE",
        help="of a reference: ΔE94 that what is drawn may leave on average (default: 0.1); half of it takes about "
        "three times as long",
    )
    command.add_argument(
        "--filtering",
        choices=("linear", "mipmapped"),
        default="linear",
        help="mipmapped: texels and highlights smaller than a sample are averaged, for pictures from afar and with "
        "few samples a pixel",
    )
    command.add_argument(
        "--jobs",
        type=positive_count,
        metavar="N",
        help="processes for ambient visibility (default: one a core), and for a missing catalogue's "
        "import (default: 1)",
    )
    command.add_argument("--bits", type=int, choices=(8, 16), help="of a PNG's channels (default: 8)")
    command.add_argument(
        "--space",
        choices=("xyz", "acescg", "rec709", "rec2020"),
        help="of an OpenEXR: XYZ as it is computed (default), or linear RGB, adapted once to the white of the space",
    )
    add_display_option(command)
    add_catalogue_option(command)
    add_renderer_option(command)
    command.set_defaults(run=run)


def _bounces(text: str) -> int | Literal["auto"]:
    """Return a number of bounces, or "auto"."""
    if text == "auto":
        return "auto"
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is neither a whole number from 0 nor auto")
    return int(text)


def run(args: argparse.Namespace) -> int:
    """Render; 0. Options that exclude each other raise `UsageError`, what cannot be used or written `InputError`."""
    from ..lighting.scene_file.files import load_scene, scene_file
    from ..runtime.files import check_outputs
    from ..viewer.picture import (
        REFERENCE_NOISE,
        bounces_notes,
        check_output,
        display_for,
        lit_by,
        picture,
        reference_picture,
        render_spectral,
        shown_on,
    )
    from ..viewer.render.picture_cost import SAID_FROM_SECONDS, picture_cost

    if args.reference and args.spectral:
        raise UsageError("--spectral and --reference: the reference is written as XYZ, choose one of the two")
    if args.reference and args.filtering != "linear":
        raise UsageError("--filtering and --reference: the reference has no factors to filter, leave one out")
    if not args.reference and args.noise is not None:
        raise UsageError("--noise requires --reference")
    for option in ("bits", "display"):
        if getattr(args, option) is not None and args.output.suffix.lower() != ".png":
            raise UsageError(f"--{option} is of PNG files: name the output .png, or leave it out")
    if args.space is not None and (args.spectral or args.output.suffix.lower() != ".exr"):
        raise UsageError("--space is of OpenEXR pictures without --spectral: name the output .exr, or leave it out")
    written: dict[str, Any] = {"bits": args.bits or 8, "space": args.space or "xyz"}
    # A wrong name is said now, not after the work: a missing catalogue alone takes minutes to make.
    check_output(args.output, args.spectral)
    scene_file(args.scene)
    check_display_option(args.display)
    check_outputs([args.output], [args.scene])
    catalogue = catalogue_for(args.catalogue, args.jobs or 1)
    scene = shown_on(lit_by(load_scene(args.scene, catalogue, say), args.illuminant), args.display)
    if args.output.suffix.lower() == ".png":
        _ = display_for(scene)
    scene = scene if args.bounces is None else replace(scene, bounces=args.bounces)
    view = scene.camera(args.camera)
    kind = "reference" if args.reference else "spectra" if args.spectral else "picture"
    cost = picture_cost(scene, view, kind, args.output.suffix)
    cost.check_room(scene, view)
    long = cost.seconds >= SAID_FROM_SECONDS
    if long:
        say(cost.words)
    if args.reference:
        left, most = TimeLeft(), 0
        left.expect(args.output, "reference", cost.seconds, evenly=True)
        left.at(args.output)
        with progress_bar("Tracing", quiet=not long, work=left) as progress:

            def traced(done: int, total: int, what: str) -> None:
                nonlocal most
                # More directions may turn out to be needed: that is told of the time, not of the rows.
                most = max(most, done)
                left.at(args.output, done / total)
                progress(most, total, what)

            noise = REFERENCE_NOISE if args.noise is None else args.noise
            made = reference_picture(scene, catalogue, args.camera, warn, traced, noise)
            notes = made.write(args.output, warn, **written)
    else:
        # Visibility may be cached, or take minutes.
        with (
            renderer_for(args.renderer) as renderer,
            progress_bar("Rendering", after=0.0 if long else _LATE, stages=cost.stages) as progress,
        ):
            renderer.configure(filtering=args.filtering, jobs=args.jobs, on_progress=progress, on_message=say)
            if args.spectral:
                notes = render_spectral(scene, catalogue, args.output, args.camera, renderer, warn)
            else:
                notes = picture(scene, catalogue, args.camera, renderer, warn).write(
                    args.output, warn, renderer, **written
                )
            notes = (*bounces_notes(scene, renderer), *notes)
    for note in (*scene.notes, *notes):
        print(note)
    print(args.output)
    return 0
