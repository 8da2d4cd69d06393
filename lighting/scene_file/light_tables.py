"""[[light]] tables of scene files: kinds of light, their keys, and their construction."""

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
    """Kind of light in scene files.

    Parameters
    ----------
    make : constructor; its parameters have the names of the keys.
    keys : own keys, with the kind of their values (`keys`).
    required : required keys among these.
    defaults : of optional keys.
    spectrum : default lamp; None leaves it to `make`.
    """

    make: Callable[..., Light]
    keys: Mapping[str, str]
    required: tuple[str, ...] = ()
    defaults: Mapping[str, Any] = field(default_factory=dict)
    spectrum: str | None = "D65"


#: Kinds of light by name in scene files.
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
    """Build one light, checked for an observer; return it and notes on assumptions.

    Parameters
    ----------
    table, where, number : the [[light]] table, its name in messages, and its number from 1.
    path : of the scene file; other files are relative to it.
    catalogue, say : see `load_scene`.

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
    """Return the spectrum named in a table, its name, and notes on assumptions; None if it names none."""
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
    """Resolve a file name relative to the folder of the scene file."""
    return path.parent / value if kind == "file" else value
