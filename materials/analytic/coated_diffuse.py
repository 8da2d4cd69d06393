"""Gloss and satin paints, varnish, plastics: a clear coat with the Fresnel reflectance of its index on a matt body."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from ...runtime.errors import InputError
from ...spectral.spectrum import Spectrum
from ..core.brdf import Lobe
from ..core.surface import SumOfTerms
from .cook_torrance import beckmann, smith_beckmann
from .instrument import Instrument, ReadBrdf, not_stated
from .model import AnalyticBrdf, ModelPart, in_domain

# Nodes of the albedo of the coat: polar and azimuth of the half vector.
_TILTS, _TURNS = 64, 64


@dataclass(frozen=True, eq=False)
class CoatedDiffuse(ReadBrdf):
    """A rough dielectric surface over a Lambertian body, coupled as Saunderson has it.

        f_r = F(h.wi) D G / (4 cos(theta_i) cos(theta_o)) + T(theta_i) T(theta_o) q / pi
        q   = rho / (n^2 (1 - R rho)),   T = 1 - F,   R = 1 - (1 - F_d) / n^2

    F is Fresnel's reflectance of unpolarised light (Born and Wolf, Principles of Optics, section 1.5), D is Beckmann's
    and G the product of Smith's two one-sided terms (Walter et al., EGSR 2007, eq. 25 and 27). Light transmitted at the
    angle of the light is scattered by the body in all directions; the surface reflects R of it back to the body,
    repeatedly, and transmits the rest at the angle of the viewer (Saunderson, "Calculation of the color of pigmented
    plastics", JOSA 32, 1942). F_d is the reflectance for uniform light from outside (Walsh 1926; Duntley, "The optical
    properties of diffusing materials", JOSA 32, 1942, eq. 30).

    A smooth coat over a white body reflects all light. Tilted facets of a rough one reflect, on average, slightly more
    than F of the whole surface: at most 1.003 times the light leaves. Near grazing, interreflection between facets is
    lost.

    Parameters
    ----------
    diffuse : rho of the body as light within the coat meets it, (L,) in [0, 1]; `reads` has it from a measurement.
    index : refractive index n of the coat, in [1.2, 3]; binders of paints have 1.5.
    roughness : m, the root mean square slope, in (0, 1].
    """

    NAME: ClassVar[str] = "coated_diffuse"
    READ: ClassVar[str] = "diffuse"
    ALBEDO_BOUND: ClassVar[float] = 1.003
    isotropic = True

    diffuse: Spectrum
    index: float = field(metadata=in_domain(1.2, 3.0))
    roughness: float = field(metadata=in_domain(0.0, 1.0, open_low=True))

    def __post_init__(self) -> None:
        rho = self._checked_reflectance("diffuse")
        self._check_numbers()
        n2 = self.index**2
        returned = 1.0 - (1.0 - diffuse_fresnel(self.index)) / n2
        self._set(_body=rho / (n2 * (1.0 - returned * rho)), _returned=returned)

    @classmethod
    def examples(cls, wavelengths_nm: np.ndarray) -> tuple[AnalyticBrdf, ...]:
        """Coats from polished to dull over bodies from black to white, for tests of what every model must keep."""
        ramp = Spectrum.sampled(wavelengths_nm, np.linspace(0.0, 1.0, len(wavelengths_nm)))
        pairs = ((1.5, 0.016), (1.5, 0.06), (1.2, 1.0), (3.0, 0.3), (1.5, 0.002))
        return tuple(cls(ramp, *pair) for pair in pairs)

    def reads(self, reading: Spectrum, geometry: str) -> CoatedDiffuse:
        """Find the body with which an instrument reads a spectrum of this coat over it.

        Parameters
        ----------
        reading : reflectance factor of the whole, on any wavelengths.
        geometry : "45:0", "di:8" or "de:8" in any of their notations. A sphere that excludes the specular component is
            assumed to lose all of the coat's own reflection.

        Raises
        ------
        InputError : another geometry, or readings that no body in [0, 1] gives under this coat.
        """
        coat, through = self._read_at(geometry)
        # The body's q, of which rho is the inverse.
        q = (reading.samples - coat) / through
        n2 = self.index**2
        whitest = 1.0 / (n2 * (1.0 - self._returned))
        for bad, words in (
            (q < 0.0, "darker than the coat alone"),
            (q > whitest, "brighter than white under the coat"),
        ):
            if bad.any():
                at = int(np.argmax(bad))
                raise InputError(
                    words,
                    field="diffuse",
                    found=f"{reading.samples[at]:.4g} at {reading.wavelengths_nm[at]:g} nm, read at {geometry}",
                    expected=f"{coat:.4g} to {coat + through * whitest:.4g} with index {self.index:g} and "
                    f"roughness {self.roughness:g}",
                    hint="another index or roughness, or the geometry of the instrument that read it",
                )
        rho = np.minimum(n2 * q / (1.0 + n2 * self._returned * q), 1.0)
        return replace(self, diffuse=Spectrum.sampled(reading.wavelengths_nm, rho, "reflectance"))

    def _read_at(self, geometry: str) -> tuple[float, float]:
        """Return the reading of the coat alone, and that of a body of q = 1."""
        found = Instrument.of(geometry)
        if found.sphere_deg is None:
            wi, wo = np.sqrt([[0.5, 0.0, 0.5]]), np.array([[0.0, 0.0, 1.0]])
            return float(np.pi * self._facets(wi, wo)[0, 0]), float(self._let_through(wi, wo)[0, 0])
        if found.included is None:
            raise not_stated(geometry)
        cosine = np.cos(np.radians(found.sphere_deg))
        body = float(self._through(cosine) * (1.0 - diffuse_fresnel(self.index)))
        return (self._coat_albedo(cosine) if found.included else 0.0), body

    def _coat_albedo(self, cosine: float) -> float:
        """Compute the fraction of light from one direction that the coat reflects into the hemisphere.

        Half vectors by their distribution, tan^2(theta_h) = -m^2 log(1 - u) with u in [0, 1].
        """
        u, share = np.polynomial.legendre.leggauss(_TILTS)
        u, share = 0.5 * (u + 1.0), 0.5 * share
        tilt = np.arctan(self.roughness * np.sqrt(-np.log1p(-u)))[:, None]
        turn = (np.arange(_TURNS) + 0.5) * (2.0 * np.pi / _TURNS)
        h = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt) + 0.0 * turn], axis=-1)
        h, share = h.reshape(-1, 3), np.repeat(share / _TURNS, _TURNS)
        wi = np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine])
        along = h @ wi
        wo = 2.0 * along[:, None] * h - wi
        seen = (along > 0.0) & (wo[:, 2] > 0.0)
        h, along, wo = h[seen], along[seen], wo[seen]
        facets = smith_beckmann(np.broadcast_to(wi, wo.shape), self.roughness) * smith_beckmann(wo, self.roughness)
        flow = (1.0 - self._through(np.minimum(along, 1.0))) * facets * wo[:, 2] * 4.0 * along / h[:, 2]
        return float(share[seen] @ flow)

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the body in incident/outgoing angles, the coat in half/difference angles."""
        kind = (self.NAME, self.index)
        body = SumOfTerms(self._let_through, self._body[None] / np.pi, (*kind, "body"))
        coat = SumOfTerms(self._facets, np.ones((1, len(self.wavelengths_nm))), (*kind, "coat", self.roughness))
        return (
            Lobe("io", ModelPart(self.wavelengths_nm, True, self._under, body)),
            Lobe("hd", ModelPart(self.wavelengths_nm, True, self._coat, coat)),
        )

    def _eval_lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        out = self._under(wi, wo)
        out += self._facets(wi, wo)
        return out

    def _under(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return self._let_through(wi, wo) * (self._body / np.pi)

    def _coat(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.repeat(self._facets(wi, wo), len(self.wavelengths_nm), axis=1)

    def _let_through(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Evaluate the transmission into the coat at one angle and out at the other, (N,1)."""
        return (self._through(wi[:, 2]) * self._through(wo[:, 2]))[:, None]

    def _facets(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Evaluate the coat's own reflection, equal at every wavelength, (N,1)."""
        h = wi + wo
        length2 = np.sum(h * h, axis=-1)
        density = beckmann(h[:, 2] ** 2 / length2, (h[:, 0] ** 2 + h[:, 1] ** 2) / length2, self.roughness)
        density *= smith_beckmann(wi, self.roughness) * smith_beckmann(wo, self.roughness)
        # |wi + wo| = 2 h.wi
        density *= 1.0 - self._through(np.minimum(0.5 * np.sqrt(length2), 1.0))
        return density[:, None]

    def _through(self, cosine: np.ndarray) -> np.ndarray:
        """Compute Fresnel's transmittance of unpolarised light, (N,).

        With a = sqrt(n^2 - sin^2) it is the mean of 4 a cos / (a + cos)^2 and 4 n^2 a cos / (a + n^2 cos)^2, which does
        not cancel at grazing angles.
        """
        n2 = self.index**2
        a = np.sqrt((self.index - 1.0) * (self.index + 1.0) + cosine * cosine)
        return 2.0 * a * cosine * (1.0 / (a + cosine) ** 2 + n2 / (a + n2 * cosine) ** 2)


def diffuse_fresnel(index: float) -> float:
    """Compute the reflectance of a smooth surface of index n > 1 for uniform light from outside (Duntley, eq. 30).

    >>> round(diffuse_fresnel(1.5), 5)
    0.09178
    """
    n, n2 = index, index**2
    n4 = n2 * n2
    return float(
        0.5
        + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0) ** 2)
        + n2 * (n2 - 1.0) ** 2 / (n2 + 1.0) ** 3 * np.log((n - 1.0) / (n + 1.0))
        - 2.0 * n * n2 * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
        + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0) ** 2) * np.log(n)
    )
