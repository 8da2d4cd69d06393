"""Fast forms of a BTF, clusters of texels and reflectance fields, and the choice of their size."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar, Self, TypeVar, overload

import numpy as np

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.basis import SpectralBasis
from ...spectral.palette import Palette
from ..core.environment_form import EnvironmentForm
from ..core.fast import Fast, Summand
from ..core.fit_error import FitError
from .field_gathering import FieldGathering
from .field_texels import FieldTexels
from .gathering import BtfGathering
from .images import BtfImages
from .lobe_field import LobeField, lobe_field
from .lobe_gathering import LobeGathering
from .local_pca import LocalPca, Size, local_pca
from .mean import MeanBtf, basis_of
from .paper_pca import PaperPca, paper_pca
from .polynomials import Polynomials, polynomials
from .reduced import reduced
from .reflectance_field import ReflectanceField
from .texel_error import TexelSample, error_stored, stored_error, worst_mean
from .texels import BtfTexels

#: Sizes of local PCA, from the smallest to the largest: some 6, 10, 23 and 50 bytes a texel of 256 x 256.
SIZES = {
    "small": Size(64, 32, 8, 1.0, 1.0),
    "medium": Size(128, 64, 12, 1.0, 1.0),
    "fine": Size(192, 32, 32, 0.6, 1.0),
    "finest": Size(384, 32, 64, 0.4, 1.0),
}
# Name by which local PCA is asked for.
_LPCA = "lpca"
#: Fields as a file may hold them.
FIELD_KINDS: dict[str, type[ReflectanceField]] = {kind.KIND: kind for kind in (Polynomials, LobeField)}
#: Local PCA as a file may hold it: ours, and as it was published.
CLUSTER_KINDS: dict[str, type[LocalPca | PaperPca]] = {_LPCA: LocalPca, "lpca-paper": PaperPca}
# Multiple of its budget from which local PCA's error is far off; and most bytes on disk of a field not asked for.
_FAR, _MOST_BYTES = 2.0, 128 << 20
# Largest error of a field in place of local PCA, relative to that of the latter: it takes tens of times the bytes.
_WORTH = 0.9


@dataclass(frozen=True, eq=False)
class TexelForm(Fast):
    """Fast form of a BTF: one summand of registered texels.

    texel_error : see `Fast.texel_error`; `error` equals it until another one is measured.
    """

    isotropic = False

    texels: BtfTexels | FieldTexels
    error: FitError | None = None
    note: str = ""
    texel_error: FitError | None = None  # pyright: ignore[reportIncompatibleMethodOverride]

    @property
    def summands(self) -> tuple[Summand, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The texels, as the only summand."""
        return (self.texels,)

    @property
    def measured_to(self) -> tuple[float, float]:
        """Implement `Surface.measured_to`; a note of the record states the lowest of each side."""
        return self.texels.form.views.reach[0], self.texels.form.lights.reach[0]

    def in_basis(self, basis: SpectralBasis) -> Self:
        """Implement `Fast.in_basis`; texels are shared."""
        return replace(self, texels=self.texels.in_basis(basis))


@dataclass(frozen=True, eq=False)
class BtfForm(TexelForm):
    """Local PCA: each texel a few weights of its cluster's components (`local_pca`)."""

    NAME: ClassVar[str] = "btf"
    WORDS: ClassVar[str] = "local PCA"

    texels: BtfTexels

    def from_afar(self) -> MeanBtf:
        """Return the mean of all texels, the single texel of the coarsest level."""
        form = self.texels.form
        level = (self.texels.whole, *form.coarser())[-1]
        means = np.einsum("c,vlcj->vlj", level.weights[0], level.table[int(level.number[0, 0])])
        return MeanBtf(form.views, form.lights, means, basis_of(self.texels.palette))

    def environment_form(self) -> BtfGathering:
        """Implement `Fast.environment_form`; computed on first use."""
        return BtfGathering(texels=self.texels)

    def stored(self) -> dict[str, Any]:
        """Return the method of the clusters, the texels (`ClusteredForm.stored`) and the palette."""
        form = self.texels.form
        (kind,) = (name for name, one in CLUSTER_KINDS.items() if isinstance(form, one))
        kept = {"kind": kind, "texels": form.stored(), "palette": self.texels.palette.stored()}
        return kept | stored_error(self.texel_error)

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> BtfForm:
        """Implement `Fast.from_stored`."""
        kind = str(kept["kind"])
        if kind not in CLUSTER_KINDS:
            raise InputError(
                "an unknown kind of local PCA", field="kind", found=kind, expected=", ".join(CLUSTER_KINDS)
            )
        palette = Palette.from_stored(kept["palette"])
        texels = BtfTexels(CLUSTER_KINDS[kind].from_stored(kept["texels"], basis_of(palette)), palette)
        return cls(texels, error, texel_error=error_stored(kept))


@dataclass(frozen=True, eq=False)
class FieldForm(TexelForm):
    """Reflectance fields (Meseth, Mueller and Klein 2003): larger than local PCA, each view fitted independently."""

    NAME: ClassVar[str] = "btf-field"
    WORDS: ClassVar[str] = "reflectance fields"

    texels: FieldTexels

    def from_afar(self) -> MeanBtf:
        """Return the mean of all texels under the measured lights, the single texel of the coarsest level."""
        field = self.texels.form
        level = field.levels(filtered=True)[-1]
        lights, first = field.lights.directions, np.zeros(len(field.lights), np.int64)
        means = np.stack([level.at(first + view, first, first, lights) for view in range(len(field.views))])
        return MeanBtf(field.views, field.lights, means, basis_of(self.texels.palette))

    def environment_form(self) -> EnvironmentForm:
        """Implement `Fast.environment_form`; computed on first use."""
        gathering = LobeGathering if isinstance(self.texels.form, LobeField) else FieldGathering
        return gathering(texels=self.texels)

    def stored(self) -> dict[str, Any]:
        """Return the kind of field, the field (`ReflectanceField.stored`) and the palette."""
        field = self.texels.form
        kept = {"kind": field.KIND, "field": field.stored(), "palette": self.texels.palette.stored()}
        return kept | stored_error(self.texel_error)

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> FieldForm:
        """Implement `Fast.from_stored`."""
        kind = str(kept["kind"])
        if kind not in FIELD_KINDS:
            raise InputError("an unknown kind of field", field="kind", found=kind, expected=", ".join(FIELD_KINDS))
        palette = Palette.from_stored(kept["palette"])
        texels = FieldTexels(FIELD_KINDS[kind].from_stored(kept["field"], basis_of(palette)), palette)
        return cls(texels, error, texel_error=error_stored(kept))


AnyForm = TypeVar("AnyForm", bound="BtfForm | FieldForm")


@overload
def btf_form(
    images: BtfImages, budget: Size, seed: int = 0, heard: Callable[[float], None] = ..., name: None = None
) -> BtfForm:
    """Fit a form of a given size."""
    ...


@overload
def btf_form(
    images: BtfImages, budget: float = 0.5, seed: int = 0, heard: Callable[[float], None] = ..., name: str | None = None
) -> BtfForm | FieldForm:
    """Choose a form by budget or name."""
    ...


def btf_form(
    images: BtfImages,
    budget: float | Size = 0.5,
    seed: int = 0,
    heard: Callable[[float], None] = lambda share: None,
    name: str | None = None,
) -> BtfForm | FieldForm:
    """Fit the fast form of a BTF and measure its error: ΔE94 of random texels over every view and light.

    budget : a size of local PCA; or the ΔE94 that the mean under the worst light should not exceed. Every figure
    includes the noise of the texels, so that all sizes may miss the budget: then "fine" is chosen, beyond which bytes
    buy little. If that misses the budget by far, fields are tried, and one that is clearly better is chosen, with a
    note. heard : receives the fraction done. name : of `NAMES`, whatever the budget. Images of many wavelengths are
    first reduced to a small basis.

    Raises
    ------
    UnknownNameError : an unknown name.
    """
    if name is not None and name not in NAMES:
        raise UnknownNameError("btf-form", name, NAMES)
    images = reduced(images, seed)
    sample = TexelSample.drawn(images, seed + 1, lambda share: heard(0.1 * share))
    rest = _part(heard, 0.1, 1.0)
    if isinstance(budget, Size):
        return _of_size(images, budget, seed, rest, sample)
    if name is not None and name != _LPCA:
        return _judged(NAMED[name](images, seed, rest), sample)
    found = _of_budget(images, budget, seed, rest if name else _part(heard, 0.1, 0.9), sample)
    if name is None and _mean(found) > _FAR * budget:
        return _field_instead(images, found, seed, _part(heard, 0.9, 1.0), sample)
    heard(1.0)
    return found


def _of_budget(
    images: BtfImages, budget: float, seed: int, heard: Callable[[float], None], sample: TexelSample
) -> BtfForm:
    small = _of_size(images, SIZES["small"], seed, _part(heard, 0.0, 0.3), sample)
    if _mean(small) <= budget:
        return small
    # Each size leaves a fifth to a third less than the one before.
    names = ("medium", "fine") if _mean(small) < 1.5 * budget else ("fine", "finest")
    found = small
    for place, name in enumerate(names):
        part = _part(heard, 0.3 + 0.35 * place, 0.65 + 0.35 * place)
        larger = _of_size(images, SIZES[name], seed, part, sample)
        if _mean(larger) <= budget or name != "finest":
            found = larger
        if _mean(found) <= budget or _mean(found) > 1.5 * budget:
            break
    return found


def _field_instead(
    images: BtfImages, found: BtfForm, seed: int, heard: Callable[[float], None], sample: TexelSample
) -> BtfForm | FieldForm:
    """Return the best field if it is clearly better than local PCA and not too large; else local PCA."""
    alone, least, best = sample.alone(), _WORTH * _mean(found), None
    for name in _TRIED:
        tried = _FIELDS[name](alone.images, seed, lambda share: None)
        if tried.texels.form.bytes_per_texel * images.height * images.width > _MOST_BYTES:
            continue
        mean = worst_mean(alone.error_of(tried.texels.form))
        if mean < least:
            least, best = mean, name
    if best is None:
        return found
    instead = _judged(_FIELDS[best](images, seed, heard), sample)
    # A field of all texels has coarser steps than one of a few.
    if _mean(instead) >= _WORTH * _mean(found):
        return found
    words = f"ΔE94 {_mean(instead):.2f} on average, of local PCA {_mean(found):.2f}"
    return replace(instead, note=f"fast form {best}, chosen by its error: {words}")


def _of_size(images: BtfImages, size: Size, seed: int, heard: Callable[[float], None], sample: TexelSample) -> BtfForm:
    found = local_pca(images, size, seed, heard)
    return _judged(BtfForm(BtfTexels(found, palette_of(images.basis))), sample)


def _judged(form: AnyForm, sample: TexelSample) -> AnyForm:
    error = sample.error_of(form.texels.form)
    return replace(form, error=error, texel_error=error)


def _mean(form: BtfForm | FieldForm) -> float:
    assert form.error is not None
    return worst_mean(form.error)


def _part(heard: Callable[[float], None], start: float, stop: float) -> Callable[[float], None]:
    return lambda share: heard(start + (stop - start) * share)


def palette_of(basis: SpectralBasis) -> Palette:
    """Make a palette of one entry, the spectra of a basis's coefficients."""
    return Palette.of(basis.synthesis.T, SpectralBasis.sampled(basis.wavelengths_nm))


def _paper(images: BtfImages, seed: int, heard: Callable[[float], None]) -> BtfForm:
    return BtfForm(BtfTexels(paper_pca(images, seed=seed, heard=heard), palette_of(images.basis)))


def _rfp(images: BtfImages, seed: int, heard: Callable[[float], None]) -> FieldForm:
    return FieldForm(FieldTexels(polynomials(images, heard), palette_of(images.basis)))


def _lobes(images: BtfImages, seed: int, heard: Callable[[float], None], lobes: int, shared: bool = True) -> FieldForm:
    return FieldForm(FieldTexels(lobe_field(images, lobes, shared, heard), palette_of(images.basis)))


_FIELDS: dict[str, Callable[[BtfImages, int, Callable[[float], None]], FieldForm]] = {
    "rfp": _rfp,
    **{f"rfnl-{count}": partial(_lobes, lobes=count) for count in (1, 2, 4)},
    **{f"rfnl-{count}-separate": partial(_lobes, lobes=count, shared=False) for count in (1, 2, 4)},
}
# Fields tried if local PCA is far off.
_TRIED = ("rfp", "rfnl-2")
#: Forms that can be asked for by name, each with its maker from images, a seed and a listener for progress.
NAMED: dict[str, Callable[[BtfImages, int, Callable[[float], None]], BtfForm | FieldForm]] = {
    "lpca-paper": _paper,
    **_FIELDS,
}
#: Names of all forms; of local PCA the budget chooses the size.
NAMES = (_LPCA, *NAMED)
