"""Lights as the methods take them: a mean under any Gaussian, a few lobes, and what is exact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...lighting.environment.brights import BrightParts, taken_apart
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.environment.pyramid import Pyramid
from ...lighting.lights import Arrivals, DeltaLight
from ...materials.core.spherical_gaussian import Gaussians, sharpness_of_area, sphere_integral
from ...spectral.observers import observer
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..papers.harmonics import gaussian_factors, harmonics, project_light
from .surface import ShadedPoints

#: Lobes of an environment for what is matt: the paper has 6 to 8.
LOBES = 8
#: Angular radii of lights from one direction, for methods that give them a width: the sun's, and that of a ball a
#: hundredth as wide as the sphere.
RADIUS_RAD, RADIUS = 0.00465, 0.01
#: gamma(directions (n, 3) of the world, sharpness (n,)) -> (n, K) cd/m^2: the mean under a normalised Gaussian.
Gamma = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class PreparedLight:
    """A light with what methods make of it before the first point; each is made when it is first asked for."""

    light: EnvironmentLight | DeltaLight

    @property
    def environment(self) -> EnvironmentLight:
        """The light, which has to be one."""
        if not isinstance(self.light, EnvironmentLight):
            raise TypeError("an environment is needed")
        return self.light

    def arrivals(self, points: ShadedPoints) -> Arrivals:
        """Return what arrives at each point of a light that comes from one direction, which it has to be."""
        if not isinstance(self.light, DeltaLight):
            raise TypeError("a light of one direction is needed")
        return self.light.arrivals(points.positions)

    @property
    def spectra(self) -> Sequence[Spectrum]:
        """One a field."""
        return self.light.spectra if isinstance(self.light, EnvironmentLight) else (self.light.spectrum,)

    @cached_property
    def gamma(self) -> Gamma:
        """Eq. 35."""
        return Pyramid.of(self.environment)

    @cached_property
    def kept_harmonics(self) -> Float[np.ndarray, "K B"]:
        """The light's first 25 coefficients."""
        return project_light(self.environment)

    def smooth_gamma(self, to: Float[np.ndarray, "n 3"], sharpness: Float[np.ndarray, " n"]) -> np.ndarray:
        """`gamma` of the light's harmonics alone."""
        return (harmonics(to) * gaussian_factors(sharpness)) @ self.kept_harmonics.T

    @cached_property
    def lobes(self) -> BrightParts:
        """All of it as a few lobes."""
        return taken_apart(self.environment, LOBES, 1.0)[0]

    def local_lobes(self, points: ShadedPoints) -> Gaussians:
        """(N,) one lobe a point (eqs. 32 and 33): as wide as the light's ball looks from there, of its illuminance."""
        at = self.arrivals(points)
        angle = RADIUS_RAD if np.isinf(at.distance).any() else RADIUS / at.distance
        sharpness = np.broadcast_to(sharpness_of_area(np.asarray(2.0 * np.pi * angle**2)), at.distance.shape)
        return Gaussians(at.directions, sharpness, at.illuminance_lux / sphere_integral(sharpness))

    def white(self, points: ShadedPoints) -> Float[np.ndarray, "3"]:
        """XYZ of the perfect diffuser: lying flat, or facing the light where the most arrives."""
        if isinstance(self.light, EnvironmentLight):
            lux = float(self.light.illuminance_lux)
        else:
            lux = float(self.arrivals(points).illuminance_lux.max())
        return observer("1931_2").weights(self.light.spectrum, WORKING_WAVELENGTHS_NM).sum(axis=1) * lux / np.pi

    def folded(self, terms: Float[np.ndarray, "N K R"], spectra: Float[np.ndarray, "R L"]) -> Float[np.ndarray, "N 3"]:
        """XYZ of terms, cd/m^2 under each of the light's spectra, and what they are multiplied by."""
        seen_by = observer("1931_2")
        weights = np.stack([seen_by.weights(one, WORKING_WAVELENGTHS_NM) for one in self.spectra])
        return np.einsum("nkr,krc->nc", terms, np.einsum("rl,kcl->krc", spectra, weights))
