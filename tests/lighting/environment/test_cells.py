"""Cells of directions: the whole sphere once, small where the light is."""

import numpy as np
import pytest
from metamer.lighting.environment import latlong
from metamer.lighting.environment.cells import COARSEST, cells_of
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.vectors import unit
from metamer.spectral.illuminants import illuminant

TO = latlong.texel_directions(64, 128)


def of(luminance):
    return EnvironmentLight(luminance[None], (illuminant("D65"),), rotation_deg=40.0)


def test_cells_are_the_whole_sphere_once_and_hold_all_light():
    light = of(1.0 + TO[..., 1])
    cells = cells_of(light, 500)
    assert COARSEST**2 <= len(cells.directions) <= 500 and cells.of.max() + 1 == len(cells.directions)
    assert cells.solid_angles.sum() == pytest.approx(4.0 * np.pi) and cells.solid_angles.min() > 0.0
    assert np.allclose(np.linalg.norm(cells.directions, axis=1), 1.0)
    values = np.random.default_rng(0).random((TO[..., 0].size, 2))
    assert np.allclose(cells.sums(values).sum(axis=0), values.sum(axis=0))


def test_cells_are_small_where_the_light_is_and_stand_in_its_middle():
    sun = unit(np.array([0.5, 0.6, 0.4]))
    light = of(1.0 + 3000.0 * np.exp(600.0 * (TO @ sun - 1.0)))
    cells = cells_of(light, 300)
    apart = np.arccos(np.clip(cells.directions @ (light.world_from_map @ sun), -1.0, 1.0))
    assert cells.solid_angles[apart < 0.05].max() < 0.1 * cells.solid_angles[apart > 1.0].min()


ONE_TEXEL = np.zeros((64, 128))
ONE_TEXEL[10, 30] = 1.0


@pytest.mark.parametrize("luminance", [ONE_TEXEL, np.ones((8, 16))], ids=["one texel", "coarser than cells"])
def test_lights_that_say_little_have_cells_too(luminance):
    cells = cells_of(of(luminance), 512)
    assert np.isfinite(cells.directions).all() and cells.solid_angles.sum() == pytest.approx(4.0 * np.pi)
