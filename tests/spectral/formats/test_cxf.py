"""CxF3: what is read, what is said of it, and what is refused with which words."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats import cxf
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import format_of, read_spectra

SPEC = """
<cc:ColorSpecification Id="M1">
  <cc:TristimulusSpec><cc:Illuminant>D50</cc:Illuminant><cc:Observer>2_Degree</cc:Observer>
    <cc:Method>E308_Table5</cc:Method></cc:TristimulusSpec>
  <cc:MeasurementSpec>
    <cc:MeasurementType>{kind}</cc:MeasurementType>
    <cc:GeometryChoice>{geometry}</cc:GeometryChoice>
    <cc:WavelengthRange StartWL="380" Increment="10"/>
    <cc:CalibrationStandard>XRGA</cc:CalibrationStandard>
    <cc:Backing>white</cc:Backing>
    <cc:Device><cc:Manufacturer>Acme</cc:Manufacturer><cc:Model>S 1</cc:Model><cc:SerialNumber>42</cc:SerialNumber>
      <cc:DeviceFilter FilterDescription="cut">Filter_UVExcluded</cc:DeviceFilter>
      <cc:DeviceIllumination>M1_Daylight</cc:DeviceIllumination></cc:Device>
  </cc:MeasurementSpec>
</cc:ColorSpecification>
"""
ANGLE = (
    "<cc:SingleAngle><cc:SingleAngleConfiguration>Annular</cc:SingleAngleConfiguration>"
    "<cc:IlluminationAngle>45.0</cc:IlluminationAngle><cc:MeasurementAngle>0.0</cc:MeasurementAngle></cc:SingleAngle>"
)
RED = '<cc:ReflectanceSpectrum ColorSpecification="M1">0.05 0.1 0.4 0.8</cc:ReflectanceSpectrum>'


def item(values, name="red", ident="o1", after=""):
    return (
        f'<cc:Object ObjectType="Standard" Name="{name}" Id="{ident}"><cc:CreationDate>2026-01-02T03:04:05Z'
        f"</cc:CreationDate><cc:Comment>wet</cc:Comment><cc:ColorValues>{values}</cc:ColorValues>{after}</cc:Object>"
    )


def document(objects, specs=None, kind="Spectrum_Reflectance", geometry=ANGLE, before="", after=""):
    specs = SPEC.format(kind=kind, geometry=geometry) if specs is None else specs
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<cc:CxF xmlns:cc="http://colorexchangeformat.com/CxF3-core">{before}<cc:Resources>'
        f"<cc:ObjectCollection>{objects}</cc:ObjectCollection>"
        f"<cc:ColorSpecificationCollection>{specs}</cc:ColorSpecificationCollection></cc:Resources>{after}</cc:CxF>"
    )


@pytest.fixture
def written(written):
    return lambda content, name="made.cxf": written(content, name)


def refusal(path):
    with pytest.raises(InputError) as caught:
        cxf.read(path)
    assert str(path) in str(caught.value)
    return caught.value


def test_a_reflectance_with_all_that_is_said_of_it(written):
    lab = "<cc:ColorCIELab ColorSpecification='M1'><cc:L>50</cc:L><cc:A>40.5</cc:A><cc:B>-3</cc:B></cc:ColorCIELab>"
    tags = '<cc:TagCollection Name="Place"><cc:Tag Name="Row" Value="7"/></cc:TagCollection>'
    about = (
        "<cc:FileInformation><cc:Creator>us</cc:Creator><cc:Description>chart</cc:Description>"
        '<cc:Tag Name="Batch" Value="B7"/></cc:FileInformation>'
    )
    custom = '<cc:CustomResources><x:Ink xmlns:x="urn:x" no="3">cyan<x:Lot>9</x:Lot></x:Ink></cc:CustomResources>'
    file = cxf.read(written(document(item(RED + lab, after=tags), before=about, after=custom)))
    (entry,) = file.entries
    assert (entry.name, entry.spectrum.quantity) == ("red", "reflectance")
    np.testing.assert_array_equal(entry.spectrum.wavelengths_nm, [380, 390, 400, 410])
    np.testing.assert_array_equal(entry.spectrum.samples, [0.05, 0.1, 0.4, 0.8])
    (colour,) = entry.stated
    assert (colour.space, colour.illuminant, colour.observer) == ("Lab", "D50", "1931_2")
    np.testing.assert_array_equal(colour.values, [50, 40.5, -3])
    told = {
        "geometry": "45:0 annular", "condition": "M1 (M1_Daylight)", "instrument": "Acme S 1 42",
        "filter": "FilterDescription=cut Filter_UVExcluded", "calibration": "XRGA", "backing": "white",
        "comment": "wet", "kind": "Standard", "id": "o1", "tag Place: Row": "7", "created": "2026-01-02T03:04:05Z",
    }  # fmt: skip
    assert told.items() <= dict(entry.details).items(), entry.details
    assert dict(file.details) == {
        "creator": "us", "description": "chart", "tag: Batch": "B7", "custom 1: Ink": "no=3 cyan; Lot: 9"
    }  # fmt: skip
    assert file.notes == () and file.rejected == ()


@pytest.mark.parametrize("prefix", ["", "a:", "long-prefix:"])
def test_any_prefix_will_do(written, prefix):
    text = document(item(RED)).replace("xmlns:cc", f"xmlns{':' if prefix else ''}{prefix[:-1]}").replace("cc:", prefix)
    path = written(text)
    assert cxf.recognises(path, path.read_bytes()) and format_of(path) is cxf
    assert len(cxf.read(path).entries) == 1 and cxf.read(path).notes == ()


@pytest.mark.parametrize("uri", ["", "http://example.org/another"])
def test_another_namespace_is_taken_with_a_note(written, uri):
    text = document(item(RED)).replace("xmlns:cc", "xmlns").replace("cc:", "").replace(cxf.NAMESPACE, uri)
    file = cxf.read(written(text))
    assert len(file.entries) == 1
    assert "namespace" in file.notes[0] and cxf.NAMESPACE in file.notes[0]


@pytest.mark.parametrize("encoding", ["utf-16", "iso-8859-1", "utf-8-sig"])
def test_encodings_and_unicode_names(written, encoding):
    label = encoding.removesuffix("-sig")
    text = document(item(RED, "Rosé ½")).replace("UTF-8", label)
    path = written(text.encode(encoding))
    assert format_of(path) is cxf
    assert cxf.read(path).entries[0].name == "Rosé ½"


def test_names_keep_every_character_but_turn_white_space_into_blanks(written):
    name = "漢字 🎨 &lt;b&gt; &amp; Tab&#x9;a&#x200B;b"
    assert cxf.read(written(document(item(RED, name)))).entries[0].name == "漢字 🎨 <b> & Tab a\u200bb"


def test_a_list_may_say_its_own_start(written):
    value = RED.replace('ColorSpecification="M1"', 'ColorSpecification="M1" StartWL="400"')
    file = cxf.read(written(document(item(value))))
    assert file.entries[0].spectrum.wavelengths_nm[0] == 400
    assert "400 nm" in file.notes[0] and "380 nm" in file.notes[0]


def test_emission_and_transmittance(written):
    glass = '<cc:TransmittanceSpectrum ColorSpecification="M1">0.9 0.91</cc:TransmittanceSpectrum>'
    lamp = '<cc:EmissiveSpectrum ColorSpecification="M1">5 120.5</cc:EmissiveSpectrum>'
    file = cxf.read(written(document(item(glass) + item(lamp, "lamp", "o2") + item(RED, "paint", "o3"))))
    glass, lamp, _ = file.entries
    assert glass.spectrum.quantity == "transmittance" and "units" not in glass.details
    assert lamp.spectrum.quantity == "emission" and lamp.details["units"] == "W/(sr m^2 nm)"
    notes = [note for note in file.notes if "its MeasurementType is Spectrum_Reflectance; what counts is its" in note]
    assert len(notes) == 2 and not any("paint" in note for note in notes)


def test_statistics_beside_readings_are_no_samples(written):
    small = RED.replace("0.05 0.1 0.4 0.8", "0.001 0.002 0.01 0.02")
    others = zip(("red mean", "red stdev", "tolerance of red"), (RED, small, small), strict=True)
    objects = [item(RED), *(item(value, name, f"s{at}") for at, (name, value) in enumerate(others))]
    objects.append(item(small, "last", "l1").replace('"Standard"', '"StandardDeviation"'))
    file = cxf.read(written(document("".join(objects))))
    assert [entry.name for entry in file.entries] == ["red", "red mean"] and not file.rejected
    assert any("statistics of others are left out: red stdev, tolerance of red, last" in note for note in file.notes)


@pytest.mark.parametrize(
    "kind, geometry, quantity",
    [
        ("Spectrum_TotalTransmittance", ANGLE, "transmittance"),
        ("Spectrum_Emissive", ANGLE, "emission"),
        ("Spectrum_Custom", ANGLE, "reflectance"),
        ("Spectrum_Custom", "<cc:EmissiveMode>EmissiveMode_Other</cc:EmissiveMode>", "emission"),
    ],
)
def test_a_custom_spectrum_is_what_its_specification_measures(written, kind, geometry, quantity):
    points = "".join(f'<cc:SpectralPoint WL="{w}">{v}</cc:SpectralPoint>' for w, v in ((500.5, 0.3), (400, 0.1)))
    value = f'<cc:CustomSpectrum ColorSpecification="M1">{points}</cc:CustomSpectrum>'
    file = cxf.read(written(document(item(value), kind=kind, geometry=geometry)))
    (entry,) = file.entries
    assert entry.spectrum.quantity == quantity
    np.testing.assert_array_equal(entry.spectrum.wavelengths_nm, [400, 500.5])
    np.testing.assert_array_equal(entry.spectrum.samples, [0.1, 0.3])
    assert any("sorted" in note for note in file.notes)
    assert any("after its geometry" in note for note in file.notes) == (kind == "Spectrum_Custom")


@pytest.mark.parametrize(
    ("quantity", "scale", "first", "said"),
    [
        ("transmittance", None, 0.05, "transmittance, by --as"),
        ("emission", None, 0.05, "emission, by --as"),
        ("transmittance", "fraction", 0.05, "transmittance in fractions, by --as"),
        ("transmittance", "percent", 0.0005, "transmittance in percent, by --as"),
    ],
)
def test_an_answer_about_this_file_alone_counts_for_more_than_its_words(written, quantity, scale, first, said):
    path = written(document(item(RED)))
    (entry,) = read_spectra(path, ImportOptions(quantity, scale, against="overruled")).entries
    assert entry.spectrum.quantity == quantity and entry.spectrum.samples[0] == pytest.approx(first)
    assert entry.taken == f"{said}, against the format (CxF3)"
    (kept,) = read_spectra(path, ImportOptions(quantity, scale, against="kept")).entries
    assert kept.spectrum.quantity == "reflectance" and kept.taken == "reflectance, by the format (CxF3)"
    with pytest.raises(InputError, match="--as another"):
        read_spectra(path, ImportOptions(quantity, scale))


@pytest.mark.parametrize("quantity", [None, "reflectance", "radiance factor", "transmittance"])
@pytest.mark.parametrize("values", ["7.1 10 40 80", "0.4 0.5 1.2 2.5", "7.1 10 40 110"])
def test_percents_are_taken_as_such_where_a_person_says_so_of_this_file_alone(written, quantity, values):
    numbers = np.array([float(value) for value in values.split()])
    if quantity == "transmittance" and numbers.max() > 100.0:
        numbers, values = numbers[:-1], values.rpartition(" ")[0]
    dark = RED.replace("0.05 0.1 0.4 0.8", "2.1 2.2 2.3 2.4")
    lamp = item('<cc:EmissiveSpectrum ColorSpecification="M1">5 120.5</cc:EmissiveSpectrum>', "lamp", "o3")
    path = written(document(item(RED.replace("0.05 0.1 0.4 0.8", values)) + item(dark, "dark", "o2") + lamp))
    file = read_spectra(path, ImportOptions(quantity, "percent", against="overruled"))
    by_name = {entry.name: entry for entry in file.entries}
    np.testing.assert_allclose(by_name["red"].spectrum.samples, numbers / 100.0)
    np.testing.assert_allclose(by_name["dark"].spectrum.samples, [0.021, 0.022, 0.023, 0.024])
    if quantity is None:
        np.testing.assert_array_equal(by_name["lamp"].spectrum.samples, [5, 120.5])
        assert "in percent, by --scale" in by_name["red"].taken
    assert any("the import says percent" in note for note in file.notes)


@pytest.mark.parametrize("against", ["kept", "refused"])
def test_percents_are_refused_where_the_answer_is_for_several_files(written, against):
    path = written(document(item(RED.replace("0.05 0.1 0.4 0.8", "7.1 10 40 80"))))
    with pytest.raises(InputError, match="alone with --scale percent"):
        read_spectra(path, ImportOptions("reflectance", "percent", against=against))


def test_fractions_are_no_percents_whatever_a_person_says(written):
    path = written(document(item(RED.replace("0.05", "0.01"))))
    with pytest.raises(InputError, match="another scale than --scale says"):
        read_spectra(path, ImportOptions("reflectance", "percent", against="overruled"))


def test_an_answer_that_the_numbers_of_a_format_cannot_be_is_refused(written):
    lamp = '<cc:EmissiveSpectrum ColorSpecification="M1">5.1 40 75 80</cc:EmissiveSpectrum>'
    path = written(document(item(lamp), kind="Spectrum_Emissive"))
    with pytest.raises(InputError) as caught:
        read_spectra(path, ImportOptions("reflectance", against="overruled"))
    assert caught.value.field == "red" and caught.value.file == path
    (entry,) = read_spectra(path, ImportOptions("reflectance", "percent", against="overruled")).entries
    np.testing.assert_allclose(entry.spectrum.samples, [0.051, 0.4, 0.75, 0.8])


def test_a_custom_spectrum_under_a_sphere_could_be_two_things(written):
    value = '<cc:CustomSpectrum ColorSpecification="M1"><cc:SpectralPoint WL="500">0.5</cc:SpectralPoint>'
    value += '<cc:SpectralPoint WL="510">0.5</cc:SpectralPoint></cc:CustomSpectrum>'
    sphere = "<cc:SphereGeometry>Diffuse</cc:SphereGeometry>"
    reason = refusal(written(document(item(value), kind="Spectrum_Custom", geometry=sphere)))
    assert "does not say what this spectrum measures" in str(reason) and "Spectrum_Custom" in str(reason)


def test_multi_angle_spectra_get_the_angle_of_their_notation(written):
    angles = "".join(
        f'<cc:BRDFAngle Notation="{name}"><cc:IlluminationAngle>45</cc:IlluminationAngle>'
        f"<cc:Aspecular>{away}</cc:Aspecular></cc:BRDFAngle>"
        for name, away in (("45as15", 15), ("45as110", 110))
    )
    both = RED.replace('"M1">', '"M1" Name="45as15">')
    both += RED.replace('"M1">', '"M1" Name="45as110">')
    file = cxf.read(written(document(item(both), geometry=f"<cc:MultiAngle>{angles}</cc:MultiAngle>")))
    assert [entry.name for entry in file.entries] == ["red, 45as15", "red, 45as110"]
    assert file.entries[1].details["geometry"] == "45as110: light 45, aspecular 110"
    flop = both.replace("0.8<", "4.5<", 1)
    file = cxf.read(written(document(item(flop), geometry=f"<cc:MultiAngle>{angles}</cc:MultiAngle>")))
    assert [entry.spectrum.quantity for entry in file.entries] == ["radiance factor", "reflectance"]


def test_spectra_of_several_conditions_are_told_apart(written):
    m2 = SPEC.replace('Id="M1"', 'Id="second"').replace("M1_Daylight", "M2_UVExcluded")
    specs = (SPEC + m2).format(kind="Spectrum_Reflectance", geometry=ANGLE)
    file = cxf.read(written(document(item(RED + RED.replace('"M1"', '"second"')), specs)))
    assert [entry.name for entry in file.entries] == ["red, M1", "red, M2"]


def test_objects_that_share_a_name_are_told_apart(written):
    file = cxf.read(written(document(item(RED) + item(RED, ident="o2"))))
    assert [entry.name for entry in file.entries] == ["red (o1)", "red (o2)"]
    assert "told apart by Id" in file.notes[0]
    measured = item(RED, ident="o2").replace("Standard", "M0_Measurement")
    measured += item(RED, ident="o3").replace("Standard", "M1_Measurement")
    file = cxf.read(written(document(item("") + measured)))
    assert [entry.name for entry in file.entries] == ["red (M0_Measurement)", "red (M1_Measurement)"]


def test_stated_colours_are_converted_where_no_other_data_are_needed(written):
    values = RED + (
        '<cc:ColorCIELCh ColorSpecification="M1"><cc:L>50</cc:L><cc:C>10</cc:C><cc:H>90</cc:H></cc:ColorCIELCh>'
        '<cc:ColorCIExyY ColorSpecification="M1"><cc:x>0.25</cc:x><cc:y>0.5</cc:y><cc:Y>40</cc:Y></cc:ColorCIExyY>'
        '<cc:ColorCIEXYZ ColorSpecification="M1"><cc:X>1</cc:X><cc:Y>2</cc:Y><cc:Z>3</cc:Z></cc:ColorCIEXYZ>'
        '<cc:ColorCIELuv ColorSpecification="M1"><cc:L>1</cc:L><cc:U>2</cc:U><cc:V>3</cc:V></cc:ColorCIELuv>'
    )
    (entry,) = cxf.read(written(document(item(values)))).entries
    assert [colour.space for colour in entry.stated] == ["Lab", "XYZ", "XYZ"]
    np.testing.assert_allclose(entry.stated[0].values, [50, 0, 10], atol=1e-14)
    np.testing.assert_allclose(entry.stated[1].values, [20, 40, 20])
    assert entry.details["ColorCIELuv"] == "ColorSpecification=M1; L: 1; U: 2; V: 3"


def test_a_colour_that_is_no_colour_is_said_and_left_out(written):
    values = RED + '<cc:ColorCIELab ColorSpecification="M1"><cc:L>fifty</cc:L></cc:ColorCIELab>'
    values += (
        '<cc:ColorCIExyY ColorSpecification="M1"><cc:x>0</cc:x><cc:y>0</cc:y><cc:Y>40</cc:Y></cc:ColorCIExyY>'
        '<cc:ColorCIEXYZ ColorSpecification="gone"><cc:X>1</cc:X><cc:Y>2</cc:Y><cc:Z>3</cc:Z></cc:ColorCIEXYZ>'
    )
    file = cxf.read(written(document(item(values))))
    assert file.entries[0].stated == ()
    assert [note.partition(" ")[0] for note in file.notes] == ["ColorCIELab", "ColorCIExyY", "ColorCIEXYZ"]


LIGHTS = {"m0": "M0_Incandescent", "m1": "M1_Daylight", "lab0": "M0_Incandescent", "lab2": "M2_UVExcluded", "bare": ""}


def measured_twice(*colours):
    """An object with spectra of M0 and M1, and a Lab for each of `colours`: its specification and attributes."""
    specs = SPEC.format(kind="Spectrum_Reflectance", geometry=ANGLE)
    specs = "".join(specs.replace("M1_Daylight", light).replace('"M1"', f'"{name}"') for name, light in LIGHTS.items())
    spectra = RED.replace('"M1"', '"m0"') + RED.replace('"M1"', '"m1" Name="second"')
    labs = (
        f"<cc:ColorCIELab ColorSpecification={name}><cc:L>{50 + at}</cc:L><cc:A>1</cc:A><cc:B>2</cc:B></cc:ColorCIELab>"
        for at, name in enumerate(colours)
    )
    return document(item(spectra + "".join(labs)), specs)


@pytest.mark.parametrize(
    ("colours", "first", "second"),
    [
        (['"m1"'], [], [50]),
        (['"m1"', '"m0"'], [51], [50]),
        (['"lab0"'], [50], []),
        (['"bare"'], [50], [50]),
        (['"bare" Name="second"'], [], [50]),
        (['"lab2"'], [], []),
    ],
)
def test_a_colour_stands_beside_the_spectrum_that_it_is_of(written, colours, first, second):
    file = cxf.read(written(measured_twice(*colours)))
    assert [[colour.values[0] for colour in entry.stated] for entry in file.entries] == [first, second]
    shared, lost = first == second == [50], not first and not second
    assert any("does not say which spectrum" in note for note in file.notes) == shared
    assert any("of another measurement" in note for note in file.notes) == lost
    assert ("L: 50" in file.entries[0].details.get("ColorCIELab", "")) == lost


# Refusals


def test_a_reference_to_nothing_names_the_id(written):
    file = cxf.read(written(document(item(RED) + item(RED.replace("M1", "m1"), "blue", "o2"))))
    ((name, reason),) = file.rejected
    assert name == "blue" and "'m1' is not in the file" in str(reason) and "M1" in str(reason.expected)


def test_two_specifications_of_one_id_are_not_chosen_between(written):
    specs = (SPEC + SPEC).format(kind="Spectrum_Reflectance", geometry=ANGLE)
    assert "share an Id" in str(refusal(written(document(item(RED), specs))))


def test_without_a_reference_the_only_specification_is_taken(written):
    value = RED.replace(' ColorSpecification="M1"', "")
    assert "only one" in cxf.read(written(document(item(value)))).notes[0]
    assert "names no ColorSpecification" in str(refusal(written(document(item(value), specs=""))))


@pytest.mark.parametrize(
    "values, words",
    [
        ("5 10 40 80", "looks like percent"),
        ("0.1 -0.05 0.2", "negative reflectance"),
        ("0.1 INF 0.2", "percent"),
        ("0,1 0,2", "decimal commas"),
        ("0.1 x", "not a number"),
        ("", "not a spectrum"),
        ("0.5", "not a spectrum"),
    ],
)
def test_values_that_are_no_reflectance(written, values, words):
    reason = refusal(written(document(item(RED.replace("0.05 0.1 0.4 0.8", values)))))
    assert words in str(reason) and "red" in str(reason.field)


def test_percent_in_one_spectrum_makes_the_others_doubtful(written):
    dark = item(RED.replace("0.05 0.1 0.4 0.8", "0.5 0.9 1.2 2.5"), "black", "o2")
    lamp = item('<cc:EmissiveSpectrum ColorSpecification="M1">5 120.5</cc:EmissiveSpectrum>', "lamp", "o3")
    bright = item(RED.replace("0.05 0.1 0.4 0.8", "5 10 40 85"))
    file = cxf.read(written(document(dark + bright + lamp)))
    assert [entry.name for entry in file.entries] == ["lamp"]
    assert {name: reason.found for name, reason in file.rejected} == {"red": "85", "black": "85 in red"}


def test_above_one_is_a_radiance_factor(written):
    file = cxf.read(written(document(item(RED.replace("0.8", "1.2")))))
    assert file.entries[0].spectrum.quantity == "radiance factor" and "above 1" in file.notes[0]


@pytest.mark.parametrize("attribute", ['StartWL="380" ', 'Increment="10"'])
def test_wavelengths_that_are_not_said(written, attribute):
    path = written(document(item(RED)).replace(attribute, ""))
    assert f"{attribute.partition('=')[0]} is missing" in str(refusal(path))


@pytest.mark.parametrize("step", ["0", "-10", "NaN", "ten"])
def test_steps_that_are_none(written, step):
    refusal(written(document(item(RED)).replace('Increment="10"', f'Increment="{step}"')))


def test_files_without_spectra_say_what_they_have(written):
    lab = '<cc:ColorCIELab ColorSpecification="M1"><cc:L>1</cc:L><cc:A>1</cc:A><cc:B>1</cc:B></cc:ColorCIELab>'
    reason = refusal(written(document(item(lab) + item("", "none", "o2"))))
    assert "2 objects (1 with ColorCIELab; 1 with no colour values): 'red', 'none'" in str(reason)
    private = '<cc:PrivateSpectrum ColorSpecification="M1" KeyID="k">AAAA</cc:PrivateSpectrum>'
    assert "encrypted" in str(refusal(written(document(item(private)))))
    assert "no objects" in str(refusal(written(document(""))))


def test_older_versions_are_named(written):
    old = '<CXF xmlns="http://www.gretagmacbeth.com/CxF"><SampleSet/></CXF>'
    path = written(old)
    assert format_of(path) is cxf and "versions 1 and 2" in str(refusal(path))


# Real files


@pytest.fixture
def real(shared_data):
    folder = shared_data / "spectra" / "cxf"
    if not folder.is_dir():
        pytest.skip(f"no CxF files in {folder}")
    return folder


def test_the_real_irregular_file(real):
    file = read_spectra(real / "custom_spectrum_irregular.cxf")
    assert file.format == "CxF3"
    assert [entry.name for entry in file.entries] == [
        "Irregular Wavelength Sample", "Out of Order Wavelengths", "High Precision Wavelengths"
    ]  # fmt: skip
    assert file.entries[0].spectrum.wavelengths_nm[1] == 381.7 and file.entries[2].spectrum.samples[0] == 0.45
    ((name, reason),) = file.rejected
    assert name == "Duplicate Wavelengths" and "stands twice" in str(reason) and "500 nm" in str(reason)


@pytest.mark.parametrize(
    "name, words",
    [
        ("minimal_cxf", "no objects"),
        ("empty_sections", "no objects"),
        ("datetime_edge_cases", "no objects"),
        ("custom_resources", "no objects"),
        ("fileinformation_all_optional", "no objects"),
        ("multiple_objects", "10 objects (10 with no colour values): 'Reference Standard'"),
        ("id_reference_validation", "9 objects (9 with ColorCIELab): 'Valid Reference'"),
        ("unicode_special_characters", "12 objects (12 with ColorCIELab): 'Color™ • 漢字 & Ñoño'"),
    ],
)
def test_real_files_without_spectra_say_so(real, name, words):
    path = real / f"{name}.cxf"
    assert format_of(path) is cxf
    assert words in str(refusal(path))
