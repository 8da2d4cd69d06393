"""Rough diffuse surfaces: V-cavities with Lambertian walls."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.folding import Folding
from ...spectral.spectrum import Spectrum
from ..core.brdf import eval_lit
from ..core.directions import spherical
from ..core.points import Points
from ..core.surface import SumOfTerms
from .instrument import Instrument, ReadBrdf
from .model import AnalyticBrdf, in_domain

# Nodes of a reading by a sphere, in each of the pieces between which the formula has kinks.
_NODES = 24


@dataclass(frozen=True, eq=False)
class OrenNayar(ReadBrdf):
    """The full model of Oren and Nayar, "Generalization of Lambert's reflectance model", SIGGRAPH 94.

    It is the paper's functional approximation for a Gaussian distribution of slopes, not the shorter qualitative model.
    With alpha = max(theta_i, theta_o), beta = min(theta_i, theta_o), phi = phi_o - phi_i and rho(lambda):

        L1 = rho/pi [C1 + cos(phi) C2 tan(beta) + (1 - |cos(phi)|) C3 tan((alpha + beta)/2)]
        C1 = 1 - 0.5 s2 / (s2 + 0.33)                      with s2 = sigma^2
        C2 = 0.45 s2 / (s2 + 0.09) (sin(alpha) - [cos(phi) < 0] (2 beta/pi)^3)
        C3 = 0.125 s2 / (s2 + 0.09) (4 alpha beta / pi^2)^2
        L2 = 0.17 rho^2/pi s2 / (s2 + 0.13) [1 - cos(phi) (2 beta/pi)^2]      one interreflection
        f_r = max(L1 + L2, 0)

    The approximation dips below zero for dark, rough surfaces seen against the light at grazing angles; radiance
    cannot, hence the maximum. f_r grows without bound towards grazing retro-reflection (tan beta), f_r times the cosine
    does not.

    Parameters
    ----------
    reflectance : rho of the walls, (L,) in [0, 1]; the whole is darker, and `reads` derives rho from its measurement.
    sigma : standard deviation of the slope angle, radians in [0, pi/2]; 0 is Lambert.
    """

    NAME: ClassVar[str] = "oren_nayar"
    READ: ClassVar[str] = "reflectance"
    # White walls of sigma = 0.3 send back 1.051 of grazing light: the approximation is not quite conservative.
    ALBEDO_BOUND: ClassVar[float] = 1.06
    isotropic = True

    reflectance: Spectrum
    sigma: float = field(metadata=in_domain(0.0, 0.5 * np.pi, unit="radians"))

    def __post_init__(self) -> None:
        self._set(_rho=self._checked_reflectance("reflectance"))
        self._check_numbers()

    @classmethod
    def examples(cls, wavelengths_nm: np.ndarray) -> tuple[AnalyticBrdf, ...]:
        """Make examples from smooth to as rough as can be, for tests of what every model must keep."""
        ramp = Spectrum.sampled(wavelengths_nm, np.linspace(0.0, 1.0, len(wavelengths_nm)))
        return tuple(cls(ramp, sigma) for sigma in (0.0, 0.3, 0.52, 0.5 * np.pi))

    def reads(self, reading: Spectrum, geometry: str) -> OrenNayar:
        """Find the walls for which an instrument reads a given spectrum of the whole: reading = a rho + b rho^2.

        Parameters and errors as of `ReadBrdf.reads`; the specular component of a matt surface need not be stated.
        """
        a, b = self._read_at(geometry)
        whitest = a + b
        if (reading.samples > whitest).any():
            at = int(np.argmax(reading.samples))
            raise InputError(
                "brighter than white walls of this roughness",
                field="reflectance",
                found=f"{reading.samples[at]:.4g} at {reading.wavelengths_nm[at]:g} nm, read at {geometry}",
                expected=f"at most {whitest:.4g} with sigma {self.sigma:g}",
                hint="a smaller sigma, or the geometry of the instrument that read it",
            )
        rho = np.minimum(2.0 * reading.samples / (a + np.sqrt(a * a + 4.0 * b * reading.samples)), 1.0)
        return replace(self, reflectance=Spectrum.sampled(reading.wavelengths_nm, rho, "reflectance"))

    def _read_at(self, geometry: str) -> tuple[float, float]:
        """Return the readings of direct and of interreflected light, for walls of rho = 1.

        Within 10 degrees of the normal, where spheres view, no wavelength is clamped to 0.
        """
        sphere_deg = Instrument.of(geometry).sphere_deg
        if sphere_deg is None:
            wi, wo, share = spherical(np.array([0.25 * np.pi]), 0.0), spherical(np.zeros(1), 0.0), np.ones(1)
        else:
            seen = np.radians(sphere_deg)
            nodes, weights = np.polynomial.legendre.leggauss(_NODES)
            theta, d_theta = _between(nodes, weights, (0.0, seen, 0.5 * np.pi))
            phi, d_phi = _between(nodes, weights, (0.0, 0.5 * np.pi, np.pi))
            theta, phi = (grid.ravel() for grid in np.meshgrid(theta, phi, indexing="ij"))
            share = np.outer(d_theta, d_phi).ravel() * np.sin(theta) * np.cos(theta) * (2.0 / np.pi)
            wi, wo = spherical(theta, phi), np.broadcast_to(spherical(seen, 0.0), (theta.size, 3))
        direct, between = share @ self._terms(wi, wo)
        return float(direct), float(between)

    @property
    def sum_of_terms(self) -> SumOfTerms | None:
        """Terms of direct and interreflected light times rho and rho^2; None if f_r may be clamped to 0.

        cos(phi) C2 tan(beta) is at least -0.45 s2 / (s2 + 0.09) (1 - (2 beta/pi)^3) tan(beta), which falls to -0.45 s2
        / (s2 + 0.09) 6/pi at grazing angles.
        """
        s2 = self.sigma**2
        if 1.0 - 0.5 * s2 / (s2 + 0.33) < 0.45 * s2 / (s2 + 0.09) * (6.0 / np.pi):
            return None
        return SumOfTerms(self._terms, np.stack([self._rho, self._rho**2]) / np.pi, (self.NAME, self.sigma))

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Implement `Surface.xyz`, folded before the evaluation wherever no wavelength is clamped to 0."""
        if self.sum_of_terms is not None:
            return super().xyz(points, folding)
        weights = folding.weights(self.wavelengths_nm) / np.pi
        colours = np.stack([self._rho @ weights, self._rho**2 @ weights])

        def folded(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
            terms = self._terms(wi, wo)
            out = terms @ colours
            held = np.flatnonzero(terms[:, 0] + terms[:, 1] * self._rho.min() < 0.0)
            if len(held):
                out[held] = self._spectra(terms[held]) @ (weights * np.pi)
            return out

        return eval_lit(folded, weights.shape[1], points.wi, points.wo)

    def _eval_lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return self._spectra(self._terms(wi, wo))

    def _spectra(self, terms: np.ndarray) -> np.ndarray:
        """Evaluate f_r (N,L) from `_terms`."""
        out = np.multiply.outer(terms[:, 1], self._rho)
        out += terms[:, :1]
        np.maximum(out, 0.0, out=out)
        out *= self._rho / np.pi
        return out

    def _terms(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Evaluate pi L1 / rho and pi L2 / rho^2, which is never negative, (N,2)."""
        sin_i, sin_o = np.hypot(wi[:, 0], wi[:, 1]), np.hypot(wo[:, 0], wo[:, 1])
        theta_i, theta_o = np.arctan2(sin_i, wi[:, 2]), np.arctan2(sin_o, wo[:, 2])
        alpha, beta = np.maximum(theta_i, theta_o), np.minimum(theta_i, theta_o)
        across = sin_i * sin_o
        # At the pole cos(phi) is anything: beta = 0 takes every term with it.
        cos_phi = np.divide(
            wi[:, 0] * wo[:, 0] + wi[:, 1] * wo[:, 1], across, out=np.zeros_like(across), where=across > 0
        )
        cos_phi = np.clip(cos_phi, -1.0, 1.0)
        s2 = self.sigma**2
        c1 = 1.0 - 0.5 * s2 / (s2 + 0.33)
        bend = beta * (2.0 / np.pi)
        c2 = 0.45 * (np.maximum(sin_i, sin_o) - np.where(cos_phi < 0, bend**3, 0.0))
        c3 = 0.125 * (alpha * beta * (4.0 / np.pi**2)) ** 2
        # Tangents from sines and cosines: near grazing the angle has lost the digits of the cosine.
        tan_beta = np.minimum(sin_i / wi[:, 2], sin_o / wo[:, 2])
        tan_mean = (sin_i + sin_o) / (wi[:, 2] + wo[:, 2])
        shape = cos_phi * c2 * tan_beta + (1.0 - np.abs(cos_phi)) * c3 * tan_mean
        direct = c1 + s2 / (s2 + 0.09) * shape
        between = 0.17 * s2 / (s2 + 0.13) * (1.0 - cos_phi * bend**2)
        return np.stack([direct, between], axis=-1)


def _between(nodes: np.ndarray, weights: np.ndarray, ends: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Compute Gauss-Legendre nodes and weights of [-1, 1] in each interval between `ends`."""
    halves = [(0.5 * (high + low), 0.5 * (high - low)) for low, high in pairwise(ends)]
    points, shares = ([middle + half * nodes for middle, half in halves], [half * weights for _, half in halves])
    return np.concatenate(points), np.concatenate(shares)
