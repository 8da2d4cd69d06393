"""`metamer catalogue verify` and `diff`: words, figures, exit codes."""

import inspect
import json
from dataclasses import replace

import numpy as np
import pytest
from metamer.cli.options import add_lights_options
from metamer.cli.parser import parser
from metamer.materials.catalogue.compare import ILLUMINANTS, compare_catalogues
from metamer.materials.records.record import read_record, write_record
from metamer.materials.records.stored_array import StoredArray


@pytest.fixture
def folder(tmp_path, write_matt, write_spectrum):
    write_matt(tmp_path / "a", "paint/dark", 0.1)
    write_matt(tmp_path / "a", "paint/light", 0.8)
    write_spectrum(tmp_path / "a", "lamp/led")
    return tmp_path / "a"


@pytest.fixture
def other(tmp_path, write_matt, write_spectrum, folder):
    write_matt(tmp_path / "b", "paint/dark", 0.1)
    write_matt(tmp_path / "b", "paint/light", 0.75)
    write_matt(tmp_path / "b", "paint/new", 0.3)
    return tmp_path / "b"


def test_verify_says_what_holds(metamer, folder):
    code, out, _ = metamer("catalogue", "verify", folder, "--jobs", 1)
    assert code == 0 and "2 errors measured again; they hold" in out and "3 materials intact, 0 damaged" in out
    code, out, _ = metamer("catalogue", "verify", folder, "--quick")
    assert code == 0 and "measured" not in out and "3 materials intact" in out


def test_verify_counts_one_as_one(metamer, tmp_path, write_matt):
    write_matt(tmp_path / "one", "paint/dark", 0.1)
    out = metamer("catalogue", "verify", tmp_path / "one")[1]
    assert "1 error measured again; it holds where both agree within" in out and "1 material intact, 0 damaged" in out


def test_how_far_it_is_stands_on_standard_error(metamer, folder):
    _, out, err = metamer("catalogue", "verify", folder, "--quick", "--jobs", 1)
    assert "Verifying: 3/3" in err and "Verifying" not in out


def test_verify_finds_a_false_error_and_quick_does_not_look(metamer, folder):
    path = folder / "paint" / "dark.h5"
    record = read_record(path)
    write_record(
        replace(record, fast=replace(record.fast, error=replace(record.error, p99=record.error.p99 + 0.1))), path
    )
    code, out, _ = metamer("catalogue", "verify", folder, "--jobs", 1)
    assert code == 4 and "dark.h5: error: the declared error does not hold" in out and "1 damaged" in out
    assert metamer("catalogue", "verify", folder, "--quick")[0] == 0
    code, out, _ = metamer("catalogue", "verify", folder, "--json", "-", "--jobs", 1)
    assert code == 4
    (dark,) = [one for one in json.loads(out)["materials"] if one["id"] == "paint/dark"]
    assert dark["declared"]["p99"] == pytest.approx(dark["measured"]["p99"] + 0.1) and "hold" in dark["problem"]


def test_verify_counts_apart_whose_original_is_gone(metamer, folder, tmp_path):
    stack = tmp_path / "scans" / "stack.raw"
    stack.parent.mkdir()
    stack.write_bytes(np.random.default_rng(0).random((40, 50, 60)).tobytes())
    path = folder / "paint" / "dark.h5"
    outside = StoredArray(stack, 0, (40, 50, 60), np.dtype("f8"))
    write_record(replace(read_record(path), original={"stack": outside}), path, copy=False)
    code, out, _ = metamer("catalogue", "verify", folder, "--quick")
    assert code == 0 and "3 materials intact, 0 damaged" in out
    stack.unlink()
    for words in ((), ("--quick",)):
        code, out, _ = metamer("catalogue", "verify", folder, "--jobs", 1, *words)
        assert code == 1 and "2 materials intact, 1 without their originals, which are gone, 0 damaged" in out
        assert f"paint/dark: error not measured: large arrays were left in a file that is gone: {stack}" in out
    code, out, _ = metamer("catalogue", "verify", folder, "--quick", "--json", "-")
    missing = {one["id"]: one["missing"] for one in json.loads(out)["materials"]}
    assert code == 1 and missing == {"lamp/led": None, "paint/dark": str(stack), "paint/light": None}
    # Damage weighs more.
    (folder / "paint" / "light.h5").write_bytes(b"no more")
    code, out, _ = metamer("catalogue", "verify", folder, "--quick")
    assert code == 4 and "1 material intact, 1 without" in out and "1 damaged" in out


def test_verify_reports_what_a_killed_writer_left(metamer, folder):
    (folder / "paint" / ".dark.0a1b2c3d.h5").write_bytes(b"half")
    code, out, _ = metamer("catalogue", "verify", folder, "--quick")
    assert code == 0 and ".dark.0a1b2c3d.h5: left behind" in out


def test_diff_of_catalogues(metamer, folder, other):
    code, out, _ = metamer("catalogue", "diff", folder, other, "--jobs", 1)
    assert code == 0
    assert "added: paint/new" in out and "removed: lamp/led" in out
    assert "1 changed, 1 same, 1 added, 1 removed" in out
    assert "fast forms of B against those of A, the reference" in out and "under D65, A, FL11" in out


def test_diff_counts_what_looks_the_same_and_lists_what_does_not(metamer, folder, other):
    path = other / "paint" / "dark.h5"
    record = read_record(path)
    write_record(replace(record, provenance=replace(record.provenance, notes="measured again")), path)
    code, out, _ = metamer("catalogue", "diff", folder, other, "--jobs", 1)
    assert code == 0 and "paint/light" in out and "paint/dark" not in out
    assert "2 changed" in out and "1 of the changed ones look the same" in out


def test_diff_fails_over_a_limit(metamer, folder, other):
    code, out, _ = metamer("catalogue", "diff", folder, other, "--jobs", 1, "--fail", "0.5", "--illuminants", "A")
    assert code == 2 and "over ΔE94 0.5" in out
    assert metamer("catalogue", "diff", folder, other, "--jobs", 1, "--fail", "50")[0] == 0
    assert metamer("catalogue", "diff", folder, folder, "--fail", "0.001")[0] == 0


def test_diff_json(metamer, folder, other):
    code, out, _ = metamer("catalogue", "diff", folder, other, "--jobs", 1, "--json", "-", "--of", "original")
    document = json.loads(out)
    assert code == 0 and document["of"] == "original" and "original data of B" in document["protocol"]
    changed = {one["id"]: one for one in document["differences"]}["paint/light"]
    assert [light["light"] for light in changed["lights"]] == ["D65", "A", "FL11"]
    assert document["largest"] == max(light["p99"] for light in changed["lights"])


@pytest.mark.parametrize("words", [("verify", "{a}", "--json", "-"), ("diff", "{a}", "{b}", "--json", "-")])
def test_a_program_is_not_told_how_far_it_is(metamer, folder, other, words):
    _, out, err = metamer("catalogue", *(word.format(a=folder, b=other) for word in words), "--jobs", 1)
    assert json.loads(out) and err == ""


def test_diff_takes_the_lights_of_the_comparison_by_default():
    """Repeated so that `--help` need not wait for it."""
    args = parser().parse_args(["catalogue", "diff", "a", "b"])
    takes = inspect.signature(compare_catalogues).parameters
    assert args.illuminants == takes["illuminants"].default == ILLUMINANTS
    assert (args.observer, args.of) == (takes["observer_name"].default, takes["of"].default)
    words = inspect.getsource(add_lights_options)
    assert f"default: {','.join(ILLUMINANTS)}" in words and f"default: {args.observer}" in words


def test_diff_of_two_materials_by_file_and_by_id(metamer, folder, other):
    code, out, _ = metamer("catalogue", "diff", folder / "paint" / "light.h5", other / "paint" / "light.h5")
    assert code == 0 and "paint/light" in out and "1 changed" in out
    code, out, _ = metamer("catalogue", "diff", "paint/light", "paint/dark", "--catalogue", folder)
    lines = [line.split() for line in out.splitlines() if line.startswith("paint/light -> paint/dark")]
    assert code == 0 and [line[3] for line in lines] == ["D65", "A", "FL11"]


def test_diff_of_what_cannot_be_compared(metamer, folder, tmp_path, write_matt):
    code, out, _ = metamer("catalogue", "diff", "paint/light", "lamp/led", "--catalogue", folder)
    assert code == 3 and "not comparable: paint/light -> lamp/led: reflectance -> emission" in out
    write_matt(tmp_path / "c", "x/y")
    code, out, _ = metamer("catalogue", "diff", folder, tmp_path / "c")
    assert code == 3 and "0 changed, 0 same, 1 added, 3 removed" in out


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("paint/lihgt", "paint/dark"), 4, "nearest: paint/light"),
        (("{a}", "paint/dark"), 64, "is a folder and the other side is not"),
        (("{a}", "{a}/paint"), 4, "not a catalogue"),
        (("{a}", "{a}", "--illuminants", "D66"), 64, "unknown illuminant"),
        (("{a}", "{a}", "--observer", "1932"), 64, "unknown observer"),
    ],
)
def test_diff_of_wrong_words(metamer, folder, words, code, said):
    where = [word.format(a=folder) for word in words]
    found, _, err = metamer("catalogue", "diff", *where, "--catalogue", folder)
    assert found == code and said in err


def test_diff_goes_on_past_a_damaged_file(metamer, folder, other):
    (other / "paint" / "light.h5").write_bytes(b"")
    code, out, _ = metamer("catalogue", "diff", folder, other, "--jobs", 1)
    assert code == 4 and "unusable: paint/light" in out and "light.h5" in out and "1 same" in out
