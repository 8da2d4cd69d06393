"""The 2004 paper's transfer: harmonics of light around a scene to those that arrive, in clusters, under BTFs."""

import numpy as np
import pytest
from btf_samples import bumps, sky
from metamer.benchmarks.papers.harmonics import harmonics, project_light
from metamer.benchmarks.papers.transfer_tensors import clustered_harmonic, harmonic
from metamer.benchmarks.papers.transfer_tensors.clustered_harmonic import clustered_transfer
from metamer.benchmarks.papers.transfer_tensors.harmonic import harmonic_transfer
from metamer.benchmarks.papers.transfer_tensors.harmonic_btf import HarmonicBtf, harmonic_weights, products
from metamer.lighting.environment import latlong
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.scene import Part, Scene, bounds_of, framing_camera
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.hits import tangents
from metamer.lighting.transfer.operator import irradiance_operator
from metamer.lighting.transfer.regions import Regions
from metamer.materials.btf.form import btf_form
from metamer.materials.btf.light_basis import hats_at
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer

NM = np.arange(400.0, 701.0, 20.0)
BASIS = SpectralBasis.sampled(np.array([450.0, 600.0]))
SEEN = observer("1931_2")


def scene_of(*meshes):
    parts = tuple(Part(str(number), mesh, "matt") for number, mesh in enumerate(meshes))
    light = DirectionalLight((0.0, 1.0, 0.0), illuminant("D65"))
    return Scene(parts, (light,), (framing_camera(*bounds_of(meshes)),), observer("1931_2"))


def transfer_of(scene, reflectances, longest_edge=0.4, rays=1024):
    """Compute the transfer of one region a part, with the frames of the hits' own tangents."""
    hits, bodies = placed(scene, longest_edge).traced(512), placed(scene, longest_edge)
    normals = hits.sites.normals
    frames = np.stack([*tangents(normals), normals], axis=1)
    regions = Regions(hits.part_of_site, np.array(reflectances), BASIS)
    return hits, harmonic_transfer(bodies, hits, regions, frames, irradiance_operator(hits), rays)


@pytest.fixture(scope="module")
def open_ball():
    return transfer_of(scene_of(sphere(1)), [[0.5, 0.5]], 9.0)


def test_in_the_open_it_is_a_turn_of_what_is_above_the_horizon(open_ball):
    """Light that is a harmonic itself: its integrals with those of the frame, over directions above the site alone."""
    hits, transfer = open_ball
    number = np.arange(20000) + 0.5
    z, turn = number / 20000, np.pi * (1.0 + np.sqrt(5.0)) * number
    local = np.stack([np.sqrt(1.0 - z * z) * np.cos(turn), np.sqrt(1.0 - z * z) * np.sin(turn), z], axis=1)
    for site in (0, 7, 30):
        both = harmonics(local).T @ harmonics(local @ transfer.frames[site]) * (2.0 * np.pi / len(local))
        np.testing.assert_allclose(transfer.matrices[site, 0], both, atol=0.03)
        np.testing.assert_array_equal(transfer.matrices[site, 0], transfer.matrices[site, 1])
    assert (hits.triangle == -1).all()


def test_even_light_in_a_white_corner():
    """A floor under a wide ceiling: what does not come from around comes from the ceiling, as much as it reflects.

    Between two endless sheets no light arrives; between these, what does is between none and all.
    """
    floor, above = plane(1, 1), plane(8, 8).placed(translate=(0.0, 0.3, 0.0))
    down = Mesh(above.vertices, -above.normals, above.faces[:, ::-1])
    even = np.zeros((1, 25))
    even[0, 0] = np.sqrt(4.0 * np.pi)
    found = []
    for white in (0.0, 0.9):
        hits, transfer = transfer_of(scene_of(floor, down), [[0.0, 0.0], [white, 0.5 * white]])
        arriving = transfer.lit(even)[:, 0]
        # The harmonic of band 0 times sqrt(4 pi) is the integral of luminance: 2 pi in the open.
        whole = arriving[hits.sites.fronts[:4], :, 0] * np.sqrt(4.0 * np.pi)
        found.append(whole)
        outside = arriving[hits.sites.backs[-4:], :, 0] * np.sqrt(4.0 * np.pi)
        np.testing.assert_allclose(outside, 2.0 * np.pi, rtol=0.05)
    dark, lit = found
    assert (dark < 0.35 * 2.0 * np.pi).all()
    added = lit - dark
    assert (added > 0.0).all()
    # The floor is black: one bounce alone, so half as much of what reflects half.
    np.testing.assert_allclose(added[:, 1], 0.5 * added[:, 0], rtol=1e-5)


@pytest.mark.slow
def test_a_closed_white_box_passes_light_on_until_nothing_is_left():
    """Inside of a ball with a hole above, radiosity is a geometric series: as light, all that arrives is even."""
    ball = sphere(3)
    kept = ball.faces[ball.vertices[ball.faces].mean(axis=1)[:, 1] < 0.9]
    hollow = Mesh(ball.vertices, -ball.normals, kept[:, ::-1])
    even = np.zeros((1, 25))
    even[0, 0] = np.sqrt(4.0 * np.pi)
    hits, transfer = transfer_of(scene_of(hollow), [[0.5, 0.9]], 9.0, 256)
    inside = np.unique(hits.corners)
    # Illuminance by bounces: the hole is 5 per cent of the ball, and all of the rest sends alike.
    hole = 1.0 - np.asarray(irradiance_operator(hits).sum(axis=1)).ravel()[inside].mean()
    arriving = transfer.lit(even)[inside, 0, :, 0].mean(axis=0) * np.sqrt(4.0 * np.pi)
    direct = transfer_of(scene_of(hollow), [[0.0, 0.0]], 9.0, 256)[1].lit(even)[inside, 0, :, 0].mean(axis=0)
    luminance = hole * np.array([0.5, 0.9]) / (1.0 - np.array([0.5, 0.9]) * (1.0 - hole))
    expected = direct * np.sqrt(4.0 * np.pi) + luminance * (2.0 * np.pi - direct * np.sqrt(4.0 * np.pi))
    np.testing.assert_allclose(arriving, expected, rtol=0.03)


def test_light_that_does_not_end_is_refused(monkeypatch):
    monkeypatch.setattr(harmonic, "MOST", 3)
    square = plane(4, 4)
    down = Mesh(square.vertices + np.array([0.0, 1.0, 0.0]), -square.normals, square.faces[:, ::-1])
    with pytest.raises(InputError, match="does not end"):
        transfer_of(scene_of(square, down), [[0.9, 0.9]] * 2, 0.9, 16)


@pytest.fixture
def few_coordinates(monkeypatch):
    monkeypatch.setattr(clustered_harmonic, "_COORDINATES", 24)


@pytest.fixture(scope="module")
def shadowed():
    """Balls above a floor, and their transfer."""
    ball = sphere(2, 0.5)
    scene = scene_of(plane(4, 4), *(ball.placed(translate=(x, 0.7, 0.0)) for x in (-1.0, 0.4)))
    return transfer_of(scene, [[0.4, 0.6], [0.7, 0.2], [0.2, 0.7]], 0.5, 512)


@pytest.mark.usefixtures("few_coordinates")
def test_clusters_are_the_better_the_more_of_them(shadowed):
    _, transfer = shadowed
    light = project_light(sky(1))
    truth = transfer.lit(light)
    off = []
    for clusters, components in ((1, 1), (6, 4), (16, 8)):
        found = clustered_transfer(transfer, clusters, components)
        assert found.nbytes < transfer.nbytes
        off.append(np.linalg.norm(found.lit(light) - truth) / np.linalg.norm(truth))
        matrices = np.einsum("sc,scjab->sjab", found.weights, found.matrices[found.number, 1:])
        matrices += found.matrices[found.number, 0]
        left = np.sum((matrices - transfer.matrices) ** 2) / np.sum(transfer.matrices**2)
        assert left == pytest.approx(found.error, rel=0.02, abs=1e-5)
    assert off[2] < 0.9 * off[1] < 0.5 * off[0]
    assert off[2] < 0.2


def test_as_many_clusters_as_sites_are_exact(open_ball):
    _, transfer = open_ball
    light = project_light(sky(2))
    found = clustered_transfer(transfer, 1000, 1)
    np.testing.assert_allclose(found.lit(light), transfer.lit(light), atol=1e-3 * np.abs(light).max())


@pytest.mark.usefixtures("few_coordinates")
def test_equal_seeds_are_equal_clusters(shadowed):
    one, other = (clustered_transfer(shadowed[1], 4, 2, seed=3) for _ in range(2))
    assert np.array_equal(one.number, other.number)
    assert np.array_equal(one.matrices, other.matrices)


@pytest.fixture(scope="module")
def cloth():
    return HarmonicBtf(texels=btf_form(bumps(6, 6, views=3, lights=4)).texels)


def test_a_btf_gathers_what_arrives(cloth):
    """In the open, the sum over directions of its own texels' values times light that 25 harmonics hold exactly."""
    draw = np.random.default_rng(4)
    arriving = 0.2 * draw.normal(size=(6, 1, 1, 25))
    arriving[..., 0] += 2.0
    uv, wo = draw.uniform(size=(6, 2)), np.tile([0.3, 0.1, np.sqrt(0.9)], (6, 1))
    own, one = cloth.texels.form.basis, SpectralBasis.sampled(np.array([400.0, 700.0]))
    both = np.concatenate([arriving, np.zeros_like(arriving)], axis=2)
    product = products(own, one, (illuminant("A"),), SEEN, np.pi)
    # The light's coefficient at 400 nm alone: a ramp from 1 there to 0 at 700 nm, nothing beyond, on the BTF's grid.
    found = cloth.xyz(uv, wo, both, product)
    values = np.einsum("nbp,nb->np", cloth.terms(uv, wo), arriving[:, 0, 0])
    ramp = np.clip((700.0 - own.wavelengths_nm) / 300.0, 0.0, 1.0)
    spectra = own.reconstruct(values) * ramp
    expected = np.pi * spectra @ SEEN.weights(illuminant("A"), own.wavelengths_nm).T
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_harmonics_of_hats_are_integrals_over_them(cloth):
    """Of light that 25 harmonics hold, at the texels of a map."""
    lights, light = cloth.texels.form.lights, np.random.default_rng(5).normal(size=25)
    to, solid = latlong.texel_directions(128, 256).reshape(-1, 3), np.repeat(latlong.solid_angles(128, 256), 256)
    expected = hats_at(lights, to).T @ (solid * (harmonics(to) @ light))
    np.testing.assert_allclose(harmonic_weights(lights) @ light, expected, atol=2e-3 * np.abs(expected).max())
