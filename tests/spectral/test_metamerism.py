"""Metamerism indices and colour inconstancy."""

from __future__ import annotations

import numpy as np
import pytest
from metamer.runtime.errors import ComparisonError
from metamer.spectral.colour_library import colour_science
from metamer.spectral.difference import lab_from_xyz
from metamer.spectral.formula import formula
from metamer.spectral.illuminants import illuminant
from metamer.spectral.metamerism import Conditions, colour_inconstancy, metamerism_index
from metamer.spectral.observers import observer
from metamer.spectral.sample import Sample
from metamer.spectral.spectrum import Spectrum

NM = np.arange(380.0, 781.0, 5.0)
D65, A = Conditions("D65", "1964_10"), Conditions("A", "1964_10")
CIE_1976, CMC = formula("CIE 1976"), formula("CMC 1:1")
BASE = 0.2 + 0.4 / (1.0 + np.exp(-(NM - 580.0) / 25.0))


def sample(name, row, **facts):
    return Sample(name, "test", (Spectrum.sampled(NM, row),), **facts)


def metameric(size=0.05):
    """The base and a metameric black."""
    seen = observer("1964_10").weights(illuminant("D65"), NM)
    wave = size * np.cos((NM - 380.0) / 30.0)
    return BASE + wave - seen.T @ np.linalg.solve(seen @ seen.T, seen @ wave)


def test_of_true_metamers_every_correction_is_the_plain_difference():
    pair = sample("standard", BASE), sample("sample", metameric())
    white = observer(A.observer).white(illuminant(A.illuminant))
    first, second = (lab_from_xyz(one.xyz(A.illuminant, A.observer), white) for one in pair)
    wanted = np.linalg.norm(second - first)
    assert wanted > 1.0
    for correction in ("none", "multiplicative", "parameric"):
        assert metamerism_index(*pair, D65, A, CIE_1976, correction) == pytest.approx(wanted, rel=1e-6)


def test_a_paler_sample_of_the_same_shape_has_next_to_no_index():
    pair = sample("standard", BASE), sample("sample", 0.9 * BASE)
    assert metamerism_index(*pair, D65, A, CIE_1976, "none") > 3.0
    assert metamerism_index(*pair, D65, A, CIE_1976) < 1e-9
    # A scaled spectrum differs in a part that the light sees and one that it does not: only the first is corrected
    # here.
    assert metamerism_index(*pair, D65, A, CIE_1976, "parameric") < 1.2


def test_the_parameric_correction_makes_the_pair_match_under_the_reference():
    pair = sample("standard", BASE), sample("sample", 0.95 * metameric() + 0.01)
    assert metamerism_index(*pair, D65, D65, CIE_1976, "parameric") < 1e-9
    assert metamerism_index(*pair, D65, D65, CIE_1976) < 1e-9
    assert metamerism_index(*pair, D65, D65, CIE_1976, "none") > 0.5


#: X, Y, Z under D65 and under A for the 10 degree observer: the example of ISO 18314-4:2024, as colour-science has it.
PRINTED = {
    "standard": {"D65": (7.6576, 10.7116, 5.0731), "A": (8.96442, 10.1878, 1.6663)},
    "sample": {"D65": (7.6933, 10.5616, 5.54474), "A": (8.56438, 10.0324, 1.9315)},
}


def test_the_printed_example_of_iso_18314_4():
    """Its XYZ stand for whatever is seen: no spectra are printed beside them."""
    key = {illuminant(name).key: name for name in ("D65", "A")}
    pair = [
        Sample(name, "ISO", seen=lambda light, eye, seen=seen: np.array(seen[key[light.key]]) / 100.0)
        for name, seen in PRINTED.items()
    ]
    found = metamerism_index(*pair, D65, A, CIE_1976, "multiplicative")
    # Printed relative to a white that is rounded otherwise, in its fifth digit.
    assert found == pytest.approx(3.7907, abs=1e-3)
    colour = colour_science()
    white = colour.XYZ_to_xy(observer("1964_10").white(illuminant("A")))
    xyz = [np.array(PRINTED[name][light]) / 100 for light in ("A", "D65") for name in ("sample", "standard")]
    wanted = colour.difference.XYZ_to_metamerism_index(*xyz, "Multiplicative", "CIE 1976", illuminant=white)
    assert found == pytest.approx(float(wanted), abs=1e-4)


@pytest.mark.parametrize("name", ["CIE 1976", "CIE 1994", "CIE 2000"])
def test_the_multiplicative_index_is_colour_science_s(name):
    colour, rng = colour_science(), np.random.default_rng(4)
    white = colour.XYZ_to_xy(observer("1964_10").white(illuminant("A")))
    for _ in range(20):
        rows = np.clip(BASE + 0.1 * np.cumsum(rng.normal(0.0, 0.2, (2, NM.size)), axis=1) / 4.0, 0.01, 1.0)
        standard, trial = (sample(one, row) for one, row in zip(("standard", "sample"), rows, strict=True))
        xyz = [side.xyz(light, "1964_10") for light in ("A", "D65") for side in (trial, standard)]
        wanted = colour.difference.XYZ_to_metamerism_index(*xyz, "Multiplicative", name, illuminant=white)
        assert metamerism_index(standard, trial, D65, A, formula(name)) == pytest.approx(float(wanted), abs=1e-4)


def test_another_observer_is_a_change_like_another_light():
    pair = sample("standard", BASE), sample("sample", metameric())
    assert metamerism_index(*pair, D65, Conditions("D65", "1931_2"), CIE_1976) > 0.1


def test_effect_coatings_colours_and_fluorescence_are_refused_by_name():
    standard = sample("standard", BASE)
    with pytest.raises(ComparisonError, match="ISO 18314-4"):
        metamerism_index(standard, sample("silver", BASE, effect="an effect coating"), D65, A, CIE_1976)
    with pytest.raises(ComparisonError, match="no spectrum"):
        metamerism_index(standard, Sample("lab", "test"), D65, A, CIE_1976)
    glowing = Sample("glowing", "test", seen=lambda light, eye: 0.5 * eye.white(light))
    assert metamerism_index(standard, glowing, D65, A, CIE_1976) > 0.0
    with pytest.raises(ComparisonError, match="fluoresces"):
        metamerism_index(standard, glowing, D65, A, CIE_1976, "parameric")
    with pytest.raises(ComparisonError, match="black"):
        metamerism_index(standard, sample("black", 0.0 * BASE), D65, A, CIE_1976)


def test_a_grey_is_constant_and_a_colour_is_adapted_as_colour_science_adapts():
    grey = sample("grey", np.full(NM.size, 0.4))
    assert colour_inconstancy(grey, D65, A, CMC) < 1e-9
    one = sample("one", BASE)
    colour = colour_science()
    eye = observer("1964_10")
    whites = [eye.white(illuminant(name)) for name in ("A", "D65")]
    adapted = colour.adaptation.chromatic_adaptation_VonKries(one.xyz("A", "1964_10"), *whites, transform="CAT02")
    labs = [colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(whites[1])) for xyz in (one.xyz("D65", "1964_10"), adapted)]
    wanted = colour.difference.delta_E_CMC(*labs, l=1, c=1)
    assert colour_inconstancy(one, D65, A, CMC) == pytest.approx(float(wanted), abs=1e-3)
