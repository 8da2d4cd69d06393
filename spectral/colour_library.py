"""Access to colour-science, deferred: its import takes a second that start-up must not pay."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from operator import attrgetter
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from ..runtime.disk_cache import cache_folder
from ..runtime.kept_arrays import kept

#: Wavelengths (L,) in nm, and values (L,) or (L,3).
ColourTable = tuple[Float[np.ndarray, " L"], Float[np.ndarray, "L *_"]]


@cache
def colour_science() -> Any:
    """Return the `colour` module.

    Its notices about optional packages are silenced, as irrelevant to Metamer, and its print options of numpy are kept
    from the rest of the process.
    """
    with warnings.catch_warnings(), np.printoptions():
        warnings.simplefilter("ignore")
        import colour
    return colour


#: Groups of tables, or single ones, as colour-science calls them.
Group = Literal[
    "MSDS_CAMERA_SENSITIVITIES", "MSDS_CMFS", "SDS_COLOURCHECKERS", "SDS_ILLUMINANTS", "SDS_LEFS", "SDS_LIGHT_SOURCES",
    "recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019",
]  # fmt: skip


@cache
def colour_tables(group: Group) -> dict[str, ColourTable]:
    """Return tables of colour-science by name, in its order, patches of charts as "PATCH of CHART"; read-only.

    They are cached in the user's cache directory by the library's version, and suffice for most commands.
    """
    file = cache_folder("colour") / f"{group}-{version('colour-science')}.npz"
    held = kept(file, lambda: _packed(_named(attrgetter(group)(colour_science()), group)))
    ends = np.cumsum(held["lengths"])[:-1]
    nm, values = (np.split(held[name], ends) for name in ("nm", "values"))
    return dict(zip(held["names"].tolist(), zip(nm, values, strict=True), strict=True))


def _named(tables: Any, group: str) -> dict[str, Any]:
    """Return tables by name, those of a mapping within by both names, and a single one by that of the group."""
    if not isinstance(tables, Mapping):
        return {group: tables}
    found: dict[str, Any] = {}
    for name, table in tables.items():
        within = isinstance(table, Mapping)
        found |= {f"{one} of {name}": each for one, each in table.items()} if within else {name: table}
    return found


def _packed(tables: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Concatenate tables, since a file of hundreds of arrays is read slowly."""
    nm, values = (
        [np.array(getattr(table, name), dtype=np.float64) for table in tables.values()]
        for name in ("wavelengths", "values")
    )
    return {
        "names": np.array([*tables]),
        "lengths": np.array([len(each) for each in nm]),
        "nm": np.concatenate(nm),
        "values": np.concatenate(values),
    }
