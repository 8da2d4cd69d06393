"""`metamer transfer relight`: other materials, other light, and the resulting colour of every part."""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...runtime.errors import UsageError
from ...runtime.wording import counted
from ..options import (
    add_catalogue_option,
    add_json_option,
    add_output_option,
    add_renderer_option,
    catalogue_for,
    positive_count,
    renderer_for,
)
from ..output import figures_file, say, warn, write_json
from ..progress.lines import progress_bar
from .build import add_kept_options
from .changes import add_change_options, by_part, given_materials, relit_lights
from .wishes import Changes, add_wish_options, check_wishes, with_wishes, write_steps

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...calibration.report.statistics import DeltaEStatistics
    from ...lighting.camera import Camera
    from ...lighting.scene import Scene
    from ...viewer.sheets.relight_compare import Relit

# Seconds that a picture which should be quick has before it says how far it is.
_LATE_S = 2.0
# Rays that were traced are read in this share of the time.
_READ = 0.05
_TURNING = "turning"


def add_parser(kinds: argparse._SubParsersAction) -> None:
    """Add `transfer relight`."""
    relight = kinds.add_parser(
        "relight",
        help="change materials or light, and see what that does to every part",
        description="Draw a scene with bounces before and after a change of materials or light, and say by ΔE94 what "
        "that did to each part: all in all, by light straight from lamps, and by light by way of other surfaces. The "
        "rays between surfaces are those of `transfer build`; what is not there is traced once, and kept.",
    )
    relight.add_argument("scene", type=Path, metavar="SCENE", help="scene.toml")
    add_change_options(relight)
    add_wish_options(relight)
    relight.add_argument("--camera", metavar="NAME", help="default: the scene's first")
    add_output_option(relight, "default: relit", metavar="DIR", default=Path("relit"))
    relight.add_argument("--spectral", action="store_true", help="also a spectral EXR of what is after")
    relight.add_argument(
        "--turntable",
        type=positive_count,
        metavar="N",
        help="also N pictures of what is after, from all around, and one that moves (WebP)",
    )
    add_json_option(relight)
    add_kept_options(relight)
    add_catalogue_option(relight)
    add_renderer_option(relight)
    relight.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Draw, compare, write and print; 0."""
    from ...lighting.scene_file.files import load_scene, scene_file
    from ...lighting.transfer.indirect import LEAST_RAYS, needs_none
    from ...lighting.transfer.ray_cache import build_rays
    from ...lighting.visibility.cache_limits import most_bytes, transfer_folder
    from ...runtime.files import check_writable, made_folder
    from ...runtime.worker_pool import usable_cores
    from ...viewer.picture import bounces_notes, lit_by, render_spectral
    from ...viewer.sheets.relight_compare import dressed, relit
    from ...viewer.sheets.turntable import turntable, write_animated

    if not (args.material or args.like or args.set or args.light) and args.illuminant is None:
        raise UsageError("nothing is changed: add --material PART=MATERIAL, --like, --set, --light or --illuminant")
    check_wishes(args)
    if len(dict(args.material)) < len(args.material):
        raise UsageError("--material: a part is given two materials, leave one out")
    if args.rays < LEAST_RAYS:
        raise UsageError(f"--rays: a picture needs {LEAST_RAYS} or more of each vertex, not {args.rays}")
    scene_file(args.scene)
    for path in figures_file(args.json):
        check_writable(path)
    catalogue = catalogue_for(args.catalogue, 1)
    before = load_scene(args.scene, catalogue, say)
    before = replace(before, bounces=before.bounces or "auto")
    before.camera(args.camera)
    worn = by_part("--material", before, args.material)
    lit = relit_lights(lit_by(before, args.illuminant), args.light, catalogue)
    for part in worn:
        before.check_changes(part)
    for name in before.material_ids:
        catalogue.surface(name)
    jobs = args.jobs or usable_cores()
    catalogue, ids, notes_of_files = given_materials(catalogue, worn.values())
    dressed_so = dressed(lit, {part: ids[word] for part, word in worn.items()})
    changes = with_wishes(dressed_so, catalogue, args, jobs)
    changes.notes[:0] = notes_of_files
    after, catalogue = changes.scene, changes.catalogue
    out = made_folder(args.out)
    folder, most = args.kept or transfer_folder(), most_bytes()
    built, traces = None, bool(most) and not needs_none(before)
    stages = _stages(before, before.camera(args.camera), traces, args.spectral, args.turntable or 0)
    with renderer_for(args.renderer) as renderer, progress_bar("Relighting", after=_LATE_S, stages=stages) as progress:
        begun = time.monotonic()
        if traces:
            built = build_rays(before, folder, args.rays, jobs, progress, say=say, most=most)
        tracing = time.monotonic() - begun
        renderer.configure(rays_folder=folder, rays=args.rays, jobs=jobs, on_message=say, on_progress=progress)
        found = relit(before, after, catalogue, renderer, args.camera, warn)
        notes = [*bounces_notes(after, renderer)]
        files = [out / f"{name}{kind}" for name in ("before", "after") for kind in (".png", ".exr")]
        for file in files:
            made = found.before if file.stem == "before" else found.after
            notes += [f"{file.name}: {note}" for note in made.write(file, warn, renderer)]
        if args.spectral:
            files.append(out / "after.spectral.exr")
            notes += render_spectral(after, catalogue, files[-1], args.camera, renderer, warn)
        if changes.part is not None:
            files += write_steps(changes, found.after, catalogue, out, renderer, args.camera, warn)
        if args.turntable:
            # Pictures are counted, not the renderer's own work on each.
            renderer.configure(on_progress=None)
            frames = []
            for made in turntable(after, catalogue, args.camera, renderer, args.turntable):
                frames.append(out / f"turn-{len(frames):03d}.png")
                made.write(frames[-1], warn, renderer)
                progress(len(frames), args.turntable, _TURNING)
            files += [*frames, out / "turntable.webp"]
            write_animated(files[-1], frames)
    for note in (*after.notes, *changes.notes, *notes):
        print(note)
    if built is not None:
        there = f"{built.there} of {counted(len(built.files), 'block')} of rays were there"
        print(f"rays: {built.sites:,} vertices of {built.rays} rays, {there}; {tracing:.1f} s")
    print(f"pictures: before {found.seconds_before:.2f} s, after {found.seconds_after:.2f} s")
    print(_table(found))
    for file in files:
        print(file)
    if args.json is not None:
        seconds = {"rays": tracing, "before": found.seconds_before, "after": found.seconds_after}
        write_json(args.json, _figures(after, found, seconds, changes))
        for path in figures_file(args.json):
            print(path)
    return 0


def _stages(before: Scene, view: Camera, traces: bool, spectral: bool, turns: int) -> Iterator[tuple[str, float]]:
    """Yield the stages of the work with their expected costs.

    Rays, both states without indirect light and with it, and further outputs.
    """
    from ...viewer.render.picture_cost import picture_cost
    from ...viewer.render.scene_layers import BOUNCES, DRAWING, INTERREFLECTION, VISIBILITY

    stages = picture_cost(before, view).stages
    of = dict(stages)
    if traces:
        yield INTERREFLECTION, of.get(INTERREFLECTION, 0.0)
    yield from (stage for stage in stages if stage[0] == VISIBILITY)
    yield from 2 * [(DRAWING, of[DRAWING])]
    if BOUNCES in of:
        # Paths that were traced before are only read.
        yield INTERREFLECTION, of[INTERREFLECTION] * (_READ if traces else 1.0)
    for _ in ("before", "after"):
        if BOUNCES in of:
            yield BOUNCES, of[BOUNCES]
        yield DRAWING, of[DRAWING]
    if spectral:
        yield DRAWING, dict(picture_cost(before, view, "spectra").stages)[DRAWING]
    if turns:
        yield _TURNING, turns * of[DRAWING]


def _table(found: Relit) -> str:
    from ...calibration.report.text_tables import columns

    def numbers(shown: DeltaEStatistics | None) -> list[str]:
        return ["-", "-"] if shown is None else [f"{shown.mean:.2f}", f"{shown.p95:.2f}"]

    rows = [
        [one.part, one.after, *(word for shown in (one.all, one.directly, one.by_others) for word in numbers(shown))]
        for one in found.parts
    ]
    head = ["part", "material", "ΔE94 mean", "p95", "directly", "p95", "by others", "p95"]
    return "\n".join(["", "what the change did, directly and by way of other parts", columns(head, rows, left=2)])


def _figures(after: Scene, found: Relit, seconds: dict[str, float], changes: Changes) -> dict[str, Any]:
    """Collect the figures of `--json`."""
    return {
        "scene": after.name,
        "camera": found.after.view.name,
        "bounces": {"before": found.bounces_before, "after": found.bounces_after},
        "seconds": seconds,
        "changes": changes.notes,
        "steps": [one.id for one in changes.materials],
        "parts": [
            {
                "part": one.part,
                "before": one.before,
                "after": one.after,
                "delta_e94": {
                    name: None if shown is None else asdict(shown)
                    for name, shown in (("all", one.all), ("directly", one.directly), ("by_others", one.by_others))
                },
            }
            for one in found.parts
        ],
    }
