"""Light that glossy parts send out by direction, beside closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.transfer import bounce_solver
from metamer.lighting.transfer.coefficients import Coefficients
from metamer.lighting.transfer.indirect import indirect_light
from metamer.lighting.transfer.ray_light import GlossyLight, RayLight, glossy_light, glossy_parts
from metamer.lighting.transfer.transport import Transport
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.factored.pack import FactoredBrdf, matt_brdf
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.bispectral import Bispectral
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

from ...viewer.scenes import lobe_pack

MATT = matt_brdf(np.ones(1), Palette.of(np.full((1, len(NM)), 0.5 / np.pi)))
GLOSS = FactoredBrdf((*MATT.packs, lobe_pack(0.3)))
BASIS = SpectralBasis.sampled()
D65, A = illuminant("D65"), illuminant("A")


def sun(to, spectrum=D65, lux=1000.0):
    return DirectionalLight(np.array(to, dtype=float), spectrum, lux)


@pytest.fixture(scope="module")
def ball_over_floor(scene_of):
    """A matt ball over a glossy floor, which wear "matt" and "gloss"."""
    scene = scene_of(plane(3.0, 3.0), sphere(2, radius=0.4).placed(translate=(0.0, 0.7, 0.0)))
    parts = tuple(replace(one, material=name) for one, name in zip(scene.parts, ("gloss", "matt"), strict=True))
    scene = replace(scene, parts=parts)
    return scene, Transport.of(scene, rays=256)


SURFACES = {"gloss": GLOSS, "matt": MATT}


def lit(scene, transport, lights, spectrum, spectra=1):
    glossy = glossy_parts(transport.prepared, scene, SURFACES)
    lux = np.zeros((len(transport.hits.sites), spectra))
    coefficients = Coefficients(BASIS, (illuminant("D65"),) * spectra, scene.observer, 1000.0)
    return glossy_light(transport.prepared, glossy, lights, spectrum, coefficients, lux)[0]


def test_only_what_is_glossy_sends_out_by_direction(ball_over_floor):
    scene, transport = ball_over_floor
    assert list(glossy_parts(transport.prepared, scene, SURFACES)) == [0]
    assert not glossy_parts(transport.prepared, scene, {"gloss": MATT, "matt": MATT})


def test_what_is_the_same_in_all_directions_arrives_as_of_matt_parts(ball_over_floor):
    """Cells that send out 1 are sites that do."""
    _, transport = ball_over_floor
    rays = transport.prepared.glossy_rays(np.array([True, False]))
    ones = np.ones((len(rays.sites) * len(rays.cells), 2), np.float32)
    even = GlossyLight(rays, transport.prepared.frames, ones, np.zeros((len(rays.ray), 2), np.float32))
    floor = (transport.hits.part_of_site == 0).astype(float)
    wanted = transport.prepared.operator @ floor
    assert wanted.max() > 0.3
    np.testing.assert_allclose(even.irradiance(transport.hits), np.stack([wanted, wanted], axis=1), atol=1e-5)
    sites = np.arange(40, 70)
    to = transport.hits.directions(slice(40, 70))
    beside = RayLight(floor[:, None]).along(transport.hits, sites, to)
    along = RayLight(np.zeros((len(floor), 2)), even).along(transport.hits, sites, to)
    np.testing.assert_allclose(along, np.repeat(beside, 2, axis=2), atol=1e-5)


def test_a_highlight_goes_where_the_mirrored_direction_is(ball_over_floor):
    """Of a low sun: to the side of the ball that looks at the sun."""
    scene, transport = ball_over_floor
    hits = transport.hits
    ball, side, areas = hits.part_of_site == 1, hits.sites.normals[:, 0], hits.areas

    def looks(along):
        return ball & (along > 0.7), ball & (along < -0.7)

    for sign in (1.0, -1.0):
        found = lit(scene, transport, [sun((sign, 0.4, 0.0))], [0]).irradiance(hits)[:, 40]
        near, far = (np.average(found[one], weights=areas[one]) for one in looks(sign * side))
        assert near > 1.6 * far


@pytest.mark.slow
def test_lights_of_one_spectrum_add_up_and_others_stay_apart(ball_over_floor):
    scene, transport = ball_over_floor
    sky = EnvironmentLight(np.ones((1, 8, 16)), (A,), 300.0)
    lights = [sun((1.0, 0.5, 0.0)), sky, sun((-0.3, 1.0, 0.2)), sun((0.0, 1.0, 0.8), A)]
    size = BASIS.size
    together = lit(scene, transport, lights, [0, 1, 0, 1], 2).irradiance(transport.hits)
    alone = [lit(scene, transport, [one], [0]).irradiance(transport.hits) for one in lights]
    assert min(one.max() for one in alone) > 1.0
    np.testing.assert_allclose(together[:, :size], alone[0] + alone[2], rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(together[:, size:], alone[1] + alone[3], rtol=1e-4, atol=1e-3)


def test_glossy_parts_of_too_many_sites_pass_light_on_as_matt_ones(ball_over_floor, monkeypatch):
    scene, transport = ball_over_floor
    scene = replace(scene, lights=(sun((1.0, 0.4, 0.0)),), bounces=1)
    known = indirect_light(scene, SURFACES, transport)
    monkeypatch.setattr(bounce_solver, "MOST_GLOSSY", 10)
    without = indirect_light(scene, SURFACES, transport)
    assert "pass light on as matt ones" in without.words and "as matt" not in known.words
    assert np.abs(known.at_sites - without.at_sites).max() > 1.0


def test_highlights_beside_what_fluoresces_go_by_direction_too(ball_over_floor):
    """A dye that takes no light is an ordinary surface: by radiance as relative to light."""
    scene, transport = ball_over_floor
    scene = replace(scene, lights=(sun((0.5, 1.0, 0.0)),), bounces=2)
    plain = FluorescentLambert(Bispectral.diagonal(Spectrum.sampled(NM, np.full(len(NM), 0.5), "reflectance")))
    seen = []
    for surfaces in (SURFACES, SURFACES | {"matt": plain.own_form()}):
        light = indirect_light(scene, surfaces, transport)
        radiant = light.radiant is not None
        coefficients = Coefficients(light.basis, light.spectra, scene.observer, 1000.0, radiant)
        seen.append(light.at_sites[:, 0] @ coefficients.to_xyz)
    assert radiant and "as matt ones" not in light.words
    assert seen[0][:, 1].max() > 0.1
    assert delta_e_xyz(*(np.maximum(one, 0.0) for one in seen), scene.adopted_white()).max() <= 0.1
