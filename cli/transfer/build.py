"""`metamer transfer build`: rays between the parts of a scene, traced once for its geometry and stored."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from ...runtime.wording import counted
from ..options import add_catalogue_option, add_output_option, add_scheduler_option, catalogue_for, positive_count
from ..output import say
from ..progress.lines import progress_bar


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `transfer build`."""
    build = kinds.add_parser(
        "build",
        help="trace the rays between the parts of a scene once, and keep them",
        description="Find where light from each vertex goes, which hangs on the geometry alone: materials, lights and "
        "cameras may change, also meanwhile. What is there already is not traced again, so that a build that was "
        "broken off goes on.",
    )
    build.add_argument("scene", type=Path, metavar="SCENE", help="scene.toml")
    add_ray_options(build)
    add_output_option(
        build, "folder to keep them in, for good (default: the user's cache)", metavar="DIR", old="--into"
    )
    add_scheduler_option(build, "trace")
    add_catalogue_option(build)
    build.set_defaults(run=run)


def add_ray_options(command: argparse.ArgumentParser) -> None:
    """Add `--rays` and `--jobs`."""
    command.add_argument("--rays", type=positive_count, default=256, metavar="N", help="of each vertex (default: 256)")
    jobs = command.add_mutually_exclusive_group()
    jobs.add_argument("--jobs", type=positive_count, metavar="N", help="processes that trace; default: one a core")
    jobs.add_argument(
        "--processes", dest="jobs", type=positive_count, default=argparse.SUPPRESS, help=argparse.SUPPRESS
    )


def add_kept_options(command: argparse.ArgumentParser) -> None:
    """Add `--rays`, `--jobs` and `--kept`."""
    add_ray_options(command)
    words = "folder of `transfer build` that has the rays (default: the user's cache)"
    command.add_argument("--kept", type=Path, metavar="DIR", help=words)


def run(args: argparse.Namespace) -> int:
    """Trace, keep and print; 0."""
    from ...lighting.scene_file.files import load_scene, scene_file
    from ...lighting.transfer.ray_cache import build_rays
    from ...lighting.visibility.cache_limits import LIMIT_VARIABLE, most_bytes, transfer_folder
    from ...runtime.errors import InputError
    from ...runtime.shutdown import saying
    from ...runtime.worker_pool import usable_cores

    most = most_bytes() if args.out is None else None
    if most == 0:
        words = "a limit above 0, or a folder"
        raise InputError("nothing is kept", field=LIMIT_VARIABLE, found="0", expected=words, hint="name one by -o")
    scene = load_scene(scene_file(args.scene), catalogue_for(args.catalogue, 1), say)
    begun = time.monotonic()
    goes_on = "What is traced is kept; the same command goes on from there."
    with saying(lambda: goes_on), progress_bar("Tracing") as progress:
        built = build_rays(
            scene,
            args.out or transfer_folder(),
            args.rays,
            args.jobs or usable_cores(),
            progress,
            say=say,
            most=most,
            scheduler=args.scheduler,
        )
    for note in scene.notes:
        print(note)
    blocks = counted(len(built.files), "block")
    there = f", {built.there} of which were there" if built.there else ""
    print(
        f"{scene.name}: {built.sites:,} vertices of {built.rays} rays, {built.nbytes / 1e6:.1f} MB in {blocks}{there}; "
        f"{time.monotonic() - begun:.1f} s"
    )
    print(built.files[0].parent)
    return 0
