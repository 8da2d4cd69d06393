"""Rows that are compared: each with a name, their layers of pixels, and the side that they are of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ...runtime.errors import visible
from ...spectral.measurement import Measurement

#: Unit roundoff: how far rounding may move a number, as a share of the power of two below it.
HALF_ROUNDOFF, FLOAT32_ROUNDOFF, FLOAT64_ROUNDOFF = 2.0**-11, 2.0**-24, 2.0**-53

#: Spectrum of a pixel (row, column): wavelengths in nm (L,) and values (L,).
PixelSpectrum = Callable[[tuple[int, int]], tuple[Float[np.ndarray, " L"], Float[np.ndarray, " L"]]]
#: Content of a layer: the fast picture, the truth from original data, or readings of an instrument.
LayerKind = Literal["picture", "reference", "reading"]


class RowName(NamedTuple):
    """Name by which rows of two sides are matched; "" for parts that a side does not state."""

    material: str
    light: str
    observer: str
    scene: str = ""
    view: str = ""

    def __str__(self) -> str:
        return visible(" · ".join(part for part in self if part)) or "(unnamed)"

    def without(self, common: RowName) -> RowName:
        """Return the parts that differ from those of `common`, "" for the others."""
        return RowName(*("" if own == shared else own for own, shared in zip(self, common, strict=True)))


@dataclass(frozen=True, eq=False)
class Pixels:
    """Colours with the data needed to compare them.

    Parameters
    ----------
    xyz : (H,W,3), Y = 1 for the white; a reading is one pixel.
    coverage : (H,W) from 0 to 1.
    white_xyz : (3,).
    unit_roundoff : of the stored numbers.
    nudged : XYZ of some rows with every stored number moved by a multiple (h,W,3) of half a step, for steps that are
        not relative, as of display codes.
    mask : (H,W) of the pixels of the row; None: of all.
    """

    xyz: Float[np.ndarray, "H W 3"]
    coverage: Float[np.ndarray, "H W"]
    white_xyz: Float[np.ndarray, "3"]
    unit_roundoff: float = FLOAT32_ROUNDOFF
    nudged: Callable[[slice, Float[np.ndarray, "h W 3"]], Float[np.ndarray, "h W 3"]] | None = None
    mask: Bool[np.ndarray, "H W"] | None = None

    def half_spacing(self, rows: slice) -> Float[np.ndarray, "h W 3"]:
        """Compute the largest rounding error of each number of some rows: half the distance to its neighbour.

        >>> one = Pixels(np.array([[[0.75, 1.5, 0.0]]]), np.ones((1, 1)), np.ones(3), HALF_ROUNDOFF)
        >>> one.half_spacing(slice(0, 1)) * 4096
        array([[[1., 2., 0.]]])
        """
        values = self.xyz[rows]
        _, exponent = np.frexp(values)
        return np.where(values == 0, 0.0, np.ldexp(self.unit_roundoff, exponent - 1))

    def equals(self, other: Pixels) -> bool:
        """Return whether both hold the same bytes."""
        ours, theirs = ((one.xyz, one.coverage, one.white_xyz) for one in (self, other))
        return all(
            a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()
            for a, b in zip(ours, theirs, strict=True)
        )


@dataclass(frozen=True)
class LayerNoise:
    """Sampling noise of a layer, in ΔE94 over its pixels."""

    mean: float
    p99: float


@dataclass(frozen=True, eq=False)
class PixelLayer:
    """Pixels loaded on demand.

    file : their source, None without one. said : statements of the file.
    spectrum : of its pixels, if it has spectra. remark : deviations from the file's statements.
    """

    load: Callable[[], Pixels]
    file: Path | None = None
    said: Mapping[str, str] = field(default_factory=dict)
    noise: LayerNoise | None = None
    spectrum: PixelSpectrum | None = None
    remark: str = ""


@dataclass(frozen=True, eq=False)
class Row:
    """One row of a side: its layers by kind.

    approximation : difference of the picture from its reference, ΔE94 as "mean", "p95", "p99" and "max"; None without a
        reference. notes : remarks on the row. measurement : of a reading; None for pictures.
    """

    name: RowName
    layers: Mapping[LayerKind, PixelLayer]
    approximation: Mapping[str, float] | None = None
    notes: tuple[str, ...] = ()
    measurement: Measurement | None = None


@dataclass(frozen=True, eq=False)
class ComparedSide:
    """All rows of a file or folder.

    kind : of source, in words. facts : of its making (versions, renderer, plan), by label.
    chain : from spectrum to numbers, a sentence each.
    """

    path: Path
    kind: str
    rows: tuple[Row, ...]
    facts: Mapping[str, str] = field(default_factory=dict)
    chain: tuple[str, ...] = ()
