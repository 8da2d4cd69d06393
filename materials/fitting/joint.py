"""Joint refinement of all packs of a material on direction pairs drawn as pictures show them.

The pairs lie between the grid's nodes, so that the error of linear interpolation is fitted as well. Factors are updated
in turn (block Gauss-Seidel over packs and axes, `axis_samples`), then the spectra of all packs together: each step
lowers the same objective, the sum of squared ΔE94 to first order.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve

from ...spectral.palette import Palette
from ..core.axes import Axis, Frame
from ..factored.pack import FactorPack
from .axis_samples import BLOCK
from .cp import Factors, balanced, extrapolated_sweeps
from .pack_samples import PackSamples
from .visible_samples import SeenSamples

# Steps of conjugate gradients towards the best spectra in every sweep.
_SPECTRAL_STEPS = 4
# One guard looks at wavelengths that are farther apart than this many samples.
_APART = 6
# Guards whose packs are farther beyond the limit than this many times the limit cost by the first power: a square would
# let the worst of them rule over everything that pictures show.
_LINEAR_FROM = 2.0
# Share of the upper limit by which exceeding it counts as much as missing the lower one by all of that.
_HIGH = 0.1
# Keeps a system without any data solvable; its reciprocal is far from overflow.
_TINY = 1e-100
# Cosines that the factors of new terms begin with.
_WAVES = 4


class JointProblem:
    """Packs and samples together: positions of samples on the packs' grids, which stay while factors change.

    The state is a list of factors: axis by axis (n, R) of the first pack, then its spectra (S, R); then those of the
    next pack.
    """

    def __init__(self, packs: tuple[FactorPack, ...], samples: SeenSamples) -> None:
        self.packs, self.samples = packs, samples
        # Copy the sensitivity: guards change it in every sweep.
        if len(samples.guards):
            self.samples = samples = replace(samples, sensitivity=samples.sensitivity.copy())
        self._targets = samples.targets.T.copy()
        self._met = [PackSamples(pack, samples) for pack in packs]
        self._starts = np.cumsum([0, *(pack.rank for pack in packs)])

    def factors(self) -> Factors:
        """Return the packs' own factors, balanced."""
        found: Factors = []
        for pack in self.packs:
            found += balanced([*pack.factors, (pack.spectra @ self.samples.analysis).T])
        return found

    def packs_of(self, factors: Factors) -> tuple[FactorPack, ...]:
        """Return the packs of these factors."""
        found = []
        for pack, (*along_axes, spectral) in zip(self.packs, self._split(factors), strict=True):
            sampled = spectral.T @ self.samples.synthesis
            found.append(replace(pack, factors=tuple(along_axes), palette=Palette.of(sampled)))
        return tuple(found)

    def _split(self, factors: Factors) -> list[Factors]:
        """Return the factors of each pack."""
        parts, first = [], 0
        for pack in self.packs:
            count = len(pack.axes) + 1
            parts.append(list(factors[first : first + count]))
            first += count
        return parts

    def terms(self, factors: Factors) -> Float[np.ndarray, "N R"]:
        """Evaluate every term of all packs at every sample, without its spectrum."""
        found = self._terms
        for met, part, first, last in zip(
            self._met, self._split(factors), self._starts[:-1], self._starts[1:], strict=True
        ):
            met.terms(part[:-1], found=found[:, first:last])
        return found

    def spectra(self, factors: Factors) -> Float[np.ndarray, "R S"]:
        """Return the spectra of all terms."""
        return np.hstack([part[-1] for part in self._split(factors)]).T

    def with_spectra(self, factors: Factors, spectra: Float[np.ndarray, "R S"]) -> Factors:
        """Return the same factors with other spectra."""
        rows = np.split(spectra, self._starts[1:-1])
        parts = zip(self._split(factors), rows, strict=True)
        return [factor for part, row in parts for factor in (*part[:-1], row.T)]

    def with_best_spectra(self, factors: Factors) -> Factors:
        """Fit spectra to the factors, as a start; their current lengths are ignored."""
        terms = self.terms(factors)
        nothing = np.zeros((terms.shape[1], self.samples.targets.shape[1]))
        spectra, _ = self._spectra(terms, nothing, self.samples.targets.T.copy())
        return self.balanced(self.with_spectra(factors, spectra))

    def balanced(self, factors: Factors) -> Factors:
        """Return the same terms, each term's length shared equally among its factors."""
        return [factor for part in self._split(factors) for factor in balanced(part)]

    def sweep(self, factors: Factors) -> tuple[Factors, float]:
        """Update the factors once over all packs and axes, then all spectra at once; return them and the objective."""
        parts = self._split(factors)
        self._aim_guards(parts)
        left = self._targets.copy()
        rests = [self._rest[: len(left[0]) * pack.rank].reshape(-1, pack.rank) for pack in self.packs]
        for met, part, rest in zip(self._met, parts, rests, strict=True):
            met.put_rest(met.turns[0], part[:-1], rest)
            left -= met.shaded(met.turns[0], rest, part[0], part[-1])
        for met, part, rest in zip(self._met, parts, rests, strict=True):
            for turn in met.turns:
                met.put_rest(turn, part[:-1], rest)
                step = met.step(turn, rest, part[turn.mode], part[-1], self.samples.half_gradient(left))
                left -= met.shaded(turn, rest, step, part[-1])
                part[turn.mode] = part[turn.mode] + step
        factors = [factor for part in parts for factor in part]
        terms = self.terms(factors)
        spectra, left = self._spectra(terms, self.spectra(factors), left)
        return self.with_spectra(factors, spectra), self.objective(left, terms, spectra)

    def objective(
        self, left: Float[np.ndarray, "S N"], terms: Float[np.ndarray, "N R"], spectra: Float[np.ndarray, "R S"]
    ) -> float:
        """Compute the cost of residuals, in squared ΔE94 to first order, and of exceeding the limits of guards."""
        samples, first = self.samples, len(self.samples.wi) - len(self.samples.guards)
        left = left[:, :first]
        seen = np.einsum("ksn,sn->kn", samples.sensitivity[:, :, :first], left)
        found = float(np.vdot(seen, seen) + samples.base_weight[:first] @ np.sum(left**2, axis=0))
        if samples.limits is not None:
            low, high = samples.limits
            values = np.pi * (terms[first:] @ spectra) @ samples.synthesis
            beyond = np.maximum(np.maximum((low - values) / -low, (values - high) / (_HIGH * high)), 0.0)
            found += float(samples.guards @ (low[0] ** 2 * _guard_cost(beyond.max(axis=1))))
        return found

    def _spectra(
        self, terms: Float[np.ndarray, "N R"], spectra: Float[np.ndarray, "R S"], left: Float[np.ndarray, "S N"]
    ) -> tuple[Float[np.ndarray, "R S"], Float[np.ndarray, "S N"]]:
        """Improve the spectra by conjugate gradients, preconditioned as if errors of all colours were equal."""
        half_gradient = self.samples.half_gradient
        matrix = np.zeros((terms.shape[1], terms.shape[1]))
        for start in range(0, len(terms), BLOCK):
            rows = slice(start, start + BLOCK)
            weighted = self._roots[rows] * terms[rows]
            matrix += weighted.T @ weighted
        matrix[np.diag_indices_from(matrix)] *= 1.0 + 1e-9
        matrix[np.diag_indices_from(matrix)] += _TINY
        factor = cho_factor(matrix)
        gradient = (half_gradient(left) @ terms).T
        steered = cho_solve(factor, gradient)
        step, slope = steered, float(np.sum(gradient * steered))
        for _ in range(_SPECTRAL_STEPS):
            if not slope > 0.0:
                break
            moved = step.T @ terms.T
            turned = half_gradient(moved)
            curvature = float(np.vdot(moved, turned))
            if not curvature > 0.0:
                break
            length = slope / curvature
            spectra, left = spectra + length * step, left - length * moved
            gradient = gradient - length * (turned @ terms).T
            steered = cho_solve(factor, gradient)
            before, slope = slope, float(np.sum(gradient * steered))
            step = steered + slope / before * step
        return spectra, left

    def _aim_guards(self, parts: list[Factors]) -> None:
        """Set the target of each guard to the limits exceeded now, at the few wavelengths of the largest excess."""
        samples = self.samples
        count = len(samples.guards)
        if not count or samples.limits is None:
            return
        last = slice(len(samples.wi) - count, None)
        now = sum(part[-1] @ met.terms(part[:-1], last).T for met, part in zip(self._met, parts, strict=True))
        (low, high), rows = samples.limits, np.pi * samples.synthesis.T
        values = rows @ now
        over = _HIGH * high[:, None]
        beyond = np.maximum((low[:, None] - values) / -low[:, None], (values - high[:, None]) / over)
        every = np.arange(count)
        asked = np.zeros((*samples.sensitivity.shape[:2], count))
        aims = np.zeros((len(asked), count))
        for number in range(len(asked)):
            at = np.argmax(beyond, axis=0)
            active = beyond[at, every] > 0.0
            limit = np.where(values[at, every] < 0.0, low[at], high[at])
            # A square that touches `_guard_cost` where packs are now and is nowhere below it: costs still only fall.
            softened = np.sqrt(_LINEAR_FROM / np.maximum(beyond[at, every], _LINEAR_FROM))
            weight = np.where(active, np.sqrt(samples.guards) * softened, 0.0)
            weight *= np.where(values[at, every] < 0, 1.0, -low[at] / (_HIGH * limit))
            asked[number] = rows[at].T * weight
            aims[number] = limit * weight
            beyond[np.abs(np.arange(len(beyond))[:, None] - at) <= _APART] = 0.0
        short = aims - np.einsum("ksg,sg->kg", asked, now)
        back = np.linalg.pinv(asked.transpose(2, 0, 1), rcond=1e-6)
        targets = now.T + np.einsum("gsk,kg->gs", back, short)
        samples.sensitivity[:, :, last] = asked
        self._targets[:, last] = targets.T
        self._roots[last, 0] = np.sqrt(np.einsum("ksg,ksg->g", asked, asked) / len(samples.synthesis))

    @cached_property
    def _terms(self) -> Float[np.ndarray, "N R"]:
        """Buffer for all terms at all samples."""
        return np.empty((len(self.samples.wi), int(self._starts[-1])))

    @cached_property
    def _rest(self) -> Float[np.ndarray, " n"]:
        """Buffer for `put_rest` of each turn."""
        return np.empty(len(self.samples.wi) * max(pack.rank for pack in self.packs))

    @cached_property
    def _roots(self) -> Float[np.ndarray, "N 1"]:
        """Square root of the weight of an error at each sample, averaged over colours."""
        seen = self.samples.sensitivity
        return np.sqrt(np.einsum("ksn,ksn->n", seen, seen) / seen.shape[1] + self.samples.base_weight)[:, None]


def _guard_cost(beyond: Float[np.ndarray, " G"]) -> Float[np.ndarray, " G"]:
    """Compute Huber's cost of exceeding a limit, in multiples of it: quadratic, and linear from `_LINEAR_FROM` on."""
    return np.where(beyond <= _LINEAR_FROM, beyond**2, _LINEAR_FROM * (2.0 * beyond - _LINEAR_FROM))


def refined(
    packs: tuple[FactorPack, ...],
    samples: SeenSamples,
    sweeps: int = 8,
) -> tuple[tuple[FactorPack, ...], float]:
    """Refine all factors of the packs jointly by some sweeps; return the packs and their relative residual.

    The objective never rises: the sum over the samples of the squared ΔE94, to first order, and of a small share for
    other lights. The second result is the square root of its ratio to that of no packs, 0 if there is no light.
    """
    problem = JointProblem(packs, samples)
    factors, left = extrapolated_sweeps(problem.sweep, problem.factors(), sweeps, 0.0, problem.balanced)
    nothing = samples.cost(())
    return problem.packs_of(factors), float(np.sqrt(left / nothing)) if nothing > 0 else 0.0


def refined_without_extrapolation(
    packs: tuple[FactorPack, ...], samples: SeenSamples, sweeps: int
) -> tuple[FactorPack, ...]:
    """Refine the packs by some sweeps without extrapolation, which moves them no farther than their guards require."""
    problem = JointProblem(packs, samples)
    factors = problem.factors()
    for _ in range(sweeps):
        factors, _ = problem.sweep(factors)
    return problem.packs_of(factors)


def new_terms(
    packs: tuple[FactorPack, ...],
    samples: SeenSamples,
    frame: Frame,
    axes: tuple[Axis, ...],
    rank: int,
    seed: int,
    sweeps: int = 12,
) -> tuple[FactorPack, float]:
    """Fit a pack of `rank` new terms to the residual of `packs`, which stay; return it and its objective.

    Starts from smooth random factors, a few cosines each, so that nodes between samples are no worse than those on
    them.
    """
    rest = samples.minus(packs)
    generator = np.random.default_rng((seed, sum(pack.rank for pack in packs), len(frame), axes[0].size))
    factors = tuple(_smooth(axis, rank, generator) for axis in axes)
    spectra = generator.standard_normal((rank, len(samples.synthesis))) @ samples.synthesis
    problem = JointProblem((FactorPack(frame, axes, factors, Palette.of(spectra)),), rest)
    factors = problem.with_best_spectra(problem.factors())
    factors, left = extrapolated_sweeps(problem.sweep, factors, sweeps, 0.0, problem.balanced)
    return problem.packs_of(factors)[0], left


def _smooth(axis: Axis, rank: int, generator: np.random.Generator) -> Float[np.ndarray, "n R"]:
    """Sum a few random cosines along an axis, with larger amplitudes for lower frequencies."""
    order = np.arange(_WAVES)
    u = np.linspace(0.0, 1.0, axis.size)[:, None]
    waves = np.cos((2.0 if axis.periodic else 1.0) * np.pi * order * u)
    return waves @ (generator.standard_normal((_WAVES, rank)) / (1.0 + order)[:, None])
