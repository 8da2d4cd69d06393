"""Codes for which a display is nearest to a colour, in ΔE94, in or out of its gamut.

Damped least squares within the box of codes (Levenberg-Marquardt, bounds by projection), each colour started at the
nearest of a lattice over the whole box. Only improving steps are taken, so that no result is worse than the best of the
lattice: unlike Newton's method it cannot diverge, for any display.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from ...spectral.difference import lab_from_xyz
from .model import DisplayModel

# Nodes of the lattice along an edge, and how many of the nearest are compared.
_LATTICE, _COMPARED = 17, 4
# ΔE94 that counts as reached; rounds at most; what a derivative is taken over.
_REACHED, _ROUNDS, _STEP = 1e-4, 40, 1e-5
# A step of codes that changes nothing any more.
_STILL = 1e-7
# Codes that channels are lifted to where they hold a search.
_LIFTS = (0.06, 0.15, 0.3)
# Share of the square of what is left, below which a step ends the search.
_HARDLY = 1e-3
# Colours that are still this far off may stand in a fold of the model: they begin again from its neighbours.
_AGAIN = 0.02


@dataclass(frozen=True, eq=False)
class Inverse:
    """Codes of a model within a box.

    model : of the display. white_xyz : (3,) in its unit, white of ΔE94. low, high : of codes; 0 and 1 are the display's
    own.
    """

    model: DisplayModel
    white_xyz: Float[np.ndarray, "3"]
    low: float = 0.0
    high: float = 1.0

    @cached_property
    def _lattice(self) -> tuple[np.ndarray, Any]:
        from scipy.spatial import cKDTree

        levels = np.linspace(self.low, self.high, _LATTICE)
        codes = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 3)
        return codes, cKDTree(_even(lab_from_xyz(self.model.xyz(codes), self.white_xyz)))

    def codes(
        self, xyz: Float[np.ndarray, "N 3"], starts: int = _COMPARED
    ) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
        """Find codes (N,3), and ΔE94 (N,) of their colours from the requested ones, the reference.

        starts : number of lattice points to start from, nearest first, for colours that are not reached.
        """
        wanted = lab_from_xyz(xyz, self.white_xyz)
        lattice, tree = self._lattice
        near = tree.query(_even(wanted), _COMPARED)[1]
        tried = self._off(wanted[:, None], lab_from_xyz(self.model.xyz(lattice[near]), self.white_xyz))
        order = np.argsort(np.sum(tried**2, axis=-1), axis=1, kind="stable")
        first = np.take_along_axis(near, order, axis=1)
        found, left = self._descended(wanted, lattice[first[:, 0]])
        for at in range(1, starts):
            again = np.flatnonzero(left > _AGAIN)
            if not again.size:
                break
            other, other_left = self._descended(wanted[again], lattice[first[again, at]])
            better = other_left < left[again]
            found[again[better]], left[again[better]] = other[better], other_left[better]
        for lift in _LIFTS if starts > 1 else ():
            # A channel that gives hardly any light at first holds a search among its lowest codes.
            again = np.flatnonzero(left > 10.0 * _REACHED)
            other, other_left = self._descended(wanted[again], np.maximum(found[again], self.low + lift))
            better = other_left < left[again]
            found[again[better]], left[again[better]] = other[better], other_left[better]
        return found, left

    def codes_from(
        self,
        xyz: Float[np.ndarray, "N 3"],
        start: Float[np.ndarray, "N 3"],
        pull: Float[np.ndarray, " N"] | None = None,
    ) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
        """Improve nearby codes: faster, never worse than the start, not always the global optimum.

        pull : (N,) ΔE94 penalty of a move over the whole range of codes.
        """
        return self._descended(lab_from_xyz(xyz, self.white_xyz), np.clip(start, self.low, self.high), pull)

    def _off(self, wanted: np.ndarray, shown: np.ndarray) -> np.ndarray:
        """Compute ΔL*, ΔC*/S_C and ΔH*/S_H of CIELAB pairs, whose length is their ΔE94 (CIE 116-1995)."""
        chroma, shown_chroma = (np.hypot(lab[..., 1], lab[..., 2]) for lab in (wanted, shown))
        cross = wanted[..., 1] * shown[..., 2] - wanted[..., 2] * shown[..., 1]
        dot = wanted[..., 1] * shown[..., 1] + wanted[..., 2] * shown[..., 2]
        hue = 2.0 * np.sqrt(chroma * shown_chroma) * np.sin(0.5 * np.arctan2(cross, dot))
        return np.stack(
            [
                shown[..., 0] - wanted[..., 0],
                (shown_chroma - chroma) / (1.0 + 0.045 * chroma),
                hue / (1.0 + 0.015 * chroma),
            ],
            axis=-1,
        )

    def _at(self, wanted: np.ndarray, codes: np.ndarray) -> np.ndarray:
        return self._off(wanted, lab_from_xyz(self.model.xyz(codes), self.white_xyz))

    def _descended(
        self, wanted: np.ndarray, codes: np.ndarray, pull: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        begun, codes = codes, np.array(codes)
        pulled = np.zeros(len(codes)) if pull is None else pull**2
        off = self._at(wanted, codes)
        left = np.sum(off**2, axis=1)
        damping, slope = np.full(len(codes), 1e-3), np.empty((len(codes), 3, 3))
        going = np.flatnonzero(left > _REACHED**2)
        fresh = going
        for _ in range(_ROUNDS):
            if not going.size:
                break
            slope[fresh] = self._slope(wanted[fresh], codes[fresh], off[fresh])
            moved = codes[going] - begun[going]
            step = self._step(codes[going], off[going], slope[going], damping[going], pulled[going, None], moved)
            trial = np.clip(codes[going] + step, self.low, self.high)
            trial_off = self._at(wanted[going], trial)
            trial_left = np.sum(trial_off**2, axis=1) + pulled[going] * np.sum((trial - begun[going]) ** 2, axis=1)
            nearer = trial_left < left[going]
            # Codes that hardly come nearer have arrived, at the edge of the gamut.
            ended = np.abs(trial - codes[going]).max(axis=1) <= _STILL
            ended |= nearer & (trial_left > (1.0 - _HARDLY) * left[going])
            fresh = going[nearer]
            codes[fresh], off[fresh], left[fresh] = trial[nearer], trial_off[nearer], trial_left[nearer]
            damping[going] *= np.where(nearer, 0.1, 10.0)
            goes_on = ~ended & (damping[going] < 1e8) & (left[going] > _REACHED**2)
            going, fresh = going[goes_on], going[goes_on & nearer]
        return codes, np.sqrt(np.sum(off**2, axis=1))

    def _slope(self, wanted: np.ndarray, codes: np.ndarray, off: np.ndarray) -> np.ndarray:
        """Differentiate (N,3,3) the difference by red, green and blue."""
        slopes = []
        for at in range(3):
            # Towards the middle, so that the derivative is of codes within the box.
            reach = np.where(codes[:, at] > 0.5, -_STEP, _STEP)
            beside = codes.copy()
            beside[:, at] += reach
            slopes.append((self._at(wanted, beside) - off) / reach[:, None])
        return np.stack(slopes, axis=-1)

    def _step(
        self,
        codes: np.ndarray,
        off: np.ndarray,
        slope: np.ndarray,
        damping: np.ndarray,
        pulled: np.ndarray,
        moved: np.ndarray,
    ) -> np.ndarray:
        """Take a step of damped least squares; codes at a bound that would leave the box are fixed."""
        downhill = -np.einsum("nij,ni->nj", slope, off) - pulled * moved
        held = ((codes <= self.low) & (downhill < 0.0)) | ((codes >= self.high) & (downhill > 0.0))
        slope = np.where(held[:, None, :], 0.0, slope)
        normal = np.einsum("nij,nik->njk", slope, slope)
        diagonal = np.einsum("njj->nj", normal)
        size = np.maximum(diagonal.max(axis=1, keepdims=True), 1e-9)
        # A channel that does nothing here is held by the last term, whose sum with the others is never singular.
        normal[:, range(3), range(3)] += damping[:, None] * (diagonal + 1e-3 * size) + 1e-12 * size + pulled + held
        return np.linalg.solve(normal, np.where(held, 0.0, downhill)[..., None])[..., 0]


def _even(lab: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
    """Shorten chroma of CIELAB so that distances approximate ΔE94, for a first search among neighbours."""
    chroma = np.hypot(lab[..., 1], lab[..., 2])
    shorter = np.log1p(0.045 * chroma) / 0.045 / np.maximum(chroma, 1e-9)
    shorter = np.where(chroma > 1e-9, shorter, 1.0)
    return np.stack([lab[..., 0], lab[..., 1] * shorter, lab[..., 2] * shorter], axis=-1)
