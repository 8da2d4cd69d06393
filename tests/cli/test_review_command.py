"""`metamer review`: files and figures, exit codes, patterns, bad input, and Ctrl-C."""

import json
import shutil
import signal

import h5py
import pytest
from metamer.viewer.review.review import OWN_LIGHT
from patience import patient
from pictures import read_xyz_exr
from PIL import Image


@pytest.fixture
def review(metamer, scene, tiny_catalogue, tmp_path):
    """Runs a review of the tiny scene in numpy; (code, stdout, stderr, review.json or None)."""

    def run(*words, renderer="software", path=scene, catalogue=tiny_catalogue):
        out = tmp_path / "out"
        options = ["--catalogue", catalogue, "--out", out, "--jobs", 1, "--renderer", renderer]
        code, said, err = metamer("review", path, *options, *words)
        figures = out / "review.json"
        return code, said, err, json.loads(figures.read_text()) if figures.exists() else None

    return run


def altered(scene, old, new):
    text = scene.read_text(encoding="utf-8")
    assert old in text
    scene.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.slow
def test_materials_given_twice_add_up(review):
    """What stands last does not take the place of what stands before it."""
    _, _, _, found = review("--illuminants", "D65", "--materials", "tiny/matt-red", "--materials", "tiny/copper")
    assert [row["material"] for row in found["results"]] == ["tiny/matt-red", "tiny/copper"]


def test_every_row_has_its_files(review, tmp_path):
    summary = tmp_path / "review.md"
    words = ("--illuminants", "D65,A", "--materials", "tiny/matt-red,tiny/copper", "--markdown", summary)
    code, said, _, found = review(*words)
    assert code == 0, said
    assert found["verdict"] in summary.read_text(encoding="utf-8") and str(summary) in said
    rows = found["results"]
    assert [(row["material"], row["illuminant"]) for row in rows] == [
        ("tiny/matt-red", "D65"),
        ("tiny/matt-red", "A"),
        ("tiny/copper", "D65"),
        ("tiny/copper", "A"),
    ]
    for row in rows:
        with Image.open(tmp_path / "out" / row["image"]) as picture:
            assert picture.size == (32, 32)
        for label in ("XYZ EXR", "reference EXR"):
            image, coverage = read_xyz_exr(tmp_path / "out" / row["files"][label])
            assert image.values.shape == (32, 32, 3) and 0.5 < coverage.mean() < 0.8
    files = {path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*") if path.is_file()}
    listed = {name for row in rows for name in (row["image"], *row["files"].values())}
    kept = {name for name in files if name.startswith("rows/")}
    assert len(kept) == 2 and files == {"index.html", "review.json", "history.json", *listed, *kept}
    assert str(tmp_path / "out" / "index.html") in said and str(tmp_path / "out" / "review.json") in said
    assert found["verdict"] in said and found["facts"] in said and "Renderer: software (numpy)" in said


def test_exit_code_follows_the_budget(review):
    words = ("--illuminants", "D65", "--materials", "tiny/rough-blue", "--budget")
    p99 = review(*words, 1)[3]["results"][0]["delta_e94"]["p99"]
    # The basis of the plan depends on the budget, but with one light it is exact whatever the budget is.
    for budget, code, status in ((1.1 * p99, 0, "pass"), (p99 / 1.25, 1, "near"), (p99 / 2.0, 2, "over")):
        found_code, said, _, found = review(*words, budget)
        assert (found_code, found["status"]) == (code, status), (p99, budget, said)
        assert found["verdict"] in said and "Farthest off: Rough blue under daylight D65." in said


def test_patterns_choose_materials(review):
    code, _, _, found = review("--materials", "*-green,tiny/m*", "--illuminants", "D65")
    assert code == 0
    assert [row["material"] for row in found["results"]] == ["tiny/satin-green", "tiny/matt-red"]


def test_illuminant_named_twice_is_one_row(review):
    _, _, _, found = review("--materials", "tiny/matt-red", "--illuminants", "D65,D65,F2")
    assert [row["illuminant"] for row in found["results"]] == ["D65", "F2"]


def test_without_gl_it_renders_in_software_and_says_so(review, monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    code, said, err, found = review("--materials", "tiny/matt-red", "--illuminants", "D65", renderer="auto")
    assert code == 0 and "OpenGL" not in said
    assert "No OpenGL here, so the software path renders" in err and "apt-get install" in err
    assert found["renderer"] == "software (numpy)"
    assert any("ran on the CPU" in words for words in found["colour_chain"])


def test_gl_where_it_is_missing_is_an_error(review, monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    code, _, err, found = review(renderer="gl")
    assert code == 4 and found is None
    assert "apt-get install libegl1" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--materials", "tiny/cooper"], ["unknown material", "nearest: tiny/copper"]),
        (["--materials", "gold*"], ["unknown material", "'gold*'"]),
        (["--illuminants", "D65,D56"], ["unknown illuminant", "'D56'", "nearest:", "D65"]),
        (["--camera", "fronts"], ["unknown camera", "front"]),
    ],
)
def test_unknown_name_on_the_command_line(review, words, said):
    code, _, err, found = review(*words)
    # A word that the scene or the catalogue would have to know is the fault of a file.
    assert code == (64 if "--illuminants" in words else 4) and found is None
    assert all(part in err for part in said), err


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"tiny/matt-red"', '"tiny/mat-red"', ["part 1 (ball).material", "nearest: tiny/matt-red"]),
        ('spectrum = "D65"', 'spectrum = "D66"', ["light 1.spectrum", "unknown illuminant", "D65"]),
        ('name = "Tiny"', 'observer = "1931_3"', ["scene.observer", "nearest: 1931_2"]),
        ("samples = 2", "sample = 2", ["unknown key", "camera 1 (front).sample", "nearest: samples"]),
        ('on = "ball"', 'on = "bell"', ["unknown part", "ball"]),
        ('"D65", "A"', '"D65", "AA"', ["review.illuminants", "'AA'"]),
        ('on = "ball"', 'on = "ball"\nmaterials = ["gold"]', ["review.materials", "'gold'"]),
        ('spectrum = "D65"', 'spectrum = "D65"\nilluminance_lux = 0', ["a light of no power", "illuminance_lux"]),
        ('spectrum = "D65"', 'spectrum = "dark.csv"', ["a light of no power", "dark.csv"]),
        ("[[part]]", "[[part]", ["not a TOML file"]),
    ],
)
def test_bad_scene(review, scene, old, new, said):
    (scene.parent / "dark.csv").write_text("wavelength_nm,dark\n400,0\n500,0\n600,0\n700,0\n")
    altered(scene, old, new)
    code, _, err, found = review()
    assert code == 4 and found is None
    assert str(scene) in err
    assert all(part in err for part in said), err


def test_missing_scene(review, tmp_path):
    code, _, err, _ = review(path=tmp_path / "scen.toml")
    assert code == 4
    assert "no such file" in err and "scen.toml" in err


def test_empty_scene(review, scene):
    scene.write_text("")
    code, _, err, _ = review()
    assert code == 4
    assert "the file is empty" in err


def test_materials_for_a_scene_without_review_are_swept_over_its_first_part(review, scene, scene_text):
    """Under the light that the scene has: only the material is asked to be another."""
    plane = '\n[[part]]\nname = "floor"\nshape = "plane"\nmaterial = "tiny/copper"\ntranslate = [0, -1, 0]\n'
    scene.write_text(scene_text + plane, encoding="utf-8")
    code, said, err, found = review("--materials", "*-green,tiny/r*")
    assert code == 0, said + err
    rows = found["results"]
    assert [(row["material"], row["illuminant"]) for row in rows] == [
        ("tiny/satin-green", OWN_LIGHT),
        ("tiny/rough-blue", OWN_LIGHT),
    ]
    assert any("no [review]" in words and '"ball"' in words for words in found["colour_chain"])


def test_missing_catalogue(review, tmp_path):
    code, _, err, _ = review(catalogue=tmp_path / "nowhere")
    assert code == 4
    assert "no such catalogue" in err and "metamer catalogue import --catalogue" in err


def test_folder_that_is_no_catalogue(review, tmp_path):
    code, _, err, _ = review(catalogue=tmp_path)
    assert code == 4
    assert "not a catalogue" in err


@pytest.fixture
def damaged(tiny_catalogue, tmp_path):
    """A copy of the catalogue and its file of tiny/copper, to be spoilt."""
    copy = tmp_path / "copy"
    shutil.copytree(tiny_catalogue, copy)
    return copy, copy / "tiny" / "copper.h5"


def test_truncated_material(review, damaged):
    folder, file = damaged
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])
    code, _, err, found = review(catalogue=folder)
    assert code == 4 and found is None
    assert str(file) in err and "not a readable material file" in err


def test_altered_material(review, damaged):
    folder, file = damaged
    with h5py.File(file, "a") as content:
        content["packs/0/spectral"][...] *= 1.05
    code, _, err, found = review(catalogue=folder)
    assert code == 4 and found is None
    assert str(file) in err and "content has changed" in err


def test_output_folder_below_a_file(metamer, scene, tiny_catalogue, tmp_path):
    (tmp_path / "file").touch()
    out = tmp_path / "file" / "review"
    code, _, err = metamer("review", scene, "--catalogue", tiny_catalogue, "--out", out, "--renderer", "software")
    assert code == 4
    assert str(out) in err and "the folder cannot be made" in err and "-o" in err


def test_part_that_is_out_of_sight_is_named(review, scene, scene_text):
    scene.write_text(
        scene_text + '\n[[part]]\nname = "far"\nshape = "sphere"\nmaterial = "tiny/copper"\ntranslate = [50, 0, 0]\n',
        encoding="utf-8",
    )
    code, _, err, _ = review()
    assert code == 4
    assert "tiny/copper under the scene's lights: no pixel" in err


def test_folder_where_a_file_should_go(review, tmp_path):
    (tmp_path / "out" / "index.html").mkdir(parents=True)
    code, _, err, _ = review("--materials", "tiny/matt-red", "--illuminants", "D65")
    assert code == 4
    assert str(tmp_path / "out" / "index.html") in err


def test_empty_catalogue(review, tmp_path):
    (tmp_path / "catalogue.toml").touch()
    code, _, err, _ = review(catalogue=tmp_path)
    assert code == 4
    assert "unknown material" in err and "there are none here" in err


def large(scene):
    """Big enough that a review of it is still at work when it is stopped."""
    altered(scene, "width = 32\nheight_px = 32\nsamples = 2", "width = 200\nheight_px = 200\nsamples = 3")


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_leaves_nothing_half_written(started, scene, tiny_catalogue, tmp_path, jobs):
    large(scene)
    out = tmp_path / "out"
    out.mkdir()
    (out / "review.json").write_text("figures of an earlier review")
    options = ["--catalogue", tiny_catalogue, "--out", out, "--jobs", jobs, "--renderer", "software"]
    process = started("review", scene, *options)
    for line in process.stderr:
        if "Reviewing: " in line:
            break
    process.send_signal(signal.SIGINT)
    said, err = process.communicate(timeout=patient(60))
    assert process.returncode == 130, said + err
    assert "interrupted; nothing half-written is left behind" in err
    assert "Traceback" not in err
    assert "Report:" not in said
    # The report of before stays as it was; what this one has drawn waits beside it.
    left = sorted(path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file())
    assert "review.json" in left and all(name.startswith("unfinished/") for name in left if name != "review.json"), left
