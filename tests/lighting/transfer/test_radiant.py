"""Light that is passed on by surfaces some of which fluoresce: in few coefficients, at every wavelength, as paths."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.transfer.bounces import interreflected
from metamer.lighting.transfer.direct import direct_illuminance
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.influence import influence
from metamer.lighting.transfer.operator import irradiance_operator
from metamer.lighting.transfer.radiant import basis_for
from metamer.lighting.transfer.regions import RadiantRegions, Regions
from metamer.lighting.visibility.occluders import Occluders
from metamer.lighting.visibility.refinement import refined
from metamer.lighting.visibility.sites import scaled_triangles
from metamer.materials.analytic import Lambert
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.bispectral import Bispectral, fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum

SEEN, NM, EVERY = observer("1931_2"), np.arange(380.0, 781.0, 10.0), np.arange(360.0, 831.0)
LIGHTS = tuple(illuminant(name) for name in ("D65", "A", "FL11"))


def about(centre, width=30.0):
    return np.exp(-(((NM - centre) / width) ** 2))


def dye(peak, to, base=0.3):
    return fluorophore(Spectrum.sampled(NM, np.full(NM.size, base)), 0.6 * about(peak), about(to), 0.9)


def matt(values):
    return Bispectral.diagonal(Spectrum.sampled(NM, values))


SURFACES = (
    dye(420, 520),
    dye(520, 610, 0.2),
    matt(0.1 + 0.7 * about(650, 80)),
    matt(np.full(NM.size, 0.8)),
    matt(0.05 + 0.6 * about(450, 50)),
    matt(0.1 + 0.5 * about(540, 40)),
)


@pytest.fixture(scope="module")
def box(scene_of, room):
    """G of the room, the side of each site, and some light."""
    hits = placed(scene_of(*room), 0.7).traced(64)
    lux = np.random.default_rng(0).uniform(0.0, 3000.0, (len(hits.sites), 1))
    return irradiance_operator(hits), hits.part_of_site, lux


def followed(box, regions, white, **more):
    operator, _, lux = box
    return interreflected(operator, regions, lux, regions.folds(), white, 1000.0, **more)


@pytest.mark.slow
@pytest.mark.parametrize("light", LIGHTS, ids=["D65", "A", "FL11"])
def test_few_coefficients_are_as_good_as_every_wavelength(box, light):
    """Against c_(k+1) = D G c_k with the full matrices at each nanometre."""
    operator, side, lux = box
    full = np.stack([surface.on(EVERY) for surface in SURFACES])
    now = lux * np.stack([one.radiance(light, EVERY) / SEEN.luminous(light) for one in SURFACES])[side]
    total = now.copy()
    for _ in range(40):
        arriving = operator @ now
        for number, matrix in enumerate(full):
            now[side == number] = arriving[side == number] @ matrix.T
        total += now
    truth = total @ SEEN.sensitivity(EVERY).T / 1000.0
    basis = basis_for(SURFACES, LIGHTS, SEEN, size=20)
    regions = RadiantRegions(side, SURFACES, (light,), SEEN, basis)
    found = followed(box, regions, SEEN.white(light), enough=1e-3)
    seen = found.all[:, 0] @ regions.folds()[0].T / 1000.0
    assert delta_e_xyz(truth, seen, SEEN.white(light)).max() < 0.1
    # Wavelength by wavelength the same sum.
    sampled = RadiantRegions(side, SURFACES, (light,), SEEN, SpectralBasis.sampled(EVERY))
    each = followed(box, sampled, SEEN.white(light), enough=1e-3)
    np.testing.assert_allclose(each.all[:, 0] @ sampled.folds()[0].T / 1000.0, truth, rtol=1e-4)
    # Without fluorescence it would be seen at once.
    plain = tuple(one.without_emission() for one in SURFACES)
    dark = followed(box, RadiantRegions(side, plain, (light,), SEEN, basis), SEEN.white(light))
    assert delta_e_xyz(truth, dark.all[:, 0] @ regions.folds()[0].T / 1000.0, SEEN.white(light)).max() > 5.0


def test_ordinary_surfaces_are_as_they_are_relative_to_light(box):
    operator, side, lux = box
    light, plain = LIGHTS[0], (*SURFACES[2:], SURFACES[2], SURFACES[3])
    basis = SpectralBasis.sampled(NM)
    regions = Regions(side, np.stack([one.reflectance.samples for one in plain]), basis)
    fold = basis.fold(light, SEEN)
    relative = interreflected(operator, regions, lux, [fold], SEEN.white(light), 1000.0)
    radiant = RadiantRegions(side, plain, (light,), SEEN, basis_for(plain, LIGHTS, SEEN))
    found = followed(box, radiant, SEEN.white(light))
    ours, other = (a.all[:, 0] @ f.T / 1000.0 for a, f in ((found, radiant.folds()[0]), (relative, fold)))
    # The one is linear in reflectance between its samples, the other smooth.
    assert delta_e_xyz(ours, other, SEEN.white(light)).max() < 0.2


def test_what_is_left_is_below_what_is_said(box):
    _, side, _ = box
    regions = RadiantRegions(side, SURFACES, LIGHTS[:1], SEEN, basis_for(SURFACES, LIGHTS, SEEN))
    rough, fine = (followed(box, regions, SEEN.white(LIGHTS[0]), enough=enough) for enough in (0.5, 1e-3))
    seen = [one.all[:, 0] @ regions.folds()[0].T / 1000.0 for one in (fine, rough)]
    assert 0.0 < delta_e_xyz(*seen, SEEN.white(LIGHTS[0])).max() <= 1.1 * rough.left
    assert (seen[0] - seen[1])[:, 1].max() <= rough.bound


def test_a_surface_that_keeps_all_of_its_light_is_refused():
    whole = (matt(np.ones(NM.size)),)
    with pytest.raises(InputError, match="what they cannot"):
        RadiantRegions(np.zeros(1, np.int64), whole, LIGHTS[:1], SEEN, SpectralBasis.sampled(NM))


@pytest.fixture(scope="module")
def facing(scene_of, squares):
    """A white square below one that glows, and a lamp that shines up on the glow alone."""
    lights = (DirectionalLight((0.0, -0.4, 1.2), LIGHTS[0], 1000.0),)
    scene = scene_of(*squares(0.5))
    parts = tuple(replace(part, material=name) for part, name in zip(scene.parts, ("white", "dye"), strict=True))
    camera = Camera(
        position=(0.0, 0.2, 0.0), target=(0, 0, 0), up=(0, 0, -1), vertical_fov_deg=4, width=2, height_px=2, samples=2
    )
    return replace(scene, parts=parts, lights=lights, cameras=(camera,))


def test_it_is_what_paths_find(facing):
    """In the middle of the lower square."""
    surfaces = {"white": Lambert(Spectrum.sampled(NM, np.full(NM.size, 0.8))), "dye": FluorescentLambert(SURFACES[0])}
    paths = reference_images(facing, None, surfaces, bounces=8, budget=2.0)
    truth = paths.xyz[0].mean(axis=(0, 1)) * facing.viewing.reference_illuminance_lux / 1000.0
    hits = placed(facing).traced(512)
    fine = refined(facing)[0]
    occluders = Occluders(scaled_triangles(fine).astype(np.float32))
    lux = np.concatenate(direct_illuminance(facing, hits.sites, occluders), axis=1)
    own = (SURFACES[3], SURFACES[0])
    regions = RadiantRegions(hits.part_of_site, own, LIGHTS[:1], SEEN, basis_for(own, LIGHTS, SEEN))
    white = SEEN.white(LIGHTS[0])
    found = interreflected(irradiance_operator(hits), regions, lux, regions.folds(), white, 1000.0)
    seen = found.all[:, 0] @ regions.folds()[0].T / 1000.0
    middle = hits.sites.fronts[: len(fine.parts[0].mesh.vertices)]
    near = np.linalg.norm(fine.parts[0].mesh.vertices, axis=1) < 0.06
    assert near.any()
    assert delta_e_xyz(truth, seen[middle[near]].mean(axis=0), white) < 1.0


def test_what_a_dye_puts_on_others_is_shown_from_original_and_fast_form(facing):
    white = Lambert(Spectrum.sampled(NM, np.full(NM.size, 0.8)))
    original = FluorescentLambert(SURFACES[0])
    found = [influence(facing, {"white": white, "dye": one}, 32) for one in (original, original.own_form())]
    without = influence(facing, {"white": white, "dye": Lambert(SURFACES[0].reflectance)}, 32)
    for one in found:
        assert one.of[0][1].mean > 2.0
        assert one.albedo_y == pytest.approx((0.8, float(SURFACES[0].fold(LIGHTS[0], SEEN)[1])), abs=1e-3)
    assert found[0].of[0][1].mean == pytest.approx(found[1].of[0][1].mean, rel=1e-3)
    assert abs(without.of[0][1].mean - found[0].of[0][1].mean) > 1.0
