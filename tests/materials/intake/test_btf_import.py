"""BTFs in a catalogue: left where they are, copied, out of archives; changed, gone, and looked at again."""

import os
import time
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from btf_samples import bumps, rgb_basis
from btf_sets import NINE, written
from metamer.cli.main import main
from metamer.materials.btf import form
from metamer.materials.btf.field_texels import FieldTexels
from metamer.materials.btf.form import FieldForm, palette_of
from metamer.materials.btf.polynomials import polynomials
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.intake.importing import import_sources
from metamer.materials.records.record import material_path
from metamer.materials.records.stored_array import StoredArray
from metamer.materials.records.stored_files import StoredFiles
from metamer.materials.records.verification import verify_catalogue
from metamer.materials.svbrdf.texture_form import texture_form
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

SAID = ImportOptions(encoding="srgb", white=(1.0,))
SOME = NINE[:5]


@pytest.fixture(autouse=True)
def fast(monkeypatch):
    """A fast form at once: one matt texel for everything."""
    matt = texture_form(WORKING_WAVELENGTHS_NM, np.full((1, 1, 81), 0.3))
    monkeypatch.setattr(form, "btf_form", lambda images, budget: matt)


@pytest.fixture
def wool(tmp_path):
    """A set that has been at rest for an hour."""
    folder = tmp_path / "wool"
    written(folder, SOME, SOME, name="tv{tv:03d}_pv{pv:03d}/{n:05d} tl{tl:03d} pl{pl:03d} tv{tv:03d} pv{pv:03d}.png")
    for path in [*folder.rglob("*"), folder]:
        os.utime(path, (time.time() - 3600,) * 2)
    return folder


def brought(source, catalogue, said=SAID, **more):
    return import_sources([source], catalogue, jobs=1, answer=said, **more)


@pytest.mark.slow_cases("True")
@pytest.mark.parametrize("copy", [False, True])
def test_images_stay_where_they_are_or_are_copied_when_asked(wool, tmp_path, copy, capsys):
    catalogue, said = tmp_path / "cat", []
    report = brought(wool, catalogue, copy=copy)
    assert report.count("imported") == 1 and len(report.files) == 1, report.outcomes
    found = Catalogue.open(catalogue)["btf/wool"]
    images = found.parameters["images"]
    assert isinstance(images, StoredArray) and isinstance(images, StoredFiles) != copy
    assert images.file == (material_path(catalogue, found.id) if copy else wool)
    surface = found.surface().images
    assert (surface.image(2, 3) > 0).all()
    assert len(found.lab()) == 3 and not found.brdf().isotropic
    assert not verify_catalogue(catalogue, jobs=1).damaged
    assert main(["catalogue", "show", "btf/wool", str(catalogue)]) == 0
    assert ("in 25 files of" in capsys.readouterr().out) != copy
    again = brought(wool, catalogue, copy=copy, doing=lambda name, doing: said.append(doing))
    assert again.count("skipped") == 1 and not said
    # Reading again gives the same bytes.
    brought(wool, tmp_path / "other", copy=copy)
    path = material_path(catalogue, found.id)
    assert material_path(tmp_path / "other", found.id).read_bytes() == path.read_bytes()
    for file in wool.rglob("*.png"):
        file.unlink()
    if copy:
        assert (found.surface().images.image(1, 1) > 0).all()
    else:
        with pytest.raises(InputError, match="no such file"):
            found.surface().images.image(1, 1)
        assert len(verify_catalogue(catalogue, jobs=1).incomplete) == 1
        # The record holds the colours from afar.
        assert len(found.lab()) == 3


def test_out_of_an_archive_images_are_copied(wool, tmp_path):
    with zipfile.ZipFile(tmp_path / "cloth.zip", "w") as archive:
        for path in sorted(wool.rglob("*.png")):
            archive.write(path, path.relative_to(wool.parent))
    assert brought(tmp_path / "cloth.zip", tmp_path / "cat").count("imported") == 1
    one = Catalogue.open(tmp_path / "cat")["btf/wool"].surface().images
    brought(wool, tmp_path / "other")
    other = Catalogue.open(tmp_path / "other")["btf/wool"].surface().images
    assert np.array_equal(one.image(3, 4), other.image(3, 4)) and one.data.file.suffix == ".h5"


def test_a_refusal_names_the_archive_and_not_where_it_was_unpacked(wool, tmp_path):
    gone, *rest = sorted(wool.rglob("*.png"))
    with zipfile.ZipFile(tmp_path / "cloth.zip", "w") as archive:
        for path in rest:
            archive.write(path, path.relative_to(wool.parent))
    (one,) = brought(tmp_path / "cloth.zip", tmp_path / "cat").outcomes
    assert one.status == "failed" and f"{tmp_path / 'cloth.zip'}/wool: images" in one.reason, one.reason
    assert gone.name[6:-4] in one.reason


def test_an_image_that_changes_between_plan_and_work_is_refused_by_name(wool, tmp_path):
    changed = sorted(wool.rglob("*.png"))[7]

    def changes(pending, jobs):
        data = bytearray(changed.read_bytes())
        data[-1] ^= 1
        changed.write_bytes(data)

    (one,) = brought(wool, tmp_path / "cat", begins=changes).outcomes
    assert one.status == "failed" and changed.name in one.reason and "not what it was" in one.reason


def test_an_image_that_changes_afterwards_is_refused_by_name_and_imported_anew(wool, tmp_path):
    brought(wool, tmp_path / "cat")
    found = Catalogue.open(tmp_path / "cat")["btf/wool"]
    changed = wool / found.parameters["images"].names[int(found.parameters["index"][2, 2, 0])]
    written(tmp_path / "one", SOME[:1], SOME[:1], size=(4, 4))
    changed.write_bytes(next((tmp_path / "one").iterdir()).read_bytes())
    with pytest.raises(InputError, match="not what it was") as caught:
        found.surface().images.image(2, 2)
    assert caught.value.file == changed
    damaged = verify_catalogue(tmp_path / "cat", jobs=1).damaged
    assert len(damaged) == 1 and changed.name in str(damaged[0].problem)
    assert brought(wool, tmp_path / "cat").count("imported") == 1
    assert not verify_catalogue(tmp_path / "cat", jobs=1).damaged


def test_a_plan_names_the_set_once_and_what_it_was_taken_for(wool, tmp_path, capsys):
    words = ["catalogue", "import", str(wool), "--into", str(tmp_path / "cat"), "--dry-run"]
    assert main(words) == 4
    out = capsys.readouterr()
    assert "--encoding srgb, linear or xyz and --white NUMBER" in out.out + out.err
    assert main([*words, "--encoding", "srgb", "--white", "0.9,1,1.1", "--texel-mm", "0.2"]) == 0
    out = capsys.readouterr().out
    assert "BTF" in out and "a perfect diffuser is 0.9, 1, 1.1" in out and "1 to import" in out
    assert not (tmp_path / "cat").exists()


def test_other_answers_are_another_record(wool, tmp_path):
    brought(wool, tmp_path / "cat")
    other = ImportOptions(encoding="linear", white=(1.0,))
    plan = import_sources([wool], tmp_path / "cat", jobs=1, answer=other, dry_run=True)
    assert plan.count("new") == 1 and brought(wool, tmp_path / "cat", dry_run=True).count("skipped") == 1


def test_an_import_that_is_ended_in_the_middle_goes_on(wool, tmp_path, monkeypatch):
    def ends(images, budget):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(form, "btf_form", ends)
        brought(wool, tmp_path / "cat")
    assert brought(wool, tmp_path / "cat").count("imported") == 1


@pytest.mark.slow_cases("rfp", "rfnl-1", "rfnl-1-separate", "lpca-paper")
@pytest.mark.parametrize("name", ["rfp", "rfnl-1", "rfnl-1-separate", "lpca", "lpca-paper"])
def test_a_fast_form_is_asked_for_by_its_name(wool, tmp_path, monkeypatch, name):
    monkeypatch.undo()
    folder = tmp_path / "cat"
    assert brought(wool, folder, said=replace(SAID, btf_form=name)).count("imported") == 1
    found = Catalogue.open(folder)["btf/wool"]
    assert ("btf" if name.startswith("lpca") else "btf-field") == found.fast.NAME
    assert f"fast form {name}: as you said" in found.provenance.notes
    # A new fit finds the same form, and asking for another imports anew.
    assert found.surface().own_form(0.5).NAME == found.fast.NAME
    assert brought(wool, folder, said=replace(SAID, btf_form=name)).count("skipped") == 1
    other = brought(wool, folder, said=SAID, dry_run=True)
    assert other.count("new") == 1
    assert not verify_catalogue(folder, jobs=1).damaged


def test_a_form_that_nobody_asked_for_is_said(wool, tmp_path, monkeypatch):
    matt = texture_form(WORKING_WAVELENGTHS_NM, np.full((1, 1, 81), 0.3))
    chosen = FieldForm(FieldTexels(polynomials(bumps(2, 2)), palette_of(rgb_basis())), note="fast form rfp, chosen")
    for given in (matt, chosen):
        monkeypatch.setattr(form, "btf_form", lambda images, budget, given=given: given)
        brought(wool, tmp_path / given.NAME)
        notes = Catalogue.open(tmp_path / given.NAME)["btf/wool"].provenance.notes
        assert notes.endswith(" + fast form rfp, chosen") == bool(given.note)
