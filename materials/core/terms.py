"""Terms: what a surface is made of but its colour, and the one sum in which they meet it; their shaders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, eq=False)
class Terms:
    """R terms of entries of a palette, in M rows; sparse, so that any interpolation between texels is the same thing.

    Parameters
    ----------
    value : (M,R) f_r cos(theta_i) of each term without its spectrum, times the light that arrives.
    place : (M,) ascending numbers of the places (points, or pixels), once each, or several times where entries are
        mixed; None is one row a place, in their order.
    entry : (M,) which of the palette's entries; None is the first.
    """

    value: Float[np.ndarray, "M R"]
    place: Int[np.ndarray, " M"] | None = None
    entry: Int[np.ndarray, " M"] | None = None

    @property
    def nbytes(self) -> int:
        """Bytes of memory that they take."""
        return sum(array.nbytes for array in (self.value, self.place, self.entry) if array is not None)

    def add_to(self, total: Float[np.ndarray, "N C"], colours: Float[np.ndarray, "P R C"]) -> None:
        """Add, at each place, the sum over entries and terms of what their spectra are worth in C numbers."""
        if self.entry is None:
            found = self.value @ colours[0]
        else:
            found = np.einsum("mr,mrc->mc", self.value, colours[self.entry])
        if self.place is None:
            total += found
        elif self.entry is None:
            # One row a place: `summed` has seen to it.
            total[self.place] += found
        else:
            np.add.at(total, self.place, found)

    def summed(self, place_of: Int[np.ndarray, " N"]) -> Terms:
        """Return the terms of points, summed up over those that belong to the same place (ascending) and entry."""
        place = place_of if self.place is None else place_of[self.place]
        return _summed(place, self.entry, self.value)

    @staticmethod
    def sum_of(several: Sequence[Terms]) -> Terms:
        """Return the sum of terms that each have places of their own; at least one."""
        if len(several) == 1:
            return several[0]
        place = np.concatenate([one.place for one in several if one.place is not None])
        entries = [one.entry for one in several if one.entry is not None]
        entry = np.concatenate(entries) if entries else None
        return _summed(place, entry, np.concatenate([one.value for one in several]))


def _summed(place: np.ndarray, entry: np.ndarray | None, value: np.ndarray) -> Terms:
    """Rows of the same place and entry as one, in the order of places."""
    if entry is not None or np.any(np.diff(place) < 0):
        order = np.argsort(place, kind="stable") if entry is None else np.lexsort((entry, place))
        place, value, entry = place[order], value[order], None if entry is None else entry[order]
    new = np.diff(place, prepend=-1) != 0
    if entry is not None:
        new |= np.diff(entry, prepend=-1) != 0
    first = np.flatnonzero(new)
    value = np.add.reduceat(value, first, axis=0) if len(first) else value
    return Terms(value, place[first], None if entry is None else entry[first])


@dataclass(frozen=True, eq=False)
class TermShader:
    """The terms of a summand on the GPU.

    file : GLSL that defines, as `docs/adding_a_surface.md` says, `Here`, `here_at`, `entry` and `term`.
    sizes : what is written into it as `#define`s; with each combination of them a program is compiled once.
    textures : (h, w, 4) float32 or float16 arrays by the names of their samplers; uniforms : numbers by name.
    steps : rounds of loops for a sample, at most: a driver may end a shader after some 65,000 without a word.
    """

    file: Path
    sizes: Mapping[str, int] = field(default_factory=dict)
    textures: Mapping[str, np.ndarray] = field(default_factory=dict)
    uniforms: Mapping[str, Any] = field(default_factory=dict)
    steps: int = 1000
