"""A BRDF that is a body and a few round lobes of half vectors, each with spectra of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ....materials.core.brdf import Brdf, Lobe, eval_lit
from ....runtime.errors import InputError

#: Angles from the normal between which the shadowing is linear in the cosine; it is 1 at the first.
SHADOWING_DEG = (0.0, 30.0, 50.0, 65.0, 75.0, 82.0, 87.0, 90.0)
_COSINES = np.cos(np.radians(SHADOWING_DEG))[::-1]


@dataclass(frozen=True, eq=False)
class GaussianBrdf(Brdf):
    """Wang et al. 2009, eqs. 8 and 13, with a spectrum in place of RGB.

    With h the half vector and s = (1 - h.o)^5:

        f_r = diffuse + sum over l  [(1 - s) normal_l + s grazing_l] S(i) S(o) G(h; n, lambda_l) / (cos i cos o)

    The paper's Fresnel term, one refractive index for all, is here what Schlick's has between two measured ends: the
    spectra of a lobe at normal incidence and at grazing. The smooth factor's pi is in them.

    Parameters
    ----------
    wavelengths_nm : (L,).
    diffuse : (L,) 1/sr, >= 0.
    sharpness : (n,) lambda, > 0.
    normal, grazing : (n,L) 1/sr, >= 0.
    shadowing : (8,) S at `SHADOWING_DEG`, >= 0.

    Raises
    ------
    InputError : shapes that do not fit, or numbers below 0.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    diffuse: Float[np.ndarray, " _"]
    sharpness: Float[np.ndarray, " _"]
    normal: Float[np.ndarray, "_ _"]
    grazing: Float[np.ndarray, "_ _"]
    shadowing: Float[np.ndarray, " _"]

    isotropic = True

    def __post_init__(self) -> None:
        shape = (len(self.sharpness), len(self.wavelengths_nm))
        expected = {"diffuse": shape[1:], "normal": shape, "grazing": shape, "shadowing": (len(SHADOWING_DEG),)}
        for name, wanted in expected.items():
            found = getattr(self, name)
            if found.shape != wanted:
                raise InputError("lobes that do not fit", field=name, found=found.shape, expected=str(wanted))
            if not (np.isfinite(found).all() and (found >= 0.0).all()):
                raise InputError("not a reflectance", field=name, expected="finite numbers >= 0")
        if not (np.isfinite(self.sharpness).all() and (self.sharpness > 0.0).all()):
            raise InputError("not a sharpness", field="sharpness", found=self.sharpness, expected="finite, > 0")

    def lobes(self) -> tuple[Lobe, ...]:
        """One, which lives in half/difference angles."""
        return (Lobe("hd", self),)

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """f_r (...,L) in 1/sr; see `Brdf.eval`."""
        return eval_lit(self._eval_lit, len(self.wavelengths_nm), wi, wo)

    def _eval_lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        terms = HalfGeometry.of(wi, wo).terms(self.sharpness, self.shadowing)
        return terms @ np.concatenate([self.diffuse[None], self.normal, self.grazing])


@dataclass(frozen=True, eq=False)
class HalfGeometry:
    """Half-vector geometry of N pairs of directions, for lobes and the smooth factor.

    apart (N,) : |h - n|^2. rise (N,) : (1 - h.o)^5. cosines (N,) : cos i cos o. towards : (N,8) twice, the shares that
    the nodes of the shadowing have in S(i) and in S(o).
    """

    apart: Float[np.ndarray, " N"]
    rise: Float[np.ndarray, " N"]
    cosines: Float[np.ndarray, " N"]
    towards: tuple[Float[np.ndarray, "N 8"], Float[np.ndarray, "N 8"]]

    @classmethod
    def of(cls, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> HalfGeometry:
        """Compute it of pairs that are all above the horizon."""
        h, d = wi + wo, wi - wo
        length2 = np.sum(h * h, axis=1)
        cos_h = h[:, 2] / np.sqrt(length2)
        # 2 (1 - cos) without cancellation.
        apart = 2.0 * (h[:, 0] ** 2 + h[:, 1] ** 2) / length2 / (1.0 + cos_h)
        rise = (0.25 * np.sum(d * d, axis=1) / (1.0 + 0.5 * np.sqrt(length2))) ** 5
        return cls(apart, rise, wi[:, 2] * wo[:, 2], (_shares(wi[:, 2]), _shares(wo[:, 2])))

    def terms(self, sharpness: Float[np.ndarray, " n"], shadowing: Float[np.ndarray, "8"]) -> Float[np.ndarray, "N R"]:
        """1, then each lobe's (1 - s) S(i) S(o) G(h) / (cos i cos o), then each lobe's with s."""
        smooth = (self.towards[0] @ shadowing) * (self.towards[1] @ shadowing) / self.cosines
        lobes = smooth[:, None] * np.exp(-0.5 * self.apart[:, None] * sharpness)
        rise = self.rise[:, None]
        return np.concatenate([np.ones((len(lobes), 1)), lobes * (1.0 - rise), lobes * rise], axis=1)


def _shares(cosine: np.ndarray) -> np.ndarray:
    """Return the shares of the nodes of `SHADOWING_DEG` at these cosines, (N,8)."""
    left = np.clip(np.searchsorted(_COSINES, cosine) - 1, 0, len(_COSINES) - 2)
    share = (cosine - _COSINES[left]) / (_COSINES[left + 1] - _COSINES[left])
    rows, shares = np.arange(len(cosine)), np.zeros((len(cosine), len(_COSINES)))
    # The table's nodes rise in angle, the cosines fall.
    last = len(_COSINES) - 1
    shares[rows, last - left], shares[rows, last - left - 1] = 1.0 - share, share
    return shares
