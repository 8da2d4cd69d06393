"""Error of a BTF's form against its images: one measure for all forms, so that they compare."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from ...spectral.difference import delta_e_xyz
from ..core.fit_error import FitError, LightError
from ..core.protocol import LIGHTS
from .images import BtfImages, HeldImages
from .local_pca import JUDGED, gathered
from .metric import folding_of

# Stride of the images of each texel whose spectra are checked for their extremes.
_SPECTRA = 61
# Colour differences per block: texels of few images are judged many at a time.
_AT_ONCE = 1 << 15


@runtime_checkable
class Decoded(Protocol):
    """Form that can reconstruct its images."""

    def decoded(self, texels: Int[np.ndarray, " n"]) -> Iterator[Float[np.ndarray, "V Lt J"]]:
        """Yield f_r cos(theta_i), 1/sr, of each texel; texels are row-major indices."""
        ...


@dataclass(frozen=True, eq=False)
class TexelSample:
    """Texels of registered images, in every image, on which the error of forms is measured.

    texels : row-major indices. truth : f_r cos(theta_i), 1/sr.
    """

    images: BtfImages
    texels: Int[np.ndarray, " n"]
    truth: Float[np.ndarray, "n V Lt J"]

    @classmethod
    def drawn(cls, images: BtfImages, seed: int, heard: Callable[[float], None] = lambda share: None) -> TexelSample:
        """Draw texels at random; forms compared on one sample have the same texels.

        Raises
        ------
        InputError : an image that is not finite.
        """
        texels = np.sort(np.random.default_rng(seed).permutation(images.height * images.width)[:JUDGED])
        return cls(images, texels, gathered(images, texels, heard))

    def alone(self) -> TexelSample:
        """Return these texels, side by side, as a BTF of their own, for quick trial fits."""
        values = self.truth.transpose(1, 2, 0, 3)[:, :, None]
        alone = HeldImages(self.images.views, self.images.lights, values, self.images.basis, self.images.texel_mm)
        return TexelSample(alone, np.arange(len(self.texels)), self.truth)

    def error_of(self, form: Decoded) -> FitError:
        """Compute ΔE94 of a form; the perfect diffuser, lit along its normal, is white."""
        return _error(self, form)


def measured(
    images: BtfImages, form: Decoded, seed: int, heard: Callable[[float], None] = lambda share: None
) -> FitError:
    """Compute the error of a form on texels drawn for it alone (`TexelSample.error_of`)."""
    return TexelSample.drawn(images, seed, heard).error_of(form)


def _error(sample: TexelSample, form: Decoded) -> FitError:
    images = sample.images
    folding = folding_of(LIGHTS)
    to_xyz = np.pi * folding.coefficients(images.basis)
    whites = folding.weights(images.basis.wavelengths_nm).sum(axis=0)
    off: list[list[np.ndarray]] = [[] for _ in LIGHTS]
    # XYZ of true and made spectra, light by light, whose differences are still to be taken.
    waiting: list[tuple[np.ndarray, np.ndarray]] = []
    squares, extremes = np.zeros(2), np.zeros(3)
    for place, (true, made) in enumerate(zip(sample.truth, form.decoded(sample.texels), strict=True)):
        squares += [np.sum(np.square(one, dtype=np.float64)) for one in (made - true, true)]
        # There may be fewer images than that.
        first = place % min(_SPECTRA, true.shape[0] * true.shape[1])
        spectra = [images.basis.reconstruct(one.reshape(-1, one.shape[2])[first::_SPECTRA]) for one in (made, true)]
        extremes = np.maximum(extremes, [-spectra[0].min(), spectra[0].max(), spectra[1].max()])
        for light in range(len(LIGHTS)):
            at = slice(3 * light, 3 * light + 3)
            waiting.append(((true @ to_xyz[:, at]).reshape(-1, 3), (made @ to_xyz[:, at]).reshape(-1, 3)))
        if len(waiting) * len(waiting[0][0]) > _AT_ONCE or place + 1 == len(sample.truth):
            for light in range(len(LIGHTS)):
                true_xyz, made_xyz = map(np.concatenate, zip(*waiting[light :: len(LIGHTS)], strict=True))
                off[light].append(delta_e_xyz(true_xyz, made_xyz, whites[3 * light : 3 * light + 3]))
            waiting.clear()
    rows = []
    for name, some in zip(LIGHTS, off, strict=True):
        each = np.concatenate(some)
        p95, p99 = np.percentile(each, (95, 99))
        rows.append(LightError(name, float(each.mean()), float(p95), float(p99), float(each.max())))
    worst = max(rows, key=lambda row: row.p99)
    size = f"{len(images.views)} x {len(images.lights)} images"
    protocol = f"{len(sample.texels)} texels of {size}, registered by {images.offset:g}"
    negative, shown, true = (float(one) for one in extremes)
    return FitError(
        **{name: getattr(worst, name) for name in ("mean", "p95", "p99", "maximum", "light")},
        observer="1931_2",
        protocol=protocol,
        relative_error=float(np.sqrt(squares[0] / squares[1])) if squares[1] > 0.0 else 0.0,
        most_negative=-np.pi * negative if negative > 0.0 else 0.0,
        largest=shown / true if true > 0.0 else None,
        lights=tuple(rows),
    )


def worst_mean(error: FitError) -> float:
    """Return the largest mean among the judged lights, which budgets of BTFs limit."""
    return max(light.mean for light in error.lights)


def stored_error(error: FitError | None) -> dict[str, Any]:
    """Return the error of texels as stored in a form's file."""
    return {} if error is None else {"texel_error": error.stored()}


def error_stored(kept: Mapping[str, Any]) -> FitError | None:
    """Read the error that `stored_error` wrote; None if there is none."""
    return FitError.from_stored(kept["texel_error"]) if "texel_error" in kept else None
