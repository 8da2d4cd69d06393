"""Influence of the parts of a scene on each other: colour differences with and without interreflection.

Every material is treated as diffuse, with its albedo for uniform light at each wavelength: exact for diffuse materials,
also fluorescent ones; for glossy ones the total is right, not its direction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from ...materials.core.surface import Surface
from ...spectral.basis import SpectralBasis
from ...spectral.difference import delta_e_xyz
from ...spectral.wavelengths import common_wavelengths, interpolation_matrix
from ..scene import Scene
from ..visibility.occluders import Occluders
from .bounces import ENOUGH, Interreflection, interreflected
from .diffuse_albedo import even_albedo, even_matrix
from .direct import direct_illuminance
from .edge_refinement import between_sites, placed
from .hits import RAYS, Hits
from .indirect import needs_none
from .operator import irradiance_operator
from .radiant import basis_for, donaldson, fluoresces
from .ray_cache import kept_hits
from .regions import RadiantRegions, Regions


@dataclass(frozen=True, eq=False)
class ShownInfluence:
    """ΔE94 over the lit sites of a part, weighted by area."""

    mean: float
    p95: float
    maximum: float


@dataclass(frozen=True, eq=False)
class Influence:
    """Colour changes by interreflection.

    bounces, left, bound : see `Interreflection`. all (P,) : on each part, by all interreflection.
    of (P,P) : on each part (row), by the light that one part (column) reflects. sites, rays, nbytes : of the geometry.
    albedo_y (P,) : luminous albedo of each part's material for uniform light, 0 to 1.
    """

    bounces: int
    left: float
    bound: float
    all: tuple[ShownInfluence, ...]
    of: tuple[tuple[ShownInfluence, ...], ...]
    sites: int
    rays: int
    nbytes: int
    added: int
    between: ShownInfluence
    albedo_y: tuple[float, ...]


def influence(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    rays: int = RAYS,
    enough: float = ENOUGH,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
    folder: Path | None = None,
    jobs: int = 1,
    say: Callable[[str], object] = lambda words: None,
) -> Influence:
    """Compute interreflection in a scene, with all parts and without the light reflected by each.

    surfaces : by material id. rays : of each site. enough : see `interreflected`.
    folder, jobs, say : cache folder of rays, number of tracing processes, and callback for messages; see `kept_hits`.

    Raises
    ------
    InputError : it would not fit into memory; a material with a reflectance of 1 or more.
    """
    scene.check_surfaces(surfaces)
    bodies = placed(scene)
    hits = kept_hits(scene, folder, rays, jobs, progress, say=say, bodies=bodies)
    operator = irradiance_operator(hits)
    if needs_none(scene):
        # Rays may hit the flat triangles of a smooth convex body that its true shape would not intersect.
        operator = 0.0 * operator
    occluders = Occluders(bodies.triangles)
    lux = np.concatenate(direct_illuminance(scene, hits.sites, occluders), axis=1)
    part, regions = hits.part_of_site, _regions(scene, surfaces, hits)
    folds = regions.folds() if isinstance(regions, RadiantRegions) else _folds(scene, regions)
    white, reference = scene.adopted_white(), float(scene.viewing.reference_illuminance_lux)
    to_xyz = np.concatenate([fold.T for fold in folds]) / reference

    def follow(sends: Float[np.ndarray, " S"] | None = None) -> Interreflection:
        return interreflected(operator, regions, lux, folds, white, reference, enough, sends=sends)

    def seen(coefficients: Float[np.ndarray, "S K J"]) -> Float[np.ndarray, "S 3"]:
        return coefficients.reshape(len(coefficients), -1) @ to_xyz

    whole = follow()
    truth, count, lost = seen(whole.all), len(scene.parts), []
    for number in range(count):
        progress(number, count, "parts")
        lost.append(delta_e_xyz(truth, seen(follow((part != number).astype(np.float32)).all), white))
    progress(count, count, "parts")
    without = delta_e_xyz(truth, seen(whole.first), white)
    lit = truth.any(axis=1)
    of_parts = [lit & (part == number) for number in range(count)]
    return Influence(
        whole.bounces,
        whole.left,
        whole.bound,
        tuple(_shown(without, hits.areas, each) for each in of_parts),
        tuple(tuple(_shown(one, hits.areas, each) for one in lost) for each in of_parts),
        len(hits.sites),
        rays,
        hits.nbytes,
        bodies.added,
        _between(bodies.scene, hits, regions, whole, seen, white),
        tuple(_y(scene, surfaces[part.material]) for part in scene.parts),
    )


def _between(
    fine: Scene,
    hits: Hits,
    regions: Regions | RadiantRegions,
    whole: Interreflection,
    seen: Callable[[Float[np.ndarray, "n K J"]], Float[np.ndarray, "n 3"]],
    white: Float[np.ndarray, "3"],
) -> ShownInfluence:
    """Measure the interpolation error between sites: ΔE94 at random points, uniform in area."""
    found = between_sites(fine, hits, whole.all.reshape(len(whole.all), -1))
    part = hits.part_of_site[found.sites[:, 0]]
    straight = np.einsum("nc,nckj->nkj", found.shares, whole.first[found.sites])
    there = replace(regions, region=part)
    traced, mixed = (
        seen(straight + there.reflected(one.reshape(straight.shape))) for one in (found.traced, found.mixed)
    )
    lit = np.flatnonzero(traced.any(axis=1))
    return _shown(delta_e_xyz(traced, mixed, white)[lit], np.ones(len(lit)), np.ones(len(lit), dtype=bool))


def _y(scene: Scene, surface: Surface) -> float:
    """Compute the luminous albedo of a surface for uniform light of the first light's spectrum."""
    light, glowing = scene.lights[0].spectrum, donaldson(surface)
    if glowing is not None:
        return float(glowing.fold(light, scene.observer)[1])
    return float(scene.observer.weights(light, surface.wavelengths_nm)[1] @ even_albedo(surface))


def _folds(scene: Scene, regions: Regions) -> list[Float[np.ndarray, "3 J"]]:
    spectra = [spectrum for light in scene.lights for spectrum in light.spectra]
    return [regions.basis.fold(spectrum, scene.observer) for spectrum in spectra]


def _regions(scene: Scene, surfaces: Mapping[str, Surface], hits: Hits) -> Regions | RadiantRegions:
    """Return regions, one per part, at all wavelengths; with fluorescence, in a basis of radiances."""
    if fluoresces(surfaces[name] for name in scene.material_ids):
        matrices = {name: even_matrix(surfaces[name]) for name in scene.material_ids}
        lights = tuple(spectrum for light in scene.lights for spectrum in light.spectra)
        basis = basis_for([*matrices.values()], lights, scene.observer)
        of_parts = tuple(matrices[part.material] for part in scene.parts)
        return RadiantRegions(hits.part_of_site, of_parts, lights, scene.observer, basis)
    wavelengths = common_wavelengths([surfaces[part.material].wavelengths_nm for part in scene.parts])
    found = {
        name: interpolation_matrix(surfaces[name].wavelengths_nm, wavelengths) @ even_albedo(surfaces[name])
        for name in scene.material_ids
    }
    reflectances = np.stack([found[part.material] for part in scene.parts])
    return Regions(hits.part_of_site, reflectances, SpectralBasis.sampled(wavelengths))


def _shown(
    delta: Float[np.ndarray, " S"], areas: Float[np.ndarray, " S"], which: Bool[np.ndarray, " S"]
) -> ShownInfluence:
    """Summarise the differences of some sites, weighted by area; 0 without area."""
    area = areas[which]
    if not area.sum() > 0.0:
        return ShownInfluence(0.0, 0.0, 0.0)
    values = delta[which]
    order = np.argsort(values)
    share = np.cumsum(area[order]) / area.sum()
    p95 = float(values[order][min(int(np.searchsorted(share, 0.95)), len(order) - 1)])
    return ShownInfluence(float(np.average(values, weights=area)), p95, float(values.max()))
