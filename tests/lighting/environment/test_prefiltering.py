"""Light that surfaces gather of an environment, and of its bright parts, beside sums over every direction."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.benchmarks.papers.harmonics import harmonics
from metamer.lighting.environment import latlong
from metamer.lighting.environment.bright_light import BrightLight
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.prefiltering import GatheredLight
from metamer.lighting.environment.pyramid import Pyramid
from metamer.lighting.vectors import unit
from metamer.materials.core.environment_form import bends
from metamer.spectral.illuminants import illuminant

HEIGHT, WIDTH = 64, 128
TO = latlong.texel_directions(HEIGHT, WIDTH).reshape(-1, 3)
ANGLES = np.repeat(latlong.solid_angles(HEIGHT, WIDTH), WIDTH)


@pytest.fixture(scope="module")
def light():
    """A sky with a small sun and a window, over dark ground, turned."""
    to = latlong.texel_directions(HEIGHT, WIDTH)
    sun = 400.0 * np.exp(300.0 * (to @ unit(np.array([0.5, 0.6, 0.4])) - 1.0))
    window = 20.0 * np.exp(30.0 * (to @ unit(np.array([-0.8, 0.2, 0.3])) - 1.0))
    sky = np.where(to[..., 1] > 0.0, 1.0 + to[..., 1], 0.1)
    return EnvironmentLight(np.stack([sky + sun, window]), (illuminant("D65"), illuminant("A")), rotation_deg=35.0)


@pytest.fixture(scope="module")
def frames():
    """Rows tangent, bitangent and normal of surfaces that face anywhere, straight up and straight down too."""
    normals = unit(np.concatenate([np.random.default_rng(1).normal(size=(30, 3)), [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]]))
    tangents = unit(np.cross(normals, [0.3, 0.2, 0.9]))
    return np.stack([tangents, np.cross(normals, tangents), normals], axis=1)


def test_moments_are_sums_over_all_texels_in_the_surfaces_own_axes(light, frames):
    found = GatheredLight.of(light).by_frames(frames @ light.world_from_map)
    world = TO @ light.world_from_map.T
    sent = light.fields.reshape(2, -1) * ANGLES
    for frame, got in zip(frames, found, strict=True):
        local = world @ frame.T
        expected = (bends(local) * np.maximum(local[:, 2:], 0.0)).T @ sent.T
        assert np.abs(got - expected).max() < 0.01 * sent.sum() / np.pi
    alone = GatheredLight.of(light).by_frames(frames @ light.world_from_map, 1)
    assert np.allclose(alone[:, 0], found[:, 0], rtol=1e-9)


def test_bright_parts_and_the_rest_are_the_whole_light(light, frames):
    bright = BrightLight.of(light)
    parts = bright.parts
    assert 1 <= len(parts.axis) <= 16
    # The cells hold the light's own less the narrow lobes', wherever it stands.
    world = TO @ light.world_from_map.T
    sharpest = parts.sharpness[: bright.narrow]
    assert (np.diff(parts.sharpness) <= 0.0).all() and (parts.sharpness[bright.narrow :] < 300.0).all()
    narrow = np.exp(sharpest * (world @ parts.axis[: bright.narrow].T - 1.0)) @ parts.amplitude[: bright.narrow]
    left = (light.fields.reshape(2, -1).T - narrow) * ANGLES[:, None]
    assert np.abs(bright.rest.sum(axis=0) - left.sum(axis=0)).max() < 0.02 * left.sum(axis=0).max()
    cells = bright.cells
    moments, expected = harmonics(cells.directions, 4).T @ bright.rest, harmonics(world, 4).T @ left
    assert np.abs(moments - expected).max() < 0.02 * np.abs(expected).max()
    # And what a lobe gives surfaces is its integral with the clamped cosine.
    one = np.exp(parts.sharpness * (world @ parts.axis.T - 1.0)) * ANGLES[:, None]
    for frame, got in zip(frames, bright.on_surfaces(frames[:, 2]), strict=True):
        expected = np.maximum(world @ frame[2], 0.0) @ one
        assert np.abs(got - expected).max() < 0.02 * one.sum(axis=0).max()


def test_the_mean_of_bright_parts_under_lobes_is_the_integral_of_products(light):
    bright = BrightLight.of(light)
    directions = unit(np.random.default_rng(2).normal(size=(5, 2, 3)))
    sharpness = np.array([[0.5, 3.0]] * 5)
    found = bright.by_lobes(directions, sharpness)
    for axis, own, got in zip(directions.reshape(-1, 3), sharpness.ravel(), found.reshape(10, -1), strict=True):
        weight = np.exp(own * (TO @ axis - 1.0)) * ANGLES
        lobes = np.exp(bright.parts.sharpness * (TO @ bright.parts.axis.T - 1.0))
        assert np.allclose(got, weight @ lobes / weight.sum(), rtol=0.02, atol=1e-6)


def test_a_light_that_is_turned_keeps_its_parts(light):
    still, turned = (BrightLight.of(replace(light, rotation_deg=angle)) for angle in (0.0, 35.0))
    other = still.turned(light.world_from_map)
    assert np.array_equal(turned.parts.sharpness, other.parts.sharpness) and np.array_equal(turned.lux, other.lux)
    assert np.allclose(turned.parts.axis, other.parts.axis, rtol=0.0, atol=1e-12)
    assert np.allclose(turned.cells.directions, other.cells.directions, rtol=0.0, atol=1e-12)
    assert np.array_equal(turned.rest, other.rest)
    # Cells and narrow parts together are the light as it is turned: its flux by direction.
    world = TO @ light.world_from_map.T
    narrow = replace(other.parts, **{name: getattr(other.parts, name)[: other.narrow] for name in vars(other.parts)})
    left = light.fields.reshape(len(light.fields), -1).T - narrow.luminance(world)
    expected = (left * ANGLES[:, None]).T @ world
    assert np.allclose(other.rest.T @ other.cells.directions, expected, rtol=0.0, atol=0.02 * np.abs(expected).max())


def test_a_light_without_bright_parts_is_all_rest():
    bright = BrightLight.of(EnvironmentLight(np.ones((1, 16, 32)), (illuminant("D65"),)))
    assert bright.on_surfaces(np.array([[0.0, 1.0, 0.0]])).shape[1] == len(bright.parts.axis)
    assert np.isfinite(bright.rest).all() and bright.rest.sum() > 0.0


def test_a_coarse_map_has_fewer_levels_and_looks_the_same_through_every_gaussian():
    to = latlong.texel_directions(16, 32)
    coarse = EnvironmentLight((1.0 + 0.5 * np.sin(3.0 * to[..., 0]) + 0.5 * to[..., 1])[None], (illuminant("D65"),))
    kept, whole = GatheredLight.of(coarse).pyramid, Pyramid.of(coarse)
    assert len(kept.levels) < len(whole.levels)
    towards = unit(np.random.default_rng(3).normal(size=(2000, 3)))
    for sharpness in (20.0, 200.0, 700.0, 3000.0, np.inf):
        found, expected = (one(towards, np.full(2000, sharpness)) for one in (kept, whole))
        assert np.sqrt(np.mean((found - expected) ** 2)) < 2e-3 * expected.mean(), sharpness
