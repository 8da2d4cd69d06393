"""The one door to colour-science: a second of import that the start-up path must not pay."""

from __future__ import annotations

import warnings
import zipfile
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from ..runtime.disk_cache import cache_folder
from ..runtime.errors import InputError
from ..runtime.files import made_folder, written_whole

#: Wavelengths (L,) in nm, and values (L,) or (L,3).
ColourTable = tuple[Float[np.ndarray, " L"], Float[np.ndarray, "L *_"]]


@cache
def colour_science() -> Any:
    """Return the `colour` module. Its notices about optional packages say nothing about Metamer and are kept quiet, and
    the way it makes numpy print numbers does not reach the rest of the process.
    """
    with warnings.catch_warnings(), np.printoptions():
        warnings.simplefilter("ignore")
        import colour
    return colour


@cache
def colour_tables(group: Literal["MSDS_CMFS", "SDS_ILLUMINANTS", "SDS_LIGHT_SOURCES"]) -> dict[str, ColourTable]:
    """Tables of colour-science by name, in its order; nobody writes to them.

    They are kept from run to run in the user's cache, by the library's version: most commands need nothing else of it.
    """
    kept = cache_folder("colour") / f"{group}-{version('colour-science')}.npz"
    with suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return _read(kept)
    found = {
        name: (np.array(table.wavelengths, dtype=np.float64), np.array(table.values, dtype=np.float64))
        for name, table in getattr(colour_science(), group).items()
    }
    with suppress(InputError, OSError):
        made_folder(kept.parent)
        with written_whole(kept) as beside, beside.open("wb") as file:
            nm, values = (np.concatenate(each) for each in zip(*found.values(), strict=True))
            np.savez(file, names=[*found], lengths=[len(nm) for nm, _ in found.values()], nm=nm, values=values)
    return found


def _read(path: Path) -> dict[str, ColourTable]:
    """Tables of a file; it is of the zip format, which tells damage."""
    with path.open("rb") as file, np.load(file, allow_pickle=False) as held:
        ends = np.cumsum(held["lengths"])[:-1]
        nm, values = (np.split(held[name], ends) for name in ("nm", "values"))
        return dict(zip(held["names"].tolist(), zip(nm, values, strict=True), strict=True))
