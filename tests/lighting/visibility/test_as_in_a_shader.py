"""A shader gets by whole-numbered fetches from plain textures, in float32, what numpy gives."""

import numpy as np
from metamer.lighting.mesh.shapes import speed_shape
from metamer.lighting.vectors import unit
from metamer.lighting.visibility.compression import SOFT, unpack_codes
from metamer.lighting.visibility.precompute import computed_visibility
from metamer.lighting.visibility.tracing import MAP

F = np.float32


def fetched(texture, x, y):
    """texelFetch of an octahedral map, one texel beyond its rim at most."""
    over, beside = y < 0 or y >= MAP, x < 0 or x >= MAP
    x, y = min(max(x, 0), MAP - 1), min(max(y, 0), MAP - 1)
    return texture[MAP - 1 - y if beside else y, MAP - 1 - x if over else x]


def shader(found, vertices, weights, to):
    """The signed distance of one point and direction as GLSL would reckon it."""
    # Four whole numbers a texel; axes with their steps in textures of four terms.
    sites = found.fronts[vertices]
    codes = unpack_codes(found.whole[sites], found.halves[sites]).reshape(3, -1, 4)
    axes = (found.axes * found.steps).astype(F).reshape(MAP, MAP, -1, 4)
    mixed = np.zeros(codes.shape[1:], dtype=F)
    for k in range(3):
        mixed = mixed + F(weights[k]) * codes[k]
    to = to.astype(F) / np.abs(to.astype(F)).sum()
    x, z = to[0], to[2]
    if to[1] < 0.0:
        x, z = (F(1) - abs(z)) * (1 if x >= 0 else -1), (F(1) - abs(x)) * (1 if z >= 0 else -1)
    column, row = (x + F(1)) * F(MAP / 2) - F(0.5), (z + F(1)) * F(MAP / 2) - F(0.5)
    left, top = int(np.floor(column)), int(np.floor(row))
    value = F(0)
    for down in (0, 1):
        for right in (0, 1):
            share = (row - top if down else F(1) - (row - top)) * (column - left if right else F(1) - (column - left))
            mean = fetched(found.mean.reshape(MAP, MAP), left + right, top + down)
            value = value + share * (mean + (mixed * fetched(axes, left + right, top + down)).sum(dtype=F))
    most = F(np.tanh(0.5 * np.pi / SOFT))
    return F(SOFT) * np.arctanh(np.clip(value, -most, most))


def test_a_shader_finds_the_same_distances(scene_of):
    scene = scene_of(speed_shape(3))
    found = computed_visibility(scene)
    rng = np.random.default_rng(2)
    faces = rng.integers(0, len(found.refinement.corners), 60)
    vertices, weights = found.located(faces, rng.dirichlet(np.ones(3), 60))
    directions = unit(rng.normal(size=(60, 6, 3)))
    directions[0] = np.concatenate([np.eye(3), -np.eye(3)])
    exact = found.signed_distances(vertices, weights, directions)
    mine = [[shader(found, vertices[n], weights[n], to) for to in directions[n]] for n in range(60)]
    assert np.abs(np.array(mine) - exact).max() < 1e-3
