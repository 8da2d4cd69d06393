"""The [[light]] tables of scene files: which kinds of light there are, their keys, and the light that a table says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.observers import Observer
from ...spectral.spectrum import Spectrum
from ..environment import booth, map_light
from ..environment.softbox import SoftboxLight
from ..lights import DirectionalLight, Light, PointLight
from .keys import EXPECTED, LIGHT, errors_at, taken
from .lamps import lamp


@dataclass(frozen=True)
class LightKind:
    """Kind of light as scene files write it.

    Parameters
    ----------
    make : gives the light; its parameters are called as the keys.
    keys : its own, with the kind of their values (`keys`).
    required : those of them that must be there.
    defaults : what stands for some that need not.
    spectrum : the lamp of a table that names none; None leaves it to `make`.
    """

    make: Callable[..., Light]
    keys: Mapping[str, str]
    required: tuple[str, ...] = ()
    defaults: Mapping[str, Any] = field(default_factory=dict)
    spectrum: str | None = "D65"


#: Every kind of light by the name that scene files give it.
LIGHTS: dict[str, LightKind] = {
    **{
        light.KIND: LightKind(light, light.KEYS, light.REQUIRED, light.DEFAULTS)
        for light in (DirectionalLight, PointLight, SoftboxLight)
    },
    "environment": LightKind(map_light.load_environment, map_light.KEYS, ("map",), spectrum=None),
    "booth": LightKind(booth.light_booth, booth.KEYS, spectrum=None),
}


def read_light(
    table: dict,
    where: str,
    number: int,
    path: Path,
    seen_by: Observer,
    catalogue: Any = None,
    say: Callable[[str], None] | None = None,
) -> tuple[Light, tuple[str, ...]]:
    """One light, usable by this observer, and what was assumed of it.

    Parameters
    ----------
    table, where, number : the [[light]] of a scene file, what messages call it, and its number from 1.
    path : the scene file; other files are looked up relative to it.
    catalogue, say : as of `load_scene`.

    Raises
    ------
    InputError, UnknownNameError : with the file, the key, and the nearest names there are.
    """
    kind_name = table.get("kind", "point" if "position" in table else "directional")
    if kind_name not in LIGHTS:
        raise UnknownNameError("kind of light", str(kind_name), LIGHTS, file=path, field=f"{where}.kind")
    kind = LIGHTS[kind_name]
    got = taken(table, LIGHT | dict(kind.keys), path, where)
    named = got.get("spectrum", kind.spectrum)
    spectrum, called, notes = _lamp(got, named, where, path, catalogue)
    own = {key: _value(got[key], kind.keys[key], path) for key in kind.keys if key in got}
    if kind.make is map_light.load_environment:
        own["say"] = say
    with errors_at(path, where):
        for key in kind.required:
            if key not in got:
                raise InputError(f"a {kind_name} light needs this key", field=key, expected=EXPECTED[kind.keys[key]])
        common = {"name": got.get("name", f"light {number}"), "spectrum": spectrum, "spectrum_name": called}
        light = kind.make(**{**kind.defaults, **own, **common})
    for one in light.spectra:
        if not (one.samples > 0.0).any():
            field = f"{where}.spectrum"
            raise InputError("a light of no power", file=path, field=field, found=named, expected="some power")
        try:
            seen_by.white(one)
        except InputError as error:
            raise error.at(file=path, field=f"{where}.spectrum") from error
    return light, tuple(f"{where}: {note}" for note in (*notes, *light.notes))


def _lamp(
    got: Mapping[str, Any], named: str | None, where: str, path: Path, catalogue: Any
) -> tuple[Spectrum | None, str, tuple[str, ...]]:
    """Return the spectrum that a table names, what it is called, and what was assumed of it; None where it names
    none."""
    if "entry" in got and "spectrum_column" in got:
        field = f"{where}.spectrum_column"
        raise InputError("entry and spectrum_column say the same", file=path, field=field, expected="one of the two")
    key = "spectrum_column" if "spectrum_column" in got else "entry"
    if named is None:
        if key in got:
            problem = "only a file has columns or entries to choose from"
            expected = "a file of spectra, named by `spectrum`"
            raise InputError(problem, file=path, field=f"{where}.{key}", found=got[key], expected=expected)
        return None, "", ()
    try:
        return lamp(named, got.get(key), path.parent, catalogue)
    except InputError as error:
        field = f"{where}.{key if error.field == 'entry' else 'spectrum'}"
        if error.file is not None:
            raise error.at(named_in=f"{path}, {field}") from error
        raise error.at(file=path, field=field) from error


def _value(value: Any, kind: str, path: Path) -> Any:
    """Make a file's name its path, from the folder of the scene file."""
    return path.parent / value if kind == "file" else value
