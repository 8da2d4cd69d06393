"""Samples of a BRDF at pairs of directions drawn as pictures show them, weighted by the visibility of errors.

To first order, ΔE94 of a small error is the length of `sensitivity` times it, with the derivative of CIELAB at the
reference itself: below (24/116)^3, where L* is linear, its slope is finite, so that black needs no special case.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from ...spectral.difference import KNEE, lab_from_xyz
from ...spectral.projection import projection_matrix
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..core.brdf import Brdf
from ..core.directions import half_difference
from ..core.highlight import highlight_width
from ..core.protocol import LIGHT_ANGLES_DEG, LIGHTS, sphere_protocol
from ..factored.pack import FactorPack
from .visible_pairs import BEHIND, seen_pairs

# Least importance of a highlight's own pixels, however few pictures show.
_HIGHLIGHT_IMPORTANCE = 0.3
# Error budget of the spectra's common basis, root mean square, in L*.
_LOST = 0.02
# Weight of a squared error under each light that a fit is judged by. Under one alone, spectra would become
# metamers.
_LIGHT_SHARE = 0.3
# Share of visible errors that may be counted as colourless: the rest are few directions of colour at each sample, in
# which the lights of the protocol agree.
_COLOURLESS = 0.02
# Directions of colour at each sample, at most.
_MOST_DIRECTIONS = 4
# Weight of an error that none of the lights shows: another light may.
_UNSEEN = 0.3
# Pairs per block in the evaluation of a BRDF.
_BLOCK = 8192
# Samples per block in products with the sensitivity.
_COLUMNS = 2048


@dataclass(frozen=True, eq=False)
class SeenSamples:
    """N direction pairs, and the BRDF there in a basis of S spectra common to all packs.

    targets : f_r cos(theta_i) in coefficients by `analysis` (L,S); `synthesis` (S,L) inverts it; on the working
    wavelengths.
    sensitivity : K rows of S per sample, along the last axis: the sum of squares of `sensitivity` times a small error
        of `targets` is that of (ΔL*, ΔC*/S_C, ΔH*/S_H) of CIE 1994 under every light of the protocol.
    base_weight : of the squared error of any colour: its cost in L*, times a small share.
    importance : frequency of the pair in pictures over its frequency in the sample.
    guards, limits : weights of the last G pairs, which are kept between limits (`with_guards`), and these.
    xyz : of the pair under D65; Y of a perfect diffuser facing the light = 1.
    """

    wi: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]
    targets: Float[np.ndarray, "N S"]
    sensitivity: Float[np.ndarray, "K S N"]
    base_weight: Float[np.ndarray, " N"]
    importance: Float[np.ndarray, " N"]
    xyz: Float[np.ndarray, "N 3"]
    analysis: Float[np.ndarray, "L S"]
    synthesis: Float[np.ndarray, "S L"]
    guards: Float[np.ndarray, " G"] = field(default_factory=lambda: np.empty(0))
    limits: Float[np.ndarray, "2 L"] | None = None

    @property
    def lit_from_behind(self) -> Bool[np.ndarray, " N"]:
        """Mask of the samples that are lit from behind."""
        return np.sum(self.wi * self.wo, axis=1) < np.cos(BEHIND)

    @cached_property
    def single_unit(self) -> float:
        """Largest sensitivity, the unit of values in single precision."""
        seen, root = self.sensitivity, np.sqrt(self.base_weight.max())
        return float(max(seen.max(), -seen.min(), root)) or 1.0

    @cached_property
    def single_sensitivity(self) -> Float[np.ndarray, "N K S"]:
        """Sensitivity in multiples of `single_unit`, in single precision, 0 for guards."""
        seen = self.sensitivity
        found = np.empty((seen.shape[2], *seen.shape[:2]), dtype=np.float32)
        np.divide(seen.transpose(2, 0, 1), self.single_unit, out=found, casting="same_kind")
        found[len(found) - len(self.guards) :] = 0.0
        return found

    @cached_property
    def single_roots(self) -> Float[np.ndarray, "N 1"]:
        """Square root of the base weight in multiples of `single_unit`, in single precision."""
        return (np.sqrt(self.base_weight[:, None]) / self.single_unit).astype(np.float32)

    def half_gradient(self, error: Float[np.ndarray, "S N"]) -> Float[np.ndarray, "S N"]:
        """Compute half the gradient of the cost of errors at the samples: the cost is the sum of `error` times this."""
        out = np.empty(error.shape)
        # Pieces small enough to stay in the cache.
        for start in range(0, error.shape[1], _COLUMNS):
            some = slice(start, start + _COLUMNS)
            sensitivity = self.sensitivity[:, :, some]
            seen = np.einsum("ksn,sn->kn", sensitivity, error[:, some])
            np.einsum("ksn,kn->sn", sensitivity, seen, out=out[:, some])
            out[:, some] += self.base_weight[some] * error[:, some]
        return out

    def reweighted(self, weights: Float[np.ndarray, " N"]) -> SeenSamples:
        """Return the same samples with the weights of squared errors multiplied by `weights`."""
        return replace(self, sensitivity=self.sensitivity * np.sqrt(weights), base_weight=self.base_weight * weights)

    def thinned(self, step: int) -> SeenSamples:
        """Return every `step`-th sample, weighted by `step`, and all guards."""
        first = len(self.wi) - len(self.guards)
        some = np.concatenate([np.arange(0, first, step), np.arange(first, len(self.wi))])
        times = np.where(some < first, float(step), 1.0)
        return replace(
            self,
            wi=self.wi[some],
            wo=self.wo[some],
            targets=self.targets[some],
            base_weight=times * self.base_weight[some],
            sensitivity=np.sqrt(times) * self.sensitivity[:, :, some],
            importance=times * self.importance[some],
            xyz=self.xyz[some],
        )

    def with_guards(
        self, wi: Float[np.ndarray, "G 3"], wo: Float[np.ndarray, "G 3"], limits: Float[np.ndarray, "2 L"], cost: float
    ) -> SeenSamples:
        """Append G guards: pairs where packs should shade to pi f_r cos(theta_i) between `limits`.

        limits : the lowest and the highest value at each working wavelength. cost : of exceeding them by 0.02 at one
        wavelength of one guard. Guards come last, and cost nothing while packs are within the limits.
        """
        more = len(wi)
        join, zero = np.concatenate, np.zeros(more)
        return replace(
            self,
            wi=join([self.wi, wi]),
            wo=join([self.wo, wo]),
            targets=join([self.targets, np.zeros((more, self.targets.shape[1]))]),
            sensitivity=join([self.sensitivity, np.zeros((*self.sensitivity.shape[:2], more))], axis=2),
            base_weight=join([self.base_weight, zero]),
            importance=join([self.importance, zero]),
            xyz=join([self.xyz, np.zeros((more, 3))]),
            guards=join([self.guards, np.full(more, cost / 0.02**2)]),
            limits=limits,
        )

    def cost(self, packs: tuple[FactorPack, ...]) -> float:
        """Compute the cost of packs over all samples: the sum of their squared ΔE94, to first order."""
        left = self.minus(packs).targets.T.copy()
        if len(self.guards):
            left[:, -len(self.guards) :] = 0.0
        return float(np.vdot(left, self.half_gradient(left)))

    def minus(self, packs: tuple[FactorPack, ...]) -> SeenSamples:
        """Subtract the shading of packs from the targets."""
        shaded = [pack.shade(self.wi, self.wo) @ (pack.palette.basis.synthesis.T @ self.analysis) for pack in packs]
        return replace(self, targets=self.targets - sum(shaded, np.zeros_like(self.targets)))


def seen_samples(brdf: Brdf, count: int, seed: int = 0) -> SeenSamples:
    """Draw some 0.6 `count` samples of a BRDF: of `count` pairs (`visible_pairs`), those above the horizon."""
    wi, wo, importance = seen_pairs(count, seed, brdf.isotropic)
    importance = np.maximum(importance, _HIGHLIGHT_IMPORTANCE * _in_highlight(brdf, wi, wo))
    spectra = working_spectra(brdf, wi, wo)
    observed = np.pi * sphere_protocol(16).weights(WORKING_WAVELENGTHS_NM)
    xyz = spectra @ observed
    slope = 116.0 / 3.0 * np.maximum(xyz[:, 1], KNEE) ** (-2.0 / 3.0)
    bright = np.linalg.norm(observed, axis=1)
    bright = np.maximum(bright, 0.05 * bright.max())
    weighted = spectra * (bright * slope[:, None] * np.sqrt(importance)[:, None])
    values, vectors = np.linalg.eigh(weighted.T @ weighted)
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    energy = np.cumsum(values[::-1])[::-1]
    size = max(1, int(np.sum(energy > _LOST**2 * len(wi))))
    analysis, synthesis = bright[:, None] * vectors[:, :size], vectors[:, :size].T / bright
    # Coefficients have the size of XYZ: a spectrum of length 1 in the basis is about 1 in Y.
    base_weight = (_UNSEEN * slope) ** 2 * importance
    sensitivity, lost = _sensitivity(spectra, synthesis)
    return SeenSamples(
        wi,
        wo,
        spectra @ analysis,
        sensitivity * np.sqrt(importance),
        base_weight + lost * importance,
        importance,
        xyz,
        analysis,
        synthesis,
    )


def working_spectra(brdf: Brdf, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N L"]:
    """Evaluate f_r cos(theta_i) on the working wavelengths, 1/sr."""
    same = np.array_equal(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    resample = None if same else projection_matrix(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM).T
    spectra = np.empty((len(wi), len(WORKING_WAVELENGTHS_NM)))
    for start in range(0, len(wi), _BLOCK):
        rows = slice(start, start + _BLOCK)
        found = brdf.eval(wi[rows], wo[rows]) * wi[rows, 2:]
        spectra[rows] = found if resample is None else found @ resample
    return spectra


def _in_highlight(brdf: Brdf, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
    """Return whether pairs belong to a highlight's own pixels."""
    theta_h, theta_d, _, _ = half_difference(wi, wo)
    known = 0.5 * np.radians(LIGHT_ANGLES_DEG)
    widths = [highlight_width(brdf, angle)[0] for angle in known]
    return theta_h <= np.interp(theta_d, known, widths, right=0.0)


def _sensitivity(
    spectra: Float[np.ndarray, "N L"], synthesis: Float[np.ndarray, "S L"]
) -> tuple[Float[np.ndarray, "K S N"], Float[np.ndarray, " N"]]:
    """Compute `SeenSamples.sensitivity`, by the principal directions of each sample's errors under all lights together.

    The second result is the mean weight of the directions that are left out.
    """
    size = len(synthesis)
    gram = np.zeros((len(spectra), size, size))
    for light in LIGHTS:
        weights = sphere_protocol(16, light=light).weights(WORKING_WAVELENGTHS_NM)
        observed = np.pi * weights
        slopes = _lab_slopes(spectra @ observed, weights.sum(axis=0)) @ (synthesis @ observed).T
        gram += _LIGHT_SHARE * np.matmul(slopes.transpose(0, 2, 1), slopes)
    values, vectors = np.linalg.eigh(gram)
    values, vectors = np.maximum(values[:, ::-1], 0.0), vectors[:, :, ::-1]
    kept = np.cumsum(values.mean(axis=0))
    rows = min(int(np.sum(kept < (1.0 - _COLOURLESS) * kept[-1])) + 1, _MOST_DIRECTIONS, size)
    found = np.sqrt(values[:, None, :rows]) * vectors[:, :, :rows]
    lost = values[:, rows:].sum(axis=1) / max(size - rows, 1)
    return np.ascontiguousarray(found.transpose(2, 1, 0)), lost


def _lab_slopes(xyz: Float[np.ndarray, "N 3"], white: Float[np.ndarray, "3"]) -> Float[np.ndarray, "N 3 3"]:
    """Differentiate (L*, C*/S_C, H*/S_H) by XYZ at a reference (CIE 116-1995); at grey, chroma is a* and hue b*."""
    slope = np.maximum(xyz / white, KNEE) ** (-2.0 / 3.0) / 3.0 / white
    lab = lab_from_xyz(xyz, white)
    zero = np.zeros(len(xyz))
    along_a = np.stack([500.0 * slope[:, 0], -500.0 * slope[:, 1], zero], axis=-1)
    along_b = np.stack([zero, 200.0 * slope[:, 1], -200.0 * slope[:, 2]], axis=-1)
    chroma = np.hypot(lab[:, 1], lab[:, 2])
    coloured = chroma > 0
    cosine = np.divide(lab[:, 1], chroma, out=np.ones_like(chroma), where=coloured)[:, None]
    sine = np.divide(lab[:, 2], chroma, out=np.zeros_like(chroma), where=coloured)[:, None]
    lightness = np.stack([zero, 116.0 * slope[:, 1], zero], axis=-1)
    chromatic = (cosine * along_a + sine * along_b) / (1.0 + 0.045 * chroma)[:, None]
    hue = (cosine * along_b - sine * along_a) / (1.0 + 0.015 * chroma)[:, None]
    return np.stack([lightness, chromatic, hue], axis=1)
