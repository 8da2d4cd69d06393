"""What an import will do, before it does it: which file is what, and which of its materials are new."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from ...spectral.errors import InputError
from ..formats.registry import Format, guessed, label, not_a_source, recognised_files
from ..records.record import SUFFIX
from ..records.record_head import SCHEMA, read_head
from .code_version import code_hash
from .inputs import InputFile
from .sources import MaterialSource, Rejected, read_with

Status = Literal["new", "skipped", "failed"]
# Above this many bytes, a material is read again when its turn comes: a hundred measured tables fit into no memory.
_KEPT_BYTES = 1 << 18


@dataclass(frozen=True)
class Settings:
    """What a fit depends on beside its source; `family` takes the place of the one that a source names."""

    budget: float
    uplift: str
    family: str | None = None


@dataclass(frozen=True)
class PlannedMaterial:
    """One material of one file, and what is to be done with it; "skipped" is what is there already, `reason` why
    it is that or has failed."""

    id: str
    status: Status
    reason: str = ""
    source_hash: str = ""
    size: int = 0
    load: Callable[[], MaterialSource] | None = None


@dataclass(frozen=True)
class PlannedFile:
    """One file: its name, its format ("" where it is none that we know), its materials.

    note : why it is passed over, where more than the lack of a format speaks against it.
    """

    name: str
    format: str
    materials: tuple[PlannedMaterial, ...] = ()
    note: str = ""

    def count(self, status: Status) -> int:
        """Materials with that status."""
        return sum(material.status == status for material in self.materials)


def planned(
    files: Iterable[InputFile | Rejected],
    folder: Path,
    settings: Settings,
    looked_at: Callable[[int, int, str], None] = lambda done, total, name: None,
) -> tuple[PlannedFile, ...]:
    """Every file with its materials, in the order of `files`; nothing is written.

    looked_at : called with (done, total, name) after each file.
    """
    seen: dict[str, tuple[str, str]] = {}
    found = []
    recognised = recognised_files(files)
    for number, (file, reader) in enumerate(recognised, 1):
        if isinstance(file, Rejected):
            found.append(PlannedFile(file.name, "", (PlannedMaterial(file.name, "failed", str(file.reason)),)))
        elif reader is not None:
            found.append(_file(file, reader, folder, settings, seen))
        elif file.named:
            reason = file.with_given_name(str(not_a_source(file.path)))
            found.append(PlannedFile(file.name, "", (PlannedMaterial(file.name, "failed", reason),)))
        else:
            found.append(PlannedFile(file.name, ""))
        looked_at(number, len(recognised), file.name)
    return tuple(found)


def _file(
    file: InputFile, reader: Format, folder: Path, settings: Settings, seen: dict[str, tuple[str, str]]
) -> PlannedFile:
    materials = []
    for material in _materials(file, reader, settings):
        if isinstance(material, Rejected):
            name = file.name if material.name == file.path.name else material.name
            reason = file.with_given_name(str(material.reason))
            materials.append(PlannedMaterial(name, "failed", reason))
        else:
            materials.append(_material(material, file, reader, folder, settings, seen))
    useless = materials and all(each.status == "failed" for each in materials)
    if useless and not file.named and guessed(reader, file.path):
        return PlannedFile(file.name, "", note=materials[0].reason.split("\n")[0].removeprefix(f"{file.name}: "))
    if not materials:
        reason = str(InputError("holds no material", file=file.name, expected="one measurement or more"))
        materials.append(PlannedMaterial(file.name, "failed", reason))
    return PlannedFile(file.name, label(reader, file.path), tuple(materials))


def _materials(file: InputFile, reader: Format, settings: Settings) -> Iterator[MaterialSource | Rejected]:
    for material in read_with(reader, file.path, settings.uplift):
        if isinstance(material, MaterialSource) and settings.family:
            name = material.id.partition("/")[2]
            material = replace(material, id=f"{settings.family}/{name}", family=settings.family)
        yield material


def _material(
    material: MaterialSource,
    file: InputFile,
    reader: Format,
    folder: Path,
    settings: Settings,
    seen: dict[str, tuple[str, str]],
) -> PlannedMaterial:
    content = material.content_hash
    if material.id in seen:
        name, other = seen[material.id]
        if content == other:
            return PlannedMaterial(material.id, "skipped", f"the same as in {name}")
        hint = "import the files one by one, each with a --family of its own, or rename one"
        reason = f"the id is used twice: {name}, {file.name}\n  try: {hint}"
        return PlannedMaterial(material.id, "failed", reason)
    seen[material.id] = file.name, content
    source_hash = _source_hash(material, content, settings.budget)
    there = stored_hash(folder, material.id)
    status: Status = "skipped" if there == source_hash else "new"
    load = _loader(material, file, reader, settings) if status == "new" else None
    return PlannedMaterial(material.id, status, "", source_hash, material.size, load)


def _loader(
    material: MaterialSource, file: InputFile, reader: Format, settings: Settings
) -> Callable[[], MaterialSource]:
    """Gives the material again: small ones are kept, large ones are read from their file."""
    if material.size <= _KEPT_BYTES:
        return lambda: material
    wanted = material.id

    def read_again() -> MaterialSource:
        for found in _materials(file, reader, settings):
            if isinstance(found, MaterialSource) and found.id == wanted:
                return found
        problem, hint = "the file has changed since the import began", "leave it alone, and import it again"
        raise InputError(problem, file=file.name, field=wanted, expected="a material of this id, as before", hint=hint)

    return read_again


def material_path(folder: Path, material_id: str) -> Path:
    """Where a catalogue keeps a material."""
    return folder / f"{material_id}{SUFFIX}"


def stored_hash(folder: Path, material_id: str) -> str | None:
    """`source_hash` of the material that is there, from its head alone; None where there is none."""
    try:
        return read_head(material_path(folder, material_id)).get("source_hash")
    except InputError:
        return None


def _source_hash(material: MaterialSource, content: str, budget: float) -> str:
    text = f"{content}|schema {SCHEMA}|budget {budget!r}|code {code_hash(material.model)}"
    return hashlib.sha256(text.encode()).hexdigest()
