"""Material sources before their fit, as yielded by every format, and rejected ones."""

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
    """Material before its fit: the content of a `MaterialRecord` except the packs; `file` is for messages.

    Data too large for memory stay in their file, as a `StoredArray`, which its users open.

    taken : assumed quantity and scale, and the evidence, for a plan; "" if its format states them.
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
        """SHA-256 of everything that enters the record, in memory or in a file."""
        return self.sealed()[1]

    def sealed(self, heard: Callable[[int], None] = lambda read: None) -> tuple[MaterialSource, str]:
        """Return this source with the digests of its stored arrays, which reveal changed files; and its content hash.

        heard : receives the bytes read.
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
        """Return this source with stored arrays that report the bytes read to `heard`."""
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
    """Unusable source, or material of one."""

    name: str
    reason: InputError
