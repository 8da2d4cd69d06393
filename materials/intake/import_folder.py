"""The folder of a catalogue while an import writes to it: its marker, and what a killed one left."""

from __future__ import annotations

from pathlib import Path

from ...runtime.errors import InputError
from ...runtime.files import half_written, made_folder
from ...runtime.locks import remove_abandoned
from ..records.record import MARKER, SUFFIX, check_marker, write_marker
from . import import_history

# An import writes no other files: what else is there is not its own to clear away.
_WRITTEN = (SUFFIX, Path(MARKER).suffix, Path(import_history.FILE).suffix)


def prepare_folder(folder: Path) -> None:
    """Make the folder, say in it that it is a catalogue, and clear away what an import that was killed left half-done.

    Several imports may write to one folder at once: each holds what it is writing, and nobody clears that away.

    Raises
    ------
    InputError
        The folder cannot be made or written to, or holds something else.
    """
    made_folder(folder)
    _mark(folder)
    for stray in half_written(folder, _WRITTEN):
        remove_abandoned(stray)


def _mark(folder: Path) -> None:
    if (folder / MARKER).exists():
        check_marker(folder)
        return
    # Hidden files may be another import's, at work or broken off.
    strangers = [entry.name for entry in folder.iterdir() if not entry.name.startswith(".")]
    if strangers:
        hint = "name an empty or a new folder: --catalogue FOLDER"
        raise InputError("not a catalogue", file=folder, found=f"other files, such as {strangers[0]}", hint=hint)
    write_marker(folder)
