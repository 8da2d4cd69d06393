"""Glossy coats over a diffuse base, with round or stretched highlights."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from ...spectral.spectrum import Spectrum
from ..core.brdf import Lobe
from ..core.surface import SumOfTerms
from .model import AnalyticBrdf, ModelPart, in_domain


@dataclass(frozen=True, eq=False)
class AshikhminShirley(AnalyticBrdf):
    """Ashikhmin and Shirley, "An anisotropic Phong BRDF model", Journal of Graphics Tools 5(2), 2000.

    With h the half vector, k either direction, u = x, v = y, n = z, and c = h.k:

        F(c)  = R_s + (1 - R_s) (1 - c)^5                                                   eq. 3 (Schlick)
        rho_s = sqrt((n_u + 1)(n_v + 1)) / (8 pi) F(c)
                (n.h)^[(n_u (h.u)^2 + n_v (h.v)^2) / (1 - (h.n)^2)] / (c max(n.k1, n.k2))   eq. 4
        rho_d = 28 R_d / (23 pi) (1 - R_s) [1 - (1 - n.k1/2)^5] [1 - (1 - n.k2/2)^5]        eq. 5

    The diffuse term reflects the remainder of the highlight at each wavelength, so that it darkens towards grazing
    angles. All three terms are a function of direction times one of wavelength: the model has spectral rank 3.

    Parameters
    ----------
    diffuse : R_d, (L,) in [0, 1].
    specular : R_s at normal incidence, (L,) in [0, 1].
    exponent_u, exponent_v : n_u, n_v > 0 along x and along y; equal ones make the model isotropic.
    """

    NAME: ClassVar[str] = "ashikhmin_shirley"

    diffuse: Spectrum
    specular: Spectrum
    exponent_u: float = field(metadata=in_domain(0.0, open_low=True))
    exponent_v: float = field(metadata=in_domain(0.0, open_low=True))

    def __post_init__(self) -> None:
        base, coat = self._checked_reflectance("diffuse"), self._checked_reflectance("specular")
        self._check_numbers()
        under = 28.0 / (23.0 * np.pi) * base * (1.0 - coat)
        self._set(_under=under, _coat=np.stack([coat, np.ones_like(coat)]))
        self._set(isotropic=self.exponent_u == self.exponent_v)

    @classmethod
    def examples(cls, wavelengths_nm: np.ndarray) -> tuple[AnalyticBrdf, ...]:
        """Highlights from dull to needle-sharp, isotropic and brushed, for tests of what every model must keep."""
        ramp = np.linspace(0.0, 1.0, len(wavelengths_nm))
        up, down = (Spectrum.sampled(wavelengths_nm, values) for values in (ramp, ramp[::-1]))
        gloss = Spectrum.sampled(wavelengths_nm, np.full_like(ramp, 0.05))
        exponents = ((1.0, 1.0), (32.0, 32.0), (1.0, 8.0), (100.0, 10000.0), (100000.0, 100000.0))
        return (*(cls(up, gloss, *pair) for pair in exponents), cls(up, down, 32.0, 32.0))

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the diffuse term (eq. 5) in incident/outgoing angles, the highlight (eq. 4) in half/difference
        angles."""
        under = SumOfTerms(self._even, self._under[None], (self.NAME, "body"))
        base = ModelPart(self.wavelengths_nm, True, self._diffuse, under)
        coat = SumOfTerms(self._gloss, self._coat, (self.NAME, "coat", self.exponent_u, self.exponent_v))
        highlight = ModelPart(self.wavelengths_nm, self.isotropic, self._highlight, coat)
        return Lobe("io", base), Lobe("hd", highlight)

    def _eval_lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        out = self._highlight(wi, wo)
        out += self._diffuse(wi, wo)
        return out

    def _diffuse(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.multiply.outer(_leaving(wi) * _leaving(wo), self._under)

    def _even(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Evaluate `_diffuse` without its spectrum, (N,1)."""
        return (_leaving(wi) * _leaving(wo))[:, None]

    def _highlight(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return self._gloss(wi, wo) @ self._coat

    def _gloss(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Evaluate the factors of the spectra of `_coat`, (N,2)."""
        h = wi + wo
        h2 = h * h
        length2 = h2.sum(axis=-1)
        # |wi + wo| = 2 h.k; above the horizon it is positive, and so is the larger cosine.
        cos_d = 0.5 * np.sqrt(length2)
        away2 = (h2[:, 0] + h2[:, 1]) / length2
        # (n.h)^e as exp(e log(n.h)), with 2 log(n.h) = log1p(-sin^2) near the pole, where n.h itself would round
        # to 1, and its limit -sin^2 on it.
        log2_nh = 2.0 * np.log(0.5 * h[:, 2] / cos_d)
        np.log1p(-away2, out=log2_nh, where=away2 < 0.5)
        slope = np.divide(log2_nh, away2, out=np.full_like(away2, -1.0), where=away2 > 0)
        lobe = np.exp(0.5 * slope * (self.exponent_u * h2[:, 0] + self.exponent_v * h2[:, 1]) / length2)
        lobe *= np.sqrt((self.exponent_u + 1.0) * (self.exponent_v + 1.0)) / (8.0 * np.pi)
        lobe /= cos_d * np.maximum(wi[:, 2], wo[:, 2])
        schlick = (1.0 - np.minimum(cos_d, 1.0)) ** 5
        return np.stack([lobe * (1.0 - schlick), lobe * schlick], axis=-1)


def _leaving(w: np.ndarray) -> np.ndarray:
    return 1.0 - (1.0 - 0.5 * w[:, 2]) ** 5
