"""Cost of an import: it is known before it is begun, and what cannot fit into memory is refused in numbers."""

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.formats import merl
from metamer.materials.formats.registry import format_for, reading_cost
from metamer.materials.intake import import_cost, import_plan
from metamer.materials.intake.import_cost import Jobs, fit_too_large, jobs_for
from metamer.materials.intake.importing import import_sources
from metamer.spectral.formats.exr import write_exr

SPECTRA = "wavelength_nm,red\n400,0.1\n500,0.2\n600,0.7\n700,0.8\n"
GREY = 'family = "grey"\nkind = "analytic"\n[[material]]\nname = "grey"\nmodel = "lambert"\n'
GIGA = 10**9


@pytest.fixture
def free(monkeypatch):
    """Sets the memory that is free, in bytes, and the cores."""

    def there_are(size, cores=4):
        monkeypatch.setattr(import_cost, "available_bytes", lambda: size)
        monkeypatch.setattr(import_cost, "usable_cores", lambda: cores)

    return there_are


@pytest.fixture
def source(tmp_path):
    folder = tmp_path / "source"
    folder.mkdir()
    (folder / "grey.toml").write_text(GREY + "reflectance = { constant = 0.5 }\n")
    return folder


def picture(path, size):
    pixels = np.full((size, size), 0.5, np.float32)
    names = [f"S0.{400 + 20 * number},000000nm" for number in range(16)]
    write_exr(path, {"spectralLayoutVersion": "1.0"}, dict.fromkeys(names, pixels))
    return path


def test_a_picture_costs_what_its_header_counts_however_small_the_file(tmp_path):
    path = picture(tmp_path / "flat.exr", 256)
    told = reading_cost(format_for(path), path)
    assert path.stat().st_size < 256 * 256 * 16 and told.bytes > 30 * 256 * 256 * 16


@pytest.mark.parametrize(("name", "least"), [("a.csv", 10), ("a.brdf", 10), ("a.binary", 8), ("a.bsdf", 3)])
def test_files_cost_several_times_their_size(tmp_path, name, least):
    path = tmp_path / name
    path.write_text(SPECTRA * 100)
    told = reading_cost(format_for(path, named=True), path)
    assert least * path.stat().st_size <= told.bytes <= 15 * path.stat().st_size and told.seconds > 0


def test_what_memory_does_not_hold_is_refused_before_it_is_read_and_the_others_go_on(
    source, tmp_path, free, monkeypatch
):
    path = picture(source / "huge.exr", 32)
    free(3 * GIGA)
    monkeypatch.setattr("metamer.materials.formats.reading_cost.samples_in", lambda path: 10**9)
    read = []
    whole = import_plan.read_with
    monkeypatch.setattr(
        import_plan, "read_with", lambda reader, path, *words: (read.append(path.name), whole(reader, path, *words))[1]
    )
    report = import_sources([source], tmp_path / "cat", jobs=1)
    (failed,) = (one for one in report.outcomes if one.status == "failed")
    assert "huge.exr" not in read and failed.file == str(path)
    for words in ("huge.exr", "42 GB", "3 GB", "try:"):
        assert words in failed.reason, failed.reason
    assert Catalogue.open(tmp_path / "cat").ids() == ("grey/grey",)


def test_a_refusal_for_want_of_memory_is_not_remembered(source, tmp_path, free, monkeypatch):
    picture(source / "some.exr", 8)
    free(3 * GIGA)
    monkeypatch.setattr("metamer.materials.formats.reading_cost.samples_in", lambda path: 10**9)
    assert import_sources([source], tmp_path / "cat", jobs=1).count("failed") == 1
    free(300 * GIGA)
    assert import_sources([source], tmp_path / "cat", jobs=1).count("failed") == 0


def test_a_fit_that_memory_does_not_hold_is_refused(free):
    free(3 * GIGA)
    refusal = fit_too_large(GIGA, "big.bsdf", "measured/big")
    assert refusal is not None
    for words in ("big.bsdf", "measured/big", "6.63 GB", "3 GB"):
        assert words in str(refusal), refusal


@pytest.mark.parametrize("size", [1000, 40 << 20])
def test_small_materials_are_never_refused(free, size):
    """A system that is short of memory makes room for so much."""
    free(1000)
    assert fit_too_large(size, "a.csv", "a/a") is None


def test_a_fit_that_is_refused_does_not_stop_the_others(source, tmp_path, free, monkeypatch):
    free(3 * GIGA)
    (source / "chart.csv").write_text(SPECTRA.replace("wavelength_nm,red", "wavelength_nm,reflectance of red"))
    plain = import_cost.fit_too_large
    monkeypatch.setattr(
        "metamer.materials.intake.importing.fit_too_large",
        lambda size, name, material_id: plain(GIGA if material_id == "grey/grey" else size, name, material_id),
    )
    report = import_sources([source], tmp_path / "cat", jobs=1)
    assert {one.id: one.status for one in report.outcomes}["grey/grey"] == "failed" and report.count("imported") == 1


@pytest.mark.parametrize(
    ("wanted", "free_bytes", "cores", "count"),
    [(None, 10 * GIGA, 4, 4), (None, 1.5 * GIGA, 4, 2), (None, 10, 4, 1), (None, None, 4, 4), (8, 10, 4, 8)],
)
def test_as_many_processes_as_memory_holds(free, wanted, free_bytes, cores, count):
    """Unless somebody asks for more; and fewer are explained in numbers."""
    free(free_bytes if free_bytes is None else int(free_bytes), cores)
    found = jobs_for([1000] * 20, wanted)
    assert found.count == count
    assert bool(found.why) == (wanted is None and count < cores)
    if found.why:
        assert f"{count} at a time instead of {cores}" in found.why and "0.6" in found.why


def test_no_more_processes_than_materials(free):
    free(None)
    assert jobs_for([1, 1], None) == Jobs(2) and jobs_for([], None) == Jobs(0)


def test_reading_a_large_file_is_told_of_before(source, tmp_path, monkeypatch):
    (source / "gold.binary").write_bytes(b"no table")
    monkeypatch.setattr(merl, "reading_cost", lambda path: import_cost.ReadingCost(1000, 42.0))
    heard = []
    import_sources([source], tmp_path / "cat", jobs=1, doing=lambda name, doing: heard.append((name, doing.phase)))
    name, phase = heard[0]
    assert name.endswith("gold.binary") and phase.startswith("reading") and "about 42 s" in phase
