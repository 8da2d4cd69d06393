"""Environment forms in material files: kept with their error, shown, verified and compared; files without stay good."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.cli.main import main
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.catalogue.compare import compare_records
from metamer.materials.core.protocol import measured
from metamer.materials.intake.code_version import modules_of
from metamer.materials.records.record import read_record, write_record
from metamer.materials.records.verification import verify_material
from metamer.materials.slices.fit import view_slices
from metamer.spectral.bispectral import Bispectral


@pytest.fixture
def matt(write_matt, tmp_path):
    """A matt material with its environment form, and the file that holds it."""
    path = write_matt(tmp_path / "cat", "tiny/grey", 0.5)
    record = read_record(path)
    record = replace(record, fast=record.fast.with_slices_of(record.surface(), 0.5))
    write_record(record, path)
    return record, path


def test_a_file_keeps_the_form_and_its_error(matt):
    record, path = matt
    again = read_record(path)
    assert again.environment_error == record.environment_error and again.environment_error is not None
    for name in ("directions", "sharpness", "value"):
        assert np.array_equal(getattr(again.fast.slices, name), getattr(record.fast.slices, name))
    assert len(again.fast.packs) == len(record.fast.packs) == 1
    assert again.fast.environment_form() is again.fast.slices


def test_equal_forms_are_equal_bytes(matt, tmp_path):
    record, path = matt
    write_record(replace(record, fast=record.fast.with_slices_of(record.surface(), 0.5)), tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == path.read_bytes()


def test_a_file_without_a_form_is_read_and_one_is_worked_out(write_matt, tmp_path):
    path = write_matt(tmp_path, "tiny/old", 0.5)
    record = read_record(path)
    assert record.environment_error is None and record.fast.slices is None
    assert record.fast.environment_form().count == 0
    found = verify_material("tiny/old", path)
    assert found.problem is None and found.measured_environment is None


def test_verify_measures_the_error_again(matt):
    record, path = matt
    found = verify_material(record.id, path)
    assert found.problem is None
    assert found.measured_environment.p99 == pytest.approx(found.declared_environment.p99, abs=1e-6)


def test_verify_refuses_a_form_that_is_farther_off_than_it_says(matt):
    record, path = matt
    slices = record.fast.slices
    brighter = replace(slices, value=1.1 * slices.value)
    write_record(replace(record, fast=replace(record.fast, slices=brighter)), path)
    problem = verify_material(record.id, path).problem
    assert problem is not None and problem.field == "packs/slices/error"


def test_diff_says_that_a_form_has_changed(matt):
    record, _ = matt
    slices = record.fast.slices
    brighter = replace(record, fast=replace(record.fast, slices=replace(slices, value=1.1 * slices.value)))
    assert "environment form p99" in compare_records(record, brighter).words
    assert compare_records(record, record).words == ""
    without = replace(record, fast=replace(record.fast, slices=None))
    assert compare_records(without, record).words == "environment form new"
    assert compare_records(record, without).words == "environment form gone"


def test_show_prints_it_beside_the_packs(matt, capsys):
    _, path = matt
    assert main(["catalogue", "show", "tiny/grey", str(path.parent.parent)]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("environment")]
    assert "matt, 1 term; ΔE94 mean 0.0" in line


def test_what_fluoresces_keeps_its_matrix():
    nm_in, nm_out = np.arange(300.0, 701.0, 10.0), np.arange(400.0, 701.0, 10.0)
    matrix = np.where(nm_out[:, None] == nm_in, 0.4, 0.0)
    matrix[12:16, :5] = 0.05
    dye = FluorescentLambert(Bispectral(nm_in, nm_out, matrix))
    fast = measured(dye.own_form(), dye, 32).with_slices_of(dye, 0.5)
    assert fast.slices.count == 0 and fast.environment_error.maximum < 0.05
    again = type(fast).from_stored(fast.stored(), fast.error)
    assert type(again.slices.palette) is type(fast.packs[0].palette)


def test_a_projection_has_the_same_form(matt):
    record, _ = matt
    basis = record.fast.packs[0].palette.basis
    assert record.fast.in_basis(basis).environment_form() is record.fast.slices


def test_an_import_makes_it_for_every_surface(tiny_catalogue):
    found = {path.stem: read_record(path).fast.slices for path in tiny_catalogue.rglob("*.h5")}
    assert len(found) == 4 and all(form is not None and form.error is not None for form in found.values())
    assert found["matt-red"].count == 0 and found["copper"].count > 0


def test_new_code_of_forms_makes_materials_be_fitted_again():
    assert {
        f"materials/slices/{name}" for name in ("fit", "mixture", "quadrature", "error", "sky", "view_slices")
    } < set(modules_of("lambert"))


def test_the_form_of_packs_is_that_of_their_sum(matt):
    record, _ = matt
    assert view_slices(record.fast).count == 0
