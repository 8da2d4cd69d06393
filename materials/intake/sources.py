"""Sources of materials from the inputs of an import; `formats.registry` finds the reader for each."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions, contradiction
from ...spectral.upsampling import DEFAULT_METHOD, METHODS
from ..formats.registry import not_a_source, recognised_files
from ..records.models import quantity_of
from ..records.source import MaterialSource, Rejected
from .inputs import inputs_of


def read_sources(
    path: str | Path, uplift: str = DEFAULT_METHOD, answer: ImportOptions = NO_ANSWER
) -> tuple[MaterialSource | Rejected, ...]:
    """Return every material that a file, or a folder of files, gives.

    uplift : upsampling of RGB measurements to spectra; one of `spectral.upsampling.METHODS`.
    answer : the measured quantity, for files that do not state it.

    Unusable materials are returned as `Rejected`, so that one bad spectrum does not stop the others; only a path that
    is not a source at all raises `InputError`.
    """
    check_uplift(uplift)
    with inputs_of([path]) as files:
        found: list[MaterialSource | Rejected] = []
        taken = False
        for file, reader in recognised_files(files):
            if isinstance(file, Rejected):
                found.append(file)
            elif reader is not None:
                found += read_with(reader, file.path, uplift, answer)
            elif file.named:
                raise not_a_source(file.path)
            else:
                continue
            taken = True
        if not taken:
            raise nothing_to_import(Path(path), len(files))
    return tuple(found)


def check_uplift(uplift: str) -> None:
    """Raise `UnknownNameError` for an unknown method."""
    if uplift not in METHODS:
        raise UnknownNameError("upsampling method", uplift, METHODS)


def read_with(
    reader: Any, path: Path, uplift: str, answer: ImportOptions = NO_ANSWER
) -> Iterator[MaterialSource | Rejected]:
    """Yield the materials that one format's reader finds in a file; a refusal of the whole file is a `Rejected`.

    The format's own statements prevail: of another quantity than the answer, a spectrum is refused or kept as it is.
    """
    try:
        if getattr(reader, "ASKS", False):
            yield from reader.read_sources(path, uplift, answer)
            return
        more = (answer,) if getattr(reader, "ASKS_MORE", False) else ()
        for material in reader.read_sources(path, uplift, *more):
            kept = answer.against == "kept" or not isinstance(material, MaterialSource)
            if not kept and not answer.allows(said := _surface(material.model)):
                refusal = contradiction(answer, said, f"the format ({reader.NAME})", file=path, field=material.id)
                yield Rejected(material.id, refusal)
            else:
                yield material
    except InputError as reason:
        yield Rejected(path.name, reason)
    except Exception as reason:
        # A defect of ours costs one file, not the import of a thousand.
        found = f"{type(reason).__name__}: {reason}".split("\n")[0]
        hint = "report it with the file: a reader should say what is wrong with it"
        problem = f"the reader of {reader.NAME} broke down"
        refusal = InputError(problem, file=path, found=found, hint=hint)
        refusal.__cause__ = reason
        yield Rejected(path.name, refusal)


def _surface(model: str) -> str:
    """Return the quantity of a model's data; fluorescence does not make it a light."""
    quantity = quantity_of(model)
    return "reflectance" if quantity == "bispectral" else quantity


def nothing_to_import(path: str | Path, looked_at: int) -> InputError:
    """Return the refusal of a folder or pattern in which nothing was recognised."""
    found = f"{looked_at} files, none of a known format" if looked_at else "no files"
    hint = "metamer catalogue import --help names the formats"
    return InputError("nothing to import", file=path, found=found, expected="files of materials", hint=hint)
