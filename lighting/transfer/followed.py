"""Light followed from surface to surface for pictures: coefficients of what all sites send out in the end.

Relative to the spectra of lights, where every surface keeps each wavelength; of radiance, where one fluoresces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...materials.fast import Fast
from ...spectral.basis import SpectralBasis
from ...spectral.bispectral import Bispectral
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import common_wavelengths, interpolation_matrix
from ..plan import bounce_basis
from ..scene import Scene
from .bounces import Regions, passed_on
from .passing_on import even_albedo, regions_of
from .radiant import RadiantRegions, donaldson, planned_basis
from .ray_light import MOST_GLOSSY, RayLight, glossy_light, glossy_parts
from .transport import Transport


@dataclass(frozen=True, eq=False)
class Followed:
    """What all sites send out, in fields: of each of K spectra, each coefficient of `basis`.

    bounces, left : see `Interreflection`. glossy : the numbers of parts that are.
    radiant : None where coefficients are relative to the spectra. Else they are of radiance, of all lights together,
    and of spectral power where the spectrum of equal energy has this much of what the observer calls Y.
    """

    sent: RayLight
    spectra: tuple[Spectrum, ...]
    basis: SpectralBasis
    bounces: int
    left: float
    glossy: tuple[int, ...]
    radiant: float | None = None


def followed(
    scene: Scene,
    surfaces: Mapping[str, Fast],
    transport: Transport,
    spectra: tuple[Spectrum, ...],
    which: Sequence[int],
    lux: Float[np.ndarray, "S K"],
    shown_in: Sequence[Spectrum],
    enough: float,
) -> Followed:
    """Where every surface keeps each wavelength.

    spectra : of `lux`, what sites receive straight away. which : of all lights' spectra, the number of each in them.
    Other parameters are those of `indirect_light`.
    """
    hits, prepared = transport.hits, transport.prepared
    wavelengths = common_wavelengths([surfaces[name].wavelengths_nm for name in scene.material_ids])
    # Rays outlive materials: parts wear those of this scene.
    worn = [replace(fine, material=part.material) for fine, part in zip(transport.fine.parts, scene.parts, strict=True)]
    regions, seen = regions_of(replace(transport.fine, parts=tuple(worn)), surfaces, hits, wavelengths)
    glossy = glossy_parts(prepared, scene, surfaces)
    shown = [one.shown @ interpolation_matrix(one.wavelengths_nm, wavelengths).T for one in glossy.values()]
    basis = bounce_basis(np.concatenate([seen, *shown]), [*spectra, *shown_in], scene.observer, wavelengths)
    known = Regions(*regions, basis)
    evenly = first = known.first(lux)
    light = then = None
    count = int(np.isin(hits.part_of_site, list(glossy)).sum())
    if 0 < count <= MOST_GLOSSY and scene.bounces != 0:
        light, of_glossy = glossy_light(prepared, glossy, scene.lights, which, basis, lux)
        first = evenly.copy()
        first[light.rays.sites] = of_glossy
        arrives = prepared.operator @ first.reshape(len(lux), -1) + light.irradiance(hits)
        then = known.reflected(arrives.reshape(first.shape))
    reference = float(scene.viewing.reference_illuminance_lux)
    found = passed_on(
        prepared.operator,
        known,
        evenly,
        np.concatenate([basis.fold(spectrum, scene.observer).T for spectrum in spectra]) / reference,
        scene.adopted_white(),
        reference,
        enough,
        bounces=_more(scene),
        then=then,
    )
    sent = RayLight((found.indirect + first).reshape(len(lux), -1), light)
    return Followed(sent, spectra, basis, found.bounces, found.left, tuple(glossy))


def followed_as_radiance(
    scene: Scene,
    surfaces: Mapping[str, Fast],
    transport: Transport,
    spectra: tuple[Spectrum, ...],
    lux: Float[np.ndarray, "S K"],
    enough: float,
) -> Followed:
    """Where some surface fluoresces: once light has met a surface, it matters no more which lamp it is of.

    Glossy parts pass light on as matt ones, and textures their mean. Parameters are those of `followed`.
    """
    matrices = {name: _matrix(surfaces[name]) for name in scene.material_ids}
    basis = planned_basis([*matrices.values()], spectra, scene.observer)
    of_parts = tuple(matrices[part.material] for part in scene.parts)
    known = RadiantRegions(transport.hits.part_of_site, of_parts, spectra, scene.observer, basis)
    reference = float(scene.viewing.reference_illuminance_lux)
    found = passed_on(
        transport.prepared.operator,
        known,
        known.first(lux).sum(axis=1, keepdims=True),
        known.folds()[0].T / reference,
        scene.adopted_white(),
        reference,
        enough,
        bounces=_more(scene),
    )
    nm = basis.wavelengths_nm
    equal = Spectrum.sampled(nm, np.ones(len(nm)), "emission")
    glossy = tuple(glossy_parts(transport.prepared, scene, surfaces))
    sent, luminous = RayLight(found.all.reshape(len(lux), -1)), scene.observer.luminous(equal)
    return Followed(sent, (equal,), basis, found.bounces, found.left, glossy, luminous)


def _matrix(surface: Fast) -> Bispectral:
    found = donaldson(surface)
    if found is not None:
        return found
    return Bispectral.diagonal(Spectrum.sampled(surface.wavelengths_nm, even_albedo(surface), "reflectance"))


def _more(scene: Scene) -> int | None:
    """Bounces that follow the first surface; None is as many as are seen."""
    return None if scene.bounces == "auto" else max(int(scene.bounces) - 1, 0)
