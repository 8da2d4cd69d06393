"""`metamer report compare`: exit codes, words and files."""

import json
import shutil

import pytest


@pytest.fixture
def reviews(metamer, scene, tiny_catalogue, tmp_path):
    """Two reviews of one material, equal to the byte."""
    words = ["--materials", "tiny/matt-red", "--catalogue", tiny_catalogue, "--renderer", "software", "--jobs", 1]
    code, _, err = metamer("review", scene, "--out", tmp_path / "a", *words)
    assert code in (0, 1, 2), err
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    return tmp_path / "a", tmp_path / "b"


@pytest.fixture
def readings(tmp_path):
    """Two files of twelve greys, lighter in one of them."""
    names = ",".join(f"grey {index} reflectance" for index in range(12))
    for name, lighter in (("a", 0.0), ("b", 0.05)):
        greys = ",".join(f"{0.2 + 0.05 * index + lighter:.2f}" for index in range(12))
        lines = [f"{nm},{greys}" for nm in range(380, 740, 10)]
        (tmp_path / f"{name}.csv").write_text("\n".join([f"wavelength,{names}", *lines]), encoding="utf-8")
    return tmp_path / "a.csv", tmp_path / "b.csv"


def test_a_copy_is_identical_and_itself_is_refused(metamer, reviews):
    code, out, err = metamer("report", "compare", *reviews)
    assert code == 0 and out.rstrip().endswith("Nothing moved: all 2 pictures are the same, byte for byte"), err
    code, out, err = metamer("report", "compare", reviews[0], reviews[0])
    assert code == 3 and out == "" and "a comparison with itself" in err


def test_criteria_decide_the_exit_code(metamer, reviews, tmp_path):
    a, b = (next((folder / "pictures").glob("*.D65.exr")) for folder in reviews)
    shutil.copy(next((reviews[1] / "pictures").glob("*.D65.reference.exr")), b)
    limits = tmp_path / "criteria.toml"
    for limit, expected in (((9, 9), 0), ((0, 9), 1), ((0, 0), 2)):
        limits.write_text('[[criteria]]\nstatistic = "max"\nwarn = {}\nfail = {}\n'.format(*limit), encoding="utf-8")
        code, out, err = metamer("report", "compare", a, b, "--criteria", limits)
        assert code == expected, out + err
    code, out, _ = metamer("report", "compare", *reviews, "--criteria", limits, "--json", "-")
    found = json.loads(out)
    assert (code, found["schema"], found["status"]) == (2, "metamer.regression/1", "fail")
    assert [row["state"] for row in found["results"]] != ["identical", "identical"]
    assert found["self_check"][0]["passed"] and found["results"][0]["layers"]["picture"]["delta_e94"]["max"] > 0


def test_files_are_written_and_standard_output_is_json(metamer, reviews, tmp_path):
    outputs = {name: tmp_path / f"moved.{name}" for name in ("html", "junit", "csv", "markdown")}
    options = [word for name, path in outputs.items() for word in (f"--{name}", path)]
    code, out, _ = metamer("report", "compare", *reviews, "--json", "-", *options)
    assert code == 0 and json.loads(out)["identical"] and all(path.stat().st_size for path in outputs.values())
    code, out, err = metamer("report", "compare", *reviews, "--csv", tmp_path / "none" / "moved.csv")
    assert code == 4 and out == "" and "none" in err


@pytest.mark.slow_cases("junit", "csv", "markdown")
@pytest.mark.parametrize("form", ["html", "junit", "csv", "xlsx", "markdown"])
def test_a_full_disk_leaves_the_file_that_was_there(metamer, readings, tmp_path, room_for, form):
    if form == "xlsx":
        pytest.importorskip("openpyxl")
    out = tmp_path / "out" / f"moved.{form}"
    out.parent.mkdir()
    words = ["report", "compare", *readings, "--illuminants", "D65", f"--{form}", out]
    assert metamer(*words)[0] == 2
    before = out.read_bytes()
    # The message itself has to go somewhere.
    for room in (max(len(before) // 2, 600), len(before) - 1):
        with room_for(room):
            code, _, err = metamer(*words)
        assert code == 4 and "no room" in err and out.name in err, (room, err)
        assert out.read_bytes() == before and [path.name for path in out.parent.iterdir()] == [out.name]


def test_bad_input_ends_with_4_and_names_it(metamer, reviews, tmp_path):
    picture = next((reviews[1] / "pictures").glob("*.D65.exr"))
    picture.write_bytes(picture.read_bytes()[:100])
    code, out, err = metamer("report", "compare", *reviews)
    assert code == 4 and out == "" and picture.name in err
    (tmp_path / "c.toml").write_text('[[criteria]]\nstatistic = "p97"\nwarn = 0\nfail = 1\n', encoding="utf-8")
    code, _, err = metamer("report", "compare", *reviews, "--criteria", tmp_path / "c.toml")
    assert code == 4 and "c.toml" in err and "p95" in err


def test_unknown_names_are_refused_before_any_file(metamer):
    for option in (("--illuminants", "D66"), ("--observer", "1965"), ("--display", "CRT")):
        code, _, err = metamer("report", "compare", "nothing-here", "neither-here", *option)
        assert code == 64 and ("nearest" in err or "choose from sRGB" in err)


def test_a_workbook_that_cannot_be_made_is_refused_before_any_work(metamer, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    words = ("--xlsx", tmp_path / "r.xlsx", "--html", tmp_path / "r.html")
    for command in (("report", "compare", tmp_path / "no", tmp_path / "none"), ("match", "no.cxf", "none.cxf")):
        code, _, err = metamer(*command, *words)
        assert code == 4 and "metamer-colour[xlsx]" in err and "no such" not in err
