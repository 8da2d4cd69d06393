"""Hashes of the code that a fit depends on: when one changes, materials are fitted again.

The modules are found by the imports in their sources, also inside functions: so the hash is the same in every process,
independent of loaded modules, and on every machine with the same code.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from ...runtime.code_hash import files_hash, release, syntax_hash
from ...runtime.errors import InputError
from ..records.models import MEASURED, SPECTRA

_ROOT = Path(__file__).parents[2]
# Modules that make records: the fit, and the colour in the head of a file.
_FIT, _COLOUR = "materials/intake/work", "materials/records/record_colour"
# Module that names all models; a fit needs only its own. Readers do not count: data that was read has its own hash.
_ALL_MODELS = "materials/analytic/__init__"
# Libraries that compute, and the parts of their versions that count: releases of one series of most only mend faults;
# colour-science holds tables.
_LIBRARIES = (("numpy", 2), ("scipy", 2), ("tensorly", 2), ("colour-science", None))
# Module that decodes pictures, in fits that do so themselves, and its libraries.
_PICTURES, _DECODERS = "materials/svbrdf/textures", (("pillow", 2), ("OpenEXR", 2))
_READERS_USE = ("numpy", "scipy", "colour-science", "defusedxml", "h5py", "OpenEXR", "pillow")
# Parsing all sources would take ten times as long. A test holds this to the parser.
_IMPORT = re.compile(rb"^[ \t]*from[ \t]+(\.*)([\w.]*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)", re.MULTILINE)
_FOR_TYPES = re.compile(rb"^if TYPE_CHECKING:\n(?:[ \t]+.*\n|[ \t]*\n)*", re.MULTILINE)
_COMMENT = re.compile(rb"#[^\n]*")


@cache
def code_hash(model: str, root: Path = _ROOT) -> str:
    """Compute the SHA-256 of the code and the libraries that the record of a material of a model depends on.

    root : the folder that holds the packages.
    """
    modules = modules_of(model, root)
    libraries = (*_LIBRARIES, *(_DECODERS if _PICTURES in modules else ()))
    code = syntax_hash({module: _source(root, module) or b"" for module in modules})
    return hashlib.sha256("|".join([code, *(release(*row) for row in libraries)]).encode()).hexdigest()


@cache
def readers_hash(root: Path = _ROOT) -> str:
    """Compute the SHA-256 of code and libraries that reading a file may use; "" if sources cannot be listed."""
    files = sorted(file for package in ("materials", "spectral", "runtime") for file in (root / package).rglob("*.py"))
    if not files:
        return ""
    return hashlib.sha256(f"{sys.version}|{files_hash(root, files, _READERS_USE)}".encode()).hexdigest()


@cache
def modules_of(model: str, root: Path = _ROOT) -> tuple[str, ...]:
    """Return the modules, as "materials/fitting/fit", that a fit of that model can reach by imports, sorted."""
    own = MEASURED[model].module.replace(".", "/") if model in MEASURED else f"analytic/{model}"
    # A spectrum without a surface is fitted by nothing.
    roots = (_COLOUR,) if model in SPECTRA else (_FIT, _COLOUR, f"materials/{own}")
    return tuple(sorted(frozenset[str]().union(*(imported_by(name, root) for name in roots))))


@cache
def imported_by(module: str, root: Path = _ROOT) -> frozenset[str]:
    """Return the modules that `module` ("materials/fitting/fit") imports, directly or not, and itself.

    Raises
    ------
    InputError
        The module has no source: metamer was installed without its sources.
    """
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in found or name == _ALL_MODELS or (text := _source(root, name)) is None:
            continue
        found.add(name)
        waiting += imports_in(name, text)
    if not found:
        hint = "install metamer with its sources, as pip does"
        raise InputError("code without its source", file=root / module, expected="a .py file", hint=hint)
    return frozenset(found)


def imports_in(module: str, text: bytes) -> Iterator[str]:
    """Yield the possible names of modules of the packages beside it that a source imports; not all need be modules."""
    for dots, place, names in _IMPORT.findall(_FOR_TYPES.sub(b"", text)):
        if not dots:
            continue
        folder = module.split("/")[: -len(dots)]
        base = "/".join([*folder, *place.decode().split(".")] if place else folder)
        words = _COMMENT.sub(b"", names).strip(b"() \t").replace(b"\n", b" ").split(b",")
        # A name stands for a module, or for something in one; where that is a package, in its own file.
        yield base
        yield f"{base}/__init__"
        yield from (f"{base}/{word.split()[0].decode()}" for word in words if word.strip())


@cache
def _source(root: Path, module: str) -> bytes | None:
    """Return the source of a module, also from a packed installation; None if there is none."""
    try:
        return __loader__.get_data(str(root / f"{module}.py"))
    except OSError:
        return None
