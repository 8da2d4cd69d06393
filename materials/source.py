"""What a material is before its fit: what every format of files gives, or why it gives none."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..spectral.errors import InputError
from .records.material import Provenance


@dataclass(frozen=True)
class MaterialSource:
    """One material before its fit: what a `MaterialRecord` says but the packs; `file` is for messages.

    taken : which quantity and scale it was taken for, and by which signs, for a plan; "" where its format says so.
    """

    id: str
    family: str
    model: str
    parameters: Mapping[str, Any]
    provenance: Provenance
    file: Path
    original: Mapping[str, Any] = field(default_factory=dict)
    taken: str = ""

    @property
    def content_hash(self) -> str:
        """SHA-256 of everything that the record would take from here."""
        digest = hashlib.sha256(f"{self.id}|{self.family}|{self.model}|{self.provenance}".encode())
        for part in (self.parameters, self.original):
            for name in sorted(part):
                value = np.asarray(part[name])
                # A text's array has its length as its type: what follows is never taken for a part of it.
                digest.update(f"|{name}:{value.dtype.str}:{value.shape}|".encode() + value.tobytes())
            digest.update(b"||")
        return digest.hexdigest()

    @property
    def size(self) -> int:
        """Bytes of all its numbers."""
        return sum(np.asarray(value).nbytes for part in (self.parameters, self.original) for value in part.values())


@dataclass(frozen=True)
class Rejected:
    """A source, or one material of it, that cannot be used."""

    name: str
    reason: InputError
