"""Environments taken apart into lobes and a rest."""

import numpy as np
import pytest
from metamer.lighting.environment import latlong
from metamer.lighting.environment.brights import taken_apart
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import Spectrum

WAVELENGTHS = np.arange(380.0, 781.0, 5.0)
WHITE = Spectrum(np.ones(len(WAVELENGTHS)), WAVELENGTHS, "emission")
HEIGHT, WIDTH = 64, 128
TO = latlong.texel_directions(HEIGHT, WIDTH).reshape(-1, 3)
SOLID = np.repeat(latlong.solid_angles(HEIGHT, WIDTH), WIDTH)


def _environment(*fields, **more):
    maps = np.stack([np.broadcast_to(field, HEIGHT * WIDTH).reshape(HEIGHT, WIDTH) for field in fields])
    return EnvironmentLight(maps, (WHITE,) * len(maps), **more)


def test_bright_parts_and_the_rest_are_all_there_was():
    lobes = [(40.0, 30.0, [0.6, 0.64, -0.48]), (300.0, 90.0, [-0.8, 0.36, 0.48])]
    bright = [top * np.exp(sharpness * (TO @ axis - 1.0)) for sharpness, top, axis in lobes]
    sky = _environment(1.0 + bright[0], 0.5 + bright[1], rotation_deg=25.0)
    parts, rest = taken_apart(sky, 2, 0.1)
    # Luminous power over the sphere, field by field.
    held = parts.amplitude * (2.0 * np.pi / parts.sharpness)[:, None]
    power = [SOLID @ field.ravel() for field in sky.fields]
    left = [SOLID @ field.ravel() for field in rest.fields]
    np.testing.assert_allclose(held.sum(axis=0) + left, power, rtol=1e-3)
    assert (rest.fields >= 0.0).all()
    # One lobe each, where it was put.
    world = np.array([axis for *_, axis in lobes]) @ sky.world_from_map.T
    order = np.argmax(world @ parts.axis.T, axis=1)
    assert sorted(order) == [0, 1]
    assert (np.sum(world * parts.axis[order], axis=1) > np.cos(np.radians(1.0))).all()


def test_a_sun_in_one_texel_is_one_lobe_as_wide_as_a_texel():
    sky = np.ones(HEIGHT * WIDTH)
    sky[20 * WIDTH + 30] = 1e5
    sun = _environment(sky)
    parts, rest = taken_apart(sun, 8)
    assert len(parts.axis) == 1
    np.testing.assert_allclose(parts.axis[0], TO[20 * WIDTH + 30], atol=1e-6)
    assert rest.fields.max() == pytest.approx(rest.fields.min())


def test_a_black_half_and_a_uniform_environment_have_no_bright_parts_or_all_of_it():
    uniform = _environment(np.ones(HEIGHT * WIDTH))
    parts, rest = taken_apart(uniform)
    assert not len(parts.axis)
    assert parts.luminance(TO).shape == (len(TO), 1)
    np.testing.assert_allclose(rest.fields, uniform.fields)
    parts, rest = taken_apart(uniform, 1, 1.0)
    assert rest is None
    np.testing.assert_allclose(parts.luminance(TO), uniform.fields.ravel()[:, None], rtol=2e-3)


@pytest.mark.parametrize(("count", "share", "field"), [(0, 0.1, "count"), (3, 0.0, "share"), (3, 1.5, "share")])
def test_what_cannot_be_taken_apart_is_refused(count, share, field):
    with pytest.raises(InputError, match=field):
        taken_apart(_environment(np.ones(HEIGHT * WIDTH)), count, share)
