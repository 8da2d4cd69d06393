"""Folder of a review in progress: finished rows are stored in `unfinished` and moved into place at the end.

    out/unfinished/KEY/rows.npz, pictures/...    a material that is drawn, under all lights
    out/rows/KEY.npz, out/pictures/...           the same once the report is there

KEY is a hash of everything that the rows depend on. A later review into the same folder reuses rows with equal keys and
unchanged images.
"""

from __future__ import annotations

import hashlib
import shutil
import zipfile
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from ...calibration.report.history import HISTORY
from ...calibration.report.row_files import DrawnRows, read_file_names, read_rows, write_rows
from ...runtime.files import check_writable, half_written, made_folder
from ...runtime.locks import alone_at_work, remove_abandoned
from ...runtime.shutdown import clearing, undisturbed
from .files import PICTURES

UNFINISHED, ROWS = "unfinished", "rows"
REPORT = ("index.html", "review.json")
# Exceptions of numpy and JSON for a damaged file or one of another version.
_UNREADABLE = (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile)


@contextmanager
def drawing_into(out: Path) -> Iterator[None]:
    """Create the folder, locked for one review at a time, and remove remains of a killed one.

    Raises
    ------
    InputError
        The folder cannot be created or written to, or another review is using it.
    """
    new = not out.exists()

    def clear_empty() -> None:
        for folder in (out / UNFINISHED, *([out] if new else [])):
            with suppress(OSError):
                folder.rmdir()

    with clearing(clear_empty):
        made_folder(out)
        with alone_at_work(out, "another review is being drawn into this folder"):
            for stray in half_written(out):
                remove_abandoned(stray)
            for stray in (out / UNFINISHED).glob(".*"):
                shutil.rmtree(stray, ignore_errors=True)
            for name in (*REPORT, HISTORY):
                check_writable(out / name)
            yield


def found_rows(out: Path, key: str) -> DrawnRows | None:
    """Return the rows of a key from an earlier review, if their images exist unchanged; else None."""
    for file, folder in ((out / UNFINISHED / key / "rows.npz", out / UNFINISHED / key), (_place(out, key), out)):
        with suppress(*_UNREADABLE):
            drawn = read_rows(file)
            if all(_digest(folder / name) == digest for name, digest in drawn.files.items()):
                return drawn
    return None


@contextmanager
def drawn_rows(out: Path, key: str) -> Iterator[tuple[Path, list[DrawnRows]]]:
    """Yield a folder for the images of one key, and a list for its rows; both are stored when the block succeeds."""
    work = out / UNFINISHED / f".{key}"
    drawn: list[DrawnRows] = []
    with clearing(lambda: shutil.rmtree(work, ignore_errors=True)):
        (work / PICTURES).mkdir(parents=True)
        yield work, drawn
        files = [path for path in sorted(work.rglob("*")) if path.is_file()]
        digests = {path.relative_to(work).as_posix(): _digest(path) for path in files}
        write_rows(work / "rows.npz", replace(drawn[0], files=digests))
        with undisturbed():
            shutil.rmtree(out / UNFINISHED / key, ignore_errors=True)
            work.rename(out / UNFINISHED / key)


def put_in_place(out: Path, keys: Sequence[str], report: Path) -> None:
    """Move the rows of these keys and the files in the folder `report` into place, and remove all others.

    The old report is removed first and the new one comes last, so that images never accompany figures of another
    review.
    """
    with undisturbed():
        for name in REPORT:
            (out / name).unlink(missing_ok=True)
        (out / PICTURES).mkdir(exist_ok=True)
        (out / ROWS).mkdir(exist_ok=True)
        for key in dict.fromkeys(keys):
            drawn = out / UNFINISHED / key
            if drawn.is_dir():
                for picture in (drawn / PICTURES).iterdir():
                    picture.replace(out / PICTURES / picture.name)
                (drawn / "rows.npz").replace(_place(out, key))
        _forget_all_but(out, keys)
        for name in (HISTORY, *REPORT):
            (report / name).replace(out / name)
        shutil.rmtree(out / UNFINISHED, ignore_errors=True)


def _forget_all_but(out: Path, keys: Collection[str]) -> None:
    """Remove rows of earlier reviews and images used only by them."""
    ours = {_place(out, key) for key in keys}
    others = [file for file in (out / ROWS).glob("*.npz") if file not in ours]
    stale = {name for file in others for name in _pictures_of(file)}
    # Usually there are none, and own rows need not be read.
    for name in stale and stale - {name for file in ours for name in _pictures_of(file)}:
        (out / PICTURES / name).unlink(missing_ok=True)
    for file in others:
        file.unlink()


def _pictures_of(file: Path) -> list[str]:
    with suppress(*_UNREADABLE):
        return [Path(name).name for name in read_file_names(file)]
    return []


def _place(out: Path, key: str) -> Path:
    return out / ROWS / f"{key}.npz"


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
