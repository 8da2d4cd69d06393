"""History of imports into a catalogue, so that files that have not changed are neither read nor checked again.

One file beside the catalogue's marker, a mere cache: if it is lost, damaged or of another version, only time is lost. A
file is unchanged if its size, times and inode are equal, and if it was at rest when these were recorded: a file that
changes twice within a tick of the clock has the same times. Packed or remote files are at another place each time, and
are identified by their content.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import astuple, dataclass, field
from functools import lru_cache
from pathlib import Path

from ...runtime.errors import InputError
from ...runtime.files import written_whole
from ..formats.input_file import InputFile
from ..formats.registry import Format, companions, format_for, formats
from ..records.record import check_large, material_path, read_record, stored_arrays
from ..records.record_head import read_head
from .code_version import readers_hash

FILE = ".import.known"
_VERSION = 2
# The coarsest clock of a file system, FAT's, ticks every other second.
_TICK_NS = 2_000_000_000
# Above this many bytes, a file whose times have changed is read again rather than hashed.
_HASHED_BYTES = 64 << 20
# Most files remembered; beyond, those of this import alone.
_MOST_FILES = 50_000

State = list[int]


@dataclass(frozen=True)
class Read:
    """Material that a file yielded, or refused.

    Its id, content hash, model, bytes in memory (`size`) and in files (`stored`) and assumed quantity; or, with a
    `reason`, a refusal.
    """

    id: str
    content: str = ""
    model: str = ""
    size: int = 0
    reason: str = ""
    taken: str = ""
    stored: int = 0


@dataclass(frozen=True)
class FileReading:
    """Result of reading a file: its format in words, its materials, and the reason if it was skipped, else ""."""

    label: str
    materials: tuple[Read, ...]
    note: str = ""


@dataclass(frozen=True)
class FileState:
    """State of a file and its companions before they are read: path, state and content hash of each."""

    key: str
    moment_ns: int
    parts: tuple[list, ...]


@dataclass
class Known:
    """Known states of files (`formats`, `readings`) and of the catalogue's own (`records`); grows with every lookup."""

    folder: Path
    formats: dict[str, list] = field(default_factory=dict)
    readings: dict[str, dict] = field(default_factory=dict)
    records: dict[str, list] = field(default_factory=dict)
    # Entries that this import used or added; the rest may be of files that no longer exist.
    _used: set[str] = field(default_factory=set)
    _changed: bool = False

    @classmethod
    def of(cls, folder: Path) -> Known:
        """Load the history of the catalogue in `folder`; empty if it is unusable."""
        try:
            checksum, _, text = (folder / FILE).read_bytes().partition(b"\n")
            if hashlib.sha256(text).hexdigest().encode() != checksum:
                return cls(folder)
            stored = json.loads(text)
            if stored["version"] != _VERSION:
                return cls(folder)
            same = bool(readers_hash()) and stored["code"] == readers_hash()
            return cls(folder, stored["formats"] if same else {}, stored["readings"] if same else {}, stored["records"])
        except (OSError, ValueError, KeyError, TypeError):
            return cls(folder)

    def save(self) -> None:
        """Save it for the next import; a failure only costs time."""
        if not self._changed:
            return
        now = time.time_ns()
        records = {}
        for name, entry in self.records.items():
            state = _state(material_path(self.folder, name))
            if state == entry[:-1] and state is not None and _at_rest(state, now):
                records[name] = entry
        kept = [
            {name: entry for name, entry in entries.items() if name in self._used or len(entries) <= _MOST_FILES}
            for entries in (self.formats, self.readings)
        ]
        stored = {"version": _VERSION, "code": readers_hash(), "formats": kept[0], "readings": kept[1]}
        text = json.dumps(stored | {"records": records}, separators=(",", ":")).encode()
        with suppress(InputError, OSError), written_whole(self.folder / FILE) as beside:
            beside.write_bytes(hashlib.sha256(text).hexdigest().encode() + b"\n" + text)

    def format_of(self, file: InputFile) -> Format | None:
        """Return `format_for`, or its cached result for the same file among files of the same names."""
        if is_private(file):
            return format_for(file.path, file.named)
        path, moment, state = os.path.abspath(file.path), time.time_ns(), _state(file.path)  # noqa: PTH100 links stay
        stored = [*(state or ()), _names_beside(path), file.named]
        self._used.add(path)
        known = self.formats.get(path, [])
        if known[:-1] == stored:
            return next((reader for reader in formats() if known[-1] == reader.NAME), None)
        found = format_for(file.path, file.named)
        if state is not None and _at_rest(state, moment) and _state(file.path) == state:
            self.formats[path], self._changed = [*stored, found.NAME if found else ""], True
        return found

    def reading(self, file: InputFile, reader: Format, words: str) -> FileReading | None:
        """Return the reading of a file in its current state and under the same `words`; None if it is unknown."""
        key = _key(file, reader, words)
        entry = self.readings.get(key)
        parts = _parts(file, reader)
        if entry is None or len(entry["parts"]) != len(parts):
            return None
        if not all(self._is_as_stored(stored, path, file) for stored, path in zip(entry["parts"], parts, strict=True)):
            return None
        self._used.add(key)
        return FileReading(entry["label"], tuple(Read(*each) for each in entry["materials"]), entry["note"])

    def look(self, file: InputFile, reader: Format, words: str) -> FileState:
        """Return the state that `keep` compares with after the file has been read."""
        moment, private = time.time_ns(), is_private(file)
        parts = [
            ["", _content(path)] if private else [os.path.abspath(path), *(_state(path) or ()), _content(path)]  # noqa: PTH100
            for path in _parts(file, reader)
        ]
        return FileState(_key(file, reader, words), moment, tuple(parts))

    def keep(self, file: InputFile, look: FileState, reading: FileReading) -> None:
        """Store the result of a file, if it was at rest before it was read and is unchanged since."""
        for path, *stored, _ in look.parts if not is_private(file) else ():
            if (_state(Path(path)) or []) != stored or (stored and not _at_rest(stored, look.moment_ns)):
                return
        materials = [astuple(each) for each in reading.materials]
        self.readings[look.key] = {
            "parts": list(look.parts),
            "label": reading.label,
            "note": reading.note,
            "materials": materials,
        }
        self._used.add(look.key)
        self._changed = True

    def stored(self, material_id: str, wanted: str, heard: Callable[[int], None] = lambda read: None) -> str | None:
        """Return the `source_hash` of the catalogue's material under an id; None if there is none or it is incomplete.

        It is incomplete, too, if files with its large arrays are missing. heard : receives the bytes of large arrays as
        they are checked.

        If it equals `wanted`, the file has been checked, now or in its current state before: the head of a file is
        intact even if its end is missing.
        """
        path = material_path(self.folder, material_id)
        if (state := _state(path)) is None:
            return None
        if self.records.get(material_id) == [*state, wanted]:
            return wanted
        try:
            found = read_head(path).get("source_hash")
            if found == wanted:
                record = read_record(path)
                if (record.id, record.source_hash) != (material_id, wanted):
                    return None
                check_large(record, path, heard)
                # Arrays in other files are checked each time.
                if all(array.file == path.absolute() for array in stored_arrays(record)):
                    self.wrote(material_id, wanted, state)
            return found
        except InputError:
            return None

    def wrote(self, material_id: str, source_hash: str, state: State | None = None) -> None:
        """Record that a file of the catalogue is complete: just written, or checked in that state."""
        state = state or _state(material_path(self.folder, material_id))
        if state is not None:
            self.records[material_id], self._changed = [*state, source_hash], True

    def _is_as_stored(self, stored: list, path: Path, file: InputFile) -> bool:
        """Return whether a part matches its entry; if only its times have changed, the entry is updated."""
        name, *then, content = stored
        if is_private(file):
            return bool(content) and _content(path) == content
        if name != os.path.abspath(path):  # noqa: PTH100
            return False
        moment, state = time.time_ns(), _state(path)
        if (state or []) == then:
            return True
        if not content or state is None or not then or state[0] != then[0] or _content(path) != content:
            return False
        if _at_rest(state, moment) and _state(path) == state:
            stored[1:-1], self._changed = state, True
        return True


def _key(file: InputFile, reader: Format, words: str) -> str:
    name = file.name if is_private(file) else os.path.abspath(file.path)  # noqa: PTH100
    return "\n".join([name, reader.NAME, str(file.named), words])


def is_private(file: InputFile) -> bool:
    """Return whether the file is a copy made by this import, of an archive's member or of a remote file."""
    return file.name != str(file.path)


def _parts(file: InputFile, reader: Format) -> list[Path]:
    """Return the file and its companions by format, which may be missing."""
    return [file.path, *sorted(companions(reader, file.path))]


def _state(path: Path) -> State | None:
    """Return size, times of content and metadata, and inode, which distinguish versions of a file."""
    try:
        found = path.stat()
    except OSError:
        return None
    return [found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino]


def _at_rest(state: State, moment_ns: int) -> bool:
    """Return whether a file was untouched for longer than a tick of any clock."""
    return max(state[1:3]) < moment_ns - _TICK_NS


def _content(path: Path) -> str:
    """Compute the SHA-256 of a file, "" if it is large or unreadable."""
    try:
        with path.open("rb") as file:
            if os.fstat(file.fileno()).st_size > _HASHED_BYTES:
                return ""
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def _names_beside(path: str) -> str:
    """Hash the names in a file's folder, which may determine its format, as of textures."""
    folder = os.path.dirname(path)  # noqa: PTH120
    try:
        return _names_in(folder, os.stat(folder).st_mtime_ns)  # noqa: PTH116
    except OSError:
        return ""


@lru_cache(maxsize=256)
def _names_in(folder: str, changed_ns: int) -> str:
    return hashlib.sha256("\n".join(sorted(os.listdir(folder))).encode("utf-8", "surrogateescape")).hexdigest()[:16]  # noqa: PTH208
