"""Suite: the scenes to render and compare repeatedly, as a TOML file."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import existing_file, read_bytes, read_text
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from .criteria import Criteria, criteria_of, default_criteria

_KEYS = ("name", "scenes", "materials", "illuminants", "observers", "cameras", "budget")
_TOP = ("suite", "criteria", "regions", "rows")


@dataclass(frozen=True)
class Suite:
    """Scenes x materials x illuminants x observers x cameras, and their criteria.

    Parameters
    ----------
    scenes : files. materials, illuminants : of every scene; none means those of its own review.
    observers, cameras : names; none means the scene's own and its first.
    budget : limit of ΔE94 p99 of picture and reference.
    sha256 : of the content of the suite's files; other materials under the same names do not change it.
    """

    name: str
    scenes: tuple[Path, ...]
    materials: tuple[str, ...]
    illuminants: tuple[str, ...]
    observers: tuple[str | None, ...]
    cameras: tuple[str | None, ...]
    budget: float
    criteria: Criteria
    sha256: str

    @property
    def said(self) -> dict[str, str]:
        """Facts that a baseline stores."""
        return {"name": self.name, "sha256": self.sha256}


def read_suite(path: Path) -> Suite:
    """Return the suite of a file; a scene's file is a suite of itself.

    Raises
    ------
    InputError : no TOML, a key or name that is not known, a scene that is not there, no scene at all.
    """
    path = existing_file(path)
    try:
        document = tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as reason:
        raise InputError("the suite cannot be read", file=path, found=str(reason), expected="TOML") from None
    try:
        if "part" in document:
            return _of(path, {"suite": {"scenes": [path.name]}})
        return _of(path, document)
    except InputError as reason:
        raise (reason.at(file=path) if reason.file is None else reason) from None


def _of(path: Path, document: Mapping[str, Any]) -> Suite:
    for key in document:
        if key not in _TOP:
            raise UnknownNameError("table", key, _TOP)
    found = document.get("suite")
    if not isinstance(found, Mapping):
        raise InputError("no suite", field="suite", found=found, expected='[suite] with scenes = ["scene.toml"]')
    for key in found:
        if key not in _KEYS:
            raise UnknownNameError("key", key, _KEYS, field="suite")
    scenes = tuple(existing_file(path.parent / name) for name in _names(found, "scenes"))
    if not scenes:
        raise InputError("a suite of no scene", field="suite.scenes", found=found.get("scenes"), expected="files")
    lights, eyes = _names(found, "illuminants"), _names(found, "observers")
    for name in lights:
        illuminant(name)
    for name in eyes:
        observer(name)
    budget = found.get("budget", 1.0)
    if isinstance(budget, bool) or not isinstance(budget, int | float) or not 0 < budget < float("inf"):
        raise InputError(
            "the budget is not a colour difference", field="suite.budget", found=budget, expected="above 0"
        )
    name = found.get("name", path.stem)
    if not isinstance(name, str) or not name:
        raise InputError("not a name", field="suite.name", found=name, expected="a text")
    asked = {key: document[key] for key in _TOP[1:] if key in document}
    digest = hashlib.sha256(json.dumps(document, sort_keys=True, default=str).encode())
    for scene in scenes:
        digest.update(hashlib.sha256(read_bytes(scene, "a scene")).digest())
    return Suite(
        name,
        scenes,
        _names(found, "materials"),
        lights,
        eyes or (None,),
        _names(found, "cameras") or (None,),
        float(budget),
        criteria_of(asked) if asked else default_criteria(),
        digest.hexdigest(),
    )


def _names(found: Mapping[str, Any], key: str) -> tuple[str, ...]:
    names = found.get(key, [])
    if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
        raise InputError("not a list of names", field=f"suite.{key}", found=names, expected='such as ["D65", "A"]')
    return tuple(dict.fromkeys(names))
