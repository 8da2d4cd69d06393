"""Embedded pictures keep their colours; the ΔE scale is ordered; reductions hide nothing."""

import io

import numpy as np
import pytest
from metamer.calibration.report import plots
from metamer.spectral.difference import lab_from_xyz
from PIL import Image


def lightness(rgb: np.ndarray) -> np.ndarray:
    """L* of sRGB code values (IEC 61966-2-1)."""
    codes = rgb / 255.0
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    y = linear @ np.array([0.2126, 0.7152, 0.0722])
    return lab_from_xyz(np.stack([y, y, y], axis=-1), np.ones(3))[..., 0]


def test_embedded_pictures_decode_to_the_same_code_values():
    rgb = np.random.default_rng(0).integers(0, 256, (31, 47, 3), dtype=np.uint8)
    decoded = np.asarray(Image.open(io.BytesIO(plots.lossless(rgb))).convert("RGB"))
    np.testing.assert_array_equal(decoded, rgb)


def test_scale_is_ordered_by_lightness():
    steps = np.diff(lightness(plots.scale_rgb().astype(float)))
    assert steps.min() > 0, f"falls at step {steps.argmin()}"


def test_map_colours():
    delta_e = np.array([[0.0, 1.0, 3.0, 3.01, np.inf, np.nan, 1e9]])
    found = [tuple(int(code) for code in rgb) for rgb in plots.delta_e_picture(delta_e, 1.0)[0]]
    scale = [tuple(int(code) for code in rgb) for rgb in plots.scale_rgb()]
    assert found[:3] == [scale[0], scale[20], scale[-1]]
    assert found[3:] == [plots.OVER_RGB, plots.UNDEFINED_RGB, plots.NOT_COMPARED_RGB, plots.OVER_RGB]


def test_the_scale_follows_the_budget():
    delta_e = np.array([[0.5, 1.5]])
    np.testing.assert_array_equal(plots.delta_e_picture(delta_e, 0.5), plots.delta_e_picture(2 * delta_e, 1.0))


@pytest.mark.parametrize("size", [(8, 8), (7, 9)])
def test_reduction_keeps_uniform_colours(size):
    for code in (0, 1, 10, 11, 127, 254, 255):
        rgb = np.full((*size, 3), code, dtype=np.uint8)
        for wanted in ((2, 2), (5, 7)):
            found = plots.reduce_picture(rgb, wanted)
            assert found.shape == (*wanted, 3) and (found == code).all(), (code, wanted)


def test_reduction_averages_light_not_codes():
    rgb = np.zeros((2, 2, 3), dtype=np.uint8)
    rgb[0] = 255
    assert plots.reduce_picture(rgb, (1, 1))[0, 0].tolist() == [188, 188, 188]


def test_reduced_map_keeps_its_worst_pixels():
    delta_e = np.full((6, 6), 0.1)
    delta_e[1, 1], delta_e[2, 2], delta_e[4:, 4:], delta_e[0, 5] = 7.0, np.inf, np.nan, np.nan
    found = plots.reduce_map(delta_e, (3, 3))
    assert found[0, 0] == 7.0 and np.isinf(found[1, 1]) and np.isnan(found[2, 2]) and found[0, 2] == 0.1


def test_many_rows_are_embedded_smaller():
    assert plots.embedded_side(3) == 512
    assert 90 < plots.embedded_side(246) < 128
    assert 56 < plots.embedded_side(480, 3000.0) < plots.embedded_side(246)
    assert plots.embedded_side(10**6) == 56
    assert plots.fitted_size((256, 512), 106) == (53, 106)
    assert plots.fitted_size((300, 200), 512) == (300, 200)
    assert plots.fitted_size((1, 400), 100) == (1, 100)


def test_a_pixel_that_is_shared_is_seen_in_both_of_the_reduced_map():
    """Five columns as three: the second is part of the first two, and neither may hide it."""
    delta_e = np.array([[0.1, 9.0, 0.2, 0.3, np.nan]])
    np.testing.assert_array_equal(plots.reduce_map(delta_e, (1, 3)), [[9.0, 9.0, 0.3]])
    rgb = np.zeros((1, 5, 3), dtype=np.uint8)
    rgb[0, 1] = 255
    light = np.array([2 / 5, 1 / 5, 0.0])  # 2/3 and 1/3 of a pixel in parts of 5/3 pixels
    encoded = np.where(light > 0, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055, 0.0)
    np.testing.assert_array_equal(plots.reduce_picture(rgb, (1, 3))[0, :, 0], np.rint(255 * encoded))


def test_curve_breaks_where_a_value_is_missing():
    path = plots.curve_path(
        np.array([400.0, 500, 600, 700]),
        np.array([0.0, 1.0, np.nan, 0.5]),
        (400.0, 700.0),
        1.0,
        (300.0, 100.0),
    )
    assert path == "M0.0 100.0L100.0 0.0M300.0 50.0"


@pytest.mark.parametrize(
    ("highest", "top"), [(3e-6, 5e-6), (0.0099, 0.01), (0.02, 0.1), (0.6, 1.0), (1.2, 1.5), (18.4, 18.5), (0.0, 0.1)]
)
def test_axis_of_a_spectrum_suits_lights_of_any_unit(highest, top):
    plot = plots.spectrum_plot(np.array([400.0, 700.0]), np.array([0.0, highest]), "emission", (300.0, 100.0))
    assert float(plot["y_ticks"][2][1]) == pytest.approx(top) and plot["y_ticks"][2][0] == 0.0
    down = float(plot["path"].split()[-1])
    assert down == pytest.approx(100.0 * (1 - highest / top), abs=0.06)
