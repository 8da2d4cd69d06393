"""A catalogue: a folder of material files (`record.py`), found by id."""

from __future__ import annotations

import fnmatch
import os
from dataclasses import dataclass
from pathlib import Path

from ..spectral.errors import InputError, UnknownNameError
from .importing import ImportOutcome, ImportReport, import_sources
from .record import MARKER, SUFFIX, MaterialRecord, Provenance, read_record, write_record

__all__ = [
    "Catalogue",
    "ImportOutcome",
    "ImportReport",
    "MaterialRecord",
    "Provenance",
    "default_catalogue",
    "import_sources",
    "write_record",
]


def default_catalogue() -> Path:
    """`$METAMER_CATALOGUE`, or `metamer-catalogue` in the current folder."""
    return Path(os.environ.get("METAMER_CATALOGUE") or "metamer-catalogue")


@dataclass(frozen=True)
class Catalogue:
    """A folder of materials; "family/name" lies in FOLDER/family/name.h5. Make one with `open`."""

    folder: Path

    @classmethod
    def open(cls, folder: str | Path) -> Catalogue:
        """The catalogue in `folder`; raises `InputError` where there is none."""
        folder = Path(folder)
        hint = f"metamer catalogue import --into {folder}"
        if not folder.exists():
            raise InputError("no such catalogue", file=folder, hint=hint)
        if not (folder / MARKER).is_file():
            expected = f"a folder that holds {MARKER}"
            raise InputError("not a catalogue", file=folder, expected=expected, hint=hint)
        return cls(folder)

    def ids(self) -> tuple[str, ...]:
        """Every material's id, sorted; files are not opened."""
        files = self.folder.rglob(f"[!.]*{SUFFIX}")
        return tuple(sorted(file.relative_to(self.folder).with_suffix("").as_posix() for file in files))

    def match(self, pattern: str) -> tuple[str, ...]:
        """Ids that fit a pattern such as "colorchecker/*-gloss"; raises `UnknownNameError` where none does."""
        known = self.ids()
        found = tuple(fnmatch.filter(known, pattern))
        if not found:
            raise UnknownNameError("material", pattern, known, file=self.folder)
        return found

    def path(self, material_id: str) -> Path:
        """The file of a material; raises `UnknownNameError`, which gives the nearest ids."""
        known = self.ids()
        if material_id not in known:
            raise UnknownNameError("material", material_id, known, file=self.folder)
        return self.folder / f"{material_id}{SUFFIX}"

    def load(self, material_id: str) -> MaterialRecord:
        """The record of a material, its checksum verified; raises `InputError` naming a file that is damaged."""
        path = self.path(material_id)
        record = read_record(path)
        if record.id != material_id:
            hint = "material files are renamed by importing them again"
            raise InputError("file holds another material", file=path, field="id", found=record.id, hint=hint)
        return record

    def verify(self) -> dict[str, InputError | None]:
        """Every id with what is wrong with its file, or None."""
        found: dict[str, InputError | None] = {}
        for material_id in self.ids():
            try:
                self.load(material_id)
                found[material_id] = None
            except InputError as reason:
                found[material_id] = reason
        return found
