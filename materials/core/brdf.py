"""Interface of BRDFs: the scattering of a uniform surface."""

from __future__ import annotations

import abc
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .axes import Axis, Frame
from .points import Points
from .surface import Surface

# Rows per block: 2048 x 81 float64 are 1.3 MB, so that a model's temporaries stay in cache.
_BLOCK = 2048


class Brdf(Surface):
    """A bidirectional reflectance distribution function, sampled in wavelength: a uniform surface."""

    @abc.abstractmethod
    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Evaluate f_r in 1/sr, without the cosine.

        `wi` points to the light and `wo` to the viewer: unit vectors in the frame whose z is the normal; their batch
        shapes broadcast. Zero if either is on or below the horizon.
        """

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """Evaluate `eval` at each point's directions."""
        return self.eval(points.wi, points.wo)

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the lobes whose sum is this function, each with the frame in which it factors best."""
        return (Lobe("io", self),)


@dataclass(frozen=True)
class Lobe:
    """One lobe of a BRDF: "io" for incident/outgoing angles, "hd" for half/difference angles.

    axes : the grid to tabulate it on, if the data have one of their own; None lets the fit choose.
    """

    frame: Frame
    brdf: Brdf
    axes: tuple[Axis, ...] | None = None


def eval_lit(
    evaluate: Callable[[np.ndarray, np.ndarray], np.ndarray], size: int, wi: np.ndarray, wo: np.ndarray
) -> Float[np.ndarray, "... L"]:
    """Evaluate `evaluate(wi (N,3), wo (N,3)) -> (N, size)` for the pairs above the horizon, zero for all others.

    The common body of `Brdf.eval`: broadcasts the batch shapes and works through them in blocks.
    """
    wi, wo = np.broadcast_arrays(np.asarray(wi, dtype=np.float64), np.asarray(wo, dtype=np.float64))
    batch = wi.shape[:-1]
    wi, wo = wi.reshape(-1, 3), wo.reshape(-1, 3)
    lit = np.flatnonzero((wi[:, 2] > 0) & (wo[:, 2] > 0))
    whole = len(lit) == len(wi)
    out = np.empty((len(wi), size)) if whole else np.zeros((len(wi), size))
    for start in range(0, len(lit), _BLOCK):
        # A slice where everything is lit spares the gather.
        rows = slice(start, start + _BLOCK) if whole else lit[start : start + _BLOCK]
        out[rows] = evaluate(wi[rows], wo[rows])
    return out.reshape(*batch, size)
