"""Probe of a pixel: incident and reflected spectra, and its colour, without a GPU.

Colours are those of the image: the pixel alone is rendered in numpy, by the twin of the GPU renderer
(`Camera.cropped`). Under delta lights, spectra are from the original data, at all wavelengths of surfaces and lights;
under area and environment lights from the fast form. Colours include indirect light, spectra only direct light.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.reference.geometry import Tracer, VisibleGeometry, visible_geometry
from ...lighting.reference.noise import NOISE_SHARE
from ...lighting.reference.reference import lit_points, reference_images
from ...lighting.scene import Scene
from ...materials.analytic.fluorescent import FluorescentBrdf
from ...materials.catalogue.catalogue import Catalogue
from ...materials.catalogue.material import Material
from ...materials.core.fast import Fast
from ...materials.factored.pack import matt_brdf
from ...runtime.errors import InputError
from ...spectral.difference import delta_e_xyz, lab_from_xyz
from ...spectral.palette import Palette
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from ...spectral.wavelengths import interpolation_matrix
from ..software.backend import software_session

ORIGINAL, FAST = "original data", "fast form"
#: Noise limit of a probe's reference, ΔE94.
NOISE = 0.05
# Id of the perfect diffuser; ids of catalogues have no capitals.
_WHITE = "the perfect diffuser/WHITE"


@dataclass(frozen=True, eq=False)
class ProbeSpectra:
    """Spectra of a pixel, box-filtered like the pixel.

    Parameters
    ----------
    wavelengths_nm : (L,).
    incident : (L,) irradiance of the surface, relative to an equal-energy light of the reference illuminance.
    reflected : (L,) radiance towards the viewer, relative to a perfect diffuser under that light; may exceed `incident`
        with fluorescence.
    reflectance : (L,) radiance factor without fluorescence, averaged over lights by illuminance; NaN without incident
        light.
    made_of : `ORIGINAL` or `FAST`.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    incident: Float[np.ndarray, " L"]
    reflected: Float[np.ndarray, " L"]
    reflectance: Float[np.ndarray, " L"]
    made_of: str


@dataclass(frozen=True, eq=False)
class ProbeReading:
    """Reading of a probe at a pixel, before adaptation and display.

    Parameters
    ----------
    pixel : column and row. parts, materials : visible in it, largest share first; () for none.
    coverage : share covered by surfaces. light, observer : by name.
    xyz : (3,) of the image, premultiplied by coverage; Y = 1 is a perfect diffuser under the reference illuminance.
    white : (3,) reference white of colours.
    spectra : None without a surface.
    """

    pixel: tuple[int, int]
    parts: tuple[str, ...]
    materials: tuple[str, ...]
    coverage: float
    light: str
    observer: str
    xyz: Float[np.ndarray, "3"]
    white: Float[np.ndarray, "3"]
    spectra: ProbeSpectra | None = None

    @cached_property
    def xy(self) -> tuple[float, float] | None:
        """Chromaticity; None for black."""
        total = float(self.xyz.sum())
        return (float(self.xyz[0]) / total, float(self.xyz[1]) / total) if total > 0.0 else None

    @cached_property
    def lab(self) -> Float[np.ndarray, "3"]:
        """CIELAB relative to `white`."""
        return lab_from_xyz(self.xyz, self.white)

    @cached_property
    def lch(self) -> Float[np.ndarray, "3"]:
        """L*, C*ab and h_ab in degrees from 0 to 360."""
        lightness, a, b = self.lab
        return np.array([lightness, np.hypot(a, b), np.degrees(np.arctan2(b, a)) % 360.0])


@dataclass(frozen=True, eq=False)
class ProbeTruth:
    """Reference of a pixel: xyz (3,), ΔE94 of the image from it, and its noise, ΔE94 or None."""

    xyz: Float[np.ndarray, "3"]
    delta_e: float
    noise: float | None


class Prober:
    """Prober of one scene, which reuses data of scenes with the same meshes."""

    def __init__(self, scene: Scene, catalogue: Catalogue) -> None:
        self.scene, self.catalogue = scene, catalogue
        self._renderer = software_session()
        self._materials: dict[str, Material] = {}
        self._load()
        self._cut = scene.cut(self._drawn)
        self._tracer = Tracer(self._cut)

    def turn_to(self, scene: Scene, catalogue: Catalogue | None = None) -> None:
        """Switch to another scene or materials; ray tracers are reused while meshes and their holes are unchanged.

        Raises
        ------
        InputError, UnknownNameError : an unusable material; the last scene stays.
        """
        before = self.scene, self.catalogue, self._materials
        self.scene = scene
        if catalogue is not None and catalogue != self.catalogue:
            self.catalogue, self._materials = catalogue, {}
        try:
            self._load()
        except InputError:
            self.scene, self.catalogue, self._materials = before
            raise
        cut = scene.cut(self._drawn)
        same = len(cut.parts) == len(self._cut.parts) and all(
            one.mesh is other.mesh and one.cutout is other.cutout
            for one, other in zip(cut.parts, self._cut.parts, strict=True)
        )
        if not same:
            self._tracer = Tracer(cut)
        self._cut = cut

    def _load(self) -> None:
        known = self._materials
        names = self.scene.material_ids
        self._materials = {name: known.get(name) or self.catalogue.surface(name) for name in names}
        self.scene.check_surfaces(self._drawn)

    @property
    def _drawn(self) -> Mapping[str, Fast]:
        return {name: one.drawn() for name, one in self._materials.items()}

    def at(self, camera: Camera, column: int, row: int, light: str | None = None) -> ProbeReading:
        """Probe a pixel of the camera's image.

        light : its name in readings; by default the names of the scene's lights.

        Raises
        ------
        InputError : a pixel outside the image, and errors of renderers.
        """
        one = camera.cropped(slice(row, row + 1), slice(column, column + 1))
        xyz, coverage = self._renderer.render(self.scene, one, self._drawn)
        # Light caches depend on the scene's lights, ray tracers only on its meshes.
        seen = visible_geometry(self._cut, one, tracer=self._tracer, with_uv=self.scene.needs_uv(self._drawn))
        numbers, counts = np.unique(seen.part, return_counts=True)
        shown = [self.scene.parts[number] for number in numbers[np.argsort(-counts, kind="stable")]]
        names = dict.fromkeys(one.spectrum_name or one.name for one in self.scene.lights)
        return ProbeReading(
            (column, row),
            tuple(part.name for part in shown),
            tuple(dict.fromkeys(part.material for part in shown)),
            float(coverage[0, 0]),
            light or ", ".join(names),
            self.scene.observer.name,
            xyz[0, 0].astype(np.float64),
            self.scene.adopted_white(),
            self._spectra(one, seen, [part.name for part in shown]) if shown else None,
        )

    def truth(self, camera: Camera, reading: ProbeReading, noise: float = NOISE) -> ProbeTruth:
        """Render the same pixel by the reference, with noise of at most `noise`, ΔE94."""
        column, row = reading.pixel
        one = camera.cropped(slice(row, row + 1), slice(column, column + 1))
        surfaces = {name: material.surface() for name, material in self._materials.items()}
        bounces = 0 if self.scene.bounces == "auto" else self.scene.bounces
        found = reference_images(self.scene, one, surfaces, budget=noise / NOISE_SHARE, bounces=bounces)
        xyz = found.xyz[0, 0, 0]
        off = float(delta_e_xyz(xyz, reading.xyz, reading.white))
        return ProbeTruth(xyz, off, None if found.noise is None else max(found.noise.mean))

    def _spectra(self, camera: Camera, seen: VisibleGeometry, parts: Sequence[str]) -> ProbeSpectra:
        return self._of_fast_forms(camera, parts) if self.scene.spread_lights else self._of_originals(seen)

    def _of_originals(self, seen: VisibleGeometry) -> ProbeSpectra:
        """Compute spectra from original surfaces, at all wavelengths of visible surfaces and lights."""
        scene, eye = self.scene, self.scene.observer
        surfaces = {number: self._materials[scene.parts[number].material].surface() for number in np.unique(seen.part)}
        known = [one.wavelengths_nm for one in surfaces.values()] + [
            one.spectrum.wavelengths_nm for one in scene.lights
        ]
        grid = np.unique(np.concatenate(known))
        grid = grid[(grid >= eye.wavelengths_nm[0]) & (grid <= eye.wavelengths_nm[-1])]
        even = eye.luminous(Spectrum.sampled(eye.wavelengths_nm, np.ones(len(eye.wavelengths_nm)), "emission"))
        incident, reflected, kept = np.zeros((3, len(grid)))
        arrived = 0.0
        for light, lit in zip(scene.delta_lights, seen.lit, strict=True):
            # Irradiance at each sample, relative to the reference illuminance on the pixel.
            share = lit.illuminance_lux * lit.wi[:, 2] / scene.viewing.reference_illuminance_lux / seen.samples
            unit = even / eye.luminous(light.spectrum)
            power = unit * np.interp(grid, light.spectrum.wavelengths_nm, light.spectrum.samples)
            of_light = np.zeros(len(grid))
            for number, surface in surfaces.items():
                mine = np.flatnonzero(seen.part[lit.sample] == number)
                points = lit_points(seen, lit, mine)
                factor = np.pi * share[mine] @ surface.at(points)
                of_light += interpolation_matrix(surface.wavelengths_nm, grid) @ factor
                if isinstance(surface, FluorescentBrdf):
                    spread = np.pi * share[mine] @ surface.emission_factor(points.wi, points.wo)
                    reflected += spread * unit * surface.bispectral.emission(light.spectrum, grid)
            incident += share.sum() * power
            reflected += of_light * power
            kept += of_light
            arrived += float(share.sum())
        reflectance = kept / arrived if arrived > 0.0 else np.full(len(grid), np.nan)
        return ProbeSpectra(grid, incident, reflected, reflectance, ORIGINAL)

    def _of_fast_forms(self, camera: Camera, parts: Sequence[str]) -> ProbeSpectra:
        """Compute spectra from fast forms at the working wavelengths; incident light is that reflected by a perfect
        diffuser.
        """
        direct, nm = replace(self.scene, bounces=0), WORKING_WAVELENGTHS_NM
        white = direct
        for part in parts:
            white = white.with_material(part, _WHITE)
        diffuser = matt_brdf(np.array([1.0 / np.pi]), Palette.of(np.ones((1, len(nm)))))
        surfaces = {**self._drawn, _WHITE: diffuser}
        incident, reflected = (
            self._renderer.render_spectra(one, camera, surfaces, nm)[0, 0].astype(np.float64) for one in (white, direct)
        )
        reflectance = np.full(len(nm), np.nan)
        np.divide(reflected, incident, out=reflectance, where=incident > 0.0)
        return ProbeSpectra(nm, incident, reflected, reflectance, FAST)
