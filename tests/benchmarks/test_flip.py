"""FLIP through its optional package."""

import sys
from inspect import unwrap

import numpy as np
import pytest
from metamer.benchmarks.flip import flip
from metamer.runtime.errors import InputError
from metamer.spectral.difference import lab_from_xyz

# Linear sRGB to XYZ of IEC 61966-2-1; its rows add up to D65.
XYZ_FROM_RGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


@pytest.fixture(autouse=True)
def _installed(request):
    if "missing" not in request.node.name:
        pytest.importorskip("flip_evaluator")


def hunt(rgb):
    """CIELAB with chroma less in the dark: what FLIP takes its distance in."""
    lab = lab_from_xyz(XYZ_FROM_RGB @ np.asarray(rgb), XYZ_FROM_RGB.sum(axis=1))
    return lab * [1.0, 0.01 * lab[0], 0.01 * lab[0]]


def closed_form(first, second):
    """Compute FLIP of two pictures of one colour each, which have no edges, points or blur (eq. 5-7 of the paper)."""

    def distance(one, other):
        off = np.abs(one - other)
        return (off[0] + np.hypot(off[1], off[2])) ** 0.7

    most = distance(hunt([0.0, 1.0, 0.0]), hunt([0.0, 0.0, 1.0]))
    found = distance(hunt(first), hunt(second))
    if found < 0.4 * most:
        return found * 0.95 / (0.4 * most)
    return 0.95 + (found - 0.4 * most) / (0.6 * most) * 0.05


@pytest.mark.parametrize(
    ("first", "second"),
    [((0, 0, 0), (1, 1, 1)), ((1, 0, 0), (0, 1, 0)), ((1, 1, 1), (1, 1, 0)), ((0, 0, 0), (0, 0, 1))],
)
def test_plain_pictures_have_the_paper_s_closed_form(first, second):
    pair = (np.full((60, 80, 3), one, dtype=np.float64) for one in (first, second))
    found = flip(*pair)
    assert found.shape == (60, 80) and found.dtype == np.float32
    np.testing.assert_allclose(found, closed_form(first, second), atol=2e-3)


def test_equal_pictures_differ_by_nothing_and_one_pixel_is_found_where_it_is():
    picture = np.random.default_rng(1).uniform(0.2, 0.8, (60, 80, 3))
    assert not flip(picture, picture).any()
    other = picture.copy()
    other[20, 30] = 1.0
    found = flip(picture, other)
    assert np.unravel_index(found.argmax(), found.shape) == (20, 30) and found[20, 30] > 0.1
    assert not found[45:, 55:].any()


def test_from_afar_fine_noise_is_seen_less():
    rng = np.random.default_rng(2)
    picture = np.full((60, 80, 3), 0.5)
    noisy = picture + rng.uniform(-0.1, 0.1, picture.shape)
    assert flip(picture, noisy, 120.0).mean() < 0.8 * flip(picture, noisy, 30.0).mean()


def test_a_missing_package_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    with pytest.raises(InputError, match=r"not installed[\s\S]*metamer-colour\[flip\]"):
        flip(np.zeros((4, 4, 3)), np.zeros((4, 4, 3)))


@pytest.mark.parametrize(
    ("first", "second", "distance", "words"),
    [
        (np.zeros((4, 4, 3)), np.zeros((4, 5, 3)), 67.0, "different shapes"),
        (np.zeros((4, 4, 3)), np.full((4, 4, 3), 1.5), 67.0, r"sample_srgb[\s\S]*1.5 to 1.5"),
        (np.full((4, 4, 3), -0.1), np.zeros((4, 4, 3)), 67.0, r"reference_srgb[\s\S]*-0.1"),
        (np.full((4, 4, 3), np.nan), np.zeros((4, 4, 3)), 67.0, "nan to nan"),
        (np.zeros((0, 4, 3)), np.zeros((0, 4, 3)), 67.0, "no picture"),
        (np.zeros((4, 4, 1)), np.zeros((4, 4, 1)), 67.0, "no picture"),
        (np.zeros((4, 4, 3)), np.zeros((4, 4, 3)), 0.0, "no distance"),
        (np.zeros((4, 4, 3)), np.zeros((4, 4, 3)), np.inf, "no distance"),
    ],
)
def test_what_is_no_pair_of_pictures_is_refused(first, second, distance, words):
    # Behind the check of annotations, which only tests have.
    with pytest.raises(InputError, match=words):
        unwrap(flip)(first, second, distance)
