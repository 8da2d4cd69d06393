"""The commands that read a catalogue, of one in a zip file, named by its URL: they say what they say of the folder."""

import json
import zipfile

import pytest
from review_folder import pictures_of


@pytest.fixture(scope="module")
def shelf(room_catalogue, tmp_path_factory):
    path = tmp_path_factory.mktemp("shelf") / "room.zip"
    with zipfile.ZipFile(path, "w") as packed:
        for file in sorted(room_catalogue.rglob("*.*")):
            packed.write(file, file.relative_to(room_catalogue).as_posix())
    return f"zip://::{path}"


@pytest.mark.parametrize(
    "words",
    [
        ("list",),
        ("list", "--near", "70,0,0", "--within", "20"),
        ("show", "room/satin"),
        ("like", "room/satin", "--but", "lighter=5"),
        ("verify", "--quick"),
    ],
    ids=" ".join,
)
def test_what_reads_says_the_same(metamer, room_catalogue, shelf, words):
    verb, *more = words
    there, here = (metamer("catalogue", verb, *more, "--catalogue", where) for where in (shelf, room_catalogue))
    assert there[0] == 0 and there[1].replace(shelf, "CAT") == here[1].replace(str(room_catalogue), "CAT")


def test_list_gives_urls_and_reads_the_address_from_the_environment(metamer, shelf, monkeypatch):
    monkeypatch.setenv("METAMER_CATALOGUE", shelf)
    code, out, err = metamer("catalogue", "list", "--json", "-")
    assert code == 0, err
    assert json.loads(out)["catalogue"] == shelf
    assert json.loads(out)["materials"][0]["path"] == shelf.replace("zip://", "zip://room/dark.h5")


def test_two_catalogues_are_compared_and_materials_exported(metamer, room_catalogue, shelf, tmp_path):
    code, out, err = metamer("catalogue", "diff", shelf, room_catalogue, "--fail", "0.001", "--jobs", "1")
    assert code == 0, out + err
    both = []
    for name, where in (("there", shelf), ("here", room_catalogue)):
        words = ("--catalogue", where, "--format", "exr", "-o", tmp_path / f"{name}.exr")
        code, _, err = metamer("catalogue", "export", "room/grey", *words)
        assert code == 0, err
        both.append((tmp_path / f"{name}.exr").read_bytes())
    assert both[0] == both[1]


def test_a_scene_is_rendered_alike(metamer, room_catalogue, shelf, tmp_path, scene_text):
    scene = tmp_path / "scene.toml"
    scene.write_text(scene_text.replace("tiny/matt-red", "room/satin"), encoding="utf-8")
    pictures = []
    for name, where in (("there", shelf), ("here", room_catalogue)):
        out = tmp_path / f"{name}.exr"
        code, _, err = metamer("render", scene, "--catalogue", where, "--renderer", "software", "-o", out)
        assert code == 0, err
        pictures.append(out.read_bytes())
    assert pictures[0] == pictures[1]


@pytest.mark.slow
def test_processes_of_a_review_read_it_there_too(metamer, room_catalogue, shelf, tmp_path, scene_text):
    scene = tmp_path / "scene.toml"
    sweep = '[review]\non = "ball"\nmaterials = ["room/satin", "room/grey"]\nilluminants = ["D65"]\n'
    scene.write_text(scene_text.replace("tiny/matt-red", "room/satin") + sweep, encoding="utf-8")
    for name, where in (("there", shelf), ("here", room_catalogue)):
        words = ("--catalogue", where, "--renderer", "software", "--size", "12", "--jobs", "2", "-o", tmp_path / name)
        code, _, err = metamer("review", scene, *words)
        assert code in (0, 1), err
    assert pictures_of(tmp_path / "there") == pictures_of(tmp_path / "here")


@pytest.mark.parametrize("words", [("catalogue", "import"), ("view",)], ids=" ".join)
def test_what_needs_a_folder_refuses_before_it_reads(metamer, words):
    code, out, err = metamer(*words, "--catalogue", "nosuch://host/cat")
    assert code == 4 and not out
    assert "needs a folder, not a URL" in err and "copy it with the store's own tool" in err


def test_an_address_that_nobody_knows_is_refused(metamer):
    code, _, err = metamer("catalogue", "list", "nosuch://host/cat")
    assert code == 4 and "nosuch://host/cat" in err and "try: " in err
    code, _, err = metamer("catalogue", "list", "s3://me:word@host/cat")
    assert code == 4 and "credentials" in err and "word" not in err.replace("password", "")
