"""CxF3 as it is written: valid against the schema, and read back bit for bit."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metamer.runtime.errors import InputError
from metamer.spectral.formats import cxf
from metamer.spectral.formats.cxf_writer import write_cxf
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import SpectralEntry, StatedColour
from metamer.spectral.spectrum import Spectrum

LAB = StatedColour("Lab", np.array([50.1, -3.25, 1 / 3]), "D50", "1931_2")
EVEN = np.arange(400.0, 701.0, 10.0)
UNEVEN = np.array([380.5, 400.0, 404.6565, 700.0, 1013.98])


def entry(name="red", grid=EVEN, quantity="reflectance", stated=(), top=1.0, **details):
    values = np.random.default_rng(len(name)).uniform(0.001, top, len(grid))
    return SpectralEntry(name, Spectrum.sampled(grid, values, quantity), tuple(stated), details)


def some():
    return [
        entry("漢字 & <b>", stated=(LAB,), geometry="45:0 annular", condition="M1 (M1_Daylight)", backing="white"),
        entry("uneven", UNEVEN, geometry="di:8", instrument="Acme 7", measured="2026-01-02T03:04:05.5+01:00"),
        entry("glass", quantity="transmittance", geometry="0:0"),
        entry("lamp", quantity="emission", top=1e4, comment="warm"),
        entry("line", UNEVEN, "emission"),
        entry("pearl", np.arange(360.0, 781.0, 1.0), "radiance factor", top=2.3, geometry="45x:0"),
        entry("bright", quantity="radiance factor", top=40.0),
        entry("infrared", np.arange(900.0, 1700.0, 3.0)),
        entry("early", np.arange(300.0, 400.0, 5.0)),
        entry("under F2", stated=(StatedColour("XYZ", np.array([1.0, 2.0, 3.0]), "FL2", "1964_10"),)),
        entry("odd", stated=(StatedColour("XYZ", np.array([1.0, 2.0, 3.0]), "LED-B3", "2015_2"),)),
    ]


def assert_same(found, written):
    assert [one.name for one in found] == [one.name for one in written]
    for one, other in zip(found, written, strict=True):
        assert one.spectrum.quantity in (other.spectrum.quantity, "reflectance"), one.name
        np.testing.assert_array_equal(one.spectrum.wavelengths_nm, other.spectrum.wavelengths_nm, err_msg=one.name)
        np.testing.assert_array_equal(one.spectrum.samples, other.spectrum.samples, err_msg=one.name)
        for back, said in zip(one.stated, other.stated, strict=True):
            assert (back.space, back.illuminant) == (said.space, said.illuminant.replace("FL2", "F2"))
            assert back.observer == said.observer
            np.testing.assert_array_equal(back.values, said.values)


def test_everything_comes_back_bit_for_bit(tmp_path):
    written = [one for one in some() if one.name != "bright"]
    write_cxf(tmp_path / "x.cxf", written, {"creator": "us", "description": "ü", "Lot": "7"})
    file = cxf.read(tmp_path / "x.cxf")
    assert_same(file.entries, written)
    assert file.details["description"] == "ü" and file.details["tag: Lot"] == "7" and file.rejected == ()
    said = file.entries[0].details
    assert (said["geometry"], said["condition"], said["backing"]) == ("45:0 annular", "M1 (M1_Daylight)", "white")
    assert file.entries[1].details["geometry"] == "di:8 (Specular_Included)"
    assert file.entries[1].details["measured"] == "2026-01-02T03:04:05.5+01:00"
    assert file.entries[3].details["comment"] == "warm"


@settings(max_examples=60, deadline=None)
@given(
    values=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=40),
    start=st.floats(200.0, 900.0),
    step=st.floats(0.01, 30.0),
)
def test_any_reflectance_comes_back(tmp_path_factory, values, start, step):
    path = tmp_path_factory.mktemp("cxf") / "x.cxf"
    written = [SpectralEntry("x", Spectrum.sampled(start + step * np.arange(len(values)), values))]
    write_cxf(path, written)
    assert_same(cxf.read(path, ImportOptions(scale="fraction", against="overruled")).entries, written)


def test_an_emission_of_nothing_at_a_wavelength_is_no_list(tmp_path):
    """The schema allows no zero in an EmissiveSpectrum."""
    lamp = SpectralEntry("lamp", Spectrum.sampled([400.0, 410.0, 420.0], [0.0, 1.0, 0.0], "emission"))
    write_cxf(tmp_path / "x.cxf", [lamp])
    assert "<cc:CustomSpectrum" in (tmp_path / "x.cxf").read_text()
    assert_same(cxf.read(tmp_path / "x.cxf").entries, [lamp])


def test_specifications_are_shared_where_everything_is_alike(tmp_path):
    write_cxf(tmp_path / "x.cxf", [entry("a"), entry("bb"), entry("ccc", geometry="45:0 annular")])
    assert (tmp_path / "x.cxf").read_text().count("<cc:ColorSpecification ") == 2


def test_characters_that_xml_cannot_hold(tmp_path):
    write_cxf(tmp_path / "x.cxf", [entry("a\x01b")])
    assert cxf.read(tmp_path / "x.cxf").entries[0].name == "a\ufffdb"


def test_nothing_is_no_file(tmp_path):
    with pytest.raises(InputError, match="nothing to write"):
        write_cxf(tmp_path / "x.cxf", [])
    with pytest.raises(InputError, match="no such folder"):
        write_cxf(tmp_path / "gone" / "x.cxf", [entry()])
    assert list(tmp_path.iterdir()) == []


def test_valid_against_the_schema(tmp_path, shared_data):
    xmlschema = pytest.importorskip("xmlschema", reason="checks against CxF3_Core.xsd need xmlschema")
    schema = shared_data / "spectra" / "cxf" / "CxF3_Core.xsd"
    write_cxf(tmp_path / "x.cxf", some(), {"Lot": "7"}, [{"licence": "CC0"}], datetime(2026, 1, 2, tzinfo=UTC))
    xmlschema.XMLSchema(schema).validate(tmp_path / "x.cxf")


ORDER = {
    "CxF": ("FileInformation", "Resources"),
    "FileInformation": ("Creator", "CreationDate", "Description", "Comment", "Tag"),
    "Resources": ("ObjectCollection", "ColorSpecificationCollection"),
    "Object": ("CreationDate", "Comment", "ColorValues", "TagCollection"),
    "ColorSpecification": ("TristimulusSpec", "MeasurementSpec"),
    "TristimulusSpec": ("Illuminant", "Observer", "Method"),
    "MeasurementSpec": (
        "MeasurementType", "GeometryChoice", "WavelengthRange", "CalibrationStandard", "Aperture", "Backing", "Device",
    ),
    "SingleAngle": ("SingleAngleConfiguration", "IlluminationAngle", "MeasurementAngle"),
    "Device": ("Model", "DeviceIllumination"),
}  # fmt: skip


def test_structure_follows_the_schema_where_no_validator_is_installed(tmp_path):
    from defusedxml.ElementTree import parse

    write_cxf(tmp_path / "x.cxf", some(), {"Lot": "7"}, [{"licence": "CC0"}])
    root = parse(tmp_path / "x.cxf").getroot()
    ids = [element.get("Id") for element in root.iter() if element.get("Id")]
    assert len(set(ids)) == len(ids)
    for element in root.iter():
        uri, _, name = element.tag.rpartition("}")
        assert uri[1:] == cxf.NAMESPACE
        if name in ORDER:
            places = [ORDER[name].index(child.tag.rpartition("}")[2]) for child in element]
            assert places == sorted(places), name
        if (reference := element.get("ColorSpecification")) is not None:
            assert reference in ids
        if name in ("ReflectanceSpectrum", "EmissiveSpectrum", "TransmittanceSpectrum"):
            assert 360 <= int(element.get("StartWL")) <= 400
            low, high = (0, np.inf) if name == "EmissiveSpectrum" else (-0.1, 3)
            assert all(low < float(value) < high for value in element.text.split())
