"""Sessions in files: TOML, written whole, read with every mistake named by its place."""

from __future__ import annotations

from pathlib import Path

from ...runtime.toml_records import RecordFile
from .state import Session

SESSION_FILE = RecordFile(
    Session, "metamer_session", 1, "session of the window", "the window: Ctrl+S, or `save` among its commands"
)
VERSION = SESSION_FILE.version


def session_text(session: Session) -> str:
    """Write a session as text, except where the pointer is."""
    return SESSION_FILE.text(session)


def write_session(path: str | Path, session: Session) -> None:
    """Write a session; errors as of `RecordFile.write`."""
    SESSION_FILE.write(path, session)


def read_session(path: str | Path) -> Session:
    """Read what `write_session` wrote; errors as of `RecordFile.read`."""
    return SESSION_FILE.read(path)


def is_session(path: str | Path) -> bool:
    """Return whether a file says that it is a session; what cannot be read is none."""
    return SESSION_FILE.is_one(path)
