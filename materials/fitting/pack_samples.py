"""One pack met with scattered samples: its factors and spectra at them, and the problem that each factor's turn is.

Samples are worked on in the order of the axis whose turn it is, some hundred at a time: of what has a column a term
nothing but the other factors' product is kept for all samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ..core.axes import frame_angles
from ..factored.pack import FactorPack
from .axis_samples import BLOCK, AxisSamples
from .cp import Factors
from .visible_samples import SeenSamples

# Rounding of curvature that is summed in single precision; times the number of terms, it is the most that rounding may
# take off the curvature along any direction (Gershgorin), as a share of what the terms have by themselves.
_ROUNDING = float(np.finfo(np.float32).eps)


@dataclass(frozen=True, eq=False)
class AxisTurn:
    """Samples in the order of one axis (`AxisSamples.order`), for the update of its factor.

    mode : number of the axis. fraction : of the way to the upper node. others : numbers of the other axes, with the
    node below each sample and the fraction there. sensitivity, root_weight : of `SeenSamples`, and the square root of
    its base weight, in single precision. places : position of each sample in that order.
    """

    mode: int
    axis: AxisSamples
    scale: Float[np.ndarray, "N 1"]
    fraction: Float[np.ndarray, "N 1"]
    others: tuple[tuple[int, Int[np.ndarray, " N"], Float[np.ndarray, "N 1"]], ...]
    sensitivity: Float[np.ndarray, "N K S"]
    root_weight: Float[np.ndarray, "N 1"]
    places: Int[np.ndarray, " N"]


class PackSamples:
    """Samples on the grid of one pack, which stays while its factors change.

    Curvature, which determines the length of steps and not their limit, is summed in single precision; gradients and
    residuals are in double precision.
    """

    def __init__(self, pack: FactorPack, samples: SeenSamples) -> None:
        self.samples = samples
        at = frame_angles(pack.frame, samples.wi, samples.wo, pack.anisotropic)
        self.scale = at.scale
        positions = (axis.position(at.angles[axis.name]) for axis in pack.axes)
        self.grids = [
            AxisSamples.of(position, axis.size, axis.periodic)
            for position, axis in zip(positions, pack.axes, strict=True)
        ]

    @cached_property
    def turns(self) -> list[AxisTurn]:
        """One turn for each axis."""
        return [self._turn(mode) for mode in range(len(self.grids))]

    def _turn(self, mode: int) -> AxisTurn:
        """Sort the samples along an axis."""
        axis, samples = self.grids[mode], self.samples
        order = axis.order
        places = np.empty(len(order), dtype=np.intp)
        places[order] = np.arange(len(order))
        return AxisTurn(
            mode,
            axis,
            self.scale[order, None],
            axis.fraction[order, None],
            tuple(
                (other, grid.below[order], grid.fraction[order, None])
                for other, grid in enumerate(self.grids)
                if other != mode
            ),
            samples.single_sensitivity.take(order, axis=0),
            samples.single_roots.take(order, axis=0),
            places,
        )

    def terms(
        self, factors: Factors, some: slice = slice(None), found: Float[np.ndarray, "n R"] | None = None
    ) -> Float[np.ndarray, "n R"]:
        """Evaluate every term at some samples, without its spectrum; into `found`, if given."""
        tables = [_with_steps(factor) for factor in factors]
        scale, rank = self.scale[some, None], factors[0].shape[1]
        at = [(grid.below[some], grid.fraction[some, None]) for grid in self.grids]
        found = np.empty((len(scale), rank)) if found is None else found
        for start in range(0, len(found), BLOCK):
            rows = slice(start, start + BLOCK)
            part = scale[rows] * np.ones(rank)
            for table, (below, fraction) in zip(tables, at, strict=True):
                part *= _between(table, below[rows], fraction[rows])
            found[rows] = part
        return found

    def put_rest(self, turn: AxisTurn, factors: Factors, rest: Float[np.ndarray, "N R"]) -> None:
        """Put each term, without its spectrum and the factor to be updated, into `rest`, in the turn's order."""
        tables = [_with_steps(factor) for factor in factors]
        for start in range(0, len(rest), BLOCK):
            rows = slice(start, start + BLOCK)
            (first, below, fraction), *others = ((m, b[rows], f[rows]) for m, b, f in turn.others)
            part = _between(tables[first], below, fraction)
            for other, below, fraction in others:
                part *= _between(tables[other], below, fraction)
            np.multiply(part, turn.scale[rows], out=rest[rows])

    def shaded(
        self,
        turn: AxisTurn,
        rest: Float[np.ndarray, "N R"],
        factor: Float[np.ndarray, "n R"],
        spectral: Float[np.ndarray, "S R"],
    ) -> Float[np.ndarray, "S N"]:
        """Shade the samples, in their own order, by terms with this factor in place of the one to be updated."""
        ends = (factor[:, :, None] * spectral.T).transpose(1, 0, 2)
        size = len(spectral)
        found = np.empty((len(rest), size))
        for interval, rows in turn.axis.blocks():
            both = rest[rows] @ ends[:, interval : interval + 2].reshape(-1, 2 * size)
            high = turn.fraction[rows]
            found[rows] = (1.0 - high) * both[:, :size] + high * both[:, size:]
        return found[turn.places].T

    def step(
        self,
        turn: AxisTurn,
        rest: Float[np.ndarray, "N R"],
        factor: Float[np.ndarray, "n R"],
        spectral: Float[np.ndarray, "S R"],
        gradient: Float[np.ndarray, "S N"],
    ) -> Float[np.ndarray, "n R"]:
        """Solve for the change of one factor, with all else fixed.

        gradient : half the negative gradient of the samples' cost.
        """
        (intervals, rank), size = (len(factor) - 1, factor.shape[1]), len(spectral)
        sums, right = np.zeros((intervals, 3, rank, rank)), np.zeros((intervals, 2, rank))
        sorted_gradient = gradient.T[turn.axis.order]
        # Columns of about 1, whatever a term's size: single precision has few powers of ten.
        tallest, longest = _or_one(np.abs(rest).max(axis=0)), _or_one(np.linalg.norm(spectral, axis=0))
        unit_spectra, shorter = (spectral / longest).astype(np.float32), 1.0 / tallest
        seen = np.empty((BLOCK, turn.sensitivity.shape[1], rank), np.float32)
        colour = np.empty((BLOCK, turn.sensitivity.shape[1], 2 * rank), np.float32)
        simple = np.empty((BLOCK, 2 * rank), np.float32)
        unit_rest, aims = np.empty((BLOCK, rank), np.float32), np.empty((BLOCK, 2 * size))
        twice = np.tile(unit_spectra.T @ unit_spectra, (2, 2))
        fractions = turn.fraction.astype(np.float32)
        for interval, rows in turn.axis.blocks():
            count = rows.stop - rows.start
            here, high = unit_rest[:count], fractions[rows]
            part, flat, aim = colour[:count], simple[:count], aims[:count]
            np.multiply(rest[rows], shorter, out=here, casting="same_kind")
            np.matmul(turn.sensitivity[rows].reshape(-1, size), unit_spectra, out=seen[:count].reshape(-1, rank))
            np.multiply(seen[:count], here[:, None, :], out=part[:, :, :rank])
            np.multiply(part[:, :, :rank], high[:, None], out=part[:, :, rank:])
            np.multiply(here, turn.root_weight[rows], out=flat[:, :rank])
            np.multiply(flat[:, :rank], high, out=flat[:, rank:])
            part = part.reshape(-1, 2 * rank)
            found = part.T @ part
            found += twice * (flat.T @ flat)
            sums[interval, 0] += found[:rank, :rank]
            sums[interval, 1] += found[rank:, :rank]
            sums[interval, 2] += found[rank:, rank:]
            np.multiply(sorted_gradient[rows], turn.fraction[rows], out=aim[:, size:])
            np.subtract(sorted_gradient[rows], aim[:, size:], out=aim[:, :size])
            toward = (rest[rows].T @ aim).reshape(rank, 2, size)
            right[interval] += np.einsum("res,sr->er", toward, spectral)
        lengths = self.samples.single_unit * tallest * longest
        sums *= np.outer(lengths, lengths)
        rounding = _ROUNDING * rank * np.einsum("krr->kr", sums[:, 0])
        self._add_guards(turn, rest, spectral, sums)
        return turn.axis.step(factor, sums, right, rounding)

    def _add_guards(
        self, turn: AxisTurn, rest: np.ndarray, spectral: np.ndarray, sums: Float[np.ndarray, "m 3 R R"]
    ) -> None:
        """Add the curvature of guards, in double precision, since they may outweigh all samples beside them."""
        first, rank = len(rest) - len(self.samples.guards), rest.shape[1]
        if first == len(rest):
            return
        asked = np.einsum("ksg,sr->gkr", self.samples.sensitivity[:, :, first:], spectral)
        asked *= rest[turn.places[first:], None, :]
        below, fraction = turn.axis.below[first:], turn.axis.fraction[first:]
        for interval in np.unique(below):
            rows = np.flatnonzero(below == interval)
            each = asked[rows]
            both = np.concatenate([each, fraction[rows, None, None] * each], axis=2).reshape(-1, 2 * rank)
            found = both.T @ both
            sums[interval] += [found[:rank, :rank], found[rank:, :rank], found[rank:, rank:]]


def _or_one(lengths: Float[np.ndarray, " R"]) -> Float[np.ndarray, " R"]:
    """Replace lengths of 0 by 1."""
    return np.where(lengths > 0.0, lengths, 1.0)


def _with_steps(factor: Float[np.ndarray, "n R"]) -> tuple[Float[np.ndarray, "n R"], Float[np.ndarray, "m R"]]:
    """Pair a factor with its differences from node to node."""
    return factor, np.diff(factor, axis=0)


def _between(
    table: tuple[np.ndarray, np.ndarray], below: Int[np.ndarray, " N"], fraction: Float[np.ndarray, "N 1"]
) -> Float[np.ndarray, "N R"]:
    """Interpolate a factor between its nodes."""
    factor, steps = table
    found = steps.take(below, axis=0)
    found *= fraction
    found += factor.take(below, axis=0)
    return found
