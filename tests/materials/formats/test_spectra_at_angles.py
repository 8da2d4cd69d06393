"""Readings of one paint at several angles in a file of spectra: one material, and what its record says of itself."""

import re
from itertools import combinations

import numpy as np
import pytest
from metamer.materials.analytic.glossmeter import gloss_of
from metamer.materials.effect_coating.coated_pair import CoatedPair
from metamer.materials.effect_coating.off_specular import light_and_detector
from metamer.materials.effect_coating.stated_error import StatedError
from metamer.materials.fitting.fit import fit
from metamer.materials.intake.sources import read_sources
from metamer.materials.records.description import shown_reconstruction
from metamer.materials.records.material import MaterialRecord
from metamer.materials.records.models import rebuild
from metamer.materials.records.record import read_record, write_record
from metamer.materials.records.source import Rejected
from metamer.spectral.folding import Folding
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.illuminants import illuminant
from metamer.spectral.measurement import geometry_in
from metamer.spectral.observers import observer

NM = np.arange(400, 701, 10)
SIX = tuple(f"45as{away}" for away in (-15, 15, 25, 45, 75, 110))
BLUE = 0.05 + 0.3 * np.exp(-(((NM - 450.0) / 40.0) ** 2))


def paint(notation, base=BLUE, flakes=0.4, width=0.2):
    """Radiance factors of a metallic paint at one angle."""
    pair = CoatedPair.of(*light_and_detector([geometry_in(notation)]))
    leaning = np.exp(-((pair.tilt / width) ** 2)) / (4.0 * width**2 * pair.cosines) * pair.through
    return base + flakes * float(leaning[0]) * (0.4 + 0.6 * base)


def film(notation):
    """Flakes of mica with 120 nm of titania."""
    pair = CoatedPair.of(*light_and_detector([geometry_in(notation)]))
    within = np.sqrt(1.0 - (0.6 * np.sin(pair.incidence[0])) ** 2)
    phase = 4.0 * np.pi * 2.5 * 120.0 * within / NM
    return 0.02 + 2.0 * float(pair.flakes(0.15)[0]) * (0.52 - 0.5 * np.cos(phase))


def written(path, columns):
    """A table of radiance factors, a column a name."""
    lines = ["Radiance factor, fraction", "nm," + ",".join(columns)]
    rows = [f"{nm}," + ",".join(f"{values[at]:.5f}" for values in columns.values()) for at, nm in enumerate(NM)]
    path.write_text("\n".join([*lines, *rows, ""]), encoding="utf-8")
    return path


def table(path, angles=SIX, colours=paint, name="Blue {}"):
    return written(path, {name.format(one): colours(one) for one in angles})


def one(path, answer=None):
    (found,) = read_sources(path, answer=answer or ImportOptions())
    return found


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """The paint of the plain table, read once."""
    return one(table(tmp_path_factory.mktemp("usual") / "columns.csv"))


def cxf(path, angles=SIX, colours=paint, form="names", gloss="", condition="", prefix="c"):
    """The paint in each of the forms that CxF3 allows."""

    def angle(notation):
        geometry = geometry_in(notation)
        return (
            f'<c:BRDFAngle Notation="{notation}"><c:IlluminationAngle>{geometry.first:g}</c:IlluminationAngle>'
            f"<c:Aspecular>{geometry.second:g}</c:Aspecular></c:BRDFAngle>"
        )

    def specification(ident, inside):
        light = f"<c:Device><c:DeviceIllumination>{condition}</c:DeviceIllumination></c:Device>" if condition else ""
        return (
            f'<c:ColorSpecification Id="{ident}"><c:MeasurementSpec><c:MeasurementType>Spectrum_Reflectance'
            f"</c:MeasurementType><c:GeometryChoice><c:MultiAngle>{inside}</c:MultiAngle></c:GeometryChoice>"
            f'<c:WavelengthRange StartWL="400" Increment="10"/>{light}</c:MeasurementSpec></c:ColorSpecification>'
        )

    def spectrum(notation, spec, named):
        label = f' Name="{notation}"' if named else ""
        numbers = " ".join(f"{value:.5f}" for value in colours(notation))
        return f'<c:ReflectanceSpectrum ColorSpecification="{spec}"{label}>{numbers}</c:ReflectanceSpectrum>'

    if form == "names":
        objects = {"Blue": "".join(spectrum(one, "all", True) for one in angles)}
        specifications = specification("all", "".join(map(angle, angles)))
    else:
        each = {one: spectrum(one, f"s{at}", False) for at, one in enumerate(angles)}
        objects = (
            {"Blue": "".join(each.values())} if form == "specifications" else {f"Blue {k}": v for k, v in each.items()}
        )
        specifications = "".join(specification(f"s{at}", angle(one)) for at, one in enumerate(angles))
    physical = f"<c:PhysicalAttributes>{gloss}</c:PhysicalAttributes>" if gloss else ""
    items = "".join(
        f'<c:Object Id="o{at}" Name="{name}" ObjectType="Standard"><c:ColorValues>{read}</c:ColorValues>{physical}'
        "</c:Object>"
        for at, (name, read) in enumerate(objects.items())
    )
    text = (
        f'<c:CxF xmlns:c="http://colorexchangeformat.com/CxF3-core"><c:Resources><c:ObjectCollection>{items}'
        f"</c:ObjectCollection><c:ColorSpecificationCollection>{specifications}</c:ColorSpecificationCollection>"
        "</c:Resources></c:CxF>"
    )
    text = re.sub(r"(?<=[</])c:", f"{prefix}:" if prefix else "", text)
    path.write_text(text.replace("xmlns:c=", f"xmlns:{prefix}=" if prefix else "xmlns="), encoding="utf-8")
    return path


@pytest.mark.parametrize("prefix", ["c", "cc", ""])
@pytest.mark.parametrize("form", ["names", "specifications", "objects"])
def test_one_paint_at_several_angles_is_one_material_in_every_form(tmp_path, form, prefix):
    found = one(cxf(tmp_path / "paint.cxf", form=form, prefix=prefix))
    assert (found.id, found.model) == ("paint/blue", "flake_tilt")
    assert found.provenance.geometry == ", ".join(SIX)
    assert re.fullmatch(r"reconstructed\(6 angles, about ΔE94 \d+\.\d\)", found.provenance.kind)
    assert found.original["aspecular_deg"].tolist() == [-15.0, 15.0, 25.0, 45.0, 75.0, 110.0]
    assert found.original["readings"] == pytest.approx(np.stack([paint(one) for one in SIX]), abs=1e-5)
    assert ("differ by the angle alone" in found.provenance.notes) == (form == "objects")
    again = rebuild(found.model, found.parameters)
    wi, wo = light_and_detector([geometry_in(one) for one in SIX])
    at = np.isin(again.wavelengths_nm, NM)
    assert np.pi * again.eval(wi, wo)[:, at] == pytest.approx(found.original["readings"], rel=0.02, abs=0.002)


def test_columns_of_a_table_are_the_angles_of_one_paint(tmp_path):
    found = one(table(tmp_path / "paint.csv"))
    assert (found.id, found.model) == ("paint/blue", "flake_tilt")
    assert "differ by the angle alone" in found.provenance.notes


def test_every_paint_of_a_file_is_a_material_of_its_own(tmp_path):
    columns = {f"{name} {one}": factor * paint(one) for name, factor in (("Sky", 1.0), ("Sea", 0.5)) for one in SIX}
    columns["Card"] = 0.0 * paint("45as45") + 0.4
    found = read_sources(written(tmp_path / "paints.csv", columns))
    assert sorted((one.id, one.model) for one in found if not isinstance(one, Rejected)) == [
        ("paints/card", "radiance_factor"),
        ("paints/sea", "flake_tilt"),
        ("paints/sky", "flake_tilt"),
    ]


@pytest.mark.parametrize("angles", [SIX[1:3], SIX[1:2], ("45as2", "45as-3", "45as5", "45as15")])
def test_too_few_angles_make_no_material(tmp_path, angles):
    (found,) = read_sources(table(tmp_path / "paint.csv", angles))
    assert isinstance(found, Rejected) and "no matt surface" in str(found.reason)
    assert angles[0] in str(found.reason) and "metamer match" in str(found.reason)


FIVE = ("15", "25", "45", "75", "110")
UNLIT = {
    "as": [f"as{one}" for one in FIVE],
    "AS": [f"AS {one}" for one in FIVE],
    "behind": [f"{one}as" for one in FIVE],
    "a word": [f"Silver as{one}" for one in FIVE],
    "towards the light": ["Silver as-15", "Silver as15", "Silver as45"],
    "in full": [f"aspecular {one}" for one in FIVE],
    "degrees": [f"{one}°" for one in FIVE],
    "degrees of a word": [f"Silver {one} deg" for one in FIVE],
    "degrees before a word": [f"{one}° Silver" for one in FIVE],
    "degrees in brackets before a word": [f"({one} deg) Silver" for one in FIVE],
    "numbers": FIVE,
    "numbers behind a hyphen": [f"Silver-{one}" for one in FIVE],
    "numbers of reflectances": [f"R{one}" for one in FIVE],
    "reflectances at 45 to them": [f"45:{one} R" for one in FIVE],
    "numbers of angles": [f"Angle {one}" for one in FIVE],
    "numbers of a word": [f"Silver {one}" for one in FIVE],
    "three of a word": ["Texas 15", "Texas 25", "Texas 45"],
    "degrees or days": [f"{one}d" for one in FIVE],
    "degrees or days of a word": [f"Silver {one} d" for one in FIVE],
    "degrees or days on both sides": [f"{one}d" for one in (-15, 15, 25, 45, 75, 110)],
    "two": ["as15", "as45"],
    "two apart": ["as 15", "as 45"],
    "two of a word": ["Silver as15", "Silver as110"],
    "two degrees": ["15°", "45°"],
    "two in letters": ["15deg", "25deg"],
    "two in German": ["25 Grad", "45 Grad"],
    "two in brackets": ["Silver (15°)", "Silver (45°)"],
    "two numbers": ["15", "45"],
    "two on both sides": ["-15", "15"],
    "two numbers of a word": ["Silver 15", "Silver 45"],
    "two of reflectances": ["R(15)", "R(45)"],
    "two of several words": [f"{word} {one}" for word in ("Sky", "Rust", "Silver") for one in (15, 45)],
    "as of several words": [f"{word} as{one}" for word in ("Sky", "Rust") for one in (45, 110)],
    "twelve": [f"as{one}" for one in (-45, -30, -15, 15, 20, 25, 38.5, 45, 60, 75, 80, 110)],
    "twelve numbers": [str(one) for one in (-45, -30, -15, 15, 20, 25, 38, 45, 60, 75, 80, 110)],
    "twelve degrees of words": [f"{word}_{one}°" for word in "AB" for one in (15, 25, 45, 60, 75, 110)],
}


def plain(path, names):
    """A table of fractions below these names."""
    rows = [f"{nm}," + ",".join(f"0.{at + 1}{nm % 7}" for at, _ in enumerate(names)) for nm in NM]
    path.write_text("\n".join(["nm," + ",".join(names), *rows, ""]), encoding="utf-8")
    return path


def plain_rows(path, names):
    """The same, a row a name."""
    rows = [f"{name}," + ",".join(f"0.{at + 1}{nm % 7}" for nm in NM) for at, name in enumerate(names)]
    path.write_text("\n".join(["Sample," + ",".join(f"{nm}nm" for nm in NM), *rows, ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("kind", UNLIT)
def test_aspecular_angles_without_that_of_the_light_are_asked_about(tmp_path, kind, rows):
    path = (plain_rows if rows else plain)(tmp_path / "paint.csv", UNLIT[kind])
    (found,) = read_sources(path, answer=ImportOptions("reflectance", "fraction"))
    assert isinstance(found, Rejected)
    few = UNLIT[kind][:5]
    assert all(part in str(found.reason) for part in ("paint.csv", *few, "45as15", "--angles matt"))
    asked = read_sources(path, answer=ImportOptions("reflectance", "fraction", angles="matt"))
    assert [one.model for one in asked] == ["lambert"] * len(UNLIT[kind])
    assert all("as asked" in one.provenance.notes for one in asked)


@pytest.mark.parametrize("label", ["Angle", "angle (deg)", "Aspecular angle", "Messwinkel", "Geometry"])
@pytest.mark.parametrize("unit", ["", "°"])
def test_rows_at_other_angles_are_asked_about(tmp_path, label, unit):
    path = tmp_path / "rows.csv"
    rows = [f"{name},{one}{unit}" + ",0.2" * NM.size for name in ("Silver", "Sky") for one in FIVE]
    path.write_text("\n".join([f"Sample,{label}," + ",".join(f"{nm}nm" for nm in NM), *rows, ""]), encoding="utf-8")
    (found,) = read_sources(path, answer=ImportOptions("reflectance", "fraction"))
    assert isinstance(found, Rejected) and label in str(found.reason) and "--angles matt" in str(found.reason)


@pytest.mark.parametrize(
    "names",
    [
        ("1", "2", "3"),
        ("7d", "14d", "28d", "56d"),
        ("0d", "30d", "60d", "90d"),
        ("15", "16", "17"),
        ("15",),
        ("15", "25", "45", "red"),
        ("AS 1", "AS 5", "AS 10", "AS 15"),
        ("as15", "red"),
        ("Cyan 25", "Cyan 75", "Magenta 25", "Magenta 75"),
        tuple(str(5 * one) for one in range(1, 13)),
        ("lot 45", "lot 46"),
        ("R15", "R16", "R25", "R45"),
        ("60 °C", "75 °C", "80 °C"),
        ("15 °C red", "25 °C red", "45 °C red"),
        ("0° warp", "45° bias", "90° weft"),
        ("Canvas 15", "Canvas 20", "Canvas 25"),
    ],
)
def test_numbered_samples_are_no_angles(tmp_path, names):
    found = read_sources(plain(tmp_path / "chart.csv", names), answer=ImportOptions("reflectance", "fraction"))
    assert [one.model for one in found] == ["lambert"] * len(names)


def test_samples_beside_angles_without_light_are_read(tmp_path):
    found = read_sources(
        plain(tmp_path / "a.csv", [*UNLIT["as"], "Card"]), answer=ImportOptions("reflectance", "fraction")
    )
    assert [one.id for one in found if not isinstance(one, Rejected)] == ["a/card"]
    assert sum(isinstance(one, Rejected) for one in found) == 1


def test_a_detector_below_the_surface_is_refused(tmp_path):
    (found,) = read_sources(cxf(tmp_path / "paint.cxf", (*SIX[1:], "45as-50"), lambda one: 0.0 * NM + 0.3))
    assert isinstance(found, Rejected) and "above the surface" in str(found.reason) and "45as-50" in str(found.reason)


@pytest.mark.parametrize(
    ("asked", "model"), [({"angles": "matt"}, "lambert"), ({"quantity": "radiance-factor"}, "radiance_factor")]
)
def test_readings_stay_apart_where_somebody_asks_for_it(tmp_path, asked, model):
    found = read_sources(
        cxf(tmp_path / "paint.cxf", colours=lambda one: np.minimum(paint(one), 1.0)), answer=ImportOptions(**asked)
    )
    assert [one.model for one in found] == [model] * 6


def test_interference_is_told_or_said_to_be_untold(tmp_path):
    notes = one(table(tmp_path / "six.csv", colours=film)).provenance.notes
    assert re.search(r"flakes change colour .*: q = 0\.\d+", notes)
    assert "cannot be told" in one(table(tmp_path / "five.csv", SIX[1:], film)).provenance.notes
    assert "q = 0" in one(table(tmp_path / "metallic.csv")).provenance.notes


def exchanged(first, second):
    return lambda notation: paint({first: second, second: first}.get(notation, notation))


@pytest.mark.parametrize(
    ("colours", "said"),
    [
        (exchanged("45as-15", "45as15"), "45as-15 and 45as15 exchanged"),
        (lambda notation: paint(SIX[5 - SIX.index(notation)]), "L* rises"),
        *((exchanged(*pair), "L* rises") for pair in combinations(("45as15", "45as25", "45as45", "45as75"), 2)),
        (exchanged("45as110", "45as15"), "L* rises"),
    ],
)
def test_readings_at_wrong_angles_are_noticed(tmp_path, usual, colours, said):
    assert said in one(table(tmp_path / "paint.csv", colours=colours)).provenance.notes
    notes = usual.provenance.notes
    assert "exchanged" not in notes and "L* rises" not in notes and "in reverse" not in notes


def test_repeated_readings_count_by_their_mean_and_their_scatter_is_told(tmp_path):
    random = np.random.default_rng(2)
    columns = {}
    for at in range(3):
        columns |= {f"Blue {one}{' ' * at}": paint(one) * (1.0 + 0.02 * random.standard_normal()) for one in SIX}
    text = cxf(tmp_path / "once.cxf").read_text(encoding="utf-8")
    spectra = re.findall(r"<c:ReflectanceSpectrum.*?</c:ReflectanceSpectrum>", text)
    doubled = text.replace("".join(spectra), "".join(spectra) * 2)
    (tmp_path / "twice.cxf").write_text(doubled, encoding="utf-8")
    found = one(tmp_path / "twice.cxf")
    assert "count by their mean" in found.provenance.notes and "45as15 0.00" in found.provenance.notes
    assert len(found.original["aspecular_deg"]) == 12
    assert found.provenance.kind == one(tmp_path / "once.cxf").provenance.kind


@pytest.mark.parametrize(
    ("gloss", "said"),
    [
        ('<c:Gloss Method="60°">80</c:Gloss>', "that of its gloss, 80 at 60"),
        ("<c:Gloss>80</c:Gloss>", "that of its gloss, 80 at 60"),
        ('<c:Gloss Method="20 degree">80</c:Gloss>', "assumed to be glossy"),
        ('<c:Gloss Method="20°">70</c:Gloss><c:Gloss Method="60°">85</c:Gloss>', "that of its gloss, 85 at 60"),
        ("", "assumed to be glossy"),
    ],
)
def test_the_coat_has_the_gloss_of_the_file_or_an_assumed_one(tmp_path, gloss, said):
    found = one(cxf(tmp_path / "paint.cxf", gloss=gloss))
    assert said in found.provenance.notes
    assert ("was not used" in found.provenance.notes) == ("20 degree" in gloss)


def test_lower_gloss_is_a_wider_coat(tmp_path):
    widths = [
        one(cxf(tmp_path / "paint.cxf", gloss=f"<c:Gloss>{units}</c:Gloss>")).parameters["coat_roughness"]
        for units in (85, 60, 40)
    ]
    assert widths == sorted(widths) and widths[0] < 0.02 < widths[-1]


def test_a_coat_that_the_readings_tell_is_called_by_what_a_glossmeter_reads_of_it(tmp_path):
    """A wide one near the mirror direction, 2 to 5 gloss units, is no semi-gloss."""
    near = dict(zip(("45as15", "45as25", "45as45", "45as75", "45as110"), (2.0, 1.2, 0.7, 0.4, 0.3), strict=True))
    found = one(table(tmp_path / "paint.csv", tuple(near), lambda notation: near[notation] * BLUE))
    told = re.search(
        r"a coat of roughness ([\d.]+), ([\d.]+) gloss units at 60°, as the readings tell", found.provenance.notes
    )
    assert float(told[1]) == pytest.approx(found.parameters["coat_roughness"], abs=0.01)
    units = gloss_of(
        rebuild(found.model, found.parameters), Folding(observer("1931_2"), [illuminant("D65")]), 0.0
    ).units
    assert float(told[2]) == pytest.approx(units, abs=0.05) and units < 10.0


@pytest.mark.parametrize(
    ("condition", "told"), [("M0_Incandescent", True), ("M1_Daylight", True), ("M2_Incandescent", False), ("", False)]
)
def test_ultraviolet_in_the_light_is_told(tmp_path, condition, told):
    found = one(cxf(tmp_path / "paint.cxf", condition=condition))
    assert ("ultraviolet" in found.provenance.notes) == told


def test_readings_within_the_flare_are_kept_and_not_fitted(tmp_path):
    found = one(table(tmp_path / "paint.csv", ("45as3", *SIX)))
    assert "are kept, and not fitted" in found.provenance.notes and len(found.original["aspecular_deg"]) == 7
    assert len(found.parameters["tilts"]) == 6


def test_a_record_says_how_far_off_it_may_be(tmp_path):
    found = one(table(tmp_path / "paint.csv"))
    record = MaterialRecord(
        found.id, found.family, found.model, found.parameters, found.provenance, None, "", found.original
    )
    write_record(record, tmp_path / "paint.h5")
    again = read_record(tmp_path / "paint.h5")
    assert again.provenance.standing == "reconstructed"
    said = shown_reconstruction(again)
    assert "within a factor of 2" in said["In between"] and "D65" in said["In between"]
    assert len(said["At readings"].split(", ")) == 6 and "mirror" in said["Not stated"]
    matt = one(written(tmp_path / "card.csv", {"Card": 0.0 * NM + 0.4}))
    plain = MaterialRecord(matt.id, matt.family, matt.model, matt.parameters, matt.provenance, None, "", matt.original)
    assert shown_reconstruction(plain) == {}


def test_equal_files_give_equal_materials(tmp_path):
    path = table(tmp_path / "paint.csv", colours=film)
    assert one(path).content_hash == one(path).content_hash


@pytest.mark.slow
@pytest.mark.parametrize("colours", [paint, film])
def test_the_fast_form_adds_little_to_what_is_stated(tmp_path, colours):
    found = one(table(tmp_path / "paint.csv", colours=colours))
    error = StatedError.from_stored(found.original)
    drawn = fit(rebuild(found.model, found.parameters), ranks=(6,), pixels=32).error
    by_light = {one.light: one.mean for one in drawn.lights}
    assert all(by_light[light] <= 0.3 * mean for light, mean in zip(error.lights, error.mean, strict=True))


def rows(path, heads, cells, names=("Blue",)):
    """A table of radiance factors, a reading a row: `cells` gives those of each notation below `heads`."""
    lines = ["Radiance factor, fraction", ",".join(["Name", *heads, *(f"{nm} nm" for nm in NM)])]
    for name in names:
        for one in SIX:
            values = (f"{value:.5f}" for value in paint(one))
            lines.append(",".join([name, *cells(geometry_in(one)), *values]))
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "heads",
    [
        ("Light", "Aspecular"),
        ("Illumination angle (°)", "Aspecular angle (°)"),
        ("Einstrahlwinkel", "Differenzwinkel"),
    ],
)
@pytest.mark.parametrize("degrees", ["", "°"])
def test_two_columns_of_angles_are_a_geometry(tmp_path, usual, heads, degrees):
    path = rows(tmp_path / "rows.csv", heads, lambda at: (f"{at.first:g}{degrees}", f"{at.second:g}{degrees}"))
    assert one(path).provenance.geometry == usual.provenance.geometry


@pytest.mark.parametrize("heads", [("Incidence", "Detection"), ("Illumination", "Viewing"), ("Einfall", "Ausfall")])
def test_a_column_of_directions_without_a_sign_convention_is_asked_about(tmp_path, heads):
    path = rows(tmp_path / "rows.csv", heads, lambda at: ("45", f"{45 - at.second:g}"), ("Blue", "Red"))
    (found,) = read_sources(path, answer=ImportOptions("reflectance", "fraction"))
    assert isinstance(found, Rejected) and "no matt surfaces" in str(found.reason)


@pytest.mark.parametrize("heads", [("Light", "Viewing"), ("Illumination", "Detection")])
def test_columns_that_number_readings_are_no_angles(tmp_path, heads):
    number = iter(range(1, 7))
    path = rows(tmp_path / "rows.csv", heads, lambda at: ("D65", f"{next(number)}"))
    found = list(read_sources(path, answer=ImportOptions("reflectance", "fraction")))
    assert not any(isinstance(each, Rejected) for each in found) and len(found) == 6


@pytest.mark.parametrize(
    ("heading", "cell"),
    [
        ("as", "{}"),
        ("Deg", "{}"),
        ("Degrees", "{}"),
        ("(°)", "{}"),
        ("Mode", "as{}"),
        ("Condition", "{}°"),
        ("Channel", "{}°"),
        ("Channel", "{}"),
        ("Position", "{} deg"),
    ],
)
@pytest.mark.parametrize("names", [("Blue",), ("Blue", "Red")])
@pytest.mark.parametrize("named", ["each", "first"])
def test_rows_of_a_paint_at_several_angles_are_no_matt_surfaces(tmp_path, heading, cell, names, named):
    path = rows(tmp_path / "rows.csv", (heading,), lambda at: (cell.format(f"{at.second:g}"),), names)
    if named == "first" and (heading, cell) != ("Channel", "{}"):
        lines = path.read_text().splitlines()
        kept = [line if not at % 6 else line[line.index(",") :] for at, line in enumerate(lines[2:])]
        path.write_text("\n".join([*lines[:2], *kept, ""]))
    (found,) = read_sources(path, answer=ImportOptions("reflectance", "fraction"))
    assert isinstance(found, Rejected) and "no matt surfaces" in str(found.reason)


@pytest.mark.parametrize(
    ("heading", "cells"),
    [
        ("Hue angle", ("15", "45", "110", "200", "250", "300")),
        ("Temperature", ("15°", "25°", "35°", "45°", "55°", "65°")),
        ("Channel", ("1", "2", "3", "4", "5", "6")),
        ("Thickness", ("10", "20", "30", "40", "50", "60")),
    ],
)
def test_rows_that_differ_in_another_number_are_surfaces(tmp_path, heading, cells):
    cells = iter(cells)
    path = rows(tmp_path / "rows.csv", (heading,), lambda _: (next(cells),))
    found = list(read_sources(path, answer=ImportOptions("reflectance", "fraction")))
    assert len(found) == 6 and not any(isinstance(one, Rejected) for one in found)


@pytest.mark.parametrize("name", ["45°/{}°", "Silver {}° L", "Silver ({}°) reflectance", "Blue {}° second coat"])
def test_names_with_degrees_between_words_are_angles(tmp_path, name):
    path = table(tmp_path / "paint.csv", tuple(str(one) for one in (-15, 15, 25, 45, 75, 110)), fixed, name)
    (found,) = read_sources(path, answer=ImportOptions("reflectance", "fraction"))
    assert isinstance(found, Rejected) and "no matt surfaces" in str(found.reason)


def fixed(_):
    return BLUE


@pytest.mark.parametrize("label", ["Angle: {}", "Aspecular = {}°", "Angle (°): {}"])
def test_blocks_of_a_paint_at_several_angles_are_no_matt_surfaces(tmp_path, label):
    values = "\n".join(f"{nm},{value:.5f}" for nm, value in zip(NM, BLUE, strict=True))
    blocks = (f"Blue {label.format(at)}\nnm,reflectance\n{values}\n" for at in (-15, 15, 25, 45, 75, 110))
    (tmp_path / "blocks.csv").write_text("\n".join(blocks), encoding="utf-8")
    found = list(read_sources(tmp_path / "blocks.csv", answer=ImportOptions("reflectance", "fraction")))
    assert len(found) == 1 and isinstance(found[0], Rejected) and "no matt surfaces" in str(found[0].reason)


@pytest.mark.parametrize("name", ["Silver {}°", "Silver_{}", "Silver as{}", "{} deg silver"])
def test_files_of_a_paint_at_one_angle_each_are_no_matt_surfaces(tmp_path, name):
    for at in (15, 45, 110):
        written(tmp_path / f"{name.format(at)}.csv", {"reflectance": BLUE})
    written(tmp_path / "Card.csv", {"reflectance": BLUE})
    answer = ImportOptions("reflectance", "fraction")
    for path in sorted(tmp_path.glob("*.csv")):
        (found,) = read_sources(path, answer=answer)
        if path.stem == "Card":
            assert found.model == "lambert"
        else:
            assert isinstance(found, Rejected) and name.format(110) in str(found.reason)
    (found,) = read_sources(
        tmp_path / f"{name.format(15)}.csv", answer=ImportOptions("reflectance", "fraction", angles="matt")
    )
    assert found.model == "lambert"


def test_numbered_files_are_surfaces(tmp_path):
    for at in range(10, 121, 5):
        written(tmp_path / f"Silver_{at}.csv", {"reflectance": BLUE})
    (found,) = read_sources(tmp_path / "Silver_15.csv", answer=ImportOptions("reflectance", "fraction"))
    assert found.model == "lambert"
