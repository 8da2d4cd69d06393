"""Sources of materials before their fit, as every format gives them, and rejected ones."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.errors import InputError
from .material import Provenance
from .stored_array import StoredArray, raw


@dataclass(frozen=True)
class MaterialSource:
    """One material before its fit: what a `MaterialRecord` says but the packs; `file` is for messages.

    What is too large for memory stays in its file, as a `StoredArray`, which whoever works with it opens.

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
        """SHA-256 of everything that the record would take from here, in memory or in a file."""
        return self.sealed()[1]

    def sealed(self, heard: Callable[[int], None] = lambda read: None) -> tuple[MaterialSource, str]:
        """This source with the digests of its stored arrays, so that a file that changes is noticed; its content hash.

        heard : hears of the bytes that are read.
        """
        digest = hashlib.sha256(f"{self.id}|{self.family}|{self.model}|{self.provenance}".encode())
        parts = {}
        for where, part in (("parameters", self.parameters), ("original", self.original)):
            parts[where] = dict(part)
            for name in sorted(part):
                value = part[name] if isinstance(part[name], StoredArray) else np.asarray(part[name])
                # A text's array has its length as its type: what follows is never taken for a part of it.
                digest.update(f"|{name}:{value.dtype.str}:{value.shape}|".encode())
                if isinstance(value, StoredArray):
                    parts[where][name] = replace(value, heard=heard).sealed(digest.update)
                else:
                    digest.update(raw(np.ascontiguousarray(value)))
            digest.update(b"||")
        return (replace(self, **parts) if self.stored else self), digest.hexdigest()

    def heard(self, heard: Callable[[int], None]) -> MaterialSource:
        """This source, whose stored arrays tell `heard` of the bytes that are read of them."""
        if not self.stored:
            return self
        parts = [
            {
                name: replace(value, heard=heard) if isinstance(value, StoredArray) else value
                for name, value in part.items()
            }
            for part in (self.parameters, self.original)
        ]
        return replace(self, parameters=parts[0], original=parts[1])

    @property
    def size(self) -> int:
        """Bytes of its numbers in memory."""
        return sum(np.asarray(value).nbytes for value in self._values() if not isinstance(value, StoredArray))

    @property
    def stored(self) -> int:
        """Bytes of its numbers that stay in files."""
        return sum(value.nbytes for value in self._values() if isinstance(value, StoredArray))

    def _values(self) -> Iterator[Any]:
        yield from self.parameters.values()
        yield from self.original.values()


@dataclass(frozen=True)
class Rejected:
    """A source, or one material of it, that cannot be used."""

    name: str
    reason: InputError
