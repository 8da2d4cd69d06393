"""Joint refinement of all packs of a material on direction pairs as pictures show them.

The pairs lie between the grid's nodes, so that what linear interpolation gets wrong is fitted as well. Factors take
turns (block Gauss-Seidel over packs and axes, `axis_samples`), then the spectra of all packs are improved together:
each step lowers the same objective, the sum of squared ΔE94 to first order.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve

from ...spectral.basis import SpectralBasis
from ..axes import Axis, Frame
from ..factors import FactorPack, frame_angles
from .axis_samples import AxisSamples
from .cp import balanced, extrapolated
from .seen import FARTHEST, SeenSamples

# Steps of conjugate gradients towards the best spectra in every sweep.
_SPECTRAL_STEPS = 4
# Wavelengths at which one guard leans are farther apart than this many samples.
_APART = 6
# Guards that are farther beyond their limit than this many times the limit lean on it by the first power: a square
# would let the worst of them rule over everything that pictures show.
_FIRM = 2.0
# Beyond the upper limit by this share of it counts as much as beyond the lower one by all of that.
_HIGH = 0.1
_TINY = 1e-100


class JointProblem:
    """The packs' grids met with the samples: what stays the same while factors change."""

    def __init__(self, packs: tuple[FactorPack, ...], samples: SeenSamples) -> None:
        self.packs, self.samples = packs, samples
        # Guards lean on their limits anew in every sweep: what they ask for is this problem's own.
        if len(samples.guards):
            self.samples = samples = replace(samples, eye=samples.eye.copy())
        self._targets = samples.targets.copy()
        self._sorted: dict[int, np.ndarray] = {}
        self._grids: list[list[AxisSamples]] = []
        self._scales: list[np.ndarray] = []
        self._starts = np.cumsum([0, *(pack.rank for pack in packs)])
        for pack in packs:
            at = frame_angles(pack.frame, samples.wi, samples.wo, pack.anisotropic)
            self._scales.append(at.scale)
            self._grids.append(
                [AxisSamples.of(axis.position(at.angles[axis.name]), axis.size, axis.periodic) for axis in pack.axes]
            )

    def start(self) -> list[Float[np.ndarray, "_ _"]]:
        """Factors of all packs, axis by axis, each pack's spectra (S,R) last."""
        state = []
        for pack in self.packs:
            state += balanced([*pack.factors, (pack.basis.reconstruct(pack.spectral) @ self.samples.analysis).T])
        return state

    def packed(self, state: list[Float[np.ndarray, "_ _"]]) -> tuple[FactorPack, ...]:
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

    def terms(self, state: list[Float[np.ndarray, "_ _"]]) -> Float[np.ndarray, "N R"]:
        """Every term of all packs at every sample, without its spectrum."""
        return np.hstack(
            [
                _product(scale, [grid.between(factor) for grid, factor in zip(grids, part[:-1], strict=True)])
                for scale, grids, part in zip(self._scales, self._grids, self._split(state), strict=True)
            ]
        )

    def spectra(self, state: list[Float[np.ndarray, "_ _"]]) -> Float[np.ndarray, "R S"]:
        """The spectra of all terms."""
        return np.hstack([part[-1] for part in self._split(state)]).T

    def with_spectra(
        self, state: list[Float[np.ndarray, "_ _"]], spectra: Float[np.ndarray, "R S"]
    ) -> list[Float[np.ndarray, "_ _"]]:
        """The same factors with other spectra."""
        rows = np.split(spectra, self._starts[1:-1])
        parts = zip(self._split(state), rows, strict=True)
        return [factor for part, row in parts for factor in (*part[:-1], row.T)]

    def with_best_spectra(self, state: list[Float[np.ndarray, "_ _"]]) -> list[Float[np.ndarray, "_ _"]]:
        """The same factors with spectra found for them: a start whose lengths mean nothing yet."""
        terms = self.terms(state)
        nothing = np.zeros((terms.shape[1], self.samples.targets.shape[1]))
        spectra, _ = self._spectra(terms, nothing, self.samples.targets.T.copy())
        return self.balanced(self.with_spectra(state, spectra))

    def balanced(self, state: list[Float[np.ndarray, "_ _"]]) -> list[Float[np.ndarray, "_ _"]]:
        """The same terms, each term's length shared equally among its factors."""
        return [factor for part in self._split(state) for factor in balanced(part)]

    def swept(self, state: list[Float[np.ndarray, "_ _"]]) -> tuple[list[Float[np.ndarray, "_ _"]], float]:
        """One round over all packs and axes, then all spectra at once; and the objective that is left."""
        parts = self._split(state)
        values = [
            [grid.between(factor) for grid, factor in zip(grids, part[:-1], strict=True)]
            for grids, part in zip(self._grids, parts, strict=True)
        ]
        terms = [_product(scale, value) for scale, value in zip(self._scales, values, strict=True)]
        self._lean(terms, [part[-1] for part in parts])
        left = self._targets.T.copy()
        for term, part in zip(terms, parts, strict=True):
            left -= part[-1] @ term.T
        for number, (grids, part, value) in enumerate(zip(self._grids, parts, values, strict=True)):
            spectral = part[-1]
            target = left + spectral @ terms[number].T
            aim = self.samples.felt(target).T @ spectral
            for mode, grid in enumerate(grids):
                rest = _product(self._scales[number], [v for m, v in enumerate(value) if m != mode])
                part[mode] = grid.solved(part[mode], rest, self._rows(grid), spectral, self.samples.plain, aim * rest)
                value[mode] = grid.between(part[mode])
            terms[number] = _product(self._scales[number], value)
            left = target - spectral @ terms[number].T
        state = [factor for part in parts for factor in part]
        spectra, left = self._spectra(np.hstack(terms), self.spectra(state), left)
        return self.with_spectra(state, spectra), self.objective(left, np.hstack(terms), spectra)

    def objective(
        self, left: Float[np.ndarray, "S N"], terms: Float[np.ndarray, "N R"], spectra: Float[np.ndarray, "R S"]
    ) -> float:
        """Sum of the squares of what is left, as the eye has it, and of what guards are beyond their limits."""
        samples, first = self.samples, len(self.samples.wi) - len(self.samples.guards)
        eye, left = samples.eye[:, :, :first], left[:, :first]
        seen = np.einsum("ksn,sn->kn", eye, left)
        found = float(np.vdot(seen, seen) + samples.plain[:first] @ np.sum(left**2, axis=0))
        if samples.limits is not None:
            low, high = samples.limits
            values = np.pi * (terms[first:] @ spectra) @ samples.synthesis
            beyond = np.maximum(np.maximum((low - values) / -low, (values - high) / (_HIGH * high)), 0.0)
            found += float(samples.guards @ (low[0] ** 2 * _leaned(beyond.max(axis=1))))
        return found

    def _spectra(
        self, terms: Float[np.ndarray, "N R"], spectra: Float[np.ndarray, "R S"], left: Float[np.ndarray, "S N"]
    ) -> tuple[Float[np.ndarray, "R S"], Float[np.ndarray, "S N"]]:
        """A few steps of conjugate gradients, preconditioned as if an error counted the same whatever its colour."""
        felt = self.samples.felt
        matrix = (terms * self._weights[:, None]).T @ terms
        matrix[np.diag_indices_from(matrix)] *= 1.0 + 1e-9
        matrix[np.diag_indices_from(matrix)] += _TINY
        factor = cho_factor(matrix)
        gradient = (felt(left) @ terms).T
        steered = cho_solve(factor, gradient)
        step, slope = steered, float(np.sum(gradient * steered))
        for _ in range(_SPECTRAL_STEPS):
            if not slope > 0.0:
                break
            moved = step.T @ terms.T
            felt_moved = felt(moved)
            curvature = float(np.vdot(moved, felt_moved))
            if not curvature > 0.0:
                break
            length = slope / curvature
            spectra, left = spectra + length * step, left - length * moved
            gradient = gradient - length * (felt_moved @ terms).T
            steered = cho_solve(factor, gradient)
            before, slope = slope, float(np.sum(gradient * steered))
            step = steered + slope / before * step
        return spectra, left

    def _lean(self, terms: list[Float[np.ndarray, "N _"]], spectra: list[Float[np.ndarray, "S _"]]) -> None:
        """Let each guard lean on the limits that it is beyond now, at the few wavelengths where it is most."""
        samples = self.samples
        count = len(samples.guards)
        if not count or samples.limits is None:
            return
        last = slice(len(samples.wi) - count, None)
        now = sum(spectral @ term[last].T for term, spectral in zip(terms, spectra, strict=True))
        (low, high), rows = samples.limits, np.pi * samples.synthesis.T
        values = rows @ now
        over = _HIGH * high[:, None]
        beyond = np.maximum((low[:, None] - values) / -low[:, None], (values - high[:, None]) / over)
        every = np.arange(count)
        eye = np.zeros((*samples.eye.shape[:2], count))
        aims = np.zeros((len(eye), count))
        for number in range(len(eye)):
            at = np.argmax(beyond, axis=0)
            active = beyond[at, every] > 0.0
            limit = np.where(values[at, every] < 0.0, low[at], high[at])
            # A square that touches `_leaned` where the guard is now and is nowhere below it: costs still only fall.
            softened = np.sqrt(_FIRM / np.maximum(beyond[at, every], _FIRM))
            weight = np.where(active, np.sqrt(samples.guards) * softened, 0.0)
            weight *= np.where(values[at, every] < 0, 1.0, -low[at] / (_HIGH * limit))
            eye[number] = rows[at].T * weight
            aims[number] = limit * weight
            beyond[np.abs(np.arange(len(beyond))[:, None] - at) <= _APART] = 0.0
        short = aims - np.einsum("ksg,sg->kg", eye, now)
        back = np.linalg.pinv(eye.transpose(2, 0, 1), rcond=1e-6)
        targets = now.T + np.einsum("gsk,kg->gs", back, short)
        samples.eye[:, :, last] = eye
        self._targets[last] = targets
        self._weights[last] = np.einsum("ksg,ksg->g", eye, eye) / len(samples.synthesis)
        for grids in self._grids:
            for grid in grids:
                if id(grid) in self._sorted:
                    place = np.empty(len(grid.order), dtype=np.intp)
                    place[grid.order] = np.arange(len(place))
                    self._sorted[id(grid)][place[last]] = eye.transpose(2, 0, 1)

    def _rows(self, grid: AxisSamples) -> Float[np.ndarray, "N K S"]:
        """`SeenSamples.eye` in the order of an axis."""
        if id(grid) not in self._sorted:
            self._sorted[id(grid)] = np.ascontiguousarray(self.samples.eye.transpose(2, 0, 1)[grid.order])
        return self._sorted[id(grid)]

    @cached_property
    def _weights(self) -> Float[np.ndarray, " N"]:
        """What an error at each sample counts, whatever its colour."""
        eye = self.samples.eye
        return np.einsum("ksn,ksn->n", eye, eye) / eye.shape[1] + self.samples.plain


def _product(scale: Float[np.ndarray, " N"], values: list[Float[np.ndarray, "N R"]]) -> Float[np.ndarray, "N R"]:
    """Terms: the factors at every sample, multiplied, times the scale of the frame."""
    found = scale[:, None] * values[0]
    for value in values[1:]:
        found *= value
    return found


def _leaned(beyond: Float[np.ndarray, " G"]) -> Float[np.ndarray, " G"]:
    """Huber's cost of being so many times a limit beyond it."""
    return np.where(beyond <= _FIRM, beyond**2, _FIRM * (2.0 * beyond - _FIRM))


def refined(
    packs: tuple[FactorPack, ...],
    samples: SeenSamples,
    sweeps: int = 8,
) -> tuple[tuple[FactorPack, ...], float]:
    """The packs after some rounds over all their factors together, and the objective relative to that of no packs.

    The objective never rises: the sum over the samples of the squared ΔE94, to first order, and of a small share of
    what another light might show.
    """
    problem = JointProblem(packs, samples)
    state, left = extrapolated(problem.swept, problem.start(), sweeps, 0.0, problem.balanced)
    nothing = samples.cost(())
    return problem.packed(state), float(np.sqrt(left / nothing)) if nothing > 0 else 0.0


def held(packs: tuple[FactorPack, ...], samples: SeenSamples, sweeps: int) -> tuple[FactorPack, ...]:
    """The packs after some rounds without extrapolation: they move no farther than their guards ask them to."""
    problem = JointProblem(packs, samples)
    state = problem.start()
    for _ in range(sweeps):
        state, _ = problem.swept(state)
    return problem.packed(state)


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


def axes_in_sight(frame: Frame, axes: tuple[Axis, ...]) -> tuple[Axis, ...]:
    """The grid in frame hd with theta_d only as far as lights of samples stand; beyond, factors are held constant."""
    if frame != "hd" or axes[1].maximum <= 0.5 * FARTHEST:
        return axes
    return (axes[0], replace(axes[1], maximum=0.5 * FARTHEST), *axes[2:])


def in_sight(pack: FactorPack) -> FactorPack:
    """The pack on `axes_in_sight`, the same function up to there."""
    axes = axes_in_sight(pack.frame, pack.axes)
    if axes is pack.axes:
        return pack
    position = pack.axes[1].position(axes[1].nodes)
    factor = AxisSamples.of(position, pack.axes[1].size, False).between(pack.factors[1])
    factors = (pack.factors[0], factor, *pack.factors[2:])
    return replace(pack, axes=axes, factors=factors, precision="single", error=None)


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
