"""A review that is broken off goes on from what it has drawn, and draws what depends on anything that has changed."""

import shutil
import zipfile
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from metamer.calibration.report.row import ReviewRow, RowColour
from metamer.calibration.report.row_files import DrawnRows, read_file_names, read_rows, write_rows
from metamer.calibration.report.statistics import DeltaEStatistics, SelfCheck
from metamer.lighting.scene import Part, Review
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.records.record import MARKER, write_record
from metamer.materials.svbrdf.map_set import Mask, Placement
from metamer.runtime import fingerprint as fingerprints
from metamer.runtime.errors import InputError
from metamer.runtime.fingerprint import fingerprint
from metamer.viewer.picture import display_for
from metamer.viewer.review import row_key as review_key
from metamer.viewer.review.review import review
from metamer.viewer.software.backend import software_session
from review_folder import pictures_of, results_of

LIGHTS = ("D65", "A")
NAMES = ("tiny/copper", "tiny/matt-red", "tiny/rough-blue")


@pytest.fixture(scope="module")
def catalogue(tiny_catalogue):
    return Catalogue.open(tiny_catalogue)


@pytest.fixture(scope="module")
def sphere(scenes):
    return replace(scenes.sphere_scene("tiny/matt-red", size=24, samples=1), review=Review("part0", NAMES, LIGHTS))


class Stopped(Exception):
    """Exception that breaks a review off in these tests."""


@pytest.fixture
def run(sphere, catalogue, tmp_path):
    """Runs a review, perhaps broken off after so many rows: (rows drawn, rows said to be there)."""

    def run(out=tmp_path / "out", scene=sphere, catalogue=catalogue, stop=None, renderer=None, **options):
        drawn, said = [], []

        def progress(done, total, material):
            drawn.append(material)
            if stop == len(drawn):
                raise Stopped

        told = {"progress": progress, "resumed": lambda found, total: said.append((found, total))}
        options = {"renderer": renderer or software_session(), "version": "test", **told, **options}
        try:
            review(scene, catalogue, out, **options)
        except Stopped:
            assert stop is not None
        return drawn, said

    return run


@pytest.fixture(scope="module")
def drawn_before(sphere, catalogue, tmp_path_factory):
    """The folder of a finished review, to be copied."""
    out = tmp_path_factory.mktemp("finished") / "out"
    review(sphere, catalogue, out, renderer=software_session(), version="test")
    return out


@pytest.fixture
def finished(drawn_before, tmp_path):
    """`tmp_path / "out"`, where a review has been."""
    return shutil.copytree(drawn_before, tmp_path / "out")


def files_of(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_review_that_was_broken_off_goes_on_and_ends_as_if_it_had_not_been(run, drawn_before, tmp_path):
    out, whole = tmp_path / "out", drawn_before
    # The second of three materials is half done.
    assert run(stop=3)[0] == ["tiny/copper", "tiny/copper", "tiny/matt-red"]
    assert {path.name for path in out.iterdir()} == {"unfinished"}
    assert len(list((out / "unfinished").iterdir())) == 1
    drawn, said = run()
    assert said == [(2, 6)] and drawn == ["tiny/matt-red"] * 2 + ["tiny/rough-blue"] * 2
    assert results_of(out) == results_of(whole) and pictures_of(out) == pictures_of(whole)
    assert files_of(out) == files_of(whole)


def test_a_review_that_is_broken_off_before_its_first_material_leaves_nothing(run, tmp_path):
    run(stop=1)
    assert not (tmp_path / "out").exists()


def test_a_folder_that_was_there_stays_as_it_was(run, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "index.html").write_text("a report of before")
    run(stop=1)
    assert files_of(out) == {"index.html"}
    run(stop=3)
    assert (out / "index.html").read_text() == "a report of before"


def test_a_finished_review_is_not_drawn_again(run, finished):
    before, files = results_of(finished), files_of(finished)
    assert run() == ([], [(6, 6)])
    assert results_of(finished) == before and files_of(finished) == files
    assert run(again=True, stop=1) == (["tiny/copper"], [])


@pytest.mark.parametrize("change", ["light", "budget", "camera", "lamp", "observer", "version", "code", "renderer"])
def test_what_a_row_depends_on_has_it_drawn_again(run, sphere, finished, monkeypatch, change):
    options = {}
    if change == "light":
        options["illuminants"] = ("D65", "F2")
    elif change == "budget":
        options["budget"] = 2.0
    elif change == "camera":
        options["scene"] = replace(sphere, cameras=(replace(sphere.camera(), width=26),))
    elif change == "lamp":
        options["scene"] = replace(sphere, lights=tuple(replace(it, illuminance_lux=900.0) for it in sphere.lights))
    elif change == "observer":
        from metamer.spectral.observers import observer

        options["scene"] = replace(sphere, observer=observer("1964_10"))
    elif change == "version":
        options["version"] = "another"
    elif change == "code":
        monkeypatch.setattr(review_key, "_code_hash", lambda: "another")
    else:
        options["renderer"] = software_session("mipmapped")
    assert run(**options, stop=1) == (["tiny/copper"], [])


def test_meshes_and_lights_are_hashed_once_for_all_cases_of_a_review(run, sphere, monkeypatch):
    hashed = []
    monkeypatch.setattr(fingerprints, "fingerprint", lambda value: hashed.append(value) or fingerprint(value))
    # Copies, which no other test has asked for.
    parts = tuple(replace(part, mesh=replace(part.mesh)) for part in sphere.parts)
    lights = tuple(replace(light) for light in sphere.lights)
    run(scene=replace(sphere, parts=parts, lights=lights), stop=1)
    assert [id(it) for it in hashed] == [id(it) for it in (*(part.mesh for part in parts), *lights)]


def test_keys_hang_on_every_field_of_a_part(sphere, catalogue):
    plan = SimpleNamespace(basis=np.eye(3), precision="float32")

    def key_of(**changes):
        changed = replace(sphere, review=None, parts=(replace(sphere.parts[0], **changes),))
        shows = (plan, display_for(changed), 1.0, 6, ())
        return review_key.row_key(changed, changed.camera(), catalogue, LIGHTS, (None, None), *shows)

    mesh = sphere.parts[0].mesh
    others = [
        {"mesh": replace(mesh, vertices=mesh.vertices + 1e-3)}, {"cutout": Mask(np.ones((1, 2, 1)), 0.5, Placement())},
        {"static": True}, {"name": "another"}, {"material": "tiny/copper"},
    ]  # fmt: skip
    assert {next(iter(one)) for one in others} == {each.name for each in fields(Part)}
    assert len({key_of(), *(key_of(**one) for one in others)}) == 6 and key_of() == key_of()


def test_a_changed_material_is_drawn_again_and_no_other(run, catalogue, tmp_path, sphere):
    """One light: with more, the basis of all depends on every material."""
    folder = tmp_path / "changed"
    shutil.copytree(catalogue.folder, folder)
    run(illuminants=["D65"], catalogue=Catalogue.open(folder))
    record = catalogue.load("tiny/copper")
    packs = tuple(pack.recoloured(1.01 * pack.palette.values[0]) for pack in record.fast.packs)
    write_record(replace(record, fast=replace(record.fast, packs=packs)), folder / "tiny" / "copper.h5")
    drawn, _ = run(illuminants=["D65"], catalogue=Catalogue.open(folder))
    assert "tiny/copper" in drawn
    assert (folder / MARKER).is_file()


def test_where_a_scene_lies_changes_no_row(run, sphere, finished, tmp_path):
    assert run(scene=replace(sphere, path=tmp_path / "elsewhere.toml", notes=("said",)))[0] == []


def test_a_picture_that_was_changed_or_lost_is_drawn_again(run, finished):
    (finished / "pictures" / "tiny~copper.D65.png").write_bytes(b"something else")
    (finished / "pictures" / "tiny~rough-blue.A.exr").unlink()
    expected = ["tiny/copper"] * 2 + ["tiny/rough-blue"] * 2
    assert run() == (expected, [(2, 6)])
    assert run()[0] == []


def test_damaged_rows_are_drawn_again(run, finished):
    for number, file in enumerate(sorted((finished / "rows").iterdir())):
        file.write_bytes([b"", b"PK\x03\x04 cut", file.read_bytes()[:-400]][number])
    assert run(stop=1) == (["tiny/copper"], [])


def test_rows_and_pictures_of_another_review_go_with_it(run, finished):
    out = finished
    (out / "pictures" / "mine.txt").write_text("somebody's")
    run(illuminants=["F2"])
    assert len(list((out / "rows").iterdir())) == 3
    assert {name.split(".")[1] for name in pictures_of(out)} == {"F2", "txt"}


def test_what_a_killed_review_left_half_done_is_cleared_away(run, finished):
    """In the middle of a material, of a file, and of putting things in their place."""
    out = finished
    expected = files_of(out)
    key = min(path.stem for path in (out / "rows").iterdir())
    half = out / "unfinished" / ".0123"
    (half / "pictures").mkdir(parents=True)
    (half / "pictures" / "red.png").write_bytes(b"half")
    (out / "unfinished" / key / "pictures").mkdir(parents=True)
    (out / "rows" / f"{key}.npz").rename(out / "unfinished" / key / "rows.npz")
    for name in (".index.0123abcd.html", ".review.0123abcd.json"):
        (out / name).write_bytes(b"half")
    for name in ("index.html", "review.json"):
        (out / name).unlink()
    drawn, said = run()
    assert len(drawn) == 2 and said == [(4, 6)]
    assert files_of(out) == expected


def test_two_reviews_into_one_folder_at_once_are_refused(run, tmp_path):
    from metamer.viewer.review.folder import drawing_into

    with drawing_into(tmp_path / "out"), pytest.raises(InputError, match="another review is being drawn"):
        run()


def test_rows_come_back_from_a_file_as_they_were(tmp_path):
    row = ReviewRow(
        material="a/b", illuminant="D65", observer="it", statistics=DeltaEStatistics(0.1, 0.2, 0.3, float("inf"), 4),
        image="pictures/a.png", picture=b"\0one", reference=b"", delta_e_map=b"three", width=2, height=3,
        full_size=(6, 4), seconds={"render": 1.5}, files={"XYZ EXR": "a.exr"}, wavelengths_nm=np.array([400.0, 500.0]),
        swatch=(1, 2, 3), colour=RowColour(np.ones((1, 3), np.float32), np.zeros((0, 3)), "45a:0"),
        white_xyz=np.array([0.9, 1.0, 1.1]), notes=("said",), provenance={"Source": "a ‘test’"},
    )  # fmt: skip
    drawn = DrawnRows((row,), (SelfCheck("lighter", 1.0, 1.0),), ("said",), {"a.png": "00"})
    write_rows(tmp_path / "rows.npz", drawn)
    back = read_rows(tmp_path / "rows.npz")
    assert fingerprint(back) == fingerprint(drawn) and back.rows[0].reflectance is None
    assert read_file_names(tmp_path / "rows.npz") == ("a.png",)
    # However many arrays there are: a member each would take longer than all that is in it.
    assert len(zipfile.ZipFile(tmp_path / "rows.npz").namelist()) == 2


def test_rows_of_a_first_review_are_laid_in_their_place_without_being_read(run, monkeypatch, tmp_path):
    read = []
    monkeypatch.setattr("metamer.viewer.review.folder.read_file_names", lambda path: read.append(path) or ())
    run()
    assert not read and len(list((tmp_path / "out" / "rows").iterdir())) == len(NAMES)


def test_a_fingerprint_tells_apart_what_differs():
    base = {"a": np.zeros((2, 3)), "b": (1, "x")}
    others = [
        {"a": np.zeros((3, 2)), "b": (1, "x")}, {"a": np.zeros((2, 3), np.float32), "b": (1, "x")},
        {"a": np.zeros((2, 3)), "b": (1.0, "x")}, {"a": np.zeros((2, 3)), "b": ("1x",)},
    ]  # fmt: skip
    assert fingerprint(base) == fingerprint({"a": np.zeros((2, 3)), "b": (1, "x")})
    assert len({fingerprint(it) for it in (base, *others)}) == 5
    with pytest.raises(TypeError):
        fingerprint(object())
