"""Interreflection while materials, lights and views change."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.benchmarks.papers.site_relighting import final_gather
from metamer.benchmarks.papers.site_relighting.relighting import Relighting
from metamer.benchmarks.papers.transfer_tensors.families import cook_torrance
from metamer.benchmarks.papers.transfer_tensors.parametric import Tuned
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.scene import framing_camera
from metamer.lighting.transfer.precomputation import Precomputation
from metamer.materials.core.points import Points
from metamer.runtime import memory
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

FAMILY = cook_torrance()
NONE, ONE = np.zeros(len(NM)), np.ones(len(NM))
RED = np.interp(NM, [380, 560, 620, 780], [0.04, 0.08, 0.75, 0.8])
GREEN = np.interp(NM, [380, 480, 540, 600, 780], [0.05, 0.1, 0.6, 0.1, 0.08])
GOLD = np.interp(NM, [380, 480, 560, 780], [0.35, 0.4, 0.85, 0.95])
EYE = (0.2, 0.6, 3.0)


def matt(colour):
    return Tuned(NM, colour, NONE, FAMILY, (0.04, 0.3))


def gloss(colour, body=NONE, roughness=0.3):
    return Tuned(NM, body, colour, FAMILY, (0.6, roughness))


def slanting(name="D65"):
    return DirectionalLight((0.3, 0.5, 0.8), illuminant(name))


def worn(scene, *surfaces, lights=None):
    """The scene with a material on each part."""
    lights = (slanting(),) if lights is None else lights
    parts = tuple(replace(part, material=part.name) for part in scene.parts)
    return replace(scene, parts=parts, lights=lights), dict(zip((part.name for part in parts), surfaces, strict=True))


@pytest.fixture(scope="module")
def corner(scene_of, room):
    """The floor and the back of a room: two sheets that touch at a right angle."""
    floor, back = room[2], room[4]
    return scene_of(floor, back)


@pytest.fixture(scope="module")
def geometry(corner):
    return Precomputation.of(corner, 64, 0.4)


SAMPLED = SpectralBasis.sampled()


def test_glossy_exits_are_the_sum_over_rays_at_every_wavelength(corner, geometry):
    """One bounce, worked out site by site, ray by ray and wavelength by wavelength."""
    gold = gloss(GOLD)
    scene, surfaces = worn(corner, gold, matt(RED))
    state = Relighting.of(scene, surfaces, geometry, SAMPLED, bounces=1, dtype=np.float64)
    found, rays = state.exits(EYE), state.rays
    centre, radius = geometry.centre_and_radius
    evenly = np.where(geometry.hits.part_of_site == 1, state.received.lux[:, 0].astype(float), 0.0)
    lux = rays.parts[0].brings[:, : len(evenly)] @ evenly
    to = (np.array(EYE) - centre) / radius - geometry.hits.sites.starts[rays.sites]
    wo = np.einsum("nij,nj->ni", geometry.frames[rays.sites], to / np.linalg.norm(to, axis=1, keepdims=True))
    weights = scene.observer.weights(illuminant("D65"), NM) / 1000.0
    assert (wo[:, 2] > 0.1).sum() > 20
    for number in np.flatnonzero(wo[:, 2] > 0.1):
        wi = rays.local[number].astype(float)
        points = Points(wi, np.tile(wo[number], (len(wi), 1)))
        scalar = gold.scalars(points)[:, 1:]
        highlight = gold.at(points) * state.reflections[0].correction(scalar[None], wo[number, 2:])[0, 0]
        brought = lux[number * rays.rays : (number + 1) * rays.rays, None] * RED
        xyz = (np.pi / rays.rays) * (highlight * brought).sum(axis=0) @ weights.T
        assert np.abs(found[rays.sites[number]] - xyz).max() <= 1e-12


def test_light_by_way_of_a_highlight_is_the_brdf_at_the_ends_of_rays(corner, geometry):
    gold = gloss(GOLD)
    scene, surfaces = worn(corner, matt(RED), gold)
    state = Relighting.of(scene, surfaces, geometry, SAMPLED, bounces=1, dtype=np.float64)
    hits, light = geometry.hits, scene.lights[0]
    part, free = hits.part_of_site, state.received.free[0][2]
    number, share = hits.ends()
    checked = 0
    for site in np.flatnonzero(part == 0)[::7]:
        expected = np.zeros(len(NM))
        for ray, to in enumerate(hits.directions(slice(site, site + 1))[0]):
            about, of = number[site, ray], share[site, ray]
            if not of.any() or part[about[0]] != 1:
                continue
            frame = geometry.frames[about[0]]
            wi, wo = frame @ light.direction_to_light, frame @ -to
            if wi[2] > 0.0 and wo[2] > 0.0:
                f_r = gold.at(Points(wi[None], wo[None]))[0]
                expected += np.pi * f_r * wi[2] * light.illuminance_lux * (of @ free[about]) / hits.rays
        np.testing.assert_allclose(state.arriving[site, 0], expected, rtol=1e-5, atol=1e-9)
        checked += expected.max() > 1.0
    assert checked > 3


@pytest.mark.parametrize("name", ["D65", "A", "FL11"])
def test_few_coefficients_show_what_all_wavelengths_do(corner, geometry, name):
    scene, surfaces = worn(corner, gloss(GOLD, 0.2 * GREEN), matt(RED), lights=(slanting(name),))
    few, all_of_them = (Relighting.of(scene, surfaces, geometry, basis) for basis in (None, SAMPLED))
    assert 3 <= few.basis.size <= 12
    # Beside what a perfect diffuser sends back: dark sites are not judged by themselves.
    seen = [np.maximum(one.exits(EYE), 0.0) for one in (all_of_them, few)]
    assert seen[0][:, 1].max() > 0.05
    assert delta_e_xyz(*seen, scene.adopted_white()).max() <= 0.1


def test_another_material_is_as_if_made_with_it(corner, geometry):
    scene, surfaces = worn(corner, gloss(GOLD), matt(RED))
    state = Relighting.of(scene, surfaces, geometry)
    state.exits(EYE)
    for surface in (matt(GREEN), gloss(GREEN, 0.1 * RED, 0.2)):
        changed = state.with_material("0", surface)
        fresh = Relighting.of(scene, {**surfaces, "0": surface}, geometry, changed.basis)
        np.testing.assert_allclose(changed.exits(EYE), fresh.exits(EYE), rtol=1e-5, atol=1e-7)
    assert state.with_material("0", gloss(GREEN)).received is state.received


def test_a_static_part_keeps_its_material_and_what_it_is_seen_by(corner, geometry, monkeypatch):
    """The last four viewers of it cost nothing again, also after another part's material and the light changed."""
    scene, surfaces = worn(corner, gloss(GOLD), gloss(RED))
    parts = (replace(geometry.scene.parts[0], static=True), geometry.scene.parts[1])
    fixed = replace(geometry, scene=replace(geometry.scene, parts=parts), _glossy={})
    state, plain = (Relighting.of(scene, surfaces, one) for one in (fixed, geometry))
    with pytest.raises(InputError, match="a static part keeps its material"):
        state.with_material("0", matt(RED))
    views, made, weigh = [(0.2, 0.6, 3.0 + 0.1 * k) for k in range(4)], [], final_gather.Weights.of
    monkeypatch.setattr(final_gather.Weights, "of", lambda *given: made.append(given[2].part) or weigh(*given))
    for eye in views:
        np.testing.assert_array_equal(state.exits(eye), plain.exits(eye))
    made.clear()
    for eye in views:
        state.exits(eye)
    assert made == [1, 1, 1, 1]
    made.clear()
    state.with_material("1", gloss(GREEN)).with_lights(slanting("A")).exits(views[1])
    assert made == [1]
    made.clear()
    state.exits((0.0, 1.0, 3.0))
    assert sorted(made) == [0, 1]


def test_another_light_is_as_if_made_with_it(corner, geometry):
    scene, surfaces = worn(corner, gloss(GOLD), matt(RED))
    state = Relighting.of(scene, surfaces, geometry)
    state.exits(EYE)
    light = replace(slanting("A"), direction_to_light=(-0.5, 0.7, 0.3))
    fresh = Relighting.of(replace(scene, lights=(light,)), surfaces, geometry, state.with_lights(light).basis)
    np.testing.assert_allclose(state.with_lights(light).exits(EYE), fresh.exits(EYE), rtol=1e-5, atol=1e-7)
    # Nothing is planned anew for a spectrum that is known.
    assert state.with_lights(replace(state.lights[0], illuminance_lux=500.0)).basis is state.basis


def test_another_illuminant_is_another_fold(corner, geometry):
    scene, surfaces = worn(corner, gloss(GOLD), matt(RED))
    state = Relighting.of(scene, surfaces, geometry, SAMPLED, bounces=3)
    both = state.exits(EYE, (None, illuminant("A")))
    other = state.with_lights(slanting("A"), basis=SAMPLED)
    np.testing.assert_allclose(both[:, :3], state.exits(EYE), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(both[:, 3:], other.exits(EYE), rtol=1e-4, atol=1e-6)


def test_three_spectra_at_once_are_each_as_if_alone(corner, geometry):
    lamps = [replace(slanting(name), direction_to_light=to) for name, to in
             (("D65", (0.3, 0.5, 0.8)), ("A", (-0.4, 0.6, 0.3)), ("FL11", (0.0, 1.0, 0.4)))]  # fmt: skip
    scene, surfaces = worn(corner, gloss(GOLD), matt(RED), lights=tuple(lamps))
    together = Relighting.of(scene, surfaces, geometry, SAMPLED, bounces=2)
    alone = [together.with_lights(lamp, basis=SAMPLED).exits(EYE) for lamp in lamps]
    np.testing.assert_allclose(together.exits(EYE), sum(alone), rtol=1e-4, atol=1e-6)


def test_light_of_one_line(corner, geometry):
    """What it shows after any bounces is the colour of its one wavelength."""
    line = Spectrum(np.array([0.0, 1.0, 0.0]), np.array([589.0, 590.0, 591.0]), "emission")
    scene, surfaces = worn(corner, gloss(GOLD), matt(RED), lights=(replace(slanting(), spectrum=line),))
    state = Relighting.of(scene, surfaces, geometry)
    found, white = state.exits(EYE), scene.observer.white(line)
    lit = found[:, 1] > 1e-3
    assert lit.sum() > 20
    np.testing.assert_allclose(found[lit] / found[lit, 1:2], np.tile(white, (lit.sum(), 1)), rtol=2e-3, atol=2e-3)


def test_a_mirror_like_trim_shows_what_is_before_it(scene_of, squares):
    """A wall that sends out evenly, close before a narrow highlight: what leaves is the wall times the albedo."""
    trim, wall = squares(0.02)
    scene, surfaces = worn(scene_of(trim, wall), gloss(ONE, roughness=0.08), matt(RED))
    prepared = Precomputation.of(scene, 1024, 0.5)
    state = Relighting.of(scene, surfaces, prepared, SAMPLED, bounces=1)
    # Light is put where it cannot come: on the side of the wall that looks at the trim.
    lux = np.zeros_like(state.received.lux)
    inner = (prepared.hits.part_of_site == 1) & (prepared.hits.sites.normals[:, 1] < 0.0)
    lux[inner] = 1000.0
    state = replace(state, _received=replace(state.received, lux=lux, free=()))
    eye = (0.0, 0.015, 0.0)
    found = state.exits(eye)
    under = (prepared.hits.part_of_site == 0) & (prepared.hits.sites.normals[:, 1] > 0.0)
    near = np.flatnonzero(under)[np.argmin(np.linalg.norm(prepared.hits.sites.starts[under][:, [0, 2]], axis=1))]
    expected = 0.6 * RED @ scene.observer.weights(illuminant("D65"), NM)[1]
    assert found[near, 1] == pytest.approx(expected, rel=0.05)


def test_a_black_scene_gives_nothing_back(corner, geometry):
    scene, surfaces = worn(corner, matt(NONE), matt(NONE))
    state = Relighting.of(scene, surfaces, geometry)
    assert not state.arriving.any()
    assert not state.exits(EYE).any()


def test_a_closed_white_box_converges(scene_of, room):
    """All receive E and pass on rho of all: rho E / (1 - rho) comes back, and the tail is known."""
    light = replace(slanting(), direction_to_light=(0.0, 1.0, 0.0))
    scene, surfaces = worn(scene_of(*room), *[matt(0.8 * ONE)] * 6, lights=(light,))
    prepared = Precomputation.of(scene, 64, 0.5)
    state = Relighting.of(scene, surfaces, prepared, SAMPLED, enough=1e-3)
    inside = np.asarray(prepared.operator.sum(axis=1)) > 0.5
    lux = np.where(inside, 1000.0, 0.0).astype(np.float32)[:, None]
    state = replace(state, _received=replace(state.received, lux=lux))
    np.testing.assert_allclose(state.arriving[inside], 4000.0, rtol=2e-3)
    assert state.passed.left <= 1e-3
    assert state.passed.bound < 0.1


def test_a_white_of_99_percent(scene_of, room):
    scene, surfaces = worn(scene_of(*room), *[matt(0.99 * ONE)] * 6)
    prepared = Precomputation.of(scene, 32, 1.0)
    state = Relighting.of(scene, surfaces, prepared)
    inside = np.asarray(prepared.operator.sum(axis=1)) > 0.5
    lux = np.where(inside, 1000.0, 0.0).astype(np.float32)[:, None]
    state = replace(state, _received=replace(state.received, lux=lux))
    y = state.arriving[inside][:, 0] @ state.coefficients.folds(ONE)[:, 1]
    np.testing.assert_allclose(y, 99.0, rtol=1e-2)


def test_one_triangle_alone(scene_of, squares):
    from metamer.lighting.mesh.mesh import Mesh

    whole = squares()[0]
    scene, surfaces = worn(scene_of(Mesh(whole.vertices[:3], whole.normals[:3], np.array([[0, 1, 2]]))), gloss(GOLD))
    state = Relighting.of(scene, surfaces, Precomputation.of(scene, 16, 9.0))
    assert len(state.exits(EYE)) == 6
    assert not state.exits(EYE).any()


def test_sheets_are_seen_from_both_sides(corner, geometry):
    """What is before a sheet does not come to its back."""
    scene, surfaces = worn(corner, gloss(GOLD), matt(RED))
    found = Relighting.of(scene, surfaces, geometry).arriving
    below = (geometry.hits.part_of_site == 0) & (geometry.hits.sites.normals[:, 1] < 0.0)
    assert below.any()
    assert not found[below].any()
    assert found[~below].any()


def test_parts_that_touch_light_each_other(corner, geometry):
    """Along the edge that floor and back share, nothing is lost: half of the hemisphere is the other part."""
    scene, surfaces = worn(corner, matt(RED), matt(RED))
    state = Relighting.of(scene, surfaces, geometry, bounces=1)
    sites = geometry.hits.sites
    inner = (geometry.hits.part_of_site == 0) & (sites.normals[:, 1] > 0.0)
    edge = inner & (np.linalg.norm(sites.starts[:, 1:] - sites.starts[inner, 1:].min(axis=0), axis=1) < 0.05)
    share = np.asarray(geometry.operator.sum(axis=1))[edge]
    assert len(share) >= 3
    assert np.isfinite(state.arriving).all()
    assert (state.arriving[edge].max(axis=(1, 2)) > 0.0).all()


def test_three_hundred_parts(scene_of, squares):
    from metamer.lighting.mesh.mesh import Mesh

    floor = squares()[0]
    meshes = [
        Mesh(0.05 * floor.vertices[:, [0, 2, 1]] * (1, 1, -1) + (0.07 * (n % 20), 0.07 * (n // 20), 0.01 * (n % 3)),
             floor.normals[:, [0, 2, 1]], floor.faces)
        for n in range(299)
    ]  # fmt: skip
    big = Mesh(2.0 * floor.vertices + (0.7, -0.05, 0.5), floor.normals, floor.faces)
    kinds = [gloss(GOLD), matt(RED), matt(GREEN)]
    scene, surfaces = worn(scene_of(*meshes, big), *(kinds[n % 3] for n in range(299)), matt(GREEN))
    state = Relighting.of(scene, surfaces, Precomputation.of(scene, 16, 5.0))
    found = state.exits((0.7, 0.5, 3.0))
    assert np.isfinite(found).all()
    assert found[:, 1].max() > 1e-3
    assert state.basis.size <= 12


def test_a_camera_sees_what_its_place_does(corner, geometry):
    scene, surfaces = worn(corner, gloss(GOLD), matt(RED))
    state = Relighting.of(scene, surfaces, geometry)
    near = framing_camera(*scene.bounds)
    np.testing.assert_allclose(state.exits(near), state.exits(near.position), rtol=1e-5, atol=1e-7)
    # A parallel view is one from very far off.
    far = replace(near, projection="orthographic", vertical_fov_deg=None, height=2.0)
    place = near.target + 1e7 * (near.position - near.target)
    np.testing.assert_allclose(state.exits(far), state.exits(place), rtol=1e-3, atol=1e-5)


def test_what_does_not_fit_into_memory_is_refused(corner, monkeypatch):
    scene, surfaces = worn(corner, gloss(GOLD), matt(RED))
    prepared = Precomputation.of(scene, 16, 0.8)
    state = Relighting.of(scene, surfaces, prepared)
    monkeypatch.setattr(memory, "available_bytes", lambda: 1000)
    with pytest.raises(InputError, match="glossy"):
        state.exits(EYE)


def test_bounces_below_none_are_refused(corner, geometry):
    scene, surfaces = worn(corner, matt(RED), matt(RED))
    with pytest.raises(InputError, match="bounce"):
        Relighting.of(scene, surfaces, geometry, bounces=-1)
    assert not Relighting.of(scene, surfaces, geometry, bounces=0).exits(EYE).any()
