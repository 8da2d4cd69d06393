"""Fitting factor packs to a BRDF, with as few terms as an error budget in ΔE94 allows.

Each lobe is tabulated in the frame that suits it, its spectra are expressed in their own orthonormal basis, the table
is decomposed (`cp`) for growing rank, and every candidate is looked at on the sphere (`protocol`) with the other
lobes exact, until the budget's share is met. One frame alone would need far more terms: Schwenk 2010, section 3.4,
notes which materials suit which frame.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..spectral.basis import SpectralBasis
from ..spectral.errors import InputError
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix
from .brdf import Brdf, Frame, Lobe
from .cp import CompressedTable, Factors, WeightedTable, weighted_cp
from .factors import Axis, FactorPack, FitError
from .grids import filled, floored, lobe_axes, node_weights, separable_roots
from .protocol import BACK_LIGHT_ANGLES_DEG, LIGHT_ANGLES_DEG, SphereProtocol, sphere_protocol
from .tabulated import node_directions, tabulate

__all__ = ["Fit", "FitError", "Trial", "fit"]

RANKS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 48)
# The mean may be this share of the budget, which is for the 99th percentile.
_MEAN_SHARE = 0.3
# Lit from behind, where the protocol does not look, the 99th percentile may be this many times the budget.
_BACK_SHARE = 4.0
# Energy of the seen, observer-weighted spectra that their basis may lose.
_SPECTRAL_LOST = 1e-8
_PILOT = 1500
_SWEEPS = 40


@dataclass(frozen=True)
class Fit:
    """Packs whose sum stands for a BRDF, and how far off they are together."""

    packs: tuple[FactorPack, ...]
    error: FitError

    @property
    def rank(self) -> int:
        """Terms of all packs."""
        return sum(pack.rank for pack in self.packs)


@dataclass(frozen=True)
class Trial:
    """One number of terms that was tried for one lobe, with the other lobes exact; `kept`: the best so far.

    seconds : since this lobe's first trial began, its table already there. score : what is held against the budget.
    """

    lobe: int
    frame: Frame
    rank: int
    seconds: float
    error: FitError
    score: float
    kept: bool


def fit(
    brdf: Brdf,
    *,
    budget: float = 0.5,
    seed: int = 0,
    axes: tuple[Axis, ...] | None = None,
    ranks: tuple[int, ...] = RANKS,
    pixels: int = 128,
    frame: Frame | None = None,
    tried: Callable[[Trial], None] = lambda trial: None,
) -> Fit:
    """Factor packs for `brdf`, their spectra sampled on the working wavelengths.

    Parameters
    ----------
    budget : ΔE94 that the 99th percentile on the sphere protocol should not exceed, with 0.3 of it for the mean. The
        measured error is reported whether or not it is met: a budget may be out of reach of `ranks` or of the grid.
    seed : of the random starts; the same seed gives the same bits on the same machine.
    axes : grid for a BRDF of one lobe, in place of the one chosen for it.
    ranks : numbers of terms to try for each lobe, ascending.
    pixels : of the sphere protocol; recorded in the error's `protocol`.
    frame : fits the BRDF as one lobe in this frame, in place of the lobes that it names itself.
    tried : called after each number of terms.

    Raises
    ------
    InputError : the budget is not positive, or the BRDF is not finite somewhere above the horizon.
    """
    if not budget > 0:
        raise InputError("unusable budget", field="budget", found=budget, expected="a positive ΔE94")
    if not ranks:
        raise InputError("no ranks to try", field="ranks", found=0, expected="at least one number of terms")
    lobes = brdf.lobes() if frame is None else (Lobe(frame, brdf),)
    if axes is not None and len(lobes) != 1:
        raise InputError("one grid for several lobes", field="axes", found=len(lobes), expected="a BRDF of one lobe")
    isotropic = all(lobe.brdf.isotropic for lobe in lobes)
    protocol, back = (
        sphere_protocol(pixels, isotropic, angles) for angles in (LIGHT_ANGLES_DEG, BACK_LIGHT_ANGLES_DEG)
    )
    reference, behind = protocol.reference(brdf), back.reference(brdf)
    if not np.all(np.isfinite(reference)):
        raise InputError(
            "the BRDF is not finite", field="brdf", found="NaN or infinity on the sphere", expected="numbers"
        )
    share = budget / np.sqrt(len(lobes))
    packs, residual = [], 0.0
    for number, lobe in enumerate(lobes):
        alone = len(lobes) == 1
        views = (
            _View(protocol, reference, 0.0 if alone else reference - protocol.reference(lobe.brdf)),
            _View(back, behind, 0.0 if alone else behind - back.reference(lobe.brdf)),
        )

        def report(trial: Trial, number: int = number) -> None:
            tried(replace(trial, lobe=number))

        pack, relative = _fit_lobe(lobe, views, share, seed, axes, ranks, report)
        packs.append(pack)
        residual = max(residual, relative)
    # A lobe without light adds nothing, unless it is all there is.
    kept = tuple(pack for pack in packs if np.any(pack.spectral)) or (packs[0],)
    error = protocol.compare(reference, protocol.sample(kept), residual, protocol.most_negative(kept))
    return Fit(tuple(replace(pack, error=error) for pack in kept), error)


@dataclass(frozen=True, eq=False)
class _View:
    """What a lobe is judged on: the whole material's XYZ, and that of its other lobes."""

    protocol: SphereProtocol
    reference: Float[np.ndarray, "N 3"]
    others: Float[np.ndarray, "N 3"] | float

    def error(self, pack: FactorPack) -> FitError:
        return self.protocol.compare(self.reference, self.others + self.protocol.sample((pack,)))


def _fit_lobe(
    lobe: Lobe,
    views: tuple[_View, _View],
    budget: float,
    seed: int,
    axes: tuple[Axis, ...] | None,
    ranks: tuple[int, ...],
    tried: Callable[[Trial], None],
) -> tuple[FactorPack, float]:
    """The pack of fewest terms within the budget, else the best one; and its table's weighted relative residual."""
    front, back = views
    observed = front.protocol.weights(lobe.brdf.wavelengths_nm)
    axes = axes or lobe.axes or lobe_axes(lobe.brdf, lobe.frame, np.pi * observed[:, 1])
    analysis, synthesis = _lobe_spectra(lobe, axes, observed)
    table = tabulate(lobe.brdf, lobe.frame, axes, analysis)
    values = filled(table)
    if not np.all(np.isfinite(values)):
        raise InputError(
            "the BRDF is not finite", field=lobe.frame, found="NaN or infinity in its table", expected="numbers"
        )
    sampled = SpectralBasis.sampled()
    if not np.any(values):
        nothing = tuple(np.zeros((axis.size, 1)) for axis in axes)
        return FactorPack(lobe.frame, axes, nothing, np.zeros((1, len(WORKING_WAVELENGTHS_NM))), sampled), 0.0
    luminance = np.pi * (values @ (synthesis @ observed[:, 1]))
    if lobe.frame == "hd":
        luminance = luminance * np.maximum(node_directions(lobe.frame, axes)[0][..., 2], 0.0)
    weights = floored(node_weights(table, luminance), values)
    whole, compressed = WeightedTable(values, weights), CompressedTable.of(values, separable_roots(weights))

    def packed(factors: Factors) -> FactorPack:
        spectral = factors[-1].T @ synthesis
        if not np.array_equal(lobe.brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM):
            spectral = spectral @ interpolation_matrix(lobe.brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM).T
        return FactorPack(lobe.frame, axes, tuple(factors[:-1]), spectral, sampled)

    best_score, best = np.inf, (packed(compressed.decomposed(ranks[0], seed, 0)), 1.0)
    stalled = 0
    begun = time.perf_counter()
    for rank in ranks:
        factors, left = weighted_cp(whole, compressed.decomposed(rank, seed), _SWEEPS)
        pack = packed(factors)
        error = front.error(pack)
        score = max(error.p99, error.mean / _MEAN_SHARE, back.error(pack).p99 / _BACK_SHARE)
        stalled = 0 if score < 0.9 * best_score else stalled + 1
        tried(Trial(0, lobe.frame, rank, time.perf_counter() - begun, error, score, score < best_score))
        if score < best_score:
            best_score, best = score, (pack, float(np.sqrt(max(left, 0.0) / whole.energy)))
        # Near the budget, what is left after three vain attempts is the grid's error, which more terms cannot mend.
        if best_score <= budget or (stalled >= 3 and best_score < 3.0 * budget):
            break
    return best


def _lobe_spectra(lobe: Lobe, axes: tuple[Axis, ...], observed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Analysis (L,S) and synthesis (S,L) of the lobe's own spectra, orthonormal in the observer's eyes.

    Found from a pilot sample of the nodes; S is the numerical rank at most, 1 for a lobe without light.
    """
    wi, wo = (w.reshape(-1, 3) for w in node_directions(lobe.frame, axes))
    rows = np.flatnonzero((wi[:, 2] > 1e-3) & (wo[:, 2] > 1e-3))
    rows = rows[:: max(1, len(rows) // _PILOT)]
    spectra = lobe.brdf.eval(wi[rows], wo[rows]) * np.sqrt(wi[rows, 2:] * wo[rows, 2:])
    eye = np.linalg.norm(observed, axis=1)
    eye = np.maximum(eye / eye.max(), 0.05)
    _, singular, right = np.linalg.svd(spectra * eye, full_matrices=False)
    energy = np.cumsum(singular[::-1] ** 2)[::-1]
    size = max(1, int(np.sum(energy > _SPECTRAL_LOST * energy[0]))) if energy[0] > 0 else 1
    return eye[:, None] * right[:size].T, right[:size] / eye
