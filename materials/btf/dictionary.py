"""Dictionary of a BTF: a few functions of view, light and spectrum, of which all texels are weighted sums.

It is the largest part of a form, and a tensor of four axes. After a Tucker decomposition along views, lights and
spectra most entries are nearly 0: rounded to whole steps, a few in a hundred remain (`sparse`). Steps are uniform in
the perceptual metric (`metric`), so that all rounding errors are equally visible, and coefficients that hardly show
take hardly any space.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ...spectral.basis import SpectralBasis
from .metric import LIGHTS, seen
from .rounded_mean import RoundedMean, principal

# Type that whole steps are stored in.
_WIDE = np.iinfo(np.int16)
# Dimensions of colour: visible differences have no more, however many coefficients there are.
_COLOURS = 3
# Run of this many zeros without a number at its end.
_ON = 255
# Mark of a number that does not fit a byte.
_LARGE = np.iinfo(np.int8).min


@dataclass(frozen=True, eq=False)
class Dictionary:
    """G functions and a mean: f_r cos(theta_i) of a texel is the mean plus a weighted sum of the functions.

    basis : of the J coefficients. mean : 1/sr. core (G,v,l,j) : Tucker core in whole steps. by_view (V,v), by_light
    (Lt,l), by_spectrum (J,j) : principal components of the three axes, in columns, as many as the core needs, in half
    precision. step : ΔE94 of one step.
    """

    basis: SpectralBasis
    mean: RoundedMean
    core: Int[np.ndarray, "G v l j"]
    by_view: Float[np.ndarray, "V v"]
    by_light: Float[np.ndarray, "Lt l"]
    by_spectrum: Float[np.ndarray, "J j"]
    step: float

    def __len__(self) -> int:
        return len(self.core)

    @property
    def average(self) -> Float[np.ndarray, "V Lt J"]:
        """The mean, 1/sr, float32."""
        return self.mean.values

    @cached_property
    def seen(self) -> Float[np.ndarray, "V Lt J J"]:
        """Perceptual metric C (`metric.seen`) of each view and light: differences x are measured as x C."""
        return seen(self.average, self.basis).astype(np.float32)

    def as_seen(self) -> Float[np.ndarray, "G V Lt J"]:
        """Return the functions in the perceptual metric, in units of ΔE94; float32."""
        return turned(
            self.core.astype(np.float32) * np.float32(self.step),
            *(part.astype(np.float32) for part in (self.by_view, self.by_light, self.by_spectrum)),
        )

    @cached_property
    def lengths(self) -> Float[np.ndarray, " G"]:
        """Norm of each function in the perceptual metric; functions are scaled as they occur in texels."""
        # The turns keep lengths, but for what half precision makes of them.
        return self.step * np.sqrt(np.sum(np.square(self.core, dtype=np.float64), axis=(1, 2, 3)))

    def functions(self) -> Float[np.ndarray, "G V Lt J"]:
        """Return the functions, f_r cos(theta_i) in 1/sr; float32."""
        back = np.linalg.inv(self.seen.astype(np.float64)).astype(np.float32)
        return np.einsum("gvlk,vlkj->gvlj", self.as_seen(), back, optimize=True)

    def stored(self) -> dict[str, Any]:
        """Return the stored fields, without the basis."""
        # Zeros lie together where the components of the axes are the outer ones.
        core = sparse(np.ascontiguousarray(self.core.transpose(3, 1, 2, 0)))
        turns = {name: getattr(self, name) for name in ("by_view", "by_light", "by_spectrum")}
        return turns | {"mean": self.mean.stored(), "core": core, "step": self.step}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], basis: SpectralBasis) -> Dictionary:
        """Return the dictionary whose `stored()` this is."""
        turns = {name: np.asarray(kept[name]) for name in ("by_view", "by_light", "by_spectrum")}
        core = np.ascontiguousarray(dense(kept["core"]).transpose(3, 1, 2, 0))
        mean = RoundedMean.from_stored(kept["mean"], basis)
        return cls(basis=basis, mean=mean, core=core, step=float(kept["step"]), **turns)


def dictionary_of(
    functions: Float[np.ndarray, "G V Lt J"], mean: RoundedMean, basis: SpectralBasis, step: float
) -> Dictionary:
    """Make a dictionary from functions rounded to whole steps; functions that round to 0 are dropped.

    functions : in the perceptual metric (ΔE94), scaled as they occur in texels. step : size of a step, relative to the
    root mean square of all functions under D65 per dimension of colour: as coarse for many coefficients as for three,
    whose synthetic spectra differ more under other lights.
    """
    turns = [_principal(functions, axis) for axis in (1, 2, 3)]
    core = turned(functions, *(turn.astype(np.float32).T for turn in turns))
    size = np.sqrt(_square_under_d65(functions, mean) / (_COLOURS * core[..., 0].size)) if core.size else 0.0
    # A number that int16 does not hold would need steps that are smaller than anything a texel shows.
    size = max(step * size, float(np.abs(core).max(initial=0.0)) / _WIDE.max)
    size = size if size > 0.0 else 1.0
    steps = np.rint(core / size)
    steps = steps[np.any(steps != 0.0, axis=(1, 2, 3))]
    # The components of each axis are in order: those beyond the last that is needed are left out.
    for axis in (1, 2, 3):
        some = np.any(steps != 0.0, axis=tuple({0, 1, 2, 3} - {axis}))
        count = int(np.flatnonzero(some).max(initial=-1)) + 1
        steps = steps.take(range(count), axis=axis)
        turns[axis - 1] = turns[axis - 1][:, :count]
    return Dictionary(basis, mean, steps.astype(np.int16), *turns, step=size)


def _square_under_d65(functions: Float[np.ndarray, "G V Lt J"], mean: RoundedMean) -> float:
    """Compute the sum of squares under D65 of functions given in ΔE94 under all judged lights."""
    all_lights, d65 = (seen(mean.values, mean.basis, lights) for lights in (LIGHTS, ("D65",)))
    products = np.einsum("gvlj,gvlk->vljk", functions, functions, optimize=True).astype(np.float64)
    turn = np.linalg.solve(all_lights, d65)
    return float(np.einsum("vlji,vljk,vlki->", turn, products, turn, optimize=True))


def turned(
    values: Float[np.ndarray, "G a b c"],
    first: Float[np.ndarray, "A a"],
    second: Float[np.ndarray, "B b"],
    third: Float[np.ndarray, "C c"],
) -> Float[np.ndarray, "G A B C"]:
    """Multiply each of a tensor's last three axes by its own matrix."""
    values = values @ third.T
    values = np.einsum("gabc,Bb->gaBc", values, second, optimize=True)
    return np.einsum("gabc,Aa->gAbc", values, first, optimize=True)


def _principal(functions: Float[np.ndarray, "G V Lt J"], axis: int) -> Float[np.ndarray, "n n"]:
    """Compute the principal components of one axis, in columns, largest first, in half precision."""
    rows = np.moveaxis(functions, axis, 0).reshape(functions.shape[axis], -1).astype(np.float64)
    return principal(rows @ rows.T)


def sparse(values: Int[np.ndarray, "..."]) -> dict[str, Any]:
    """Encode integers that are mostly 0 and otherwise small; compressed, this takes half the space of the array.

    `shape` : of the array. `runs` : lengths of runs of zeros, in bytes, 255 if the run continues in the next byte.
    `others` : values other than 0, in bytes, -128 in place of one that is too large, which is then the next of `large`.
    """
    flat = values.ravel()
    places = np.flatnonzero(flat)
    before = np.diff(places, prepend=-1) - 1
    whole = before // _ON
    runs = np.full(len(places) + int(whole.sum()), _ON, dtype=np.uint8)
    runs[np.cumsum(whole + 1) - 1] = before % _ON
    others = flat[places]
    small = np.abs(others.astype(np.int64)) <= -(_LARGE + 1)
    kept = {"others": np.where(small, others, _LARGE).astype(np.int8), "large": others[~small]}
    return {"shape": np.array(values.shape, dtype=np.int32), "runs": runs, **kept}


def dense(kept: Mapping[str, Any]) -> Int[np.ndarray, "..."]:
    """Decode an array encoded by `sparse`."""
    large, small = np.asarray(kept["large"]), np.asarray(kept["others"])
    others = small.astype(large.dtype)
    others[small == _LARGE] = large
    runs = np.asarray(kept["runs"]).astype(np.int64)
    shape = tuple(int(length) for length in np.asarray(kept["shape"]))
    ends = runs < _ON
    found = np.zeros(int(np.prod(shape)), dtype=others.dtype)
    found[(np.cumsum(runs + ends) - 1)[ends]] = others
    return found.reshape(shape)
