"""Which code a fit depends on, as a hash: when it changes, materials are fitted again."""

from __future__ import annotations

import ast
import hashlib
from functools import cache
from pathlib import Path

from ..records.models import MEASURED

_PACKAGE = Path(__file__).parents[1]
# What spectra are made up by, and what a re-radiation folds with, stands in another package: named one by one, since
# most changes there change no fit.
_ELSEWHERE = {
    "merl": ("spectral/upsampling",),
    "rgl": ("spectral/upsampling",),
    "fluorescent_lambert": ("spectral/bispectral",),
}


@cache
def code_hash(model: str) -> str:
    """SHA-256 of the source of the fit, of the model of that NAME, and of all in this package that the two import."""
    own = (MEASURED[model].module.replace(".", "/"),) if model in MEASURED else (f"analytic/{model}", "analytic/model")
    modules = sorted({name for root in ("fitting/fit", *own) for name in imported_by(root)})
    files = [_PACKAGE / f"{name}.py" for name in modules]
    files += [_PACKAGE.parent / f"{name}.py" for name in _ELSEWHERE.get(model, ())]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


@cache
def imported_by(module: str) -> frozenset[str]:
    """Modules of this package that `module` ("fitting/fit", "analytic/lambert") imports, directly or not, and itself;
    readers of files excepted."""
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        file = _PACKAGE / f"{name}.py"
        # A reader changes what is read, and that has a hash of its own.
        if name in found or name.startswith("formats/") or not file.is_file():
            continue
        found.add(name)
        here = file.parent
        for node in ast.walk(ast.parse(file.read_bytes())):
            if isinstance(node, ast.ImportFrom) and node.level:
                base = here.parents[node.level - 2] if node.level > 1 else here
                if not base.is_relative_to(_PACKAGE):
                    continue
                place = base.joinpath(*(node.module or "").split(".")) if node.module else base
                names = [place] if place.with_suffix(".py").is_file() else [place / each.name for each in node.names]
                waiting += [path.relative_to(_PACKAGE).as_posix() for path in names]
    return frozenset(found)
