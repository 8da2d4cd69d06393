"""Datacolor QTX: standards and batches, what their fields say, and what makers of other programs write."""

import metamer
import numpy as np
import pytest
from metamer.cli.main import main
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.qtx import read
from metamer.spectral.formats.registry import format_of, read_spectra
from metamer.spectral.measurement import Measurement

NM = np.arange(360, 701, 10)
RED, BLUE = 5.0 + 0.2 * (NM - 360), 60.5 - 0.15 * (NM - 360)


def section(prefix, number, name, values, *lines, end="\r\n", comma=",", low=360, step=10, points=None, text=None):
    """A section as Datacolor's programs write it: each line ends with a comma."""
    kind = {"STD": "STANDARD", "BAT": "BATCH"}[prefix]
    fields = {"NAME": name, "REFLPOINTS": points or len(values), "REFLINTERVAL": step, "REFLLOW": low}
    fields["R"] = ",".join(f"{value:.6f}" for value in values) if text is None else text
    rows = [f"[{kind}_DATA {number}]", *(f"{prefix}_{key}={value}" for key, value in fields.items()), *lines]
    return "".join(row + comma + end for row in rows)


def without(text, start):
    return "".join(line for line in text.splitlines(keepends=True) if not line.startswith(start))


def test_standards_each_with_its_batches(written):
    path = written(
        section("STD", 0, "Rot", RED, "STD_VIEWING=%R USAV SCI UV Inc", "STD_INST_TYPE=SF600", "ILLNAME=D65 10 Deg")
        + section("BAT", 0, "Lot 1", RED * 0.9, "STD_NAME=Rot", "BAT_VIEWING=%R LAV SCE UV 420 nm")
        + section("STD", 1, "Bleu", BLUE)
        + section("BAT", 0, "Lot 1", BLUE * 0.9),
        "of any name",
    )
    assert format_of(path).NAME == "Datacolor QTX"
    file = read_spectra(path)
    assert [entry.name for entry in file.entries] == ["Rot", "Lot 1", "Bleu", "Lot 1"] and not file.rejected
    for entry, percent in zip(file.entries, (RED, RED * 0.9, BLUE, BLUE * 0.9), strict=True):
        assert entry.spectrum.wavelengths_nm == pytest.approx(NM) and entry.spectrum.quantity == "reflectance"
        assert entry.spectrum.samples == pytest.approx(percent / 100.0, abs=1e-8)
        assert entry.taken == "reflectance in percent, by the format (Datacolor QTX)"
    details = [entry.details for entry in file.entries]
    assert [said.get("standard") for said in details] == [None, "Rot", None, "Bleu"]
    assert details[0]["instrument"] == "SF600" and details[0]["illname"] == "D65 10 Deg"
    one, two = (Measurement.of("reflectance", said).words for said in details[:2])
    assert {"specular component", "filter"} <= set(Measurement.of("reflectance", details[0]).differing(
        Measurement.of("reflectance", details[1])))  # fmt: skip
    assert (one["aperture"], two["aperture"]) == ("USAV", "LAV")


@pytest.mark.parametrize(
    ("text", "notes"),
    [
        (";".join(f"{v:.3f}".replace(".", ",") for v in RED), False),
        (" ".join(f"{v:.3f}".replace(".", ",") for v in RED), False),
        (",".join(f"{v:.6f}".replace(".", ",") for v in RED), True),
        (", ".join(f"{v:.3f}" for v in RED), False),
        ("\t".join(f"{v:.3f}" for v in RED), False),
        (",".join(f"{v:.3f}" for v in RED) + ",", False),
    ],
)
@pytest.mark.parametrize(("end", "comma"), [("\n", ""), ("\r\n", ",")])
def test_values_are_parted_as_programs_part_them(written, text, notes, end, comma):
    file = read(written(section("STD", 0, "Rot", RED, text=text, end=end, comma=comma)))
    assert file.entries[0].spectrum.samples == pytest.approx(RED / 100.0, abs=1e-5)
    assert any(note.startswith("commas part the values") for note in file.notes) == notes


def test_decimal_commas_among_commas_are_asked_about(written, refused):
    text = section("STD", 0, "Rot", RED, text=",".join(f"{v:.1f}".replace(".", ",") for v in RED))
    lines = refused(read, text, "rot.qtx")
    assert "decimal commas among commas, or twice the values?" in lines[0] and "STD_R" in lines[0]
    assert "--decimal comma" in lines[-1]
    file = read(written(text), ImportOptions(decimal="comma"))
    assert file.entries[0].spectrum.samples == pytest.approx(np.round(RED, 1) / 100.0)


def test_names_are_latin_1_where_they_are_no_utf_8(written):
    text = section("STD", 0, "Grün mélange", RED)
    for encoding in ("latin-1", "utf-8-sig", "utf-16"):
        assert read(written(text.encode(encoding), "a.qtx")).entries[0].name == "Grün mélange"


def test_a_transmittance_by_the_mode_of_viewing(written):
    file = read(written(section("STD", 0, "Glass", BLUE, "STD_VIEWING=%T LAV SCI")))
    assert file.entries[0].spectrum.quantity == "transmittance"


def test_colours_beside_are_for_the_light_and_observer_that_are_named(written):
    lines = ["ILLNAME=D65 10 Deg", "STD_X=20.1", "STD_Y=21.2", "STD_Z=22.3", "STD_CIEL=1", "STD_CIEa=2"]
    (entry,) = read(written(section("STD", 0, "Rot", RED, *lines))).entries
    (stated,) = entry.stated
    assert (stated.space, stated.illuminant, stated.observer) == ("XYZ", "D65", "1964_10")
    assert stated.values.tolist() == [20.1, 21.2, 22.3]


ONE = section("STD", 0, "Rot", RED)
WRONG = {
    "a point less": (section("STD", 0, "Rot", RED, points=36), "STD_R", "35 values", "36 numbers"),
    "a point more": (section("STD", 0, "Rot", RED, points=34), "STD_R", "35 values", "34 numbers"),
    "a word": (section("STD", 0, "Rot", RED, text=",".join(["5.0"] * 34 + ["broken"])), "STD_R", "broken", "35"),
    "a gap": (section("STD", 0, "Rot", RED, text=",".join(["5.0"] * 33 + ["", "5.0"])), "STD_R", "''", "35"),
    "infinite": (section("STD", 0, "Rot", RED, text=",".join(["5.0"] * 34 + ["inf"])), "STD_R", "inf", "35"),
    "no count": (without(ONE, "STD_REFLPOINTS"), "STD_REFLPOINTS", "", "a whole number"),
    "no first wavelength": (without(ONE, "STD_REFLLOW"), "STD_REFLLOW", "", "nm from 100"),
    "no step": (without(ONE, "STD_REFLINTERVAL"), "STD_REFLINTERVAL", "", "nm"),
    "no values": (without(ONE, "STD_R="), "STD_R", "", "35 values"),
    "a step of nothing": (section("STD", 0, "Rot", RED, step=0), "STD_REFLINTERVAL", "0", "nm"),
    "a step too long": (section("STD", 0, "Rot", RED, step=9000), "STD_REFLINTERVAL", "nm", "20000"),
    "a count without end": (section("STD", 0, "Rot", RED, points=10**12), "STD_REFLPOINTS", "1000000000000", "5000"),
    "two values": (ONE + "STD_REFLLOW=400\r\n", "STD_REFLLOW", "360 and 400", "one"),
    "absorbance": (section("STD", 0, "Rot", RED, "STD_VIEWING=Absorbance"), "STD_VIEWING", "Absorbance", "%R or %T"),
    "two modes": (section("STD", 0, "Rot", RED, "STD_VIEWING=%R %T"), "STD_VIEWING", "%R %T", "%R or %T"),
}


@pytest.mark.parametrize("name", WRONG)
def test_one_that_is_wrong_is_refused_alone(written, refused, name):
    text, field, found, expected = WRONG[name]
    said = "\n".join(refused(read, text, "a.qtx"))
    assert "a.qtx: Rot, line 1" in said and field in said and found in said and expected in said
    file = read(written(section("STD", 1, "Blau", BLUE) + text, "a.qtx"))
    assert [entry.name for entry in file.entries] == ["Blau"] and len(file.rejected) == 1


def test_fractions_are_asked_about(written, refused):
    text = section("STD", 0, "Rot", RED / 100.0)
    lines = refused(read, text, "a.qtx")
    assert "the file states percent, and the numbers say fractions" in lines[0] and "--scale" in lines[-1]
    (entry,) = read(written(text), ImportOptions(scale="fraction")).entries
    assert entry.spectrum.samples == pytest.approx(RED / 100.0, abs=1e-6)


@pytest.mark.parametrize("low", [800, 4000])
def test_percent_is_percent_beyond_the_visible_too(written, low):
    (entry,) = read(written(section("STD", 0, "Rot", RED, low=low))).entries
    assert entry.spectrum.quantity == "reflectance" and entry.spectrum.samples == pytest.approx(RED / 100.0)


def test_a_fluorescent_white_sends_back_more(written):
    (entry,) = read(written(section("STD", 0, "Brightened", RED + 60.0))).entries
    assert entry.spectrum.quantity == "radiance factor" and entry.spectrum.samples.max() == pytest.approx(1.33)


@pytest.mark.parametrize("content", ["[HEADER]\nA=1\n", "A=1\n", "nothing at all"])
def test_no_section_of_a_sample(refused, content):
    lines = refused(read, content, "a.qtx")
    assert "a.qtx: section: no standards and no batches" in lines[0] and "[STANDARD_DATA 0]" in "".join(lines)


def test_other_sections_and_lines_are_said(written):
    file = read(written("[TOLERANCE 0]\nDE=1\n" + ONE + "free words\n"))
    assert any("TOLERANCE" in note for note in file.notes) and any(note.startswith("1 lines") for note in file.notes)


def test_an_answer_against_the_format_is_refused(written):
    with pytest.raises(InputError, match="the file says one thing"):
        read(written(ONE), ImportOptions(quantity="emission"))


def test_commands_and_scripts_take_it(written, tmp_path, capsys):
    path = written(ONE + section("BAT", 0, "Lot", RED * 0.98), "shade.qtx")
    with pytest.warns(UserWarning, match="percent"):
        assert list(metamer.read_spectra(path)) == ["Rot", "Lot"]
    assert main(["catalogue", "import", str(path), "--catalogue", str(tmp_path / "c"), "--dry-run"]) == 0
    assert "2 to import" in capsys.readouterr().out
    code = main(["match", f"{path}#Rot", f"{path}#Lot"])
    assert code in (0, 1) and "Lot" in capsys.readouterr().out
