"""Surfaces of texture maps: the facets and the body of glTF's materials, with colour, roughness and normal by texels.

Between texels, what they scatter is mixed as far as that is one number each: colours of body and facets, the square of
alpha (as a matrix, where highlights are stretched), and the x and y of the unit normal. A texel that is part metal is
so much metal beside so much of the other, as the specification's appendix B.2 has it.

Directions are turned into the frame of the texel's normal. What arrives is counted by the cosine there, so that f_r is
the facets' own times cos(theta_i) there over cos(theta_i) of the mesh. Nothing is reflected where either direction is
on or below the horizon of the mesh, or of the texel's normal: bumps neither shine through nor light what faces away.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...spectral.errors import InputError
from ...spectral.spectrum import Spectrum
from ..analytic.metallic_roughness import MetallicRoughness, schlick
from ..fast import Fast
from ..points import Points
from ..surface import Surface
from .facets import facets, turned_to
from .map_set import ROUNDING, MapSet
from .maps_form import maps_form
from .texels import between

# Points that are worked on at once: spectra of four texels of each are held.
_BLOCK = 4096


@dataclass(frozen=True, eq=False)
class MappedSurface(MapSet, Surface):  # pyright: ignore[reportIncompatibleVariableOverride]
    """glTF 2.0's material (Khronos 2021, appendix B) with the extensions specular, ior and anisotropy, by texels.

        dielectric = (1 - F_d) base / pi + F_d D G / (4 cos cos),   F_d = w (c + (1 - c) (1 - h.wi)^5)
        metal      = (base + (1 - base) (1 - h.wi)^5) D G / (4 cos cos)
        f_r        = (m metal + (1 - m) dielectric) cos(theta_i of the texel) / cos(theta_i of the mesh)

    and (1 - F_d) with the largest of c's red, green and blue. `glossy`: `base` is the body's colour and `reflected`
    that of all facets (KHR_materials_pbrSpecularGlossiness), and (1 - largest of c) base takes the place of base. See
    `MapSet` for the parameters.
    """

    NAME: ClassVar[str] = "maps"
    uses_uv: ClassVar[bool] = True

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """f_r at the point itself: what a sample spans is not averaged. See `Surface.at`."""
        out = np.zeros((len(points), len(self.wavelengths_nm)))
        lit = np.flatnonzero((points.wi[:, 2] > 0) & (points.wo[:, 2] > 0))
        for start in range(0, len(lit), _BLOCK):
            some = lit[start : start + _BLOCK]
            out[some] = self._at(points.chosen(some))
        return out

    def _at(self, points: Points) -> Float[np.ndarray, "N L"]:
        uv = np.zeros((len(points), 2)) if points.uv is None else self.placement.of(points.uv)
        rows, columns, shares = between(uv, *self.size, self.placement.wrap)
        four = self.texels(rows.ravel(), columns.ravel())

        def mixed(values: np.ndarray) -> np.ndarray:
            return np.einsum("nk,nk...->n...", shares, values.reshape(len(points), 4, *values.shape[1:]))

        lean = mixed(four.normal)
        normal = np.concatenate([lean, np.sqrt(np.maximum(1.0 - np.sum(lean**2, axis=1, keepdims=True), 0.0))], axis=1)
        wi, wo = turned_to(normal, points.wi, points.wo)
        seen = (wi[:, 2] > 0) & (wo[:, 2] > 0) & (mixed(four.covers) >= self.cutoff - ROUNDING)
        wi, wo = (np.where(seen[:, None], w, (0.0, 0.0, 1.0)) for w in (wi, wo))
        fall = schlick(points.wi, points.wo)
        shine = facets(wi, wo, mixed(four.spread))
        body = self.spectra(four.body)
        out = mixed(body * four.through[:, None]) * ((1.0 - fall) / np.pi)[:, None]
        out += mixed(body * four.rest[:, None]) * (fall / np.pi)[:, None]
        out += mixed(self.spectra(four.facets)) * ((1.0 - fall) * shine)[:, None]
        out += (mixed(four.edge) * fall * shine)[:, None]
        return out * (seen * wi[:, 2] / points.wi[:, 2])[:, None]

    def average(self) -> MetallicRoughness:
        """The surface of the mean of what texels reflect, and of alpha; bumps are left out.

        Raises
        ------
        InputError : a mean that is no reflectance.
        """
        total: Any = 0.0
        # What is linear in red, green and blue is made into a spectrum once.
        linear = self.uplift == "mallett-yuksel"
        made = (lambda colours: colours) if linear else self.spectra
        for _, found in self.blocks():
            share = (found.covers >= self.cutoff - ROUNDING).astype(float)
            alpha = np.sqrt(np.sqrt(found.spread[:, 0] * found.spread[:, 2] - found.spread[:, 1] ** 2))
            numbers = np.stack([np.ones(len(share)), found.edge, alpha], axis=1)
            total = total + share @ np.concatenate([numbers, made(found.body), made(found.facets)], axis=1)
        if not total[0] > 0:
            raise InputError("no texel is there", field="coverage", expected=f"opacity of {self.cutoff:g} somewhere")
        mean = total[1:] / total[0]
        colours = mean[2:].reshape(2, -1)
        colours = self.spectra(colours) if linear else colours
        # Rounding, and Mallett and Yuksel's white of 1.00000001.
        colours = np.where((colours > 1.0) & (colours < 1.0 + 1e-6), 1.0, colours)
        body, shine = (Spectrum.sampled(self.wavelengths_nm, part, "reflectance") for part in colours)
        return MetallicRoughness(body, shine, min(float(mean[0]), 1.0), min(float(mean[1]), 1.0))

    def own_form(self, budget: float = 0.5) -> Fast:
        """As few spectra as show every texel within the budget; see `maps_form`."""
        return maps_form(self, budget)
