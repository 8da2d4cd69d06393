"""The spheres of the protocol as scenes: what a renderer really draws, beside the rays of the reference."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
from jaxtyping import Bool, Float

from ...lighting.camera import Camera
from ...lighting.lights import DirectionalLight
from ...lighting.mesh import shapes
from ...lighting.reference.reference import reference_images
from ...lighting.scene import Part, Scene
from ...materials.core.brdf import Brdf
from ...materials.core.protocol import LIGHT_ANGLES_DEG
from ...materials.factored.pack import FactoredBrdf, FactorPack
from ...spectral.difference import delta_e_xyz
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.spectrum import Spectrum
from ...viewer.render.session import RenderSession

_MATERIAL = "material"
# Least cosine of the light on the surface; as in the protocol, the last of the shade is not counted.
_LEAST_COSINE = 0.01
# Subdivisions of the sphere's triangles into four.
_SUBDIVISIONS = 5


@cache
def sphere_scenes(pixels: int, angles_deg: tuple[float, ...] = LIGHT_ANGLES_DEG) -> tuple[Scene, ...]:
    """One scene a light angle: a unit sphere that fills `pixels`, orthographic, one sample a pixel, Y = 1 at most."""
    camera = Camera(projection="orthographic", height=2.0, width=pixels, height_px=pixels, samples=1)
    ball = Part("ball", shapes.sphere(_SUBDIVISIONS), _MATERIAL)
    eye, lamp = observer("1931_2"), illuminant("D65")
    scenes = []
    for angle in np.radians(angles_deg):
        light = DirectionalLight(np.array([np.sin(angle), 0.0, np.cos(angle)]), lamp, 1000.0)
        scenes.append(Scene((ball,), (light,), (camera,), eye))
    return tuple(scenes)


@cache
def lit_pixels(pixels: int, angles_deg: tuple[float, ...] = LIGHT_ANGLES_DEG) -> Bool[np.ndarray, "A P P"]:
    """Pixels of each scene's picture whose sample the light reaches, and where the outline is not in doubt."""
    centres = (np.arange(pixels) + 0.5) / pixels * 2.0 - 1.0
    x, y = np.meshgrid(centres, -centres)
    # Triangles stay a little inside the sphere.
    inside = x * x + y * y < 0.995
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    return np.stack([inside & (np.sin(a) * x + np.cos(a) * z > _LEAST_COSINE) for a in np.radians(angles_deg)])


def rendered_xyz(
    renderer: RenderSession,
    packs: tuple[FactorPack, ...],
    lights: Mapping[str, Spectrum],
    pixels: int,
    angles_deg: tuple[float, ...] = LIGHT_ANGLES_DEG,
) -> Float[np.ndarray, "M A P P 3"]:
    """XYZ of every picture that the renderer makes: M lights, A angles."""
    pictures = [
        [xyz for xyz, _ in renderer.render_many(scene, None, {_MATERIAL: FactoredBrdf(packs)}, tuple(lights.values()))]
        for scene in sphere_scenes(pixels, angles_deg)
    ]
    return np.asarray(pictures, dtype=np.float64).swapaxes(0, 1)


def reference_xyz(
    brdf: Brdf,
    lights: Mapping[str, Spectrum],
    pixels: int,
    angles_deg: tuple[float, ...] = LIGHT_ANGLES_DEG,
) -> Float[np.ndarray, "M A P P 3"]:
    """Return the same pictures by rays, at every wavelength, in float64; for fluorescent surfaces with the whole
    matrix.
    """
    pictures = [
        reference_images(scene, None, {_MATERIAL: brdf}, tuple(lights.values())).xyz
        for scene in sphere_scenes(pixels, angles_deg)
    ]
    return np.stack(pictures, axis=1)


def picture_statistics(
    reference: Float[np.ndarray, "A P P 3"],
    sample: Float[np.ndarray, "A P P 3"],
    light: Spectrum,
    angles_deg: tuple[float, ...] = LIGHT_ANGLES_DEG,
) -> dict[str, float]:
    """Mean, p95, p99 and maximum of ΔE94 over the lit pixels of all angles, relative to the light's own white."""
    lit = lit_pixels(reference.shape[1], angles_deg)
    difference = delta_e_xyz(reference[lit], sample[lit], observer("1931_2").white(light))
    p95, p99 = np.percentile(difference, [95, 99])
    return {"mean": float(difference.mean()), "p95": float(p95), "p99": float(p99), "max": float(difference.max())}
