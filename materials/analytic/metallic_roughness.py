"""The material of game engines and glTF files: facets with Schlick's Fresnel term over a matt body, under a coat."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from ...spectral.spectrum import Spectrum
from ..core.brdf import Lobe
from ..core.surface import SumOfTerms
from .cook_torrance import ggx, smith_ggx
from .model import AnalyticBrdf, ModelPart, in_domain

# F0 of the coat, whose refractive index is 1.5.
_COAT_F0 = 0.04


@dataclass(frozen=True, eq=False)
class MetallicRoughness(AnalyticBrdf):
    """The BRDF of glTF 2.0 (Khronos 2021, appendix B.3.5), with its extensions specular and clearcoat.

        F(c) = f0 + (f90 - f0) (1 - c)^5,   c = h.wi           Schlick, between F at the normal and at grazing
        base = (1 - F) rho/pi + F D_a G_a / (4 cos(theta_i) cos(theta_o))
        f_r  = (1 - w Fc) base + w Fc D_b G_b / (4 cos(theta_i) cos(theta_o)),   Fc = 0.04 + 0.96 (1 - c)^5

    D is GGX with alpha a of the surface and b of the coat, G the product of Smith's two one-sided terms. A metal has
    rho = 0 and its colour in f0; a plastic has its colour in rho and f0 = 0.04.

    The extension evaluates the coat's Fresnel term at the viewer's angle, which is not reciprocal; here it is that of
    the half vector, as in the base. Facets attenuate the body at the half vector only: a white, smooth surface reflects
    up to 1.9 times the grazing light.

    Parameters
    ----------
    diffuse : rho, (L,) in [0, 1].
    specular : f0, (L,) in [0, 1].
    edge : f90 in [0, 1].
    alpha, coat_alpha : a and b in (0, 1]; glTF's roughness is their square root.
    coat : w in [0, 1]; 0 is no coat.
    """

    NAME: ClassVar[str] = "metallic_roughness"
    ALBEDO_BOUND: ClassVar[float] = 1.95
    isotropic = True

    diffuse: Spectrum
    specular: Spectrum
    edge: float = field(metadata=in_domain(0.0, 1.0))
    alpha: float = field(metadata=in_domain(0.0, 1.0, open_low=True))
    coat: float = field(default=0.0, metadata=in_domain(0.0, 1.0))
    coat_alpha: float = field(default=1.0, metadata=in_domain(0.0, 1.0, open_low=True))

    def __post_init__(self) -> None:
        body, f0 = self._checked_reflectance("diffuse"), self._checked_reflectance("specular")
        self._check_numbers()
        # Coefficients of 1 and of (1 - c)^5.
        self._set(_facet=np.stack([f0, self.edge - f0]))
        self._set(_under=np.stack([(1.0 - f0) * body, (f0 - self.edge) * body]) / np.pi)

    @classmethod
    def examples(cls, wavelengths_nm: np.ndarray) -> tuple[AnalyticBrdf, ...]:
        """Make examples from polished metal to matt, coated and black, for tests of what every model must keep."""
        ramp = np.linspace(0.0, 1.0, len(wavelengths_nm))
        up, black, low = (Spectrum.sampled(wavelengths_nm, values) for values in (ramp, 0.0 * ramp, 0.04 + 0.0 * ramp))
        return (
            cls(up, low, 1.0, 0.25),
            cls(black, up, 1.0, 0.02),
            cls(up, low, 1.0, 1.0, 1.0, 0.04),
            cls(up, black, 0.0, 0.5),
            cls(up, up, 1.0, 0.002, 0.5, 0.5),
        )

    def lobes(self) -> tuple[Lobe, ...]:
        """Body, facets and coat, all in half/difference angles, where the body depends on theta_d alone."""
        one = np.ones((1, len(self.wavelengths_nm)))
        over = (self.coat,)
        parts = [
            (self._body, SumOfTerms(self._under_terms, self._under, (self.NAME, "body", *over))),
            (self._facets, SumOfTerms(self._facet_terms, self._facet, (self.NAME, "facets", *over, self.alpha))),
        ]
        if self.coat > 0.0:
            coat = SumOfTerms(self._coat_terms, one, (self.NAME, "coat", *over, self.coat_alpha))
            parts.append((self._coat, coat))
        return tuple(Lobe("hd", ModelPart(self.wavelengths_nm, True, whole, folded)) for whole, folded in parts)

    def _eval_lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        out = self._body(wi, wo)
        out += self._facets(wi, wo)
        if self.coat > 0.0:
            out += self._coat(wi, wo)
        return out

    def _body(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return self._under_terms(wi, wo) @ self._under

    def _facets(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return self._facet_terms(wi, wo) @ self._facet

    def _coat(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.repeat(self._coat_terms(wi, wo), len(self.wavelengths_nm), axis=1)

    def _under_terms(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Evaluate the factors of the spectra of `_under`, (N,2)."""
        fall = schlick(wi, wo)
        through = self._through(fall)
        return np.stack([through, through * fall], axis=-1)

    def _facet_terms(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Evaluate the factors of the spectra of `_facet`, (N,2)."""
        fall = schlick(wi, wo)
        geometry = self._through(fall) * _facet_geometry(wi, wo, self.alpha)
        return np.stack([geometry, geometry * fall], axis=-1)

    def _coat_terms(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """(N,1)."""
        reflected = self.coat * (_COAT_F0 + (1.0 - _COAT_F0) * schlick(wi, wo))
        return (reflected * _facet_geometry(wi, wo, self.coat_alpha))[:, None]

    def _through(self, fall: np.ndarray) -> np.ndarray:
        """Compute the coat's transmission, 1 - w Fc, (N,)."""
        return 1.0 - self.coat * (_COAT_F0 + (1.0 - _COAT_F0) * fall)


def schlick(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Compute (1 - h.wi)^5, (N,); from |wi - wo| = 2 sin, so that it does not cancel near retro-reflection."""
    h, d = wi + wo, wi - wo
    cos = 0.5 * np.sqrt(np.sum(h * h, axis=-1))
    return (0.25 * np.sum(d * d, axis=-1) / (1.0 + cos)) ** 5


def _facet_geometry(wi: np.ndarray, wo: np.ndarray, alpha: float) -> np.ndarray:
    """Compute D G / (4 cos(theta_i) cos(theta_o)), (N,)."""
    h = wi + wo
    length2 = np.sum(h * h, axis=-1)
    density = ggx(h[:, 2] ** 2 / length2, (h[:, 0] ** 2 + h[:, 1] ** 2) / length2, alpha)
    return density * smith_ggx(wi, alpha) * smith_ggx(wo, alpha)
