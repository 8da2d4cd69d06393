"""`metamer review`: the main job, headless."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from ..runtime.progress import TimeLeft
from ..runtime.wording import counted
from .options import (
    Added,
    add_catalogue_option,
    add_display_option,
    add_output_option,
    add_renderer_option,
    add_scheduler_option,
    catalogue_for,
    check_display_option,
    comma_separated,
    parse_illuminants,
    positive_count,
    positive_delta_e,
    renderer_for,
)
from .output import say, warn, write_text
from .progress.lines import progress_bar


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `review`."""
    command = subparsers.add_parser(
        "review",
        help="render materials under several lights and report how far off they are",
        description="Render every material of a scene under every light, compare with the reference, write a report. "
        "What was broken off goes on from where it was: rows in DIR that depend on the very same things are not drawn "
        "again. Exit code 0: every picture is accurate enough to judge colour by; 1: some are borderline; 2: some are "
        "too far off.",
    )
    command.add_argument(
        "scene", nargs="?", type=Path, metavar="SCENE", help="scene.toml; default: a sphere in a light booth"
    )
    add_output_option(command, "default: review", metavar="DIR", default=Path("review"))
    command.add_argument(
        "--illuminants", type=parse_illuminants, action=Added, metavar="A,B", help="default: those of the scene"
    )
    command.add_argument(
        "--materials",
        type=comma_separated,
        action=Added,
        metavar="ID,ID",
        help="ids or patterns to sweep over the review's part, or the first",
    )
    command.add_argument(
        "--budget",
        type=positive_delta_e,
        default=1.0,
        metavar="ΔE94",
        help="limit that 99 %% of each surface is held to; default 1.0",
    )
    command.add_argument(
        "--size",
        type=positive_count,
        metavar="N",
        help="pixels on the longer side of pictures; default: as the camera has it",
    )
    command.add_argument(
        "--reference-size",
        type=positive_count,
        metavar="N",
        help="the same of references, figures and maps, which take most of the time; default: as large as the pictures",
    )
    command.add_argument("--camera", metavar="NAME", help="default: the scene's first")
    command.add_argument("--again", action="store_true", help="also draw the rows that are in DIR already")
    command.add_argument(
        "--protocol",
        type=Path,
        metavar="FILE",
        help="what a reviewer said in the window, as it wrote it: for the report",
    )
    command.add_argument("--markdown", type=Path, metavar="FILE", help="write a short summary for a merge request, too")
    command.add_argument("--jobs", type=positive_count, metavar="N", help="processes; default: one a core")
    add_scheduler_option(command, "draw")
    add_display_option(command)
    add_catalogue_option(command)
    add_renderer_option(command)
    command.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Review; 0 where every row is within the budget, 1 where some are near it, 2 where some are over it."""
    from ..calibration.report.rating import read_protocol
    from ..calibration.report.review_words import as_markdown, row_words
    from ..lighting.scene_file.files import load_scene, scene_file, shipped_scene
    from ..runtime.distribution import installed_version
    from ..runtime.files import check_outputs
    from ..runtime.worker_pool import usable_cores
    from ..viewer.picture import shown_on
    from ..viewer.render.picture_cost import SAID_FROM_SECONDS, picture_cost
    from ..viewer.render.scene_layers import VISIBILITY
    from ..viewer.review.cases import review_views, reviewed_lights_of
    from ..viewer.review.review import review

    start = time.perf_counter()
    check_outputs([] if args.markdown is None else [args.markdown], [] if args.scene is None else [args.scene])
    jobs = args.jobs or usable_cores()
    # Said before a missing catalogue is made, which takes minutes.
    path = scene_file(args.scene or shipped_scene("booth"))
    check_display_option(args.display)
    ratings = () if args.protocol is None else read_protocol(args.protocol)
    catalogue = catalogue_for(args.catalogue, jobs)
    scene = shown_on(load_scene(path, catalogue, say, swept=bool(args.materials)), args.display)
    view, _ = review_views(scene, args.camera, args.size, args.reference_size)
    cost = picture_cost(scene, view, "review", spectra=len(reviewed_lights_of(scene, args.illuminants)), jobs=jobs)
    cost.check_room(scene, view)
    if cost.seconds >= SAID_FROM_SECONDS:
        say(f"each material: {cost.words}")
    renderer = renderer_for(args.renderer)
    print(f"Renderer: {renderer.name}")
    left = TimeLeft()
    with renderer, progress_bar("Reviewing", work=None if args.scheduler else left) as progress:
        # Pictures are counted by the review.
        renderer.configure(
            jobs=args.jobs,
            on_message=say,
            on_progress=lambda done, total, what: progress(done, total, what) if what == VISIBILITY else None,
        )
        result = review(
            scene,
            catalogue,
            args.out,
            illuminants=args.illuminants,
            materials=args.materials,
            budget=args.budget,
            renderer=renderer,
            camera=args.camera,
            size=args.size,
            reference_size=args.reference_size,
            jobs=jobs,
            scheduler=args.scheduler,
            version=installed_version(),
            progress=progress,
            warn=warn,
            again=args.again,
            ratings=ratings,
            left=left,
            resumed=lambda found, total: print(f"resumed: {found} of {total} rows were there", flush=True),
        )
    document = json.loads(result.figures.read_text(encoding="utf-8"))
    worst = max(document["results"], key=lambda row: row["delta_e94"]["p99"])
    print(f"{result.verdict}\n{result.facts}")
    took = f"{counted(len(result.rows), 'picture')} in {time.perf_counter() - start:.0f} s"
    print(f"Farthest off: {row_words(document, worst)}. {took}.")
    if args.markdown is not None:
        write_text(args.markdown, as_markdown(document))
        print(f"Summary:  {args.markdown}")
    print(f"Report:   {result.page}\nFigures:  {result.figures}\nPictures: {args.out / 'pictures'}")
    return {"pass": 0, "near": 1, "over": 2}.get(result.status, 2)
