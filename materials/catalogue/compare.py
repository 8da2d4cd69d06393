"""Changes between two catalogues or two materials, in ΔE94 on the sphere of `protocol`, light by light.

The reference is always the first of the two: its packs ("packs": what pictures show) or its original data ("original":
what was measured). The second is taken from the same, so that with "original" a new fit of old data is no change.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, MetamerError
from ...runtime.worker_pool import each_done, usable_cores
from ...spectral.difference import delta_e_xyz
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import Observer, observer
from ...spectral.spectrum import Spectrum
from ..btf.difference import texel_difference
from ..btf.form import BtfForm, FieldForm
from ..core.fast import Fast
from ..core.protocol import sphere_protocol
from ..factored.pack import FactoredBrdf
from ..records.material import MaterialRecord
from ..records.query import Summary
from ..records.record import read_record, stored_arrays
from ..slices.error import error_between, samples
from .catalogue import Catalogue

Of = Literal["packs", "original"]
Status = Literal["added", "removed", "same", "changed", "not comparable", "unusable"]
ILLUMINANTS = ("D65", "A", "FL11")
_PIXELS = 96
# ΔE94 below which environment forms count as equal.
_ALIKE = 0.0005


@dataclass(frozen=True)
class LightDifference:
    """ΔE94 over the samples of the sphere under one light; of a spectrum without a surface, one number four times.

    where : of texels, the one with the largest difference, with its light and view.
    """

    light: str
    mean: float
    p95: float
    p99: float
    maximum: float
    where: str = ""


@dataclass(frozen=True)
class MaterialDifference:
    """Change of one material. `words`: further remarks, such as a change of model.

    texels : of the fast forms of BTFs, over texels, views and lights that both have, with the place of the largest.
    """

    id: str
    status: Status
    words: str = ""
    lights: tuple[LightDifference, ...] = ()
    texels: tuple[LightDifference, ...] = ()

    @property
    def worst(self) -> LightDifference | None:
        """The light under which the 99th percentile is largest."""
        return max(self.lights, key=lambda one: one.p99, default=None)


@dataclass(frozen=True)
class CatalogueComparison:
    """Differences of all materials, sorted by id, and their protocol."""

    differences: tuple[MaterialDifference, ...]
    of: Of
    illuminants: tuple[str, ...]
    observer: str

    def count(self, status: Status) -> int:
        """Materials with that status."""
        return sum(one.status == status for one in self.differences)

    @property
    def largest(self) -> float:
        """Largest ΔE94 p99 of any material under any light, of its texels too; 0 if none was measured."""
        return max((light.p99 for one in self.differences for light in (*one.lights, *one.texels)), default=0.0)

    @property
    def protocol(self) -> str:
        """Protocol of the differences, in words."""
        what = "fast forms" if self.of == "packs" else "original data"
        return (
            f"ΔE94 of the {what} of B against those of A, the reference: sphere {_PIXELS} x {_PIXELS}, directional "
            f"lights from five sides, under {', '.join(self.illuminants)}, observer {self.observer}"
        )


def compare_catalogues(
    a: Catalogue,
    b: Catalogue,
    *,
    illuminants: Sequence[str] = ILLUMINANTS,
    observer_name: str = "1931_2",
    of: Of = "packs",
    jobs: int | None = None,
    progress: Callable[[int, int, str], None] = lambda done, total, material_id: None,
) -> CatalogueComparison:
    """Compare materials of the same id; those with equal checksums in their heads are skipped.

    Raises
    ------
    InputError : an illuminant or the observer is not known.
    """
    for name in illuminants:
        illuminant(name)
    observer(observer_name)
    sides: list[dict[str, Summary | InputError]] = [_heads(side) for side in (a, b)]
    found: list[MaterialDifference] = []
    pending: list[tuple[Summary, Summary]] = []
    for material_id in sorted(sides[0].keys() | sides[1].keys()):
        one, other = (side.get(material_id) for side in sides)
        if isinstance(one, InputError) or isinstance(other, InputError):
            reason = next(side for side in (one, other) if isinstance(side, InputError))
            found.append(MaterialDifference(material_id, "unusable", str(reason)))
        elif one is None or other is None:
            found.append(MaterialDifference(material_id, "added" if one is None else "removed"))
        elif one.checksum == other.checksum:
            found.append(MaterialDifference(material_id, "same"))
        else:
            pending.append((one, other))
    work = partial(_compared, illuminants=tuple(illuminants), observer_name=observer_name, of=of)
    jobs = min(jobs or usable_cores(), max(1, len(pending) // 4))
    for done, one in enumerate(each_done(work, pending, jobs), 1):
        found.append(one)
        progress(done, len(pending), one.id)
    return CatalogueComparison(tuple(sorted(found, key=lambda one: one.id)), of, tuple(illuminants), observer_name)


def compare_records(
    a: MaterialRecord,
    b: MaterialRecord,
    *,
    illuminants: Sequence[str] = ILLUMINANTS,
    observer_name: str = "1931_2",
    of: Of = "packs",
) -> MaterialDifference:
    """Compare two materials, whatever their ids; "not comparable" if their quantities differ.

    Raises
    ------
    InputError : `of` is "original", and a file that holds part of an original is missing.
    """
    name = a.id if a.id == b.id else f"{a.id} -> {b.id}"
    said = [] if a.model == b.model else [f"model {a.model} -> {b.model}"]
    if a.provenance.kind != b.provenance.kind:
        said.append(f"kind {a.provenance.kind} -> {b.provenance.kind}")
    if of == "original":
        for record in (a, b):
            _check_original(record)
    elif changed := _environment_words(a, b):
        said.append(changed)
    if of == "packs" and a.fast is not None and b.fast is not None:
        said += _form_words(a.fast, b.fast)
    lights, eye = [illuminant(light) for light in illuminants], observer(observer_name)
    texels: tuple[LightDifference, ...] = ()
    if of == "packs" and isinstance(a.fast, BtfForm | FieldForm) and isinstance(b.fast, BtfForm | FieldForm):
        apart = texel_difference(a.fast, b.fast, Folding(eye, lights))
        rows = zip(illuminants, apart.each, apart.where, strict=True) if apart.where else ()
        texels = tuple(replace(_statistics(light, each), where=where) for light, each, where in rows)
        said.append(apart.compared)
    words = ", ".join(said)
    if a.fast is not None and b.fast is not None:
        isotropic = a.fast.isotropic and b.fast.isotropic
        sphere = sphere_protocol(_PIXELS, isotropic)
        folding = Folding(eye, lights, np.pi)
        reference, sample = (
            sphere.fast_xyz(fast, folding) if of == "packs" else sphere.original_xyz(record.surface(), folding)
            for record, fast in ((a, a.fast), (b, b.fast))
        )
    elif a.quantity == b.quantity:
        reference, sample = (_spectrum_xyz(record, lights, eye) for record in (a, b))
        if a.quantity == "emission":
            # A light has no white but itself: both are scaled to Y = 1, and A is the white.
            difference = delta_e_xyz(reference[0], sample[0], reference[0, 0])
            return MaterialDifference(name, "changed", words, (_statistics("itself", difference),))
    else:
        return MaterialDifference(name, "not comparable", f"{a.quantity} -> {b.quantity}")
    figures = tuple(
        _statistics(light, delta_e_xyz(one, other, eye.white(spectrum)))
        for light, spectrum, one, other in zip(illuminants, lights, reference, sample, strict=True)
    )
    return MaterialDifference(name, "changed", words, figures, texels)


def _check_original(record: MaterialRecord) -> None:
    gone = next((array for array in stored_arrays(record) if not array.is_there), None)
    if gone is not None:
        raise InputError(
            "the original is gone",
            file=gone.file,
            field=record.id,
            found="files that it was left in are not there",
            expected="all of them, as they were imported",
            hint="bring them back, or compare what pictures show: --of packs",
        )


def _form_words(a: Fast, b: Fast) -> list[str]:
    """Describe changes of the kind of form, and of the size and error of forms with a texel error."""
    said = [] if a.WORDS == b.WORDS else [f"form {a.WORDS} -> {b.WORDS}"]
    if a.texel_error is None and b.texel_error is None:
        return said
    sizes = [sum(one.nbytes for one in form.summands) for form in (a, b)]
    errors = ["not measured" if one is None else f"{one.mean:.3f}" for one in (a.texel_error, b.texel_error)]
    name = [] if said else [a.WORDS]
    return [*said, *name, f"bytes {sizes[0]} -> {sizes[1]}", f"texel error mean {errors[0]} -> {errors[1]}"]


def _environment_words(a: MaterialRecord, b: MaterialRecord) -> str:
    """Describe changes of the stored environment forms, by the protocol of `slices.error`; "" without any."""
    forms = [one.fast.slices if isinstance(one.fast, FactoredBrdf) else None for one in (a, b)]
    if forms[0] is None or forms[1] is None:
        return "" if forms[0] is forms[1] else f"environment form {'new' if forms[0] is None else 'gone'}"
    isotropic = forms[0].isotropic and forms[1].isotropic
    found = error_between(samples(forms[0], isotropic), samples(forms[1], isotropic), isotropic)
    return f"environment form p99 {found.p99:.3f} under {found.light}" if found.maximum >= _ALIKE else ""


def _statistics(light: str, difference: Float[np.ndarray, " N"]) -> LightDifference:
    p95, p99 = np.percentile(difference, [95, 99])
    return LightDifference(light, float(difference.mean()), float(p95), float(p99), float(difference.max()))


def _spectrum_xyz(record: MaterialRecord, lights: Sequence[Spectrum], eye: Observer) -> Float[np.ndarray, "lights 1 3"]:
    spectrum = record.measured_spectrum()
    if spectrum is None or spectrum.samples.ndim != 1:
        raise InputError("no spectrum to compare", field=record.id, expected="wavelengths_nm and values in `original`")
    if spectrum.quantity == "emission":
        xyz = eye.sensitivity(spectrum.wavelengths_nm) @ spectrum.samples
        if not xyz[1] > 0:
            raise InputError("a light without power", field=record.id, found=f"Y = {xyz[1]:g}", expected="above 0")
        return (xyz / xyz[1])[None, None]
    return np.stack([(eye.weights(light, spectrum.wavelengths_nm) @ spectrum.samples)[None] for light in lights])


def _heads(catalogue: Catalogue) -> dict[str, Any]:
    ids = catalogue.ids()
    return dict(zip(ids, catalogue.summaries(ids), strict=True))


def _compared(a: Summary, b: Summary, illuminants: tuple[str, ...], observer_name: str, of: Of) -> MaterialDifference:
    try:
        records = read_record(a.file), read_record(b.file)
        return compare_records(*records, illuminants=illuminants, observer_name=observer_name, of=of)
    except MetamerError as reason:
        return MaterialDifference(a.id, "unusable", str(reason))
