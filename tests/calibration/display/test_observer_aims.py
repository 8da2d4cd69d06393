"""Displays aimed for observers whom they were not characterised for, from the spectra of their readings."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.calibration.display.aim import PICTURE_WHITE_XYZ, AimSettings, d65_xyz
from metamer.calibration.display.characterise import characterise
from metamer.calibration.display.observer_aims import observer_aims
from metamer.calibration.display.patches import patches
from metamer.calibration.display.primaries import Primaries, with_primaries
from metamer.calibration.display.record import read_record
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz


def record_of(display, scale=1.0, luminance=1.0):
    """Characterise a display by readings with spectra. scale : unit of the spectra. luminance : of XYZ."""
    codes = patches(61)
    read, spectra = display.measured(codes, 0, noise=0.2), display.spectra(codes)
    spectra = replace(spectra, radiance=scale * spectra.radiance)
    read = replace(read, xyz=luminance * read.xyz, spectra=spectra, absolute=luminance == 1.0)
    return characterise(read).record


@pytest.fixture(scope="module")
def lcd_record(simulated):
    return record_of(simulated["LCD"])


# A fourth emitter is not in any matrix of three: how far that goes is said.
@pytest.mark.slow_cases("WRGB OLED-0-0.3-1.5")
@pytest.mark.parametrize(
    "name, leak, mean, largest", [("LCD", 0, 0.02, 0.1), ("LCD", 5, 0.02, 0.1), ("WRGB OLED", 0, 0.3, 1.5)]
)
def test_codes_show_each_observer_what_its_picture_asks_for(simulated, name, leak, mean, largest):
    """leak : of blue light at all codes, of a colour of its own."""
    display = simulated[name]
    emitters = display.emitters.copy()
    emitters[-1] += leak * emitters[2][::-1]
    display = replace(display, emitters=emitters)
    record = record_of(display, scale=1e3)
    aims = observer_aims(record)
    assert [one.observer for one in aims] == ["1964_10", "2015_2", "2015_10"]
    assert_shown(display, record, aims, mean, largest)
    exact = name == "LCD"
    assert all((one.largest_off < 1e-6) == exact and one.mean_off < mean for one in aims)
    if leak:
        return
    # Its primaries alone, as a file has them, tell as much, but for the leak; white too where it is an emitter's.
    by_primaries = replace(
        record, readings=with_primaries(replace(record.readings, spectra=None), primaries_of(display))
    )
    aims = observer_aims(by_primaries)
    assert_shown(display, by_primaries, aims, 2.0 * mean, 2.0 * largest)
    assert all((one.largest_off < 1e-6) == exact for one in aims)


def primaries_of(display):
    """Red, green, blue and white at full code, in a unit of their own."""
    spectra = display.spectra(np.array([*np.eye(3), np.ones(3)]))
    pure, lit = (replace(spectra, radiance=100.0 * spectra.radiance[:count]) for count in (3, 4))
    return Primaries(display.name, pure, lit)


def assert_shown(display, record, aims, mean, largest):
    """Assert that codes aimed for each observer show what was asked for, to so much of ΔE94."""
    codes = np.random.default_rng(4).random((300, 3))
    for one in aims:
        asked = display.xyz(codes, one.observer) @ np.linalg.inv(one.aim.adapted).T
        sent = (asked @ one.front[:, :3].T + one.front[:, 3]) @ record.aim.adapted.T
        shown = display.xyz(codes)
        off = delta_e_xyz(shown, sent, record.aim.white_xyz)
        assert off.mean() < mean and off.max() < largest, one.observer
        # The picture's white is this observer's D65, and as bright as the display can have it.
        unit = one.aim.white_xyz / one.aim.white_xyz[1]
        assert delta_e_xyz(d65_xyz(one.observer), unit, unit) < 1e-3
        light = np.linalg.solve(display.xyz(np.eye(3), one.observer).T, one.aim.white_xyz)
        assert display.name != "LCD" or 0.985 < light.max() < 1.005
        # White as aimed for 1931 is none of this observer's.
        before = delta_e_xyz(shown, asked @ record.aim.adapted.T, record.aim.white_xyz)
        assert before.mean() > 3.0 * off.mean()


def test_black_is_moved_to_that_of_the_display_for_each_observer(lcd_record):
    record = lcd_record
    for one in observer_aims(record):
        for picture, shown in ((np.zeros(3), record.model.xyz(np.zeros((1, 3)))[0]), (PICTURE_WHITE_XYZ, None)):
            moved, plain = (record.aim.adapted @ one.for_first(picture, black) for black in ("bpc", "absolute"))
            np.testing.assert_allclose(moved, plain if shown is None else shown, rtol=1e-6, atol=1e-9)


def test_another_white_stays_the_light_that_it_is(simulated, lcd_record):
    display = simulated["LCD"]
    for white in ("native", (0.33, 0.34)):
        record = replace(lcd_record, settings=AimSettings(white))
        code = record.model.xyz(np.ones((1, 3)))[0] if white == "native" else None
        for one in observer_aims(record):
            sent = record.aim.adapted @ (one.front[:, :3] @ d65_xyz("1931_2") + one.front[:, 3])
            np.testing.assert_allclose(sent, record.aim.white_xyz, rtol=1e-9)
            if code is not None:
                np.testing.assert_allclose(one.aim.white_xyz, display.xyz(np.ones((1, 3)), one.observer)[0], rtol=0.01)


def test_a_luminance_holds_as_far_as_an_observer_can_have_it(lcd_record):
    record = lcd_record
    low, high = (observer_aims(replace(record, settings=AimSettings("d65", one))) for one in (80.0, 117.0))
    assert all(one.aim.white_xyz[1] == pytest.approx(80.0) for one in low)
    assert all(one.aim.white_xyz[1] == pytest.approx(117.0) for one in high)
    brighter = observer_aims(replace(record, settings=AimSettings("d65", record.aim.white_xyz[1])))
    assert all(one.aim.white_xyz[1] <= record.aim.white_xyz[1] * (1.0 + 1e-9) for one in brighter)


def test_relative_readings_keep_their_unit(simulated, lcd_record):
    own = observer_aims(lcd_record)
    other = observer_aims(record_of(simulated["LCD"], luminance=100.0 / 120.0))
    for one, relative in zip(own, other, strict=True):
        assert "of the display's white = 100" in relative.words and "cd/m2" in one.words
        np.testing.assert_allclose(relative.front, one.front, atol=2e-3)


def test_primaries_of_another_display_are_refused(simulated, lcd_record, tmp_path):
    readings = replace(lcd_record.readings, spectra=None)
    with pytest.raises(InputError, match="spectra of their own"):
        with_primaries(lcd_record.readings, primaries_of(simulated["LCD"]))
    for name, display in simulated.items():
        if name.startswith("LCD"):
            own = with_primaries(readings, primaries_of(display))
            continue
        with pytest.raises(InputError, match="primaries of another display"):
            with_primaries(readings, primaries_of(display))
    assert "is ΔE94 0." in own.notes[-1]
    # A record keeps them.
    replace(lcd_record, readings=own).write(tmp_path / "lcd.json")
    again = read_record(tmp_path / "lcd.json")
    for one, other in zip(observer_aims(replace(lcd_record, readings=own)), observer_aims(again), strict=True):
        np.testing.assert_array_equal(one.front, other.front)
    greys = readings.taken(np.ptp(readings.codes, axis=1) == 0.0)
    assert "not held against" in with_primaries(greys, primaries_of(simulated["LCD"])).notes[-1]


def test_without_spectra_there_is_none(simulated):
    assert observer_aims(characterise(simulated["LCD"].measured(patches(61), 0)).record) == ()
