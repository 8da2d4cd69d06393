"""OpenPBR 1.1 (Academy Software Foundation), as far as uniform opaque surfaces need it, in red, green and blue."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ..analytic.cook_torrance import fresnel, ggx, smith_ggx

# Half vectors by which the albedo of facets is integrated, polar and azimuth, and cosines at which it is.
_TILTS, _TURNS = 32, 32
_COSINES = np.linspace(0.02, 1.0, 50)
# Constants of Fujii's form of Oren's and Nayar's model, and of its albedo.
_FUJII_1, _FUJII_2 = 0.5 - 2.0 / (3.0 * np.pi), 2.0 / 3.0 - 28.0 / (15.0 * np.pi)
# Cosine of the second colour of a metal, at 82 degrees.
_EDGE_COSINE = 1.0 / 7.0


@dataclass(frozen=True, eq=False)
class OpenPbr:
    """A metal, or a matt body under facets, under a coat; names and ranges are OpenPBR's.

        matt  : Oren's and Nayar's surface as Fujii has it, with what its walls send to another (`rough_body`)
        metal : F D G / (4 cos(theta_i) cos(theta_o)),  F between base_color, specular_color at 82 degrees and 1
        body  : F D G / (4 cos(theta_i) cos(theta_o)) + (1 - E(theta_o)) matt,  F of specular_ior
        coat  : w Fc Dc Gc / (4 cos(theta_i) cos(theta_o)) + (1 - w Ec(theta_o)) times what is below

    D is GGX with alpha = roughness^2, G the product of Smith's one-sided terms, E the albedo of the facets above.
    Interreflection between facets is lost here, as in Metamer's models; renderers may add it.
    """

    base_color: tuple[float, float, float]
    base_diffuse_roughness: float = 0.0
    base_metalness: float = 0.0
    specular_weight: float = 1.0
    specular_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    specular_roughness: float = 0.3
    specular_ior: float = 1.5
    coat_weight: float = 0.0
    coat_roughness: float = 0.0
    coat_ior: float = 1.5
    coat_darkening: float = 0.0

    def eval(self, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Evaluate f_r for red, green and blue, 1/sr; both directions above the surface."""
        base = np.asarray(self.base_color)
        cosine, facets = _half_cosine(wi, wo), _facets(wi, wo, self._alpha)[:, None]
        if self.base_metalness:
            out = facets * metal_fresnel(cosine, base, np.asarray(self.specular_color))
        else:
            out = rough_body(wi, wo, base, self.base_diffuse_roughness)
            if self.specular_weight:
                out = self._let_through(wo, self.specular_ior, self._alpha) * out
                out += facets * _dielectric(cosine, self.specular_ior)
        if self.coat_weight:
            alpha = self.coat_roughness**2
            below = 1.0 - self.coat_weight * (1.0 - self._let_through(wo, self.coat_ior, alpha))
            out = out * below
            out += self.coat_weight * _facets(wi, wo, alpha)[:, None] * _dielectric(cosine, self.coat_ior)
        return out

    @cached_property
    def _alpha(self) -> float:
        """Roughness of the base under its coat, which spreads what passes through it."""
        fourth = self.specular_roughness**4
        spread = min(1.0, fourth + 2.0 * self.coat_roughness**4) ** 0.25
        return float(((1.0 - self.coat_weight) * self.specular_roughness + self.coat_weight * spread) ** 2)

    def _let_through(self, wo: np.ndarray, ior: float, alpha: float) -> Float[np.ndarray, "N 1"]:
        return 1.0 - np.interp(wo[:, 2], _COSINES, dielectric_albedo(_COSINES, ior, alpha))[:, None]


def rough_body(
    wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"], colour: Float[np.ndarray, " C"], roughness: float
) -> Float[np.ndarray, "N C"]:
    """Evaluate f_r of a matt body.

    Portsmouth, Kutz and Hill, "EON: a practical energy-preserving rough diffuse BRDF", 2024.
    """
    scale = 1.0 / (1.0 + _FUJII_1 * roughness)
    apart = (wi * wo).sum(axis=1) - wi[:, 2] * wo[:, 2]
    apart = np.where(apart > 0.0, apart / np.maximum(wi[:, 2], wo[:, 2]), apart)
    single = (scale * (1.0 + roughness * apart))[:, None] * colour
    if not roughness:
        return single / np.pi
    mean = scale * (1.0 + _FUJII_2 * roughness)
    lost = (1.0 - _body_albedo(wi[:, 2], roughness)) * (1.0 - _body_albedo(wo[:, 2], roughness)) / (1.0 - mean)
    return (single + lost[:, None] * (colour**2 * mean / (1.0 - colour * (1.0 - mean)))) / np.pi


def _body_albedo(cosine: np.ndarray, roughness: float) -> np.ndarray:
    """Evaluate the albedo of white walls without interreflection, by the cosine of the light."""
    cosine = np.clip(cosine, 1e-6, 1.0)
    sine = np.sqrt(1.0 - cosine**2)
    bent = sine * (np.arccos(cosine) - sine * cosine) + 2.0 / 3.0 * (sine / cosine * (1.0 - sine**3) - sine)
    return (1.0 + roughness * bent / np.pi) / (1.0 + _FUJII_1 * roughness)


def metal_fresnel(
    cosine: Float[np.ndarray, " N"], normal: Float[np.ndarray, " C"], tint: Float[np.ndarray, " C"]
) -> Float[np.ndarray, "N C"]:
    """Evaluate a metal's Fresnel term: Schlick's from `normal` to 1, times `tint` at 82 degrees (Kutz et al. 2021)."""
    fall = 1.0 - cosine[:, None]
    lack = schlick_at_edge(normal) * (1.0 - tint) / (_EDGE_COSINE * (1.0 - _EDGE_COSINE) ** 6)
    return np.clip(normal + (1.0 - normal) * fall**5 - lack * cosine[:, None] * fall**6, 0.0, 1.0)


def schlick_at_edge(normal: Float[np.ndarray, " C"]) -> Float[np.ndarray, " C"]:
    """Schlick's reflectance at 82 degrees."""
    return normal + (1.0 - normal) * (1.0 - _EDGE_COSINE) ** 5


def edge_reflectance(eta: Float[np.ndarray, " L"], k: Float[np.ndarray, " L"]) -> Float[np.ndarray, "2 L"]:
    """Reflectance of n + ik at the normal and at 82 degrees."""
    cos2 = np.array([1.0, _EDGE_COSINE**2])
    return fresnel(cos2, 1.0 - cos2, eta, k)


def dielectric_albedo(cosines: Float[np.ndarray, " n"], ior: float, alpha: float) -> Float[np.ndarray, " n"]:
    """Compute the fraction of light from directions of these cosines that rough facets of an index reflect.

    Half vectors by their distribution, tan^2(theta_h) = alpha^2 u / (1 - u) with u in [0, 1].
    """
    u, share = np.polynomial.legendre.leggauss(_TILTS)
    u, share = 0.5 * (u + 1.0), 0.5 * share
    tilt = np.arctan(alpha * np.sqrt(u / (1.0 - u)))[:, None]
    turn = (np.arange(_TURNS) + 0.5) * (2.0 * np.pi / _TURNS)
    h = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt) + 0.0 * turn], axis=-1)
    h, share = h.reshape(-1, 3), np.repeat(share / _TURNS, _TURNS)
    found = np.empty(len(cosines))
    for at, cosine in enumerate(cosines):
        wi = np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine])
        along = np.minimum(h @ wi, 1.0)
        wo = 2.0 * along[:, None] * h - wi
        seen = (along > 0.0) & (wo[:, 2] > 0.0)
        masked = smith_ggx(np.broadcast_to(wi, wo[seen].shape), alpha) * smith_ggx(wo[seen], alpha)
        flow = _dielectric(along[seen], ior)[:, 0] * masked * wo[seen, 2] * 4.0 * along[seen] / h[seen, 2]
        found[at] = share[seen] @ flow
    return found


def _half_cosine(wi: np.ndarray, wo: np.ndarray) -> Float[np.ndarray, " N"]:
    """Compute the cosine between light and half vector."""
    h = wi + wo
    return np.minimum(0.5 * np.sqrt((h * h).sum(axis=1)), 1.0)


def _facets(wi: np.ndarray, wo: np.ndarray, alpha: float) -> Float[np.ndarray, " N"]:
    """Evaluate D G / (4 cos(theta_i) cos(theta_o))."""
    h = wi + wo
    length2 = (h * h).sum(axis=1)
    density = ggx(h[:, 2] ** 2 / length2, (h[:, 0] ** 2 + h[:, 1] ** 2) / length2, alpha)
    return density * smith_ggx(wi, alpha) * smith_ggx(wo, alpha)


def _dielectric(cosine: np.ndarray, ior: float) -> Float[np.ndarray, "N 1"]:
    """Evaluate Fresnel's reflectance at these cosines of the half vector."""
    cos2 = cosine**2
    return fresnel(cos2, 1.0 - cos2, np.array([ior]), np.array([0.0]))
