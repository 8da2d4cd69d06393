"""Spectra of the worst pixels of a case: image and reference by wavelength.

Original data and fast form, before reduction to the plan's coefficients, are rendered by the reference renderer with
the same random directions. A pixel's radiance is linear in the light, so that the effect of a band added to an
equal-energy light is the reflection of that band, relative to a perfect diffuser under the reference illuminance.
(Under a narrow band alone the white may have Z = 0, and relative colours would be undefined.)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
from jaxtyping import Float

from ...lighting.reference.geometry import LitSamples, VisibleGeometry
from ...lighting.reference.reference import reference_images
from ...lighting.scene import Scene
from ...lighting.transfer.radiant import fluoresces
from ...materials.core.surface import Surface
from ...spectral.observers import Observer
from ...spectral.spectrum import Spectrum
from .cases import ReviewCase, Setting

#: Centres of triangular bands, nm; each falls to 0 at its neighbours.
BANDS_NM = np.arange(400.0, 701.0, 10.0)
# Power of a band, large enough to outshine the equal-energy light at either end of the visible, and far within float64.
_STRENGTH = 1e6
#: Radiance factors (L,) of a pixel (row, column) at `BANDS_NM` by the original data and by render forms.
PixelSpectra = Callable[[tuple[int, int]], tuple[Float[np.ndarray, "L"], Float[np.ndarray, "L"]] | None]


def pixel_spectra(setting: Setting, case: ReviewCase) -> PixelSpectra:
    """Return a cached function from pixels of a case to their spectra; it gives None if a material fluoresces, whose
    emission is no reflectance.
    """
    names = case.scene.material_ids

    @cache
    def surfaces() -> tuple[Mapping[str, Surface], Mapping[str, Surface]]:
        records = {name: setting.records[name] for name in names}
        return {name: one.surface() for name, one in records.items()}, {
            name: one.drawn() for name, one in records.items()
        }

    @cache
    def spectra(place: tuple[int, int]) -> tuple[Float[np.ndarray, "L"], Float[np.ndarray, "L"]] | None:
        original, fast = surfaces()
        if fluoresces(original.values()):
            return None
        seen = _only(setting.geometry, place[0] * setting.geometry.width + place[1])
        return _factors(setting, case.scene, original, seen), _factors(setting, case.scene, fast, seen)

    return spectra


def _factors(
    setting: Setting, scene: Scene, surfaces: Mapping[str, Surface], seen: VisibleGeometry
) -> Float[np.ndarray, "L"]:
    lights, luminous = _lights(scene.observer)
    found = reference_images(
        scene,
        setting.view,
        surfaces,
        lights,
        geometry=seen,
        budget=setting.budget,
        bounces=int(scene.bounces),
    )
    # Y of the white is 1 under each light, whatever its power.
    sent = found.xyz[:, 0, 0, 1] * luminous
    return (sent[1:] - sent[0]) / (luminous[1:] - luminous[0])


@cache
def _lights(seen_by: Observer) -> tuple[tuple[Spectrum, ...], Float[np.ndarray, "M"]]:
    """Return an equal-energy light, the same with a band of `_STRENGTH` at each of `BANDS_NM`, and the luminance of
    each.
    """
    nm = np.arange(360.0, 831.0, 5.0)
    step = BANDS_NM[1] - BANDS_NM[0]
    bands = [np.maximum(1.0 - np.abs(nm - middle) / step, 0.0) for middle in BANDS_NM.tolist()]
    lights = tuple(Spectrum.sampled(nm, 1.0 + _STRENGTH * band, "emission") for band in (np.zeros_like(nm), *bands))
    return lights, np.array([seen_by.luminous(light) for light in lights])


def _only(geometry: VisibleGeometry, pixel: int) -> VisibleGeometry:
    """Return the geometry of one pixel."""
    chosen = np.flatnonzero(geometry.pixel == pixel)
    place = np.full(len(geometry.pixel), -1)
    place[chosen] = np.arange(len(chosen))

    def of(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else values[chosen]

    lit = []
    for one in geometry.lit:
        mine = place[one.sample] >= 0
        lit.append(LitSamples(place[one.sample[mine]], one.wi[mine], one.illuminance_lux[mine]))
    return replace(
        geometry,
        width=1,
        rows=1,
        pixel=np.zeros_like(geometry.pixel[chosen]),
        part=geometry.part[chosen],
        position=geometry.position[chosen],
        wo=geometry.wo[chosen],
        lit=tuple(lit),
        uv=of(geometry.uv),
        footprint=of(geometry.footprint),
        frame=of(geometry.frame),
        geometric=of(geometry.geometric),
    )
