"""Sphere protocol: the visible error of a material, in ΔE94, on a sphere under five directional lights.

A unit sphere seen orthographically, a light at 10, 35, 60, 80 and 110 degrees from the view, Y of a perfect diffuser
facing the light = 1, every pixel with cos(theta_i) > 0.01, nothing clipped. The reference is the original BRDF at every
wavelength of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from ...spectral.difference import delta_e_xyz
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from .directions import angles
from .fast import Fast
from .fit_error import FitError, LightError
from .points import Points
from .surface import Surface

# A fit meets its budget when it meets it under all of these: daylight, tungsten, three narrow bands, a blue LED with
# a phosphor, and sodium at high pressure.
LIGHTS = ("D65", "A", "FL11", "LED-B3", "HP1")
LIGHT_ANGLES_DEG = (10.0, 35.0, 60.0, 80.0, 110.0)
# Lights from behind: no part of the protocol, but a picture may have one.
BACK_LIGHT_ANGLES_DEG = (125.0, 140.0)
# Below this the pixel is dark whatever the material; the cosine's own rounding would be judged.
_LEAST_COSINE = 0.01

Form = TypeVar("Form", bound=Fast)


@dataclass(frozen=True, eq=False)
class SphereProtocol:
    """Shading points of the lit pixels of all lights, directions in each pixel's own surface frame.

    `pixels`: across the sphere's diameter. The tangent x of the surface points along the parallels of an upright
    sphere, so that an anisotropic material is seen at every azimuth.
    """

    pixels: int
    lights_deg: tuple[float, ...]
    wi: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]
    light: str = "D65"
    observer: str = "1931_2"
    uv: Float[np.ndarray, "N 2"] | None = None

    @property
    def text(self) -> str:
        """Description of the protocol for a record or a report."""
        lights = ", ".join(f"{angle:g}" for angle in self.lights_deg)
        return (
            f"sphere {self.pixels} x {self.pixels}, orthographic, directional light at {lights} degrees from the view, "
            f"Y of a perfect diffuser facing it = 1, pixels with cos theta_i > {_LEAST_COSINE:g}, unclipped, "
            "CIE 1994 graphic arts, reference = original at every wavelength"
        )

    @cached_property
    def points(self) -> Points:
        """All direction pairs, with cached angles; (u, v) go across and up the sphere's disc."""
        return Points(self.wi, self.wo, self.uv)

    def weights(self, wavelengths_nm: Float[np.ndarray, " L"]) -> Float[np.ndarray, "L 3"]:
        """Compute weights light x observer: XYZ of the perfect diffuser has Y = 1."""
        return _weights(self.light, self.observer, tuple(wavelengths_nm.tolist()))

    def under(self, light: str) -> SphereProtocol:
        """Return the same samples under another light."""
        return replace(self, light=light)

    def reference(self, surface: Surface) -> Float[np.ndarray, "N 3"]:
        """Compute XYZ of every sample from the surface at its own wavelengths."""
        return self.references(surface, (self.light,))[0]

    def references(self, surface: Surface, lights: Sequence[str]) -> Float[np.ndarray, "M N 3"]:
        """Compute XYZ of every sample under M lights; the surface is evaluated once."""
        return self.original_xyz(surface, _folding(tuple(lights), self.observer))

    def sample(self, fast: Fast) -> Float[np.ndarray, "N 3"]:
        """Compute XYZ of every sample from terms folded with the light."""
        return self.samples(fast, (self.light,))[0]

    def samples(self, fast: Fast, lights: Sequence[str]) -> Float[np.ndarray, "M N 3"]:
        """Compute XYZ of every sample from terms folded with each of M lights; the terms are evaluated once."""
        return self.fast_xyz(fast, _folding(tuple(lights), self.observer))

    def original_xyz(self, surface: Surface, folding: Folding) -> Float[np.ndarray, "M N 3"]:
        """Compute `references` under lights and an observer of any kind; the scale of `folding` is pi."""
        xyz = np.empty((len(self.wi), 3 * len(folding.lights)))
        for start in range(0, len(xyz), surface.points_at_once):
            rows = slice(start, start + surface.points_at_once)
            xyz[rows] = surface.xyz(self.points.chosen(rows), folding) * self.wi[rows, 2:]
        return _by_light(xyz)

    def fast_xyz(self, fast: Fast, folding: Folding) -> Float[np.ndarray, "M N 3"]:
        """Compute `samples` under lights and an observer of any kind; the scale of `folding` is pi."""
        return _by_light(fast.shaded_xyz(self.points, folding))

    def compare(self, reference_xyz: Float[np.ndarray, "N 3"], sample_xyz: Float[np.ndarray, "N 3"]) -> FitError:
        """Compute statistics of ΔE94 over the samples."""
        difference = self.differences(reference_xyz, sample_xyz)
        p95, p99 = np.percentile(difference, [95, 99])
        mean, most = float(difference.mean()), float(difference.max())
        worst = int(np.argmax(difference))
        where = f"light {_placed(self.wi[worst])}; view {_placed(self.wo[worst])}"
        return FitError(mean, float(p95), float(p99), most, self.light, self.observer, self.text, 0.0, where=where)

    def compare_lights(
        self,
        references: Float[np.ndarray, "M N 3"],
        samples: Float[np.ndarray, "M N 3"],
        lights: Sequence[str],
        highlights: Sequence[float | None] = (),
    ) -> FitError:
        """Compute statistics under each of M lights; the overall figures are those of the worst 99th percentile.

        `highlights`: p99 of the highlight's own pixels under each light, if the surface has one.
        """
        by_light = [
            self.under(light).compare(reference, sample)
            for light, reference, sample in zip(lights, references, samples, strict=True)
        ]
        own = highlights or [None] * len(by_light)
        figures = tuple(
            LightError(one.light, one.mean, one.p95, one.p99, one.maximum, highlight)
            for one, highlight in zip(by_light, own, strict=True)
        )
        return replace(max(by_light, key=lambda one: one.p99), lights=figures)

    def differences(
        self, reference_xyz: Float[np.ndarray, "N 3"], sample_xyz: Float[np.ndarray, "N 3"]
    ) -> Float[np.ndarray, " N"]:
        """Compute ΔE94 of every sample."""
        white = self.weights(WORKING_WAVELENGTHS_NM).sum(axis=0)
        return delta_e_xyz(reference_xyz, sample_xyz, white)


def _placed(w: Float[np.ndarray, "3"]) -> str:
    """Describe a direction in a surface's frame."""
    polar, azimuth = np.degrees(angles(w))
    return f"{polar:.1f}° from the normal, azimuth {azimuth:.1f}°"


def _by_light(xyz: Float[np.ndarray, "N M3"]) -> Float[np.ndarray, "M N 3"]:
    """Split columns, three per light, into one picture per light."""
    return np.ascontiguousarray(xyz.reshape(len(xyz), -1, 3).transpose(1, 0, 2))


@lru_cache(maxsize=64)
def _folding(lights: tuple[str, ...], observer_name: str) -> Folding:
    return Folding(observer(observer_name), [illuminant(light) for light in lights], np.pi)


@lru_cache(maxsize=64)
def _weights(light: str, observer_name: str, wavelengths_nm: tuple[float, ...]) -> np.ndarray:
    weights = observer(observer_name).weights(illuminant(light), np.array(wavelengths_nm)).T
    weights.setflags(write=False)
    return weights


@cache
def sphere_protocol(
    pixels: int = 512,
    isotropic: bool = True,
    lights_deg: tuple[float, ...] = LIGHT_ANGLES_DEG,
    light: str = "D65",
) -> SphereProtocol:
    """Return the protocol's samples; for isotropic materials only the upper half, which the lower one mirrors."""
    centres = (np.arange(pixels) + 0.5) / pixels * 2.0 - 1.0
    x, y = np.meshgrid(centres, centres[centres > 0] if isotropic else centres)
    seen = x * x + y * y < 1.0
    x, y = x[seen], y[seen]
    normal = np.stack([x, y, np.sqrt(1.0 - x * x - y * y)], axis=-1)
    tangent = np.stack([normal[:, 2], np.zeros_like(x), -x], axis=-1)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    frame = np.stack([tangent, np.cross(normal, tangent), normal], axis=1)
    uv = 0.5 + 0.5 * np.stack([x, y], axis=-1)
    lit_points = []
    for angle in np.radians(lights_deg):
        wi = frame @ np.array([np.sin(angle), 0.0, np.cos(angle)])
        lit = wi[:, 2] > _LEAST_COSINE
        lit_points.append((wi[lit], frame[lit] @ np.array([0.0, 0.0, 1.0]), uv[lit]))
    wi, wo, uv = (np.concatenate(side) for side in zip(*lit_points, strict=True))
    return SphereProtocol(pixels, lights_deg, wi, wo, light, uv=uv)


def measured(fast: Form, surface: Surface, pixels: int = 128) -> Form:
    """Return a fast form with its error against the original, under all of `LIGHTS`."""
    sphere = sphere_protocol(pixels, surface.isotropic)
    error = sphere.compare_lights(sphere.references(surface, LIGHTS), sphere.samples(fast, LIGHTS), LIGHTS)
    return replace(fast, error=error)  # pyright: ignore[reportArgumentType]
