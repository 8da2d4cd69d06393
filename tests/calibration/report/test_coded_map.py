"""Maps with codes: the colours that the report has always had, and values that come back within their steps."""

import io
import re
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metamer.calibration.report import coded_map, plots
from metamer.calibration.report.page import TEMPLATES
from PIL import Image

SCRIPT = TEMPLATES / "report_maps.js"


def opened(png):
    """Codes and colours of a map, as any reader of PNG gives them."""
    with Image.open(io.BytesIO(png)) as picture:
        return np.asarray(picture), np.asarray(picture.convert("RGB"))


def shaded(size=48):
    """A map with values of many sizes, pixels that are not compared, and one without a number."""
    y, x = np.mgrid[-1.0 : 1.0 : size * 1j, -1.0 : 1.0 : size * 1j]
    found = np.where(x * x + y * y < 0.9, 5.0 * (x + 0.3 * y) ** 4, np.nan)
    found[size // 2, size // 2] = np.inf
    return found


@given(st.floats(0.0, 1e4), st.floats(0.01, 10.0))
def test_a_value_is_within_its_step_and_never_shown_smaller(value, budget):
    (code,) = coded_map.map_codes(np.array([[value]]), budget)[0].tolist()
    values = coded_map.code_values() * budget
    if code > coded_map.LAST:
        assert code == coded_map.BEYOND and value > values[-1]
        return
    assert value <= values[code]
    assert code == 0 or values[code - 1] < value
    assert code < 2 or values[code] / values[code - 1] == pytest.approx(1.0 + coded_map.STEP_SHARE)


@pytest.mark.parametrize("budget", [0.3, 0.7, 1.0, 1.9])
def test_budget_and_three_budgets_end_a_step(budget):
    """So that no pixel over either looks as if it were within."""
    edges = np.array([1.0, 3.0]) * budget
    at, above = coded_map.map_codes(np.stack([edges, np.nextafter(edges, np.inf)]), budget)
    np.testing.assert_array_equal(above, at + 1)
    np.testing.assert_array_equal(coded_map.code_values()[at] * budget, edges)


@pytest.mark.parametrize("budget", [0.3, 1.0])
def test_without_a_script_a_map_has_the_colours_of_the_scale(budget):
    delta_e = shaded()
    codes, colours = opened(coded_map.map_png(delta_e, budget))
    np.testing.assert_array_equal(codes, coded_map.map_codes(delta_e, budget))
    exact = plots.delta_e_picture(delta_e, budget)
    flat = np.isnan(delta_e) | np.isinf(delta_e) | (delta_e > 3.0 * budget)
    np.testing.assert_array_equal(colours[flat], exact[flat])
    # A step may reach into the next colour of the scale, no further.
    scale = plots.scale_rgb().astype(int)
    place = [np.argmin(np.abs(scale - rgb).sum(axis=1)) for rgb in exact[~flat].astype(int)]
    shown = [np.argmin(np.abs(scale - rgb).sum(axis=1)) for rgb in colours[~flat].astype(int)]
    assert set(np.subtract(shown, place)) <= {0, 1, 2, 3}


def test_script_finds_palette_and_pixels_where_they_are():
    """The page's script exchanges the palette and unpacks the pixels by these numbers."""
    png = coded_map.map_png(shaded(), 1.0)
    start, pixels = (int(re.search(rf"{name} = (\d+)", SCRIPT.read_text("utf-8"))[1]) for name in ("PALETTE", "PIXELS"))
    assert png[start - 4 : start] == b"PLTE" and struct.unpack(">I", png[start - 8 : start - 4]) == (768,)
    assert png[pixels + 4 : pixels + 8] == b"IDAT" and pixels % 3 == 0
    assert png[pixels - 4 : pixels] == struct.pack(">I", zlib.crc32(png[start - 4 : pixels - 4]))
    assert png[24:29] == bytes([8, 3, 0, 0, 0]), "8-bit palette, not interlaced"


def test_rows_are_filtered_in_one_of_two_ways():
    """The two that the script undoes; both occur, since the smaller file is kept."""
    rng = np.random.default_rng(0)
    kinds = set()
    for delta_e in (shaded(), 10.0 ** rng.uniform(-2.0, 1.0, (48, 48))):
        png = coded_map.map_png(delta_e, 1.0)
        (length,) = struct.unpack(">I", png[813:817])
        kinds |= set(zlib.decompress(png[821 : 821 + length])[:: 48 + 1])
        np.testing.assert_array_equal(opened(png)[0], coded_map.map_codes(delta_e, 1.0))
    assert kinds == {0, 2}


def test_the_same_map_is_the_same_bytes():
    assert coded_map.map_png(shaded(), 1.0) == coded_map.map_png(shaded(), 1.0)
