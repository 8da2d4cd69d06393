"""One lobe on its grid: the table, what its nodes are seen as, and factor packs of it by several methods."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from ...spectral.basis import SpectralBasis
from ...spectral.errors import InputError
from ...spectral.projection import projection_matrix
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..axes import Axis
from ..brdf import Lobe
from ..factors import FactorPack
from .cp import CompressedTable, Factors, WeightedTable, weighted_cp
from .decompose import decompose_compressed
from .grids import filled, floored, lobe_axes, node_weights, separable_roots
from .smoothing import smoothed_pack
from .tabulated import node_directions, tabulate
from .tucker import Tucker, compressed

Method = Literal["joint", "weighted", "incremental", "refitted"]
METHODS: tuple[Method, ...] = ("joint", "weighted", "incremental", "refitted")

# Energy of the seen, observer-weighted spectra that their basis may lose.
_SPECTRAL_LOST = 1e-8
_PILOT = 1500
_SWEEPS = 40
# Where packs are refined afterwards, large problems (nodes times squared rank) are only begun on the table.
_LARGE, _FEW_SWEEPS = 10_000_000, 6
# So many terms end in this or that local minimum, whatever rounding leads to: of some starts, the best after a few
# sweeps goes on.
_MANY_TERMS, _STARTS, _FIRST_SWEEPS = 6, 4, 8
# Share of the energy that the packs of four may lose before they are looked for, and the most columns of a core.
_LOST, _MOST = 1e-9, 112


@dataclass(frozen=True, eq=False)
class LobeTable:
    """values (*grid, S) in the lobe's own spectra, `synthesis` (S,L) on the working wavelengths; weights of nodes."""

    lobe: Lobe
    axes: tuple[Axis, ...]
    values: Float[np.ndarray, "*grid S"]
    weights: Float[np.ndarray, "*grid"]
    synthesis: Float[np.ndarray, "S L"]

    @classmethod
    def of(cls, lobe: Lobe, observed: Float[np.ndarray, "L 3"], axes: tuple[Axis, ...] | None = None) -> LobeTable:
        """Tabulate; `observed` (L,3) is light x observer at the lobe's wavelengths.

        Raises
        ------
        InputError : the BRDF is not finite somewhere above the horizon.
        """
        axes = axes or lobe.axes or lobe_axes(lobe.brdf, lobe.frame, np.pi * observed[:, 1])
        analysis, synthesis = _lobe_spectra(lobe, axes, observed)
        table = tabulate(lobe.brdf, lobe.frame, axes, analysis)
        values = filled(table)
        if not np.all(np.isfinite(values)):
            raise InputError(
                "the BRDF is not finite", field=lobe.frame, found="NaN or infinity in its table", expected="numbers"
            )
        luminance = np.pi * (values @ (synthesis @ observed[:, 1]))
        if lobe.frame == "hd":
            luminance = luminance * np.maximum(node_directions(lobe.frame, axes)[0][..., 2], 0.0)
        weights = floored(node_weights(table, luminance), values)
        if not np.array_equal(lobe.brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM):
            synthesis = synthesis @ projection_matrix(lobe.brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM).T
        return cls(lobe, axes, values, weights, synthesis)

    @property
    def black(self) -> bool:
        """No light at any node."""
        return not np.any(self.values)

    def pack(self, rank: int, seed: int, method: Method, smooth: bool = False) -> tuple[FactorPack, float]:
        """A pack of `rank` terms by `method`, and the weighted relative residual of the table.

        "weighted": with the nodes' true weights. "joint": the same in fewer sweeps where that takes long, since the
        pack is refined afterwards. "incremental", "refitted": packs of four terms, unweighted (`decompose`).
        """
        if self.black:
            return self._packed([np.zeros((size, 1)) for size in self.values.shape]), 0.0
        if method in ("incremental", "refitted"):
            found = decompose_compressed(self._form, rank, method=method, seed=seed)
            pack, relative = self._packed(list(found.factors)), found.relative_error
        else:
            few = method == "joint" and self.weights.size * rank**2 > _LARGE
            start = self._compressed.decomposed(rank, seed)
            if not few and rank >= _MANY_TERMS:
                others = (self._compressed.decomposed(rank, (seed, number)) for number in range(1, _STARTS))
                begun = (weighted_cp(self._weighted, one, _FIRST_SWEEPS) for one in (start, *others))
                start, _ = min(begun, key=lambda one: one[1])
            factors, left = weighted_cp(self._weighted, start, _FEW_SWEEPS if few else _SWEEPS)
            pack, relative = self._packed(factors), float(np.sqrt(max(left, 0.0) / self._weighted.energy))
        return (smoothed_pack(pack) if smooth else pack), relative

    def _packed(self, factors: Factors) -> FactorPack:
        spectral = factors[-1].T @ self.synthesis
        return FactorPack(self.lobe.frame, self.axes, tuple(factors[:-1]), spectral, SpectralBasis.sampled())

    @cached_property
    def _weighted(self) -> WeightedTable:
        return WeightedTable(self.values, self.weights)

    @cached_property
    def _compressed(self) -> CompressedTable:
        return CompressedTable.of(self.values, separable_roots(self.weights))

    @cached_property
    def _form(self) -> Tucker:
        return compressed(self.values, _LOST, _MOST)


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
