"""One lobe on its grid: the table, weights by the visibility of nodes, and factor packs by several methods."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from jaxtyping import Float
from tensorly.cp_tensor import CPTensor

from ...runtime.errors import InputError
from ...spectral.palette import Palette
from ...spectral.projection import projection_matrix
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..core.axes import Axis
from ..core.brdf import Lobe
from ..factored.pack import FactorPack
from .brdf_table import node_directions, tabulate
from .cp import CompressedTable, WeightedTable, absorbed, weighted_cp
from .decompose import decompose_compressed
from .grids import filled, floored, lobe_axes, node_weights, separable_roots
from .tucker import Tucker, compressed

Method = Literal["joint", "weighted", "incremental", "refitted"]
METHODS: tuple[Method, ...] = ("joint", "weighted", "incremental", "refitted")

# Energy of the seen, observer-weighted spectra that their basis may lose.
_SPECTRAL_LOST = 1e-8
# Approximate number of nodes whose spectra that basis is fitted to.
_PILOT = 1500
# Floor of the observer's sensitivity in the weights of wavelengths, as a share of its maximum.
_LEAST_OBSERVED = 0.05
# Weighted sweeps over the table, at most.
_SWEEPS = 40
# If packs are refined afterwards, problems larger than this (nodes times squared rank) are only begun on the table.
_LARGE = 10_000_000
# Weighted sweeps of such a beginning, at most.
_FEW_SWEEPS = 6
# Number of terms from which rounding decides the local minimum that is reached: several starts are tried.
_MANY_TERMS = 6
# Starts that are tried for many terms; the best goes on.
_STARTS = 4
# Weighted sweeps of each of those starts before they are compared.
_FIRST_SWEEPS = 8
# Share of the energy that compression may lose before packs of four are looked for.
_LOST = 1e-9
# Columns that a basis of the compressed table has at most.
_MOST_COLUMNS = 112


@dataclass(frozen=True, eq=False)
class LobeTable:
    """A lobe on the grid of `axes`.

    values : f_r cos(theta_i) in frame io, f_r in frame hd, as coefficients of the lobe's own S spectra.
    weights : of squared errors at each node.
    synthesis : those spectra on the working wavelengths.
    """

    lobe: Lobe
    axes: tuple[Axis, ...]
    values: Float[np.ndarray, "*grid S"]
    weights: Float[np.ndarray, "*grid"]
    synthesis: Float[np.ndarray, "S L"]
    _packs: dict[tuple[int, int, Method, bool], tuple[FactorPack, float]] = field(default_factory=dict, repr=False)

    @classmethod
    def shared(cls, lobe: Lobe, observed: Float[np.ndarray, "L 3"], axes: tuple[Axis, ...] | None = None) -> LobeTable:
        """Make the table, and its packs, once for lobes of the same terms and spectra, such as coats.

        The last few are cached, for isotropic lobes only: other tables are large. Parameters and errors as of `of`.
        """
        terms = lobe.brdf.sum_of_terms
        if terms is None or not lobe.brdf.isotropic:
            return cls.of(lobe, observed, axes)
        values = (terms.spectra, lobe.brdf.wavelengths_nm, observed)
        key = (lobe.frame, lobe.axes, axes, terms.key, *(part.tobytes() for part in values))
        return _kept_table(_Asked(key, lobe, observed, axes))

    @classmethod
    def of(cls, lobe: Lobe, observed: Float[np.ndarray, "L 3"], axes: tuple[Axis, ...] | None = None) -> LobeTable:
        """Tabulate a lobe.

        observed : light times observer at the lobe's own wavelengths, Y of the perfect diffuser = 1.
        axes : the grid, in place of the lobe's own or the one chosen for it.

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
        """True if there is no light at any node."""
        return not np.any(self.values)

    def pack(self, rank: int, seed: int, method: Method, smooth: bool = False) -> tuple[FactorPack, float]:
        """Fit a pack of `rank` terms by `method`; return it and the weighted relative residual of the table.

        "weighted": with the nodes' true weights. "joint": the same, in fewer sweeps if these are slow, since the pack
        is refined afterwards. "incremental", "refitted": packs of four terms, unweighted (`decompose`).
        """
        asked = (rank, seed, method, smooth)
        if asked not in self._packs:
            self._packs[asked] = self._fitted(*asked)
        return self._packs[asked]

    def _fitted(self, rank: int, seed: int, method: Method, smooth: bool) -> tuple[FactorPack, float]:
        if self.black:
            return self._packed(CPTensor((None, [np.zeros((size, 1)) for size in self.values.shape]))), 0.0
        if method in ("incremental", "refitted"):
            found = decompose_compressed(self._form, rank, method=method, seed=seed)
            pack, relative = self._packed(found.cp), found.relative_error
        else:
            few = method == "joint" and self.weights.size * rank**2 > _LARGE
            start = self._compressed.decomposed(rank, seed)
            if not few and rank >= _MANY_TERMS:
                others = (self._compressed.decomposed(rank, (seed, number)) for number in range(1, _STARTS))
                begun = (weighted_cp(self._weighted, one, _FIRST_SWEEPS) for one in (start, *others))
                start, _ = min(begun, key=lambda one: one[1])
            found, left = weighted_cp(self._weighted, start, _FEW_SWEEPS if few else _SWEEPS)
            pack, relative = self._packed(found), float(np.sqrt(max(left, 0.0) / self._weighted.energy))
        return (smoothed_pack(pack) if smooth else pack), relative

    def _packed(self, decomposition: CPTensor) -> FactorPack:
        """Convert a decomposition of `values` to a pack, its last mode written as spectra."""
        *factors, coefficients = absorbed(decomposition)
        spectral = coefficients.T @ self.synthesis
        return FactorPack(self.lobe.frame, self.axes, tuple(factors), Palette.of(spectral))

    @cached_property
    def _weighted(self) -> WeightedTable:
        """Table laid out for sweeps with the nodes' true weights."""
        return WeightedTable(self.values, self.weights)

    @cached_property
    def _compressed(self) -> CompressedTable:
        """Table compressed under separable weights, for starts."""
        return CompressedTable.of(self.values, separable_roots(self.weights))

    @cached_property
    def _form(self) -> Tucker:
        """Table compressed without weights, for packs of four."""
        return compressed(self.values, _LOST, _MOST_COLUMNS)


@dataclass(frozen=True)
class _Asked:
    """Parameters of a table, compared by the key alone."""

    key: tuple[Hashable, ...]
    lobe: Lobe = field(compare=False)
    observed: Float[np.ndarray, "L 3"] = field(compare=False)
    axes: tuple[Axis, ...] | None = field(compare=False)


@lru_cache(maxsize=4)
def _kept_table(asked: _Asked) -> LobeTable:
    return LobeTable.of(asked.lobe, asked.observed, asked.axes)


def _lobe_spectra(lobe: Lobe, axes: tuple[Axis, ...], observed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute analysis (L,S) and synthesis (S,L) of the lobe's own spectra, orthonormal in the observer's metric.

    From a pilot sample of the nodes; S is the numerical rank, and 1 for a lobe without light.
    """
    wi, wo = (w.reshape(-1, 3) for w in node_directions(lobe.frame, axes))
    rows = np.flatnonzero((wi[:, 2] > 1e-3) & (wo[:, 2] > 1e-3))
    rows = rows[:: max(1, len(rows) // _PILOT)]
    spectra = lobe.brdf.eval(wi[rows], wo[rows]) * np.sqrt(wi[rows, 2:] * wo[rows, 2:])
    bright = np.linalg.norm(observed, axis=1)
    bright = np.maximum(bright / bright.max(), _LEAST_OBSERVED)
    _, singular, right = np.linalg.svd(spectra * bright, full_matrices=False)
    energy = np.cumsum(singular[::-1] ** 2)[::-1]
    size = max(1, int(np.sum(energy > _SPECTRAL_LOST * energy[0]))) if energy[0] > 0 else 1
    return bright[:, None] * right[:size].T, right[:size] / bright


def smoothed_pack(pack: FactorPack) -> FactorPack:
    """Smooth every factor of a pack over its angle; spectra stay; the error is unknown."""
    factors = [smoothed(factor, axis.periodic) for factor, axis in zip(pack.factors, pack.axes, strict=True)]
    return replace(pack, factors=tuple(factors))


def smoothed(factor: Float[np.ndarray, "n R"], periodic: bool = False) -> Float[np.ndarray, "n R"]:
    """Compute a moving average four nodes wide: a little less sharpness for fewer ripples (Schwenk 2010, figure 4).

    Centred on the node: four whole steps, so that the outermost two of five samples count half. Clamped at the ends, or
    wrapped on a periodic axis.

    >>> smoothed(np.array([[0.0], [0.0], [0.0], [8.0], [0.0], [0.0], [0.0]]))[:, 0].tolist()
    [0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0]
    """
    held = np.pad(factor[:-1], ((2, 3), (0, 0)), mode="wrap") if periodic else np.pad(factor, ((2, 2), (0, 0)), "edge")
    count = len(factor)
    taps = (0.125, 0.25, 0.25, 0.25, 0.125)
    return sum((tap * held[k : k + count] for k, tap in enumerate(taps)), np.zeros_like(factor))
