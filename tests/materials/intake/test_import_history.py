"""History of imports: what a second one does not do again, and what it never takes for granted."""

import json
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.formats import registry
from metamer.materials.intake import import_history
from metamer.materials.intake import import_plan as planning
from metamer.materials.intake.importing import import_sources
from metamer.materials.records.record import material_path

SPECTRA = "# reflectance\nwavelength_nm,red,blue\n400,0.1,0.6\n500,0.2,0.4\n600,0.7,0.1\n700,0.8,0.1\n"
GREY = 'family = "grey"\nkind = "analytic"\n[[material]]\nname = "grey"\nmodel = "lambert"\n'
CONSTANT = "reflectance = { constant = 0.5 }\n"
FROM_TABLE = 'reflectance = { table = "t", column = "red" }\n'
pytestmark = pytest.mark.usefixtures("fits")


@pytest.fixture(autouse=True)
def at_rest(monkeypatch):
    """Files are as if they had lain there for long."""
    monkeypatch.setattr(import_history, "_TICK_NS", -(10**15))


@pytest.fixture
def work(monkeypatch):
    """Counts what is done: files read by readers, files sniffed, records checked whole."""
    done = {"read": [], "sniffed": [], "checked": []}

    def counted(module, name, kind):
        plain = getattr(module, name)

        def call(*args, **words):
            path = next(arg for arg in args if isinstance(arg, Path))
            done[kind].append(path.name)
            return plain(*args, **words)

        monkeypatch.setattr(module, name, call)

    counted(planning, "read_with", "read")
    counted(import_history, "format_for", "sniffed")
    counted(import_history, "read_record", "checked")
    return done


@pytest.fixture
def source(tmp_path):
    folder = tmp_path / "source"
    folder.mkdir()
    (folder / "chart.csv").write_text(SPECTRA)
    (folder / "grey.toml").write_text(GREY + CONSTANT)
    (folder / "damaged.bsdf").write_bytes(b"tensor_file\0\1\0")
    (folder / "README.md").write_text("What is in here.\n")
    (folder / "mesh.txt").write_text("1 2 3\n" * 5)
    return folder


def imported(source, tmp_path, **words):
    return import_sources([source], tmp_path / "cat", jobs=1, **words)


def told(report):
    outcomes = sorted((one.id, one.status, one.reason, one.file, one.format) for one in report.outcomes)
    return outcomes, sorted((file.name, file.format, file.note) for file in report.files)


def nothing(work):
    return {kind: [] for kind in work}


def test_a_second_import_opens_nothing_and_says_the_same(source, tmp_path, work, fits):
    imported(source, tmp_path)
    second = imported(source, tmp_path)
    for names in work.values():
        names.clear()
    third = imported(source, tmp_path)
    assert work == nothing(work)
    assert told(third) == told(second) and third.count("skipped") == 3 and len(fits) == 3
    assert third.count("failed") == 1 and len(third.not_recognised) == 2


def test_without_what_is_known_the_report_is_the_same(source, tmp_path, work):
    imported(source, tmp_path)
    with_it = imported(source, tmp_path)
    (tmp_path / "cat" / import_history.FILE).unlink()
    without = imported(source, tmp_path)
    assert told(without) == told(with_it)
    assert len(work["checked"]) == 3


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: data[:-20],
        lambda data: data.replace(b"chart", b"cheat"),
        lambda data: b"\xff" * 9,
    ],
)
def test_damage_to_what_is_known_costs_time_only(source, tmp_path, work, damage):
    imported(source, tmp_path)
    expected = told(imported(source, tmp_path))
    file = tmp_path / "cat" / import_history.FILE
    file.write_bytes(damage(file.read_bytes()))
    work["read"].clear()
    assert told(imported(source, tmp_path)) == expected and "chart.csv" in work["read"]


def test_other_code_of_readers_reads_again(source, tmp_path, work, monkeypatch):
    imported(source, tmp_path)
    work["read"].clear()
    monkeypatch.setattr(import_history, "readers_hash", lambda: "of another day")
    imported(source, tmp_path)
    assert "chart.csv" in work["read"]


def test_other_settings_read_again(source, tmp_path, work):
    imported(source, tmp_path)
    work["read"].clear()
    assert imported(source, tmp_path, family="mine").count("imported") == 3
    assert {"chart.csv", "grey.toml"} <= set(work["read"])
    assert imported(source, tmp_path, budget=0.25).count("imported") == 3


def test_a_changed_file_is_read_again_and_its_neighbours_are_not(source, tmp_path, work, fits):
    imported(source, tmp_path)
    fits.clear(), work["read"].clear()
    (source / "chart.csv").write_text(SPECTRA.replace("0.7", "0.6"))
    assert imported(source, tmp_path).count("imported") == 2
    assert set(fits) == {"chart/red", "chart/blue"} and set(work["read"]) == {"chart.csv"}


def test_a_change_of_the_same_size_and_time_is_seen(source, tmp_path, fits):
    """Programs that keep a file's time do not keep the time at which its node was changed."""
    imported(source, tmp_path)
    file = source / "chart.csv"
    before = file.stat()
    file.write_text(SPECTRA.replace("0.7", "0.6"))
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert imported(source, tmp_path).count("imported") == 2


def test_a_file_that_was_just_written_is_not_trusted(source, tmp_path, work, monkeypatch):
    """It may change once more within the same tick of the clock, and show the same times."""
    monkeypatch.setattr(import_history, "_TICK_NS", 10**15)
    imported(source, tmp_path)
    state = import_history._state
    monkeypatch.setattr(
        import_history, "_state", lambda path: [1, 1, 1, 1] if path.name == "chart.csv" else state(path)
    )
    (source / "chart.csv").write_text(SPECTRA.replace("0.7", "0.6"))
    work["checked"].clear()
    assert imported(source, tmp_path).count("imported") == 2
    assert "grey.h5" in work["checked"]


def test_a_file_that_changes_while_it_is_read_is_not_kept(source, tmp_path, monkeypatch):
    plain = planning.read_with

    def changing(reader, path, *words):
        found = list(plain(reader, path, *words))
        if path.name == "chart.csv":
            path.write_text(SPECTRA.replace("0.7", "0.6"))
        return iter(found)

    monkeypatch.setattr(planning, "read_with", changing)
    imported(source, tmp_path)
    monkeypatch.setattr(planning, "read_with", plain)
    assert imported(source, tmp_path).count("imported") == 2


def test_a_copy_with_other_times_is_known_by_its_content(source, tmp_path, work):
    imported(source, tmp_path)
    os.utime(source / "chart.csv", (1, 1))
    work["read"].clear()
    assert imported(source, tmp_path).count("skipped") == 3 and work["read"] == []


def test_the_files_beside_a_description_count(source, tmp_path, work):
    (source / "t.csv").write_text("nm,red\n400,0.1\n700,0.8\n")
    (source / "sources.toml").write_text('[t]\nfile = "t.csv"\nsource = "s"\nlicence = "l"\n')
    (source / "grey.toml").write_text(GREY + FROM_TABLE)
    imported(source, tmp_path)
    work["read"].clear()
    assert imported(source, tmp_path).count("imported") == 0 and work["read"] == []
    (source / "t.csv").write_text("nm,red\n400,0.1\n700,0.7\n")
    assert imported(source, tmp_path).count("imported") == 1
    (source / "t.csv").unlink()
    report = imported(source, tmp_path)
    assert any("t.csv" in one.reason for one in report.outcomes if one.status == "failed")


def test_what_lies_in_a_folder_decides_what_a_picture_is(source, tmp_path):
    """A file beside a set of maps is passed over, and refused where they are gone."""
    pytest.importorskip("PIL")
    from PIL import Image

    Image.new("RGB", (4, 4), (90, 120, 60)).save(source / "wood_albedo.png")
    (source / "wood.mtlx").write_text("<materialx></materialx>")
    first = imported(source, tmp_path)
    assert not any("wood.mtlx" in one.file for one in first.outcomes)
    (source / "wood_albedo.png").unlink()
    second = imported(source, tmp_path)
    assert any("wood.mtlx" in one.file and one.status == "failed" for one in second.outcomes)


def test_members_of_archives_are_known_by_their_content(source, tmp_path, work):
    archive = tmp_path / "set.zip"
    with zipfile.ZipFile(archive, "w") as packed:
        packed.write(source / "chart.csv", "chart.csv")
    assert import_sources([archive], tmp_path / "cat", jobs=1).count("imported") == 2
    work["read"].clear()
    assert import_sources([archive], tmp_path / "cat", jobs=1).count("skipped") == 2 and work["read"] == []
    with zipfile.ZipFile(archive, "w") as packed:
        packed.writestr("chart.csv", SPECTRA.replace("0.7", "0.6"))
    assert import_sources([archive], tmp_path / "cat", jobs=1).count("imported") == 2


@pytest.mark.parametrize("reason", [OSError("stale file handle"), MemoryError()])
def test_what_a_disk_or_memory_refused_is_tried_again(source, tmp_path, monkeypatch, reason):
    rgl = next(reader for reader in registry.formats() if reader.NAME == "RGL measurement")
    plain = rgl.read_sources

    def failing(path, uplift):
        raise reason

    monkeypatch.setattr(rgl, "read_sources", failing)
    imported(source, tmp_path)
    monkeypatch.setattr(rgl, "read_sources", plain)
    (failed,) = (one for one in imported(source, tmp_path).outcomes if one.status == "failed")
    assert "broke down" not in failed.reason and "ends early" in failed.reason


def test_a_stored_file_that_lost_its_end_is_made_again(source, tmp_path, fits):
    """Its head is whole, and says what it should."""
    imported(source, tmp_path)
    path = material_path(tmp_path / "cat", "chart/red")
    whole = path.read_bytes()
    path.write_bytes(whole[:-100])
    fits.clear()
    report = imported(source, tmp_path)
    assert (report.count("imported"), fits) == (1, ["chart/red"]) and path.read_bytes() == whole
    assert Catalogue.open(tmp_path / "cat").verify()["chart/red"] is None


def test_a_stored_file_with_another_bit_is_made_again(source, tmp_path, fits):
    imported(source, tmp_path)
    path = material_path(tmp_path / "cat", "grey/grey")
    data = bytearray(path.read_bytes())
    place = data.index(np.ones(81, "<f4").tobytes()) if np.ones(81, "<f4").tobytes() in data else len(data) - 1500
    data[place] ^= 0x40
    path.write_bytes(bytes(data))
    broken = Catalogue.open(tmp_path / "cat").verify()["grey/grey"] is not None
    fits.clear()
    assert imported(source, tmp_path).count("imported") == broken


def test_nothing_is_written_by_a_dry_run_or_where_nothing_is_new(source, tmp_path):
    imported(source, tmp_path, dry_run=True)
    assert not (tmp_path / "cat").exists()
    imported(source, tmp_path), imported(source, tmp_path)
    file = tmp_path / "cat" / import_history.FILE
    before = file.stat().st_ino
    imported(source, tmp_path)
    assert file.stat().st_ino == before


def test_a_place_that_cannot_be_written_to_stops_nothing(source, tmp_path, monkeypatch):
    def full(path):
        raise OSError(28, "no space")

    monkeypatch.setattr(import_history, "written_whole", full)
    assert imported(source, tmp_path).count("imported") == 3


def test_what_is_known_holds_no_more_than_it_says(source, tmp_path):
    imported(source, tmp_path)
    text = (tmp_path / "cat" / import_history.FILE).read_bytes().partition(b"\n")[2]
    assert set(json.loads(text)) == {"version", "code", "formats", "readings", "records"}
