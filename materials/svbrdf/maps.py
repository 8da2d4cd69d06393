"""Surfaces of texture maps: facets and body of glTF's materials, with colour, roughness and normal by texel.

Interpolation between texels is linear in the scattering: colours of body and facets, the square of alpha (as a matrix,
for anisotropic highlights), and the x and y of the unit normal. A texel that is part metal is a weighted sum of a metal
and a dielectric, as in the specification's appendix B.2.

Directions are transformed to the frame of the texel's normal. Irradiance takes the cosine there, so that f_r is the
facets' own times cos(theta_i) there over cos(theta_i) of the mesh. Nothing is reflected if either direction is on or
below the horizon of the mesh, or of the texel's normal: bumps neither shine through nor light what faces away.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.spectrum import Spectrum
from ..analytic.metallic_roughness import MetallicRoughness, schlick
from ..core.fast import Fast
from ..core.points import Points
from ..core.surface import Cutout, Surface
from .coat import alike, coat_over
from .facets import facets, turned_to, upright
from .map_set import ROUNDING, MapSet, Mask
from .maps_form import maps_form
from .texels import between

# Points per block: spectra of four texels of each are held.
_BLOCK = 4096


@dataclass(frozen=True, eq=False)
class MappedSurface(MapSet, Surface):  # pyright: ignore[reportIncompatibleVariableOverride]
    """glTF 2.0's material (Khronos 2021, appendix B) with its extensions, by texels.

        dielectric = (1 - F_d) base / pi + F_d D G / (4 cos cos),   F_d = w (c + (1 - c) (1 - h.wi)^5)
        metal      = (base + (1 - base) (1 - h.wi)^5) D G / (4 cos cos)
        f_r        = (m metal + (1 - m) dielectric) cos(theta_i of the texel) / cos(theta_i of the mesh)

    under a clear coat (KHR_materials_clearcoat; see `coat`), and (1 - F_d) with the largest of c's red, green and blue.
    `glossy`: `base` is the body's colour and `reflected` that of all facets (KHR_materials_pbrSpecularGlossiness), and
    (1 - largest of c) base takes the place of base. See `MapSet` for the parameters.
    """

    NAME: ClassVar[str] = "maps"
    uses_uv: ClassVar[bool] = True

    @cached_property
    def cutout(self) -> Cutout | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Opacity mask of its coverage."""
        opacity = self.coverage.decoded(self.coverage.values)
        return Mask(opacity, self.cutoff, self.placement) if (opacity < self.cutoff - ROUNDING).any() else None

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """Evaluate f_r at the point itself, without averaging over the footprint. See `Surface.at`."""
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

        wi, wo = turned_to(upright(mixed(four.normal)), points.wi, points.wo)
        there = mixed(four.covers) >= self.cutoff - ROUNDING
        seen = (wi[:, 2] > 0) & (wo[:, 2] > 0) & there
        wi, wo = (np.where(seen[:, None], w, (0.0, 0.0, 1.0)) for w in (wi, wo))
        fall = schlick(points.wi, points.wo)
        shine = facets(wi, wo, mixed(four.spread))
        body = self.spectra(four.body)
        out = mixed(body * four.through[:, None]) * ((1.0 - fall) / np.pi)[:, None]
        out += mixed(body * four.rest[:, None]) * (fall / np.pi)[:, None]
        out += mixed(self.spectra(four.facets)) * ((1.0 - fall) * shine)[:, None]
        out += (mixed(four.edge) * fall * shine)[:, None]
        out *= (seen * wi[:, 2] / points.wi[:, 2])[:, None]
        if four.coat is not None and four.coat_spread is not None and four.coat_normal is not None:
            lean, smooth = mixed(four.coat_normal), mixed(four.coat_spread)
            through, shine = coat_over(points, fall, mixed(four.coat), upright(lean), alike(smooth))
            out = out * through[:, None] + (there * shine / points.wi[:, 2])[:, None]
        return out

    def average(self) -> MetallicRoughness:
        """Return the surface of the mean reflectances and the mean alpha; bumps are left out.

        Raises
        ------
        InputError : a mean that is not a reflectance.
        """
        total: Any = 0.0
        # An uplift that is linear in red, green and blue is applied once, to the mean.
        linear = self.uplift == "mallett-yuksel"
        made = (lambda colours: colours) if linear else self.spectra
        for _, found in self.blocks():
            share = (found.covers >= self.cutoff - ROUNDING).astype(float)
            alpha = np.sqrt(np.sqrt(found.spread[:, 0] * found.spread[:, 2] - found.spread[:, 1] ** 2))
            # Mean roughness of the coat where it lies.
            coat = np.zeros(len(share)) if found.coat is None else found.coat
            smooth = 1.0 if found.coat_spread is None else np.sqrt(found.coat_spread)
            numbers = np.stack([np.ones(len(share)), found.edge, alpha, coat, coat * smooth], axis=1)
            total = total + share @ np.concatenate([numbers, made(found.body), made(found.facets)], axis=1)
        if not total[0] > 0:
            raise InputError("no texel is there", field="coverage", expected=f"opacity of {self.cutoff:g} somewhere")
        mean = total[1:] / total[0]
        colours = mean[4:].reshape(2, -1)
        colours = self.spectra(colours) if linear else colours
        # Rounding, and Mallett and Yuksel's white of 1.00000001.
        colours = np.where((colours > 1.0) & (colours < 1.0 + 1e-6), 1.0, colours)
        body, shine = (Spectrum.sampled(self.wavelengths_nm, part, "reflectance") for part in colours)
        edge, alpha, coat = (min(float(number), 1.0) for number in mean[:3])
        coat_alpha = min(float(mean[3] / mean[2]), 1.0) if coat > 0.0 else 1.0
        return MetallicRoughness(body, shine, edge, alpha, coat, coat_alpha)

    def own_form(self, budget: float = 0.5) -> Fast:
        """Make a form of few spectra that keeps every texel within the budget; see `maps_form`."""
        return maps_form(self, budget)
