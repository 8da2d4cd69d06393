"""Direct light by the paper's way: wavelets of what a site sees, times its factors of the light.

Sun et al. 2007 (sections 3.3 and 4.3): T0 times the cosine and each light factor U_i, in Haar wavelets, of which the 96
largest of each factor are kept; times the light's own wavelets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ....lighting.environment.cube import CubeMap
from .brdf_tensor import BrdfTensor
from .precomputed import TransferTensors, local, unpack_visibility

#: Wavelets of each factor.
WAVELETS = 96


@dataclass(frozen=True, eq=False)
class DirectTensor:
    """Direct transfer of S sites and 1 + k factors, the first of which is 1 (matt).

    place, value (S,1+k,w) : wavelets of cosine times factor times visibility times solid angle.
    """

    place: Int[np.ndarray, "S k1 w"]
    value: Float[np.ndarray, "S k1 w"]
    across: int

    @property
    def nbytes(self) -> int:
        """Bytes of the stored tensor."""
        return self.place.nbytes + self.value.nbytes

    def lit(self, light: Float[np.ndarray, "K D"]) -> Float[np.ndarray, "S k1 K"]:
        """Integrals of light of each field, cd/m^2 by texel, with cosine and factors."""
        wavelets = transformed(light, self.across).astype(np.float32)
        return np.einsum("nkw,fnkw->nkf", self.value, wavelets[:, self.place], optimize=True)


def direct_tensor(tensors: TransferTensors, brdf: BrdfTensor, wavelets: int = WAVELETS) -> DirectTensor:
    """Return the wavelets of all sites."""
    cube = CubeMap(tensors.across)
    count, factors = len(tensors.sites), brdf.by_light.shape[1] + 1
    wavelets = min(wavelets, len(cube))
    place = np.zeros((count, factors, wavelets), dtype=np.int32)
    value = np.zeros((count, factors, wavelets), dtype=np.float32)
    for site in range(count):
        seen = unpack_visibility(tensors.visible[site : site + 1], tensors.across)[0]
        free = np.flatnonzero(seen > 0.0)
        to = local(cube.directions[free], np.broadcast_to(tensors.normals[site], (len(free), 3)))
        rows = np.zeros((factors, len(cube)))
        weight = to[:, 2] * cube.solid_angles[free]
        rows[0, free] = weight
        rows[1:, free] = brdf.disc.look_up(brdf.by_light, to).T * weight
        found = transformed(rows, tensors.across)
        largest = np.argpartition(np.abs(found), -wavelets, axis=1)[:, -wavelets:]
        largest.sort(axis=1)
        place[site], value[site] = largest, np.take_along_axis(found, largest, axis=1)
    return DirectTensor(place, value, tensors.across)


def transformed(values: Float[np.ndarray, "*n D"], across: int) -> Float[np.ndarray, "*n D"]:
    """Orthonormal, non-standard two-dimensional Haar coefficients of each face; `across` is a power of 2.

    The inner product of two maps is that of their coefficients.
    """
    faces = np.array(values, dtype=np.float64).reshape(*values.shape[:-1], 6, across, across)
    size = across
    while size > 1:
        half = size // 2
        block = faces[..., :size, :size]
        a, b = block[..., 0::2, 0::2], block[..., 0::2, 1::2]
        c, d = block[..., 1::2, 0::2], block[..., 1::2, 1::2]
        parts = [a + b + c + d, a - b + c - d, a + b - c - d, a - b - c + d]
        parts = [0.5 * part for part in parts]
        block[..., :half, :half], block[..., :half, half:] = parts[0], parts[1]
        block[..., half:, :half], block[..., half:, half:] = parts[2], parts[3]
        size = half
    return faces.reshape(values.shape)
