"""IES TM-27: one spectrum in XML."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats import iestm27
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import format_of, read_spectra

HEADER = "<Manufacturer>Acme</Manufacturer><Description>lamp 3</Description><ReportNumber>R7</ReportNumber>"
POINTS = ((400, 0.2), (410.5, 0.4), (430, 0.9))


def document(quantity="relative", more="", points=POINTS, namespace="iestm2714", root="IESTM2714", header=HEADER):
    data = "".join(f'<SpectralData wavelength="{w}">{v}</SpectralData>' for w, v in points)
    return (
        f'<?xml version="1.0"?>\n<{root} xmlns="{namespace}" version="1.0"><Header>{header}</Header>'
        f"<SpectralDistribution><SpectralQuantity>{quantity}</SpectralQuantity>{more}{data}"
        f"</SpectralDistribution></{root}>"
    )


@pytest.fixture
def written(written):
    return lambda content, name="made.spdx": written(content, name)


def refusal(path):
    with pytest.raises(InputError) as caught:
        iestm27.read(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    "word, quantity, units",
    [
        ("flux", "emission", "W/nm"), ("intensity", "emission", "W/(sr nm)"),
        ("irradiance", "emission", "W/(m^2 nm)"), ("radiance", "emission", "W/(sr m^2 nm)"),
        ("exitance", "emission", "W/(m^2 nm)"), ("relative", "emission", "relative"),  # codespell:ignore exitance
        ("reflectance", "reflectance", None), ("transmittance", "transmittance", None),
        ("R-Value", "radiance factor", None), ("R-Factor", "radiance factor", None),
        ("T-Value", "transmittance", None), ("T-Factor", "transmittance", None),
    ],
)  # fmt: skip
def test_every_quantity_of_the_standard(written, word, quantity, units):
    (entry,) = iestm27.read(written(document(word))).entries
    assert entry.spectrum.quantity == quantity and entry.details.get("units") == units
    assert entry.details["quantity"] == word and entry.name == "lamp 3"
    np.testing.assert_array_equal(entry.spectrum.wavelengths_nm, [400, 410.5, 430])
    np.testing.assert_array_equal(entry.spectrum.samples, [0.2, 0.4, 0.9])


def test_all_that_is_said_is_kept(written):
    more = (
        "<ReflectionGeometry>de:8</ReflectionGeometry><BandwidthFWHM>2.0</BandwidthFWHM>"
        "<BandwidthCorrected>true</BandwidthCorrected>"
    )
    file = iestm27.read(written(document("reflectance", more)))
    assert dict(file.details) == {
        "Manufacturer": "Acme", "Description": "lamp 3", "ReportNumber": "R7", "version": "1.0"
    }  # fmt: skip
    assert dict(file.entries[0].details) == {
        "quantity": "reflectance", "geometry": "de:8", "bandwidth": "2.0", "bandwidth corrected": "true"
    }  # fmt: skip
    assert file.notes == ()


@pytest.mark.parametrize("header, name", [("<CatalogNumber>7</CatalogNumber>", "7"), ("", "made")])
def test_without_a_description(written, header, name):
    assert iestm27.read(written(document(header=header))).entries[0].name == name


@pytest.mark.parametrize("namespace, noted", [("http://www.ies.org/iestm2714", False), ("urn:x", True), ("", True)])
def test_namespaces(written, namespace, noted):
    path = written(document(namespace=namespace))
    assert format_of(path) is iestm27
    assert bool(iestm27.read(path).notes) == noted


@pytest.mark.parametrize("told", ["%R", "R (%)", "percent reflectance"])
def test_a_file_that_says_percent_is_followed(written, told):
    (entry,) = iestm27.read(written(document(told, points=((400, 20), (410, 40), (430, 90))))).entries
    np.testing.assert_allclose(entry.spectrum.samples, [0.2, 0.4, 0.9])


def test_a_geometry_that_is_none_says_nothing(written):
    more = "<ReflectionGeometry>other</ReflectionGeometry><TransmissionGeometry>0:0</TransmissionGeometry>"
    for quantity, geometry in (("relative", None), ("transmittance", "0:0")):
        text = document(quantity, more if geometry else more.replace("0:0", "none"))
        (entry,) = iestm27.read(written(text)).entries
        assert entry.details.get("geometry") == (geometry or "other")


def test_points_are_sorted(written):
    file = iestm27.read(written(document(points=POINTS[::-1])))
    assert file.entries[0].spectrum.wavelengths_nm[0] == 400 and "sorted" in file.notes[0]


@pytest.mark.parametrize(
    "text, words",
    [
        (document("absorptance"), "absorptance is what"),
        (document("photon irradiance"), "no reflectance, transmittance or emission"),
        (document("W/m2/Hz"), "over a frequency"),
        (document("reflectance", "<SpectralQuantity>transmittance</SpectralQuantity>"), "two quantities"),
        (document("relative", "<ReflectionGeometry>de:8</ReflectionGeometry>"), "the geometry another"),
        (document("reflectance", "<TransmissionGeometry>0:0</TransmissionGeometry>"), "the geometry another"),
        (document("transmittance", "<ReflectionGeometry>45:0</ReflectionGeometry>"), "the geometry another"),
        (document("%R"), "the numbers say fractions"),
        (document("other"), "no reflectance, transmittance or emission"),
        (document(""), "no SpectralQuantity"),
        (document(points=()), "not a spectrum"),
        (document(points=((400, 1), (400, 2))), "stands twice"),
        (document(points=((400, "1,5"), (410, 2))), "decimal commas"),
        (document(points=((400, 1), ("", 2))), "not a number"),
        (document("reflectance", points=((400, 20), (410, 50))), "percent"),
        (document("relative", points=((400, 1), (410, -0.5))), "negative"),
        (document().replace("SpectralDistribution", "Other"), "no SpectralDistribution"),
        ("<SPDX><a/></SPDX>", "not an IES TM-27 file"),
        ("not xml", "not well-formed"),
        ("", "empty"),
    ],
)
def test_what_is_refused(written, text, words):
    assert words in refusal(written(text))


def test_the_real_file(shared_data):
    folder = shared_data / "spectra" / "iestm27"
    if not folder.is_dir():
        pytest.skip(f"no TM-27 files in {folder}")
    file = read_spectra(folder / "TM27 Sample Spectral Data.spdx")
    (entry,) = file.entries
    assert file.format == "IES TM-27" and entry.name == "LED 2' x 4' Troffer"
    assert entry.spectrum.quantity == "emission" and entry.spectrum.samples[17] == 1.0
    np.testing.assert_array_equal(entry.spectrum.wavelengths_nm, np.arange(400, 651, 10))
    assert file.details["ReportNumber"] == "APEX-091101-004" and len(file.details) == 11


@pytest.mark.parametrize("unit", ["W/nm", "W/m2/nm", "mW/(m^2 nm)", "W.sr-1.m-2.nm-1", "spectral power distribution"])
def test_a_unit_in_place_of_the_quantity_is_taken_and_said(written, unit):
    file = iestm27.read(written(document(quantity=unit)))
    assert file.entries[0].spectrum.quantity == "emission" and file.entries[0].details["units"] == unit
    assert any(unit in note and "emission" in note for note in file.notes)
    assert "none of" not in refusal(written(document(quantity="sone")))


@pytest.mark.parametrize(
    "told", ["Watt/nm", "watts per nanometer", "W/nm", "kW/nm", "Spectral flux", "mW/(m² nm)", "µWatt/cm²/nm", "power"]
)
def test_power_by_any_name_is_emission(written, told):
    (entry,) = iestm27.read(written(document(told))).entries
    assert entry.spectrum.quantity == "emission" and entry.details["units"] == told


@pytest.mark.parametrize("told", ["other", "unknown", "arbitrary", ""])
def test_what_the_file_does_not_say_the_import_may(written, told):
    path = written(document(told))
    assert "--as reflectance" in refusal(path)
    (entry,) = read_spectra(path, ImportOptions("emission")).entries
    assert entry.spectrum.quantity == "emission"
    (entry,) = read_spectra(path, ImportOptions("reflectance", "fraction")).entries
    assert entry.spectrum.quantity == "reflectance"


@pytest.mark.parametrize("told", ["absorptance", "counts", "photon flux", "lm/nm", "luminous flux", "W/Hz", "BRDF"])
def test_what_is_another_quantity_no_answer_makes_one_of_ours(written, told):
    with pytest.raises(InputError) as caught:
        read_spectra(written(document(told)), ImportOptions("emission"))
    assert "SpectralQuantity" in str(caught.value) and "--as" not in str(caught.value)
