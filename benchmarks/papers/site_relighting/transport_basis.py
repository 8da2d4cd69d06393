"""A small basis for light on its way between surfaces, planned with the spectra of two and three surfaces one after
the other.

The plain basis of a few reflectances stops at their number, and products of them lie outside of it. Here the rows that
`SpectralBasis.balanced` takes are what light has met so far, and the columns what may follow before it is seen; both
together are one path. This is balanced truncation of a linear system (Moore 1981), as in `radiance_basis`, with light
left out of the coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from ....spectral.basis import SpectralBasis
from ....spectral.difference import delta_e_xyz
from ....spectral.illuminants import illuminant
from ....spectral.observers import Observer
from ....spectral.spectrum import Spectrum

#: ΔE94 that a basis may be off along any path, and lights that it is good under whatever a scene is lit by.
ENOUGH = 0.1
LIGHTS = ("D65", "A", "FL11")
# Products of each length that a basis is made from, paths that it is tried on, and surfaces of the longest path.
_PRODUCTS, _PATHS, _LONGEST = 1024, 512, 4


def transport_basis(
    spectra: Float[np.ndarray, "n L"],
    lights: Sequence[Spectrum],
    seen_by: Observer,
    wavelengths_nm: Float[np.ndarray, " L"],
    enough: float = ENOUGH,
    before: SpectralBasis | None = None,
) -> SpectralBasis:
    """Return the smallest balanced basis that keeps paths of two to four surfaces within ΔE94 `enough`.

    spectra : that surfaces reflect with, of 1. lights : of the scene; D65, A and FL11 come to them.
    before : a basis that is kept if it does so.
    The basis is that of all samples where no smaller one will do.
    """
    known = np.unique(np.maximum(spectra, 0.0), axis=0)
    known = known[known.any(axis=1)]
    lamps = [*lights, *(illuminant(name) for name in LIGHTS)]
    weights = np.concatenate([seen_by.weights(lamp, wavelengths_nm) for lamp in lamps])
    if not len(known):
        known = np.ones((1, len(wavelengths_nm)))
    generator = np.random.default_rng(3)
    paths = [generator.integers(len(known), size=(_PATHS, length)) for length in range(2, _LONGEST + 1)]
    fits = before is not None and np.array_equal(before.wavelengths_nm, wavelengths_nm)
    if before is not None and fits and (before.is_sampled or _error(before, known, paths, weights) <= enough):
        return before
    once, twice = known, _products(known, known, generator)
    thrice = _products(known, twice, generator)
    rows = np.concatenate([_by_lightness(each, weights[1]) for each in (once, twice, thrice)])
    columns = np.concatenate([weights, _products(known, weights, generator), _products(twice, weights, generator)])
    # The balanced basis of a table's triangle is that of the table.
    surfaces, follow = (np.asarray(np.linalg.qr(each, mode="r")) for each in (rows, columns))
    full = SpectralBasis.balanced(surfaces, follow.T, wavelengths_nm=wavelengths_nm)
    low, high = min(3, full.size), full.size
    if _error(full, known, paths, weights) > enough:
        return SpectralBasis.sampled(wavelengths_nm)
    while low < high:
        middle = (low + high) // 2
        if _error(full.truncated(middle), known, paths, weights) <= enough:
            high = middle
        else:
            low = middle + 1
    return full.truncated(high)


def _products(one: np.ndarray, other: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Return all of them, or as many as there may be, drawn."""
    if len(one) * len(other) <= _PRODUCTS:
        return (one[:, None] * other).reshape(-1, one.shape[1])
    return one[generator.integers(len(one), size=_PRODUCTS)] * other[generator.integers(len(other), size=_PRODUCTS)]


def _by_lightness(rows: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Spectra, as steep as L* is at each."""
    return rows * np.maximum(rows @ y, 1e-3)[:, None] ** (-2.0 / 3.0)


def _error(
    basis: SpectralBasis,
    known: Float[np.ndarray, "n L"],
    paths: Sequence[Int[np.ndarray, "paths _"]],
    weights: Float[np.ndarray, "m L"],
) -> float:
    """Return the largest ΔE94 along paths: coefficients of the first surface, operators, and an exact fold at the
    last."""
    first, operators = basis.project(known), basis.operator(known)
    folds = np.einsum("nl,ml,lj->nmj", known, weights, basis.synthesis, optimize=True)
    whites, worst = weights.sum(axis=1).reshape(-1, 3), 0.0
    for each in paths:
        now, truth = first[each[:, 0]], known[each[:, 0]]
        for step in each.T[1:-1]:
            now, truth = np.einsum("pjk,pk->pj", operators[step], now), truth * known[step]
        ours = np.einsum("pmj,pj->pm", folds[each[:, -1]], now).reshape(len(each), -1, 3)
        exact = (truth * known[each[:, -1]] @ weights.T).reshape(len(each), -1, 3)
        for light, white in enumerate(whites):
            worst = max(worst, float(delta_e_xyz(exact[:, light], ours[:, light], white).max()))
    return worst
