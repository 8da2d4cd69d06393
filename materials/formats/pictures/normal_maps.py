"""Normal maps: the direction of green, and invalid normals.

OpenGL has green where a surface leans upwards in the picture, DirectX where it leans downwards. If a map does not state
it, it can be determined if slopes are those of one height field: then the change along v of the slope along u equals
the change along u of the slope along v (the curl is zero), but not with green inverted.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from jaxtyping import Float

from ....runtime.errors import InputError
from ...svbrdf.texel_map import TexelMap
from ...svbrdf.textures import Texture

Green = Literal["opengl", "directx"]

# Widths in texels over which slopes are averaged before they are compared: bricks and their grain have to agree.
_SCALES = (1.0, 2.0, 4.0, 8.0, 16.0)
# Ratio by which the wrong curl has to exceed the right one, at each of them: noise is as large in both.
_PROOF = 1.25
# A level normal is 127.5 of 255; the two codes beside it are meant by it.
_LEVEL = 1.01 / 255.0


def normals_of(texture: Texture, green: Green, strength: float = 1.0) -> tuple[TexelMap, list[str]]:
    """Decode the vectors of a normal map, z up and y upwards in the picture, and notes on them.

    strength : factor of x and y (glTF's `scale`).

    Raises
    ------
    InputError : a map without colours, or a texture that cannot be decoded.
    """
    values = texture.values
    if values.shape[2] < 3:
        raise InputError(
            "a normal map without colours",
            file=texture.file,
            field=texture.field,
            found="grey",
            expected="x, y and z in red, green and blue",
            hint="save the normal map in colour; a height map is not one",
        )
    y = strength if green == "opengl" else -strength
    codes = values[..., :3]
    if values.dtype.kind == "f":
        return TexelMap(np.ascontiguousarray(codes), False, (strength, y, 1.0)), []
    blue = codes[..., 2]
    if blue.max() == blue.min() and blue.flat[0] in (0, np.iinfo(values.dtype).max) and np.ptp(codes[..., :2]):
        lean = TexelMap(np.ascontiguousarray(codes[..., :2]), False, (2.0,), (-1.0,)).decoded(codes[..., :2])
        up = np.sqrt(np.maximum(1.0 - np.sum(lean**2, axis=-1, keepdims=True), 0.0))
        vectors = np.concatenate([lean * (strength, y), up], axis=-1)
        return TexelMap(vectors.astype(np.float32)), ["the normal map has no blue: z is what x and y leave of 1"]
    scale, offset = (2.0 * strength, 2.0 * y, 2.0), (-strength, -y, -1.0)
    return TexelMap(np.ascontiguousarray(codes), False, scale, offset), []


def mended(normal: TexelMap) -> tuple[TexelMap, list[str]]:
    """Replace invalid normals by level ones, and count them; see `map_set.check_normals`."""
    vectors = normal.decoded(normal.values)
    bad = (np.linalg.norm(vectors, axis=-1) < 0.02) | (vectors[..., 2] <= 0.0)
    if not bad.any():
        return normal, []
    vectors[bad] = (0.0, 0.0, 1.0)
    words = f"{int(bad.sum())} of {bad.size} normals have no length or point below the surface: taken as level"
    return TexelMap(vectors.astype(np.float32)), [words]


def is_level(normal: TexelMap) -> bool:
    """Return whether all normals are equal, and upright within the precision of an 8-bit picture."""
    if (normal.values != normal.values[:1, :1]).any():
        return False
    x, y, z = normal.decoded(normal.values[0, 0])
    return bool(z > 0 and max(abs(x), abs(y)) <= _LEVEL * z)


def green_of(texture: Texture) -> Green | None:
    """Determine the direction of green if the map proves it; else None.

    A map whose green is constant and level is the same either way: "opengl".
    """
    normal, _ = normals_of(texture, "opengl")
    vectors = normal.decoded(normal.values)
    up = np.maximum(vectors[..., 2], 0.05)
    across, along = -vectors[..., 0] / up, -vectors[..., 1] / up
    if np.abs(along).max() <= 2.0 * _LEVEL:
        return "opengl"
    most = max(1.0, min(along.shape) / 16.0)
    found: set[Green | None] = {_side(across, along, scale) for scale in _SCALES if scale <= most}
    return found.pop() if len(found) == 1 else None


def _side(across: Float[np.ndarray, "H W"], along: Float[np.ndarray, "H W"], scale: float) -> Green | None:
    """Determine the direction of green by slopes averaged over `scale` texels."""
    from scipy import ndimage

    if min(along.shape) < 3:
        return None
    across, along = (ndimage.gaussian_filter(slope, scale, mode="nearest") for slope in (across, along))
    turned = _upwards(across)
    sideways = 0.5 * (along[:-1, 1:] + along[1:, 1:] - along[:-1, :-1] - along[1:, :-1])
    curl, other = (float(np.mean((turned - sign * sideways) ** 2)) for sign in (1.0, -1.0))
    if other > _PROOF**2 * curl:
        return "opengl"
    return "directx" if curl > _PROOF**2 * other else None


def _upwards(slope: Float[np.ndarray, "H W"]) -> Float[np.ndarray, "h w"]:
    """Compute the change of a slope to the row above, between four texels."""
    return 0.5 * (slope[:-1, :-1] + slope[:-1, 1:] - slope[1:, :-1] - slope[1:, 1:])
