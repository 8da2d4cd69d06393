"""Interreflection at sites where some parts fluoresce: coefficients of radiance."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.benchmarks.papers.site_relighting.relighting import Relighting
from metamer.benchmarks.papers.transfer_tensors.families import cook_torrance
from metamer.benchmarks.papers.transfer_tensors.parametric import Tuned
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.transfer.indirect import indirect_light
from metamer.lighting.transfer.precomputation import Precomputation
from metamer.lighting.transfer.transport import Transport
from metamer.materials.analytic import Lambert
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.factored.pack import matt_brdf
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.bispectral import Bispectral, fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

EYE = (0.2, 0.6, 3.0)
GOLD = np.interp(NM, [380, 480, 560, 780], [0.35, 0.4, 0.85, 0.95])
RED = np.interp(NM, [380, 560, 620, 780], [0.04, 0.08, 0.75, 0.8])
EVERY = np.arange(360.0, 831.0)
SAMPLED = SpectralBasis.sampled(EVERY)


def reflectance(values):
    return Spectrum.sampled(NM, values, "reflectance")


def about(centre):
    return np.exp(-(((NM - centre) / 30.0) ** 2))


DYE = fluorophore(reflectance(np.full(NM.size, 0.3)), 0.6 * about(420), about(520), 0.9)
GLOWING, DULL = FluorescentLambert(DYE), Lambert(DYE.reflectance)
CRIMSON = Lambert(reflectance(RED))
WHITE = Lambert(reflectance(np.full(NM.size, 0.8)))
METAL = Tuned(NM, np.zeros(NM.size), GOLD, cook_torrance(), (0.6, 0.3))


def slanting(name="D65", towards=(0.3, 0.5, 0.8)):
    return DirectionalLight(towards, illuminant(name))


def worn(scene, *surfaces, lights=None):
    parts = tuple(replace(part, material=part.name) for part in scene.parts)
    scene = replace(scene, parts=parts, lights=lights or (slanting(),))
    return scene, dict(zip((part.name for part in parts), surfaces, strict=True))


@pytest.fixture(scope="module")
def corner(scene_of, room):
    """The floor and the back of a room."""
    return scene_of(room[2], room[4])


@pytest.fixture(scope="module")
def geometry(corner):
    return Precomputation.of(corner, 64, 0.4)


def exactly(state):
    """Compute what lights give in double precision."""
    got = state.received
    return replace(state, _received=replace(got, lux=got.lux.astype(float), incoming=got.incoming.astype(float)))


@pytest.mark.slow_cases("A")
@pytest.mark.parametrize("name", ["D65", "A", "FL11"])
def test_fluorescent_parts_are_full_matrices_at_every_wavelength(corner, geometry, name):
    """Three bounces worked out with Donaldson matrices at each nanometre: sampled to rounding, few numbers unseen."""
    light = replace(slanting(name), illuminance_lux=5000.0)
    scene, surfaces = worn(corner, WHITE, GLOWING, lights=(light,))
    state = exactly(Relighting.of(scene, surfaces, geometry, SAMPLED, bounces=3, dtype=np.float64))
    part, seen_by = geometry.hits.part_of_site, scene.observer
    matrices = np.stack([one.on(EVERY) for one in (Bispectral.diagonal(WHITE.reflectance), DYE)])
    power = light.spectrum.averaged(EVERY).samples / seen_by.luminous(light.spectrum)
    own = DYE.radiance(light.spectrum, EVERY) / seen_by.luminous(light.spectrum)
    first = np.stack([np.diag(matrices[0]) * power, own])[part] * state.received.lux

    def sent(arriving):
        found = np.empty_like(arriving)
        for number, matrix in enumerate(matrices):
            found[part == number] = arriving[part == number] @ matrix.T
        return found

    arriving = geometry.operator @ first
    second = sent(arriving)
    third = sent(geometry.later @ second)
    arriving = arriving + geometry.operator @ (second + third)
    truth = sent(arriving) @ seen_by.sensitivity(EVERY).T / 1000.0
    seen = state.exits(EYE)
    shown = seen.any(axis=1)
    assert shown.sum() > 40
    assert truth[shown, 1].max() > 0.1
    np.testing.assert_allclose(seen[shown], truth[shown], rtol=0, atol=1e-12)
    few = replace(Relighting.of(scene, surfaces, geometry, bounces=3), _received=state.received)
    assert few.basis.size <= 12
    assert delta_e_xyz(truth[shown], few.exits(EYE)[shown], scene.adopted_white()).max() <= 0.1
    dull = Relighting.of(scene, surfaces | {"1": DULL}, geometry, bounces=3)
    assert delta_e_xyz(truth[shown], dull.exits(EYE)[shown], scene.adopted_white()).max() > 0.8


def test_it_is_what_pictures_take(corner):
    """What arrives at the sites of a picture's transport, its later bounces by a quarter of the rays."""
    red = matt_brdf(np.ones(1), Palette.of(RED[None] / np.pi))
    scene, surfaces = worn(corner, red, GLOWING.own_form(), lights=(slanting("FL11"),))
    transport = Transport.of(replace(scene, bounces="auto"), rays=256)
    picture = indirect_light(replace(scene, bounces="auto"), surfaces, transport)
    state = Relighting.of(scene, surfaces, transport.prepared)
    ours = state.arriving[:, 0] @ state.coefficients.to_xyz
    to = scene.observer.sensitivity(picture.basis.wavelengths_nm) @ picture.basis.synthesis
    theirs = picture.at_sites[:, 0] @ to.T / 1000.0
    lit = theirs[:, 1] > 0.01
    assert lit.sum() > 100
    assert delta_e_xyz(theirs[lit], ours[lit], scene.adopted_white()).max() <= 0.3


def test_a_metal_shows_and_throws_what_glows(corner, geometry):
    """Seen in a glossy floor, and lit by it: by radiance as relative to the light, where nothing glows."""
    for surfaces in ((METAL, CRIMSON), (CRIMSON, METAL)):
        plain = [
            FluorescentLambert(Bispectral.diagonal(reflectance(RED))) if one is CRIMSON else one for one in surfaces
        ]
        lights = (slanting("D65"), slanting("A", (-0.3, 0.6, 0.5)))
        scene, worn_so = worn(corner, *surfaces, lights=lights)
        relative = Relighting.of(scene, worn_so, geometry)
        radiant = Relighting.of(scene, worn(corner, *plain)[1], geometry)
        assert (relative.coefficients.kinds, radiant.coefficients.kinds) == (2, 1)
        seen = [one.exits(EYE) for one in (relative, radiant)]
        assert seen[0][:, 1].max() > 0.05
        # The one is linear in reflectance between its samples, the other smooth.
        assert delta_e_xyz(*(np.maximum(one, 0.0) for one in seen), scene.adopted_white()).max() <= 0.2


def test_glossy_exits_with_a_dye_before_them_are_sums_over_rays(corner, geometry):
    scene, surfaces = worn(corner, METAL, GLOWING)
    state = exactly(Relighting.of(scene, surfaces, geometry, SAMPLED, bounces=1, dtype=np.float64))
    found, rays, light = state.exits(EYE), state.rays, scene.lights[0]
    centre, radius = geometry.centre_and_radius
    lux = np.where(geometry.hits.part_of_site == 1, state.received.lux[:, 0], 0.0)
    brought = rays.parts[0].brings[:, : len(lux)] @ lux
    to = (np.array(EYE) - centre) / radius - geometry.hits.sites.starts[rays.sites]
    wo = np.einsum("nij,nj->ni", geometry.frames[rays.sites], to / np.linalg.norm(to, axis=1, keepdims=True))
    glow = DYE.radiance(light.spectrum, EVERY) / scene.observer.luminous(light.spectrum)
    gold = state._fitting[0].spectra[0]
    seen = (gold * glow) @ scene.observer.sensitivity(EVERY).T / 1000.0
    assert (wo[:, 2] > 0.1).sum() > 20
    for number in np.flatnonzero(wo[:, 2] > 0.1):
        wi = rays.local[number].astype(float)
        scalar = state.reflections[0].scalars(wi, np.tile(wo[number], (len(wi), 1)))
        f_r = scalar[:, 0] * state.reflections[0].correction(scalar[None], wo[number, 2:])[0, 0]
        lit = f_r @ brought[number * rays.rays : (number + 1) * rays.rays] * np.pi / rays.rays
        np.testing.assert_allclose(found[rays.sites[number]], lit * seen, rtol=0, atol=1e-9)


def test_a_part_that_begins_or_ends_to_fluoresce_is_as_if_made_so(corner, geometry):
    scene, surfaces = worn(corner, METAL, CRIMSON)
    plain = Relighting.of(scene, surfaces, geometry)
    plain.exits(EYE)
    glowing = plain.with_material("1", GLOWING)
    assert (plain.coefficients.radiant, glowing.coefficients.radiant) == (False, True)
    fresh = Relighting.of(scene, {**surfaces, "1": GLOWING}, geometry)
    np.testing.assert_allclose(glowing.exits(EYE), fresh.exits(EYE), rtol=1e-4, atol=1e-6)
    # Direct irradiance is known, and the basis is kept where it is good.
    assert glowing.received is plain.received
    assert glowing.with_material("1", GLOWING).basis is glowing.basis
    back = glowing.with_material("1", CRIMSON)
    np.testing.assert_allclose(back.exits(EYE), plain.exits(EYE), rtol=1e-4, atol=1e-6)


def test_illuminants_each_excite_anew(corner, geometry):
    scene, surfaces = worn(corner, METAL, GLOWING)
    state = Relighting.of(scene, surfaces, geometry)
    both = state.exits(EYE, (None, illuminant("FL11")))
    alone = Relighting.of(replace(scene, lights=(slanting("FL11"),)), surfaces, geometry)
    np.testing.assert_allclose(both[:, :3], state.exits(EYE), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(both[:, 3:], alone.exits(EYE), rtol=1e-3, atol=1e-5)
    with pytest.raises(InputError, match="one light"):
        state.matt_fold(1, (illuminant("A"),))


def test_three_lamps_on_a_dye_add_up(corner, geometry):
    lamps = [slanting("D65"), slanting("A", (-0.4, 0.6, 0.3)), slanting("FL11", (0.0, 1.0, 0.4))]
    scene, surfaces = worn(corner, METAL, GLOWING, lights=tuple(lamps))
    together = Relighting.of(scene, surfaces, geometry, SAMPLED, bounces=2)
    alone = [together.with_lights(lamp, basis=SAMPLED).exits(EYE) for lamp in lamps]
    np.testing.assert_allclose(together.exits(EYE), sum(alone), rtol=1e-4, atol=1e-6)


def test_original_and_fast_form_are_one(corner, geometry):
    scene, surfaces = worn(corner, METAL, GLOWING)
    found = [Relighting.of(scene, {**surfaces, "1": one}, geometry).exits(EYE) for one in (GLOWING, GLOWING.own_form())]
    np.testing.assert_allclose(*found, rtol=1e-5, atol=1e-7)


def test_a_glossy_surface_that_fluoresces_is_refused(corner, geometry):
    class Shining(Tuned):
        bispectral = DYE

    scene, surfaces = worn(corner, CRIMSON, Shining(NM, np.zeros(NM.size), GOLD, cook_torrance(), (0.6, 0.3)))
    with pytest.raises(InputError, match="glossy surface that fluoresces"):
        Relighting.of(scene, surfaces, geometry)
