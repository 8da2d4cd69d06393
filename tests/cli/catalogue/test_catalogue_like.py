"""`metamer catalogue like`: what a person and what a program reads of neighbours."""

import json

import numpy as np
import pytest
from metamer.materials.records.material import Provenance


@pytest.fixture
def folder(tmp_path, write_matt, write_spectrum):
    for percent in (10, 20, 40, 80):
        write_matt(tmp_path / "cat", f"paint/grey-{percent}", percent / 100)
    write_matt(tmp_path / "cat", "paint/red", np.linspace(0.1, 0.3, 81))
    write_spectrum(tmp_path / "cat", "lamp/led")
    return tmp_path / "cat"


def test_a_table_of_neighbours(metamer, folder):
    code, out, err = metamer("catalogue", "like", "paint/grey-20", folder, "--but", "lighter=18")
    assert code == 0, err
    lines = out.splitlines()
    assert lines[0].startswith("paint/grey-20: L*a*b* 51.8 ") and lines[1] == "asked for: lighter 18"
    assert lines[2].split()[-2:] == ["lighter", "besides"]
    assert lines[4].startswith("paint/grey-40") and "+17." in lines[4]
    assert "left out, an emission spectrum, not a surface: lamp/led" in out


def test_so_many_and_json(metamer, folder):
    code, out, _ = metamer("catalogue", "like", "paint/grey-20", folder, "-n", 2, "--json", "-")
    found = json.loads(out)
    assert code == 0 and len(found["neighbours"]) == 2 and found["unusable"] == []
    assert found["material"]["id"] == "paint/grey-20" and found["material"]["distance"] == 0.0
    first = found["neighbours"][0]
    assert first["distance"] <= found["neighbours"][1]["distance"] and first["got"] == {}
    assert first["gloss_stops"] == pytest.approx(0.0, abs=1e-3)


def test_what_was_guessed_from_rgb_looks_no_better_than_what_was_measured(metamer, folder, write_matt):
    guessed, measured = (Provenance("a test", "none", kind) for kind in ("uplifted(mallett-yuksel)", "measured"))
    write_matt(folder, "paint/guess", 0.21, provenance=guessed)
    write_matt(folder, "paint/panel", 0.19, provenance=measured)
    code, out, _ = metamer("catalogue", "like", "paint/panel", folder)
    lines = out.splitlines()
    assert code == 0 and lines[0].endswith("; measured") and lines[1].split()[:2] == ["material", "standing"]
    standings = {line.split()[0]: line.split()[1] for line in lines if line.startswith("paint/g")}
    assert standings["paint/guess"] == "uplifted" and standings["paint/grey-20"] == "analytic"
    assert "1 material uplifted or reconstructed: a small distance is no match of colour" in out
    found = json.loads(metamer("catalogue", "like", "paint/panel", folder, "--json", "-")[1])
    assert found["material"]["standing"] == "measured"
    assert {one["id"]: one["standing"] for one in found["neighbours"]}["paint/guess"] == "uplifted"


def test_a_strip_of_pictures_itself_first(metamer, folder, tmp_path):
    from PIL import Image

    strip = tmp_path / "strip.png"
    words = ["--but", "lighter=18", "-n", 1, "--strip", strip, "--renderer", "software"]
    code, out, err = metamer("catalogue", "like", "paint/grey-20", folder, *words)
    assert code == 0, err
    assert str(strip) in out
    sheet = np.asarray(Image.open(strip).convert("L")).astype(float)
    before, after = sheet[80:120, 50:90].mean(), sheet[80:120, 190:230].mean()
    assert sheet.shape[1] == 2 * 140 + 12 and after > before + 20


def test_none_is_said(metamer, folder):
    code, out, _ = metamer("catalogue", "like", "paint/grey-80", folder, "--but", "lighter=5")
    assert code == 0 and "no other material here is nearer to that than it is itself" in out


def test_a_damaged_file_is_said(metamer, folder):
    (folder / "paint" / "grey-40.h5").write_bytes(b"nothing")
    code, out, _ = metamer("catalogue", "like", "paint/grey-20", folder)
    assert code == 4 and "grey-40.h5" in out and "paint/grey-10" in out


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["paint/grey-20", "--but", "warm"], 64, "WORD=N"),
        (["paint/grey-20", "--but", ""], 64, "WORD=N"),
        (["paint/grey-20", "--but", "warmer=much"], 64, "a number"),
        (["paint/grey-20", "--but", "warmer=1,warmer=2"], 64, "said twice"),
        (["paint/grey-20", "--but", "hotter=1"], 64, "warmer"),
        (["paint/grey-20", "--but", "warmer=1,cooler=1"], 4, "warmer and cooler"),
        (["paint/grey-20", "-n", "0"], 64, "-n"),
        (["paint/grey-20", "--stop", "-1"], 4, "weight of gloss"),
        (["paint/grey-20", "--strip", "strip.html"], 64, "written as .png"),
        (["paint/gray-20"], 4, "paint/grey-20"),
        (["lamp/led"], 4, "an emission spectrum"),
    ],
)
def test_what_is_refused(metamer, folder, words, code, said):
    found, _, err = metamer("catalogue", "like", words[0], folder, *words[1:])
    assert found == code and said in err
