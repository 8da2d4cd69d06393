"""Lights by name."""

import numpy as np
import pytest
from metamer.runtime.errors import UnknownNameError
from metamer.spectral.illuminants import booth_words, canonical_name, illuminant, illuminant_names, light_source_names
from metamer.spectral.observers import observer


def test_every_table_of_colour_science_is_there(colour):
    assert set(illuminant_names()) == set(colour.SDS_ILLUMINANTS)
    assert set(light_source_names()) == set(colour.SDS_LIGHT_SOURCES)
    assert {"D65", "A", "E", "FL11", "HP1", "LED-B1", "ID65"} <= set(illuminant_names())


def test_no_two_lights_share_a_name_in_any_case():
    names = [name.casefold() for name in illuminant_names() + light_source_names()]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("group", ["SDS_ILLUMINANTS", "SDS_LIGHT_SOURCES"])
def test_each_name_is_its_own_table(colour, group):
    tables = getattr(colour, group)
    for name in tables:
        found = illuminant(name)
        assert found.quantity == "emission"
        np.testing.assert_array_equal(found.wavelengths_nm, tables[name].wavelengths, err_msg=name)
        np.testing.assert_array_equal(found.samples, tables[name].values, err_msg=name)


@pytest.mark.parametrize("number", range(1, 13))
def test_f_series_aliases(number):
    np.testing.assert_array_equal(illuminant(f"F{number}").samples, illuminant(f"FL{number}").samples)


def test_case_does_not_matter():
    np.testing.assert_array_equal(illuminant("d65").samples, illuminant("D65").samples)


def test_d65_is_100_at_560_nm():
    d65 = illuminant("D65")
    assert d65.samples[d65.wavelengths_nm == 560.0].tolist() == [100.0]


@pytest.mark.parametrize(("asked", "near"), [("D56", "D65"), ("FL111", "FL11"), ("LED B1", "LED-B1")])
def test_unknown_illuminant_gives_the_nearest_names(asked, near):
    with pytest.raises(UnknownNameError, match="unknown illuminant") as caught:
        illuminant(asked)
    assert near in caught.value.nearest


@pytest.mark.parametrize(
    ("booth", "light"),
    [
        *[("TL84", "FL11"), ("tl84", "F11"), ("TL-84", "FL11"), ("U40", "FL11"), ("Ultralume 40", "FL11")],
        *[("TL83", "FL12"), ("Philips TL83", "FL12"), ("U30", "FL12"), ("u-30", "FL12"), ("Ultralume 3000", "FL12")],
        *[("TL85", "FL10"), ("U 50", "FL10"), ("CWF", "FL2"), ("cwf", "F2"), ("WWF", "FL4")],
    ],
)
def test_names_on_booths_are_those_of_cie_illuminants(booth, light):
    assert illuminant(booth) is illuminant(light) and canonical_name(booth) == canonical_name(light)
    assert booth_words(booth) == f"{booth} is CIE {canonical_name(light)}"


@pytest.mark.parametrize("name", ["U35", "TL835", "TL 830", "tl841", "Ultralume 3500", "TL865", "INC A", "Inc"])
def test_a_lamp_that_is_no_illuminant_says_what_to_write(name):
    hint = illuminant_error(name).hint
    assert "measured lamp of" in hint or hint.startswith("A, ")
    assert illuminant(hint.split("'")[1] if "'" in hint else hint[0]).quantity == "emission"


def test_a_lamp_is_itself_by_its_own_name_and_the_horizon_is_a_radiator():
    lamp, eye = illuminant("Philips TL-84"), observer("1931_2")
    assert np.abs(eye.white(lamp) - eye.white(illuminant("TL84"))).max() > 1e-3
    x, y, z = eye.white(illuminant("Horizon"))
    assert (x / (x + y + z), y / (x + y + z)) == pytest.approx((0.4952, 0.4155), abs=2e-3)
    assert "TL84" in illuminant_error("TL87").nearest


def illuminant_error(name):
    with pytest.raises(UnknownNameError) as caught:
        illuminant(name)
    return caught.value
