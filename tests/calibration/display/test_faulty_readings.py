"""Readings with a fault that a person makes: exchanged, mistyped, of the set before, of an unknown scale."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.calibration.display.characterise import _exchanged as exchanged_channels
from metamer.calibration.display.characterise import characterise
from metamer.calibration.display.criteria import criteria_named
from metamer.calibration.display.patches import patches
from metamer.calibration.display.reading_files import Answers, read_readings
from metamer.calibration.display.readings import Readings
from metamer.calibration.display.verification import verify
from metamer.runtime.errors import ComparisonError, InputError


def changed(readings, change):
    xyz = readings.xyz.copy()
    change(xyz, readings)
    return Readings(readings.codes, xyz)


def exchanged(xyz, readings):
    """Two coloured patches, far apart."""
    order = np.argsort(xyz[:, 1])
    inner = [at for at in order if np.ptp(readings.codes[at]) > 0.3]
    xyz[[inner[2], inner[-3]]] = xyz[[inner[-3], inner[2]]]


def mistyped(xyz, readings):
    at = np.flatnonzero(np.ptp(readings.codes, axis=1) > 0.5)[4]
    xyz[at] *= 10.0


def white_and_dark(xyz, readings):
    white, dark = readings.whites[2], int(np.argmin(xyz[:, 1]))
    xyz[[white, dark]] = xyz[[dark, white]]


@pytest.mark.parametrize("display", ["LCD", "WRGB OLED"])
@pytest.mark.parametrize("fault", [exchanged, mistyped, white_and_dark])
def test_a_reading_of_something_else_is_named(simulated, display, fault):
    readings = simulated[display].measured(patches(61), 0)
    if fault is exchanged:
        assert not [words for words in characterise(readings).warnings if "misread" in words]
    try:
        found = characterise(changed(readings, fault)).warnings
    except InputError as reason:
        found = (str(reason),)
    # A model that follows the wrong reading leaves sums of channels that do not add up: those are named.
    assert any("misread" in words or "from the sum of their parts" in words for words in found), found
    if fault is white_and_dark:
        assert any(f"reading {readings.whites[2] + 1}, of white" in words for words in found), found


@pytest.mark.parametrize("order", [(2, 1, 0), (1, 0, 2), (0, 2, 1), (1, 2, 0)])
@pytest.mark.parametrize("what", ["codes", "XYZ"])
def test_exchanged_columns_are_said(simulated, order, what):
    for display in simulated.values():
        readings = display.measured(patches(61), 1)
        assert exchanged_channels(readings) is None, display.name
        codes = readings.codes[:, order] if what == "codes" else readings.codes
        xyz = readings.xyz[:, order] if what == "XYZ" else readings.xyz
        wrong = Readings(np.ascontiguousarray(codes), np.ascontiguousarray(xyz))
        assert "are exchanged" in (exchanged_channels(wrong) or ""), display.name


def test_exchanged_columns_are_among_the_warnings(simulated):
    readings = simulated["LCD"].measured(patches(61), 1)
    found = characterise(Readings(np.ascontiguousarray(readings.codes[:, ::-1]), readings.xyz)).warnings
    assert any("are exchanged" in words for words in found), found


@pytest.fixture(scope="module")
def record(simulated):
    return characterise(simulated["LCD"].measured(patches(61), 0)).record


@pytest.fixture
def judged(record):
    return lambda readings: verify(record, readings, criteria_named(None), "2026-01-01T00:00:00+00:00")


def again(readings, xyz, rows=slice(None)):
    return Readings(readings.codes[rows], xyz[rows])


@pytest.mark.parametrize("decimals", [2, 3, 4])
@pytest.mark.parametrize("part", ["all", "some", "backwards", "with others"])
def test_readings_of_the_model_verify_nothing(simulated, judged, decimals, part):
    display = simulated["LCD"]
    readings = display.measured(patches(61), 0)
    xyz = np.round(readings.xyz, decimals)
    if part == "some":
        rows = np.r_[0:40, readings.whites[-1]]
        tried = again(readings, xyz, rows)
    elif part == "backwards":
        tried = again(readings, xyz, slice(None, None, -1))
    elif part == "with others":
        other = display.measured(patches(61, "verify"), 5)
        tried = Readings(np.concatenate([readings.codes, other.codes]), np.concatenate([xyz, other.xyz]))
    else:
        tried = again(readings, xyz)
    with pytest.raises(ComparisonError, match="characterised with"):
        judged(tried)


def test_the_same_patches_measured_again_are_judged(simulated, judged):
    for seed in range(1, 6):
        readings = simulated["LCD"].measured(patches(61), seed)
        assert judged(again(readings, np.round(readings.xyz, 2))).verdict in ("recommended", "pass", "not resolved")


def test_a_record_of_before_readings_were_kept_is_judged_as_it_was(simulated, record):
    readings = simulated["LCD"].measured(patches(61), 0)
    old = replace(record, read=np.zeros((0, 6)))
    rounded = again(readings, np.round(readings.xyz, 2))
    assert verify(old, rounded, criteria_named(None), "2026-01-01T00:00:00+00:00").verdict


@pytest.mark.parametrize("luminous", [1.0, 99.4, 100.0, 100.7])
def test_a_white_that_may_be_relative_is_asked_about(simulated, written, luminous):
    readings = simulated["LCD"].measured(patches(61), 0)
    xyz = readings.xyz * (luminous / readings.white_xyz[1])
    path = written(replace(readings, xyz=xyz), unit="")
    with pytest.raises(InputError, match="cd/m2 or relative"):
        read_readings(path)
    assert read_readings(path, Answers(unit="cd/m2")).white_xyz[1] == pytest.approx(luminous, rel=1e-4)
    assert read_readings(written(replace(readings, xyz=xyz), unit=" cd/m2")).absolute


@pytest.mark.parametrize(
    ("keyword", "name"),
    [
        ('DESCRIPTOR "Argyll Calibration Target chart information 3"', ""),
        ('DESCRIPTOR "Argyll Calibration Target chart information 1"\nDISPLAY "Desk"', "Desk"),
        ('DESCRIPTOR "Desk, left"', "Desk, left"),
    ],
)
def test_a_kind_of_file_is_no_display(simulated, tmp_path, keyword, name):
    readings = simulated["LCD"].measured(patches(61), 0)
    rows = "\n".join(
        f"{at} " + " ".join(f"{value:.6f}" for value in (*(100.0 * codes), *xyz))
        for at, (codes, xyz) in enumerate(zip(readings.codes, readings.xyz, strict=True), 1)
    )
    text = f'CTI3\n\n{keyword}\nORIGINATOR "Argyll dispread"\nDEVICE_CLASS "DISPLAY"\nCOLOR_REP "RGB_XYZ"\n'
    text += "NUMBER_OF_FIELDS 7\nBEGIN_DATA_FORMAT\nSAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z\nEND_DATA_FORMAT\n"
    text += f"NUMBER_OF_SETS {len(readings)}\nBEGIN_DATA\n{rows}\nEND_DATA\n"
    (tmp_path / "x.ti3").write_text(text)
    assert read_readings(tmp_path / "x.ti3").display == name
