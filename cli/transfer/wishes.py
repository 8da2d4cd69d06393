"""Changes of `metamer transfer relight` without a material's name: neighbours by wish, parameters, and steps."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...runtime.errors import InputError, UsageError
from ..options import amounts
from ..progress.lines import progress_bar
from .changes import by_part

if TYPE_CHECKING:
    from ...lighting.scene import Scene
    from ...materials.catalogue.catalogue import Catalogue
    from ...materials.catalogue.material import Material
    from ...materials.search.neighbours import Neighbours
    from ...viewer.picture import Picture, Warn
    from ...viewer.render.session import RenderSession

_TO = ".."


def add_wish_options(command: argparse.ArgumentParser) -> None:
    """Add `--like`, `--set` and `--steps`."""
    command.add_argument(
        "--like",
        action="append",
        default=[],
        type=_wish_of_part,
        metavar="PART=WORD:N,...",
        help="the neighbour in the catalogue that is nearest to the wish, such as seat=warmer:10,glossier:1; PART may "
        "be a pattern",
    )
    command.add_argument(
        "--set",
        action="append",
        default=[],
        type=_value_of_part,
        metavar="PART.NAME=X",
        help="a parameter of the part's material, such as trim.roughness=0.3; with --steps a range, such as 0.1..0.5; "
        "PART may be a pattern",
    )
    command.add_argument(
        "--steps",
        type=_steps,
        metavar="N",
        help="also N pictures along the range of --set, or of the N nearest neighbours of --like, and all in a row",
    )


def _wish_of_part(text: str) -> tuple[str, dict[str, float]]:
    part, equals, wish = text.partition("=")
    if not (part and equals and wish):
        raise argparse.ArgumentTypeError(f"{text!r} is not PART=WORD:N, such as seat=warmer:10")
    return part, amounts(wish, ":")


def _value_of_part(text: str) -> tuple[str, str, tuple[float, ...]]:
    place, equals, value = text.partition("=")
    part, dot, name = place.rpartition(".")
    if not (part and dot and name and equals and value):
        raise argparse.ArgumentTypeError(f"{text!r} is not PART.NAME=X, such as trim.roughness=0.3")
    try:
        ends = tuple(float(end) for end in value.split(_TO))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{place}: a number or FROM{_TO}TO, not {value}") from None
    if len(ends) > 2:
        raise argparse.ArgumentTypeError(f"{place}: one range, FROM{_TO}TO, not {value}")
    return part, name, ends


def _steps(text: str) -> int:
    if not (text.isdecimal() and int(text) >= 2):
        raise argparse.ArgumentTypeError(f"a whole number from 2 on, not {text}")
    return int(text)


@dataclass(eq=False)
class Changes:
    """Changes of the options: the scene, a catalogue with its materials, and notes.

    part, materials : of the steps; None without steps. varied : ids of refitted materials, by material and values:
    parts of one material share it.
    """

    scene: Scene
    catalogue: Catalogue
    notes: list[str] = field(default_factory=list)
    part: str | None = None
    materials: tuple[Material, ...] = ()
    varied: dict[tuple[str, Any], str] = field(default_factory=dict)


def check_wishes(args: argparse.Namespace) -> None:
    """Raise `UsageError` for contradictory options, without reading a file."""
    liked = [part for part, _ in args.like]
    ranges = {part for part, _, ends in args.set if len(ends) == 2}
    if len(set(liked)) < len(liked):
        raise UsageError("--like: a part is given two wishes, leave one out")
    if both := set(liked) & {part for part, _, _ in args.set}:
        raise UsageError(f"{min(both)}: --like looks for another material, --set changes this one: leave one out")
    if len({place[:2] for place in args.set}) < len(args.set):
        raise UsageError("--set: a parameter is given two values, leave one out")
    if ranges and args.steps is None:
        raise UsageError(f"--set: a range FROM{_TO}TO needs --steps N")
    if args.steps is not None and len(ranges | set(liked)) != 1:
        raise UsageError(f"--steps needs one part with a range, --set PART.NAME=FROM{_TO}TO, or with --like")


def with_wishes(scene: Scene, catalogue: Catalogue, args: argparse.Namespace, jobs: int) -> Changes:
    """Apply the options to the scene; `jobs`: processes for fits.

    Raises
    ------
    UnknownNameError : no such part, parameter or word. UsageError : contradictory options for a part.
    InputError : no neighbour is nearer to a wish than the material itself, a value out of its domain, a static part,
        errors of `like` and `varied`.
    """
    found = Changes(scene, catalogue)
    liked = by_part("--like", scene, args.like)
    names = dict.fromkeys(name for _, name, _ in args.set)
    varied: dict[str, dict[str, tuple[float, ...]]] = {}
    for name in names:
        for part, ends in by_part("--set", scene, [(p, ends) for p, n, ends in args.set if n == name]).items():
            varied.setdefault(part, {})[name] = ends
    if both := set(liked) & set(varied):
        raise UsageError(f"{min(both)}: --like looks for another material, --set changes this one: leave one out")
    stepping = [*liked, *(part for part, values in varied.items() if any(len(ends) == 2 for ends in values.values()))]
    if args.steps is not None and len(stepping) > 1:
        raise UsageError(f"--steps needs one part, not {', '.join(stepping)}")
    for part, wish in liked.items():
        _find(found, part, wish, args.steps)
    for part, values in varied.items():
        _vary(found, part, values, args.steps, jobs)
    return found


def _find(changes: Changes, part: str, wish: dict[str, float], steps: int | None) -> None:
    from ...materials.search.neighbours import like

    catalogue = changes.catalogue
    found = like(catalogue, changes.scene.part(part).material, wish, steps or 1)
    if not found.found:
        expected, hint = f"{_words(wish)}, or a part of it", "wish for less, or import more materials"
        problem = "no other material is nearer to the wish than it is itself"
        raise InputError(f"--like {part}: {problem}", found=found.of.id, expected=expected, hint=hint)
    changes.notes.append(_chosen(part, found))
    changes.notes += [f"not looked at: {reason}" for reason in found.unusable]
    changes.scene = changes.scene.with_material(part, found.found[0].summary.id)
    if steps is not None:
        changes.part = part
        changes.materials = tuple(catalogue.surface(one.summary.id) for one in found.found)


def _chosen(part: str, found: Neighbours) -> str:
    first = found.found[0]
    got = ", ".join(f"{word} {value:+.1f}" for word, value in found.wish.got(first.look).items())
    besides = [f"{word} {value:.1f}" for word, value in found.wish.besides(first.look).items() if value >= 0.05]
    also = f"; besides {', '.join(besides)}" if besides else ""
    return (
        f"{part}: like {found.of.id}, but {_words(found.wish.amounts)}: {first.summary.id} "
        f"(off by {first.distance:.1f}; {got}{also})"
    )


def _words(wish: Any) -> str:
    return ", ".join(f"{word} {amount:g}" for word, amount in wish.items())


def _vary(changes: Changes, part: str, values: dict[str, tuple[float, ...]], steps: int | None, jobs: int) -> None:
    from ...materials.search.edited_material import VariedCatalogue, varied, varied_along
    from ...materials.search.sliders import changed

    material = changes.catalogue.surface(changes.scene.part(part).material)
    last = {name: ends[-1] for name, ends in values.items()}
    known = changes.varied.get((material.id, tuple(last.items()))) if steps is None else None
    if known is not None:
        changes.scene = changes.scene.with_material(part, known)
        return
    # Refusals come before any fit.
    changed(material.surface(), last, material.id)
    ranged = steps is not None and any(len(ends) == 2 for ends in values.values())
    with progress_bar("Fitting", after=2.0) as progress:
        if ranged and steps is not None:
            each: list[Material] = []
            ranges = {name: (ends[0], ends[-1]) for name, ends in values.items()}
            for one in varied_along(material, ranges, steps, jobs=min(jobs, steps)):
                each.append(one)
                progress(len(each), steps, one.id)
            changes.part, changes.materials = part, tuple(each)
            made = each[-1]
        else:
            made = varied(material, last)
    said = f"ΔE94 p99 {made.error.p99:.2f}" if made.error else "nobody measured how far off"
    changes.notes.append(f"{part}: {made.id}, fitted anew ({said})")
    changes.catalogue = VariedCatalogue.of(changes.catalogue, [made])
    changes.varied[material.id, tuple(last.items())] = made.id
    changes.scene = changes.scene.with_material(part, made.id)


def write_steps(
    changes: Changes,
    after: Picture,
    catalogue: Catalogue,
    out: Path,
    renderer: RenderSession,
    camera: str | None,
    warn: Warn,
) -> list[Path]:
    """Write the pictures of the steps, `step-000.png` and so on, and all in a row, `steps.png`; return the paths.

    after : picture drawn already, one of the steps.
    """
    from ...viewer.sheets.material_sweep import along, row_of
    from ...viewer.sheets.preview import write_sheet

    part = changes.part
    assert part is not None
    worn = after.scene.part(part).material
    files, shown, captions = [], [], []
    for material in changes.materials:
        drawn = (
            [(material, after)]
            if material.id == worn
            else along(after.scene, part, [material], catalogue, renderer, camera)
        )
        for one, made in drawn:
            files.append(out / f"step-{len(files):03d}.png")
            made.write(files[-1], warn, renderer)
            shown.append(made.rgb())
            captions.append(one.id.rpartition("/")[2].rpartition(" with ")[2])
    files.append(out / "steps.png")
    write_sheet(files[-1], row_of(shown, captions))
    return files
