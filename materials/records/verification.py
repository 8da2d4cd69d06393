"""Verification of a catalogue: checksums, heads, and a new measurement of every declared error.

A material passes if its file is as it was written, and if the error of its packs, measured on the sphere of `protocol`
against its own data, is as declared, to within `TOLERANCE` ΔE94 in mean, 95th and 99th percentile and maximum; and its
environment form likewise, by the protocol of `slices.error`.
"""

from __future__ import annotations

import platform
import re
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...runtime.code_hash import product_hash
from ...runtime.dask_cluster import clustered
from ...runtime.errors import InputError, MetamerError
from ...runtime.files import half_written, of_the_system
from ...runtime.memory import gigabytes
from ...runtime.worker_pool import Lost, Task, supervised, usable_cores
from ..btf.form import BtfForm, FieldForm
from ..btf.reduced import reduced
from ..btf.surface import MeasuredBtf
from ..btf.texel_error import measured
from ..core.brdf import Brdf
from ..core.fit_error import FitError
from ..core.protocol import sphere_protocol
from ..factored.pack import FactoredBrdf
from ..slices.error import measured_form, text_of
from .material import MaterialRecord
from .query import material_files
from .record import SUFFIX, material_path, read_record, stored_arrays
from .record_head import IMPORT_AGAIN, other_material
from .stored_array import StoredArray
from .stored_files import StoredFiles

#: ΔE94: other processors round otherwise, by far less than this.
TOLERANCE = 0.01
_FIGURES = ("mean", "p95", "p99", "maximum")
# Places of the other errors in a file.
_ENVIRONMENT = "packs/slices/error"
_TEXELS = "texel_error"
# Texels of a form that are decoded, evenly over the sample.
_DECODED = 64
# Share of the largest number in a basis by which the same basis may differ.
_SAME = 1e-6


@dataclass(frozen=True)
class Verified:
    """Verification of one material: its defect, or None; the declared error and the measured one.

    declared_environment, measured_environment : those of its environment form, if it stores one.
    declared_texels, measured_texels : those of single texels of a BTF.

    note : why the error was not measured, if it was not.
    missing : an absent file outside of the catalogue that holds large arrays.
    """

    id: str
    problem: InputError | None = None
    declared: FitError | None = None
    measured: FitError | None = None
    note: str = ""
    missing: Path | None = None
    declared_environment: FitError | None = None
    measured_environment: FitError | None = None
    declared_texels: FitError | None = None
    measured_texels: FitError | None = None


@dataclass(frozen=True)
class CatalogueVerification:
    """All materials, sorted by id, and half-written leftovers of killed imports."""

    folder: Path
    results: tuple[Verified, ...]
    strays: tuple[Path, ...]

    @property
    def damaged(self) -> tuple[Verified, ...]:
        """Records that are damaged."""
        return tuple(one for one in self.results if one.problem is not None)

    @property
    def incomplete(self) -> tuple[Verified, ...]:
        """Intact records that refer to a missing file."""
        return tuple(one for one in self.results if one.problem is None and one.missing is not None)

    @property
    def intact(self) -> tuple[Verified, ...]:
        """Records that are whole and undamaged."""
        return tuple(one for one in self.results if one.problem is None and one.missing is None)


def verify_catalogue(
    folder: Path,
    *,
    quick: bool = False,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[int, int, str], None] = lambda done, total, material_id: None,
) -> CatalogueVerification:
    """Verify every material file below `folder`.

    Parameters
    ----------
    quick : checksums and heads (except their colour) only; errors are not measured again.
    jobs : processes; default one a core.
    scheduler : address of a Dask scheduler whose workers verify instead; they find the files where they are here.
    progress : called with (done, total, id) after each material; while large arrays are read, also with the bytes.

    Raises
    ------
    InputError : as `dask_cluster.clustered` does; a worker that does not find the files that are here.
    """
    files = [(name, material_path(folder, name)) for name in sorted(name for name, _ in material_files(folder, SUFFIX))]
    found: list[Verified] = []
    read = Counter[str]()

    def reading(material_id: str, more: int) -> None:
        read[material_id] += more
        progress(len(found), len(files), f"{material_id}, {gigabytes(read[material_id])} read")

    # A process takes a second to start.
    enough = max(1, len(files) // (200 if quick else 8))
    if scheduler is None:
        verified = _each(files, quick, min(jobs or usable_cores(), enough), reading)
    else:
        verified = _each_on_cluster(files, quick, scheduler)
    for one in verified:
        found.append(one)
        progress(len(found), len(files), one.id)
    return CatalogueVerification(folder, tuple(sorted(found, key=lambda one: one.id)), half_written(folder))


def _each(
    files: list[tuple[str, Path]], quick: bool, jobs: int, reading: Callable[[str, int], None]
) -> Iterator[Verified]:
    if jobs <= 1:
        for material_id, path in files:
            yield verify_material(material_id, path, quick, say=partial(reading, material_id))
        return
    tasks = (Task(file[0], (*file, quick)) for file in files)
    yield from _found(supervised(verify_material, tasks, jobs, reading))


def _each_on_cluster(files: list[tuple[str, Path]], quick: bool, scheduler: str) -> Iterator[Verified]:
    tasks = (Task(file[0], (*file, quick, _state(file[1]))) for file in files)
    yield from _found(clustered(_verify_the_same, tasks, scheduler, _code))


def _code() -> str:
    """Hash the code that must be equal on both sides."""
    return product_hash(("runtime", "spectral", "materials"))


def _found(results: Generator[tuple[str, Any], None, None]) -> Iterator[Verified]:
    with closing(results):
        for material_id, result in results:
            yield (
                Verified(material_id, InputError(result.reason, field=material_id))
                if isinstance(result, Lost)
                else result
            )


def _state(path: Path) -> tuple[int, int]:
    """Return size and time of a file, by which a worker recognises the caller's file."""
    try:
        found = path.stat()
    except OSError as reason:
        raise of_the_system(reason, path) from None
    return found.st_size, found.st_mtime_ns


def _verify_the_same(material_id: str, path: Path, quick: bool, state: tuple[int, int]) -> Verified:
    """Verify a file on a worker, where it must equal the caller's."""
    if not path.is_file() or _state(path) != state:
        raise InputError(
            "a worker does not find the file that is here",
            file=path,
            found=f"another file on {platform.node()}" if path.is_file() else f"none on {platform.node()}",
            expected="the catalogue on a file system that all workers have in the same place",
        )
    return verify_material(material_id, path, quick)


def verify_material(
    material_id: str, path: Path, quick: bool = False, say: Callable[[int], None] = lambda read: None
) -> Verified:
    """Verify one file; defects are returned in `problem`. say : receives the bytes of large arrays as they are read."""
    try:
        record = read_record(path, check_colour=not quick)
        if record.id != material_id:
            raise other_material(path, record.id, material_id)
        declared = record.error
        gone = [array for array in stored_arrays(record) if not array.is_there]
        for array in stored_arrays(record):
            if array.file not in [one.file for one in gone]:
                replace(array, heard=say).check()
        check_decodes(record)
        if gone:
            return Verified(material_id, declared=declared, note=gone_words(gone), missing=Path(gone[0].file))
        if quick or declared is None or record.fast is None:
            return Verified(material_id, declared=declared, note="" if quick or declared is None else "no packs")
        measured = measured_again(record)
        if measured is None:
            return Verified(material_id, None, declared, note=f"declared by another protocol: {declared.protocol}")
        said, found = record.environment_error, environment_measured_again(record)
        problem = _mismatch(declared, measured, path)
        if problem is None and said is not None and found is not None:
            problem = _mismatch(said, found, path, _ENVIRONMENT)
        texels, again = record.fast.texel_error, texels_measured_again(record)
        if problem is None and texels is not None and again is not None:
            problem = _mismatch(texels, again, path, _TEXELS)
        note = "" if texels is None or again is not None else f"of texels, by another protocol: {texels.protocol}"
        return Verified(material_id, problem, declared, measured, note, None, said, found, texels, again)
    except InputError as reason:
        # An error in a file of large arrays does not name its material.
        named = reason if reason.file in (None, path) else reason.at(named_in=material_id)
        return Verified(material_id, named)
    except (MetamerError, ArithmeticError, ValueError, MemoryError) as reason:
        return Verified(material_id, InputError("cannot be measured", file=path, found=str(reason)))


def measured_again(record: MaterialRecord) -> FitError | None:
    """Measure the error of a record's packs as its `error` describes; None if this version cannot."""
    declared = record.error
    size = None if declared is None else re.match(r"sphere (\d+) x \1,", declared.protocol)
    if declared is None or size is None or record.fast is None:
        return None
    original, pixels, isotropic = record.surface(), int(size[1]), None
    if isinstance(original, Brdf) and not original.bispectral:
        isotropic = all(lobe.brdf.isotropic for lobe in original.lobes())
    isotropic = original.isotropic if isotropic is None else isotropic
    sphere = sphere_protocol(pixels, isotropic, light=declared.light)
    if (sphere.text, sphere.observer) != (declared.protocol, declared.observer):
        return None
    names = [one.light for one in declared.lights] or [declared.light]
    return sphere.compare_lights(sphere.references(original, names), sphere.samples(record.fast, names), names)


def environment_measured_again(record: MaterialRecord) -> FitError | None:
    """Measure the error of a record's environment form; None if there is none, or by another protocol."""
    declared = record.environment_error
    if declared is None or not isinstance(record.fast, FactoredBrdf) or record.fast.slices is None:
        return None
    original = record.surface()
    if declared.protocol != text_of(original.isotropic):
        return None
    return measured_form(record.fast.slices, original).error


def _mismatch(declared: FitError, measured: FitError, path: Path, field: str = "error") -> InputError | None:
    pairs = list(zip(declared.lights or (declared,), measured.lights, strict=True))
    off = [
        (one.light, name, getattr(one, name), getattr(other, name))
        for one, other in pairs
        for name in _FIGURES
        if not abs(getattr(one, name) - getattr(other, name)) <= TOLERANCE
    ]
    if not off:
        return None
    return InputError(
        "the declared error does not hold",
        file=path,
        field=field,
        found=", ".join(f"{name} {found:.4f} measured under {light}" for light, name, _, found in off),
        expected=", ".join(f"{name} {said:.4f}" for _, name, said, _ in off) + f", within {TOLERANCE:g} ΔE94",
        hint=IMPORT_AGAIN,
    )


def check_decodes(record: MaterialRecord) -> None:
    """Decode texels all over the sample, in every view and light; nothing without a fast form of a BTF.

    Raises
    ------
    InputError : a form that does not decode, or to numbers that are not finite.
    """
    fast = record.fast
    if not isinstance(fast, BtfForm | FieldForm):
        return
    form = fast.texels.form
    count = form.height * form.width if isinstance(fast, FieldForm) else fast.texels.form.number.size
    texels = np.unique(np.linspace(0, count - 1, _DECODED).astype(np.int64))
    try:
        for texel, values in zip(texels.tolist(), form.decoded(texels), strict=True):
            if not np.isfinite(values).all():
                raise InputError("a fast form that is not finite", field=f"texel {texel}", expected="numbers")
    except IndexError as reason:
        raise InputError("a fast form that does not decode", field=fast.WORDS, found=str(reason)) from None


def texels_measured_again(record: MaterialRecord) -> FitError | None:
    """Measure the error of texels as `btf_form` does, on the texels that it draws.

    None if none is declared, or if it was measured differently: by another protocol, or in a basis of few coefficients
    whose vectors are found otherwise here.
    """
    fast, declared = record.fast, None if record.fast is None else record.fast.texel_error
    if declared is None or not isinstance(fast, BtfForm | FieldForm):
        return None
    surface = record.surface()
    if not isinstance(surface, MeasuredBtf):
        return None
    form, images = fast.texels.form, reduced(surface.images)
    ours, theirs = images.basis.synthesis, form.basis.synthesis
    if ours.shape != theirs.shape or not np.allclose(ours, theirs, rtol=0.0, atol=_SAME * np.abs(theirs).max()):
        return None
    found = measured(images, form, seed=1)
    return found if (found.protocol, found.observer) == (declared.protocol, declared.observer) else None


def gone_words(gone: Sequence[StoredArray]) -> str:
    """Describe missing files, and their place; for images, the count and the total."""
    first = gone[0]
    if not isinstance(first, StoredFiles):
        return f"large arrays were left in a file that is gone: {first.file}"
    lost = sum(not (first.file / name).is_file() for name in first.names)
    return f"{lost} of {len(first.names)} images are gone that were left in {first.file}"
