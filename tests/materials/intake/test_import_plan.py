"""Plan of an import, said before it does anything: which file is what, what is new, what is refused and why."""

import dataclasses
import zipfile

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.formats import registry
from metamer.materials.intake import import_plan as planning
from metamer.materials.intake.import_plan import Settings, planned
from metamer.materials.intake.importing import ImportReport, import_sources
from metamer.materials.intake.inputs import inputs_of
from metamer.materials.intake.sources import read_sources
from metamer.materials.records.source import MaterialSource
from metamer.spectral.formats.import_options import ImportOptions

SPECTRA = "# reflectance\nwavelength_nm,red,blue\n400,0.1,0.6\n500,0.2,0.4\n600,0.7,0.1\n700,0.8,0.1\n"
FAMILY = """family = "grey"
kind = "analytic"
[[material]]
name = "grey"
model = "lambert"
reflectance = { constant = 0.5 }
"""
SETTINGS = Settings(0.5, "mallett-yuksel")


@pytest.fixture
def source(tmp_path):
    """Two materials in a table, one in a description, a damaged file, and files that are none of ours."""
    folder = tmp_path / "source"
    folder.mkdir()
    (folder / "chart.csv").write_text(SPECTRA)
    (folder / "grey.toml").write_text(FAMILY)
    (folder / "damaged.bsdf").write_bytes(b"tensor_file\0\1\0")
    (folder / "README.md").write_text("What is in here.\n")
    (folder / "report.pdf").write_bytes(b"%PDF-1.7\n" + bytes(200))
    return folder


def plan(*words, folder, settings=SETTINGS):
    with inputs_of(words) as files:
        return {file.name: file for file in planned(files, folder, settings)}


def test_one_path_is_one_source(source, tmp_path):
    """Taken letter by letter, the first letter would be the root of the disk."""
    for one in (source / "chart.csv", str(source / "chart.csv")):
        report = import_sources(one, tmp_path / "cat", dry_run=True)
        assert [file.name for file in report.files] == [str(source / "chart.csv")]
    assert repr(report) == f"<ImportReport of {tmp_path / 'cat'}: 2 to import>"


def test_what_is_what(source, tmp_path):
    found = plan(source, folder=tmp_path / "cat")
    rows = {
        name.rpartition("/")[2]: (file.format, len(file.materials), file.count("new")) for name, file in found.items()
    }
    assert rows == {
        "README.md": ("", 0, 0),
        "chart.csv": ("table (CSV, TSV)", 2, 2),
        "damaged.bsdf": ("RGL measurement", 1, 0),
        "grey.toml": ("family description", 1, 1),
        "report.pdf": ("", 0, 0),
    }
    assert not (tmp_path / "cat").exists()


def test_what_is_there_already_is_known(source, tmp_path):
    import_sources([source], tmp_path / "cat", jobs=1)
    found = plan(source, folder=tmp_path / "cat")
    assert [sum(file.count(status) for file in found.values()) for status in ("new", "skipped", "failed")] == [
        0,
        3,
        1,
    ]
    other = plan(source, folder=tmp_path / "cat", settings=Settings(0.25, "mallett-yuksel"))
    assert sum(file.count("new") for file in other.values()) == 3


def test_files_that_belong_to_another_are_no_sources(source, tmp_path):
    """The tables of a description are not spectra of their own."""
    (source / "sources.toml").write_text('[chart]\nfile = "chart.csv"\nsource = "s"\nlicence = "l"\n')
    names = {name.rpartition("/")[2] for name in plan(source, folder=tmp_path / "cat")}
    assert names == {"README.md", "damaged.bsdf", "grey.toml", "report.pdf"}
    assert len(plan(source / "chart.csv", folder=tmp_path / "cat")) == 1


def test_file_that_was_named_must_be_of_use(source, tmp_path):
    (file,) = plan(source / "report.pdf", folder=tmp_path / "cat").values()
    (material,) = file.materials
    assert material.status == "failed" and "not a material source" in material.reason
    assert str(source / "report.pdf") in material.reason


def test_refused_files_fail_and_unknown_ones_do_not(source, tmp_path):
    report = import_sources([source], tmp_path / "cat", jobs=1)
    assert (report.count("imported"), report.count("failed")) == (3, 1)
    assert len(report.not_recognised) == 2
    assert "3 imported, 1 failed; 2 files not recognised" in report.sentence
    (failed,) = (outcome for outcome in report.outcomes if outcome.status == "failed")
    assert failed.format == "RGL measurement" and failed.file.endswith("damaged.bsdf")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("README.txt", "What is in here.\nTwo charts, 1 and 2.\n"),
        ("notes.dat", "5 apples\n6 pears\n"),
        ("mesh.obj", "v 0.1 0.2 0.3\nv 0.2 0.1 0.4\nv 0.3 0.3 0.5\nf 1 2 3\n"),
        ("schema.xsd", '<?xml version="1.0"?><xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema"/>'),
        ("empty.txt", ""),
        ("stock.csv", "part,drawer,left\nscrew M4,A3,120\nnut M4,A4,85\n"),
    ],
)
def test_texts_that_are_no_tables_are_passed_over_in_folders_and_refused_by_name(source, tmp_path, name, text):
    (source / name).write_text(text)
    report = import_sources([source], tmp_path / "cat", jobs=1, dry_run=True)
    assert (report.count("new"), report.count("failed"), len(report.not_recognised)) == (3, 1, 3)
    report = import_sources([source / name], tmp_path / "cat", jobs=1, dry_run=True)
    assert (report.count("new"), report.count("failed")) == (0, 1)


def test_a_table_of_something_else_is_named_with_its_reason(source, tmp_path):
    (source / "stock.csv").write_text("part,drawer,left\nscrew M4,A3,120\nnut M4,A4,85\n")
    (source / "cut.csv").write_text("wavelength_nm,red\nx,y\nz,0.1\n")
    files = {name.rpartition("/")[2]: file for name, file in plan(source, folder=tmp_path / "cat").items()}
    assert files["stock.csv"].materials == () and files["stock.csv"].note == "no table of wavelengths and values"
    assert files["cut.csv"].count("failed") == 1


def test_table_that_is_wrong_is_refused_in_folders_too(source, tmp_path):
    (source / "bad.txt").write_text(SPECTRA.replace("0.8", "-0.8").replace("0.1\n", "-0.1\n"))
    report = import_sources([source], tmp_path / "cat", jobs=1, dry_run=True)
    assert any("bad.txt" in outcome.file and "negative" in outcome.reason for outcome in report.outcomes)


def test_reasons_name_members_of_archives_and_no_private_folder(source, tmp_path):
    with zipfile.ZipFile(tmp_path / "set.zip", "w") as archive:
        archive.write(source / "damaged.bsdf", "deep/damaged.bsdf")
    (file,) = plan(tmp_path / "set.zip", folder=tmp_path / "cat").values()
    (material,) = file.materials
    assert file.name == f"{tmp_path}/set.zip/deep/damaged.bsdf"
    assert material.reason.startswith(file.name) and material.id == file.name


def test_family_of_ones_own(source, tmp_path):
    report = import_sources([source / "chart.csv"], tmp_path / "cat", jobs=1, family="mine")
    assert Catalogue.open(tmp_path / "cat").ids() == ("mine/blue", "mine/red")
    assert Catalogue.open(tmp_path / "cat").load("mine/red").family == "mine"
    assert report.count("imported") == 2


def test_one_id_from_two_files(source, tmp_path):
    """Equal content is one material; other content is refused, with a way out."""
    for name, spectra in (("same", SPECTRA), ("other", SPECTRA.replace("0.8", "0.9"))):
        (tmp_path / name).mkdir()
        (tmp_path / name / "chart.csv").write_text(spectra)
    found = plan(source / "chart.csv", tmp_path / "same", tmp_path / "other", folder=tmp_path / "cat")
    statuses = [[material.status for material in file.materials] for file in found.values()]
    assert statuses == [["new", "new"], ["skipped", "skipped"], ["failed", "failed"]]
    reasons = [file.materials[0].reason for file in found.values()]
    assert "the same as in" in reasons[1]
    assert "used twice" in reasons[2] and "--family" in reasons[2]


def test_large_materials_are_not_kept_but_read_again(source, tmp_path, monkeypatch):
    monkeypatch.setattr(planning, "_KEPT_BYTES", 0)
    read = []
    whole = planning.read_with
    monkeypatch.setattr(
        planning,
        "read_with",
        lambda reader, path, *more: (read.append(path), whole(reader, path, *more))[1],
    )
    with inputs_of([source / "chart.csv"]) as files:
        (file,) = planned(files, tmp_path / "cat", SETTINGS)
        again = file.materials[1].load()
        (source / "chart.csv").write_text("changed")
        with pytest.raises(Exception, match="changed since"):
            file.materials[0].load()
    assert again.id == "chart/blue" and len(read) == 3
    assert import_sources([source / "grey.toml"], tmp_path / "cat", jobs=1).count("imported") == 1


def test_file_that_changes_during_the_import_fails_its_materials_only(source, tmp_path, monkeypatch):
    monkeypatch.setattr(planning, "_KEPT_BYTES", 0)

    def change(done, total, outcome):
        (source / "chart.csv").write_text("changed\n")

    report = import_sources([source], tmp_path / "cat", jobs=1, progress=change)
    failed = {outcome.id: outcome.reason for outcome in report.outcomes if outcome.status == "failed"}
    assert {"chart/red", "chart/blue"} <= set(failed) and "changed since the import began" in failed["chart/red"]
    assert report.count("imported") == 1


def test_reader_with_a_defect_costs_one_file(source, tmp_path, monkeypatch):
    rgl = next(reader for reader in registry.formats() if reader.NAME == "RGL measurement")
    monkeypatch.setattr(rgl, "read_sources", lambda path, uplift: 1 / 0)
    report = import_sources([source], tmp_path / "cat", jobs=1)
    (failed,) = (outcome for outcome in report.outcomes if outcome.status == "failed")
    assert "the reader of RGL measurement broke down" in failed.reason and "ZeroDivisionError" in failed.reason
    assert report.count("imported") == 3


def test_file_without_a_material_is_refused(tmp_path):
    (tmp_path / "none.toml").write_text('family = "none"\nkind = "analytic"\n')
    (file,) = plan(tmp_path / "none.toml", folder=tmp_path / "cat").values()
    assert "holds no material" in file.materials[0].reason


def test_hash_of_a_source_sees_every_part_of_it(source):
    (red, *_) = read_sources(source / "chart.csv")
    assert isinstance(red, MaterialSource)
    parameters = dict(red.parameters) | {"reflectance": np.asarray(red.parameters["reflectance"]) * 0.5}
    others = [
        dataclasses.replace(red, id="chart/other"),
        dataclasses.replace(red, family="other"),
        dataclasses.replace(red, model="other"),
        dataclasses.replace(red, parameters=parameters),
        dataclasses.replace(red, original=dict(red.original) | {"name": "other"}),
        dataclasses.replace(red, original=dict(red.original) | {"more": 1}),
        dataclasses.replace(red, provenance=dataclasses.replace(red.provenance, notes="other")),
    ]
    assert len({other.content_hash for other in [red, *others]}) == len(others) + 1
    assert dataclasses.replace(red, file=source / "elsewhere").content_hash == red.content_hash


def test_report_of_nothing():
    assert ImportReport(planning.Path("cat"), ()).sentence == "cat: nothing imported"


def test_every_module_with_a_reader_is_in_the_list():
    """And none of the list is missing: a format is one file and one row."""
    folder = planning.Path(registry.__file__).parent
    readers = {
        file.stem for file in folder.glob("*.py") if "\ndef read_sources(path" in file.read_text(encoding="utf-8")
    }
    assert readers == set(registry.FORMATS)
    for reader in registry.formats():
        assert reader.NAME and all(suffix.startswith(".") for suffix in reader.SUFFIXES)


@pytest.mark.parametrize("name", ["a.cxf", "a.csv", "a.zip", "a.bsdf", "a.mat", "a.spdx"])
def test_empty_files_that_are_called_measurements_are_refused_in_folders_too(tmp_path, name):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / name).write_bytes(b"")
    (found,) = plan(tmp_path / "in", folder=tmp_path / "cat").values()
    assert [material.status for material in found.materials] == ["failed"]


def test_a_plan_says_what_was_taken_and_by_which_sign(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.csv").write_text("nm,R (%)\n400,40\n700,50\n")
    (tmp_path / "in" / "b.csv").write_text("nm,red\n400,40\n700,50\n")
    answered = dataclasses.replace(SETTINGS, answer=ImportOptions("transmittance"))
    first, second = plan(tmp_path / "in", folder=tmp_path / "cat").values()
    known = "known from 400 to 700 nm only"
    assert first.taken == (f"reflectance in percent, by the heading 'R (%)'; {known}",)
    assert second.count("failed") == 1 and "what was measured?" in second.materials[0].reason
    first, second = plan(tmp_path / "in", folder=tmp_path / "cat", settings=answered).values()
    assert first.taken == (f"reflectance in percent, by the heading 'R (%)'; {known}",)
    assert second.taken[0].startswith("transmittance in percent, by --as; percent by values from")


def test_another_answer_is_another_import(tmp_path):
    path = tmp_path / "b.csv"
    path.write_text("nm,red\n400,0.4\n700,0.5\n")
    hashes = set()
    for quantity, scale in (("reflectance", "fraction"), ("reflectance", "percent"), ("transmittance", "fraction")):
        settings = dataclasses.replace(SETTINGS, answer=ImportOptions(quantity, scale))
        (file,) = plan(path, folder=tmp_path / "cat", settings=settings).values()
        hashes.add(file.materials[0].source_hash)
    assert len(hashes) == 3


def test_a_description_may_say_that_its_table_is_in_percent(tmp_path):
    (tmp_path / "t.csv").write_text("nm,red\n380,40\n780,60\n")
    (tmp_path / "f.toml").write_text(FAMILY.replace("{ constant = 0.5 }", '{ table = "t", column = "red" }'))
    said = '[t]\nfile = "t.csv"\nsource = "me"\nlicence = "CC0"\n'
    (tmp_path / "sources.toml").write_text(said)
    (refused,) = read_sources(tmp_path / "f.toml")
    assert "looks like percent" in str(refused.reason)
    (tmp_path / "sources.toml").write_text(said + 'scale = "percent"\n')
    (found,) = read_sources(tmp_path / "f.toml")
    assert found.parameters["reflectance"][0] == 0.4
    (tmp_path / "sources.toml").write_text(said + 'scale = "percent"\nquantity = "index"\n')
    (refused,) = read_sources(tmp_path / "f.toml")
    assert "no percent here" in str(refused.reason)


def test_answers_for_a_folder_fill_gaps_and_leave_alone_what_files_state(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.csv").write_text("nm,reflectance (0..1)\n400,0.4\n700,0.5\n")
    (tmp_path / "in" / "b.csv").write_text("nm,red\n400,40\n700,50\n")
    (tmp_path / "in" / "c.csv").write_text("nm,irradiance (W/m2/nm)\n400,40\n700,50\n")
    settings = dataclasses.replace(SETTINGS, answer=ImportOptions("reflectance", "percent"))
    first, second, third = plan(tmp_path / "in", folder=tmp_path / "cat", settings=settings).values()
    assert first.taken[0].startswith("reflectance in fractions, by the heading")
    assert second.taken[0].startswith("reflectance in percent, by --as; percent by --scale")
    assert third.taken[0].startswith("emission, by the heading")


@pytest.mark.parametrize(
    ("head", "values", "answer", "taken"),
    [
        ("reflectance (%)", (0.07, 0.63), ImportOptions(None, "fraction"), "fraction by --scale, against the heading"),
        ("reflectance (%)", (0.07, 0.63), ImportOptions(None, "percent"), "percent by --scale"),
        ("reflectance (%)", (40.0, 50.0), ImportOptions("transmittance"), "transmittance in percent, by --as, against"),
        ("reflectance", (0.0004, 0.0024), ImportOptions("emission"), "emission, by --as, against the heading"),
        (
            "irradiance",
            (0.2, 0.8),
            ImportOptions("reflectance", "fraction"),
            "reflectance in fractions, by --as, against",
        ),
    ],
)
def test_of_a_file_alone_the_answer_counts_for_more_than_its_words(tmp_path, head, values, answer, taken):
    path = tmp_path / "a.csv"
    path.write_text(f"nm,{head}\n400,{values[0]}\n700,{values[1]}\n")
    (file,) = plan(path, folder=tmp_path / "cat", settings=dataclasses.replace(SETTINGS, answer=answer)).values()
    assert file.count("new") == 1 and taken in file.taken[0]
