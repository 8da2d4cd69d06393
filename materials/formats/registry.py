"""Registry of readers: one module a format, known by content before name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast, runtime_checkable

from ...runtime.errors import InputError
from ..records.source import MaterialSource, Rejected
from .input_file import InputFile, head_of
from .reading_cost import ReadingCost, cost_of_bytes

#: Modules beside this one, the most particular first: the first that recognises a file reads it.
FORMATS = (
    "family",
    "merl",
    "rgl",
    "cornell",
    "btf",
    "bispectral",
    "texture_exr",
    "gltf",
    "maps",
    "spectra",
    "unreadable",
)


@runtime_checkable
class Format(Protocol):
    """Interface of the modules in `FORMATS`.

    A module may also have `reading_cost(path) -> Cost`, if a file's size does not determine it; `companions(path) ->
    Iterable[Path]`, further files of a recognised file, which are not read as sources of their own; `label(path) ->
    str`, if it covers several formats; and `guessed(path) -> bool`, true if the evidence for the format is weak: such a
    file, found in a folder, is skipped if it is unusable, not refused. A format that may not state the measured
    quantity has `ASKS = True`, and `read_sources(path, uplift, answer)`; one that asks other questions has `ASKS_MORE =
    True`, and the same.
    """

    NAME: str
    SUFFIXES: tuple[str, ...]

    def recognises(self, path: Path, head: bytes) -> bool:
        """Return whether a file is of this format, or a damaged one by its name; `head`: its first bytes."""
        ...

    def read_sources(self, path: Path, uplift: str) -> Iterator[MaterialSource | Rejected]:
        """Yield its materials; raises `InputError` if the file as a whole cannot be used."""
        ...


def reading_cost(reader: Format, path: Path) -> ReadingCost:
    """Estimate the largest cost of reading a file, from its size or its header."""
    of_its_own: Callable[[Path], ReadingCost] | None = getattr(reader, "reading_cost", None)
    return of_its_own(path) if of_its_own is not None else cost_of_bytes(path)


# Meshes without materials of their own; scenes read them.
_MESHES = (".obj", ".ply", ".off", ".stl")


@cache
def formats() -> tuple[Format, ...]:
    """Return the readers, in the order of their recognition."""
    return tuple(cast(Format, import_module(f".{name}", __package__)) for name in FORMATS)


def format_for(path: Path, named: bool = False) -> Format | None:
    """Return the reader for a file, None if there is none; raises `InputError` for an unreadable file.

    named : the file was given explicitly: a name typical of a format is then enough, and its reader reports errors in
    the content.
    """
    head = head_of(path)
    known = next((reader for reader in formats() if reader.recognises(path, head)), None)
    if known is None and named:
        for reader in formats():
            getattr(reader, "check_named", lambda path: None)(path)
        known = next((reader for reader in formats() if path.suffix.lower() in reader.SUFFIXES), None)
    return known


def label(reader: Format, path: Path) -> str:
    """Name the format of a file."""
    return getattr(reader, "label", lambda path: reader.NAME)(path)


def guessed(reader: Format, path: Path) -> bool:
    """Return whether the evidence for that format is weak."""
    return getattr(reader, "guessed", lambda path: False)(path)


def companions(reader: Format, path: Path) -> tuple[Path, ...]:
    """Return the further files that belong to a file of that format."""
    return tuple(getattr(reader, "companions", lambda path: ())(path))


def recognised_files(
    files: Iterable[InputFile | Rejected],
    format_of: Callable[[InputFile], Format | None] = lambda file: format_for(file.path, file.named),
) -> list[tuple[InputFile | Rejected, Format | None]]:
    """Return each file with its reader, or None; without companions of others, such as tables and textures.

    format_of : replaces `format_for`.
    """
    found: list[tuple[InputFile | Rejected, Format | None]] = []
    parts: set[Path] = set()
    for file in files:
        if isinstance(file, Rejected):
            found.append((file, None))
            continue
        try:
            reader = format_of(file)
        except InputError as reason:
            found.append((Rejected(file.name, reason), None))
            continue
        found.append((file, reader))
        if reader is not None:
            parts.update(path.resolve() for path in companions(reader, file.path))
    return [(file, reader) for file, reader in found if not _part_of_another(file, parts)]


def _part_of_another(file: InputFile | Rejected, parts: set[Path]) -> bool:
    return isinstance(file, InputFile) and not file.named and bool(parts) and file.path.resolve() in parts


def not_a_source(path: Path) -> InputError:
    """Return the error for a file of no known format."""
    start = head_of(path)[:16]
    if start and path.suffix.lower() in _MESHES:
        return InputError(
            "a mesh, not a material",
            file=path,
            found=path.suffix,
            expected="a measurement, texture maps or a family description",
            hint=f'give it a material in a scene.toml, [[part]] with mesh = "{path.name}" and material = "ID" '
            "(docs/scene.md), and draw that: metamer render scene.toml",
        )
    return InputError(
        "not a material source" if start else "the file is empty",
        file=path,
        found=f"first bytes {start!r}" if start else "0 bytes",
        expected=", ".join(f"{reader.NAME} ({', '.join(reader.SUFFIXES)})" for reader in formats() if reader.SUFFIXES),
        hint="export the measurement in one of these formats" if start else "export or copy it again",
    )
