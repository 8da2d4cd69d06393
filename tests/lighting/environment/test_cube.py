"""Cube maps, and their wavelets."""

import numpy as np
from metamer.benchmarks.papers.transfer_tensors.direct import transformed
from metamer.lighting.environment.cube import CubeMap
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.spectral.illuminants import illuminant


def test_texels_cover_the_sphere_and_hold_their_middles():
    cube = CubeMap(8)
    np.testing.assert_allclose(cube.solid_angles.sum(), 4.0 * np.pi, rtol=1e-12)
    np.testing.assert_array_equal(cube.texel_of(cube.directions), np.arange(len(cube)))


def test_a_coarser_texel_holds_the_finer_ones():
    fine, coarse = CubeMap(8), CubeMap(2)
    part = fine.coarser(2)
    np.testing.assert_array_equal(coarse.texel_of(fine.directions), part)
    np.testing.assert_allclose(np.bincount(part, fine.solid_angles), coarse.solid_angles, rtol=1e-12)


def test_means_keep_the_light():
    fields = np.random.default_rng(0).uniform(0.0, 1.0, (2, 16, 32))
    lamp = illuminant("D65")
    light = EnvironmentLight(fields, (lamp, lamp), 1000.0)
    cube, fine = CubeMap(4), CubeMap(256)
    found = cube.means(light) @ cube.solid_angles
    want = light.luminance(np.zeros((len(fine), 3)), fine.directions).T @ fine.solid_angles
    np.testing.assert_allclose(found, want, rtol=1e-4)


def test_wavelets_keep_inner_products():
    first, second = np.random.default_rng(0).normal(size=(2, 3, len(CubeMap(8))))
    np.testing.assert_allclose(
        transformed(first, 8) @ transformed(second, 8).T, first @ second.T, rtol=1e-10, atol=1e-10
    )


def test_an_even_face_is_one_wavelet():
    values = np.repeat(np.arange(6.0), 16)
    found = transformed(values, 4).reshape(6, 16)
    np.testing.assert_allclose(found[:, 0], 4.0 * np.arange(6.0), atol=1e-12)
    np.testing.assert_allclose(found[:, 1:], 0.0, atol=1e-12)
