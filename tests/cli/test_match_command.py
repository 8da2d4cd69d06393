"""`metamer match`, its exit codes, and what it writes."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from metamer import Catalogue, match
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import ImportOptions

NM = np.arange(380, 731, 10)
BASE = 0.15 + 0.5 / (1.0 + np.exp(-(NM - 560.0) / 20.0))


def readings(path, rows, last=730):
    """A CGATS file of named readings."""
    nm = NM[last >= NM]
    fields = " ".join(["SAMPLE_NAME", *(f"SPECTRAL_NM{one}" for one in nm)])
    lines = ["CGATS.17", 'INSTRUMENTATION "Spectro 9"', 'KEYWORD "SPECTRAL_NORM"', "SPECTRAL_NORM 1.0"]
    lines += [f"NUMBER_OF_FIELDS {nm.size + 1}", "BEGIN_DATA_FORMAT", fields, "END_DATA_FORMAT"]
    lines += [f"NUMBER_OF_SETS {len(rows)}", "BEGIN_DATA"]
    lines += [" ".join([f'"{name}"', *(f"{value:.6f}" for value in row[: nm.size])]) for name, row in rows]
    path.write_text("\n".join([*lines, "END_DATA", ""]), encoding="utf-8")
    return path


@pytest.fixture
def master(tmp_path):
    return readings(tmp_path / "master.txt", [("Master", BASE)])


@pytest.fixture
def lots(tmp_path):
    return readings(tmp_path / "lots.txt", [("lot 1", 1.002 * BASE), ("lot 2", 1.06 * BASE)])


SAID = ("--as", "reflectance")


@pytest.mark.parametrize(
    ("more", "code"),
    [((), 0), (("--tolerance", "CIE 2000 5"), 0), (("--tolerance", "CIE 2000 0.5"), 2)],
)
def test_the_exit_code_is_the_verdict(metamer, master, lots, more, code):
    found, out, _ = metamer("match", master, lots, *SAID, *more)
    assert found == code and "lot 2" in out and "lighter" in out
    assert ("not judged" in out) == (not more)


@pytest.mark.parametrize("held", ["file", "folder", "another way to write its path"])
def test_a_standard_among_its_lots_is_taken_out_of_them(metamer, tmp_path, held):
    rows = [("Standard", BASE), ("lot 1", 1.002 * BASE), ("Standard", 1.0001 * BASE), ("lot 2", 1.06 * BASE)]
    (tmp_path / "day").mkdir()
    file = readings(tmp_path / "day" / "all.txt", rows)
    where = {"file": file, "folder": file.parent}.get(held, f"{tmp_path}/day/../day/all.txt")
    figures = tmp_path / "m.json"
    code, out, _ = metamer("match", f"{file}#Standard", where, *SAID, "--tolerance", "CIE 2000 0.5", "--json", figures)
    said = json.loads(figures.read_text(encoding="utf-8"))
    assert code == 2 and [one["name"] for one in said["samples"]] == ["lot 1", "lot 2"]
    assert f"{where} holds the standard, Standard, too: it is not among the samples." in out
    assert any(words.startswith(f"{where} holds") for words in said["notes"]) and said["batches"][0]["count"] == 2
    # Named alone, it is its own standard all the same.
    for alone in (f"{file}#Standard", readings(tmp_path / "alone.txt", rows[:1])):
        code, _, err = metamer("match", alone, alone, *SAID)
        assert code == 3 and "its own standard" in err


def test_what_is_not_resolved_ends_with_1(metamer, master, lots):
    words = ("match", master, f"{lots}#lot 1", *SAID, "--tolerance", "CIE 2000 0.1", "--repeatability", "0.1")
    code, out, _ = metamer(*words)
    assert code == 1 and "too close to call" in out and "±" in out and "k = 2" in out


def test_a_page_to_sign_and_every_figure(metamer, master, lots, tmp_path):
    page, figures = tmp_path / "m.html", tmp_path / "m.json"
    words = ("--tolerance", "CMC 2:1 0.5", "--supplier", "Acme <Dye>", "--html", page, "--json", figures)
    code, out, _ = metamer("match", master, lots, *SAID, *words)
    assert (
        code == 2
        and str(page) in out
        and "\nlot 2 fails under every light" in out
        and "1 of 2 passes under every light\n" in out
    )
    html = page.read_text(encoding="utf-8")
    assert "Acme &lt;Dye&gt;" in html and "Spectro 9" in html and "Approved by" in html
    assert "http://" not in html.replace("http://www.w3.org", "") and "https://" not in html
    said = json.loads(figures.read_text(encoding="utf-8"))
    assert said["schema"] == "metamer.match/1" and [one["verdict"] for one in said["samples"]] == ["pass", "fail"]
    lot = said["samples"][1]["differences"][0]
    square = sum(lot["difference"][axis] ** 2 for axis in ("lightness", "chroma", "hue"))
    assert lot["delta_e"]["CIE 1976"] == pytest.approx(square**0.5)
    assert [one["count"] for one in said["batches"]] == [2, 2, 2]


@pytest.fixture
def metamers(tmp_path):
    """A lot that matches under D65 and fails under others, beside two that pass."""
    from metamer.spectral.illuminants import illuminant
    from metamer.spectral.observers import observer

    nm = NM.astype(float)
    seen = observer("1964_10").weights(illuminant("D65"), nm)
    bump = 0.1 * np.sin((nm - 380.0) / 40.0)
    black = bump - np.linalg.pinv(seen) @ (seen @ bump)
    rows = [("lot 1", 1.001 * BASE), ("lot 2", 1.0015 * BASE), ("lot 3", 1.0005 * BASE + black)]
    return readings(tmp_path / "metamers.txt", rows)


def test_a_lot_that_fails_under_one_light_goes_the_way_it_goes_there(metamer, master, metamers, tmp_path):
    page, figures = tmp_path / "m.html", tmp_path / "m.json"
    words = ("--illuminants", "D65,A,F11", "--tolerance", "CMC 2:1 0.5", "--html", page, "--json", figures)
    code, out, _ = metamer("match", master, metamers, *SAID, *words)
    said = json.loads(figures.read_text(encoding="utf-8"))
    lot = said["samples"][2]
    failing = [one["illuminant"] for one in lot["differences"] if one["verdict"] == "fail"]
    assert code == 2 and lot["differences"][0]["verdict"] == "pass" and "A" in failing
    assert failing == ["A", "F11"]
    towards = [one["words"] for one in lot["differences"] if one["verdict"] == "fail"]
    lights = [
        f"{name} ({words})" for name, words in zip(("tungsten lamp A", "shop light TL84 F11"), towards, strict=True)
    ]
    assert len(set(towards)) == 2
    says = f"lot 3 fails under {' and '.join(lights)} but passes under daylight D65; 2 of 3 pass under every light"
    assert out.splitlines()[-3] == said["summary"] == says
    text = page.read_text(encoding="utf-8")
    assert f"<span>L{says[1:]}.</span>" in text and text.count('<td class="k k4"') == 2
    first = lot["directions"][0]
    assert first["verdict"] == "fail" and first["conditions"][0]["illuminant"] in failing
    html = page.read_text(encoding="utf-8")
    row = html[html.index("<tbody>") : html.index("</tr>", html.index("<tbody>"))]
    # A sign and a word in each cell of it, and a ground that none of the others has.
    assert row.count('aria-label="fails"') == row.count('class="k k4"') == len(failing)
    assert first["words"] in row and row.count('aria-label="passes"') == 1
    planes = html.index('class="planes"')
    drawing = html[planes : html.index("</svg>", planes)]
    # A number alone would be taken for that of the table, where the worst is the first.
    assert "1 · " in row and "lot 3" in row
    assert all(f">{name}</text>" in drawing for name in ("lot 1", "lot 2", "lot 3"))


@pytest.mark.parametrize(
    ("names", "labels"),
    [
        (("Monday's panels, lot 1", "Monday's panels, lot 2"), ("…panels, lot 1", "…panels, lot 2")),
        (("Monday's panels, red", "Monday's panels, blue"), ("red", "blue")),
    ],
)
def test_long_names_of_dots_leave_out_what_all_begin_with(names, labels):
    nm = np.arange(400.0, 701.0, 20.0)
    lots = {name: (nm, factor * np.linspace(0.2, 0.5, nm.size)) for name, factor in zip(names, (0.9, 1.1), strict=True)}
    page = match((nm, np.linspace(0.2, 0.5, nm.size)), lots, illuminants="D65").html()
    drawing = page[page.index('class="planes"') :]
    assert all(f">{label}</text>" in drawing for label in labels)


@pytest.mark.parametrize("form", ["html", "json"])
def test_a_full_disk_leaves_the_file_that_was_there(metamer, master, lots, tmp_path, room_for, form):
    out = tmp_path / "out" / f"m.{form}"
    out.parent.mkdir()
    words = ("match", master, lots, *SAID, "--illuminants", "D65", f"--{form}", out)
    assert metamer(*words)[0] == 0
    before = out.read_bytes()
    for room in (len(before) // 2, len(before) - 1):
        with room_for(room):
            code, _, err = metamer(*words)
        assert code == 4 and "no room" in err and out.name in err, (room, err)
        assert out.read_bytes() == before and [path.name for path in out.parent.iterdir()] == [out.name]


def test_a_table_and_a_workbook_have_a_line_a_sample_and_condition(metamer, master, lots, tmp_path):
    """The numbers of the JSON, under headings that say what they are."""
    table, book, figures = (tmp_path / name for name in ("m.csv", "m.xlsx", "m.json"))
    asked = ("--tolerance", "CMC 2:1 0.5", "--repeatability", "0.1", "--yellowness", "--observers", "1964_10,1931_2")
    openpyxl = pytest.importorskip("openpyxl")
    metamer("match", master, lots, *SAID, *asked, "--csv", table, "--xlsx", book, "--json", figures)
    text = table.read_text(encoding="utf-8")
    lines = list(csv.reader(text.splitlines()))
    assert len(lines) == 1 + 2 * 6 and {len(line) for line in lines} == {len(lines[0])} == {len(set(lines[0]))}
    told = [dict(zip(lines[0], line, strict=True)) for line in lines[1:]]
    found = json.loads(figures.read_text(encoding="utf-8"))["samples"][1]
    line, difference = told[6 + 1], found["differences"][1]
    assert (line["sample"], line["illuminant"], line["observer"]) == ("lot 2", "A", "1964_10")
    assert line["verdict"] == difference["verdict"] and line["direction"] == difference["words"]
    assert float(line["ΔH*"]) == difference["difference"]["hue"]
    assert float(line["ΔE CMC 2:1"]) == difference["delta_e"]["CMC 2:1"]
    assert float(line["ΔE CMC 2:1 ±"]) == difference["uncertainty_k2"]["delta_e"]["CMC 2:1"]
    assert [float(line[f"{axis} of sample"]) for axis in ("L*", "a*", "b*")] == difference["sample_lab"]
    index = "metamerism, change of illuminant, parameric"
    told_by = {one["name"]: one["value"] for one in found["indices"] if one["changed"] == "A, 1964_10"}
    assert float(line[index]) == told_by[index] and told[6][index] == ""
    yellow = found["whites"][0]
    assert float(told[6]["yellowness, ASTM E313, sample"]) == yellow["sample"] and line["yellowness, ASTM E313 ±"] == ""
    assert [cell.value for cell in openpyxl.load_workbook(book).active[1]] == lines[0]


def test_documented_fields_are_those_written(metamer, master, lots):
    """docs/match.md names every field of `metamer.match/1`, and none that is not there."""
    _, out, _ = metamer("match", master, lots, *SAID, "--repeatability", "0.1", "--yellowness", "--json", "-")
    text = (Path(__file__).parents[2] / "docs" / "match.md").read_text(encoding="utf-8")
    text = text[text.index("## metamer.match/1") :]
    parts = re.split(r"^Of each ", text, flags=re.MULTILINE)
    found = json.loads(out)
    sample = found["samples"][0]
    written = [found, sample, *(part[0] for part in (sample["differences"], sample["indices"], sample["whites"]))]
    for part, fields in zip(parts, [*written, found["batches"][0]], strict=True):
        named = [row.partition("|")[0] for row in re.findall(r"^\| (`.*)", part, re.MULTILINE)] or [part]
        told = {word for row in named for word in re.findall(r"`([a-z_0-9]+)`", row)}
        assert set(fields) <= told, set(fields) - told
        if named != [part]:
            assert told == set(fields)


def test_illuminants_given_twice_add_up(metamer, master, lots):
    _, out, _ = metamer("match", master, lots, *SAID, "--illuminants", "A", "--illuminants", "D65,A", "--json", "-")
    found = json.loads(out)["samples"][0]["differences"]
    assert [one["illuminant"] for one in found] == ["A", "D65"]


def test_json_goes_to_standard_output_alone(metamer, master, lots):
    _, out, _ = metamer("match", master, lots, *SAID, "--json", "-")
    assert json.loads(out)["standard"]["name"] == "Master"


@pytest.mark.parametrize(
    ("headings", "name", "found"),
    [
        (["Master R%", "Lot 1 R%"], "Master", "Master R%"),
        (["R% Master", "R% Lot 1"], "Master", "R% Master"),
        (["Car red Master R%", "Car red Lot R%"], "Master", "Car red Master R%"),
        # All words of one are words of the other, too.
        (["red R%", "deep red R%"], "red", "red R%"),
        (["Master R%", "Lot 1 R%"], "Master R%", "Master R%"),
        (["Master R%", "Lot 1 R%"], "R%", None),
        (["Master R%", "Lot 1 R%"], "Mast", None),
        (["Master R%", "Master lot R%"], "lot", None),
    ],
)
def test_words_that_all_headings_have_need_not_be_written(metamer, tmp_path, headings, name, found):
    table = tmp_path / "lots.csv"
    rows = [f"{one},{100 * value:.3f},{101 * value:.3f}" for one, value in zip(NM, BASE, strict=True)]
    table.write_text("\n".join([",".join(["nm", *headings]), *rows]), encoding="utf-8")
    code, out, err = metamer("match", f"{table}#{name}", table)
    if found is None:
        assert code == 4 and "unknown reading" in err
    else:
        assert code == 0 and f"Standard: {found} (" in out and "too: it is not among the samples" in out


@pytest.mark.parametrize(
    ("axis", "head", "said"),
    [
        (299792.458 / NM, "THz", "the axis is in THz and converted: nm = 299792.458 / THz"),
        (NM, "nm", "the file states percent: values from"),
    ],
)
def test_what_was_converted_is_said_once(metamer, tmp_path, axis, head, said):
    rows = [f"{at:.6f},{100 * one:.4f},{101 * one:.4f}" for at, one in zip(axis, BASE, strict=True)]
    table, figures = tmp_path / "lots.csv", tmp_path / "m.json"
    table.write_text("\n".join([f"{head},Master R%,Lot 1 R%", *rows]), encoding="utf-8")
    code, out, _ = metamer("match", f"{table}#Master", table, "--json", figures)
    notes = json.loads(figures.read_text(encoding="utf-8"))["notes"]
    assert code == 0 and out.count(said) == 1 and sum(note.startswith(f"lots.csv: {said}") for note in notes) == 1


@pytest.mark.parametrize(
    ("option", "begins"),
    [("--csv", "standard,"), ("--html", "<!doctype html>"), ("--junit", "<?xml"), ("--markdown", "#")],
)
def test_one_output_goes_to_standard_output_and_the_rest_elsewhere(
    metamer, master, lots, tmp_path, monkeypatch, option, begins
):
    monkeypatch.chdir(tmp_path)
    code, out, err = metamer("match", master, lots, *SAID, option, "-")
    assert code == 0 and out.lower().startswith(begins) and "lighter" in err
    assert not Path("-").exists()


@pytest.mark.parametrize("words", [("--json", "-", "--csv", "-"), ("--xlsx", "-")])
def test_outputs_that_cannot_share_standard_output(metamer, master, lots, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    code, out, err = metamer("match", master, lots, *SAID, *words)
    assert code == 64 and not out and "standard output" in err and not Path("-").exists()


def test_readings_of_one_name_are_one_sample(metamer, master, tmp_path):
    rng = np.random.default_rng(0)
    again = [("lot", BASE * 1.03 + rng.normal(0, 1e-3, NM.size)) for _ in range(5)]
    code, out, _ = metamer("match", master, readings(tmp_path / "again.txt", again), *SAID, "--json", "-")
    (lot,) = json.loads(out)["samples"]
    assert code == 0 and lot["readings"] == 5


def test_one_sample_in_python_needs_no_list(master, lots):
    """Text is a name as a whole, and not one for each of its letters."""
    answer = ImportOptions("reflectance")
    for one in (lots, str(lots)):
        found = match(str(master), one, answer=answer).samples
        assert [each.sample.name for each in found] == ["lot 1", "lot 2"]


def test_whiteness_and_yellowness_where_asked_for(metamer, tmp_path):
    near_white = 0.88 + 0.02 * np.tanh((NM - 450.0) / 40.0)
    sides = [readings(tmp_path / f"{name}.txt", [(name, row)]) for name, row in (("a", near_white), ("b", BASE))]
    code, out, _ = metamer("match", *sides, *SAID)
    assert code == 0 and "Whiteness" not in out
    asked = ("--whiteness", "--yellowness", "--repeatability", "0.1")
    code, out, _ = metamer("match", *sides, *SAID, *asked)
    # A colour that is no white has no whiteness, and the reason is given.
    assert code == 0 and "whiteness, CIE 2004" in out and "no commercial white" in out
    _, out, _ = metamer("match", *sides, *SAID, *asked, "--json", "-")
    white, yellow = json.loads(out)["samples"][0]["whites"]
    assert 70 < white["standard"] < 90 and white["sample"] is None and white["uncertainty"] is None
    assert yellow["conditions"] == "D65, 1964_10" and yellow["sample"] > yellow["standard"]
    assert 0.0 < yellow["uncertainty"] < 1.0
    # Defined under none of these lights: said, and not left out.
    _, out, _ = metamer("match", *sides, *SAID, "--yellowness", "--illuminants", "A")
    assert "not defined for A, 1964_10; it is for" in out
    assert metamer("match", *sides, *SAID, "--whiteness", "CIE 1982")[0] == 64


def test_colours_of_a_file_that_does_not_say_what_they_are_for(metamer, master, tmp_path):
    """Asked for, and never guessed; what a file says itself counts more."""
    rows = "BEGIN_DATA_FORMAT\nSAMPLE_LOC LAB_L LAB_A LAB_B\nEND_DATA_FORMAT\n"
    path = tmp_path / "target.cie"
    path.write_text(f"CTI3\nNUMBER_OF_FIELDS 4\n{rows}NUMBER_OF_SETS 1\nBEGIN_DATA\nA1 66 24 45\nEND_DATA\n")
    code, _, err = metamer("match", f"{path}#A1", master, *SAID)
    assert code == 3 and "without its illuminant" in err and "--colours-for" in err
    for sides in ((f"{path}#A1", master), (master, path)):
        code, out, err = metamer("match", *sides, *SAID, "--colours-for", "D50/1931_2")
        assert code == 0, err
        assert "Warm daylight D50, 2° observer" in out and "1964_10" not in out
    assert metamer("match", path, master, *SAID, "--colours-for", "D50")[0] == 64
    said = tmp_path / "said.csv"
    said.write_text("name,L* (D65/10°),a* (D65/10°),b* (D65/10°)\nOrange,66.7,23.5,44.1\n")
    _, out, _ = metamer("match", said, master, *SAID, "--colours-for", "D50/1931_2")
    assert "Daylight D65, 10° observer" in out


def test_a_folder_is_a_batch(metamer, master, tmp_path):
    folder = tmp_path / "lots"
    folder.mkdir()
    for at in range(6):
        readings(folder / f"{at}.txt", [(f"lot {at}", (1.0 + 0.01 * (at + 1)) * BASE)])
    code, out, _ = metamer("match", master, folder, *SAID, "--illuminants", "D65")
    assert code == 0 and "The batch of 6" in out and "a sample" in out
    (tmp_path / "none").mkdir()
    code, _, err = metamer("match", master, tmp_path / "none", *SAID)
    assert code == 4 and "no readings in this folder" in err
    # Nothing of a batch is left out unseen.
    (folder / "7.txt").write_text("not a reading", encoding="utf-8")
    assert metamer("match", master, folder, *SAID)[0] == 4


def test_a_lab_standard_is_compared_under_its_own_light(metamer, lots, tmp_path):
    code, out, _ = metamer("match", "lab:66.7,23.5,44.1@D65/1964_10", lots, *SAID)
    assert code == 0 and "Tungsten" not in out and "Daylight D65, 10° observer" in out
    code, _, err = metamer("match", "lab:66.7,23.5,44.1@D65/1964_10", lots, *SAID, "--illuminants", "A")
    assert code == 3 and "has no spectrum" in err
    code, _, err = metamer("match", "lab:66.7,23.5,44.1", lots, *SAID)
    assert code == 4 and "without its illuminant and observer" in err
    table = tmp_path / "standards.csv"
    table.write_text("name,L* (D65/10°),a* (D65/10°),b* (D65/10°)\nOrange,66.7,23.5,44.1\nBlue,30,5,-40\n")
    code, out, err = metamer("match", f"{table}#Orange", lots, *SAID)
    assert code == 0, err
    assert "Standard: Orange" in out


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("{master}", "{master}"), 3, "its own standard"),
        (("{lots}", "{master}"), 64, "holds 2 samples"),
        (("{lots}#lot 3", "{master}"), 4, "lot 2"),
        (("{master}", "{lots}", "--tolerance", "CMC 1.0"), 64, "l:c"),
        (("{master}", "{lots}", "--tolerance", "CIE2000"), 64, "a formula and a number"),
        (("{master}", "{lots}", "--tolerance", "CIE 200 0.5"), 64, "CIE 2000"),
        (("{master}", "{lots}", "--formulas", "CIE 2001"), 64, "CIE 2000"),
        (("nowhere.txt", "{lots}", "--illuminants", "D66"), 64, "D65"),
        (("{master}", "{lots}", "--observers", "1931_3"), 64, "1931_2"),
        (("{master}", "nowhere.txt"), 4, "no such file"),
        (("{master}", "nowhere.cxf#lot 3"), 4, "nowhere.cxf: no such file"),
        (("{master}", "{folder}/nowhere"), 4, "nowhere: no such file"),
        (("lots/nowhere.cxf", "{master}"), 4, "lots/nowhere.cxf: no such file, and as a material: no such catalogue"),
        (("{master}", "{lots}", "--illuminants", "D65,booth.csv#2"), 64, "booth.csv: no such file"),
        (("{master}", "{lots}", "--repeatability", "0"), 64, "repeatability"),
        (("{master}", "{lots}", "--repeated", "{master}"), 4, "too few readings"),
        (("{master}", "{short}"), 4, "too little of the visible"),
        (("{master}", "{lots}", "--html", "nowhere/m.html"), 4, "no such folder"),
    ],
)
def test_what_cannot_be_compared_says_why(metamer, master, lots, tmp_path, words, code, said):
    short = readings(tmp_path / "short.txt", [("short", BASE)], last=620)
    known = {"master": master, "lots": lots, "short": short, "folder": tmp_path}
    found, _, err = metamer("match", *(word.format(**known) for word in words), *SAID)
    assert found == code and said in err


def test_an_observer_is_called_by_its_short_name_however_it_was_spelt(metamer, master, lots):
    words = ("match", master, lots, *SAID, "--illuminants", "D65", "--json", "-")
    by_angle, by_name = (metamer(*words, "--observers", spelt)[1] for spelt in ("10°", "1964_10"))
    assert by_angle == by_name and '"1964_10"' in by_name


def test_materials_of_a_catalogue(metamer, tiny_catalogue):
    code, out, err = metamer("match", "tiny/matt-red", "tiny/satin-green", "--catalogue", tiny_catalogue)
    assert code == 0, err
    assert "tiny/satin-green" in out


def test_materials_are_matched_as_they_are_by_their_ids(tiny_catalogue):
    catalogue = Catalogue.open(tiny_catalogue)
    of_ids = match("tiny/matt-red", "tiny/satin-green", catalogue=catalogue)
    found = match(catalogue["tiny/matt-red"], [catalogue["tiny/satin-green"]])
    assert found.summary == of_ids.summary and found.samples[0].sample.name == "tiny/satin-green"
    assert found.samples[0].differences[0].delta_e == of_ids.samples[0].differences[0].delta_e
    with pytest.raises(InputError, match=r"(?s)no sample.*lab:50,20,10@D65/1964_10"):
        match((50, 20, 10), catalogue["tiny/matt-red"])


def test_a_build_server_is_told_of_each_sample(metamer, master, lots, tmp_path):
    """What is not resolved neither passes nor fails."""
    junit, summary = tmp_path / "m.xml", tmp_path / "m.md"
    words = ("--tolerance", "CMC 2:1 0.5", "--junit", junit, "--markdown", summary)
    code, _, _ = metamer("match", master, lots, *SAID, *words)
    suite = ElementTree.parse(junit).getroot().find("testsuite")
    assert code == 2 and (suite.get("tests"), suite.get("failures"), suite.get("skipped")) == ("2", "1", "0")
    failed = [case.get("name") for case in suite.findall("testcase") if case.find("failure") is not None]
    text = summary.read_text(encoding="utf-8")
    assert failed == ["lot 2"] and "1 of 2 passes under every light." in text
    assert text.index("| lot 2 | ❌ fails |") < text.index("| lot 1 | ✅ passes |")
    words = ("--tolerance", "CIE 2000 0.1", "--repeatability", "0.1", "--junit", junit, "--markdown", summary)
    code, _, _ = metamer("match", master, f"{lots}#lot 1", *SAID, *words)
    suite = ElementTree.parse(junit).getroot().find("testsuite")
    assert code == 1 and (suite.get("failures"), suite.get("skipped")) == ("0", "1")
    assert "not resolved: ΔE CIE 2000" in suite.find("testcase/skipped").get("message")
    assert "⚠️ too close to call" in summary.read_text(encoding="utf-8")


def test_an_empty_file_is_said_to_be_empty_and_what_to_do(metamer, tmp_path):
    file = tmp_path / "nothing.csv"
    file.touch()
    code, _, said = metamer("match", file, file)
    assert code == 4
    assert str(file) in said and "the file is empty" in said and "expected: one of: " in said and "try: export" in said


def test_help_lists_every_option(metamer):
    _, out, _ = metamer("match", "--help")
    assert all(f"--{name} WORDS" in out for name in ("project", "part", "supplier", "instrument"))
