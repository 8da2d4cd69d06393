"""Joint refinement of all packs of a material on direction pairs as pictures show them.

The pairs lie between the grid's nodes, so that what linear interpolation gets wrong is fitted as well. Factors take
turns (block Gauss-Seidel over packs and axes, `axis_samples`), then the spectra of all packs are improved together:
each step lowers the same objective, the sum of squared ΔE94 to first order.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve

from ...spectral.basis import SpectralBasis
from ..brdf import Frame
from ..factors import Axis, FactorPack, frame_angles
from .axis_samples import AxisSamples
from .cp import balanced, extrapolated
from .seen import SeenSamples

# Steps of conjugate gradients towards the best spectra in every sweep.
_SPECTRAL_STEPS = 4
_TINY = 1e-100


class JointProblem:
    """The packs' grids met with the samples: what stays the same while factors change."""

    def __init__(self, packs: tuple[FactorPack, ...], samples: SeenSamples) -> None:
        self.packs, self.samples = packs, samples
        self.stress(np.ones(len(samples.wi)))
        self._grids: list[list[AxisSamples]] = []
        self._scales: list[np.ndarray] = []
        self._starts = np.cumsum([0, *(pack.rank for pack in packs)])
        for pack in packs:
            at = frame_angles(pack.frame, samples.wi, samples.wo, pack.anisotropic)
            self._scales.append(at.scale)
            self._grids.append(
                [AxisSamples.of(axis.position(at.angles[axis.name]), axis.size, axis.periodic) for axis in pack.axes]
            )

    def stress(self, weights: Float[np.ndarray, " N"]) -> None:
        """Let errors at each sample count this many times."""
        self._eye = self.samples.eye * np.sqrt(weights)[:, None, None]
        self._plain = self.samples.plain * weights

    def start(self) -> list[Float[np.ndarray, "_ R"]]:
        """Factors of all packs, axis by axis, each pack's spectra (S,R) last."""
        state = []
        for pack in self.packs:
            state += balanced([*pack.factors, (pack.basis.reconstruct(pack.spectral) @ self.samples.analysis).T])
        return state

    def packed(self, state: list[Float[np.ndarray, "_ R"]]) -> tuple[FactorPack, ...]:
        """The packs of these factors."""
        found = []
        for pack, (*factors, spectral) in zip(self.packs, self._split(state), strict=True):
            samples = spectral.T @ self.samples.synthesis
            found.append(
                replace(pack, factors=tuple(factors), spectral=samples, basis=SpectralBasis.sampled(), error=None)
            )
        return tuple(found)

    def _split(self, state: list[np.ndarray]) -> list[list[np.ndarray]]:
        parts, first = [], 0
        for pack in self.packs:
            count = len(pack.axes) + 1
            parts.append(list(state[first : first + count]))
            first += count
        return parts

    def with_best_spectra(self, state: list[Float[np.ndarray, "_ R"]]) -> list[Float[np.ndarray, "_ R"]]:
        """The same factors with spectra found for them: a start whose lengths mean nothing yet."""
        parts = self._split(state)
        terms = [
            scale[:, None] * np.prod([g.between(f) for g, f in zip(grids, part[:-1], strict=True)], axis=0)
            for scale, grids, part in zip(self._scales, self._grids, parts, strict=True)
        ]
        everything = np.hstack(terms)
        nothing = np.zeros((everything.shape[1], self.samples.targets.shape[1]))
        spectra, _ = self._spectra(everything, nothing, self.samples.targets)
        found = [[*part[:-1], rows.T] for part, rows in zip(parts, np.split(spectra, self._starts[1:-1]), strict=True)]
        return self.balanced([factor for part in found for factor in part])

    def balanced(self, state: list[Float[np.ndarray, "_ R"]]) -> list[Float[np.ndarray, "_ R"]]:
        """The same terms, each term's length shared equally among its factors."""
        return [factor for part in self._split(state) for factor in balanced(part)]

    def swept(self, state: list[Float[np.ndarray, "_ R"]]) -> tuple[list[Float[np.ndarray, "_ R"]], float]:
        """One round over all packs and axes, then all spectra at once; and the objective that is left."""
        parts = self._split(state)
        values = [
            [grid.between(factor) for grid, factor in zip(grids, part[:-1], strict=True)]
            for grids, part in zip(self._grids, parts, strict=True)
        ]
        terms = [scale[:, None] * np.prod(v, axis=0) for scale, v in zip(self._scales, values, strict=True)]
        left = self.samples.targets - sum(term @ part[-1].T for term, part in zip(terms, parts, strict=True))
        for number, (grids, part, value) in enumerate(zip(self._grids, parts, values, strict=True)):
            spectral = part[-1]
            target = left + terms[number] @ spectral.T
            seen = self._eye @ spectral
            aim = np.einsum("nkr,nk->nr", seen, np.einsum("nks,ns->nk", self._eye, target))
            aim += (target @ spectral) * self._plain[:, None]
            gram = spectral.T @ spectral
            for mode, grid in enumerate(grids):
                rest = self._scales[number][:, None] * np.prod([v for m, v in enumerate(value) if m != mode], axis=0)
                part[mode] = grid.solved(part[mode], rest, seen, self._plain, aim * rest, gram)
                value[mode] = grid.between(part[mode])
            terms[number] = self._scales[number][:, None] * np.prod(value, axis=0)
            left = target - terms[number] @ spectral.T
        spectra, left = self._spectra(np.hstack(terms), np.hstack([part[-1] for part in parts]).T, left)
        for part, rows in zip(parts, np.split(spectra, self._starts[1:-1]), strict=True):
            part[-1] = rows.T
        return [factor for part in parts for factor in part], self.objective(left)

    def objective(self, left: Float[np.ndarray, "N S"]) -> float:
        """Sum of the squares of what is left, as the eye has it."""
        return float(np.sum(np.einsum("nks,ns->nk", self._eye, left) ** 2) + self._plain @ np.sum(left**2, axis=1))

    def _spectra(
        self, terms: Float[np.ndarray, "N R"], spectra: Float[np.ndarray, "R S"], left: Float[np.ndarray, "N S"]
    ) -> tuple[Float[np.ndarray, "R S"], Float[np.ndarray, "N S"]]:
        """A few steps of conjugate gradients, preconditioned as if an error counted the same whatever its colour."""
        weights = np.einsum("nks,nks->n", self._eye, self._eye) / self._eye.shape[2] + self._plain
        matrix = (terms * weights[:, None]).T @ terms
        matrix[np.diag_indices_from(matrix)] *= 1.0 + 1e-9
        matrix[np.diag_indices_from(matrix)] += _TINY
        factor = cho_factor(matrix)

        def felt(error: np.ndarray) -> np.ndarray:
            return np.einsum("nks,nk->ns", self._eye, np.einsum("nks,ns->nk", self._eye, error)) + (
                self._plain[:, None] * error
            )

        gradient = terms.T @ felt(left)
        steered = cho_solve(factor, gradient)
        step, slope = steered, float(np.sum(gradient * steered))
        for _ in range(_SPECTRAL_STEPS):
            if not slope > 0.0:
                break
            moved = terms @ step
            curvature = float(np.sum(moved * felt(moved)))
            if not curvature > 0.0:
                break
            length = slope / curvature
            spectra, left = spectra + length * step, left - length * moved
            gradient = terms.T @ felt(left)
            steered = cho_solve(factor, gradient)
            before, slope = slope, float(np.sum(gradient * steered))
            step = steered + slope / before * step
        return spectra, left


def refined(
    packs: tuple[FactorPack, ...],
    samples: SeenSamples,
    sweeps: int = 8,
    stress: Float[np.ndarray, " N"] | None = None,
) -> tuple[tuple[FactorPack, ...], float]:
    """The packs after some rounds over all their factors together, and the objective relative to that of no packs.

    The objective never rises: the sum over the samples of the squared ΔE94, to first order, and of a small share of
    what another light might show. `stress` lets errors at each sample count that many times.
    """
    problem = JointProblem(packs, samples)
    if stress is not None:
        problem.stress(stress)
    state, left = extrapolated(problem.swept, problem.start(), sweeps, 0.0, problem.balanced)
    nothing = problem.objective(samples.targets)
    return problem.packed(state), float(np.sqrt(left / nothing)) if nothing > 0 else 0.0


def added(
    packs: tuple[FactorPack, ...],
    samples: SeenSamples,
    frame: Frame,
    axes: tuple[Axis, ...],
    rank: int,
    seed: int,
    sweeps: int = 12,
) -> tuple[FactorPack, float]:
    """A pack of `rank` new terms, fitted to what the others leave (which stay as they are); and the objective then.

    Starts from smooth random factors, a few cosines each: nodes between samples are then no worse than those on them.
    """
    rest = samples.less(packs)
    generator = np.random.default_rng((seed, sum(pack.rank for pack in packs), len(frame), axes[0].size))
    factors = tuple(_smooth(axis, rank, generator) for axis in axes)
    spectra = generator.standard_normal((rank, len(samples.synthesis))) @ samples.synthesis
    problem = JointProblem((FactorPack(frame, axes, factors, spectra, SpectralBasis.sampled()),), rest)
    state = problem.with_best_spectra(problem.start())
    state, left = extrapolated(problem.swept, state, sweeps, 0.0, problem.balanced)
    return problem.packed(state)[0], left


def _smooth(axis: Axis, rank: int, generator: np.random.Generator) -> Float[np.ndarray, "n R"]:
    order = np.arange(4)
    u = np.linspace(0.0, 1.0, axis.size)[:, None]
    waves = np.cos((2.0 if axis.periodic else 1.0) * np.pi * order * u)
    return waves @ (generator.standard_normal((4, rank)) / (1.0 + order)[:, None])


def finer(pack: FactorPack, most: int) -> FactorPack:
    """The same function on axes with a node between any two, as far as an axis then has `most` nodes at most."""
    axes, factors = [], []
    for axis, factor in zip(pack.axes, pack.factors, strict=True):
        if 2 * axis.size - 1 <= most:
            axis = replace(axis, size=2 * axis.size - 1)
            between = np.empty((axis.size, pack.rank))
            between[::2], between[1::2] = factor, 0.5 * (factor[1:] + factor[:-1])
            factor = between
        axes.append(axis)
        factors.append(factor)
    return replace(pack, axes=tuple(axes), factors=tuple(factors), precision="single", error=None)


def merged(packs: tuple[FactorPack, ...]) -> tuple[FactorPack, ...]:
    """One pack for each frame and grid, in the order in which they first appear."""
    groups: dict[tuple, list[FactorPack]] = {}
    for pack in packs:
        groups.setdefault((pack.frame, pack.axes), []).append(pack)
    return tuple(
        replace(
            group[0],
            factors=tuple(np.hstack(columns) for columns in zip(*(pack.factors for pack in group), strict=True)),
            spectral=np.vstack([pack.spectral for pack in group]),
            error=None,
        )
        for group in groups.values()
    )
