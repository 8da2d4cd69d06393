"""Size of a form in a catalogue's file, bytes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...materials.records.hdf5_tree import form_node, write_tree


def stored_bytes(kept: Mapping[str, Any]) -> int:
    """Sum the bytes of all data sets of a form in HDF5, compressed as they are there, not of the file's bookkeeping."""
    import h5py

    total = 0

    def add(name: str, found: object) -> None:
        nonlocal total
        if isinstance(found, h5py.Dataset):
            total += found.id.get_storage_size()

    with h5py.File("in memory", "w", driver="core", backing_store=False) as file:
        write_tree(file, form_node(kept))
        file.flush()
        file.visititems(add)
    return total
