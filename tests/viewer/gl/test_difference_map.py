"""ΔE maps on the GPU are those of double precision."""

import numpy as np
import pytest
from metamer.calibration.report.statistics import delta_e_map, delta_e_statistics
from metamer.spectral.adaptation import adaptation_matrix
from metamer.spectral.difference import xyz_from_lab
from metamer.spectral.formula import Formula
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.viewer.gl.difference_map import FORMULAS, DifferencePass
from metamer.viewer.gl.resources import Owner
from metamer.viewer.gl.tile import read

SIDE = 256


@pytest.fixture
def owner(gl):
    kept = Owner(gl)
    yield kept
    kept.release()


@pytest.fixture(scope="module")
def differing(gl):
    made = DifferencePass(gl)
    yield made
    made.release()


def white_of(light):
    return observer("1931_2").white(illuminant(light))


def pairs(kind, seed=0):
    """CIELAB of reference and sample, (SIDE, SIDE, 3) each."""
    rng = np.random.default_rng(seed)
    shape = (SIDE, SIDE)
    lightness, hue = rng.uniform(0.5, 100.0, shape), rng.uniform(0.0, 2.0 * np.pi, shape)
    # A tenth is without chroma.
    chroma = rng.uniform(0.0, 110.0, shape) * (rng.random(shape) > 0.1)
    if kind == "nearly grey":
        chroma = rng.uniform(0.0, 2.5, shape)
    if kind == "in the dark":
        lightness, chroma = rng.uniform(0.0, 8.0, shape), rng.uniform(0.0, 8.0, shape)
    lab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], axis=-1)
    if kind == "any":
        return lab, rng.permuted(lab.reshape(-1, 3), axis=0).reshape(lab.shape)
    if kind == "nearly grey":
        # Hues that are opposite, or all but that.
        turned = np.stack([lightness, -lab[..., 1], -lab[..., 2] * (1.0 + 1e-3 * rng.normal(size=shape))], axis=-1)
        return lab, turned
    spread = {"close": 1.5, "hardly apart": 0.03, "in the dark": 0.5}[kind]
    return lab, lab + spread * rng.normal(size=lab.shape)


def canvases(owner, *pictures, coverage=1.0):
    full = [np.dstack([one, np.full(one.shape[:2], coverage)]).astype(np.float32) for one in pictures]
    return tuple(owner.texels(one) for one in full)


@pytest.mark.parametrize("light", ["D65", "A"])
@pytest.mark.parametrize("kind", ["any", "close", "hardly apart", "nearly grey", "in the dark"])
def test_maps_are_those_of_double_precision(owner, differing, kind, light):
    white = white_of(light)
    xyz = [xyz_from_lab(one, white).astype(np.float32) for one in pairs(kind)]
    pair = canvases(owner, *xyz)
    drawn = owner.texture((SIDE, SIDE), 1)
    for method in FORMULAS:
        differing.draw(drawn, pair, (white, white), method)
        found = differing.whole(drawn, pair, (white, white), method)
        wanted = Formula(method)(*(one.astype(np.float64) for one in xyz), white)
        numbers = np.isfinite(wanted)
        # Lightness below none has no place in CAM16.
        assert numbers.mean() > (0.95 if method == "CAM16-UCS" else 0.999) and (np.isfinite(found) == numbers).all()
        counted = numbers & (wanted < 5.0) if method == "CIE 2000" else numbers
        off = np.abs(found - wanted)[counted]
        assert off.max() < (0.05 if method == "CAM16-UCS" else 1e-3), (method, off.max())
        np.testing.assert_array_equal(read(drawn)[..., 0][numbers], found[numbers])


def test_colours_that_no_light_has_are_worked_out_again(owner, differing):
    """Near where CAM16 divides by nothing, and beyond."""
    white = white_of("D65")
    rng = np.random.default_rng(4)
    xyz = [rng.uniform(-0.1, 0.3, (SIDE, SIDE, 3)).astype(np.float32) for _ in range(2)]
    pair = canvases(owner, *xyz)
    drawn = owner.texture((SIDE, SIDE), 1)
    differing.draw(drawn, pair, (white, white), "CAM16-UCS")
    assert 0.001 < np.isinf(read(drawn)).mean() < 0.9
    found = differing.whole(drawn, pair, (white, white), "CAM16-UCS")
    with np.errstate(invalid="ignore"):
        wanted = Formula("CAM16-UCS")(*(one.astype(np.float64) for one in xyz), white)
    both = np.isfinite(wanted) & np.isfinite(found)
    assert both.mean() > 0.3
    assert np.abs(found - wanted)[both].max() < 0.05


def test_what_is_compared_is_what_a_report_compares(owner, differing):
    white = white_of("D65")
    rng = np.random.default_rng(1)
    first, second = (rng.uniform(0.0, 1.0, (SIDE, SIDE, 3)).astype(np.float32) for _ in range(2))
    coverage = np.where(rng.random((SIDE, SIDE)) < 0.3, 0.5, 1.0).astype(np.float32)
    first[:9, :9] = second[:9, :9] = 0.0
    second[20, 20] = np.nan
    coverage[20, 20] = 1.0
    pair = tuple(owner.texels(np.dstack([one, coverage])) for one in (first, second))
    drawn = owner.texture((SIDE, SIDE), 1)
    differing.draw(drawn, pair, (white, white))
    found = differing.whole(drawn, pair, (white, white))
    wanted = delta_e_map(first, second, white, coverage)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(wanted))
    assert np.isinf(found[20, 20])
    counted, theirs = delta_e_statistics(found), delta_e_statistics(wanted)
    assert (counted.pixels, counted.undefined) == (theirs.pixels, 1)
    assert counted.p95 == pytest.approx(theirs.p95, abs=1e-3)


def test_the_sample_is_taken_to_the_white_of_the_reference(owner, differing):
    whites = white_of("D65"), white_of("A")
    grey = np.full((SIDE, SIDE, 1), 0.4)
    xyz = (grey * whites[0], grey * whites[1])
    pair = canvases(owner, *xyz)
    drawn = owner.texture((SIDE, SIDE), 1)
    differing.draw(drawn, pair, whites)
    assert read(drawn).max() < 1e-3
    differing.draw(drawn, pair, (whites[0], whites[0]))
    assert read(drawn).min() > 10.0
    assert adaptation_matrix(whites[1], whites[0]) @ whites[1] == pytest.approx(whites[0])
