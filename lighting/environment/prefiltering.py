"""Prefiltered environment: light gathered by any lobe and any diffuse surface, by look-up."""

from __future__ import annotations

import hashlib
import threading
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...materials.core.environment_form import BENDS, bends
from . import convolution, latlong, octahedral
from .environment import EnvironmentLight
from .pyramid import SHARPEST, Pyramid

#: Side of the irradiance map: diffuse surfaces resolve nothing finer, except where a sun crosses their horizon.
IRRADIANCE_SIDE = 128
#: Rows of a map from which its finest level has the largest sharpness. On coarser maps the Gaussian of the finest level
#: has the same width in texels, a third of one; beyond, the map itself is linear between texels.
ROWS_OF_SHARPEST = 64
# Environments of the last scenes, by the bytes of their maps: a reloaded scene usually has the same light.
_KEPT = 2
_recent: dict[tuple[tuple[int, ...], bytes], GatheredLight] = {}
_lock = threading.Lock()


@dataclass(frozen=True, eq=False)
class GatheredLight:
    """Prefiltered environment of K spectra in its own frame, valid for every rotation.

    pyramid : for lobes. irradiance (side, side, 9, K) : by normal, lux, and its moments (`bends`) over incident
    directions; float32, octahedral.
    """

    pyramid: Pyramid
    irradiance: Float[np.ndarray, "side side 9 K"]

    @classmethod
    def of(cls, environment: EnvironmentLight) -> GatheredLight:
        """Prefilter an environment, for every rotation; the last few of a process are cached."""
        key = environment.fields.shape, hashlib.sha256(np.ascontiguousarray(environment.fields).data).digest()
        with _lock:
            found = _recent.pop(key, None)
        if found is None:
            found = cls._gathered(replace(environment, rotation_deg=0.0))
        with _lock:
            _recent[key] = found
            while len(_recent) > _KEPT:
                _recent.pop(next(iter(_recent)))
        return found

    @classmethod
    def _gathered(cls, level: EnvironmentLight) -> GatheredLight:
        normals = octahedral.texel_directions(IRRADIANCE_SIDE).reshape(-1, 3)
        shape = (IRRADIANCE_SIDE, IRRADIANCE_SIDE)
        bent = bends(latlong.texel_directions(*level.fields.shape[1:]))
        # All moments of all fields together: the kernel is computed once.
        each = np.concatenate([level.fields * bent[..., k] for k in range(BENDS)])
        found = Irradiance.of_fields(each)(normals).astype(np.float32)
        coarseness = min(1.0, level.fields.shape[1] / ROWS_OF_SHARPEST)
        return cls(Pyramid.of(level, SHARPEST * coarseness**2), found.reshape(*shape, BENDS, -1))

    def by_lobes(
        self, directions: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
    ) -> Float[np.ndarray, "N Q K"]:
        """Return the mean luminance weighted by each Gaussian about unit directions, cd/m^2."""
        found = self.pyramid(directions.reshape(-1, 3), sharpness.reshape(-1))
        return found.reshape(*sharpness.shape, self.irradiance.shape[3])

    def by_frames(self, frames: Float[np.ndarray, "N 3 3"], bent: int = BENDS) -> Float[np.ndarray, "N B K"]:
        """Return the unoccluded illuminance on surfaces, lx, and its moments in their own axes (rows of `frames`; the
        last is the normal); with `bent` 1 the illuminance alone.
        """
        u, v = octahedral.places(frames[:, 2])
        padded = self._bordered if bent > 1 else self._bordered[:, :, :1]
        column, row = (0.5 * (place + 1.0) * IRRADIANCE_SIDE + 0.5 for place in (u, v))
        left, top = (np.minimum(np.floor(at).astype(np.int64), IRRADIANCE_SIDE) for at in (column, row))
        right, down = (column - left)[:, None, None], (row - top)[:, None, None]
        above = padded[top, left] * (1.0 - right) + padded[top, left + 1] * right
        below = padded[top + 1, left] * (1.0 - right) + padded[top + 1, left + 1] * right
        found = above * (1.0 - down) + below * down
        return found if bent == 1 else rotate_moments(found, frames)

    @cached_property
    def _bordered(self) -> Float[np.ndarray, "padded padded 9 K"]:
        side, count = IRRADIANCE_SIDE, self.irradiance.shape[3]
        bordered = octahedral.bordered(self.irradiance.reshape(side, side, -1)).astype(np.float64)
        return bordered.reshape(side + 2, side + 2, BENDS, count)


def rotate_moments(
    moments: Float[np.ndarray, "N 9 K"], frames: Float[np.ndarray, "N 3 3"]
) -> Float[np.ndarray, "N 9 K"]:
    """Rotate moments to other axes: those of degree one as a vector, those of degree two as a symmetric matrix."""
    whole, xy, yz, xz, difference, third = moments[:, 0], *(moments[:, k] for k in range(4, 9))
    zz = (third + whole) / 3.0
    xx, yy = 0.5 * (whole - zz + difference), 0.5 * (whole - zz - difference)
    matrix = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1).reshape(len(moments), 3, 3, -1)
    vector = np.einsum("nij,njk->nik", frames, moments[:, 1:4])
    inner = np.einsum("nai,nijk,nbj->nabk", frames, matrix, frames)
    uneven, steep = inner[:, 0, 0] - inner[:, 1, 1], 3.0 * inner[:, 2, 2] - whole
    bent = np.stack([inner[:, 0, 1], inner[:, 1, 2], inner[:, 0, 2], uneven, steep], axis=1)
    return np.concatenate([whole[:, None], vector, bent], axis=1)


#: Rows of the map over normals: where the sun crosses a surface's horizon, the error is then 0.2 % of the sun's largest
#: illuminance.
ROWS = 128
#: Rows of the environment that are enough for this: half a degree of smoothing moves a cosine by 1e-5.
ENVIRONMENT_ROWS = 180


@dataclass(frozen=True, eq=False)
class Irradiance:
    """Illuminance over normals: the environment convolved with the clamped cosine, Ramamoorthi and Hanrahan 2001.

    lux (K, ROWS, 2 ROWS) : by the surface's normal, latitude-longitude, in the environment's own frame.
    world_from_map : rotation of that frame.
    """

    lux: Float[np.ndarray, "K H W"]
    world_from_map: Float[np.ndarray, "3 3"]

    @classmethod
    def of(cls, environment: EnvironmentLight) -> Irradiance:
        """Integrate an environment over all directions."""
        return cls.of_fields(environment.fields, environment.world_from_map)

    @classmethod
    def of_fields(cls, fields: Float[np.ndarray, "K H W"], world_from_map: np.ndarray | None = None) -> Irradiance:
        """Return the same for any fields, also negative ones such as a map's moments."""
        fields = convolution.Resolutions(fields).at_least(ENVIRONMENT_ROWS)
        mean = convolution.convolved(fields, lambda cosine: np.maximum(cosine, 0.0), 0.5 * np.pi, ROWS)
        # A mean under the clamped cosine, whose integral is pi.
        return cls(np.pi * mean, np.eye(3) if world_from_map is None else world_from_map)

    def __call__(self, normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n K"]:
        """Return the illuminance (n, K), lx, for unit world normals and each of the environment's spectra."""
        return convolution.smooth_between_texels(self.lux, normals @ self.world_from_map)
