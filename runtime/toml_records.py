"""Frozen records in TOML files and back, field by field: tables are records, arrays of tables are tuples of records.

Types come from the annotations of fields, and the record's own constructor validates values.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from .errors import InputError, UnknownNameError
from .files import read_text, written_whole


@dataclass(frozen=True)
class RecordFile:
    """Kind of TOML file with one record.

    kind : of the record. key : of the version, which identifies such files. version : incremented with every
    incompatible change. words : name in messages. written_by : writer of such files, for hints.
    """

    kind: type
    key: str
    version: int
    words: str
    written_by: str

    def text(self, record: Any) -> str:
        """Write a record as text; errors as of `toml_of`."""
        return f"{self.key} = {self.version}\n{toml_of(record)}\n"

    def write(self, path: str | Path, record: Any) -> None:
        """Write a record beside the target and rename it, so that an old file stays until it is complete.

        Raises
        ------
        InputError, NoRoomError : as of `written_whole`; text that cannot be encoded.
        """
        try:
            text = self.text(record)
        except InputError as error:
            raise error.at(file=path) from error
        with written_whole(path) as beside:
            beside.write_text(text, encoding="utf-8")

    def read(self, path: str | Path) -> Any:
        """Read the file of `write`.

        Raises
        ------
        InputError, UnknownNameError : no such file, not TOML, another kind or version of file, an unknown key, a value
            of the wrong kind or out of range; with file, key, what was found and what is expected.
        """
        hint = f"such a file is written by {self.written_by}"
        try:
            document = tomllib.loads(read_text(path, "a TOML file"))
        except tomllib.TOMLDecodeError as reason:
            raise InputError("not a TOML file", file=path, found=str(reason), hint=hint) from reason
        said, place = document.pop(self.key, None), {"file": path, "field": self.key}
        if said is None:
            raise InputError(f"not a {self.words}", expected=f"{self.version}", hint=hint, **place)
        if type(said) is not int or said < 1:
            raise InputError("not a version", found=repr(said), expected=f"{self.version}", hint=hint, **place)
        if said != self.version:
            problem = f"a {self.words} of {'a newer' if said > self.version else 'an older'} Metamer"
            expected = f"{self.version}, which is what this one reads"
            hint = "open it with the Metamer that wrote it, or begin a new one"
            raise InputError(problem, found=said, expected=expected, hint=hint, **place)
        try:
            return record_of(self.kind, document)
        except InputError as error:
            raise error.at(file=path) from error

    def is_one(self, path: str | Path) -> bool:
        """Return whether a file is of this kind, in any version; unreadable files are not."""
        try:
            return self.key in tomllib.loads(read_text(path, "a TOML file"))
        except (InputError, tomllib.TOMLDecodeError):
            return False


def toml_of(record: Any, path: str = "") -> str:
    """Return a record as the lines of a table, without its passing fields; a field that is None is left out.

    Raises
    ------
    InputError : text that UTF-8 cannot encode.
    """
    return "\n".join(_lines(record, path))


def _lines(record: Any, path: str) -> Iterator[str]:
    tables: list[tuple[str, Any]] = []
    for one in _kept(type(record)):
        value, where = getattr(record, one.name), f"{path}.{one.name}" if path else one.name
        if is_dataclass(value) or (isinstance(value, tuple) and value and is_dataclass(value[0])):
            tables.append((where, value))
        elif value is not None:
            yield f"{one.name} = {_value(value, where)}"
    for where, value in tables:
        for item in value if isinstance(value, tuple) else (value,):
            yield ""
            yield f"[[{where}]]" if isinstance(value, tuple) else f"[{where}]"
            yield from _lines(item, where)


def _value(value: Any, where: str) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        try:
            value.encode("utf-8")
        except UnicodeEncodeError:
            expected = "characters of Unicode"
            raise InputError("text that cannot be kept", field=where, found=ascii(value), expected=expected) from None
        # The escapes of JSON are all in TOML; of what TOML does not let stand, JSON lets stand this one.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, tuple):
        return f"[{', '.join(_value(one, where) for one in value)}]"
    return repr(float(value)) if isinstance(value, float) else repr(int(value))


def record_of(kind: type, table: Mapping[str, Any], path: str = "") -> Any:
    """Make the record of a table.

    Raises
    ------
    UnknownNameError : a key that the record does not have. InputError : a key that is missing, a value of the wrong
        kind, or one that the record refuses; with its place in the file.
    """
    hints, there = get_type_hints(kind), {one.name: one for one in _kept(kind)}
    given: dict[str, Any] = {}
    for key, value in table.items():
        where = f"{path}.{key}" if path else key
        if key not in there:
            raise UnknownNameError("key", key, there, field=where)
        given[key] = _read(hints[key], value, where)
    missing = [name for name, one in there.items() if name not in given and _needed(one)]
    if missing:
        raise InputError("a key is missing", field=f"{path}.{missing[0]}" if path else missing[0], expected="a value")
    try:
        return kind(**given)
    except InputError as error:
        raise error.at(field=".".join(filter(None, (path, error.field)))) from error


def _read(kind: Any, value: Any, where: str) -> Any:
    origin, options = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        # TOML has no null: a key that is there has a value.
        (inner,) = (one for one in options if one is not NoneType)
        return _read(inner, value, where)
    if origin is Literal:
        if value not in options or isinstance(value, bool):
            raise UnknownNameError("value", str(value), [str(one) for one in options], field=where)
        return value
    if origin is tuple:
        return _read_tuple(options, value, where)
    if is_dataclass(kind):
        if not isinstance(value, dict):
            raise _wrong(value, f"a table, [{where}]", where)
        return record_of(kind, value, where)  # type: ignore[arg-type]
    if kind is float and type(value) in (int, float):
        try:
            return float(value)
        except OverflowError:
            raise _wrong(value, "a number that fits into 64 bits", where) from None
    if type(value) is not kind:
        words = {bool: "true or false", str: "text in quotes", int: "a whole number", float: "a number"}
        raise _wrong(value, words[kind], where)
    return value


def _read_tuple(options: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    several = len(options) == 2 and options[1] is Ellipsis
    tables = several and is_dataclass(options[0])
    if not isinstance(value, list) or not (several or len(value) == len(options)):
        words = f"tables, [[{where}]]" if tables else f"a list of {'values' if several else f'{len(options)} values'}"
        raise _wrong(value, words, where)
    kinds = [options[0]] * len(value) if several else options
    each = enumerate(zip(kinds, value, strict=True), 1)
    return tuple(_read(kind, one, f"{where} {number}") for number, (kind, one) in each)


def _wrong(value: Any, expected: str, where: str) -> InputError:
    return InputError("wrong kind of value", field=where, found=repr(value), expected=expected)


def _kept(kind: type) -> list[Field[Any]]:
    return [one for one in fields(kind) if not one.metadata.get("passing")]


def _needed(one: Field[Any]) -> bool:
    return one.default is MISSING and one.default_factory is MISSING
