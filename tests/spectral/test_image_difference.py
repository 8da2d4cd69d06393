"""Differences of large images in single precision, beside double precision and colour-science."""

from inspect import unwrap

import numpy as np
import pytest
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral import image_difference
from metamer.spectral.difference import delta_e_lab
from metamer.spectral.image_difference import image_delta_e

METHODS = ("CIE 1994", "CIE 2000")


@pytest.fixture(scope="module")
def pair():
    """Colours all over, and others at all distances from them; of some hues are opposite, or there is none."""
    rng = np.random.default_rng(3)
    shape = (300, 200)
    first = np.stack([rng.uniform(0, 100, shape), *rng.uniform(-110, 110, (2, *shape))], axis=-1)
    second = first + rng.normal(0, 3, first.shape) * rng.choice([0.0, 1e-3, 0.1, 1.0, 20.0], (*shape, 1))
    first[:10, :, 1:] = 0.0
    first[10:20, :, 1:] *= 1e-4
    second[20:30, :, 1:] = -first[20:30, :, 1:] * rng.uniform(0.5, 2.0, (10, 200, 1))
    second[30:40, :, 1:] = -first[30:40, :, 1:] * (1.0 + rng.normal(0, 1e-3, (10, 200, 2)))
    return first, second


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_every_pixel_is_that_of_double_precision(pair, method, kind):
    first, second = (one.astype(kind) for one in pair)
    found = image_delta_e(first, second, method)
    assert found.shape == (300, 200) and found.dtype == np.float32
    np.testing.assert_allclose(found, delta_e_lab(first, second, method), rtol=0, atol=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_every_pixel_is_colour_science_s(colour, pair, method):
    first, second = (one[:100] for one in pair)
    # For exactly opposite hues either mean is as good.
    first, second = (np.delete(one, slice(20, 40), axis=0) for one in (first, second))
    np.testing.assert_allclose(
        image_delta_e(first, second, method), colour.delta_E(first, second, method=method), rtol=0, atol=1e-3
    )


@pytest.mark.parametrize("method", METHODS)
def test_blocks_and_threads_change_no_bit(pair, method, monkeypatch):
    whole = image_delta_e(*pair, method, threads=1)
    monkeypatch.setattr(image_difference, "_BLOCK", 700)
    monkeypatch.setattr(image_difference, "_RUN", 3)
    np.testing.assert_array_equal(image_delta_e(*pair, method, threads=2), whole)


@pytest.mark.parametrize("method", METHODS)
def test_what_is_no_colour_stays_in_its_pixel(pair, method):
    first, second = (one.copy() for one in pair)
    first[3, 5, 1], second[7, 11, 0], second[12, 0] = np.nan, np.inf, -np.inf
    found = image_delta_e(first, second, method)
    assert np.argwhere(~np.isfinite(found)).tolist() == [[3, 5], [7, 11], [12, 0]]


@pytest.mark.parametrize("method", METHODS)
def test_equal_images_differ_by_nothing(pair, method):
    assert not image_delta_e(pair[0], pair[0], method).any()
    assert image_delta_e(np.zeros((0, 4, 3)), np.zeros((0, 4, 3)), method).shape == (0, 4)


def test_other_shapes_and_formulas_are_refused(pair):
    # Behind the check of annotations, which only tests have.
    with pytest.raises(InputError, match="different shapes"):
        unwrap(image_delta_e)(pair[0], pair[1][:20])
    with pytest.raises(UnknownNameError, match="CIE 1994, CIE 2000, CAM16-UCS"):
        unwrap(image_delta_e)(*pair, "CIE 1976")
