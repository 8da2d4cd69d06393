"""Diffuse albedo of surfaces for indirect light.

Of uniform light a slice reflects its integral (`EnvironmentForm`), however sharp it is. A uniform material has one
reflectance, a texture one per site: the mean of its texels over the adjacent triangles.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float, Int

from ...materials.core.environment_form import BENDS, EnvironmentForm
from ...materials.core.fast import Fast
from ...materials.core.points import Points
from ...materials.core.sampling import DirectionSampler
from ...materials.core.surface import Surface
from ...spectral.bispectral import Bispectral
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import interpolation_matrix
from ..scene import Scene
from .hits import Hits, shifted_pattern
from .radiant import donaldson

# Samples of a drawn albedo: pairs of directions, each with a place on a texture.
_PAIRS = 4096
# Steps of a low-discrepancy sequence in their six dimensions: powers of the inverse of the real root of x^7 = x + 1
# (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018). A pattern shared by them would
# correlate them.
_STEPS = 1.11277568427870550 ** -np.arange(1.0, 7.0)
#: Moments z and 3 zz - 1 of uniform light from above, relative to its illuminance.
EVEN_Z, EVEN_ZZ = 2.0 / 3.0, 0.5
# Samples of a fast form's albedo: viewers, each with a place on a texture.
_VIEWERS = 2048
# Places in each triangle of a textured part, and points per block.
_PLACES, _AT_ONCE = 4, 1 << 14
# Sites of a texture whose reflectances a basis is fitted to, besides the texture's mean.
_SHOWN = 8


def even_albedo(surface: Surface) -> Float[np.ndarray, " L"]:
    """Compute the albedo of a surface under uniform light: a cosine-weighted mean over viewing directions, and over
    texels.

    For a fast form the integral over incident directions is that of the rendered slice (`EnvironmentForm`), however
    sharp. For other surfaces incident directions are importance sampled: the error is some 0.3 % for highlights of
    alpha 0.05, and 0 for diffuse surfaces.
    """
    if not isinstance(surface, Fast):
        return _drawn_albedo(surface)
    form = surface.environment_form()
    square = shifted_pattern(np.arange(2), _VIEWERS)
    radius, turn = np.sqrt(square[0, :, 0]), 2.0 * np.pi * square[0, :, 1]
    to = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - square[0, :, 0])], axis=1)
    # Permuted, since both patterns are the same and places would be correlated with directions.
    places = np.random.default_rng(0).permutation(square[1])
    return _even(form, Points(to, to, places)).mean(axis=0) @ form.palette.samples[0]


def even_matrix(surface: Surface) -> Bispectral:
    """Return the albedo as a bispectral matrix; exact for fluorescent surfaces, which are diffuse."""
    found = donaldson(surface)
    if found is not None:
        return found
    return Bispectral.diagonal(Spectrum.sampled(surface.wavelengths_nm, even_albedo(surface), "reflectance"))


def _drawn_albedo(surface: Surface) -> Float[np.ndarray, " L"]:
    even = (0.5 + np.arange(1, _PAIRS + 1)[:, None] * _STEPS) % 1.0
    radius, turn = np.sqrt(even[:, 0]), 2.0 * np.pi * even[:, 1]
    wo = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - even[:, 0])], axis=1)
    sampler = DirectionSampler(surface)
    wi = sampler.drawn(wo, even[:, 2:4])
    density = sampler.density(wo, wi)
    some = np.flatnonzero((wi[:, 2] > 0.0) & (density > 0.0))
    weight = wi[some, 2] / density[some] / _PAIRS
    return weight @ surface.at(Points(wi[some], wo[some], even[some, 4:]))


def _even(form: EnvironmentForm, points: Points) -> Float[np.ndarray, "N R"]:
    """Compute each term's reflectance of uniform light."""
    lobes = form.lobes(points)
    matt = lobes.matt[:, 0].copy()
    if lobes.matt.shape[1] == BENDS:
        matt += EVEN_Z * lobes.matt[:, 3] + EVEN_ZZ * lobes.matt[:, 8]
    return lobes.value.sum(axis=1) + matt


def regions_of(
    fine: Scene, surfaces: Mapping[str, Fast], hits: Hits, wavelengths_nm: Float[np.ndarray, " L"]
) -> tuple[tuple[Int[np.ndarray, " S"], Float[np.ndarray, "R L"]], Float[np.ndarray, "n L"]]:
    """Group sites into regions with their reflectances, as for `Regions`; also return a sample of reflectances, for
    fitting a basis.

    fine : scene of `hits`, with texture coordinates where materials use them.
    """
    region, parts = hits.part_of_site.copy(), []
    for part in fine.parts:
        surface = surfaces[part.material]
        parts.append(interpolation_matrix(surface.wavelengths_nm, wavelengths_nm) @ even_albedo(surface))
    found, shown, count = [np.stack(parts)], [np.stack(parts)], len(parts)
    for number, part in enumerate(fine.parts):
        form = surfaces[part.material].environment_form()
        if not form.uses_uv:
            continue
        sites, reflectances = _of_sites(form, fine, hits, number)
        reflectances = reflectances @ interpolation_matrix(form.palette.wavelengths_nm, wavelengths_nm).T
        region[sites] = count + np.arange(len(sites))
        found.append(reflectances)
        shown.append(reflectances[np.linspace(0, len(sites) - 1, _SHOWN).astype(np.int64)])
        count += len(sites)
    return (region, np.concatenate(found)), np.concatenate(shown)


def _of_sites(
    form: EnvironmentForm, fine: Scene, hits: Hits, number: int
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n L"]]:
    """Return the sites of a textured part, and their reflectances."""
    mesh = fine.parts[number].mesh
    assert mesh.uv is not None
    triangles = np.flatnonzero(hits.part == number)
    square = shifted_pattern(np.arange(len(triangles)), _PLACES).reshape(-1, 2)
    square = np.where(square.sum(axis=1, keepdims=True) > 1.0, 1.0 - square, square)
    shares = np.column_stack([1.0 - square.sum(axis=1), square])
    uv = np.einsum("nc,nci->ni", shares, np.repeat(mesh.uv[mesh.faces], _PLACES, axis=0))
    # Cosine-weighted viewing directions, a different one at each place.
    even = np.random.default_rng(0).random((len(uv), 2))
    radius, turn = np.sqrt(even[:, 0]), 2.0 * np.pi * even[:, 1]
    to = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - even[:, 0])], axis=1)
    blocks = [slice(start, start + _AT_ONCE) for start in range(0, len(uv), _AT_ONCE)]
    terms = np.concatenate([_even(form, Points(to[rows], to[rows], uv[rows])) for rows in blocks])
    corners = mesh.vertices[mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    weights = shares * np.repeat(areas, _PLACES)[:, None]
    total, whole = np.zeros((len(hits.sites), terms.shape[1])), np.zeros(len(hits.sites))
    for sites in (hits.corners[triangles], hits.backs[triangles]):
        at = np.repeat(sites, _PLACES, axis=0)
        for corner in range(3):
            there = at[:, corner] >= 0
            np.add.at(total, at[there, corner], weights[there, corner, None] * terms[there])
            np.add.at(whole, at[there, corner], weights[there, corner])
    mine = np.flatnonzero(whole > 0.0)
    return mine, (total[mine] / whole[mine, None]) @ form.palette.samples[0]
