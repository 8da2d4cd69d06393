"""Terms: the geometric factors of a surface, the one sum that combines them with colours, and their shaders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, eq=False)
class Terms:
    """R terms of entries of a palette, in M rows; sparse, which covers any interpolation between texels.

    Parameters
    ----------
    value : (M,R) f_r cos(theta_i) of each term without its spectrum, times the incident light.
    place : (M,) ascending indices of the places (points, or pixels), once each, or several times if entries are mixed;
        None is one row per place, in order.
    entry : (M,) index of the palette's entry; None is the first.
    """

    value: Float[np.ndarray, "M R"]
    place: Int[np.ndarray, " M"] | None = None
    entry: Int[np.ndarray, " M"] | None = None

    @property
    def nbytes(self) -> int:
        """Bytes of memory that they take."""
        return sum(array.nbytes for array in (self.value, self.place, self.entry) if array is not None)

    def add_to(self, total: Float[np.ndarray, "N C"], colours: Float[np.ndarray, "P R C"]) -> None:
        """Add at each place the sum over entries and terms times their colours, of C numbers each."""
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
        """Sum the terms of points over those of the same place (ascending) and entry."""
        place = place_of if self.place is None else place_of[self.place]
        return _summed(place, self.entry, self.value)

    @staticmethod
    def sum_of(several: Sequence[Terms]) -> Terms:
        """Concatenate terms that each have places of their own into one sum; at least one."""
        if len(several) == 1:
            return several[0]
        place = np.concatenate([one.place for one in several if one.place is not None])
        entries = [one.entry for one in several if one.entry is not None]
        entry = np.concatenate(entries) if entries else None
        return _summed(place, entry, np.concatenate([one.value for one in several]))


def _summed(place: np.ndarray, entry: np.ndarray | None, value: np.ndarray) -> Terms:
    """Merge rows of the same place and entry, in the order of places."""
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
    """Terms of a summand on the GPU.

    file : GLSL that defines `Here`, `here_at`, `entry` and `term`, as described in `docs/adding_a_surface.md`.
    sizes : inserted as `#define`s; each combination of them is compiled to a program once.
    textures : (h, w, 4) float32 or float16 arrays by the names of their samplers; uniforms : numbers by name.
    steps : maximum loop rounds per sample: a driver may end a shader after some 65,000 without a message.
    """

    file: Path
    sizes: Mapping[str, int] = field(default_factory=dict)
    textures: Mapping[str, np.ndarray] = field(default_factory=dict)
    uniforms: Mapping[str, Any] = field(default_factory=dict)
    steps: int = 1000
