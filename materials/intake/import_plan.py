"""Plan of an import: the format of each file, and which of its materials are new."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Literal

from ...runtime.errors import InputError
from ...runtime.memory import gigabytes
from ...runtime.wording import in_words
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions
from ..formats.input_file import InputFile
from ..formats.registry import Format, companions, guessed, label, not_a_source, recognised_files
from ..records.models import quantity_of
from ..records.record_head import SCHEMA
from ..records.source import MaterialSource, Rejected
from .code_version import code_hash
from .import_cost import TOLD_S, reading_too_large
from .import_history import FileReading, Known, Read, is_private
from .progress import Doing, Hears, in_bytes
from .sources import read_with

Status = Literal["new", "skipped", "failed"]
# Names that nothing but a measurement, or an archive of them, has.
_MEASUREMENTS = (
    *(".bsdf", ".binary", ".brdf", ".cgats", ".ccss", ".csv", ".cxf", ".dx", ".jdx", ".mat", ".qtx", ".sp", ".spd"),
    *(".spdx", ".ti3", ".tsv", ".zip"),
)
# Above this many bytes, a material is read again when its turn comes: a hundred measured tables fit into no memory.
_KEPT_BYTES = 1 << 18


@dataclass(frozen=True)
class Settings:
    """Settings of an import; `family` replaces the one of a source.

    again : fit existing materials, too.
    copy : copy large arrays of files into the record; else it refers to them by place and digests.
    answer : the measured quantity, for files that do not state it.
    """

    budget: float
    uplift: str
    family: str | None = None
    again: bool = False
    answer: ImportOptions = NO_ANSWER
    copy: bool = False


@dataclass(frozen=True)
class PlannedMaterial:
    """Material of a file, and its planned treatment.

    "skipped" is an existing material. reason : of a skip or a failure. taken : assumed quantity and scale, with the
    evidence.

    size, stored : bytes of its numbers in memory, and of those that stay in files.
    copy : whether the latter are copied into the record.
    """

    id: str
    status: Status
    reason: str = ""
    source_hash: str = ""
    size: int = 0
    model: str = ""
    load: Callable[[], MaterialSource] | None = None
    taken: str = ""
    stored: int = 0
    copy: bool = False


@dataclass(frozen=True)
class PlannedFile:
    """One file: its name, its format ("" if it is unknown), its materials.

    note : why it is skipped, if there are reasons beyond an unknown format.
    """

    name: str
    format: str
    materials: tuple[PlannedMaterial, ...] = ()
    note: str = ""

    def count(self, status: Status) -> int:
        """Materials with that status."""
        return sum(material.status == status for material in self.materials)

    @property
    def taken(self) -> tuple[str, ...]:
        """Assumed quantities and scales of its materials, with the evidence for the first of each."""
        said = [material.taken for material in self.materials if material.taken]
        first: dict[str, str] = {}
        for words in said:
            first.setdefault(words.partition(", by ")[0], words)
        return tuple(first.values())


LookedAt = Callable[[int, int, PlannedFile], None]


def planned(
    files: Iterable[InputFile | Rejected],
    folder: Path,
    settings: Settings,
    looked_at: LookedAt = lambda done, total, file: None,
    known: Known | None = None,
    doing: Callable[[str, Doing], None] = lambda name, doing: None,
) -> tuple[PlannedFile, ...]:
    """Plan every file with its materials, in the order of `files`, without writing anything.

    looked_at : called with (done, total, file) after each file.
    known : history of earlier imports into the folder, updated by this one. doing : called with (name, current work)
    before a file that takes long to read.
    """
    known = known or Known(folder)
    seen: dict[str, tuple[str, str]] = {}
    found = []
    recognised = recognised_files(files, known.format_of)
    # An answer for several files fills the gaps that they leave; for one alone, it is about that file.
    alone = len(recognised) == 1 and isinstance(recognised[0][0], InputFile) and recognised[0][0].named
    settings = replace(settings, answer=replace(settings.answer, against="overruled" if alone else "kept"))
    for number, (file, reader) in enumerate(recognised, 1):
        if isinstance(file, Rejected):
            found.append(PlannedFile(file.name, "", (PlannedMaterial(file.name, "failed", str(file.reason)),)))
        elif reader is not None:
            found.append(_file(file, reader, settings, known, seen, doing))
        elif file.named or _is_cut_to_nothing(file.path):
            reason = file.with_given_name(str(not_a_source(file.path)))
            found.append(PlannedFile(file.name, "", (PlannedMaterial(file.name, "failed", reason),)))
        else:
            found.append(PlannedFile(file.name, ""))
        looked_at(number, len(recognised), found[-1])
    return tuple(found)


def _is_cut_to_nothing(path: Path) -> bool:
    """Return whether a file with the name of a measurement is empty, as after an aborted copy."""
    return path.suffix.lower() in _MEASUREMENTS and path.stat().st_size == 0


Load = Callable[[], MaterialSource]


def _file(
    file: InputFile,
    reader: Format,
    settings: Settings,
    known: Known,
    seen: dict[str, tuple[str, str]],
    doing: Callable[[str, Doing], None],
) -> PlannedFile:
    words = repr(replace(settings, budget=0.0, again=False, copy=False))
    # Private files are gone when this import ends.
    settings = replace(settings, copy=settings.copy or is_private(file))
    say = partial(doing, file.name)
    reading = None if settings.again else known.reading(file, reader, words)
    loads: Sequence[Load | None] = ()
    # A material to be fitted has to be read, and the others of its file with it.
    if reading is None or not all(each.reason or _is_there(each, settings, known, say) for each in reading.materials):
        cost, refusal = reading_too_large(reader, file.path, file.name)
        if refusal is not None:
            refused = PlannedMaterial(file.name, "failed", str(refusal))
            return PlannedFile(file.name, label(reader, file.path), (refused,))
        if cost.seconds > TOLD_S:
            parts = (file.path, *companions(reader, file.path))
            size = gigabytes(sum(part.stat().st_size for part in parts if part.is_file()))
            doing(file.name, Doing(f"reading {size}, about {in_words(cost.seconds)}"))
        look = known.look(file, reader, words)
        reading, loads, lasts = _read(file, reader, settings, say)
        if lasts:
            known.keep(file, look, reading)
    if reading.note:
        return PlannedFile(file.name, "", note=reading.note)
    materials = [
        _material(each, load, file, settings, known, seen, say) for each, load in zip_longest(reading.materials, loads)
    ]
    return PlannedFile(file.name, reading.label, tuple(materials))


def _read(
    file: InputFile, reader: Format, settings: Settings, say: Hears
) -> tuple[FileReading, list[Load | None], bool]:
    """Read a file: its materials, loaders of each, and whether all of it depends on the file alone."""
    found: list[Read] = []
    loads: list[Load | None] = []
    lasts = True
    for read in _materials(file, reader, settings):
        material, content = _sealed(read, say)
        if isinstance(material, Rejected):
            name = file.name if material.name == file.path.name else material.name
            found.append(Read(name, reason=file.with_given_name(str(material.reason))))
            loads.append(None)
            lasts = lasts and _lasts(material.reason)
        else:
            said = taken_as(material, reader)
            found.append(Read(material.id, content, material.model, material.size, taken=said, stored=material.stored))
            loads.append(_loader(material, content, file, reader, settings))
    note = ""
    if found and all(each.reason for each in found) and not file.named and guessed(reader, file.path):
        note = found[0].reason.split("\n")[0].removeprefix(f"{file.name}: ")
    if not found:
        reason = str(InputError("holds no material", file=file.name, expected="one measurement or more"))
        found.append(Read(file.name, reason=reason))
    return FileReading("" if note else label(reader, file.path), tuple(found), note), loads, lasts


def _sealed(read: MaterialSource | Rejected, say: Hears) -> tuple[MaterialSource | Rejected, str]:
    """Return a source with digests of its files, and its content hash; `Rejected` if they are unreadable."""
    if isinstance(read, Rejected):
        return read, ""
    try:
        return read.sealed(in_bytes("hashing", read.stored, say))
    except InputError as reason:
        return Rejected(read.id, reason), ""


def _lasts(reason: BaseException | None) -> bool:
    """Return whether a refusal is of the file's content, and not of a disk or of memory, which may differ next time."""
    while reason is not None:
        if isinstance(reason, OSError | MemoryError | RuntimeError):
            return False
        reason = reason.__cause__ or reason.__context__
    return True


def _materials(file: InputFile, reader: Format, settings: Settings) -> Iterator[MaterialSource | Rejected]:
    for material in read_with(reader, file.path, settings.uplift, settings.answer):
        if isinstance(material, MaterialSource) and settings.family:
            name = material.id.partition("/")[2]
            material = replace(material, id=f"{settings.family}/{name}", family=settings.family)
        yield material


def _material(
    read: Read,
    load: Load | None,
    file: InputFile,
    settings: Settings,
    known: Known,
    seen: dict[str, tuple[str, str]],
    say: Hears,
) -> PlannedMaterial:
    if read.reason:
        return PlannedMaterial(read.id, "failed", read.reason)
    if read.id in seen:
        name, other = seen[read.id]
        if read.content == other:
            return PlannedMaterial(read.id, "skipped", f"the same as in {name}")
        hint = "import the files one by one, each with a --family of its own, or rename one"
        reason = f"the id is used twice: {name}, {file.name}\n  try: {hint}"
        return PlannedMaterial(read.id, "failed", reason)
    seen[read.id] = file.name, read.content
    wanted = _source_hash(read, settings)
    said = (wanted, read.size, read.model)
    if not settings.again and _is_there(read, settings, known, say):
        return PlannedMaterial(read.id, "skipped", "", *said, taken=read.taken)
    return PlannedMaterial(read.id, "new", "", *said, load, read.taken, read.stored, settings.copy)


def _is_there(read: Read, settings: Settings, known: Known, say: Hears) -> bool:
    """Return whether the catalogue has an intact material equal to the one that this import would make."""
    wanted = _source_hash(read, settings)
    return known.stored(read.id, wanted, in_bytes("checking", read.stored, say)) == wanted


def taken_as(material: MaterialSource, reader: Format) -> str:
    """Describe the assumed quantity of a material, and the evidence: its format if it states none of its own."""
    return material.taken or f"{quantity_of(material.model)}, by the format ({reader.NAME})"


def _loader(
    material: MaterialSource, content: str, file: InputFile, reader: Format, settings: Settings
) -> Callable[[], MaterialSource]:
    """Return a function that loads the material again: small and file-based ones are kept, large ones are re-read."""
    if material.size <= _KEPT_BYTES or material.stored:
        return lambda: material
    wanted = material.id

    def read_again() -> MaterialSource:
        for found in _materials(file, reader, settings):
            if isinstance(found, MaterialSource) and found.id == wanted and found.content_hash == content:
                return found
        problem, hint = "the file has changed since the import began", "leave it alone, and import it again"
        raise InputError(problem, file=file.name, field=wanted, expected="this material, as before", hint=hint)

    return read_again


def _source_hash(read: Read, settings: Settings) -> str:
    text = f"{read.content}|schema {SCHEMA}|budget {settings.budget!r}|code {code_hash(read.model)}"
    if read.stored and settings.copy:
        text += "|copied"
    return hashlib.sha256(text.encode()).hexdigest()
