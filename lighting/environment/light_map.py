"""Light over directions as stored in a file: RGB, XYZ, luminance or spectra at each texel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.axis_letters import Wavelengths
from ...spectral.observers import observer
from . import latlong
from .reduction import xyz_of_samples

#: Quantity in the channels of a map.
Kind = Literal["RGB", "XYZ", "luminance", "spectra"]
#: Replacements for texels that hold no light: NaN, infinite or negative values.
BAD_TEXELS = ("black",)
# Texels of a block.
_BLOCK = 1 << 16


@dataclass(frozen=True, eq=False)
class LightMap:
    """Latitude-longitude image of light (`latlong`), row 0 up.

    Parameters
    ----------
    path : the file.
    kind : of the channels: "RGB", "XYZ", "luminance", or "spectra" (radiance at `wavelengths_nm`).
    channels : C arrays (H,W), as stored.
    wavelengths_nm : (C,) of spectra, ascending, nm; else None.
    xyz_from_rgb : of RGB: XYZ = M @ rgb; else None.
    notes : assumptions and omissions.
    """

    path: Path
    kind: Kind
    channels: tuple[np.ndarray, ...]
    wavelengths_nm: Wavelengths | None = None
    xyz_from_rgb: Float[np.ndarray, "3 3"] | None = None
    notes: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Height and width, texels."""
        height, width = self.channels[0].shape
        return height, width

    @property
    def xyz_from_channels(self) -> Float[np.ndarray, "3 C"]:
        """XYZ (CIE 1931 2 degree, relative) = M @ channels; for luminance alone all three rows are Y."""
        if self.wavelengths_nm is not None:
            return xyz_of_samples(observer("1931_2"), self.wavelengths_nm)[0]
        if self.xyz_from_rgb is not None:
            return self.xyz_from_rgb
        return np.eye(3) if self.kind == "XYZ" else np.ones((3, 1))

    def luminance(self) -> Float[np.ndarray, "H W"]:
        """Return Y of each texel, relative."""
        found = np.zeros(self.size)
        for weight, channel in zip(self.xyz_from_channels[1], self.channels, strict=True):
            found += weight * channel
        return found

    def blocks(self) -> Iterator[tuple[slice, Float[np.ndarray, "n C"]]]:
        """Yield blocks of rows: their slice, and the channel values of their texels."""
        height, width = self.size
        step = max(1, _BLOCK // width)
        for start in range(0, height, step):
            rows = slice(start, min(start + step, height))
            yield rows, self.at(rows)

    def at(self, where: Any) -> Float[np.ndarray, "n C"]:
        """Return the channels at an index of (H,W) arrays, one texel per row, float64."""
        return np.stack([channel[where].ravel() for channel in self.channels], axis=-1).astype(np.float64)

    def without_bad_texels(self, bad_texels: str | None) -> LightMap:
        """Return the map with every value finite and not negative.

        bad_texels : None raises for any other texel, naming row and column from 0; "black" replaces them by black, and
            a note states their number and their share of the light.
        """
        if bad_texels not in (None, *BAD_TEXELS):
            raise UnknownNameError("treatment of bad texels", str(bad_texels), BAD_TEXELS, field="bad_texels")
        bad = np.zeros(self.size, dtype=bool)
        for channel in self.channels:
            bad |= ~((channel >= 0) & np.isfinite(channel))
        if not bad.any():
            return self
        row, column = (int(index) for index in np.argwhere(bad)[0])
        if bad_texels is None:
            value = next(v for c in self.channels if not ((v := float(c[row, column])) >= 0.0 and np.isfinite(v)))
            what = "not a number" if np.isnan(value) else "infinite" if np.isinf(value) else "negative"
            raise InputError(
                f"a texel that is {what}",
                file=self.path,
                field=f"row {row}, column {column}",
                found=f"{value:g}; {int(bad.sum())} of {bad.size} texels hold no light",
                expected="light: finite, not negative; rows and columns count from 0",
                hint='mend the map, or say bad_texels = "black" to take them for black',
            )
        channels = tuple(np.where(bad, channel.dtype.type(0), channel) for channel in self.channels)
        mended = replace(self, channels=channels)
        return replace(mended, notes=(*self.notes, self._said_of(bad, mended, f"row {row}, column {column}")))

    def _said_of(self, bad: Bool[np.ndarray, "H W"], mended: LightMap, first: str) -> str:
        """Describe the texels replaced by black: their number, solid angle and share of the light."""
        solid = latlong.solid_angles(*self.size)
        directions = float(bad.sum(axis=1) @ solid) / (4.0 * np.pi)
        values = self.at(bad)
        finite = np.asarray(np.isfinite(values).all(axis=-1))
        kinds = ((int((~finite).sum()), "not finite"), (int(finite.sum()), "negative"))
        words = ", ".join(f"{count} {word}" for count, word in kinds if count)
        said = f"{int(bad.sum())} of {bad.size} texels ({words}; the first at {first}) are taken for black: "
        said += f"{directions:.2g} of all directions"
        if finite.any():
            lost = np.zeros(self.size)
            lost[bad] = np.abs(np.where(finite[:, None], values, 0.0)) @ np.abs(self.xyz_from_channels[1])
            kept = float(mended.luminance().sum(axis=1) @ solid)
            share = float(lost.sum(axis=1) @ solid) / kept if kept > 0.0 else np.inf
            said += f"; the negative ones hold {share:.2g} of the light that is left"
        return said if finite.all() else f"{said}; how much light the others would send is not known"
