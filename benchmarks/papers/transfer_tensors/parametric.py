"""A material of a family: matt, with a highlight that parameters choose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ....materials.core.brdf import Brdf, Lobe, eval_lit
from ....materials.core.points import Points
from ....runtime.errors import InputError
from .families import Family


@dataclass(frozen=True, eq=False)
class Tuned(Brdf):
    """f_r = diffuse / pi + specular times a mixture of a family's members.

    wavelengths_nm (L,). diffuse, specular (L,) : reflectance of the matt part, and what the highlight is multiplied
    with, not negative. parameters : of the family, within it.

    Raises
    ------
    InputError : parameters outside of the family, when it is first seen; spectra that do not fit.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    diffuse: Float[np.ndarray, " L"]
    specular: Float[np.ndarray, " L"]
    family: Family
    parameters: tuple[float, ...]
    isotropic = True

    def __post_init__(self) -> None:
        for field in ("diffuse", "specular"):
            values = getattr(self, field)
            if values.shape != self.wavelengths_nm.shape or not np.isfinite(values).all() or values.min() < 0.0:
                expected = f"{len(self.wavelengths_nm)} numbers, not negative"
                raise InputError("no reflectance", field=field, found=f"{values.shape}", expected=expected)

    @cached_property
    def weights(self) -> Float[np.ndarray, " N"]:
        """The mixture of the family's members."""
        return self.family.weights(*self.parameters)

    @property
    def spectra(self) -> Float[np.ndarray, "2 L"]:
        """Spectra that `scalars` are multiplied with: those of the matt part and of the highlight."""
        return np.stack([self.diffuse, self.specular])

    def scalars(self, points: Points) -> Float[np.ndarray, "N 2"]:
        """1 / pi, and the mixture of members, 1/sr: f_r without spectra, 0 on and below the horizon; as precise as the
        directions are.
        """
        lit = (points.wi[:, 2] > 0.0) & (points.wo[:, 2] > 0.0)
        # A slice avoids copies if all are lit.
        some = slice(None) if lit.all() else lit
        found = np.zeros((len(points), 2), dtype=np.result_type(points.wi, points.wo))
        found[some, 0] = 1.0 / np.pi
        if self.specular.any():
            found[some, 1] = self._highlight(points.wi[some], points.wo[some])
        return found

    def _highlight(self, wi: Float[np.ndarray, "n 3"], wo: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        return self.family.mixture(self.weights, wi, wo)

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Implement `Brdf.eval`."""
        return eval_lit(self._lit, len(self.wavelengths_nm), wi, wo)

    def _lit(self, wi: Float[np.ndarray, "n 3"], wo: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n L"]:
        found = np.broadcast_to(self.diffuse / np.pi, (len(wi), len(self.diffuse)))
        if not self.specular.any():
            return found
        return found + self._highlight(wi, wo)[:, None] * self.specular

    def lobes(self) -> tuple[Lobe, ...]:
        """Return the matt part and the highlight, each where it is not black."""
        none = np.zeros_like(self.diffuse)
        found = []
        if self.diffuse.any() or not self.specular.any():
            found.append(Lobe("io", Tuned(self.wavelengths_nm, self.diffuse, none, self.family, self.parameters)))
        if self.specular.any():
            found.append(Lobe("hd", Tuned(self.wavelengths_nm, none, self.specular, self.family, self.parameters)))
        return tuple(found)
