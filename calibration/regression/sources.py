"""Sources of comparisons: the kind of a path, and the side that it makes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...runtime.errors import InputError
from ...spectral.formats import xlsx
from ...spectral.formats.exr import MAGIC
from ...spectral.formats.registry import format_of
from .baseline import MANIFEST, baseline_side
from .display_png import png_rows
from .picture_files import SeenSpectra, header, picture_rows
from .readings import readings_side
from .review_folder import FIGURES, review_side
from .row import ComparedSide, Row

_PNG = b"\x89PNG\r\n\x1a\n"
# Suffixes of a review's files beside its pictures, which are not compared.
_PASSED_OVER = (".html", ".json", ".md", ".npz", ".toml")


def side_of(path: Path, seen: SeenSpectra, display: str | None = None) -> ComparedSide:
    """Return a baseline, a review's folder, a folder of pictures and readings, a picture, or a file of readings.

    Raises
    ------
    InputError : a missing path, nothing comparable, or a damaged file.
    """
    if path.is_dir():
        if (path / MANIFEST).is_file():
            return baseline_side(path)
        return review_side(path) if (path / FIGURES).is_file() else _folder_side(path, seen, display)
    if not path.exists():
        raise InputError("no such file or folder", file=path, hint="check the path")
    rows = _rows_of(path, None, seen, display)
    if rows is None:
        return readings_side(path, seen)
    facts = header(path) if _head(path).startswith(MAGIC) else {}
    made = {key: facts[key] for key in ("renderer", "software") if key in facts}
    return ComparedSide(path, "picture", tuple(rows), made, _chain(rows, seen))


def _folder_side(folder: Path, seen: SeenSpectra, display: str | None) -> ComparedSide:
    """Return every picture or file of readings of a folder; rows are named by their paths."""
    rows: list[Row] = []
    other = []
    for path in sorted(file for file in folder.rglob("*") if file.is_file() and not file.name.startswith(".")):
        name = path.relative_to(folder).as_posix()
        found = _rows_of(path, name, seen, display)
        if found is not None:
            rows += found
        elif path.suffix.lower() not in _PASSED_OVER and _has_readings(path):
            side = readings_side(path, seen)
            rows += [replace(row, name=row.name._replace(material=f"{name}: {row.name.material}")) for row in side.rows]
        else:
            other.append(name)
    if not rows:
        raise InputError(
            "nothing in this folder can be compared",
            file=folder,
            found=f"{len(other)} files, such as {', '.join(other[:3])}" if other else "no files",
            expected="a review, pictures in XYZ or spectra (EXR), PNG, CxF, CGATS, or a catalogue",
        )
    return ComparedSide(folder, "pictures", tuple(rows), {}, _chain(rows, seen))


def _has_readings(path: Path) -> bool:
    """Return whether a file is of a format of readings; a workbook without a table of wavelengths may be a report."""
    reader = format_of(path)
    return reader is not None and not (reader is xlsx and xlsx.has_no_table(path))


def _rows_of(path: Path, material: str | None, seen: SeenSpectra, display: str | None) -> list[Row] | None:
    head = _head(path)
    if head.startswith(MAGIC):
        return picture_rows(path, material, seen)
    return png_rows(path, material, display) if head.startswith(_PNG) else None


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(len(_PNG))
    except OSError as reason:
        hint = "give yourself the right to read it"
        raise InputError("the file cannot be read", file=path, found=reason.strerror, hint=hint) from None


def _chain(rows: list[Row], seen: SeenSpectra) -> tuple[str, ...]:
    spectral = any("reading" in row.layers for row in rows) or (len(rows) > 1 and rows[0].name.light in seen.lights)
    return (seen.words,) if spectral else ()
