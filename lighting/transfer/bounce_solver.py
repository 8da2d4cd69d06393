"""Interreflection for renderings: coefficients of the radiosity of all sites.

They are relative to the spectra of lights, or of radiance if any surface fluoresces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...materials.core.fast import Fast
from ...spectral.basis import SpectralBasis
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import common_wavelengths
from ..plan import bounce_basis
from ..scene import Scene
from .bounces import passed_on
from .coefficients import Coefficients
from .diffuse_albedo import even_matrix, regions_of
from .radiant import fluoresces, planned_basis
from .ray_light import MOST_GLOSSY, RayLight, glossy_light, glossy_parts
from .reflection import Reflection
from .regions import RadiantRegions, Regions
from .transport import Transport


@dataclass(frozen=True, eq=False)
class Followed:
    """Radiosity of all sites, in fields: each coefficient of `basis` for each of K spectra.

    bounces, left : see `Interreflection`. glossy : indices of glossy parts.
    radiant : None if coefficients are relative to the spectra. Else they are of the radiance of all lights together,
    and this is the observer's Y of the equal-energy spectrum of power 1.
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
    """Compute the radiosity that results from the direct illuminance `lux`.

    spectra : K distinct spectra of the light. which : index into them for each spectrum of each light. Other
    parameters: see `indirect_light`.
    """
    hits, prepared = transport.hits, transport.prepared
    glossy = glossy_parts(prepared, scene, surfaces)
    radiant = fluoresces(surfaces[name] for name in scene.material_ids)
    if radiant:
        known, evenly = _by_radiance(scene, surfaces, transport, glossy, spectra, lux)
    else:
        known, evenly = _relative(scene, surfaces, transport, glossy, spectra, shown_in, lux)
    reference = float(scene.viewing.reference_illuminance_lux)
    coefficients = Coefficients(known.basis, spectra, scene.observer, reference, radiant)
    first, light, then = evenly, None, None
    count = int(np.isin(hits.part_of_site, list(glossy)).sum())
    if 0 < count <= MOST_GLOSSY and scene.bounces != 0:
        light, of_glossy = glossy_light(prepared, glossy, scene.lights, which, coefficients, lux)
        first = evenly.copy()
        first[light.rays.sites] = of_glossy.reshape(len(of_glossy), *first.shape[1:])
        arrives = prepared.operator @ first.reshape(len(lux), -1) + light.irradiance(hits)
        then = known.reflected(arrives.reshape(first.shape))
    found = passed_on(
        prepared.operator,
        known,
        evenly,
        coefficients.to_xyz,
        scene.adopted_white(),
        reference,
        enough,
        bounces=_more(scene),
        then=then,
    )
    sent = RayLight((found.indirect + first).reshape(len(lux), -1), light)
    if not radiant:
        return Followed(sent, spectra, known.basis, found.bounces, found.left, tuple(glossy))
    nm = known.basis.wavelengths_nm
    equal = Spectrum.sampled(nm, np.ones(len(nm)), "emission")
    luminous = scene.observer.luminous(equal)
    return Followed(sent, (equal,), known.basis, found.bounces, found.left, tuple(glossy), luminous)


def _relative(
    scene: Scene,
    surfaces: Mapping[str, Fast],
    transport: Transport,
    glossy: Mapping[int, Reflection],
    spectra: tuple[Spectrum, ...],
    shown_in: Sequence[Spectrum],
    lux: Float[np.ndarray, "S K"],
) -> tuple[Regions, Float[np.ndarray, "S K J"]]:
    """Return the diffuse reflectances of all sites, and their first reflection of `lux`, without fluorescence."""
    wavelengths = common_wavelengths([surfaces[name].wavelengths_nm for name in scene.material_ids])
    # Cached rays are independent of materials; parts get those of this scene.
    worn = [replace(fine, material=part.material) for fine, part in zip(transport.fine.parts, scene.parts, strict=True)]
    regions, seen = regions_of(replace(transport.fine, parts=tuple(worn)), surfaces, transport.hits, wavelengths)
    shown = [one.on(wavelengths).shown for one in glossy.values()]
    basis = bounce_basis(np.concatenate([seen, *shown]), [*spectra, *shown_in], scene.observer, wavelengths)
    known = Regions(*regions, basis)
    return known, known.first(lux)


def _by_radiance(
    scene: Scene,
    surfaces: Mapping[str, Fast],
    transport: Transport,
    glossy: Mapping[int, Reflection],
    spectra: tuple[Spectrum, ...],
    lux: Float[np.ndarray, "S K"],
) -> tuple[RadiantRegions, Float[np.ndarray, "S 1 J"]]:
    """Return the same with fluorescence, for all lights together; a texture is replaced by its mean."""
    matrices = {name: even_matrix(surfaces[name]) for name in scene.material_ids}
    shown = [each for one in {id(one): one for one in glossy.values()}.values() for each in one.shown_as_matrices]
    basis = planned_basis([*matrices.values(), *shown], spectra, scene.observer)
    of_parts = tuple(matrices[part.material] for part in scene.parts)
    known = RadiantRegions(transport.hits.part_of_site, of_parts, spectra, scene.observer, basis)
    return known, known.first(lux).sum(axis=1, keepdims=True)


def _more(scene: Scene) -> int | None:
    """Return the number of bounces after the first surface; None is as many as are visible."""
    return None if scene.bounces == "auto" else max(int(scene.bounces) - 1, 0)
