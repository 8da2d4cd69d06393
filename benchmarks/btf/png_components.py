"""Measured BTFs that come as blockwise principal components in PNG files, as xml3d-btf writes them.

A folder has `meta.json` (imageSize, numDirections, blockSize, numComp), `R.png` and one `k.png` a component. Views come
in blocks of a few; value[image, pixel, channel] = sum over k of L[k, pixel] sigma[k] R[k, image, channel], with L and R
bytes from -1 to 1 and sigma two bytes, 10 and 0.1 each. Values are encoded as sRGB, with cos(theta_i) in them; white is
not known, and taken for full scale. Views and lights are UBO2003's 81. What the coding leaves below 0 is taken for 0.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from ...materials.btf.decoding import uplifted_basis
from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.images import HeldImages, displacement
from ...materials.btf.registration import plane_offset
from ...materials.formats.btf_names import directions_of
from ...runtime.errors import InputError
from ...spectral.srgb import srgb_to_linear

# Rings of UBO2003: polar angle and step in azimuth, degrees.
_RINGS = ((0, 360), (15, 60), (30, 30), (45, 20), (60, 18), (75, 15))


def ubo_directions() -> Float[np.ndarray, "81 3"]:
    """UBO2003's directions in the order of its files."""
    return directions_of([(theta, phi) for theta, step in _RINGS for phi in range(0, 360, step)])


@dataclass(frozen=True, eq=False)
class CodedBtf:
    """A BTF of n x n texels, still coded.

    pixels (m,blocks,n n) : bytes. images (blocks,D b,3,m) : of each block's b views times D lights, in [-1, 1].
    sigma (blocks,m).
    """

    side: int
    block: int
    pixels: np.ndarray
    images: Float[np.ndarray, "blocks Db 3 m"]
    sigma: Float[np.ndarray, "blocks m"]

    @classmethod
    def read(cls, folder: Path) -> CodedBtf:
        """Read the BTF of a folder.

        Raises
        ------
        InputError : a file that is missing, is no picture or has too few bytes; directions other than 81.
        """
        try:
            said = {name: int(value) for name, value in json.loads((folder / "meta.json").read_text()).items()}
            side, count, block, size = (said[key] for key in ("imageSize", "numDirections", "blockSize", "numComp"))
        except (OSError, ValueError, KeyError, AttributeError, TypeError) as reason:
            expected = "imageSize, numDirections, blockSize and numComp"
            raise InputError(
                "not a coded BTF", file=folder / "meta.json", found=str(reason), expected=expected
            ) from None
        if count != 81:
            raise InputError("other directions than UBO2003's", file=folder / "meta.json", found=count, expected="81")
        blocks = -(-count // block)
        each = [_bytes(folder / f"{k}.png", blocks * side * side) for k in range(size)]
        shape = (blocks, count * block, 3, size)
        rest = _bytes(folder / "R.png", int(np.prod(shape)) + blocks * size * 2)
        images, sigma = np.split(rest, [int(np.prod(shape))])
        sigma = sigma[: blocks * size * 2].reshape(blocks, size, 2) @ np.array([10.0, 0.1])
        images = images.reshape(shape).astype(np.float32) / 127.5 - 1.0
        return cls(side, block, np.stack(each).reshape(size, blocks, -1), images, sigma.astype(np.float32))

    def values(self, view: int, light: int, rows: Int[np.ndarray, " h"], columns: Int[np.ndarray, " w"]) -> np.ndarray:
        """(h,w,3) linear numbers of an image at rows and columns, which go on from the other side beyond an edge."""
        number, inside = divmod(view, self.block)
        texel = (rows[:, None] % self.side) * self.side + columns % self.side
        weights = self.sigma[number] * self.images[number, inside * 81 + light]
        encoded = np.zeros((*texel.shape, 3), dtype=np.float32)
        for k, plane in enumerate(self.pixels[:, number]):
            encoded += (plane[texel] / np.float32(127.5) - 1.0)[..., None] * weights[:, k]
        return srgb_to_linear(np.maximum(encoded, 0.0))

    @cached_property
    def offset(self) -> float:
        """Texels by which the surface stands above the measured plane; 0 where views do not tell.

        The plane sweep of `materials.btf.registration`, on each view's mean over all lights, still encoded: it looks
        for places, not for colours.
        """
        pictures = np.empty((81, self.side, self.side))
        for view in range(81):
            number, inside = divmod(view, self.block)
            mean = self.images[number, inside * 81 : inside * 81 + 81].mean(axis=(0, 1)) * self.sigma[number]
            coded = self.pixels[:, number].astype(np.float32) / 127.5 - 1.0
            pictures[view] = (mean @ coded).reshape(self.side, self.side)
        return plane_offset(pictures, ubo_directions()) or 0.0

    def crop(self, texels: int, offset: float) -> HeldImages:
        """Return the middle of it, so many texels each way, registered by `offset`, in half precision, which codes of 8
        bits are coarser than.

        What a view displaces beyond the crop's edge was measured, too, and is taken from there. Between texels, linear.
        """
        if not 1 <= texels <= self.side:
            expected = f"1 to {self.side}"
            raise InputError("a crop that there is not", field="--texels", found=texels, expected=expected)
        directions = ubo_directions()
        first = (self.side - texels) // 2
        place = np.arange(first, first + texels + 1)
        values = np.empty((81, 81, texels, texels, 3), dtype=np.float16)
        for view, moved in enumerate(displacement(directions, offset)):
            column, row = (int(np.floor(one)) for one in moved)
            right, below = np.float32(moved[0] - column), np.float32(moved[1] - row)
            for light in range(81):
                found = self.values(view, light, place + row, place + column) / np.float32(np.pi)
                found = found[:, :-1] + right * (found[:, 1:] - found[:, :-1])
                values[view, light] = found[:-1] + below * (found[1:] - found[:-1])
        both = Hemisphere(directions)
        return HeldImages(both, both, values, uplifted_basis())


def _bytes(path: Path, needed: int) -> np.ndarray:
    """Return all channels' bytes of a picture in the order of reading."""
    from PIL import Image

    try:
        with Image.open(path) as picture:
            found = np.asarray(picture.convert("RGBA")).reshape(-1)
    except OSError as reason:
        raise InputError("not a picture", file=path, found=str(reason), expected="PNG, RGBA") from None
    if len(found) < needed:
        raise InputError("too few bytes", file=path, found=len(found), expected=f"{needed} or more")
    return found[:needed]
