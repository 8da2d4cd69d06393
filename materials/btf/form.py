"""The fast form of a BTF, and how large it has to be."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ...spectral.basis import SpectralBasis
from ...spectral.difference import delta_e_xyz
from ...spectral.palette import Palette
from ..fast import Fast, Summand
from ..fit_error import FitError, LightError
from ..protocol import LIGHTS
from .gathering import BtfGathering
from .images import BtfImages
from .local_pca import JUDGED, LocalPca, Size, gathered, local_pca
from .metric import folding_of
from .reduced import reduced
from .texels import BtfTexels

# One of so many images of each texel is looked at for how dark and bright its spectra are.
_SPECTRA = 61
#: From the smallest to the largest that anybody asks for: some 7, 12, 30 and 60 bytes a texel of 256 x 256.
SIZES = {
    "small": Size(64, 32, 8, 1.0, 1.0),
    "medium": Size(128, 64, 12, 1.0, 1.0),
    "fine": Size(192, 32, 32, 0.6, 1.0),
    "finest": Size(384, 32, 64, 0.4, 1.0),
}


@dataclass(frozen=True, eq=False)
class BtfForm(Fast):
    """The fast form of a BTF: registered, each texel a few weights of its cluster's components (`local_pca`).

    texel_error : see `Fast.texel_error`; `error` is the same until somebody measures another one.
    """

    NAME: ClassVar[str] = "btf"
    WORDS: ClassVar[str] = "local PCA"
    isotropic = False

    texels: BtfTexels
    error: FitError | None = None
    texel_error: FitError | None = None  # pyright: ignore[reportIncompatibleMethodOverride]

    @property
    def summands(self) -> tuple[Summand, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The texels alone."""
        return (self.texels,)

    def in_basis(self, basis: SpectralBasis) -> BtfForm:
        """See `Fast.in_basis`; texels are shared."""
        return replace(self, texels=self.texels.in_basis(basis))

    def environment_form(self) -> BtfGathering:
        """See `Fast.environment_form`; worked out when first asked for."""
        return BtfGathering(texels=self.texels)

    def stored(self) -> dict[str, Any]:
        """The texels (`LocalPca.stored`), the palette, and the error of the texels."""
        kept = {"texels": self.texels.form.stored(), "palette": self.texels.palette.stored()}
        return kept | ({} if self.texel_error is None else {"texel_error": self.texel_error.stored()})

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> BtfForm:
        """See `Fast.from_stored`."""
        palette = Palette.from_stored(kept["palette"])
        spectra = palette.samples[0].T
        basis = SpectralBasis("btf", palette.wavelengths_nm, np.linalg.pinv(spectra).T, spectra)
        texel_error = FitError.from_stored(kept["texel_error"]) if "texel_error" in kept else None
        return cls(BtfTexels(LocalPca.from_stored(kept["texels"], basis), palette), error, texel_error)


def btf_form(
    images: BtfImages,
    budget: float | Size = 0.5,
    seed: int = 0,
    heard: Callable[[float], None] = lambda share: None,
) -> BtfForm:
    """The form of a BTF, with its error: ΔE94 of texels drawn at random, of every view and light.

    budget : a size; or the ΔE94 that the mean should not exceed under the worst light. Texels' own noise is in every
    figure, and none of a few sizes may be within: then it is the one called "fine", beyond which bytes buy little.
    heard : hears the share that is done. Of many wavelengths, images are brought into a small basis before.
    """
    images = reduced(images, seed)
    if isinstance(budget, Size):
        return _of_size(images, budget, seed, heard)
    small = _of_size(images, SIZES["small"], seed, lambda share: heard(0.3 * share))
    if _mean(small) <= budget:
        return small
    # Each size leaves a fifth to a third less than the one before.
    names = ("medium", "fine") if _mean(small) < 1.5 * budget else ("fine", "finest")
    found = small
    for place, name in enumerate(names):
        start = 0.3 + 0.35 * place
        larger = _of_size(images, SIZES[name], seed, lambda share, start=start: heard(start + 0.35 * share))
        if _mean(larger) <= budget or name != "finest":
            found = larger
        if _mean(found) <= budget or _mean(found) > 1.5 * budget:
            break
    heard(1.0)
    return found


def _of_size(images: BtfImages, size: Size, seed: int, heard: Callable[[float], None]) -> BtfForm:
    found = local_pca(images, size, seed, lambda share: heard(0.9 * share))
    form = BtfForm(BtfTexels(found, palette_of(images.basis)))
    error = measured(images, found, seed + 1, lambda share: heard(0.9 + 0.1 * share))
    return replace(form, error=error, texel_error=error)


def _mean(form: BtfForm) -> float:
    assert form.error is not None
    return max(light.mean for light in form.error.lights)


def palette_of(basis: SpectralBasis) -> Palette:
    """One entry: what each coefficient of a basis is a coefficient of."""
    return Palette.of(basis.synthesis.T, SpectralBasis.sampled(basis.wavelengths_nm))


def measured(
    images: BtfImages, form: LocalPca, seed: int, heard: Callable[[float], None] = lambda share: None
) -> FitError:
    """ΔE94 of some texels of a form, in every image; the perfect diffuser, lit along its normal, is white."""
    texels = np.sort(np.random.default_rng(seed).permutation(form.number.size)[:JUDGED])
    truth = gathered(images, texels, heard)
    table, number = form.table(), form.number.ravel()[texels]
    weights = form.weights.reshape(form.number.size, -1)[texels].astype(np.float32)
    folding = folding_of(LIGHTS)
    to_xyz = np.pi * folding.coefficients(images.basis)
    whites = folding.weights(images.basis.wavelengths_nm).sum(axis=0)
    off: list[list[np.ndarray]] = [[] for _ in LIGHTS]
    squares, extremes = np.zeros(2), np.zeros(3)
    for place, (cluster, share) in enumerate(zip(number, weights, strict=True)):
        true = truth[place]
        sample = table[cluster, ..., 0, :] + np.einsum("c,vlcj->vlj", share, table[cluster, ..., 1:, :])
        squares += [np.sum(np.square(one, dtype=np.float64)) for one in (sample - true, true)]
        # There may be fewer images than that.
        first = place % min(_SPECTRA, true.shape[0] * true.shape[1])
        spectra = [images.basis.reconstruct(one.reshape(-1, one.shape[2])[first::_SPECTRA]) for one in (sample, true)]
        extremes = np.maximum(extremes, [-spectra[0].min(), spectra[0].max(), spectra[1].max()])
        for light in range(len(LIGHTS)):
            at = slice(3 * light, 3 * light + 3)
            off[light].append(delta_e_xyz(true @ to_xyz[:, at], sample @ to_xyz[:, at], whites[at]).ravel())
    rows = []
    for name, some in zip(LIGHTS, off, strict=True):
        each = np.concatenate(some)
        p95, p99 = np.percentile(each, (95, 99))
        rows.append(LightError(name, float(each.mean()), float(p95), float(p99), float(each.max())))
    worst = max(rows, key=lambda row: row.p99)
    protocol = (
        f"{len(texels)} texels of {len(images.views)} x {len(images.lights)} images, registered by {images.offset:g}"
    )
    negative, shown, true = (float(one) for one in extremes)
    return FitError(
        **{name: getattr(worst, name) for name in ("mean", "p95", "p99", "maximum", "light")},
        observer="1931_2",
        protocol=protocol,
        relative_error=float(np.sqrt(squares[0] / squares[1])) if squares[1] > 0.0 else 0.0,
        most_negative=-np.pi * negative,
        largest=shown / true if true > 0.0 else None,
        lights=tuple(rows),
    )
