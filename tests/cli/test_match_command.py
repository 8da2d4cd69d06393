"""`metamer match`, its exit codes, and what it writes."""

from __future__ import annotations

import json

import numpy as np
import pytest

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


def test_what_is_not_resolved_ends_with_1(metamer, master, lots):
    words = ("match", master, f"{lots}#lot 1", *SAID, "--tolerance", "CIE 2000 0.1", "--repeatability", "0.1")
    code, out, _ = metamer(*words)
    assert code == 1 and "not resolved" in out and "±" in out and "k = 2" in out


def test_a_page_to_sign_and_every_figure(metamer, master, lots, tmp_path):
    page, figures = tmp_path / "m.html", tmp_path / "m.json"
    words = ("--tolerance", "CMC 2:1 0.5", "--supplier", "Acme <Dye>", "--html", page, "--json", figures)
    code, out, _ = metamer("match", master, lots, *SAID, *words)
    assert code == 2 and str(page) in out
    html = page.read_text(encoding="utf-8")
    assert "Acme &lt;Dye&gt;" in html and "Spectro 9" in html and "Approved by" in html
    assert "http://" not in html.replace("http://www.w3.org", "") and "https://" not in html
    said = json.loads(figures.read_text(encoding="utf-8"))
    assert said["schema"] == "metamer.match/1" and [one["verdict"] for one in said["samples"]] == ["pass", "fail"]
    lot = said["samples"][1]["differences"][0]
    square = sum(lot["difference"][axis] ** 2 for axis in ("lightness", "chroma", "hue"))
    assert lot["delta_e"]["CIE 1976"] == pytest.approx(square**0.5)
    assert [one["count"] for one in said["batches"]] == [2, 2, 2]


def test_json_goes_to_standard_output_alone(metamer, master, lots):
    _, out, _ = metamer("match", master, lots, *SAID, "--json", "-")
    assert json.loads(out)["standard"]["name"] == "Master"


def test_readings_of_one_name_are_one_sample(metamer, master, tmp_path):
    rng = np.random.default_rng(0)
    again = [("lot", BASE * 1.03 + rng.normal(0, 1e-3, NM.size)) for _ in range(5)]
    code, out, _ = metamer("match", master, readings(tmp_path / "again.txt", again), *SAID, "--json", "-")
    (lot,) = json.loads(out)["samples"]
    assert code == 0 and lot["readings"] == 5


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
    assert code == 0 and "A, 1964_10" not in out and "D65, 1964_10" in out
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
        (("{master}", "{lots}", "--tolerance", "CMC 1.0"), 4, "l:c"),
        (("{master}", "{lots}", "--illuminants", "D66"), 4, "D65"),
        (("{master}", "{lots}", "--observers", "1931_3"), 4, "1931_2"),
        (("{master}", "nowhere.txt"), 4, "no such file"),
        (("{master}", "{lots}", "--repeatability", "0"), 4, "repeatability"),
        (("{master}", "{lots}", "--repeated", "{master}"), 4, "too few readings"),
        (("{master}", "{short}"), 4, "too little of the visible"),
        (("{master}", "{lots}", "--html", "nowhere/m.html"), 4, "no such folder"),
    ],
)
def test_what_cannot_be_compared_says_why(metamer, master, lots, tmp_path, words, code, said):
    short = readings(tmp_path / "short.txt", [("short", BASE)], last=680)
    known = {"master": master, "lots": lots, "short": short}
    found, _, err = metamer("match", *(word.format(**known) for word in words), *SAID)
    assert found == code and said in err


def test_materials_of_a_catalogue(metamer, tiny_catalogue):
    code, out, err = metamer("match", "tiny/matt-red", "tiny/satin-green", "--catalogue", tiny_catalogue)
    assert code == 0, err
    assert "tiny/satin-green" in out
