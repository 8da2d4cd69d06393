"""A catalogue holds what it says, or `verify` says what does not."""

import os
from dataclasses import replace

import h5py
import numpy as np
import pytest
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.core.protocol import measured
from metamer.materials.records import verification
from metamer.materials.records.record import read_record, write_record
from metamer.materials.records.verification import TOLERANCE, verify_catalogue, verify_material
from metamer.runtime.errors import InputError
from metamer.spectral.bispectral import Bispectral


def by_id(found):
    return {one.id: one for one in found.results}


def declare(path, **changes):
    record = read_record(path)
    write_record(replace(record, fast=replace(record.fast, error=replace(record.error, **changes))), path)


@pytest.fixture
def folder(tmp_path, write_matt, write_spectrum):
    for name, reflectance in (("paint/dark", 0.1), ("paint/light", 0.8)):
        write_matt(tmp_path, name, reflectance)
    # Packs that are off: a matt 0.5 shown as 0.52, honestly declared.
    write_matt(tmp_path, "paint/off", 0.5, shown=np.full(81, 0.52))
    write_spectrum(tmp_path, "lamp/led")
    return tmp_path


def test_intact_catalogue_holds_and_its_errors_are_measured(folder):
    found = verify_catalogue(folder, jobs=1)
    assert [one.id for one in found.results] == ["lamp/led", "paint/dark", "paint/light", "paint/off"]
    assert found.damaged == () and found.strays == ()
    off = by_id(found)["paint/off"]
    assert off.measured.p99 == pytest.approx(off.declared.p99, abs=1e-9) and off.measured.p99 > 0.5
    assert by_id(found)["lamp/led"].measured is None


@pytest.mark.parametrize("figure", ["mean", "p95", "p99", "maximum"])
@pytest.mark.parametrize("by", [-2.0, 2.0])
def test_error_that_was_declared_wrong_is_found(folder, figure, by):
    """Too small flatters; too large hides what the fit can do. Either is no measurement."""
    path = folder / "paint" / "off.h5"
    declare(path, **{figure: getattr(read_record(path).error, figure) + by * TOLERANCE})
    one = verify_material("paint/off", path)
    assert one.problem is not None and f"{figure} " in str(one.problem) and "does not hold" in str(one.problem)
    assert verify_material("paint/off", path, quick=True).problem is None


def test_error_within_the_tolerance_holds(folder):
    path = folder / "paint" / "off.h5"
    declare(path, p99=read_record(path).error.p99 + 0.5 * TOLERANCE)
    assert verify_material("paint/off", path).problem is None


def test_error_that_is_no_number_does_not_hold(folder):
    path = folder / "paint" / "off.h5"
    declare(path, p99=float("nan"))
    assert "p99" in str(verify_material("paint/off", path).problem)


def test_error_by_another_protocol_is_said_not_judged(folder):
    path = folder / "paint" / "off.h5"
    declare(path, protocol="a photograph", p99=9.0)
    one = verify_material("paint/off", path)
    assert one.problem is None and one.measured is None and "a photograph" in one.note


def test_changed_content_and_wrong_name_are_found(folder):
    with h5py.File(folder / "paint" / "dark.h5", "r+") as file:
        text = bytes(file["packed"][:])
        file["packed"][...] = np.frombuffer(text.replace(b"0.1,", b"0.2,", 1), np.uint8)
    (folder / "paint" / "light.h5").rename(folder / "paint" / "lihgt.h5")
    for quick in (True, False):
        found = by_id(verify_catalogue(folder, quick=quick, jobs=1))
        assert "content has changed" in str(found["paint/dark"].problem)
        assert "another material" in str(found["paint/lihgt"].problem)


def test_half_written_files_are_reported_and_do_no_harm(folder):
    strays = ("..writable.89abcdef", ".red.0123abcd.h5", ".writable")
    for name in strays:
        (folder / "paint" / name).write_bytes(b"")
    (folder / ".hidden").write_bytes(b"")
    found = verify_catalogue(folder, quick=True, jobs=1)
    assert tuple(path.name for path in found.strays) == strays
    assert found.damaged == ()


@pytest.mark.slow
def test_several_processes_find_the_same(folder):
    (folder / "paint" / "dark.h5").write_bytes(b"")
    for name in range(12):
        (folder / "paint" / f"empty-{name}.h5").write_bytes(b"")
    seen = []
    found = verify_catalogue(folder, jobs=2, progress=lambda *what: seen.append(what))
    assert len(found.damaged) == 13 and [done for done, _, _ in seen] == list(range(1, 17))
    alone = verify_catalogue(folder, jobs=1)
    assert [one.measured for one in found.results] == [one.measured for one in alone.results]


def test_fluorescent_surface_is_measured_with_its_emission(tmp_path, write_matt):
    matrix = np.diag(np.full(40, 0.4))
    matrix[20:28, :4] += 0.05
    surface = FluorescentLambert(Bispectral(np.arange(380.0, 780.0, 10.0), np.arange(380.0, 780.0, 10.0), matrix))
    fast = measured(surface.own_form(), surface, 32)
    changes = {"model": surface.NAME, "parameters": surface.parameters(), "fast": fast}
    one = verify_material("x/f", write_matt(tmp_path, "x/f", **changes))
    assert one.problem is None and one.measured.p99 == pytest.approx(fast.error.p99, abs=1e-6)
    (pack,) = fast.packs
    dimmer = replace(fast, packs=(pack.recoloured(0.9 * pack.palette.values[0]),))
    one = verify_material("x/f", write_matt(tmp_path, "x/f", **(changes | {"fast": dimmer})))
    assert "does not hold" in str(one.problem)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_workers_of_a_cluster_find_the_same(tmp_path, write_matt):
    distributed = pytest.importorskip("distributed")
    write_matt(tmp_path / "cat", "paint/dark", 0.1)
    damaged = write_matt(tmp_path / "cat", "paint/light", 0.8)
    damaged.write_bytes(damaged.read_bytes()[:-200] + bytes(200))
    here = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "silence_logs": 50}
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, **here) as workers:
        away = verify_catalogue(tmp_path / "cat", scheduler=workers.scheduler_address)
    home = verify_catalogue(tmp_path / "cat", jobs=1)
    assert [one.id for one in away.damaged] == ["paint/light"] and [one.id for one in away.intact] == ["paint/dark"]
    assert [replace(one, problem=None) for one in away.results] == [replace(one, problem=None) for one in home.results]
    assert str(away.damaged[0].problem) == str(home.damaged[0].problem)


def test_a_worker_that_sees_another_file_is_refused(tmp_path, write_matt):
    """A catalogue of its own in the same place would be found intact."""
    path = write_matt(tmp_path / "cat", "paint/dark", 0.1)
    state = verification._state(path)
    assert verification._verify_the_same("paint/dark", path, True, state).problem is None
    os.utime(path, ns=(state[1] + 1, state[1] + 1))
    with pytest.raises(InputError, match=r"(?s)does not find the file that is here.*another file on .*file system"):
        verification._verify_the_same("paint/dark", path, True, state)
    path.unlink()
    with pytest.raises(InputError, match="none on "):
        verification._verify_the_same("paint/dark", path, True, state)
