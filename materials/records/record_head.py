"""Head of a material file: the summary for lists, as JSON up to the file's first line feed.

The block, of 512 bytes, 1024, 2048 or 4096, precedes the HDF5 content (HDF5 calls it a user block and skips it). It is
read without HDF5 and is derived from the content: reading a record recomputes it and compares.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...runtime.errors import InputError
from ...runtime.remote import RemotePath

if TYPE_CHECKING:
    from .material import MaterialRecord

FORMAT = "metamer-material"
SCHEMA = 2
#: Most and fewest bytes of a head: HDF5 allows these and the powers of two between.
HEAD_BYTES, _LEAST_BYTES = 4096, 512
_HDF5 = b"\x89HDF"
#: Hint for a file that has changed.
IMPORT_AGAIN = "import the material again: metamer catalogue import --again SOURCE"
#: Hint for a file that is no material.
NAME_A_MATERIAL = "name the .h5 file of a material; metamer catalogue list CAT shows what is in a catalogue"
# A head stays short; the whole text is in the content.
_LONGEST_TEXT = 300


def head_of(record: MaterialRecord, checksum: str, *, colour: bool = True) -> dict[str, Any]:
    """Make the head of a record whose content has that checksum; with its colour if `colour`.

    `colour`: XYZ (Y of the perfect diffuser = 1) and CIELAB at 45 degrees annular : 0 under D65, 1931 2 degrees, as the
    packs have it, or of a spectrum without a surface itself. An emission has a chromaticity (XYZ with Y = 1) alone.
    `sizes`: bytes of the arrays before compression.
    """
    error = record.error
    stated = None
    if error is not None:
        figures = {name: _figure(getattr(error, name)) for name in ("mean", "p95", "p99", "maximum")}
        lights = {one.light: _figure(one.p99) for one in error.lights}
        stated = {**figures, "light": error.light, "observer": error.observer, "lights": lights}
        aims = ((name, getattr(error, name)) for name in ("budget", "score", "more_terms", "more_score"))
        stated |= {name: _figure(value) for name, value in aims if value is not None}
        stated |= {} if error.where is None else {"where": error.where}
    return {
        "format": FORMAT,
        "schema": SCHEMA,
        "id": record.id,
        "family": record.family,
        "model": record.model,
        "kind": record.provenance.kind,
        "quantity": record.quantity,
        "licence": _shortened(record.provenance.licence),
        "terms": [[one.rank, one.frame] for one in record.summands],
        "precision": record.fast.precision if record.fast else "",
        "error": stated,
        "colour": _colour(record) if colour else None,
        "sizes": {
            "packs": sum(one.nbytes for one in record.summands),
            "parameters": _bytes(record.parameters),
            "original": _bytes(record.original),
        },
        "source_hash": record.source_hash,
        "checksum": checksum,
    }


def head_bytes(head: dict[str, Any], path: Path) -> bytes:
    """Format the head for the file: JSON, spaces, a line feed."""
    text = json.dumps(head, ensure_ascii=False, separators=(",", ":")).encode("utf-8")
    if len(text) >= HEAD_BYTES:
        problem = "what the file says of itself is too long"
        raise InputError(
            problem, file=path, field="head", found=f"{len(text)} bytes", expected=f"under {HEAD_BYTES}: shorter names"
        )
    size = _LEAST_BYTES
    while size <= len(text):
        size *= 2
    return text.ljust(size - 1) + b"\n"


def read_head(path: str | Path) -> dict[str, Any]:
    """Return the head of a material file, without opening its content.

    Raises
    ------
    InputError : no such file, one of an older schema, or one that is none.
    """
    try:
        if isinstance(path, RemotePath):
            block = path.first_bytes(HEAD_BYTES)
        else:
            with open(path, "rb", buffering=0) as file:  # noqa: PTH123  pathlib's takes half as long again
                block = file.read(HEAD_BYTES)
    except FileNotFoundError:
        raise no_such_file(path) from None
    except OSError as reason:
        found, expected = reason.strerror or str(reason), "a file that this user may read"
        raise InputError("cannot be read", file=path, found=found, expected=expected, hint=NAME_A_MATERIAL) from None
    return head_from(block, path)


def head_from(block: bytes, path: str | Path) -> dict[str, Any]:
    """Parse the head at the beginning of a file; raises `InputError` as `read_head` does. block : its first bytes."""
    try:
        head = json.loads(block.partition(b"\n")[0])
        if head["format"] != FORMAT:
            raise InputError(
                "not a material file",
                file=path,
                field="format",
                found=head["format"],
                expected=FORMAT,
                hint=NAME_A_MATERIAL,
            )
        schema = head["schema"]
    except (ValueError, TypeError, KeyError, RecursionError):
        if block.startswith(_HDF5):
            # Before heads, files began with HDF5 itself; which schema they are their content says.
            raise InputError(
                "not a material file of this schema", file=path, found="HDF5 without a head", hint=IMPORT_AGAIN
            ) from None
        expected = "a JSON head and HDF5"
        raise InputError(
            "not a readable material file", file=path, found=_begins(block), expected=expected, hint=IMPORT_AGAIN
        ) from None
    if schema != SCHEMA:
        raise other_schema(path, schema)
    return head


def no_such_file(path: str | Path) -> InputError:
    """Return the refusal of a file that is not there."""
    return InputError("no such file", file=path, expected="the file of a material", hint=NAME_A_MATERIAL)


def other_material(path: str | Path, found: object, expected: str) -> InputError:
    """Return the error for a file whose id differs from its place in the catalogue."""
    hint = "material files are renamed by importing them again"
    return InputError("file holds another material", file=path, field="id", found=found, expected=expected, hint=hint)


def other_schema(path: str | Path, schema: object) -> InputError:
    """Return the refusal of a file of another schema."""
    hint = "import the material again, or upgrade metamer"
    return InputError(
        "written by another version", file=path, field="schema", found=schema, expected=str(SCHEMA), hint=hint
    )


def check_head(head: dict[str, Any], record: MaterialRecord, checksum: str, path: Path, colour: bool = False) -> None:
    """Raise an `InputError` if the head does not match the content; its colour is compared only if `colour` is true."""
    expected = head_of(record, checksum, colour=colour)
    for name in sorted(expected.keys() | head.keys()):
        found, true = head.get(name), expected.get(name)
        same = found == true if name != "colour" else not colour or _same_colour(found, true)
        if not same:
            raise InputError(
                "the head of the file says otherwise than its content",
                file=path,
                field=name,
                found=json.dumps(found, ensure_ascii=False),
                expected=json.dumps(true, ensure_ascii=False),
                hint=IMPORT_AGAIN,
            )


def _colour(record: MaterialRecord) -> dict[str, Any] | None:
    # Imported here: it loads the tables of lights and observers.
    from .record_colour import record_colour

    return record_colour(record)


def _same_colour(found: Any, true: Any) -> bool:
    """Return whether words are equal, and numbers within the rounding differences between machines."""
    if isinstance(true, dict):
        return (
            isinstance(found, dict)
            and found.keys() == true.keys()
            and all(_same_colour(found[k], true[k]) for k in true)
        )
    if isinstance(true, list):
        return isinstance(found, list) and len(found) == len(true) and all(map(_same_colour, found, true))
    if isinstance(true, float):
        return isinstance(found, float | int) and abs(found - true) <= 1e-3
    return found == true


def _figure(value: float) -> float | None:
    # JSON has no word for what is not a number.
    return float(f"{value:.6g}") if math.isfinite(value) else None


def _begins(block: bytes) -> str:
    return f"{block[:12]!r}..." if block.strip() else "an empty file" if not block else "blanks"


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_TEXT else text[: _LONGEST_TEXT - 1] + "…"


def _bytes(values: Any) -> int:
    import numpy as np

    # A stored array says it without being read.
    counted = (value if hasattr(value, "nbytes") else np.asarray(value) for value in values.values())
    return sum(value.nbytes for value in counted if value.dtype.kind != "U")
