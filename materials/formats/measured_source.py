"""Material source of one measured BRDF."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, Protocol, runtime_checkable

from ...runtime.errors import InputError
from ..records.material import Provenance
from ..records.source import MaterialSource
from .naming import id_word, printable


@runtime_checkable
class MeasuredBrdf(Protocol):
    """Measured BRDF for an importer: the name of its model, and the parameters to rebuild it."""

    NAME: ClassVar[str]

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on how it was read."""
        ...

    def parameters(self) -> dict[str, Any]:
        """Return the parameters that rebuild it."""
        ...


def measured_source(
    path: Path, brdf: MeasuredBrdf, *, source: str, kind: str, geometry: str, original: Mapping[str, Any]
) -> MaterialSource:
    """Return the measurement in `path` as "measured/NAME"; its notes are those of the BRDF, and the file's SHA-256.

    original : further content of the file; the parameters of `brdf` hold all of its values.
    """
    notes = (*brdf.notes, f"{printable(path.name)}: SHA-256 {sha256_of(path)}")
    provenance = Provenance(printable(source), "not stated in the file", kind, geometry, " + ".join(notes))
    material_id = f"measured/{id_word(path.stem)}"
    return MaterialSource(material_id, "measured", brdf.NAME, brdf.parameters(), provenance, path, original)


@contextmanager
def placed(
    path: Path, field: str | None = None, hint: str | None = None, expected: str | None = None
) -> Iterator[None]:
    """Add this file to errors that have none; the other arguments replace missing parts."""
    try:
        yield
    except InputError as reason:
        raise reason.at(
            file=reason.file or path,
            field=reason.field or field,
            expected=reason.expected or expected,
            hint=reason.hint or hint,
        ) from None


def sha256_of(path: Path) -> str:
    """Compute the SHA-256 of a file's content, read in blocks."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
