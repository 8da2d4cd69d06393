"""Lights as the methods take them: a mean under any Gaussian, a few lobes, and what is exact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...lighting.environment.brights import BrightParts, taken_apart
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.environment.harmonics import gaussian_factors, harmonics, projected
from ...lighting.environment.pyramid import Pyramid
from ...lighting.lights import DirectionalLight
from ...materials.gaussians.gaussian import Gaussians, sphere_integral
from ...spectral.observers import observer
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM

#: Lobes of an environment for what is matt: the paper has 6 to 8.
LOBES = 8
#: The sun's radius, which the paper gives a distant light, rad.
RADIUS = 0.00465
#: gamma(directions (n, 3) of the world, sharpness (n,)) -> (n, K): the mean luminance under a normalised Gaussian, cd/m^2.
Gamma = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class PreparedLight:
    """A light with what methods make of it before the first point; each is made when it is first asked for."""

    light: EnvironmentLight | DirectionalLight

    @property
    def spectra(self) -> Sequence[Spectrum]:
        """One a field."""
        return self.light.spectra if isinstance(self.light, EnvironmentLight) else (self.light.spectrum,)

    @cached_property
    def gamma(self) -> Gamma:
        """Eq. 35 (`Pyramid`); of a distant light, the product of two Gaussians (eq. 33)."""
        return Pyramid.of(self.light) if isinstance(self.light, EnvironmentLight) else _of_lobes(self.lobes)

    @cached_property
    def kept_harmonics(self) -> Float[np.ndarray, "K B"]:
        """The light's first 25 coefficients."""
        if isinstance(self.light, EnvironmentLight):
            return projected(self.light)
        lobes = self.lobes
        around = harmonics(lobes.axis) * gaussian_factors(lobes.sharpness)
        return (lobes.amplitude * sphere_integral(lobes.sharpness)[:, None]).T @ around

    def smooth_gamma(self, to: Float[np.ndarray, "n 3"], sharpness: Float[np.ndarray, " n"]) -> np.ndarray:
        """`gamma` of the light's harmonics alone."""
        return (harmonics(to) * gaussian_factors(sharpness)) @ self.kept_harmonics.T

    @cached_property
    def lobes(self) -> BrightParts:
        """All of it as a few lobes."""
        if isinstance(self.light, EnvironmentLight):
            return taken_apart(self.light, LOBES, 1.0)[0]
        # The disc of radius r as a Gaussian of the same solid angle pi r^2, and of the light's own illuminance.
        sharpness = np.array([2.0 / RADIUS**2])
        amplitude = np.array([[self.light.illuminance_lux]]) / sphere_integral(sharpness)[:, None]
        return BrightParts(self.light.direction_to_light[None], sharpness, amplitude)

    @property
    def white(self) -> Float[np.ndarray, "3"]:
        """XYZ of the perfect diffuser lying flat, or facing a distant light."""
        weights = observer("1931_2").weights(self.light.spectrum, WORKING_WAVELENGTHS_NM)
        return weights.sum(axis=1) * self.light.illuminance_lux / np.pi

    def folded(self, terms: Float[np.ndarray, "N K R"], spectra: Float[np.ndarray, "R L"]) -> Float[np.ndarray, "N 3"]:
        """XYZ of terms, cd/m^2 under each of the light's spectra, and what they are multiplied by."""
        seen_by = observer("1931_2")
        weights = np.stack([seen_by.weights(one, WORKING_WAVELENGTHS_NM) for one in self.spectra])
        return np.einsum("nkr,krc->nc", terms, np.einsum("rl,kcl->krc", spectra, weights))


def _of_lobes(lobes: BrightParts) -> Gamma:
    def gamma(to: np.ndarray, sharpness: np.ndarray) -> np.ndarray:
        light = Gaussians(lobes.axis, lobes.sharpness, np.ones(len(lobes.sharpness)))
        inner = Gaussians(to[:, None], sharpness[:, None], np.ones((len(to), 1))).inner(light)
        return (inner @ lobes.amplitude) / sphere_integral(sharpness)[:, None]

    return gamma
