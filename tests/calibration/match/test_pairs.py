"""Pairs, their verdicts, and which of them are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from metamer.calibration.match.page import _srgb
from metamer.calibration.match.pairs import MatchOptions, matched
from metamer.calibration.match.tolerance import Tolerance
from metamer.calibration.match.uncertainty import Repeatability
from metamer.calibration.report.direction import direction
from metamer.materials.analytic.coated_diffuse import CoatedDiffuse
from metamer.materials.analytic.lambert import Lambert
from metamer.materials.catalogue.material import Material
from metamer.materials.catalogue.samples import sample_of
from metamer.materials.records.material import Provenance
from metamer.runtime.errors import ComparisonError, InputError
from metamer.spectral.adaptation import adaptation_matrix
from metamer.spectral.colour_library import colour_science
from metamer.spectral.difference import differences, xyz_from_lab
from metamer.spectral.formats.registry import StatedColour
from metamer.spectral.formula import formula
from metamer.spectral.illuminants import illuminant
from metamer.spectral.metamerism import Conditions
from metamer.spectral.observers import observer
from metamer.spectral.sample import Sample
from metamer.spectral.spectrum import Spectrum
from orange_batch import NM, ORANGE, metamer_of, sample

D65, A, TL84 = (Conditions(name, "1964_10") for name in ("D65", "A", "TL84"))


def asked(*conditions, **more):
    tolerance = more.get("tolerance")
    formulas = (formula("CIE 2000"),) if tolerance is None else (tolerance.formula, formula("CIE 1976"))
    return MatchOptions(conditions or (D65,), formulas, **more)


def test_a_pair_has_its_differences_by_every_formula():
    (found,) = matched(sample("master", ORANGE), [sample("lot 1", 1.02 * ORANGE)], asked(D65, A))
    assert [one.conditions for one in found.differences] == [D65, A]
    first = found.differences[0]
    square = first.off.lightness**2 + first.off.chroma**2 + first.off.hue**2
    assert square == pytest.approx(((first.sample_lab - first.standard_lab) ** 2).sum())
    assert "lighter" in first.words and found.verdict == "not judged"


def test_wavelengths_need_not_be_the_same():
    fine = np.arange(360.0, 781.0, 1.0)
    other = sample("fine", np.interp(fine, NM, ORANGE) * 1.001, nm=fine)
    (found,) = matched(sample("coarse", ORANGE), [other], asked())
    assert 0.0 < found.worst.delta_e["CIE 2000"] < 0.1


@pytest.mark.parametrize(("limit", "verdict"), [(3.0, "pass"), (0.2, "fail"), (None, "not resolved")])
def test_a_limit_within_the_uncertainty_is_not_resolved(limit, verdict):
    master, lot = sample("master", ORANGE), sample("lot", 1.02 * ORANGE)
    (plain,) = matched(master, [lot], asked())
    limit = limit or 1.02 * plain.worst.delta_e["CIE 2000"]
    judging = Tolerance(formula("CIE 2000"), limit)
    (found,) = matched(master, [lot], asked(tolerance=judging, repeatability=Repeatability(0.05)))
    assert found.verdict == verdict
    (sure,) = matched(master, [lot], asked(tolerance=judging))
    assert sure.verdict == ("fail" if verdict == "fail" else "pass")


def test_the_worst_light_decides():
    judging = Tolerance.of("CIE 2000 0.5")
    lot = sample("lot", metamer_of(ORANGE))
    (found,) = matched(sample("master", ORANGE), [lot], asked(D65, A, tolerance=judging))
    assert [one.verdict for one in found.differences] == ["pass", "fail"]
    assert found.verdict == "fail" and found.worst.conditions == A


def test_directions_are_told_by_light_and_those_that_fail_come_first():
    """A metamer that matches under D65 and turns under A goes the way that it goes under A."""
    judging = Tolerance.of("CIE 2000 0.5")
    (found,) = matched(sample("master", ORANGE), [sample("lot", metamer_of(ORANGE))], asked(D65, A, tolerance=judging))
    passes, fails = found.differences
    assert [one.conditions for one in found.directions] == [(A,), (D65,)]
    assert found.directions[0].words == fails.words and found.directions[1].words == passes.words
    assert found.worst is fails and fails.words != passes.words


def test_the_conditions_that_decide_are_those_with_the_verdict():
    """A light of large uncertainty, where nothing is resolved, does not decide for one that fails."""
    (found,) = matched(sample("master", ORANGE), [sample("lot", 1.02 * ORANGE)], asked(D65, A))
    larger, other = sorted(found.differences, key=lambda one: -one.delta_e["CIE 2000"])
    told = replace(found, differences=(replace(larger, verdict="not resolved"), replace(other, verdict="fail")))
    assert told.verdict == "fail" and told.worst.conditions == other.conditions


def test_a_standard_is_not_its_own_sample():
    master = sample("master", ORANGE)
    with pytest.raises(ComparisonError, match="its own standard"):
        matched(master, [master], asked())
    with pytest.raises(ComparisonError, match="to the last digit"):
        matched(master, [sample("copy", ORANGE)], asked())


def paint(name, brdf):
    """A material of a catalogue, as an instrument reads it."""
    parameters = {"wavelengths_nm": brdf.wavelengths_nm, **brdf.parameters()}
    provenance = Provenance("one chart", "none", "analytic")
    return sample_of(Material(f"paint/{name}", "paint", brdf.NAME, parameters, provenance, None))


def coated(roughness, index=1.5):
    reading = Spectrum.sampled(NM, ORANGE, "reflectance")
    return CoatedDiffuse(reading, index, roughness).reads(reading, "45:0")


def test_finishes_over_one_reading_are_several_materials():
    """Where the bodies are those with which all read alike, a pair may have one colour to the last digit."""
    reading = Spectrum.sampled(NM, ORANGE, "reflectance")
    paints = {"gloss": coated(0.016), "satin": coated(0.06), "other-gloss": coated(0.02), "matt": Lambert(reading)}
    for name, brdf in paints.items():
        others = [paint(other, paints[other]) for other in paints if other != name]
        for found in matched(paint(name, brdf), others, asked()):
            assert found.worst.delta_e["CIE 2000"] < 1e-6
    for brdf in paints.values():
        with pytest.raises(ComparisonError, match="to the last digit"):
            matched(paint("one", brdf), [paint("two", brdf)], asked())


def test_no_sample_is_refused():
    with pytest.raises(InputError, match="no sample"):
        matched(sample("master", ORANGE), [], asked())


def test_a_stated_colour_is_good_for_its_own_conditions_only():
    lot = sample("lot", ORANGE)
    master = Sample("master", "test", stated=(StatedColour("Lab", lot.lab("D65", "1964_10") + 1.0, "D65", "1964_10"),))
    (found,) = matched(master, [lot], asked())
    assert found.worst.delta_e["CIE 2000"] > 0.5
    for other in (A, Conditions("D65", "1931_2")):
        with pytest.raises(ComparisonError, match="stated for D65 and 1964_10"):
            matched(master, [lot], asked(other))


def test_a_stated_xyz_is_on_a_scale_of_100():
    lot = sample("lot", ORANGE)
    xyz = 100.0 * lot.xyz("D65", "1964_10")
    master = Sample("master", "test", stated=(StatedColour("XYZ", xyz, "d65", "1964_10"),))
    (found,) = matched(master, [lot], asked())
    assert found.worst.delta_e["CIE 2000"] == pytest.approx(0.0, abs=1e-9)


def test_an_effect_coating_has_differences_and_no_index():
    lot = sample("lot", 1.1 * ORANGE, effect="an effect coating (flop index 9.1)")
    (found,) = matched(sample("master", ORANGE), [lot], asked(D65, A))
    assert found.worst.delta_e["CIE 2000"] > 0.5
    metamerism = [one for one in found.indices if one.name.startswith("metamerism")]
    assert all(one.value is None and "ISO 18314-4" in one.words for one in metamerism) and metamerism


@pytest.mark.parametrize(
    ("lab", "off", "words"),
    [
        ((50, 40, 1), (0, 0, 3), "yellower"),
        ((50, 40, -1), (0, 0, -3), "bluer"),
        ((50, 1, 40), (0, -3, 0), "greener"),
        ((50, 1, 40), (0, 3, 0), "redder"),
        ((50, -40, -1), (0, 0, -3), "bluer"),
        ((50, -1, -40), (0, 3, 0), "redder"),
        ((50, 30, 30), (1, 1, 1), "stronger, lighter"),
        ((50, 1, 1), (-2, 0, -1), "darker, bluer"),
        ((50, 0, 0), (0, 0, 0), "alike"),
        # No hue between orange and blue would name this change.
        ((50, 30, 30), (0, -30, -60), "bluer, greener"),
        # A hue that has turned past red towards blue is no redder colour alone, nor one that has turned past yellow.
        ((50, 10, 10), (0, 4, -33), "bluer"),
        ((50, 10, 10), (0, 25, -22), "redder, bluer"),
        ((50, 10, 10), (0, 25, -13), "stronger, redder"),
        ((50, 20, 30), (0, -30, 5), "greener"),
    ],
)
def test_directions_in_words(lab, off, words):
    standard = np.array(lab, dtype=float)
    assert direction(standard, differences(standard, standard + off)) == words


@pytest.mark.parametrize("words", ["CMC 2:1 1.0", "CIE 2000 0.8", "CIE 1994 1.5", "CAM16-UCS 1"])
def test_the_outline_is_where_the_tolerance_ends(words):
    tolerance, lab, white = Tolerance.of(words), np.array([61.0, 25.0, 40.0]), np.array([0.95, 1.0, 1.07])
    across, up = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    outline = tolerance.outline(lab, white, across, up)
    at = xyz_from_lab(lab + outline @ np.stack([across, up]), white)
    off = tolerance.formula(np.broadcast_to(xyz_from_lab(lab, white), at.shape), at, white)
    np.testing.assert_allclose(off, tolerance.limit, rtol=1e-6)
    np.testing.assert_allclose(outline[0], outline[-1], atol=1e-9)


@pytest.mark.parametrize("words", ["CMC 2:1", "1.0", "CIE 2000 0", "CIE 2000 -1", "CIE 2000 nan", ""])
def test_what_is_no_tolerance(words):
    with pytest.raises(InputError):
        Tolerance.of(words)


def test_swatches_are_what_srgb_shows_of_both_samples():
    """Swatches agree with colour-science after adaptation from the light's white; out of sRGB they stay at its ends."""
    white, daylight = (observer("1931_2").white(illuminant(name)) for name in ("A", "D65"))
    labs = np.random.default_rng(2).uniform([0.0, -60.0, -60.0], [100.0, 60.0, 60.0], (40, 3))
    shown = colour_science().XYZ_to_sRGB(xyz_from_lab(labs, white) @ adaptation_matrix(white, daylight).T)
    wanted = np.rint(255.0 * np.clip(shown, 0.0, 1.0)).astype(int)
    assert [_srgb(lab, white) for lab in labs] == ["#{:02x}{:02x}{:02x}".format(*row) for row in wanted.tolist()]
