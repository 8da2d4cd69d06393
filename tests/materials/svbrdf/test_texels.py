"""Pictures on a surface: which way up, what lies between texels and beyond the edges, and means over samples."""

import numpy as np
import pytest
from metamer.materials.svbrdf.texels import filtered, level_at, levels_of, look_up

RNG = np.random.default_rng(4)


def test_the_first_row_is_on_top_and_texels_are_read_in_their_middles():
    picture = np.arange(6.0).reshape(2, 3, 1)
    uv = np.array([[(column + 0.5) / 3, 1 - (row + 0.5) / 2] for row in range(2) for column in range(3)])
    np.testing.assert_allclose(look_up(picture, uv)[:, 0], np.arange(6.0), atol=1e-12)
    # Between the middles of two texels half of each; between four a quarter of each.
    np.testing.assert_allclose(look_up(picture, np.array([[1 / 3, 0.75], [1 / 3, 0.5]]))[:, 0], [0.5, 2.0])


def test_beyond_the_edges_a_picture_is_repeated():
    picture = RNG.random((5, 7, 2))
    uv = RNG.random((50, 2))
    for shift in ((1, 0), (0, -1), (3, -2)):
        np.testing.assert_allclose(look_up(picture, uv + shift), look_up(picture, uv), atol=1e-12)
    # At the edge itself, half of the texel there and half of the one on the other side.
    np.testing.assert_allclose(look_up(picture, np.array([[0.0, 0.9]])), 0.5 * (picture[0, :1] + picture[0, -1:]))


@pytest.mark.parametrize("size", [(8, 8), (5, 7), (1, 1), (1, 6), (33, 2)])
def test_every_level_has_the_mean_of_the_picture(size):
    picture = RNG.random((*size, 3))
    levels = levels_of(picture)
    assert levels[-1].shape == (1, 1, 3)
    np.testing.assert_array_equal(levels[0], picture)
    for level in levels:
        np.testing.assert_allclose(level.mean(axis=(0, 1)), picture.mean(axis=(0, 1)), rtol=1e-12)


def test_halves_of_even_sizes_are_boxes_of_four():
    picture = RNG.random((6, 4, 1))
    boxes = picture.reshape(3, 2, 2, 2, 1).mean(axis=(1, 3))
    np.testing.assert_allclose(levels_of(picture)[1], boxes, rtol=1e-12)


def test_a_sample_that_spans_nothing_sees_the_picture_and_one_that_spans_all_its_mean():
    picture = RNG.random((16, 32, 2))
    uv = RNG.random((20, 2))
    levels = levels_of(picture)
    np.testing.assert_allclose(filtered(levels, uv, np.zeros((20, 2, 2))), look_up(picture, uv), atol=1e-12)
    # A texel wide is still the picture itself.
    one = np.broadcast_to([[1 / 32, 0.0], [0.0, 1 / 16]], (20, 2, 2))
    np.testing.assert_allclose(filtered(levels, uv, one), look_up(picture, uv), atol=1e-12)
    mean = np.broadcast_to(picture.mean(axis=(0, 1)), (20, 2))
    np.testing.assert_allclose(filtered(levels, uv, np.broadcast_to(5.0 * np.eye(2), (20, 2, 2))), mean, rtol=1e-12)


def test_levels_follow_the_longer_side_of_what_a_sample_spans():
    footprint = np.array([[[4 / 64, 0.0], [0.0, 1 / 32]], [[0.0, 1 / 32], [8 / 64, 0.0]], [[0.0, 0.0], [0.0, 0.0]]])
    np.testing.assert_allclose(level_at(footprint, 32, 64, 6), [2.0, 3.0, 0.0], atol=1e-12)
    assert level_at(1e9 * np.ones((1, 2, 2)), 32, 64, 6) == 6.0


def test_means_change_steadily_with_the_span():
    picture = RNG.random((64, 64, 1))
    levels, uv = levels_of(picture), np.full((400, 2), 0.37)
    spans = np.geomspace(1e-3, 4.0, 400)[:, None, None] * np.eye(2)
    seen = filtered(levels, uv, spans)[:, 0]
    assert np.abs(np.diff(seen)).max() < 0.02
