"""Surfaces that are rendered, and their lights."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...lighting.environment import latlong
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.environment.map_light import load_environment
from ...lighting.lights import DeltaLight, DirectionalLight, PointLight
from ...materials.analytic.cook_torrance import beckmann, ggx, smith_beckmann, smith_ggx
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.spectrum import Spectrum
from ...spectral.upsampling import upsampling
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..papers.gaussian_lobes import ndf
from .gold import real_gold
from .surface import GlossySurface, masked_by

#: A wall that hides what is to the left of its points, leaning over them.
WALL = np.array([0.8, -0.36, 0.48])
#: Reflectance of gold by wavelength, nm.
_GOLD = ((380, 0.39), (480, 0.39), (500, 0.50), (520, 0.63), (550, 0.80), (580, 0.90), (600, 0.95), (650, 0.97))
_ONE = np.ones(len(WORKING_WAVELENGTHS_NM))


@dataclass(frozen=True, eq=False)
class BenchCase:
    """A surface under a light, and the numbers of lobes that it is rendered in.

    place : a sphere in the "open" or beside a "wall", or one of `meshes.mesh_places`. full : only the long run has it.
    """

    name: str
    surface: GlossySurface
    light_name: str
    lobes: tuple[int, ...]
    place: str = "open"
    full: bool = False


def gold(roughness: float) -> GlossySurface:
    """Facets of GGX, alpha as given, with gold's reflectance at normal incidence and 1 at grazing."""
    colour = np.interp(WORKING_WAVELENGTHS_NM, *np.array(_GOLD).T)
    return GlossySurface(
        f"gold {roughness:g}",
        0.0 * _ONE,
        np.stack([colour, _ONE]),
        lambda half: ggx(half[..., 2] ** 2, half[..., 0] ** 2 + half[..., 1] ** 2, roughness),
        partial(masked_by, smith_ggx, roughness),
        partial(ndf.ggx, roughness),
    )


def matt_red() -> GlossySurface:
    """Return a body alone."""
    red = 0.05 + 0.6 / (1.0 + np.exp(-(WORKING_WAVELENGTHS_NM - 600.0) / 12.0))
    return GlossySurface("matt red", red, np.zeros((2, len(red))), None, _over_larger_cosine, partial(ndf.ggx, 0.5))


def _analytic() -> Iterator[tuple[GlossySurface, tuple[int, ...]]]:
    """Other distributions, each with a black body under it."""

    def of(name: str, density, masked, lobes) -> GlossySurface:
        return GlossySurface(name, 0.0 * _ONE, np.stack([0.04 * _ONE, _ONE]), density, masked, lobes)

    for roughness in (0.045, 0.2):

        def facets(half: np.ndarray, roughness: float = roughness) -> np.ndarray:
            return beckmann(half[..., 2] ** 2, half[..., 0] ** 2 + half[..., 1] ** 2, roughness)

        masked = partial(masked_by, smith_beckmann, roughness)
        yield of(f"Cook-Torrance {roughness:g}", facets, masked, _one(ndf.beckmann(roughness))), (1,)
    yield (
        of("Blinn-Phong 100", lambda half: _phong(half, 100.0), _over_larger_cosine, _one(ndf.blinn_phong(100.0))),
        (1,),
    )
    yield of("Ward 0.15", lambda half: _ward(half, 0.15, 0.15), _over_root, _one(ndf.ward(0.15))), (1,)
    wide = (0.3, 0.1)
    yield of("Ward 0.3, 0.1", lambda half: _ward(half, *wide), _over_root, lambda count: ndf.ward(*wide, count)), (1, 7)
    brushed = (75.0, 1200.0)
    yield (
        of(
            "Ashikhmin-Shirley 75, 1200",
            lambda half: _brushed(half, *brushed),
            _over_larger_cosine,
            lambda count: ndf.ashikhmin_shirley(*brushed, count),
        ),
        (1, 7),
    )


def svbrdf_cases(full: bool) -> list[BenchCase]:
    """Return every one that a run of this length has."""
    found = [BenchCase(f"{surface.name}, sun", surface, "sun", lobes) for surface, lobes in _analytic()]
    found += [BenchCase(f"gold {alpha:g}, sun", gold(alpha), "sun", (1, 4)) for alpha in (0.1, 0.3)]
    found += [BenchCase(f"{surface.name}, lamp", surface, "lamp", lobes, full=True) for surface, lobes in _analytic()]
    found.append(BenchCase("gold 0.2, lamp", gold(0.2), "lamp", (1, 4)))
    brushed = next(surface for surface, _ in _analytic() if surface.name.startswith("Ashikhmin"))
    for light in ("kiara-dawn", "studio", "venice-sunset", "made-sky"):
        long = light in ("studio", "venice-sunset")
        found += [
            BenchCase(f"gold {alpha:g}", gold(alpha), light, (1, 4, 6) if full else (1, 4), full=long)
            for alpha in (0.1, 0.2, 0.3)
        ]
        found.append(BenchCase("gold 0.2, wall", gold(0.2), light, (1, 4), place="wall", full=long))
        found.append(BenchCase(f"{brushed.name}", brushed, light, (1, 7), full=long))
        found.append(BenchCase("gold 0.2, floor", gold(0.2), light, (4,), place="floor", full=long))
        found.append(BenchCase("matt red", matt_red(), light, (0,), full=long))
        found.append(BenchCase("matt red, floor", matt_red(), light, (0,), place="floor", full=long))
        found.append(BenchCase("matt red, wall", matt_red(), light, (0,), place="wall", full=long))
    found += _scenes()
    return [case for case in found if full or not case.full]


def _scenes() -> Iterator[BenchCase]:
    """Meshes under measured skies; a sky with a low sun is what throws shadows on a floor."""

    def of(surface: GlossySurface, light: str, place: str, full: bool = False) -> BenchCase:
        lobes = 0 if surface.density is None else 4
        return BenchCase(f"{surface.name}, {place}", surface, light, (lobes,), place, full)

    yield of(matt_red(), "kiara-dawn", "spot")
    yield of(matt_red(), "venice-sunset", "spot on floor")
    yield of(matt_red(), "studio", "shaderball", full=True)
    for alpha in (0.1, 0.2, 0.4):
        yield of(real_gold(alpha), "kiara-dawn", "spot")
    for alpha in (0.2, 0.4):
        yield of(real_gold(alpha), "studio", "shaderball", full=True)


#: Files of environments by the lights' names, below `light/` of the data.
FILES = {
    "kiara-dawn": "kiara_1_dawn_512.exr",
    "studio": "studio_small_03_512.exr",
    "venice-sunset": "venice_sunset_512.exr",
}


def case_lights(data: Path | None) -> dict[str, Callable[[], EnvironmentLight | DeltaLight]]:
    """Return the lights that there are, by name; without `data` no file is one."""
    found: dict[str, Callable[[], EnvironmentLight | DeltaLight]]
    found = {"sun": _sun, "lamp": _lamp, "made-sky": window_sky}
    for name, file in FILES.items():
        if data is not None and (path := data / "light" / file).is_file():
            found[name] = partial(read_environment, path)
    return found


def read_environment(path: Path) -> EnvironmentLight:
    """Return a picture in linear sRGB, its channels uplifted as reflectances are, times D65."""
    return load_environment(path, uplift="mallett-yuksel")


def window_sky() -> EnvironmentLight:
    """Return a blue sky, brighter towards the horizon, over brown ground, with a low warm window of light."""
    to = latlong.texel_directions(128, 256)
    up = to[..., 1]
    sky = np.stack([0.3 + 0.5 * (1.0 - up), 0.5 + 0.4 * (1.0 - up), 1.0 + 0.1 * up])
    rgb = np.where(up > 0.0, sky, np.array([0.25, 0.18, 0.12])[:, None, None])
    window = (np.abs(to[..., 0] - 0.5) < 0.12) & (np.abs(up - 0.35) < 0.2) & (to[..., 2] > 0.0)
    return _uplifted(np.where(window, np.array([60.0, 40.0, 20.0])[:, None, None], rgb))


def _uplifted(rgb: Float[np.ndarray, "3 H W"]) -> EnvironmentLight:
    light = illuminant("D65")
    there = np.interp(WORKING_WAVELENGTHS_NM, light.wavelengths_nm, light.samples)
    corners = upsampling("mallett-yuksel").corners
    spectra = tuple(Spectrum(corner * there, WORKING_WAVELENGTHS_NM, "emission") for corner in corners)
    # The luminance of each channel at 1, as shares of white's.
    shares = corners @ observer("1931_2").weights(light, WORKING_WAVELENGTHS_NM)[1]
    return EnvironmentLight(rgb * shares[:, None, None], spectra, origin="made")


def _sun() -> DirectionalLight:
    return DirectionalLight((0.5, 0.5, 0.7), illuminant("D65"), 1000.0)


def _lamp() -> PointLight:
    return PointLight((1.2, 1.0, 1.6), illuminant("A"), 1000.0)


def _one(lobes) -> Callable[[int], object]:
    return lambda count: lobes


def _over_larger_cosine(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """1 / (4 h.o max(cos)): Ashikhmin and Shirley's."""
    cosine = 0.5 * np.linalg.norm(wi + wo, axis=-1)
    return 0.25 / (np.maximum(cosine, 1e-3) * np.maximum(wi[..., 2], wo[..., 2]))


def _over_root(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """1 / (4 root(cos i cos o)): Ward's."""
    return 0.25 / np.sqrt(wi[..., 2] * wo[..., 2])


def _phong(half: np.ndarray, exponent: float) -> np.ndarray:
    return (exponent + 2.0) / (2.0 * np.pi) * half[..., 2] ** exponent


def _ward(half: np.ndarray, along: float, across: float) -> np.ndarray:
    slope = ((half[..., 0] / along) ** 2 + (half[..., 1] / across) ** 2) / half[..., 2] ** 2
    return np.exp(-slope) / (np.pi * along * across)


def _brushed(half: np.ndarray, along: float, across: float) -> np.ndarray:
    sine2 = np.maximum(half[..., 0] ** 2 + half[..., 1] ** 2, 1e-30)
    exponent = (along * half[..., 0] ** 2 + across * half[..., 1] ** 2) / sine2
    top = np.sqrt((along + 1.0) * (across + 1.0)) / (2.0 * np.pi)
    return top * half[..., 2] ** exponent
