"""Index of a catalogue's heads: a table of queried properties for DuckDB; derived, and disposable.

    .index/state            SHA-256, line feed, JSON: which table, how each folder was, what has changed since
    .index/DIGEST.parquet   a row a file: its size and time, the words of its head and what is sorted by

The folder is in the catalogue or, if that is unwritable, in the user's cache.

Files remain authoritative. The table only narrows a query down; candidates are read from the heads of the files, and
`Query` decides, as without an index. A row is valid while its file has the recorded size and time. Files of a catalogue
are renamed into place, which changes the times of their folder: only folders with changed times are listed again. A
lost, damaged or outdated index only costs time.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import os
import re
import shutil
import stat
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float

from ...runtime.disk_cache import cache_folder
from ...runtime.errors import InputError
from ...runtime.files import half_written, made_folder, written_whole
from ...runtime.locks import alone_at_work, remove_abandoned
from ...runtime.private_folder import private_folder
from ...spectral.difference import FormulaName, delta_e_lab
from ..records.query import SORTED_BY, WORDS, Query, Summary, material_files, order_key, read_heads, summary
from ..records.record import SUFFIX

FOLDER = ".index"
_STATE = "state"
_VERSION = 1
#: Fewest heads that take an index: fewer are read in a tenth of a second.
WORTH = 2_000
# Most rows that are changes beside the table, or this share of it; beyond, the table is written anew.
_FEW, _SHARE = 5_000, 50
#: The coarsest clock of a file system, FAT's, ticks every other second: what is younger may yet change unseen.
TICK_NS = 2_000_000_000
# Rows per insertion into a table; rows per group of the file; colours per block of differences.
_BATCH, _GROUP, _BLOCK = 5_000, 20_480, 1 << 16
# Words that are looked up one by one, which pays for few.
_FEW_WORDS = 500
# Other rows than those of the table have numbers from here on.
_BEYOND = 1 << 40
# Most tries of a query, which is repeated if the catalogue changes meanwhile.
_TRIES = 3
# Catalogues of one process whose tables stay open.
_OPEN = 4

_COLUMNS = {
    **dict.fromkeys(("id", "folder", "place", "folded"), "VARCHAR"),
    **dict.fromkeys(("size", "time"), "BIGINT"),
    **dict.fromkeys(("family", "model", "kind", "quantity"), "VARCHAR"),
    "terms": "BIGINT",
    **dict.fromkeys(("error", "lightness", "chroma", "hue", "a", "b"), "DOUBLE"),
}
_SAID = [name for name in _COLUMNS if name in SORTED_BY]
_TYPES = ", ".join(f'"{name}" {kind}' for name, kind in _COLUMNS.items())
_ROWS = "SELECT id, size, time FROM"
# Rounding of a distance, as a share of it.
_SLACK = 1e-9
_ELSEWHERE = "another process writes its index"

Row = tuple[Any, ...]


def index_of(folder: Path, say: Callable[[str], None] = lambda line: None) -> HeadIndex | None:
    """Return the current index of a catalogue; None if reading all heads is as fast, or if no index can be made.

    say : receives a sentence when many heads are read one by one, and that this is the last time.
    """
    places = (
        folder / FOLDER,
        cache_folder("heads") / hashlib.sha256(os.fsencode(os.path.realpath(folder))).hexdigest(),
    )
    if not any((place / _STATE).is_file() for place in places):
        few = sum(1 for _ in itertools.islice(material_files(folder, SUFFIX), WORTH))
        if few < WORTH:
            return None
    try:
        from duckdb import Error
    except ImportError:
        say(f"{folder}: the heads are read one by one; with the extra `index` (DuckDB) they are kept in a table")
        return None

    name = os.path.realpath(folder)
    with _opening:
        index = _opened.pop(name) if name in _opened else HeadIndex(folder, places)
        try:
            index.move(folder, places)
            index.refresh(say)
        except (Error, InputError, OSError) as reason:
            say(f"{folder}: the heads are read one by one, there can be no index: {str(reason).splitlines()[0]}")
            return None
        _opened[name] = index
        while len(_opened) > _OPEN:
            del _opened[next(iter(_opened))]
    return index


_opened: dict[str, HeadIndex] = {}
_opening = threading.Lock()


class HeadIndex:
    """Heads of a catalogue's files in a table, and the few that do not fit one; see `index_of`.

    unusable : an error for each file with an unreadable head.
    """

    def __init__(self, folder: Path, places: tuple[Path, ...]) -> None:
        self.unusable: tuple[InputError, ...] = ()
        self._folder, self._places = folder, places
        self._lock = threading.RLock()
        self._known: _Known = _Known()
        self._place: Path | None = None
        self._stamp: tuple[int, ...] | None = None
        self._connection: Any = None
        self._apart: tuple[Summary, ...] = ()
        self._doubted: set[str] = set()
        self._count: int | None = None
        self._words: dict[str, frozenset[str]] = {}
        # Colours of the table's rows, in their order.
        self._colours: Float[np.ndarray, "N 3"] | None = None

    def move(self, folder: Path, places: tuple[Path, ...]) -> None:
        """Set the current name of the catalogue's folder, which may be another path to it."""
        with self._lock:
            self._folder, self._places = folder, places

    def __len__(self) -> int:
        count = self._ask("SELECT count(*) FROM heads")[0][0] if self._count is None else self._count
        self._count = count
        return count + len(self._apart)

    def words(self, name: str) -> frozenset[str]:
        """Return the existing families, models, kinds or quantities."""
        if name not in self._words:
            self._words[name] = frozenset(row[0] for row in self._ask(f"SELECT DISTINCT {name} FROM heads"))
        return self._words[name] | {getattr(one, name) for one in self._apart}

    def select(self, query: Query) -> tuple[Summary, ...]:
        """Summaries of the materials that fit, sorted, each read from the head of its file."""
        from duckdb import Error

        if query.limit == 0:
            return ()
        with self._lock:
            for _ in range(_TRIES):
                with suppress(Error):
                    found = self._answers(query)
                    if not self._doubted:
                        return query.of((*self._apart, *found))
                self.refresh()
        return read_heads(self._folder, SUFFIX).select(query)

    def _answers(self, query: Query) -> list[Summary]:
        """Read the heads of candidates; files that differ from their rows are re-examined."""
        found = []
        for material_id, size, moment in self._candidates(query):
            path = f"{self._folder}{os.sep}{material_id}{SUFFIX}"
            try:
                now = os.stat(path)  # noqa: PTH116
                if (size, moment) not in ((now.st_size, now.st_mtime_ns), (now.st_size, None)):
                    self._doubted.add(material_id)
                found.append(summary(material_id, path))
            except (OSError, InputError):
                self._doubted.add(material_id)
        return found

    def _candidates(self, query: Query) -> list[Row]:
        """Return id, size and time of all materials that `query` may select, and of few others."""
        wanted, values, exact = self._conditions(query)
        where = f" WHERE {' AND '.join(wanted)}" if wanted else ""
        order = query.sort or ("id" if query.near is None else "near")
        if query.near is not None and (query.within is not None or order == "near"):
            numbers = self._near(query, order, where, values)
            if numbers is not None:
                return self._ask(f"{_ROWS} every WHERE number IN (SELECT unnest(?::BIGINT[]))", [numbers])
            return self._ask(f"{_ROWS} heads{where}", values)
        if query.limit is None or not exact:
            return self._ask(f"{_ROWS} heads{where}", values)
        way = "DESC" if query.reverse else "ASC"
        by = f"place {way}, id {way}" if order == "id" else f'"{order}" {way} NULLS LAST, place, id'
        return self._ask(f"{_ROWS} heads{where} ORDER BY {by} LIMIT {query.limit}", values)

    def _conditions(self, query: Query) -> tuple[list[str], list[Any], bool]:
        """Translate a query to SQL conditions with their values; and return whether they are complete."""
        wanted, values, exact = [], [], True
        for name in WORDS:
            there = self.words(name)
            taken = sorted(word for word in there if query.takes(name, word))
            if len(taken) < len(there):
                few = f'list_contains(?::VARCHAR[], "{name}")'
                wanted.append(few if len(taken) < _FEW_WORDS else f'"{name}" IN (SELECT unnest(?::VARCHAR[]))')
                values.append(taken)
        if query.ids:
            patterns = [_like(pattern) for pattern in query.ids]
            wanted.append("(" + " OR ".join([r"folded LIKE ? ESCAPE '\'"] * len(patterns)) + ")")
            values += patterns
            exact = not any("[" in pattern for pattern in query.ids)
        if query.max_error is not None:
            wanted.append("error <= ?")
            values.append(query.max_error)
        if query.coloured is False or (query.coloured and query.near is None):
            wanted.append(f"lightness IS {'NOT ' if query.coloured else ''}NULL")
        return wanted, values, exact

    def _near(self, query: Query, order: str, where: str, values: list[Any]) -> list[int] | None:
        """Return the numbers of the nearest rows, or of those within reach; None if all matches are wanted."""
        assert query.near is not None
        if query.within is None and query.limit is None:
            return None
        near, formula = np.array(query.near, dtype=float), cast(FormulaName, query.formula)
        if where:
            numbers, labs = self._colours_of(f"heads{where}", values)
            far = _distances(near, labs, formula)
        else:
            if self._colours is None:
                held, labs = self._colours_of(f"every WHERE number < {_BEYOND}")
                self._colours = np.empty_like(labs)
                self._colours[held] = labs
            beside, labs = self._colours_of(f"every WHERE number >= {_BEYOND}")
            far = np.concatenate([_distances(near, some, formula) for some in (self._colours, labs)])
            numbers = np.concatenate([np.arange(len(self._colours)), beside])
            far[[number for (number,) in self._ask("SELECT number FROM gone")]] = np.nan
        if query.within is not None:
            # Query decides on what a last digit makes of the border.
            inside = far <= query.within * (1 + _SLACK)
            numbers, far = numbers[inside], far[inside]
        elif query.limit is not None and len(far) - np.count_nonzero(np.isnan(far)) < query.limit:
            return None
        if order == "near" and query.limit is not None and query.limit <= len(far):
            # Materials without a distance come last, also where the farthest are wanted.
            far = -far if query.reverse else far
            last = np.partition(far, query.limit - 1)[query.limit - 1]
            numbers = numbers[far <= last + abs(last) * _SLACK]
        return numbers.tolist()

    def _colours_of(self, rows: str, values: Iterable[Any] = ()) -> tuple[np.ndarray, Float[np.ndarray, "N 3"]]:
        """Return row numbers and CIELAB, NaN if no colour is known."""
        with self._lock:
            text = f"SELECT number, lightness, a, b FROM {rows}"
            read = self._connection.execute(text, list(values)).fetchnumpy()
        columns = [np.ma.filled(read[name].astype(float), np.nan) for name in ("lightness", "a", "b")]
        return read["number"], np.stack(columns, axis=-1)

    def _ask(self, text: str, values: Iterable[Any] = ()) -> list[Row]:
        with self._lock:
            return self._connection.execute(text, list(values)).fetchall()

    def refresh(self, say: Callable[[str], None] = lambda line: None) -> None:
        """Update the table from the folders, and save it if possible."""
        with self._lock:
            self._open()
            folders = dict(self._known.folders)
            lost, unread = self._changes()
            if lost or unread or self._known.table is None:
                beside = self._ask("SELECT count(*) FROM changed")[0][0] if self._known.table else 0
                if self._known.table is None or beside + len(unread) > max(_FEW, self._known.rows // _SHARE):
                    if len(unread) >= WORTH:
                        say(f"{self._folder}: {len(unread)} heads are read into an index, once")
                    self._write_anew(lost, unread)
                else:
                    self._drop(lost)
                    self._insert(self._connection, self._rows(unread))
                    self._write()
                self._show()
            elif folders != self._known.folders:
                self._write()
            self._doubted.clear()
            self._read_apart()

    def _open(self) -> None:
        """Load the saved state if it differs from the loaded one."""
        for place in self._places:
            stamp = _stamp(place / _STATE)
            if self._connection is not None and stamp == self._stamp and place == self._place:
                return
            if stamp is not None and (known := _Known.read(place)) is not None:
                self._known, self._place, self._stamp = known, place, stamp
                self._connect()
                return
        if self._connection is None or self._place is not None:
            self._known, self._place, self._stamp = _Known(), None, None
            self._connect()

    def _connect(self) -> None:
        self._connection, self._colours = _connection(":memory:"), None
        self._connection.execute(f"CREATE TABLE changed ({_TYPES})")
        self._connection.execute("CREATE TABLE gone (number BIGINT)")
        self._insert(self._connection, self._known.changed)
        if self._known.gone:
            self._connection.execute("INSERT INTO gone SELECT unnest(?::BIGINT[])", [self._known.gone])
        self._show()

    def _show(self) -> None:
        """Expose the valid rows as `heads`, and clear derived data."""
        table = None if self._place is None else self._place / f"{self._known.table}.parquet"
        _view(self._connection, table)
        self._count, self._words = None, {}

    def _changes(self) -> tuple[list[Row], list[_Found]]:
        """Return id and number of each outdated row, and the files to be read."""
        known, lost, unread = self._known, [], []
        doubted = {_parent(material_id) for material_id in self._doubted}
        waiting = {
            name
            for name, then in known.folders.items()
            if then is None or name in doubted or _folder_state(self._folder, name) != then
        }
        waiting |= set() if "" in known.folders else {""}
        while waiting:
            name = waiting.pop()
            moment, state = time.time_ns(), _folder_state(self._folder, name)
            rows = self._ask("SELECT id, number, size, time FROM heads WHERE folder = ?", [name])
            then = {row[0]: row[1:] for row in rows}
            known.apart = {material_id for material_id in known.apart if _parent(material_id) != name}
            known.folders.pop(name, None)
            if state is not None:
                folders, files = _listed(self._folder, name)
                at_rest = max(*state, *(file.time or 0 for file in files)) < moment - TICK_NS
                known.folders[name] = state if at_rest else None
                waiting |= folders - known.folders.keys()
                for file in files:
                    number, *stood = then.pop(file.id, (None,))
                    if number is not None and stood == [file.size, file.time] and file.id not in self._doubted:
                        continue
                    unread.append(file if (file.time or 0) < moment - TICK_NS else file.young())
                    lost += [] if number is None else [(file.id, number)]
            lost += [(material_id, number) for material_id, (number, *_) in then.items()]
        return lost, unread

    def _rows(self, files: Iterable[_Found]) -> Iterator[Row]:
        """Read the heads; those that no row can hold are kept separately."""
        for file in files:
            row = None
            with suppress(InputError):
                row = _row(file, summary(file.id, file.path))
            if row is None:
                self._known.apart.add(file.id)
            else:
                yield row

    def _read_apart(self) -> None:
        found, unusable = [], []
        for material_id in sorted(self._known.apart, key=order_key):
            try:
                found.append(summary(material_id, f"{self._folder}{os.sep}{material_id}{SUFFIX}"))
            except InputError as reason:
                unusable.append(reason)
        self._apart, self.unusable = tuple(found), tuple(unusable)

    def _drop(self, lost: list[Row]) -> None:
        for text, numbers in (
            ("DELETE FROM changed WHERE id IN (SELECT unnest(?::VARCHAR[]))", [i for i, n in lost if n >= _BEYOND]),
            ("INSERT INTO gone SELECT unnest(?::BIGINT[])", [n for _, n in lost if n < _BEYOND]),
        ):
            if numbers:
                self._connection.execute(text, [numbers])

    def _insert(self, connection: Any, rows: Iterable[Row]) -> None:
        rows = iter(rows)
        holes = ", ".join(f"unnest(?::{kind}[])" for kind in _COLUMNS.values())
        while some := list(itertools.islice(rows, _BATCH)):
            columns = [list(column) for column in zip(*some, strict=True)]
            connection.execute(f"INSERT INTO changed SELECT {holes}", columns)

    def _write(self) -> None:
        """Save changes beside the table; on failure they are recomputed next time."""
        self._known.changed = self._ask("SELECT * EXCLUDE number FROM heads WHERE number >= ?", [_BEYOND])
        self._known.gone = [number for (number,) in self._ask("SELECT number FROM gone")]
        if self._place is not None:
            with suppress(InputError, OSError), alone_at_work(self._place, _ELSEWHERE):
                self._stamp = self._known.write(self._place)

    def _write_anew(self, lost: list[Row], unread: list[_Found]) -> None:
        """Write a complete table, in the first place that is writable."""
        with private_folder() as room:
            written = room / "table.parquet"
            rows = self._write_table(room, written, {number for _, number in lost}, unread)
            known, refused = _Known(_digest(written), rows, self._known.folders, self._known.apart), None
            for place in self._places:
                try:
                    made_folder(place)
                    with alone_at_work(place, _ELSEWHERE):
                        with written_whole(place / f"{known.table}.parquet") as beside:
                            shutil.copyfile(written, beside)
                        self._stamp = known.write(place)
                    self._known, self._place = known, place
                    return self._connect()
                except (InputError, OSError) as reason:
                    refused = reason
            assert refused is not None
            raise refused

    def _write_table(self, room: Path, written: Path, lost: set[int], unread: list[_Found]) -> int:
        """Write the valid rows and those of files that are read now; return their number."""
        connection = _connection(str(room / "rows"))
        try:
            connection.execute(f"CREATE TABLE changed ({_TYPES})")
            connection.execute("CREATE TABLE gone (number BIGINT)")
            beside = self._ask("SELECT * FROM heads WHERE number >= ?", [_BEYOND])
            self._insert(connection, (row[:-1] for row in beside if row[-1] not in lost))
            self._insert(connection, self._rows(unread))
            # Beside the table, what is lost was left out above, and its numbers are other rows' here.
            gone = [*self._known.gone, *(number for number in lost if number < _BEYOND)]
            connection.execute("INSERT INTO gone SELECT unnest(?::BIGINT[])", [gone])
            table = None if self._place is None else self._place / f"{self._known.table}.parquet"
            how = f"FORMAT parquet, COMPRESSION zstd, ROW_GROUP_SIZE {_GROUP}"
            _view(connection, table)
            text = "SELECT * EXCLUDE number FROM heads ORDER BY place, id"
            connection.execute(f"COPY ({text}) TO '{_quoted(written)}' ({how})")
            return connection.execute(f"SELECT count(*) FROM read_parquet('{_quoted(written)}')").fetchone()[0]
        finally:
            connection.close()


@dataclass
class _Known:
    """State of an index beside the rows of its table.

    table : digest of its file, which is named by it. rows : number of rows. folders : the times of each, by its name;
    None if it changed too recently to tell. apart : ids of files with unreadable heads, or heads that no row can hold.
    gone : numbers of invalid rows. changed : valid rows beside the table.
    """

    table: str | None = None
    rows: int = 0
    folders: dict[str, list[int] | None] = field(default_factory=dict)
    apart: set[str] = field(default_factory=set)
    gone: list[int] = field(default_factory=list)
    changed: list[Row] = field(default_factory=list)

    @classmethod
    def read(cls, place: Path) -> _Known | None:
        """Load the state from a place; None if it, or the table, is damaged or incomplete."""
        try:
            checksum, _, text = (place / _STATE).read_bytes().partition(b"\n")
            if hashlib.sha256(text).hexdigest().encode() != checksum:
                return None
            stored = json.loads(text)
            if stored.pop("version") != _VERSION or _digest(place / f"{stored['table']}.parquet") != stored["table"]:
                return None
            return cls(**stored | {"apart": set(stored["apart"])})
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def write(self, place: Path) -> tuple[int, ...] | None:
        """Save the state, remove tables that it does not name, and return the stamp of the file."""
        stored = vars(self) | {"version": _VERSION, "apart": sorted(self.apart)}
        text = json.dumps(stored, separators=(",", ":")).encode()
        with written_whole(place / _STATE) as beside:
            beside.write_bytes(hashlib.sha256(text).hexdigest().encode() + b"\n" + text)
        for left in half_written(place):
            remove_abandoned(left)
        for other in place.glob("*.parquet"):
            if other.stem != self.table and not other.name.startswith("."):
                with suppress(OSError):
                    other.unlink()
        return _stamp(place / _STATE)


@dataclass(frozen=True)
class _Found:
    """Listing entry of a material file; time : ns, None if it is so recent that the file may still change."""

    id: str
    path: str
    size: int
    time: int | None

    def young(self) -> _Found:
        """This entry with an unknown time, since the file may still change."""
        return _Found(self.id, self.path, self.size, None)


def _listed(top: Path, name: str) -> tuple[set[str], list[_Found]]:
    """Return the names of a folder's subfolders, and its material files, as `material_files` does."""
    folders, files = set(), []
    with suppress(OSError), os.scandir(top / name) as entries:
        for entry in entries:
            inside = f"{name}/{entry.name}" if name else entry.name
            if entry.name.startswith("."):
                continue
            if entry.is_dir():
                folders |= set() if entry.is_symlink() else {inside}
            elif entry.name.endswith(SUFFIX):
                try:
                    found = entry.stat()
                except OSError:
                    # A link that leads nowhere: reading its head says so.
                    files.append(_Found(inside[: -len(SUFFIX)], entry.path, 0, 0))
                else:
                    files.append(_Found(inside[: -len(SUFFIX)], entry.path, found.st_size, found.st_mtime_ns))
    return folders, files


def _folder_state(top: Path, name: str) -> list[int] | None:
    """Return the times of a folder's names and of the folder; None if it is missing, or a link."""
    try:
        found = os.stat(f"{top}{os.sep}{name}", follow_symlinks=not name)  # noqa: PTH116
    except OSError:
        return None
    return [found.st_mtime_ns, found.st_ctime_ns] if stat.S_ISDIR(found.st_mode) else None


def _row(file: _Found, one: Summary) -> Row | None:
    """Make the row of a file, in the order of `_COLUMNS`; None if its head does not fit a table."""
    said = [SORTED_BY[name](one) for name in _SAID]
    lab = one.lab or (None, None, None)
    texts = [file.id, _parent(file.id), order_key(file.id), file.id.casefold()]
    try:
        "".join([*texts, *(value for value in said if isinstance(value, str))]).encode()
    except UnicodeEncodeError:
        return None
    numbers = [value for value in (*said, *lab) if isinstance(value, int | float)]
    if any(math.isnan(value) or abs(value) >= 1 << 62 for value in numbers):
        return None
    values = dict(zip(_SAID, said, strict=True)) | {"a": lab[1], "b": lab[2]}
    values |= dict(zip(("id", "folder", "place", "folded"), texts, strict=True)) | {
        "size": file.size,
        "time": file.time,
    }
    return tuple(values[name] for name in _COLUMNS)


def _like(pattern: str) -> str:
    """Translate a pattern of `Query` to LIKE, matching at least as much: character sets become any character."""
    text = re.sub(r"[\\%_]", r"\\\g<0>", pattern.casefold())
    return re.sub(r"\[!?\]?[^\]]*\]", "?", text).replace("*", "%").replace("?", "_")


def _distances(near: np.ndarray, labs: Float[np.ndarray, "N 3"], formula: FormulaName) -> Float[np.ndarray, " N"]:
    """Compute ΔE of colours from the reference `near`, in cached blocks."""
    far = np.empty(len(labs))
    for first in range(0, len(labs), _BLOCK):
        some = labs[first : first + _BLOCK]
        far[first : first + _BLOCK] = delta_e_lab(np.broadcast_to(near, some.shape), some, formula)
    return far


def _connection(database: str) -> Any:
    import duckdb

    # Nothing is fetched from anywhere.
    alone = {"autoinstall_known_extensions": "false", "autoload_known_extensions": "false"}
    return duckdb.connect(database, config={"memory_limit": "1GB", **alone})


def _view(connection: Any, table: Path | None) -> None:
    """Have all rows of a table and beside it, with their numbers, as `every`, and those that hold as `heads`."""
    every = f"SELECT *, rowid + {_BEYOND} AS number FROM changed"
    if table is not None:
        read = f"read_parquet('{_quoted(table)}', file_row_number = true)"
        every = f"SELECT * EXCLUDE file_row_number, file_row_number AS number FROM {read} UNION ALL {every}"
    connection.execute(f"CREATE OR REPLACE VIEW every AS {every}")
    gone = connection.execute("SELECT count(*) FROM gone").fetchone()[0]
    rest = " WHERE number NOT IN (SELECT number FROM gone)" if gone else ""
    connection.execute(f"CREATE OR REPLACE VIEW heads AS SELECT * FROM every{rest}")


def _quoted(path: Path) -> str:
    return str(path).replace("'", "''")


def _parent(material_id: str) -> str:
    return material_id.rpartition("/")[0]


def _stamp(path: Path) -> tuple[int, ...] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
