"""Light that comes by way of other surfaces, at the sites of scenes whose answer is known, and between them."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.lights import PointLight
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.transfer.diffuse_albedo import even_albedo
from metamer.lighting.transfer.indirect import (
    FLUX,
    RADIANCE,
    arriving,
    indirect_light,
    lessened,
    light_at,
    needs_none,
    radiance_under_lobes,
)
from metamer.lighting.transfer.ray_light import RayLight
from metamer.lighting.transfer.transport import Transport
from metamer.materials.core.environment_form import bends
from metamer.materials.factored.pack import matt_brdf
from metamer.runtime.errors import InputError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM


def matt(reflectance):
    return matt_brdf(np.ones(1), Palette.of(np.broadcast_to(reflectance, (1, 81)) / np.pi))


@pytest.fixture(scope="module")
def lit_room(scene_of, room):
    """The room with a lamp that is not in its middle, and its rays."""
    scene = replace(scene_of(*room), lights=(PointLight((0.3, -0.2, 0.1), illuminant("D65"), 500.0),), bounces="auto")
    return scene, Transport.of(scene, rays=128)


def lux(light):
    """(S,) illuminance of a light of one spectrum, as observers have it."""
    return light.at_sites[:, 0] @ light.basis.fold(light.spectra[0], observer("1931_2"))[1]


def inside(transport):
    return np.asarray(transport.prepared.operator.sum(axis=1)).ravel() > 0.5


def test_a_closed_white_box_multiplies_its_light(lit_room):
    """Of a share rho that all pass on, rho / (1 - rho) times the direct light arrives, as a mean over all walls."""
    scene, transport = lit_room
    found = indirect_light(scene, {"matt": matt(0.7)}, transport, enough=1e-3)
    some, areas = inside(transport), transport.hits.areas
    # 500 cd in all directions, over 24 square metres.
    direct = 4.0 * np.pi * 500.0 / 24.0
    assert np.average(lux(found)[some], weights=areas[some]) == pytest.approx(direct * 0.7 / 0.3, rel=0.02)


def test_a_number_of_bounces_is_kept_to(lit_room):
    scene, transport = lit_room
    some, areas, surfaces = inside(transport), transport.hits.areas, {"matt": matt(0.5)}
    found = [indirect_light(replace(scene, bounces=count), surfaces, transport) for count in (1, 2, 3)]
    assert [one.bounces for one in found] == [1, 2, 3]
    first, second, third = (np.average(lux(one)[some], weights=areas[some]) for one in found)
    assert (third - second) / (second - first) == pytest.approx(0.5, rel=0.02)
    assert (second - first) / first == pytest.approx(0.5, rel=0.05)


def test_black_surfaces_pass_nothing_on(lit_room):
    scene, transport = lit_room
    assert indirect_light(scene, {"matt": matt(0.0)}, transport).bounces == 0


def test_colours_multiply_at_every_wavelength(lit_room):
    """What arrives after one bounce has the reflectance's spectrum times the light's, in few numbers."""
    scene, transport = lit_room
    red = np.interp(NM, [380, 560, 620, 780], [0.04, 0.08, 0.75, 0.8])
    found = indirect_light(replace(scene, bounces=1), {"matt": matt(red)}, transport)
    some = found.at_sites[inside(transport), 0]
    spectra = found.basis.reconstruct(some.astype(float))
    scale = spectra @ red / (red @ red)
    assert found.basis.size < 8
    np.testing.assert_allclose(spectra / scale[:, None], np.tile(red, (len(spectra), 1)), atol=0.02)


def test_lights_of_several_spectra_stay_apart(lit_room):
    """K = 3, one of them a single line: each comes back as it would alone."""
    scene, transport = lit_room
    line = Spectrum(np.array([0.0, 1.0, 0.0]), np.array([588.0, 589.0, 590.0]), "emission")
    places = (((0.3, -0.2, 0.1), illuminant("D65")), ((-0.5, 0.4, 0.0), illuminant("A")), ((0.0, 0.5, 0.5), line))
    lamps = [PointLight(place, spectrum, 100.0) for place, spectrum in places]
    surfaces = {"matt": matt(0.6)}
    together = indirect_light(replace(scene, lights=(*lamps, lamps[0]), bounces=2), surfaces, transport)
    assert len(together.spectra) == 3
    for number, lamp in enumerate(lamps):
        alone = indirect_light(replace(scene, lights=(lamp,), bounces=2), surfaces, transport)
        size = together.basis.size
        one = (
            together.at_sites[:, 0, number * size : (number + 1) * size]
            @ together.basis.fold(lamp.spectrum, scene.observer).T
        )
        other = alone.at_sites[:, 0] @ alone.basis.fold(lamp.spectrum, scene.observer).T
        # The first lamp is there twice.
        np.testing.assert_allclose(one, other * (2.0 if number == 0 else 1.0), rtol=1e-3, atol=1e-3)


def test_what_is_even_has_the_moments_of_even_light(scene_of, hollow):
    """Inside a ball that sends the same from everywhere: the moments, the flux and the radiance in closed form."""
    transport = Transport.of(scene_of(hollow), rays=256)
    some = inside(transport)
    at = arriving(transport.hits, RayLight(np.full((len(some), 1), 1000.0)))[some, :, 0]
    normals = transport.hits.sites.normals[some]
    np.testing.assert_allclose(at[:, 0], 1000.0, rtol=1e-3)
    np.testing.assert_allclose(at[:, 1:4], 2000.0 / 3.0 * normals, atol=15.0)
    np.testing.assert_allclose(at[:, FLUX], 1000.0 * normals, atol=1.0)
    expected = np.zeros(9)
    expected[0] = 1000.0 / np.pi
    np.testing.assert_allclose(at[:, RADIANCE], np.tile(expected, (len(at), 1)), atol=0.5)


def test_the_flux_of_what_changes_with_direction(scene_of, hollow):
    """Inside a ball whose radiosity is 1000 (1 + y / 2): beside sums over directions."""
    transport = Transport.of(scene_of(hollow), rays=256)
    hits, some = transport.hits, inside(transport)
    slope = hits.sites.starts[:, 1:2] / np.abs(hits.sites.starts[some]).max()
    at = arriving(hits, RayLight(1000.0 * (1.0 + 0.5 * slope)))
    to = np.random.default_rng(1).normal(size=(200_000, 3))
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    for site in np.flatnonzero(some)[::200]:
        normal, place = hits.sites.normals[site], hits.sites.starts[site]
        place = place / np.linalg.norm(place)
        up = to[to @ normal > 0.0]
        # The end of a chord of the unit ball.
        end = place - 2.0 * (up @ place)[:, None] * up
        expected = (1000.0 * (1.0 + 0.5 * end[:, 1:2]) * up).mean(axis=0) * 2.0
        np.testing.assert_allclose(at[site, FLUX, 0], expected, atol=25.0)


def test_even_light_from_above_follows_a_leaning_normal():
    """A surface that leans by t receives (1 + cos t) / 2 of it, and its moments add up to that."""
    up, t = np.array([[0.0, 0.0, 1.0]]), 0.6
    even = np.zeros((1, 21, 1))
    even[0, :9, 0] = 1.0, 0.0, 0.0, 2.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.5
    even[0, FLUX, 0], even[0, RADIANCE.start, 0] = (0.0, 0.0, 1.0), 1.0 / np.pi
    moments, radiance = light_at(even, up, np.array([[np.sin(t), 0.0, np.cos(t)]]))
    assert moments[0, 0, 0] == pytest.approx(0.5 * (1.0 + np.cos(t)))
    assert radiance[0, 0, 0] == pytest.approx(1.0 / np.pi)
    straight, _ = light_at(even, up, up)
    np.testing.assert_allclose(straight, even[:, :9])


def test_gaussians_lessen_what_changes_with_direction():
    """Beside sums over directions drawn from the Gaussian."""
    rng = np.random.default_rng(3)
    axis, radiance = np.array([0.36, 0.48, 0.8]), rng.normal(size=(1, 9, 1))
    for sharpness in (0.05, 0.2, 3.0, 40.0):
        cosine = 1.0 + np.log1p(rng.random(400_000) * np.expm1(-2.0 * sharpness)) / sharpness
        turn, sine = 2.0 * np.pi * rng.random(len(cosine)), np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        across = np.linalg.svd(axis[None])[2][1:]
        to = cosine[:, None] * axis + sine[:, None] * (
            np.cos(turn)[:, None] * across[0] + np.sin(turn)[:, None] * across[1]
        )
        expected = (bends(to) @ radiance[0, :, 0]).mean()
        found = radiance_under_lobes(radiance, axis[None, None], np.array([[sharpness]]))[0, 0, 0]
        assert found == pytest.approx(expected, abs=0.01)
    below, above = lessened(np.array([0.2 - 1e-9, 0.2]))
    assert below[0] == pytest.approx(below[1], rel=1e-4) and above[0] == pytest.approx(above[1], rel=1e-3)


def test_even_albedo_of_a_matt_surface_is_its_reflectance():
    red = np.linspace(0.05, 0.8, 81)
    np.testing.assert_allclose(even_albedo(matt(red)), red, rtol=1e-6)


def test_one_convex_body_needs_none(scene_of, hollow):
    assert needs_none(scene_of(sphere(2)))
    assert not needs_none(scene_of(hollow))
    assert not needs_none(scene_of(sphere(2), sphere(2)))


def test_what_is_no_number_of_bounces_is_refused(lit_room):
    with pytest.raises(InputError, match="bounces"):
        replace(lit_room[0], bounces=-1)
