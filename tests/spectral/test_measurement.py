"""Conditions of measurement of readings, as files say them, and which may be compared."""

from __future__ import annotations

import pytest
from metamer.spectral.formats.registry import details_of_readings, read_spectra
from metamer.spectral.measurement import Geometry, Measurement, Side, crossed, geometry_in, remarks, why_not_comparable


def measured(label="", words="", quantity="reflectance", **more):
    return Measurement.of(quantity, ({label: words} if label else {}) | more)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("45/0", "0:45"),
        ("45:0 annular", "45°a:0°"),
        ("45/0", "45.0:0.3"),
        ("d/8", "d:8°"),
        ("di:8 (Specular_Included)", "D/8 SCI"),
        ("Integrating sphere", "8:d"),
        ("45as-15", "r45as_15"),
        ("45asminus15", "light 45, aspecular -15"),
        ("45as25az90", "45as25.4az90"),
    ],
)
def test_geometries_are_compared_by_their_numbers(one, other):
    assert not measured("geometry", one).differing(measured("MEASUREMENT_GEOMETRY", other))


@pytest.mark.parametrize(
    ("one", "other", "part"),
    [
        (("MEASUREMENT_GEOMETRY", "45/0"), ("Geometry", "d/8"), "geometry"),
        (("MEASUREMENT_GEOMETRY", "0:45"), ("geometry", "sphere, Diffuse"), "geometry"),
        (("geometry", "45as15"), ("geometry", "45as25"), "geometry"),
        (("geometry", "45as45"), ("geometry", "45:0"), "geometry"),
        (("geometry", "45as25"), ("geometry", "45as25az90"), "geometry"),
        (("geometry", "di:8"), ("geometry", "de:8"), "specular component"),
        (("Specular component", "SCI"), ("Specular component", "excluded"), "specular component"),
        (("STD_VIEWING", "SCE"), ("SCI/SCE", "SCI"), "specular component"),
        (("Gloss trap", "open"), ("geometry", "d:8 SPIN"), "specular component"),
        (("FILTER", "M1"), ("MEASUREMENT_SOURCE", "MeasurementCondition=M0 Filter=D50"), "measurement condition"),
        (("condition", "M2 (M2_UVExcluded)"), ("ILLUMINATION_MODE", "M1"), "measurement condition"),
        (("FILTER", "UVcut"), ("MEASUREMENT_SOURCE", "WhiteBase=Abs\tFilter=No"), "filter"),
        (("filter", "Filter_UVExcluded"), ("filter", "Filter_None"), "filter"),
        (("FILTER", "Pol"), ("POLARIZATION", "none"), "polarisation"),
        (("condition", "M3"), ("DevicePolarization", "false"), "polarisation"),
        (("SAMPLE_BACKING", "black"), ("Backing", "White tile"), "backing"),
        (("MEASUREMENT_SOURCE", "WhiteBase=Abs"), ("MEASUREMENT_SOURCE", "WhiteBase=Pap"), "white base"),
        (("MATERIAL", "Polyester film"), ("MATERIAL", "paint"), "film"),
        (("Mode", "SCI"), ("Mode", "SCE"), "specular component"),
        (("Comments", "Geometry: 45/0; read twice"), ("comment", "panel 3, wet. Geometry = d/8"), "geometry"),
        (("Remark", "Backing: white"), ("Bemerkung", "Unterlage: schwarz"), "backing"),
        (("Notes", "Measurement condition: M1"), ("tag Device: MeasurementCondition", "M0"), "measurement condition"),
        (("units", "SCI"), ("units", "SPEX"), "specular component"),
        (("Specular component", "SPINC"), ("Specular component", "SPEXC"), "specular component"),
        (("Gloss", "included"), ("gloss component", "excluded"), "specular component"),
        (("Glanz", "ein"), ("Glanzeinschluss", "ohne"), "specular component"),
        (("Mask/Gloss", "M/I"), ("Mask/Gloss", "S/E"), "specular component"),
        (("Mode", "M1"), ("Modus", "M0"), "measurement condition"),
        (("UV", "100%"), ("UV", "0 %"), "filter"),
        (("UV", "no"), ("UV mode", "included"), "filter"),
        (("UV cut", "yes"), ("UV cut", "no"), "filter"),
        (("UV-Cut Filter", "on"), ("UV", "full"), "filter"),
        (("Polfilter", "ja"), ("Polarizer", "none"), "polarisation"),
        (("Hintergrund", "weiß"), ("Background", "black"), "backing"),
        (("Géométrie", "45:0"), ("Geometría", "d:8"), "geometry"),
        (("Gloss", "SCI"), ("Glanz", "SPEX"), "specular component"),
        (("UV cut", "no"), ("UV cut", "UVcut 400 nm"), "filter"),
        (("UV cut", "off"), ("UV cut", "420 nm"), "filter"),
        (("FILTER", "no"), ("FILTER", "pol"), "polarisation"),
    ],
)
def test_what_was_not_measured_alike_is_refused_until_somebody_asks(one, other, part):
    sides = Side("red", "a.cxf", measured(*one)), Side("red", "b.txt", measured(*other))
    said = why_not_comparable(*sides, ())
    assert all(repr(side.measurement.parts[part].words) in said for side in sides)
    assert part in said and "a.cxf" in said and "b.txt" in said and "--across" in said
    asked = "geometry" if part in ("geometry", "specular component") else "condition"
    assert f"--across {asked}" in said and not why_not_comparable(*sides, (asked,)) and crossed(*sides)
    assert why_not_comparable(*sides, ("condition" if asked == "geometry" else "geometry",))


@pytest.mark.parametrize("quantity", ["reflectance", "radiance factor"])
def test_no_wish_compares_reflectance_with_transmittance(quantity):
    one, other = measured(quantity=quantity), measured(quantity="transmittance")
    said = why_not_comparable(Side("a", "a", one), Side("b", "b", other), ("geometry", "condition"))
    assert "transmittance" in said and quantity in said and "--across" not in said


@pytest.mark.parametrize(
    ("label", "words"),
    [
        ("condition", "as new"),
        ("Measurement mode", "single"),
        ("Geometry", "unknown"),
        ("Specular component", "SCI + SCE"),
        ("FILTER", "-"),
        ("ILLUMINATION_NAME", "D50"),
        ("ORIGINATOR", "45/0 laboratory"),
        ("Gloss", "85.1"),
        ("Gloss", "1"),
        ("units", "1"),
        ("units", "%"),
        ("Mode", "single"),
        ("Mode", "reflectance"),
        ("Options", "SCI + SCE"),
        ("Mode", "M12"),
        ("UV cut", "400"),
    ],
)
def test_words_that_say_nothing_of_the_measurement_are_none_of_it(label, words):
    assert set(measured(label, words).parts) == {"quantity"}


@pytest.mark.parametrize("words", ["looks like SCE under M0", "compare it with the d/8 master", "see note: 45/0", ""])
def test_a_sentence_without_a_label_states_nothing(words):
    assert set(measured("Comments", words).parts) == {"quantity"}


def test_what_one_side_alone_states_is_noted_and_refuses_nothing():
    one, other = Side("red", "a.cxf", measured("geometry", "di:8")), Side("lot", "b.csv", measured())
    (said,) = remarks(one, other)
    assert not why_not_comparable(one, other, ()) and said.startswith("lot of b.csv does not state")
    assert "geometry (di:8)" in said and "specular component (di:8)" in said
    assert remarks(other, other) == ()


def test_a_part_is_named_by_its_field_in_the_file():
    cxf = Measurement.of("reflectance", {"condition": "M0 (M0_Incandescent)", "format": "CxF3"})
    assert cxf.parts["measurement condition"].field == "DeviceIllumination"
    assert measured("FILTER", "M1").parts["measurement condition"].field == "FILTER"


def test_a_name_states_a_specular_component_and_an_angle_but_no_condition():
    assert Measurement.of(None, {}, "red SCE").parts["specular component"].value == "excluded"
    assert Measurement.of(None, {}, "Silver 45as-15").geometry == Geometry("multi-angle", 45.0, -15.0)
    assert Measurement.of(None, {}, "redSCI").parts["specular component"].value == "included"
    assert Measurement.of(None, {}, "red, UV excluded").parts["filter"].value == "uv excluded"
    assert Measurement.of(None, {}, "red over black").parts["backing"].value == "black"
    assert Measurement.of(None, {}, "red_white_backing").parts["backing"].value == "white"
    assert Measurement.of(None, {}, "red 45/0").geometry == Measurement.of(None, {}, "0:45 red").geometry
    sphere = Measurement.of(None, {}, "red di:8")
    assert sphere.geometry == Geometry("sphere", 8.0) and sphere.parts["specular component"].value == "included"
    for name in ("ASCII red", "5R 4/10", "1/45/0", "Blackboard", "black on request", "red 145/0", "UV red", "spine"):
        assert not Measurement.of(None, {}, name).parts, name
    assert not Measurement.of(None, {}, "M1").parts and not Measurement.of(None, {}, "Texas 15").parts


@pytest.mark.parametrize(
    ("words", "part", "value"),
    [
        ("red R% (45°:0°)", "geometry", "directional"),
        ("Reflectance %, D/8", "geometry", "sphere"),
        ("Reflectance (specular excluded)", "specular component", "excluded"),
        ("R [%], gloss included", "specular component", "included"),
        ("R% UVcut 400 nm", "filter", "uv excluded"),
        ("R% (UV included)", "filter", "none"),
        ("R%, black backing", "backing", "black"),
        ("R%, cross-polarised", "polarisation", True),
        ("unpolarized reflectance", "polarisation", False),
    ],
)
@pytest.mark.parametrize("where", ["heading", "line above", "heading across"])
def test_headings_and_lines_about_the_values_state_conditions(tmp_path, words, part, value, where):
    path, nm = tmp_path / "red.csv", range(400, 701, 20)
    head, above = ("red", f"{words}\n") if where == "line above" else (words, "")
    down = f"{above}nm;{head}\n" + "".join(f"{at};{at / 10}\n" for at in nm)
    across = f"{words};" + ";".join(f"{at} nm" for at in nm) + "\nred;" + ";".join(str(at / 10) for at in nm) + "\n"
    path.write_text(across if where == "heading across" else down)
    (entry,) = read_spectra(path).entries
    found = Measurement.of("reflectance", entry.details, entry.name).parts[part].value
    assert (found.kind if isinstance(found, Geometry) else found) == value


@pytest.mark.parametrize("line", ["# {}: {}", "{} = {}", "{}: {}", "{};{}", "# {}\t{}"])
@pytest.mark.parametrize(
    ("label", "words", "part"),
    [
        ("Geometry", "45°:0°", "geometry"),
        ("Filter", "UV cut", "filter"),
        ("Backing", "white", "backing"),
        ("Mode", "SCE", "specular component"),
        ("Measurement condition", "M1", "measurement condition"),
        ("Polarization", "crossed", "polarisation"),
    ],
)
def test_lines_above_a_table_state_conditions_however_they_are_written(tmp_path, line, label, words, part):
    path = tmp_path / "red.csv"
    rows = "".join(f"{at};{at / 10};{at / 20}\n" for at in range(400, 701, 20))
    path.write_text(f"{line.format(label, words)}\nnm;red R%;blue R%\n{rows}")
    file = read_spectra(path)
    for entry in file.entries:
        assert part in Measurement.of("reflectance", details_of_readings(file, path) | dict(entry.details)).parts


@pytest.mark.parametrize(("head", "words"), [("Filter", "none"), ("Polarization", "none"), ("Geometry", "45/0")])
def test_conditions_in_a_column_of_a_table_in_long_form(tmp_path, head, words):
    path = tmp_path / "red.csv"
    rows = "".join(f"{name},{words},{at},{at / 1000}\n" for name in ("red", "blue") for at in range(400, 701, 20))
    path.write_text(f"sample,{head},nm,R\n{rows}")
    for entry in read_spectra(path).entries:
        assert entry.details[head] == words and entry.spectrum.quantity == "reflectance"


def test_several_angles_are_no_geometry():
    assert geometry_in("45as15: light 45, aspecular 15; 45as25: light 45, aspecular 25") is None
