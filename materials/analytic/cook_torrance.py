"""Rough metals and plastics: microfacets with the Fresnel reflectance of a complex refractive index."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from ...spectral.spectrum import Spectrum
from ..core.brdf import Lobe
from ..core.surface import Directed, constant_term
from .model import AnalyticBrdf, ModelPart, in_domain

# Cells of a folded Fresnel term along the cosine, and how far off a straight line in one may be: as float32 rounds.
_FOLDED_CELLS, _FOLDED_OFF = 16384, 6e-8


@dataclass(frozen=True, eq=False)
class CookTorrance(AnalyticBrdf):
    """Cook and Torrance, "A reflectance model for computer graphics", ACM Transactions on Graphics 1(1), 1982.

        f_r = s R_s + d R_d,   s + d = 1,   R_d = rho/pi,   R_s = F D G / (4 cos(theta_i) cos(theta_o))

    F is the exact Fresnel reflectance of unpolarised light from n + ik at each wavelength, at the angle between light
    and half vector. The paper divides by pi where this divides by 4: once D is normalised so that the facets' projected
    areas sum to 1, the 4 is that of the solid angle of the mirrored direction, 4 (h.wo) times the half vector's
    (Walter, Marschner, Li and Torrance, "Microfacet models for refraction through rough surfaces", EGSR 2007, eq. 20).
    With pi, a smooth perfect mirror would return 4/pi = 1.27 times the light.

    Distributions D: "beckmann", the paper's (Walter eq. 25), and "ggx" (Walter eq. 33). Masking G: "v_cavity", the
    paper's min(1, 2 (n.h)(n.wo)/(wo.h), 2 (n.h)(n.wi)/(wo.h)), and "smith", the product of two one-sided terms, exact
    for GGX (Walter eq. 34), his rational approximation for Beckmann (eq. 27; good to 0.35 %).

    Parameters
    ----------
    diffuse : rho of the body under the surface, (L,) in [0, 1]; without effect if specular_weight is 1.
    eta, k : refractive index n > 0 and extinction coefficient k >= 0, (L,) on the wavelengths of `diffuse`.
    roughness : m, the root mean square slope (Beckmann) or alpha (GGX), in (0, 1].
    specular_weight : s in [0, 1]; 1 for a bare metal.
    """

    NAME: ClassVar[str] = "cook_torrance"
    CHOICES: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "distribution": ("beckmann", "ggx"),
        "masking": ("v_cavity", "smith"),
    }
    isotropic = True

    diffuse: Spectrum
    eta: np.ndarray
    k: np.ndarray
    roughness: float = field(metadata=in_domain(0.0, 1.0, open_low=True))
    specular_weight: float = field(metadata=in_domain(0.0, 1.0))
    distribution: str = "beckmann"
    masking: str = "v_cavity"

    def __post_init__(self) -> None:
        rho = self._checked_reflectance("diffuse")
        self._set(eta=self._checked_spectral("eta", 0.0, open_low=True), k=self._checked_spectral("k", 0.0))
        self._check_numbers()
        self._set(**{name: self._checked_choice(name) for name in self.CHOICES})
        self._set(_body=(1.0 - self.specular_weight) * rho / np.pi)

    @classmethod
    def examples(cls, wavelengths_nm: np.ndarray) -> tuple[AnalyticBrdf, ...]:
        """Metals and plastics of each distribution and masking, for tests of what every model must keep."""
        ramp = np.linspace(0.0, 1.0, len(wavelengths_nm))
        body = Spectrum.sampled(wavelengths_nm, ramp)
        metal, plastic = (0.2 + 1.3 * ramp, 3.6 - 1.7 * ramp), (1.49 + 0.02 * ramp, 0.0 * ramp)
        return (
            cls(body, *metal, 0.2, 1.0),
            cls(body, *plastic, 0.35, 0.4, masking="smith"),
            cls(body, *metal, 1.0, 1.0, "ggx", "smith"),
            cls(body, *plastic, 0.05, 0.5, "ggx", "v_cavity"),
            cls(body, *metal, 0.002, 1.0, masking="smith"),
        )

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the body in incident/outgoing angles and the facets in half/difference angles, if they have weight."""
        parts = []
        if self.specular_weight < 1.0:
            body = constant_term(self._body)
            parts.append(Lobe("io", ModelPart(self.wavelengths_nm, True, self._diffuse, body)))
        if self.specular_weight > 0.0:
            parts.append(Lobe("hd", ModelPart(self.wavelengths_nm, True, self._facets, self._folded_facets)))
        return tuple(parts)

    def _eval_lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        out = self._facets(wi, wo)
        if self.specular_weight < 1.0:
            out += self._body
        return out

    def _diffuse(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.broadcast_to(self._body, (len(wi), len(self._body)))

    def _facets(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return self._reflected(wi, wo, lambda cos2, sin2: fresnel(cos2, sin2, self.eta, self.k), len(self._body))

    def _folded_facets(self, weights: np.ndarray) -> Directed:
        """Fold Fresnel's term of every wavelength into a function of the cosine alone; see `ModelPart.folded`."""
        folded = FoldedFresnel(self.eta, self.k, weights)
        return partial(self._reflected, fresnel_term=folded, columns=weights.shape[1])

    def _reflected(self, wi: np.ndarray, wo: np.ndarray, fresnel_term: Directed, columns: int) -> np.ndarray:
        """Multiply the facets by `fresnel_term(cos^2, sin^2)` (N, columns)."""
        h, d = wi + wo, wi - wo
        # h and d are the diagonals of a rhombus of side 1: |h| = 2 cos(theta_d), |d| = 2 sin(theta_d).
        cos2_d = 0.25 * (h[:, 0] ** 2 + h[:, 1] ** 2 + h[:, 2] ** 2)
        sin2_d = 0.25 * (d[:, 0] ** 2 + d[:, 1] ** 2 + d[:, 2] ** 2)
        cos2_h = 0.25 * h[:, 2] ** 2 / cos2_d
        sin2_h = 0.25 * (h[:, 0] ** 2 + h[:, 1] ** 2) / cos2_d
        density = beckmann if self.distribution == "beckmann" else ggx
        geometry = self.specular_weight * density(cos2_h, sin2_h, self.roughness)
        out = np.zeros((len(wi), columns))
        # Most directions miss a narrow highlight altogether: its exponential is zero, and Fresnel is what costs.
        seen = np.flatnonzero(geometry > 0.0)
        if len(seen):
            if self.masking == "v_cavity":
                masked = v_cavity(wi[seen, 2], wo[seen, 2], np.sqrt(cos2_h[seen] / cos2_d[seen]))
            else:
                one_sided = smith_beckmann if self.distribution == "beckmann" else smith_ggx
                masked = one_sided(wi[seen], self.roughness) * one_sided(wo[seen], self.roughness)
            out[seen] = fresnel_term(cos2_d[seen], sin2_d[seen])
            out[seen] *= (geometry[seen] * masked)[:, None]
        return out


def fresnel(cos2: np.ndarray, sin2: np.ndarray, eta: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Compute the reflectance (N,L) of unpolarised light from n + ik (L,) at angles of cos^2 and sin^2 (N,).

    With a + ib = sqrt((n + ik)^2 - sin^2), by its squares so that nothing is complex (Born and Wolf, Principles of
    Optics, section 14.2):

        R_s = |cos - (a + ib)|^2 / |cos + (a + ib)|^2
        R_p = R_s |a cos - sin^2 + ib cos|^2 / |a cos + sin^2 + ib cos|^2
    """
    cos, cos2, sin2 = np.sqrt(cos2)[:, None], cos2[:, None], sin2[:, None]
    real = (eta * eta - k * k) - sin2
    modulus = np.sqrt(real * real + 4.0 * (eta * k) ** 2)
    b2 = 0.5 * (modulus - real)
    a = np.sqrt(0.5 * (modulus + real))
    across = (a - cos) ** 2
    across += b2
    whole = (a + cos) ** 2
    whole += b2
    a *= cos
    b2 *= cos2
    along = (a - sin2) ** 2
    along += b2
    under = (a + sin2) ** 2
    under += b2
    # (R_s + R_p) / 2 = R_s (1 + along/under) / 2, over one division.
    along += under
    along *= across
    whole *= under
    along /= whole
    along *= 0.5
    return along


class FoldedFresnel:
    """`fresnel` times weights (L,C), a function of the cosine alone, as a table.

    There are enough nodes that linear interpolation is within `_FOLDED_OFF` of the largest value, as verified half-way
    between nodes. If a refractive index causes a kink, as at total reflection, every wavelength is evaluated instead.
    """

    def __init__(self, eta: np.ndarray, k: np.ndarray, weights: Float[np.ndarray, "L C"]) -> None:
        self._eta, self._k, self._weights = eta, k, weights
        cos = np.arange(2 * _FOLDED_CELLS + 1) / (2 * _FOLDED_CELLS)
        found = self._exact(cos**2, (1.0 - cos) * (1.0 + cos))
        nodes, middles = found[::2], found[1::2]
        off = np.abs(0.5 * (nodes[1:] + nodes[:-1]) - middles).max()
        # Slopes beside nodes: a cell's numbers are fetched together.
        kinked = off > _FOLDED_OFF * np.abs(found).max()
        self._table = None if kinked else np.concatenate([np.diff(nodes, axis=0), nodes[:-1]], axis=1)

    def _exact(self, cos2: np.ndarray, sin2: np.ndarray) -> np.ndarray:
        step = 2048
        each = range(0, len(cos2), step)
        rows = [fresnel(cos2[i : i + step], sin2[i : i + step], self._eta, self._k) @ self._weights for i in each]
        return np.concatenate(rows)

    def __call__(self, cos2: np.ndarray, sin2: np.ndarray) -> np.ndarray:
        """Evaluate the folded reflectance, (N,C)."""
        if self._table is None:
            return self._exact(cos2, sin2)
        place = np.minimum(np.sqrt(cos2), 1.0) * _FOLDED_CELLS
        cell = np.minimum(place.astype(np.intp), _FOLDED_CELLS - 1)
        columns = self._weights.shape[1]
        found = self._table.take(cell, axis=0)
        out = found[:, :columns] * (place - cell)[:, None]
        out += found[:, columns:]
        return out


def beckmann(cos2_h: np.ndarray, sin2_h: np.ndarray, roughness: float) -> np.ndarray:
    """Evaluate D in 1/sr of Gaussian slopes: exp(-tan^2/m^2) / (pi m^2 cos^4) (Walter et al. 2007, eq. 25)."""
    tan2 = sin2_h / cos2_h
    # 1/cos^2 = 1 + tan^2
    return np.exp(-tan2 / roughness**2) * (1.0 + tan2) ** 2 / (np.pi * roughness**2)


def ggx(cos2_h: np.ndarray, sin2_h: np.ndarray, roughness: float) -> np.ndarray:
    """Evaluate D in 1/sr: m^2 / (pi cos^4 (m^2 + tan^2)^2) (Walter et al. 2007, eq. 33)."""
    return roughness**2 / (np.pi * (cos2_h * roughness**2 + sin2_h) ** 2)


def v_cavity(cos_i: np.ndarray, cos_o: np.ndarray, cos_h_over_cos_d: np.ndarray) -> np.ndarray:
    """Evaluate G / (4 cos_i cos_o) of the 1982 paper, with the cosines cancelled: finite at grazing angles."""
    return np.minimum(0.25 / (cos_i * cos_o), 0.5 * cos_h_over_cos_d / np.maximum(cos_i, cos_o))


def smith_ggx(w: np.ndarray, roughness: float) -> np.ndarray:
    """Evaluate G1 / (2 cos) of GGX for w (N,3) (Walter et al. 2007, eq. 34), the cosine cancelled."""
    return 1.0 / (w[:, 2] + np.hypot(w[:, 2], roughness * np.hypot(w[:, 0], w[:, 1])))


def smith_beckmann(w: np.ndarray, roughness: float) -> np.ndarray:
    """Evaluate G1 / (2 cos) of Beckmann for w (N,3) by the rational approximation (Walter et al. 2007, eq. 27).

    With a = 1 / (m tan): (3.535 a + 2.181 a^2) / (1 + 2.276 a + 2.577 a^2) below a = 1.6, else 1.
    """
    cos, slope = w[:, 2], roughness * np.hypot(w[:, 0], w[:, 1])
    masked = cos < 1.6 * slope
    # a / cos = 1 / slope is the limit that keeps grazing angles finite; rows that are not masked divide by cos.
    scale = np.where(masked, slope, cos)
    a = cos / scale
    partly = (3.535 + 2.181 * a) / (1.0 + 2.276 * a + 2.577 * a * a)
    return 0.5 * np.where(masked, partly, 1.0) / scale
