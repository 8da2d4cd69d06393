"""A display measured again: what is found, what is refused, what is left open."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.calibration.display.characterise import characterise
from metamer.calibration.display.criteria import KNOWN, criteria_named
from metamer.calibration.display.patches import patches
from metamer.calibration.display.primaries import apart_for, read_primaries
from metamer.calibration.display.readings import Readings
from metamer.calibration.display.verification import verify
from metamer.calibration.display.verification_outputs import verification_junit, verification_page
from metamer.runtime.errors import ComparisonError, InputError
from metamer.spectral.difference import delta_e_xyz, lab_from_xyz, xyz_from_lab

METAMER = KNOWN["metamer"]
WHEN = "2026-01-02T03:04:05+00:00"


@pytest.fixture(scope="module")
def record(lcd):
    return characterise(lcd).record


@pytest.fixture(scope="module")
def again(simulated):
    return simulated["LCD"].measured(np.round(patches(51, "verify") * 255.0) / 255.0, 8)


def figures(found):
    return {row.criterion.statistic: row for row in found.rows}


def test_the_same_display_passes(record, again):
    found = verify(record, again, METAMER, WHEN)
    rows = figures(found)
    assert found.verdict in ("recommended", "pass")
    assert rows["average"].value < 0.4 and rows["white"].value < 0.5
    assert found.injected == pytest.approx(1.0, abs=1e-6)
    document = found.document
    assert document["verdict"] == found.verdict and len(document["patches_delta_e94"]) == 51


def test_an_injected_difference_of_1_is_found(record, again, simulated):
    """Every patch moved by ΔE94 1, each in a direction of its own."""
    white = record.model.white_xyz
    lab = lab_from_xyz(record.model.xyz(again.codes), white)
    random = np.random.default_rng(1).standard_normal(lab.shape)
    for _ in range(20):
        moved = xyz_from_lab(lab + random, white)
        random /= delta_e_xyz(xyz_from_lab(lab, white), moved, white)[:, None]
    moved = xyz_from_lab(lab + random, white)
    truth = simulated["LCD"].xyz(again.codes)
    noise = again.xyz - truth
    injected = Readings(again.codes, moved + noise, "injected")
    found = figures(verify(record, injected, METAMER, WHEN))
    assert found["average"].value == pytest.approx(1.0, abs=0.1)


def test_wrong_files_are_refused_by_name(record, again, lcd):
    with pytest.raises(ComparisonError, match="readings that the display was characterised with"):
        verify(record, lcd.taken(np.arange(len(lcd))[::-1]), METAMER, WHEN)
    with pytest.raises(ComparisonError, match="readings of another display"):
        verify(record, replace(again, display="Another"), METAMER, WHEN)
    with pytest.raises(ComparisonError, match="readings of another observer"):
        verify(record, replace(again, observer="1964_10"), METAMER, WHEN)
    with pytest.raises(ComparisonError, match="in another unit"):
        verify(record, replace(again, absolute=False), METAMER, WHEN)
    warmer = replace(again, xyz=again.xyz * np.array([1.0, 1.0, 0.8]))
    with pytest.raises(ComparisonError, match="in another state"):
        verify(record, warmer, METAMER, WHEN)
    assert verify(record, warmer, METAMER, WHEN, any_state=True).verdict == "fail"


def test_a_tolerance_that_the_instrument_cannot_tell(record, again):
    noisy = np.random.default_rng(0).standard_normal(again.xyz.shape)
    found = verify(record, replace(again, xyz=again.xyz * (1.0 + 0.02 * noisy)), METAMER, WHEN)
    assert found.repeatability > 1.0 and figures(found)["average"].verdict == "not resolved"
    few = again.taken(np.concatenate([[again.whites[0]], np.setdiff1d(np.arange(len(again)), again.whites)]))
    assert figures(verify(record, few, METAMER, WHEN))["white"].verdict == "not resolved"


def test_what_was_not_measured_is_not_judged(record, again):
    coloured = again.taken(np.ptp(again.codes, axis=1) > 0.05)
    whites = again.taken(again.whites)
    readings = Readings(np.concatenate([whites.codes, coloured.codes]), np.concatenate([whites.xyz, coloured.xyz]))
    rows = figures(verify(record, readings, METAMER, WHEN))
    assert rows["grey average"].verdict == rows["contrast"].verdict == "not measured"


def test_page_junit_and_trend(record, again):
    first = verify(record, again, METAMER, WHEN)
    later = verify(replace(record, verifications=(first.kept,)), again, criteria_named("iso-14861"), WHEN)
    page = verification_page(later)
    assert "ISO 14861" in page and f"{figures(first)['average'].value:.2f}" in page and "Signature" in page
    assert '<testcase classname="ISO 14861" name="average of all patches"' in verification_junit(later)


def test_criteria_of_a_file(tmp_path):
    path = tmp_path / "ours.toml"
    path.write_text(
        'metamer_criteria = 1\nname = "Ours"\n[[criteria]]\nstatistic = "average"\nnominal = 0.9\nrecommended = 0.4\n'
        'formula = "CIE 2000"\n'
    )
    found = criteria_named(path)
    assert found.name == "Ours" and found.criteria[0].nominal == 0.9
    path.write_text(path.read_text().replace("0.4", "1.4"))
    with pytest.raises(InputError, match="limits that contradict"):
        criteria_named(path)
    with pytest.raises(InputError, match="unknown criteria"):
        criteria_named("iso-1")


def test_real_primaries(shared_data):
    """What matches for 1931 does not for the observers of 2015, on real screens."""
    folder = shared_data / "spectra" / "displays"
    found = {path.stem: read_primaries(path) for path in sorted(folder.glob("*.ccss"))}
    for one in found.values():
        xyz = one.spectra.xyz("1931_2")
        xy = xyz[:, :2] / xyz.sum(axis=1, keepdims=True)
        assert xy[0, 0] > 0.55 and xy[1, 1] > 0.5 and xy[2, 1] < 0.15
    lcd, crt = found["WLEDFamily_07Feb11"], found["CRT"]
    assert apart_for(lcd, crt, "1931_2", "1931_2") < 1e-6
    assert apart_for(lcd, crt, "1931_2", "2015_10") > 1.0
