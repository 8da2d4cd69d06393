"""A catalogue: a folder of material files (`record.py`), found by id."""

from __future__ import annotations

import fnmatch
import html
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import made_folder
from ...runtime.notebook import MOST_LINES, html_table
from ...runtime.remote import UnlistedError, is_remote, local_folder, open_anew, place
from ..records.material import MaterialRecord
from ..records.models import SPECTRA, no_surface
from ..records.query import Heads, Query, Summary, material_files, read_heads, summaries, summary
from ..records.record import MARKER, SUFFIX, check_id, check_marker, read_record, write_marker, write_record
from ..records.record_head import other_material
from .head_index import HeadIndex, index_of
from .material import Material

# Wildcards of a pattern.
_WILD = re.compile(r"[*?[]")

__all__ = ["Catalogue", "Query", "Summary", "default_catalogue"]


def default_catalogue() -> Path:
    """Return `$METAMER_CATALOGUE`, or `metamer-catalogue` in the current folder."""
    return place(os.environ.get("METAMER_CATALOGUE") or "metamer-catalogue")


@dataclass(frozen=True)
class Catalogue:
    """A folder of materials; "family/name" is FOLDER/family/name.h5. Make one with `open`.

    `catalogue["family/name"]` loads a material; iteration yields the ids.
    """

    folder: Path

    @classmethod
    def open(cls, folder: str | Path | None = None, *, create: bool = False) -> Catalogue:
        """Return the catalogue in `folder`, or `default_catalogue()`; raises `InputError` if there is none.

        create : make an empty catalogue of a missing or empty folder.
        """
        folder = default_catalogue() if folder is None else place(folder)
        if create:
            folder = local_folder(folder, "a new catalogue")
        if is_remote(folder):
            open_anew(folder)
            check_marker(folder)
            return cls(folder)
        if create and (not folder.exists() or (folder.is_dir() and not any(folder.iterdir()))):
            made_folder(folder)
            write_marker(folder)
        hint = f"metamer catalogue import --catalogue {folder}"
        if not folder.exists():
            raise InputError("no such catalogue", file=folder, hint=hint)
        if not (folder / MARKER).is_file():
            found = f"a folder without {MARKER}" if folder.is_dir() else "a file"
            if not folder.is_dir():
                hint = "name the folder that an import has made: metamer catalogue import --catalogue FOLDER"
            expected = f"a folder that holds {MARKER}"
            raise InputError("not a catalogue", file=folder, found=found, expected=expected, hint=hint)
        check_marker(folder)
        return cls(folder)

    def _repr_html_(self) -> str:
        known = self.ids()
        families = Counter(material_id.partition("/")[0] for material_id in known)
        words = ", ".join(f"{count} {family}" for family, count in families.items())
        told = f"<p><b>{html.escape(str(self.folder))}</b>: {len(known)} materials ({html.escape(words)})</p>"
        shown = []
        for material_id in known[:MOST_LINES]:
            try:
                shown.append([material_id, self.summary(material_id).kind])
            except InputError as reason:
                shown.append([material_id, reason.problem])
        return told + html_table(["id", "standing"], shown, len(known))

    def ids(self) -> tuple[str, ...]:
        """Return every material's id, sorted; files are not opened."""
        return tuple(sorted(material_id for material_id, _ in material_files(self.folder, SUFFIX)))

    def match(self, pattern: str) -> tuple[str, ...]:
        """Return ids that match a pattern such as "colorchecker/*-gloss"; raises `UnknownNameError` if none does."""
        if not _WILD.search(pattern):
            # An id: of a list of them, the names of all files are not asked for each time.
            self.path(pattern)
            return (pattern,)
        known = self.ids()
        found = tuple(fnmatch.filter(known, pattern))
        if not found:
            raise UnknownNameError("material", pattern, known, file=self.folder)
        return found

    def match_surfaces(self, pattern: str) -> tuple[str, ...]:
        """Return ids as `match` does, without spectra that have no surface; raises `InputError` if none remain."""
        found = self.summaries(self.match(pattern))
        for one in found:
            if isinstance(one, InputError):
                raise one
        usable = [one for one in found if isinstance(one, Summary)]
        surfaces = tuple(one.id for one in usable if one.model not in SPECTRA)
        if not surfaces:
            raise no_surface(usable[0].model, usable[0].id)
        return surfaces

    def add(self, material: MaterialRecord, *, replace: bool = False) -> Path:
        """Write a material into the catalogue, whole or not at all; returns its file.

        replace : overwrite a material of the same id.

        Raises
        ------
        InputError : the id exists already, or is invalid. NoRoomError : the disk is full.
        """
        check_id(material.id)
        local_folder(self.folder, "a new material")
        path = self.folder / f"{material.id}{SUFFIX}"
        if path.exists() and not replace:
            hint = "take another name, or replace=True to put this one in its place"
            raise InputError("there is a material of this id", file=path, field=material.id, hint=hint)
        write_record(material, path)
        return path

    def path(self, material_id: str) -> Path:
        """Return the file of a material; raises `UnknownNameError`, which names the nearest ids."""
        path = self.folder / f"{material_id}{SUFFIX}"
        plain = all(part and not part.startswith(".") for part in material_id.split("/"))
        # The names of all files are asked for only where a wrong one was given.
        if not (plain and path.is_file()):
            try:
                known = self.ids()
            except UnlistedError:
                hint = "check the id; this store lists none"
                raise InputError("no such material", file=path, expected="the file of a material", hint=hint) from None
            raise UnknownNameError("material", material_id, known, file=self.folder)
        return path

    def state(self, material_id: str) -> tuple:
        """Return a stamp that changes whenever the material is rewritten; raises `UnknownNameError` as `path` does."""
        path = self.path(material_id)
        found = path.stat()
        return path, found.st_mtime_ns, found.st_size, found.st_ino

    def __iter__(self) -> Iterator[str]:
        return iter(self.ids())

    def __len__(self) -> int:
        return len(self.ids())

    def __getitem__(self, material_id: str) -> Material:
        return self.load(material_id)

    def load(self, material_id: str) -> Material:
        """Read a material and verify its checksum; raises `InputError` naming a damaged file."""
        path = self.path(material_id)
        record = read_record(path)
        if record.id != material_id:
            raise other_material(path, record.id, material_id)
        return Material(**vars(record))

    def surface(self, material_id: str) -> Material:
        """Return `load` of a material that has a surface; raises `InputError` for a spectrum without one."""
        record = self.load(material_id)
        if not record.is_surface:
            raise no_surface(record.model, material_id)
        return record

    def summary(self, material_id: str) -> Summary:
        """Read only the summary in the head of a material's file."""
        return summary(material_id, self.path(material_id))

    def summaries(self, ids: Iterable[str]) -> list[Summary | InputError]:
        """Read the `summary` of each of these materials; behind a URL, many are read at once."""
        ids = tuple(ids)
        known = dict(summaries(self.folder, SUFFIX, frozenset(ids))) if is_remote(self.folder) and len(ids) > 1 else {}
        found: list[Summary | InputError] = []
        for material_id in ids:
            try:
                found.append(known[material_id] if material_id in known else self.summary(material_id))
            except InputError as reason:
                found.append(reason)
        return found

    def query(self, query: Query | None = None, unusable: list[InputError] | None = None) -> tuple[Summary, ...]:
        """Summaries of the materials that fit, sorted; all of them by default.

        `unusable` takes one error for each file whose head cannot be read; without it, the first one is raised.

        >>> Query(families=("paint",), near=(50.0, 20.0, 10.0), within=3.0, sort="error").formula
        'CIE 1994'
        """
        heads = self.heads()
        if heads.unusable and unusable is None:
            raise heads.unusable[0]
        if unusable is not None:
            unusable.extend(heads.unusable)
        return heads.select(query or Query())

    def heads(self, say: Callable[[str], None] = lambda line: None) -> Heads | HeadIndex:
        """Return the heads of all files for queries: by an index if there are many and DuckDB is installed.

        say : receives a message if an index is made, or could be made.
        """
        index = None if is_remote(self.folder) else index_of(self.folder, say)
        return read_heads(self.folder, SUFFIX) if index is None else index

    def verify(self) -> dict[str, InputError | None]:
        """Return every id with the defect of its file, or None: checksums and heads (`verification` checks more)."""
        from ..records.verification import verify_catalogue

        return {one.id: one.problem for one in verify_catalogue(self.folder, quick=True, jobs=1).results}
