"""CAM16-UCS of images in single precision, beside colour-science."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral import image_difference
from metamer.spectral.difference import xyz_from_lab
from metamer.spectral.formula import ADAPTING_LUMINANCE, BACKGROUND, formula
from metamer.spectral.illuminants import illuminant
from metamer.spectral.image_cam16 import cam16_block
from metamer.spectral.image_difference import image_delta_e
from metamer.spectral.observers import observer

SHAPE = (120, 200)


def white(light="D65"):
    return observer("1964_10").white(illuminant(light))


@pytest.fixture(scope="module")
def pair():
    """Colours all over, of which many are of no light, dark ones and greys; and others at all distances."""
    rng = np.random.default_rng(5)
    first = np.stack([rng.uniform(0, 100, SHAPE), *rng.uniform(-128, 128, (2, *SHAPE))], axis=-1)
    first[:10, :, 1:] *= 1e-3
    first[10:15, :, 1:] = 0.0
    first[15:30] *= 0.01
    first[30:40, :, 0] *= 0.01
    second = first + rng.normal(0, 2, first.shape) * rng.choice([1e-3, 1.0, 20.0], (*SHAPE, 1))
    first[0, :20] = 0.0
    return first, second


def by_pixel(pair, light):
    return formula("CAM16-UCS")(*(xyz_from_lab(np.float64(one), white(light)) for one in pair), white(light))


@pytest.mark.parametrize("light", ["D65", "A", "FL11"])
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_every_pixel_is_that_of_double_precision(pair, light, kind):
    pair = [one.astype(kind) for one in pair]
    found = image_delta_e(*pair, "CAM16-UCS", white_xyz=white(light))
    assert found.shape == SHAPE and found.dtype == np.float32
    wanted = by_pixel(pair, light)
    # Neither has a value where CAM16's logarithm has none; some pairs are so steep that they are done again.
    assert 0.01 < np.isnan(wanted).mean() < 0.3 and (wanted > 150.0).any()
    np.testing.assert_allclose(found, wanted, rtol=0, atol=0.05)
    seen = np.isfinite(wanted)
    assert np.percentile(np.abs(found - wanted)[seen], 99) < 1e-3


def test_every_pixel_of_surface_colours_is_colour_science_s(colour):
    rng = np.random.default_rng(6)
    lab = np.stack([rng.uniform(30, 95, SHAPE), *rng.uniform(-20, 20, (2, *SHAPE))], axis=-1)
    pair = lab, lab + rng.normal(0, 2, lab.shape)
    ucs = []
    for one in pair:
        xyz = colour.Lab_to_XYZ(one, colour.XYZ_to_xy(white()))
        seen = colour.XYZ_to_CAM16(100 * xyz, 100 * white(), ADAPTING_LUMINANCE, BACKGROUND)
        ucs.append(colour.JMh_CAM16_to_CAM16UCS(np.stack([seen.J, seen.M, seen.h], axis=-1)))
    wanted = colour.delta_E(*ucs, method="CAM16-UCS")
    found = image_delta_e(*pair, "CAM16-UCS", white_xyz=white())
    np.testing.assert_allclose(found, wanted, rtol=0, atol=2e-3)


@pytest.mark.parametrize(
    ("reference", "sample"),
    [
        ((2.00227333, -44.76211792, 56.11465698), (1.25033543, -44.19599795, 54.99820423)),
        ((0.79055986, -13.64608627, 2.84689995), (1.6629681, -13.19070149, 3.97046143)),
        ((0.2702726, -37.7590953, 14.77300305), (2.81634773, -36.59578038, 14.69443729)),
        ((5.37704899, -84.07530834, 17.74895985), (3.20125824, -83.34964467, 20.49680734)),
    ],
)
def test_colours_of_no_light_near_the_formula_s_poles_are_done_again(reference, sample):
    pair = np.array([reference]), np.array([sample])
    found = image_delta_e(*pair, "CAM16-UCS", white_xyz=white())
    np.testing.assert_allclose(found, by_pixel(pair, "D65"), rtol=0, atol=1e-3)
    with np.errstate(all="ignore"):
        assert np.isinf(cam16_block(white())(np.stack([one.T for one in pair]).astype(np.float32)))


def test_the_scale_of_the_white_is_nothing(pair):
    found = [image_delta_e(*pair, "CAM16-UCS", white_xyz=scale * white()) for scale in (1.0, 128.0)]
    np.testing.assert_array_equal(*found)


def test_black_and_white_are_100_apart():
    ends = np.array([[0.0, 0.0, 0.0]]), np.array([[100.0, 0.0, 0.0]])
    assert image_delta_e(*ends, "CAM16-UCS", white_xyz=white()) == pytest.approx(100.0, abs=0.5)
    assert not image_delta_e(ends[0], ends[0], "CAM16-UCS", white_xyz=white()).any()


def test_blocks_and_threads_change_no_bit(pair, monkeypatch):
    whole = image_delta_e(*pair, "CAM16-UCS", threads=1, white_xyz=white())
    monkeypatch.setattr(image_difference, "_BLOCK", 704)
    monkeypatch.setattr(image_difference, "_RUN", 3)
    np.testing.assert_array_equal(image_delta_e(*pair, "CAM16-UCS", threads=2, white_xyz=white()), whole)


def test_what_is_no_colour_stays_in_its_pixel():
    first, second = np.full((2, 8, 9, 3), 40.0)
    first[3, 5, 1], second[4, 6, 0] = np.nan, np.nan
    found = image_delta_e(first, second, "CAM16-UCS", white_xyz=white())
    assert np.argwhere(np.isnan(found)).tolist() == [[3, 5], [4, 6]]


@pytest.mark.parametrize("bad", [None, np.array([0.9, 1.0, 0.0]), np.array([np.nan, 1.0, 1.0])])
def test_no_white_is_refused(pair, bad):
    with pytest.raises(InputError, match="needs the white"):
        image_delta_e(*pair, "CAM16-UCS", white_xyz=bad)
