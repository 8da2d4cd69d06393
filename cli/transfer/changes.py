"""Changes of `metamer transfer relight` by name: materials on parts, and lights one by one."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ...runtime.errors import InputError, UnknownNameError, UsageError
from ..options import add_illuminant_option
from ..progress.lines import progress_bar

if TYPE_CHECKING:
    from ...lighting.lights import Light
    from ...lighting.scene import Scene
    from ...materials.catalogue.catalogue import Catalogue
    from ...materials.catalogue.material import Material

Value = TypeVar("Value")
_OFF = "off"


def add_change_options(command: argparse.ArgumentParser) -> None:
    """Add `--material`, `--light` and `--illuminant`."""
    command.add_argument(
        "--material",
        action="append",
        default=[],
        type=_material_of_part,
        metavar="PART=MATERIAL",
        help="an id of the catalogue for a part, or a file of one material, which is fitted; PART may be a pattern, "
        "such as 'seat*'; may be given again",
    )
    command.add_argument(
        "--light",
        action="append",
        default=[],
        type=_change_of_light,
        metavar="LIGHT=LAMP",
        help="a light's spectrum, by what scene.toml names (FL11, a file, an emission of the catalogue), or off; "
        "LIGHT.KEY=X a number of it, such as lamp.intensity_cd=800 or sky.rotation_deg=90; may be given again",
    )
    add_illuminant_option(command, "in place of every light's own spectrum, before --light")


def _material_of_part(text: str) -> tuple[str, str]:
    part, equals, material = text.partition("=")
    if not (part and equals and material):
        raise argparse.ArgumentTypeError(f"{text!r} is not PART=MATERIAL")
    return part, material


def _change_of_light(text: str) -> tuple[str, str]:
    light, equals, value = text.partition("=")
    if not (light and equals and value):
        raise argparse.ArgumentTypeError(f"{text!r} is not LIGHT=LAMP or LIGHT.KEY=X")
    return light, value


def by_part(option: str, scene: Scene, given: Iterable[tuple[str, Value]]) -> dict[str, Value]:
    """Return the assignment of each part, by name or by pattern; names take precedence over patterns.

    Raises
    ------
    UnknownNameError : no part is called so. UsageError : two names, or two patterns, assign one part.
    """
    names = {part.name for part in scene.parts}
    found: dict[str, Value] = {}
    for named in (False, True):
        here: dict[str, Value] = {}
        for pattern, value in given:
            if (pattern in names) != named:
                continue
            for part in scene.parts_like(pattern):
                if part in here:
                    raise UsageError(f"{option}: {part} is given two, leave one out")
                here[part] = value
        found |= here
    return found


def given_materials(catalogue: Catalogue, words: Iterable[str]) -> tuple[Catalogue, dict[str, str], list[str]]:
    """Return a catalogue with materials of files too, the id of each word, and notes on those files.

    Raises
    ------
    InputError, UnknownNameError : neither an id of the catalogue nor a file; as of `material_from` and
        `Catalogue.surface`.
    """
    ids: dict[str, str] = {}
    made: list[Material] = []
    notes = []
    known = set(catalogue.ids())
    files = []
    # All names are looked at before anything is fitted.
    for word in dict.fromkeys(words):
        if word in known:
            catalogue.surface(word)
        elif Path(word).exists():
            files.append(word)
        else:
            raise _neither(catalogue, word)
        ids[word] = word
    if files:
        from ...materials.intake.single_file import material_from
        from ...materials.search.edited_material import VariedCatalogue

        with progress_bar("Fitting", after=2.0) as progress:
            for done, word in enumerate(files):
                progress(done, len(files), word)
                made.append(material_from(word))
                ids[word] = made[-1].id
                notes.append(f"{word}: {_fitted(made[-1])}")
        catalogue = VariedCatalogue.of(catalogue, made)
    return catalogue, ids, notes


def _fitted(material: Material) -> str:
    said = f"ΔE94 p99 {material.error.p99:.2f}" if material.error else "nobody measured how far off"
    return f"{material.model}, from its file ({said})"


def _neither(catalogue: Catalogue, word: str) -> InputError:
    if Path(word).suffix:
        hint = "paths start at the current folder; ids are those of `metamer catalogue list`"
        return InputError("--material: neither a file nor a material of the catalogue", found=word, hint=hint)
    return UnknownNameError("material", word, catalogue.ids(), file=catalogue.folder)


@dataclass(frozen=True)
class _Change:
    """Change of a light; None if it is switched off."""

    said: str
    made: Callable[[Light], Light | None]


def relit_lights(scene: Scene, given: Sequence[tuple[str, str]], catalogue: Catalogue) -> Scene:
    """Apply the changes of `--light` to the scene, in order, with notes.

    Raises
    ------
    UnknownNameError, InputError : no such light, number or lamp; a number out of its domain; no light is left.
    """
    notes = []
    for named, value in given:
        lights: list[Light] = []
        numbers, change = _change(scene, named, value, catalogue)
        for number, light in enumerate(scene.lights):
            made = change.made(light) if number in numbers else light
            if made is not None:
                lights.append(made)
            if number in numbers:
                notes.append(f"{light.name}: {change.said}; this overrides what is said of it above")
        if not lights:
            raise InputError("no light is left", field=f"--light {named}", found=value, expected="one at least")
        scene = replace(scene, lights=tuple(lights))
    return replace(scene, notes=(*scene.notes, *notes))


def _change(scene: Scene, named: str, value: str, catalogue: Catalogue) -> tuple[set[int], _Change]:
    """Return the numbers of the lights that change, and their change."""
    name, dot, key = named.rpartition(".")
    if scene.lights_like(named):
        return set(scene.lights_like(named)), _lamp(named, value, catalogue)
    numbers = scene.lights_like(name) if dot else ()
    if not numbers:
        names = dict.fromkeys(light.name for light in scene.lights)
        raise UnknownNameError("light", named, names, file=scene.path, field="--light")
    for number in numbers:
        known = _numbers(scene.lights[number])
        if key not in known:
            raise UnknownNameError("number of a light", key, known, field=f"--light {named}")
    try:
        changed: dict[str, Any] = {key: float(value)}
    except ValueError:
        raise InputError("not a number", field=f"--light {named}", found=value, expected="a finite number") from None

    def made(light: Light) -> Light:
        try:
            return replace(light, **changed)  # pyright: ignore[reportArgumentType]
        except InputError as error:
            raise error.at(field=f"--light {named}") from error

    return set(numbers), _Change(f"{key} {changed[key]:g}", made)


def _lamp(named: str, value: str, catalogue: Catalogue) -> _Change:
    from ...lighting.scene_file.lamps import lamp

    if value == _OFF:
        return _Change("put out", lambda light: None)
    try:
        spectrum, called, _ = lamp(value, None, Path(), catalogue)
    except InputError as error:
        raise error.at(field=f"--light {named}") from error
    return _Change(f"lit by {called}", lambda light: light.with_spectrum(spectrum, called))


def _numbers(light: Light) -> tuple[str, ...]:
    """Return keys of scene files that are numbers of this light."""
    from ...lighting.scene_file.light_tables import LIGHTS

    keys = {key for kind in LIGHTS.values() for key, what in kind.keys.items() if what == "number"}
    return tuple(one.name for one in fields(light) if one.name in keys)  # pyright: ignore[reportArgumentType]
