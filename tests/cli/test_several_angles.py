"""One paint that was read at several angles: one sample, a verdict an angle, and no matt material of its readings."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.catalogue.samples import samples_of
from metamer.spectral.angles import AngleReading, things
from metamer.spectral.measurement import Measurement

NM = np.arange(400, 701, 10)
#: Aspecular angles, and how bright a flake paint is there.
FLOP = {-15: 0.9, 15: 0.8, 25: 0.5, 45: 0.2, 75: 0.1, 110: 0.07}


def values(away, factor=1.0):
    """A paint whose hue wanders with the angle."""
    curve = FLOP[away] * factor * (0.3 + 0.7 / (1.0 + np.exp(-(NM - 520.0 - away) / 25.0)))
    return " ".join(f"{value:.5f}" for value in curve)


def angle(away, notation=None, aspecular=None):
    return (
        f'<c:BRDFAngle Notation="{notation or f"45as{away}"}"><c:IlluminationAngle>45</c:IlluminationAngle>'
        f"<c:Aspecular>{away if aspecular is None else aspecular}</c:Aspecular></c:BRDFAngle>"
    )


def specification(ident, angles):
    return (
        f'<c:ColorSpecification Id="{ident}"><c:MeasurementSpec><c:MeasurementType>Spectrum_Reflectance'
        f"</c:MeasurementType><c:GeometryChoice><c:MultiAngle>{angles}</c:MultiAngle></c:GeometryChoice>"
        f'<c:WavelengthRange StartWL="400" Increment="10"/></c:MeasurementSpec></c:ColorSpecification>'
    )


def spectrum(away, spec, factor, name=""):
    named = f' Name="{name}"' if name else ""
    return f'<c:ReflectanceSpectrum ColorSpecification="{spec}"{named}>{values(away, factor)}</c:ReflectanceSpectrum>'


def cxf(path, form="names", angles=tuple(FLOP), factor=1.0, prefix="c", listed=None, name="Silver"):
    """The same paint in each of the ways in which a file may have it; `listed` : the angles of its specification."""
    listed = listed or "".join(angle(one) for one in angles)
    each = "".join(specification(f"s{one}", angle(one)) for one in angles)
    if form in ("names", "order", "shuffled"):
        order = angles[::-1] if form == "shuffled" else angles
        label = "" if form == "order" else "45as{}"
        objects = {name: "".join(spectrum(one, "all", factor, label.format(one)) for one in order)}
        specs = specification("all", listed)
    elif form == "specifications":
        objects, specs = {name: "".join(spectrum(one, f"s{one}", factor) for one in angles)}, each
    else:
        named = {"objects": "{} 45as{}", "before": "r45as{1}_{0}"}[form]
        objects = {named.format(name, one): spectrum(one, f"s{one}", factor) for one in angles}
        specs = each
    items = "".join(
        f'<c:Object Id="o{place}" Name="{called}" ObjectType="Standard">'
        f"<c:ColorValues>{read}</c:ColorValues></c:Object>"
        for place, (called, read) in enumerate(objects.items())
    )
    text = (
        f'<c:CxF xmlns:c="http://colorexchangeformat.com/CxF3-core"><c:Resources><c:ObjectCollection>{items}'
        f"</c:ObjectCollection><c:ColorSpecificationCollection>{specs}</c:ColorSpecificationCollection>"
        f"</c:Resources></c:CxF>"
    )
    text = re.sub(r"(?<=[</])c:", f"{prefix}:" if prefix else "", text)
    path.write_text(text.replace("xmlns:c=", f"xmlns:{prefix}=" if prefix else "xmlns="), encoding="utf-8")
    return path


def table(path, names, factor=1.0):
    rows = [values(int(re.search(r"as(-?\d+)", name)[1]), factor).split() for name in names]
    lines = ["Reflectance, fraction", "nm," + ",".join(names)]
    lines += [f"{nm}," + ",".join(row[at] for row in rows) for at, nm in enumerate(NM)]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


FORMS = ("names", "order", "shuffled", "specifications", "objects", "before")
ONE_LIGHT = ("--illuminants", "D65", "--formulas", "CIE 2000")


def told(metamer, *words):
    code, out, err = metamer("match", *words, *ONE_LIGHT, "--json", "-")
    assert code in (0, 2), err
    return json.loads(out)


@pytest.mark.parametrize("form", FORMS)
def test_a_file_of_several_angles_is_one_sample_in_every_form(metamer, tmp_path, form):
    master = cxf(tmp_path / "master.cxf")
    said = told(metamer, master, cxf(tmp_path / "lot.cxf", form, factor=1.03))
    (lot,) = said["samples"]
    assert said["standard"]["name"] == "Silver" and lot["readings"] == 6
    assert sorted(one["geometry"] for one in lot["differences"]) == sorted(f"45as{one}" for one in FLOP)
    by_form = told(metamer, cxf(tmp_path / "again.cxf", form), cxf(tmp_path / "other.cxf", factor=1.03))
    again = {one["geometry"]: one["delta_e"] for one in by_form["samples"][0]["differences"]}
    assert again == {one["geometry"]: one["delta_e"] for one in lot["differences"]}


def test_a_table_names_its_angles_in_its_headings(metamer, tmp_path):
    names = [f"Silver 45as{one}" for one in FLOP]
    said = told(metamer, table(tmp_path / "a.csv", names), table(tmp_path / "b.csv", names[::-1], 1.05))
    assert len(said["samples"]) == 1 and len(said["samples"][0]["differences"]) == 6
    assert any("differ by their angle alone" in note for note in said["notes"])


def test_angles_that_are_paired_are_not_said_to_be_judged_apart(metamer, tmp_path):
    names = [f"45as{one} R" for one in FLOP]
    said = told(metamer, table(tmp_path / "silver.csv", names), table(tmp_path / "b.csv", names, 1.05))
    assert len(said["samples"]) == 1 and len(said["samples"][0]["differences"]) == 6
    assert not any("judged each by itself" in note for note in said["notes"])
    assert any("one thing, silver, for their names" in note for note in said["notes"])


@pytest.mark.parametrize("prefix", ["c", "cc", ""])
def test_the_prefix_of_the_namespace_does_not_matter(metamer, tmp_path, prefix):
    lot = cxf(tmp_path / "lot.cxf", factor=1.03, prefix=prefix)
    assert len(told(metamer, cxf(tmp_path / "m.cxf"), lot)["samples"][0]["differences"]) == 6


def test_figures_over_the_angles_are_those_of_a_spreadsheet(metamer, tmp_path):
    said = told(metamer, cxf(tmp_path / "m.cxf"), cxf(tmp_path / "lot.cxf", factor=1.1))
    (lot,) = said["samples"]
    by_angle = {one["geometry"]: one for one in lot["differences"]}
    delta_e = {name: one["delta_e"]["CIE 2000"] for name, one in by_angle.items()}
    over = lot["angles"]
    assert over["worst"] == max(delta_e, key=delta_e.get) and over["largest"] == max(delta_e.values())
    assert over["mean"] == pytest.approx(np.mean(list(delta_e.values())))
    for side in ("standard", "sample"):
        near, face, far = (by_angle[f"45as{one}"][f"{side}_lab"][0] for one in (15, 45, 110))
        assert over[f"{side}_flop"] == pytest.approx(2.69 * (near - far) ** 1.11 / face**0.86)
    assert over["flop_difference"] == pytest.approx(over["sample_flop"] - over["standard_flop"])


def test_every_angle_has_to_pass(metamer, tmp_path):
    master, lot = cxf(tmp_path / "m.cxf"), cxf(tmp_path / "lot.cxf", factor=1.1)
    over = told(metamer, master, lot)["samples"][0]["angles"]
    limit = 0.5 * (over["mean"] + over["largest"])
    code, out, _ = metamer("match", master, lot, *ONE_LIGHT, "--tolerance", f"CIE 2000 {limit:.4f}")
    assert code == 2 and "Worst angle" not in out and over["worst"] in out and "pass" in out


def test_an_angle_that_one_side_lacks_is_named_and_not_judged(metamer, tmp_path):
    lot = cxf(tmp_path / "lot.cxf", angles=tuple(FLOP)[1:], factor=1.03)
    said = told(metamer, cxf(tmp_path / "m.cxf"), lot)
    assert [one["geometry"] for one in said["samples"][0]["differences"]] == [f"45as{one}" for one in tuple(FLOP)[1:]]
    assert any("Not judged: 45as-15" in note for note in said["notes"])


def test_an_angle_that_one_of_several_samples_lacks_spares_no_other(metamer, tmp_path):
    """The lot that is off at that angle alone would pass beside one that was not read there."""
    master, lot = cxf(tmp_path / "m.cxf"), cxf(tmp_path / "lot.cxf", factor=1.03)
    five = cxf(tmp_path / "five.cxf", angles=tuple(FLOP)[1:], factor=1.02)
    for samples in ((lot, five), (five, lot)):
        code, _, err = metamer("match", master, *samples)
        assert code == 3 and "lacks 45as-15" in err and "five.cxf" in err and "lot.cxf" in err and "--angles" in err
    assert metamer("match", master, five, five, *ONE_LIGHT)[0] == 0
    said = told(metamer, master, lot, five, "--angles", "15,45,110")
    assert [len(one["differences"]) for one in said["samples"]] == [3, 3]


def test_angles_may_begin_with_a_negative_one(metamer, tmp_path):
    lot = cxf(tmp_path / "lot.cxf", factor=1.03)
    said = told(metamer, cxf(tmp_path / "m.cxf"), lot, "--angles", "-15,15,45")
    assert [one["geometry"] for one in said["samples"][0]["differences"]] == ["45as-15", "45as15", "45as45"]


def test_samples_of_one_name_are_told_apart_by_their_files(metamer, tmp_path):
    lots = [cxf(tmp_path / f"lot{one}.cxf", factor=1.0 + 0.1 * one) for one in (1, 2)]
    said = told(metamer, cxf(tmp_path / "m.cxf"), *lots)
    names = [one["name"] for one in said["samples"]]
    assert len(set(names)) == 2 and all(f"lot{one}.cxf" in name for one, name in zip((1, 2), names, strict=True))


def test_effect_coatings_have_no_metamerism_index(metamer, tmp_path):
    master, lot = cxf(tmp_path / "m.cxf"), cxf(tmp_path / "lot.cxf", factor=1.03)
    assert "etamerism" not in metamer("match", master, lot)[1]


def test_unlike_readings_of_one_angle_are_noted(metamer, tmp_path):
    master, lot = cxf(tmp_path / "m.cxf"), cxf(tmp_path / "lot.cxf", factor=1.03)
    same = spectrum(15, "all", 1.03, "45as15")
    for other, noted in ((spectrum(15, "all", 1.031, "45as15"), False), (spectrum(25, "all", 1.03, "45as15"), True)):
        twice = tmp_path / "twice.cxf"
        twice.write_text(lot.read_text("utf-8").replace(same, same + other), encoding="utf-8")
        assert twice.read_text("utf-8") != lot.read_text("utf-8")
        notes = told(metamer, master, twice)["notes"]
        assert any("2 times at 45as15" in note for note in notes) == noted


def test_angles_are_paired_by_their_numbers(metamer, tmp_path):
    listed = "".join(angle(one, notation=f"r45as{one}".replace("-", "_"), aspecular=one + 0.3) for one in FLOP)
    lot = cxf(tmp_path / "lot.cxf", "order", factor=1.03, listed=listed)
    assert len(told(metamer, cxf(tmp_path / "m.cxf"), lot)["samples"][0]["differences"]) == 6
    said = told(metamer, cxf(tmp_path / "m.cxf"), lot, "--angles", "110,15")
    assert [one["geometry"] for one in said["samples"][0]["differences"]] == ["45as110", "45as15"]


@pytest.mark.parametrize(
    ("one", "other", "said"),
    [
        ("#Silver, 45as15", "#Silver, 45as25", "45as15 alone"),
        ("", "#Silver, 45as45", "45as45 alone"),
        ("#Silver, 45as45", "", "45as45 alone"),
    ],
)
def test_one_angle_is_judged_against_nothing(metamer, tmp_path, one, other, said):
    master, lot = cxf(tmp_path / "m.cxf"), cxf(tmp_path / "lot.cxf", factor=1.03)
    code, _, err = metamer("match", f"{master}{one}", f"{lot}{other}")
    assert code == 3 and said in err


def test_too_few_shared_angles_are_refused(metamer, tmp_path):
    master, lot = cxf(tmp_path / "m.cxf", angles=(-15, 15, 25)), cxf(tmp_path / "lot.cxf", angles=(25, 45, 110))
    code, _, err = metamer("match", master, lot)
    assert code == 3 and "1 angles are shared" in err and "45as110" in err and "45as-15" in err
    assert metamer("match", master, lot, "--angles", "45")[0] == 3


@pytest.mark.parametrize(
    ("listed", "form", "said"),
    [
        ([angle(15), angle(15), *map(angle, (25, 45, 75, 110))], "names", "stands twice"),
        ([angle(-15, aspecular="x"), *map(angle, (15, 25, 45, 75, 110))], "names", "not"),
        ([*map(angle, (-15, 15, 25, 45, 75))], "order", "at which angle"),
        ([angle(-15, aspecular=20), *map(angle, (15, 25, 45, 75, 110))], "names", "are not the same"),
        ([re.sub("<c:Aspecular>.*?</c:Aspecular>", "", angle(-15)), *map(angle, (15, 25, 45))], "names", "missing"),
    ],
)
def test_a_file_that_does_not_tell_its_angles_is_refused(metamer, tmp_path, listed, form, said):
    path = cxf(tmp_path / "lot.cxf", form, listed="".join(listed))
    code, _, err = metamer("match", cxf(tmp_path / "m.cxf"), path)
    assert code == 4 and said in err


@pytest.mark.slow_cases("names", "specifications")
@pytest.mark.parametrize("form", ["names", "specifications", "objects"])
def test_no_reading_at_an_angle_becomes_a_matt_material_unless_somebody_says_so(metamer, tmp_path, form):
    path = cxf(tmp_path / "silver.cxf", form, angles=(15, 110))
    code, out, _ = metamer("catalogue", "import", path, "--into", tmp_path / "none", "--jobs", 1)
    assert code == 4 and "is no matt surface" in out and "45as110" in out and "1 failed" in out
    matt = tmp_path / "matt"
    assert metamer("catalogue", "import", path, "--into", matt, "--jobs", 1, "--angles", "matt")[0] == 0
    _, out, _ = metamer("catalogue", "show", "silver/silver-45as15", matt)
    assert "taken for a matt surface, as asked" in " ".join(out.split())
    kept = tmp_path / "kept"
    assert metamer("catalogue", "import", path, "--into", kept, "--jobs", 1, "--as", "radiance-factor")[0] == 0
    _, out, _ = metamer("catalogue", "list", kept)
    assert "lambert" not in out and out.count("silver/silver-45as") == 2


def test_a_surface_of_the_catalogue_is_read_at_the_angles_of_the_file(metamer, tmp_path, tiny_catalogue):
    """At 45 degrees from the mirror the detector looks along the normal; glosses shine near the mirror."""
    lot = cxf(tmp_path / "lot.cxf")
    code, out, err = metamer("match", "tiny/satin-green", lot, "--catalogue", tiny_catalogue, *ONE_LIGHT, "--json", "-")
    assert code == 0, err
    seen = {one["geometry"]: one["standard_lab"][0] for one in json.loads(out)["samples"][0]["differences"]}
    assert len(seen) == 6 and seen["45as15"] > seen["45as25"] > seen["45as45"]
    face = cxf(tmp_path / "one.cxf", angles=(45,))
    assert metamer("match", "tiny/matt-red", face, "--catalogue", tiny_catalogue)[0] == 3


def test_din_6175_2_stands_beside_the_others_at_angles_alone(metamer, tmp_path):
    master, lot = cxf(tmp_path / "m.cxf"), cxf(tmp_path / "lot.cxf", factor=1.05)
    code, out, _ = metamer("match", master, lot, "--json", "-", "--illuminants", "D65")
    said = json.loads(out)
    (name,) = [one for one in said["formulas"] if "DIN 6175-2" in one]
    assert "as published in software" in name
    by_angle = [one["delta_e"][name] for one in said["samples"][0]["differences"]]
    over = said["samples"][0]["angles"]["by_formula"][name]
    assert over["mean"] == pytest.approx(np.mean(by_angle)) and over["largest"] == max(by_angle)
    html = tmp_path / "page.html"
    code, out, _ = metamer("match", master, lot, "--tolerance", f"DIN 6175-2 {max(by_angle) + 0.1:.3f}", "--html", html)
    assert code == 0 and "DIN 6175-2" in out and "DIN 6175-2" in html.read_text(encoding="utf-8")
    code, _, err = metamer("match", "lab:50,0,0@D65/1964_10", "lab:51,0,0@D65/1964_10", "--formulas", "DIN 6175-2")
    assert code == 3 and "several angles" in err
    code, out, _ = metamer("match", "lab:50,0,0@D65/1964_10", "lab:51,0,0@D65/1964_10")
    assert code == 0 and "DIN" not in out


def rearranged(path, order):
    """A file whose readings stand at other angles than they were read at."""
    text = path.read_text(encoding="utf-8")
    numbers = re.findall(r"(?<=>)[\d. ]+(?=</c:ReflectanceSpectrum>)", text)
    for at, one in enumerate(numbers):
        text = text.replace(f">{one}</c:Ref", f">@{at}@</c:Ref", 1)
    for at, other in enumerate(order):
        text = text.replace(f"@{at}@", numbers[other])
    path.write_text(text, encoding="utf-8")
    return path


def test_readings_that_stand_at_wrong_angles_are_noted(metamer, tmp_path):
    master, lot = cxf(tmp_path / "m.cxf"), cxf(tmp_path / "lot.cxf", factor=1.03)
    assert not any("away from the mirror" in note for note in told(metamer, master, lot)["notes"])
    turned = told(metamer, master, rearranged(lot, (5, 4, 3, 2, 1, 0)))["notes"]
    assert any("L* rises from" in note and "lot.cxf" in note for note in turned)


@pytest.mark.parametrize(
    ("first", "second", "noted"),
    [
        ("2024-03-01T10:00:00Z", "2024-02-01T10:00:00Z", True),
        ("2024-03-01T10:00:00+01:00", "2024-03-01T11:00:00", False),
        ("2024-02-01T10:00:00", "2024-03-01T10:00:00Z", False),
        ("in March", "2024-02-01T10:00:00Z", False),
        ("", "2024-02-01T10:00:00Z", False),
    ],
)
def test_a_sample_that_is_older_than_its_standard_is_noted(metamer, tmp_path, first, second, noted):
    sides = []
    for name, date, factor in (("m", first, 1.0), ("lot", second, 1.03)):
        path = cxf(tmp_path / f"{name}.cxf", factor=factor)
        dated = path.read_text(encoding="utf-8").replace(
            "<c:ReflectanceSpectrum ",
            f'<c:ReflectanceSpectrum MeasureDate="{date}" ' if date else "<c:ReflectanceSpectrum ",
        )
        path.write_text(dated, encoding="utf-8")
        sides.append(path)
    assert any("measured before its standard" in note for note in told(metamer, *sides)["notes"]) == noted


def with_mode(path, mode):
    """A file whose readings are of one data mode."""
    tag = f'<c:TagCollection Name="X-Rite"><c:Tag Name="DataMode" Value="{mode}"/></c:TagCollection>'
    path.write_text(path.read_text(encoding="utf-8").replace("</c:Object>", f"{tag}</c:Object>"), encoding="utf-8")
    return path


def test_another_data_mode_is_another_measurement_and_is_noted(metamer, tmp_path):
    master, lot = with_mode(cxf(tmp_path / "m.cxf"), "mat"), with_mode(cxf(tmp_path / "lot.cxf", factor=1.03), "byk")
    notes = told(metamer, master, lot)["notes"]
    assert any("data mode" in note and "'mat'" in note and "'byk'" in note for note in notes)
    readings = [
        AngleReading(one, f"Silver {one}", "", Measurement.of("reflectance", {"geometry": one, "data mode": mode}))
        for mode in ("mat", "byk")
        for one in ("45as15", "45as45", "45as110")
    ]
    assert [(one.name, len(one.readings)) for one in things(readings)] == [("Silver, mat", 3), ("Silver, byk", 3)]


@pytest.mark.parametrize("form", ["as{}", "Silver as{}", "aspecular {}", "{} as"])
def test_angles_without_that_of_the_light_are_paired_by_their_numbers(metamer, tmp_path, form):
    """One sample, and one angle alone is judged against nothing; bare numbers may be those of samples."""
    away = (15, 45, 110)
    sides = []
    for name, factor in (("m", 1.0), ("lot", 1.1)):
        path = table(tmp_path / f"{name}.csv", [f"as{one}" for one in away], factor)
        text = path.read_text("utf-8")
        sides.append(path)
        path.write_text(text.replace(",".join(f"as{one}" for one in away), ",".join(map(form.format, away))), "utf-8")
    said = told(metamer, *sides)
    assert [one["geometry"] for one in said["samples"][0]["differences"]] == ["as15", "as45", "as110"]
    assert any("does not state the angle of its light" in note for note in said["notes"])
    code, _, err = metamer("match", f"{sides[0]}#{form.format(15)}", f"{sides[1]}#{form.format(45)}")
    assert code == 3 and "as15 alone" in err
    for path in sides:
        path.write_text(path.read_text("utf-8").replace(form.format(15), "15").replace(form.format(45), "45"), "utf-8")
    assert metamer("match", f"{sides[0]}#15", f"{sides[1]}#15", *ONE_LIGHT)[0] == 0


@pytest.mark.parametrize("form", ["rows", "long"])
@pytest.mark.parametrize(
    ("heading", "notation"),
    [
        ("Angle", "{}"),
        ("Winkel", "{}°"),
        ("Measurement geometry", "{}"),
        ("Aspecular angle", "{}"),
        ("Angle", "45as{}"),
        ("Condition", "r45as{}"),
    ],
)
def test_rows_of_one_name_at_several_angles_are_not_averaged(tmp_path, form, heading, notation):
    path, at = tmp_path / "lot.csv", {away: notation.format(away) for away in FLOP}
    read = {away: [float(one) for one in values(away).split()] for away in FLOP}
    if form == "long":
        rows = [f"Silver;{at[away]};{nm};{one}" for away in FLOP for nm, one in zip(NM, read[away], strict=True)]
        path.write_text("\n".join([f"sample;{heading};nm;Reflectance", *rows]))
    else:
        rows = [";".join(["Silver", at[away], *map(str, read[away])]) for away in FLOP]
        path.write_text("\n".join([";".join(["Reflectance of", heading, *(f"{nm} nm" for nm in NM)]), *rows]))
    (one,) = samples_of(str(path), Catalogue.open)
    assert one.name == "Silver" and [angle.second for angle in one.geometries] == list(FLOP)
    for away, part in zip(FLOP, one.angles, strict=True):
        np.testing.assert_allclose(part.readings[0].samples, read[away])


@pytest.mark.parametrize("names", ["{}°", "Silver {}°", "Angle {}", "Silver {}° aspec"])
def test_names_with_degrees_are_angles_of_one_sample(tmp_path, names):
    path = tmp_path / "lot.csv"
    rows = [f"{nm};" + ";".join(values(away).split()[place] for away in FLOP) for place, nm in enumerate(NM)]
    path.write_text("\n".join(["Reflectance", ";".join(["nm", *map(names.format, FLOP)]), *rows]))
    (one,) = samples_of(str(path), Catalogue.open)
    assert one.name == ("Silver" if "Silver" in names else "lot")
    assert [angle.second for angle in one.geometries] == list(FLOP)


def test_rows_of_one_name_under_two_conditions_of_the_sample_are_two_samples(tmp_path):
    path = tmp_path / "lot.csv"
    rows = ["red;dry;" + values(15).replace(" ", ";"), "red;wet;" + values(25).replace(" ", ";")]
    path.write_text("\n".join([";".join(["Reflectance of", "Condition", *(f"{nm} nm" for nm in NM)]), *rows]))
    assert [one.name for one in samples_of(str(path), Catalogue.open)] == ["red, dry", "red, wet"]


def test_numbers_that_may_be_angles_are_noted(tmp_path):
    path = tmp_path / "lot.csv"
    path.write_text(table(path, [f"Silver as{away}" for away in FLOP]).read_text().replace(" as", " "))
    found = samples_of(str(path), Catalogue.open)
    assert len(found) == len(FLOP) and all("may be readings of one thing" in one.notes[-1] for one in found)


LIGHTNESS = {-15: 120.0, 15: 110.0, 25: 80.0, 45: 45.0, 75: 30.0, 110: 25.0}


def colours_at_angles(path, form, name="Silver", off=0.0):
    """CIELAB of one paint at six angles, in the ways in which instruments write it."""
    rows = {away: (light + off, 1.0 + away / 50.0, -3.0) for away, light in LIGHTNESS.items()}
    cells = {away: ",".join(f"{value:.2f}" for value in row) for away, row in rows.items()}
    above = "Illuminant: D65, Observer: 10\n"
    if form in ("45as{}", "as{}", "{}°"):
        heads = ",".join(f"{axis}*({form.format(away)})" for away in rows for axis in "Lab")
        text = f"{above}Name,{heads}\n{name},{','.join(cells.values())}\n"
    elif form == "CGATS":
        head = "SAMPLE_NAME MEASUREMENT_GEOMETRY LAB_L LAB_A LAB_B"
        data = "".join(f'"{name}" "45as{away}" {row.replace(",", " ")}\n' for away, row in cells.items())
        text = (
            f'CGATS.17\nILLUMINATION_NAME "D65"\nOBSERVER_ANGLE "10"\nNUMBER_OF_FIELDS 5\nBEGIN_DATA_FORMAT\n{head}\n'
        )
        text += f"END_DATA_FORMAT\nNUMBER_OF_SETS 6\nBEGIN_DATA\n{data}END_DATA\n"
    else:
        heading, below = form.removesuffix(" below"), form.endswith(" below")
        text = f"{above}Name,{heading},L*,a*,b*\n"
        shown = {"Geometry": "45as{}", "Channel": "{}°"}.get(heading, "{}")
        named = [name, *["" if below else name] * (len(cells) - 1)]
        for word, (away, row) in zip(named, cells.items(), strict=True):
            text += f"{word},{shown.format(away)},{row}\n"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "form", ["Angle", "Geometry", "Angle below", "Geometry below", "Channel below", "CGATS", "45as{}", "as{}", "{}°"]
)
def test_colours_without_spectra_at_several_angles_are_one_sample(metamer, tmp_path, form):
    """Before, the first angle alone was judged, without a word."""
    suffix = "txt" if form == "CGATS" else "csv"
    one = colours_at_angles(tmp_path / f"one.{suffix}", form)
    two = colours_at_angles(tmp_path / f"two.{suffix}", form, "Lot", 0.5)
    code, _, err = metamer("match", one, two, "--tolerance", "CIE 1976 1.0", "--json", tmp_path / "m.json")
    assert code == 0, err
    (sample,) = json.loads((tmp_path / "m.json").read_text())["samples"]
    assert len(sample["differences"]) == 6
    assert {round(each["difference"]["lightness"], 6) for each in sample["differences"]} == {0.5}
    flop = 2.69 * (110.0 - 25.0) ** 1.11 / 45.0**0.86
    assert sample["angles"]["standard_flop"] == pytest.approx(flop)


def test_repeated_colours_of_one_name_count_by_their_mean(tmp_path):
    path = tmp_path / "red.csv"
    path.write_text("Illuminant: D65/10\nName,SCI/SCE,L*,a*,b*\nred,SCI,50,40,30\nred,SCI,52,42,31\nred,SCE,40,41,32\n")
    one, two = samples_of(str(path), Catalogue)
    assert (one.name, two.name) == ("red, SCI", "red, SCE")
    np.testing.assert_allclose(one.lab("D65", "1964_10"), [51, 41, 30.5])
    np.testing.assert_allclose(two.lab("D65", "1964_10"), [40, 41, 32])
