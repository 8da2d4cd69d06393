"""Light from all around that BTFs are shown in: skies and lamps, measured and made up, in a dozen turns each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...lighting.environment import latlong
from ...lighting.environment.convolution import half_size
from ...lighting.environment.environment import EnvironmentLight, mixture
from ...lighting.environment.prefiltering import GatheredLight
from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.light_basis import LightFunctions, hats_at
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..papers.harmonics import harmonics
from ..svbrdf.cases import FILES, read_environment, window_sky

#: Turns of a sample in each.
TURNS = 12
#: Rows that maps are reduced to.
ROWS = 128


def environments(data: Path | None) -> dict[str, Callable[[], EnvironmentLight]]:
    """Return the environments that there are, by name; without `data` only those that are made up."""
    found: dict[str, Callable[[], EnvironmentLight]] = {}
    for name, file in FILES.items():
        if data is not None and (path := data / "light" / file).is_file():
            found[name] = partial(read_environment, path)
    return found | {"made-sky": window_sky, "lamps": lamps, "half-sky": half_sky, "low-sun": low_sun}


def lamps() -> EnvironmentLight:
    """Return a dim room with a large lamp above and two small ones lower down, of incandescent light."""
    to = latlong.texel_directions(ROWS, 2 * ROWS)
    field = np.full(to.shape[:2], 0.03)
    for (x, y, z), radius, bright in (((0.3, 0.9, 0.3), 0.3, 8.0), ((0.9, 0.3, -0.4), 0.1, 40.0)):
        field += bright * _disc(to, (x, y, z), radius)
    field += 60.0 * _disc(to, (-0.6, 0.5, -0.6), 0.07)
    return EnvironmentLight(field[None], (illuminant("A"),))


def half_sky() -> EnvironmentLight:
    """Return an even sky on one side, and nothing on the other: a window as wide as its wall."""
    to = latlong.texel_directions(ROWS, 2 * ROWS)
    return EnvironmentLight((to[..., 0] > 0.0).astype(float)[None], (illuminant("D65"),))


def low_sun() -> EnvironmentLight:
    """Return a sun of 4 degrees, 15 above the horizon, in a sky that is brighter around it."""
    to = latlong.texel_directions(ROWS, 2 * ROWS)
    sun = np.array([np.cos(np.radians(15.0)), np.sin(np.radians(15.0)), 0.0])
    sky = (0.3 + 0.7 * np.exp(4.0 * (to @ sun - 1.0))) * np.where(to[..., 1] > 0.0, 1.0, 0.15)
    disc = 400.0 * _disc(to, tuple(sun), np.radians(2.0))
    return EnvironmentLight(np.stack([sky, disc]), (illuminant("D75"), illuminant("D50")))


def _disc(
    to: Float[np.ndarray, "H W 3"], middle: tuple[float, float, float], radius: float
) -> Float[np.ndarray, "H W"]:
    """1 within so many radians of a direction; half a texel wide at its edge, so that turns do not flicker."""
    unit = np.asarray(middle) / np.linalg.norm(middle)
    off = np.arccos(np.clip(to @ unit, -1.0, 1.0))
    texel = np.pi / len(to)
    return np.clip((radius - off) / texel + 0.5, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class PlacedLight:
    """An environment of K spectra as it arrives at one sample.

    hats (Lt,K) : what each measured light stands for, the integral of its hat and the luminance, cd/m^2 sr. functions
    (F,K) : what renderers look up: mean luminance under Gaussians, then the illuminance and its moments. harmonics
    (25,K) : its coefficients in the sample's frame. folding : its spectra, so that white is what `white` says.
    """

    hats: Float[np.ndarray, "Lt K"]
    functions: Float[np.ndarray, "F K"]
    harmonics: Float[np.ndarray, "25 K"]
    folding: Folding
    white: Float[np.ndarray, "3"]


def tilted_lights(
    light: EnvironmentLight, lights: Hemisphere, functions: LightFunctions, seed: int = 0
) -> list[PlacedLight]:
    """Return an environment above a sample that is turned any which way, as parts of a mesh are, `TURNS` times.

    Y of 1 is the perfect diffuser in the turn in which the most light arrives; the others are darker, as they look
    beside it.
    """
    from scipy.spatial.transform import Rotation

    while light.fields.shape[1] > ROWS:
        light = replace(light, fields=half_size(light.fields))
    gathered = GatheredLight.of(light)
    height, width = light.fields.shape[1:]
    solid = np.repeat(latlong.solid_angles(height, width), width)
    arriving = (light.fields.reshape(len(light.fields), -1) * solid).T
    to = latlong.texel_directions(height, width).reshape(-1, 3)
    sharpness = np.full((1, len(functions.axes)), functions.sharpness)
    # Illuminance of each turn, and the fields of a `PlacedLight`.
    found: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []
    # Rows of a frame are the sample's axes in the map.
    for frame in Rotation.random(TURNS, np.random.default_rng(seed)).as_matrix():
        seen = gathered.by_lobes((functions.axes @ frame)[None], sharpness)[0]
        lux = gathered.by_frames(frame[None])[0]
        local = to @ frame.T
        hats, about_it = hats_at(lights, local).T @ arriving, harmonics(local).T @ arriving
        found.append((float(lux[0].sum()), hats, np.concatenate([seen, lux]), about_it))
    brightest = max(found, key=lambda one: one[0])
    folding = Folding(light.observer, light.spectra, np.pi / brightest[0])
    # Mixture of the spectra in the shares of the brightest turn's illuminance.
    spectrum = mixture(light.spectra, brightest[2][len(functions.axes)], light.observer)
    white = light.observer.weights(spectrum, WORKING_WAVELENGTHS_NM).sum(axis=1)
    return [PlacedLight(*one[1:], folding, white) for one in found]
