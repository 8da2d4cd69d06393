"""Softbox: a one-sided rectangular light of uniform luminance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float

from ...runtime.errors import InputError
from ...spectral.spectrum import Spectrum
from ..lights import SpreadLight, check_spectrum, strength
from ..vectors import Number, VectorLike, dot, finite_vector, unit

# Solid angle, sr, below which a rectangle is sampled by area, since rounding dominates the sums of its angles.
_SMALL = 1e-5
# Floor of divisors, cosines and lengths: a rectangle sends no light into its own plane.
_TINY = 1e-12
# Rounding of a dot product of unit vectors.
_ROUNDED = 4.0 * np.finfo(np.float64).eps
# `up` and the axis count as parallel below this sine.
_PARALLEL = 1e-6


@dataclass(frozen=True, eq=False)
class SoftboxLight(SpreadLight):
    """One-sided rectangular area light of uniform luminance.

    Parameters
    ----------
    position : (3,) of its centre, world coordinates; one world unit is a metre.
    target : (3,) point that it faces.
    width, height : sides across and along `up`, world units, > 0.
    spectrum : emission, relative: its scale does not matter.
    illuminance_lux : at the target, on a plane facing the light, lx, > 0.
    up : (3,) approximate direction of its height; None is up (+y), or away from the viewer (-z) if it faces straight up
        or down.
    spectrum_name : name of the spectrum, for reports.

    Raises
    ------
    InputError : no power, no size, a target at its position, `up` along its axis, or a spectrum that is no emission.
    """

    KIND: ClassVar = "softbox"
    KEYS: ClassVar = {
        "position": "vector",
        "target": "vector",
        "width": "number",
        "height": "number",
        "up": "vector",
        "illuminance_lux": "number",
    }
    REQUIRED: ClassVar = ("position", "target", "width", "height")

    position: VectorLike
    target: VectorLike
    width: Number
    height: Number
    spectrum: Spectrum
    illuminance_lux: Number = 1000.0
    up: VectorLike = None
    name: str = "light"
    spectrum_name: str = ""

    def __post_init__(self) -> None:
        position, target = finite_vector(self.position, "position"), finite_vector(self.target, "target")
        if not np.linalg.norm(target - position) > 0.0:
            raise InputError(
                "a softbox that faces nowhere",
                field="target",
                found=target.tolist(),
                expected="another point than its position",
            )
        for side in ("width", "height"):
            value = getattr(self, side)
            if not 0.0 < value < np.inf:
                raise InputError("a softbox of no size", field=side, found=value, expected="more than 0, finite")
        up = self._up(None if self.up is None else finite_vector(self.up, "up"), unit(target - position))
        check_spectrum(self.spectrum)
        lux = strength(self.illuminance_lux, "illuminance_lux", "lx")
        for name, value in (("position", position), ("target", target), ("up", up), ("illuminance_lux", lux)):
            object.__setattr__(self, name, value)
        of_one = self._vector_irradiance(target[None])[0]
        object.__setattr__(self, "_luminance", lux / float(np.linalg.norm(of_one)))

    @staticmethod
    def _up(stated: np.ndarray | None, axis: np.ndarray) -> Float[np.ndarray, "3"]:
        """Return the direction of the height: `stated`, or the first of +y and -z that is not along the axis.

        Idempotent: a copy of a softbox has bit-identical corners.
        """
        if stated is not None and abs(stated @ axis) <= _ROUNDED and abs(stated @ stated - 1.0) <= _ROUNDED:
            return stated
        for up in (np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -1.0])) if stated is None else (stated,):
            across = up - (up @ axis) * axis
            if np.linalg.norm(across) > _PARALLEL * np.linalg.norm(up):
                return unit(across)
        raise InputError(
            "up lies along the direction in which the softbox faces",
            field="up",
            found=[float(value) for value in stated] if stated is not None else None,
            expected="another direction",
        )

    @property
    def spectra(self) -> tuple[Spectrum, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """`spectrum` alone."""
        return (self.spectrum,)

    @property
    def place(self) -> Float[np.ndarray, "3"]:
        """`position`."""
        return self.position

    @property
    def luminance_cd_m2(self) -> float:
        """Luminance of its front."""
        return self._luminance

    @property
    def axes(self) -> Float[np.ndarray, "3 3"]:
        """Unit rows: along its width, along its height, and its facing direction; right-handed."""
        facing = unit(self.target - self.position)
        return np.stack([np.cross(self.up, facing), self.up, facing])

    @property
    def corners(self) -> Float[np.ndarray, "4 3"]:
        """Corners, world, counter-clockwise seen from the front."""
        right, up, _ = self.axes
        half_right, half_up = 0.5 * self.width * right, 0.5 * self.height * up
        return np.array([self.position + a * half_right + b * half_up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])

    def with_spectrum(self, spectrum: Spectrum, name: str = "") -> SoftboxLight:
        """Return the same softbox with another spectrum at the same strength."""
        return replace(self, spectrum=spectrum, spectrum_name=name)

    def counted_from(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
        """Compute the illuminance, lx, on a surface at the box's centre facing the light; 0 behind the light."""
        middle = 0.5 * (low + high)
        distance = float(np.linalg.norm(self.position - middle))
        return float(np.linalg.norm(self.irradiance_vectors(middle[None])[0])), distance, distance

    def irradiance_vectors(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Return vectors (n,3), lx, whose product with a normal is the illuminance of a plane with the whole light
        above its horizon.

        Lambert's formula for polygons: half the luminance times the sum over edges of the angle each spans, along the
        normal of the plane through the edge and the point (Arvo 1994, eq. 2). 0 behind the light.
        """
        in_front = (points - self.position) @ self.axes[2] > 0.0
        return np.where(in_front[:, None], self.luminance_cd_m2 * self._vector_irradiance(points), 0.0)

    def _vector_irradiance(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Compute the vector irradiance for luminance 1, towards the light, on either side of it."""
        corners = self.corners
        total = np.zeros_like(points)
        for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            normal = np.cross(here - points, there - points)
            length = np.linalg.norm(normal, axis=-1)
            angle = np.arctan2(length, dot(here - points, there - points))
            total += (angle / np.where(length > 0.0, length, 1.0))[:, None] * normal
        return 0.5 * np.sign(dot(total, self.position - points))[:, None] * total

    def luminance(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> np.ndarray:
        """Return the luminance (n, 1), cd/m^2: that of the front where a ray from the point hits it, else 0."""
        met, _ = self._met(points, directions)
        front = directions @ self.axes[2] < 0.0
        return np.where(met & front, self.luminance_cd_m2, 0.0)[:, None]

    def distance(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> np.ndarray:
        """Compute the distance to the rectangle; infinite for a ray that misses it."""
        met, along = self._met(points, directions)
        return np.where(met, along, np.inf)

    def _met(self, points: np.ndarray, directions: np.ndarray) -> tuple[Bool[np.ndarray, " n"], np.ndarray]:
        """Return whether rays hit the rectangle, from either side, and the distance to its plane along each."""
        right, up, facing = self.axes
        towards, height = directions @ facing, (self.position - points) @ facing
        parallel = np.abs(towards) < _TINY
        along = np.where(parallel, np.inf, height / np.where(parallel, 1.0, towards))
        offset = points + np.where(np.isfinite(along), along, 0.0)[:, None] * directions - self.position
        within = (np.abs(offset @ right) <= 0.5 * self.width) & (np.abs(offset @ up) <= 0.5 * self.height)
        return within & (along > 0.0) & ~parallel, along

    def drawn(
        self, points: Float[np.ndarray, "n 3"], uniform: Float[np.ndarray, "n 2"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Sample uniformly by solid angle (Ureña, Fajardo and King 2013); by area where the rectangle subtends little.

        A point behind it, which receives no light, gets directions to its back.
        """
        frame = self._seen_from(points)
        x, y, z = _on_rectangle(frame, uniform)
        share = uniform * (self.width, self.height)
        small = _solid_angle(frame) < _SMALL
        x, y = np.where(small, frame[0] + share[:, 0], x), np.where(small, frame[1] + share[:, 1], y)
        to = unit(np.stack([x, y, z], axis=-1) @ self.axes)
        return to, self._density(frame, to, np.sqrt(x * x + y * y + z * z))

    def density(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> np.ndarray:
        """Return the probability density of `drawn` for these directions, 1/sr; 0 outside the rectangle."""
        met, along = self._met(points, directions)
        return np.where(met, self._density(self._seen_from(points), directions, np.where(met, along, 1.0)), 0.0)

    def _density(self, frame: np.ndarray, to: np.ndarray, far: np.ndarray) -> Float[np.ndarray, " n"]:
        solid = _solid_angle(frame)
        cosine = np.maximum(np.abs(to @ self.axes[2]), _TINY)
        by_area = np.maximum(far, _TINY) ** 2 / (cosine * self.width * self.height)
        return np.where(solid < _SMALL, by_area, 1.0 / np.maximum(solid, _SMALL))

    def _seen_from(self, points: np.ndarray) -> Float[np.ndarray, "5 n"]:
        """Return x0, y0, x1, y1 of the rectangle and z of its plane, along `axes`, relative to each point."""
        x, y, z = ((self.position - points) @ self.axes.T).T
        half = 0.5 * np.array([self.width, self.height])
        return np.stack([x - half[0], y - half[1], x + half[0], y + half[1], z])


def _solid_angle(frame: Float[np.ndarray, "5 n"]) -> Float[np.ndarray, " n"]:
    """Compute the solid angle of rectangles, sr: four right-angled corners, each arctan(x y / (z r))."""
    x0, y0, x1, y1, z = frame
    total = np.zeros_like(z)
    for x, y, sign in ((x1, y1, 1.0), (x0, y1, -1.0), (x1, y0, -1.0), (x0, y0, 1.0)):
        total += sign * np.arctan2(x * y, np.abs(z) * np.sqrt(x * x + y * y + z * z))
    return np.abs(total)


def _on_rectangle(frame: Float[np.ndarray, "5 n"], uniform: Float[np.ndarray, "n 2"]) -> tuple[Any, Any, Any]:
    """Sample points of rectangles uniformly by solid angle: Ureña, Fajardo and King 2013, listings 1 and 2.

    Results are meaningless where a rectangle is too small to be seen.
    """
    x0, y0, x1, y1, height = frame
    z = -np.maximum(np.abs(height), _TINY)
    # z components of the normals of the planes through the lower and the upper edge, and the corners' angles.
    down, up = np.sqrt(y0 * y0 + z * z), np.sqrt(y1 * y1 + z * z)
    left, right = np.sqrt(x0 * x0 + z * z), np.sqrt(x1 * x1 + z * z)
    b0, b1 = -y0 / down, y1 / up
    g0 = np.arccos(np.clip(y0 * x1 / (down * right), -1.0, 1.0))
    g1 = np.arccos(np.clip(-y1 * x1 / (up * right), -1.0, 1.0))
    g2 = np.arccos(np.clip(y1 * x0 / (up * left), -1.0, 1.0))
    g3 = np.arccos(np.clip(-y0 * x0 / (down * left), -1.0, 1.0))
    k = 2.0 * np.pi - g2 - g3
    at = uniform[:, 0] * (g0 + g1 - k) + k
    sine = np.sin(at)
    sine = np.where(np.abs(sine) < _TINY, _TINY, sine)
    slope = (np.cos(at) * b0 - b1) / sine
    cosine = np.where(slope > 0.0, 1.0, -1.0) / np.maximum(np.sqrt(slope * slope + b0 * b0), _TINY)
    cosine = np.clip(cosine, -1.0, 1.0)
    x = np.clip(-cosine * z / np.maximum(np.sqrt(1.0 - cosine * cosine), _TINY), x0, x1)
    far = np.sqrt(x * x + z * z)
    h0, h1 = y0 / np.sqrt(far * far + y0 * y0), y1 / np.sqrt(far * far + y1 * y1)
    h = h0 + uniform[:, 1] * (h1 - h0)
    y = np.clip(h * far / np.sqrt(np.maximum(1.0 - h * h, _TINY)), y0, y1)
    return x, y, height
