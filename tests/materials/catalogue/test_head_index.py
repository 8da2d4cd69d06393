"""The index of a catalogue's heads: it answers as every head read does, whatever happened to it or to the files."""

import json
import os
import random
import shutil
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from metamer.benchmarks import heads as made
from metamer.materials.catalogue import head_index
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.catalogue.head_index import FOLDER, HeadIndex
from metamer.materials.records.query import SORT_KEYS, Query, read_heads
from metamer.materials.records.record import SUFFIX, material_path
from metamer.materials.records.record_head import HEAD_BYTES, head_bytes
from metamer.materials.search.neighbours import like
from metamer.runtime.locks import alone_at_work
from patience import patient

pytest.importorskip("duckdb")

# Program of a process of its own: an index, and the answers of the benchmark.
INDEXING = """
import json, pathlib, sys
from metamer.materials.catalogue import head_index
from metamer.benchmarks.heads import QUERIES
from metamer.materials.catalogue.catalogue import Catalogue
head_index.WORTH = 10
print("begun", flush=True)
heads = Catalogue(pathlib.Path(sys.argv[1])).heads()
print(json.dumps([[one.id for one in heads.select(query)] for query in QUERIES.values()]))
"""
NEAR = Query(near=(52.0, 31.0, 18.0), limit=5)


@pytest.fixture(autouse=True)
def small(monkeypatch, tmp_path):
    """An index for a few materials; clocks that tick every 20 ms; a cache, and a process, of each test's own."""
    monkeypatch.setattr(head_index, "WORTH", 10)
    monkeypatch.setattr(head_index, "TICK_NS", 20_000_000)
    monkeypatch.setattr(made, "_FAMILY", 12)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    new_process()


@pytest.fixture
def folder(tmp_path):
    made.generated(tmp_path / "catalogue", 40)
    at_rest()
    return tmp_path / "catalogue"


def at_rest():
    time.sleep(0.05)


def new_process():
    head_index._opened.clear()


def ids(found):
    return [one.id for one in found]


def every_head(folder):
    return read_heads(folder, SUFFIX)


def write(folder, number, **changes):
    """Write a material of the benchmark's anew, as an import does; where its id is new, too."""
    head = made.head(number, (50.0, 0.0, 0.0)) | changes
    path = material_path(folder, head["id"])
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(".beside")
    beside.write_bytes(head_bytes(head, path))
    beside.replace(path)
    return path


def lab(*values):
    return {"colour": {"Lab": values, "XYZ": (0.2, 0.2, 0.2)}}


def check(folder, *queries, words=()):
    """Check that the index answers as every head does, in this process and in a new one."""
    for _ in range(2):
        heads = Catalogue(folder).heads()
        assert isinstance(heads, HeadIndex)
        expected = every_head(folder)
        assert len(heads) == len(expected)
        assert sorted(map(str, heads.unusable)) == sorted(map(str, expected.unusable))
        for query in (NEAR, Query(), Query(ids=("*red*",)), *queries):
            assert heads.select(query) == expected.select(query), query
        new_process()


def some_query(draw):
    """Draw a query of any filters and order."""
    chosen = {
        "ids": [("*red*",), ("paint-1/*", "*VIOLET*"), ("*-?",), ("*[2-4]?",), ("*%*",), ("*_*",), ("*[!a-z]",)],
        "families": [("PAINT-?",), ("lamp", "paint-2"), ("none",)],
        "models": [("lambert",), ("emission", "m*"), ("*\\*",)],
        "kinds": [("uplifted",), ("measured", "analytic")],
        "quantities": [("emission",), ("ref*", "transmittance")],
        "max_error": [0.01, 0.03],
        "coloured": [True, False],
        "limit": [0, 1, 4, 1000],
    }
    asked = {name: draw.choice(values) for name, values in chosen.items() if draw.random() < 0.3}
    if draw.random() < 0.5:
        formula = draw.choice(["CIE 1994", "CIE 2000"])
        asked |= {"near": draw.choice([(52.0, 31.0, 18.0), (50.0, 0.0, 0.0)]), "formula": formula}
        asked |= {"within": draw.choice([0.5, 30.0])} if draw.random() < 0.5 else {}
    if draw.random() < 0.7:
        keys = [key for key in SORT_KEYS if key != "near" or "near" in asked]
        asked |= {"sort": draw.choice(keys), "reverse": draw.random() < 0.5}
    return Query(**asked)


def test_any_query_is_answered_as_every_head_answers_it(folder):
    """Of uplifted, colourless, equal and unusable ones too, before and after some have changed."""
    for number, changes in enumerate(
        (
            {"kind": "uplifted(smits)", "error": None},
            {"model": "emission", "quantity": "emission", "colour": None, "terms": []},
            {"model": "transmittance", "quantity": "transmittance", **lab(52.0, 31.0, 18.0)},
            {"id": "paint-1/x7", **lab(50.0, 0.0, 0.0)},
            {"id": "paint-1/x07", **lab(50.0, 0.0, 0.0)},
            {"id": "deep/er/Größe 2%_", "model": "m\\o", **lab(50.0, 0.0, 0.0)},
            {"id": "paint-1/another"},
        ),
        100,
    ):
        write(folder, number, **changes)
    (folder / "paint-1" / "broken.h5").write_bytes(b"nothing")
    material_path(folder, "paint-1/another").rename(folder / "paint-1" / "renamed.h5")
    draw = random.Random(3)
    queries = [
        *(Query(ids=(pattern,), limit=1, reverse=True) for pattern in ("*%*", "*%_", "*[!a-z0-9]", "*?GRÖSSE*")),
        *(replace(NEAR, reverse=True, formula=formula) for formula in ("CIE 1994", "CIE 2000")),
        *(some_query(draw) for _ in range(50)),
    ]
    check(folder, *queries)
    write(folder, 3, **lab(52.0, 31.0, 17.0))
    write(folder, 14, model="ggx")
    (folder / "paint-2" / f"{made.head(25, NEAR.near)['id'].partition('/')[2]}.h5").unlink()
    at_rest()
    check(folder, *queries)


def test_few_materials_take_no_index(tmp_path):
    made.generated(tmp_path / "catalogue", 9)
    assert len(Catalogue(tmp_path / "catalogue").heads()) == 9
    assert not (tmp_path / "catalogue" / FOLDER).exists() and not (tmp_path / "cache" / "metamer").exists()


@pytest.mark.parametrize("what", ["state cut", "state flipped", "table cut", "table flipped", "table gone", "all gone"])
def test_an_index_that_is_not_what_was_written_is_made_anew(folder, what):
    check(folder)
    name, _, how = what.partition(" ")
    files = {"state": folder / FOLDER / "state", "table": next((folder / FOLDER).glob("*.parquet"))}
    if name == "all":
        shutil.rmtree(folder / FOLDER)
    elif how == "gone":
        files[name].unlink()
    else:
        data = bytearray(files[name].read_bytes())
        data[len(data) // 2] ^= 4
        files[name].write_bytes(data[: len(data) // 3] if how == "cut" else data)
    check(folder)
    assert head_index._Known.read(folder / FOLDER).rows == 40


def test_a_row_that_somebody_has_edited_is_not_believed(folder):
    check(folder)
    nearest = every_head(folder).select(NEAR)[0]
    write(folder, int(nearest.id.rpartition("-")[2]), **lab(52.0, 31.0, 18.0))
    check(folder)
    state = folder / FOLDER / "state"
    text = state.read_bytes()
    assert text.count(b"52.0,") == 1
    state.write_bytes(text.replace(b"52.0,", b"99.0,"))
    check(folder)


def test_an_index_of_another_version_is_made_anew_and_what_a_kill_left_is_cleared_away(folder, monkeypatch):
    with monkeypatch.context() as other:
        other.setattr(head_index, "_VERSION", 0)
        check(folder)
    strays = [folder / FOLDER / name for name in (".state.0123abcd", f".{'0' * 64}.0123abcd.parquet")]
    for stray in strays:
        stray.write_bytes(b"half")
    check(folder)
    assert not any(stray.exists() for stray in strays)


def test_a_table_that_goes_while_it_is_open_is_made_anew(folder):
    heads = Catalogue(folder).heads()
    shutil.rmtree(folder / FOLDER)
    assert heads.select(NEAR) == every_head(folder).select(NEAR)
    check(folder)


@pytest.mark.parametrize("change", ["written", "added", "added below", "removed", "folder removed", "folder renamed"])
def test_what_changes_below_is_seen(folder, change):
    check(folder)
    nearest = every_head(folder).select(NEAR)[0]
    if change == "written":
        write(folder, 20, **lab(52.0, 31.0, 18.0))
    elif change == "added":
        write(folder, 200, id="paint-1/new", **lab(52.0, 31.0, 18.0))
    elif change == "added below":
        (folder / "paint-1" / "deep").mkdir()
        write(folder, 200, id="paint-1/deep/new", **lab(52.0, 31.0, 18.0))
    elif change == "removed":
        nearest.file.unlink()
    elif change == "folder removed":
        shutil.rmtree(nearest.file.parent)
    else:
        nearest.file.parent.rename(folder / "elsewhere")
    check(folder)
    assert ids(Catalogue(folder).query(NEAR, unusable=[]))[0] != nearest.id
    at_rest()
    check(folder)


def test_one_change_reads_one_head_and_lists_one_folder(folder, monkeypatch):
    check(folder)
    at_rest()
    check(folder)
    read, listed = [], []
    summary, names = head_index.summary, head_index._listed
    monkeypatch.setattr(head_index, "summary", lambda *words: read.append(words[0]) or summary(*words))
    monkeypatch.setattr(head_index, "_listed", lambda *words: listed.append(words[1]) or names(*words))
    heads = Catalogue(folder).heads()
    assert (read, listed) == ([], [])
    assert len(heads.select(NEAR)) == len(read) == 5
    written = made.head(20, NEAR.near)["id"]
    write(folder, 20)
    read.clear()
    Catalogue(folder).heads()
    assert (read, listed) == ([written], ["paint-1"])


def test_many_changes_are_written_into_the_table(folder, monkeypatch):
    check(folder)
    (before,) = (folder / FOLDER).glob("*.parquet")
    monkeypatch.setattr(head_index, "_FEW", 2)
    for number in (1, 2, 30):
        write(folder, number)
        check(folder)
    (after,) = (folder / FOLDER).glob("*.parquet")
    known = head_index._Known.read(folder / FOLDER)
    assert after != before and len(known.changed) < 3
    write(folder, 31)
    material_path(folder, made.head(5, NEAR.near)["id"]).unlink()
    check(folder)


def test_an_answer_that_was_edited_in_place_is_read_again(folder):
    """Its folder shows nothing, its own time does."""
    check(folder)
    at_rest()
    check(folder)
    heads = Catalogue(folder).heads()
    nearest = heads.select(NEAR)[0]
    head = json.loads(nearest.file.read_bytes().partition(b"\n")[0]) | lab(5.0, 0.0, 0.0)
    nearest.file.write_bytes(head_bytes(head, nearest.file))
    assert heads.select(NEAR) == every_head(folder).select(NEAR) and nearest.id not in ids(heads.select(NEAR))


def test_an_answer_that_was_damaged_behind_its_time_is_said(folder):
    check(folder)
    nearest = every_head(folder).select(NEAR)[0]
    stood = nearest.file.stat()
    nearest.file.write_bytes(bytes(stood.st_size))
    os.utime(nearest.file, ns=(stood.st_atime_ns, stood.st_mtime_ns))
    heads = Catalogue(folder).heads()
    assert heads.select(NEAR) == every_head(folder).select(NEAR)
    assert nearest.file.name in str(heads.unusable[0]) and len(heads.unusable) == 1


def test_what_is_too_young_to_tell_is_read_again(folder, monkeypatch):
    """A file that is written twice within a tick shows one time."""
    monkeypatch.setattr(head_index, "TICK_NS", 10**12)
    path = write(folder, 20, **lab(5.0, -60.0, 60.0))
    stood = path.stat()
    check(folder)
    path.write_bytes(head_bytes(made.head(20, (52.0, 31.0, 18.0)), path))
    os.utime(path, ns=(stood.st_atime_ns, stood.st_mtime_ns))
    assert path.stat().st_size == stood.st_size
    check(folder)


@pytest.mark.slow
@pytest.mark.parametrize("tick_ns", [0, 10**12], ids=["nothing is too young", "all is too young"])
def test_a_table_that_is_written_anew_loses_no_row(folder, monkeypatch, tick_ns):
    """Rows beside the table that hold no more leave their numbers to others."""
    monkeypatch.setattr(head_index, "TICK_NS", tick_ns)
    monkeypatch.setattr(head_index, "_FEW", 4)
    check(folder)
    for number in (1, 2, 30, 14, 1, 5, 5, 31, 2, 100, 101, 30):
        write(folder, number)
        check(folder)


@pytest.mark.parametrize("changes", [{"model": "\ud800"}, {"terms": [[10**30, "hd"]]}, lab(float("nan"), 1.0, 2.0)])
def test_what_no_table_holds_is_found_all_the_same(folder, changes):
    path = write(folder, 20)
    head = made.head(20, NEAR.near) | changes
    path.write_bytes(json.dumps(head).encode().ljust(HEAD_BYTES - 1) + b"\n")
    name = head["id"]
    for query in (Query(ids=(name,)), Query(ids=(name, "paint-0/*"), sort="terms")):
        heads, expected = Catalogue(folder).heads(), every_head(folder).select(query)
        found = heads.select(query)
        assert head_index._Known.read(folder / FOLDER).apart == {name} and isinstance(heads, HeadIndex)
        assert list(map(repr, found)) == list(map(repr, expected)) and name in ids(found)


def test_where_the_catalogue_cannot_be_written_to_the_cache_of_the_user_has_the_index(folder, tmp_path, monkeypatch):
    (folder / FOLDER).write_bytes(b"in the way of a folder")
    check(folder)
    assert len(list((tmp_path / "cache").rglob("*.parquet"))) == 1
    monkeypatch.setattr(HeadIndex, "_write_table", None)
    check(folder)


def test_on_a_full_disk_every_head_is_read_and_nothing_half_stays(folder, room_for):
    said = []
    with room_for(100):
        heads = Catalogue(folder).heads(said.append)
        assert heads.select(NEAR) == every_head(folder).select(NEAR) and not isinstance(heads, HeadIndex)
    assert "one by one" in said[-1] and "catalogue" in said[-1]
    assert not [
        path for path in folder.rglob("*") if path.name != "catalogue.toml" and path.suffix != SUFFIX and path.is_file()
    ]
    check(folder)


def test_a_change_is_seen_on_a_full_disk(folder, room_for):
    check(folder)
    write(folder, 20, **lab(52.0, 31.0, 18.0))
    with room_for(100):
        check(folder)
    check(folder)


def test_an_index_that_another_process_writes_is_not_waited_for(folder, tmp_path):
    (folder / FOLDER).mkdir()
    with alone_at_work(folder / FOLDER, "somebody else"):
        check(folder)
    assert not list((folder / FOLDER).iterdir()) and list((tmp_path / "cache").rglob("*.parquet"))


def test_a_catalogue_is_called_as_it_is_called_now(folder, monkeypatch):
    """Of one process, by two paths, one of which a change of the working folder ends."""
    monkeypatch.chdir(folder.parent)
    for called in (folder, type(folder)(folder.name), folder):
        found = Catalogue(called).heads().select(NEAR)
        assert found == every_head(called).select(NEAR) and found[0].path.startswith("/") == (called == folder)
    monkeypatch.chdir("/")
    assert Catalogue(folder).heads().select(NEAR) == every_head(folder).select(NEAR)


@pytest.mark.stress
def test_a_kill_at_any_moment_leaves_nothing_that_is_believed(tmp_path):
    folder = made.generated(tmp_path / "catalogue", 400)
    for number, wait_s in enumerate(np.linspace(0.0, 0.5, 8)):
        if number % 2:
            shutil.rmtree(folder / FOLDER, ignore_errors=True)
        write(folder, number, **lab(52.0, 31.0, 18.0 + number))
        process = subprocess.Popen([sys.executable, "-c", INDEXING, folder], stdout=subprocess.PIPE, text=True)
        assert process.stdout.readline() == "begun\n"
        time.sleep(wait_s)
        process.kill()
        process.communicate(timeout=patient(50))
        check(folder)
        assert {path.suffix for path in (folder / FOLDER).iterdir()} == {"", ".parquet"}


def test_two_processes_that_index_at_once_both_answer(tmp_path):
    folder = made.generated(tmp_path / "catalogue", 300)
    words = [sys.executable, "-c", INDEXING, folder]
    both = [subprocess.Popen(words, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    expected = [ids(every_head(folder).select(query)) for query in made.QUERIES.values()]
    for one in both:
        assert json.loads(one.communicate(timeout=patient(50))[0].splitlines()[1]) == expected and one.returncode == 0
    check(folder)


def test_without_duckdb_every_head_is_read_with_a_word(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "duckdb", None)
    said = []
    heads = Catalogue(folder).heads(said.append)
    assert heads.select(NEAR) == every_head(folder).select(NEAR) and not (folder / FOLDER).exists()
    assert len(said) == 1 and "extra `index`" in said[0]


def test_neighbours_are_the_same(tmp_path, write_matt, write_spectrum, monkeypatch):
    for number in range(9):
        write_matt(tmp_path, f"paint/grey-{number}", 0.05 + 0.1 * number)
    write_spectrum(tmp_path, "lamp/led")
    write_spectrum(tmp_path, "glass/clear", "transmittance")
    catalogue = Catalogue.open(tmp_path)
    monkeypatch.setattr("metamer.materials.search.neighbours._FIRST", 2)
    with_index = like(catalogue, "paint/grey-4", {"lighter": 10})
    assert (tmp_path / FOLDER).exists()
    shutil.rmtree(tmp_path / FOLDER)
    monkeypatch.setattr(head_index, "WORTH", 1000)
    without = like(catalogue, "paint/grey-4", {"lighter": 10})
    assert [(one.summary, one.distance) for one in with_index.found] == [(o.summary, o.distance) for o in without.found]
    assert len(without.found) > 2 and without.left_out == with_index.left_out and len(without.left_out) == 2
