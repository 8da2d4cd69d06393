"""Import of source folders into a catalogue: what is read, what is refused, what a second run and Ctrl-C leave."""

import hashlib
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from metamer.materials.analytic.oren_nayar import OrenNayar
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.directions import spherical
from metamer.materials.intake import import_history, import_plan, importing
from metamer.materials.intake.importing import ImportInterrupted, import_sources
from metamer.materials.intake.sources import read_sources
from metamer.materials.records.models import rebuild
from metamer.materials.records.record import MARKER
from metamer.materials.records.source import Rejected
from metamer.runtime.errors import InputError
from metamer.runtime.files import made_folder
from patience import patient

SPECTRA = "# reflectance\nwavelength_nm,red,blue\n400,0.1,0.6\n500,0.2,0.4\n600,0.7,0.1\n700,0.8,0.1\n"
TABLES = """
[chart]
file = "chart.csv"
source = "A chart, measured for this test"
licence = "CC0 1.0"
geometry = "45:0"
sha256 = "HASH"
"""
FAMILY = """
family = "paint"
kind = "analytic"

[[material]]
each = "chart"
name = "{column}-matte"
model = "oren_nayar"
reflectance = { table = "chart", column = "{column}" }
sigma = 0.3

[[material]]
name = "grey"
model = "lambert"
reflectance = { constant = 0.5 }
"""


def write_source(folder, spectra=SPECTRA, tables=TABLES, family=FAMILY):
    folder.mkdir(exist_ok=True)
    (folder / "chart.csv").write_text(spectra)
    digest = hashlib.sha256((folder / "chart.csv").read_bytes()).hexdigest()
    (folder / "sources.toml").write_text(tables.replace("HASH", digest))
    (folder / "paint.toml").write_text(family)
    return folder


@pytest.fixture
def source(tmp_path):
    return write_source(tmp_path / "source")


def refusals(folder):
    return {found.name: str(found.reason) for found in read_sources(folder) if isinstance(found, Rejected)}


def statuses(report):
    return {outcome.id: outcome.status for outcome in report.outcomes}


def test_a_matt_spectrum_is_a_file_of_six_kilobytes_at_most(tmp_path):
    """With all of it: spectrum, fit, environment form, errors under five lights, notes."""
    nm = np.arange(400, 701, 10)
    values = np.round(np.random.default_rng(4).uniform(5, 90, nm.size), 2)
    table = "\n".join(["wavelength_nm,chip R (%)", *(f"{a},{b}" for a, b in zip(nm, values, strict=True))])
    (tmp_path / "chips.csv").write_text(table + "\n")
    (outcome,) = import_sources([tmp_path / "chips.csv"], tmp_path / "cat", jobs=1).outcomes
    catalogue = Catalogue.open(tmp_path / "cat")
    assert catalogue.path(outcome.id).stat().st_size <= 6000
    record = catalogue.load(outcome.id)
    np.testing.assert_array_equal(record.original["values"], values / 100)
    assert (
        record.environment_error is not None and len(record.error.lights) == 5 and "percent" in record.provenance.notes
    )


def test_materials_of_a_table_and_single_ones(source):
    found = {material.id: material for material in read_sources(source)}
    assert sorted(found) == ["paint/blue-matte", "paint/grey", "paint/red-matte"]
    red = found["paint/red-matte"]
    assert red.provenance.source == "A chart, measured for this test"
    assert (red.provenance.licence, red.provenance.geometry) == ("CC0 1.0", "45:0")
    assert "known from 400 to 700 nm" in red.provenance.notes
    whole = rebuild(red.model, red.parameters)
    assert isinstance(whole, OrenNayar)
    at_600 = np.pi * whole.eval(*(spherical(np.array([one]), 0.0) for one in (np.pi / 4, 0.0)))[0]
    assert at_600[whole.wavelengths_nm == 600] == pytest.approx(0.7, abs=1e-12)


def test_a_finer_table_stays_the_truth_and_coarser_ones_join_it(tmp_path):
    """A model's spectra stand on the grid of the finest; without a fine one they stand on the working wavelengths."""
    nm = np.arange(380, 781)
    fine = "wavelength_nm,red,blue\n" + "".join(f"{at},{0.3 + 0.2 * (at % 3) / 3:.4f},0.5\n" for at in nm)
    family = FAMILY.replace("oren_nayar", "ashikhmin_shirley").replace(
        "sigma = 0.3", "exponent_u = 9.0\nexponent_v = 9.0"
    )
    coat = 'specular = { table = "coat", column = "blue" }\n'
    family = family.replace('reflectance = { table = "chart"', coat + 'diffuse = { table = "chart"')
    tables = TABLES + TABLES.replace("[chart]", "[coat]").replace("chart.csv", "coat.csv").replace("HASH", "")
    folder = write_source(tmp_path / "fine", fine, tables, family)
    (folder / "coat.csv").write_text(SPECTRA)
    assert not refusals(folder)
    found = {material.id: material for material in read_sources(folder)}
    red = found["paint/red-matte"]
    np.testing.assert_array_equal(red.parameters["wavelengths_nm"], nm)
    np.testing.assert_allclose(red.parameters["diffuse"], 0.3 + 0.2 * (nm % 3) / 3, atol=1e-4)
    assert red.parameters["specular"][nm == 500] == pytest.approx(0.4)
    assert "diffuse finer than 5 nm" in red.provenance.notes and "specular finer" not in red.provenance.notes
    assert len(found["paint/grey"].parameters["wavelengths_nm"]) == 81


COATED = """
family = "paint"
kind = "analytic"

[[material]]
name = "red"
model = "coated_diffuse"
diffuse = { table = "chart", column = "red"GEOMETRY }
index = 1.5
roughness = 0.016
"""


def coated(folder, table, entry=""):
    """Read a paint of a table with such a geometry and an entry with such a one."""
    stated = f', geometry = "{entry}"' if entry else ""
    tables = TABLES.replace('"45:0"', f'"{table}"')
    (found,) = read_sources(write_source(folder, tables=tables, family=COATED.replace("GEOMETRY", stated)))
    return found


@pytest.mark.parametrize(
    ("table", "entry", "body_at_700"),
    [
        # Saunderson: rho = n^2 q / (1 + n^2 R q), R = 0.59635; q is 0.8 over 0.91177 of 45:0 or 0.87189 of spheres.
        ("45:0", "", 0.90671),
        ("", "45:0", 0.90671),
        ("d/8 SCE", "", 0.92531),
        ("d/8 SCI", "", 0.90398),
        ("45:0", "di:8", 0.90398),
        ("45:0", "body", 0.8),
    ],
)
def test_the_body_of_a_coated_paint_is_found_from_the_geometry_of_its_reading(tmp_path, table, entry, body_at_700):
    found = coated(tmp_path / "source", table, entry)
    assert found.parameters["diffuse"][found.parameters["wavelengths_nm"] == 700] == pytest.approx(
        body_at_700, abs=1e-4
    )
    assert found.provenance.geometry == (table if entry in ("", "body") else entry)
    assert ("the whole reads as the table" in found.provenance.notes) == (entry != "body")


def test_a_coated_paint_of_a_table_that_leaves_its_geometry_open_is_asked_about(tmp_path):
    for table in ("", "directional", "d:8"):
        refusal = str(coated(tmp_path / "source", table).reason)
        assert "paint.toml" in refusal and "red.geometry" in refusal and 'geometry = "45:0"' in refusal


@pytest.mark.parametrize("geometry", ["", "directional", "45as15"])
def test_a_rough_paint_of_a_table_that_leaves_its_geometry_open_is_asked_about(tmp_path, geometry):
    found = refusals(write_source(tmp_path / "source", tables=TABLES.replace('"45:0"', f'"{geometry}"')))
    assert len(found) == 2 and all("matte.geometry" in words for words in found.values())
    family = FAMILY.replace('column = "{column}" }', 'column = "{column}", geometry = "body" }')
    (tmp_path / "source" / "paint.toml").write_text(family)
    red = next(found for found in read_sources(tmp_path / "source") if found.id == "paint/red-matte")
    assert red.parameters["reflectance"][red.parameters["wavelengths_nm"] == 600] == pytest.approx(0.7, abs=1e-12)


def test_only_what_is_found_from_a_reading_has_a_geometry_of_its_own(source):
    text = FAMILY.replace('column = "{column}" }', 'column = "{column}", geometry = "45:0" }')
    text = text.replace('model = "oren_nayar"', 'model = "lambert"').replace("sigma = 0.3", "")
    (source / "paint.toml").write_text(text)
    assert all("unknown key" in words for words in refusals(source).values()) and len(refusals(source)) == 2


def test_import_makes_a_catalogue(source, tmp_path, fits):
    say = []
    report = import_sources([source], tmp_path / "cat", jobs=1, progress=lambda *args: say.append(args))
    assert set(statuses(report).values()) == {"imported"}
    assert [done for done, total, _ in say] == [1, 2, 3]
    catalogue = Catalogue.open(tmp_path / "cat")
    assert catalogue.ids() == ("paint/blue-matte", "paint/grey", "paint/red-matte")
    assert catalogue.load("paint/grey").brdf().eval(*np.array([[0.0, 0, 1], [0.0, 0, 1]]))[0] == pytest.approx(
        0.5 / np.pi
    )


def test_second_run_skips_what_is_unchanged(source, tmp_path, fits):
    import_sources([source], tmp_path / "cat", jobs=1)
    fits.clear()
    report = import_sources([source], tmp_path / "cat", jobs=1)
    assert fits == []
    assert report.count("skipped") == 3
    write_source(source, spectra=SPECTRA.replace("0.7", "0.6"))
    assert import_sources([source], tmp_path / "cat", jobs=1).count("imported") == 1
    assert fits == ["paint/red-matte"]
    assert import_sources([source], tmp_path / "cat", jobs=1, budget=0.25).count("imported") == 3


def test_change_of_the_fit_is_a_reason_to_fit_again(source, tmp_path, fits, monkeypatch):
    import_sources([source], tmp_path / "cat", jobs=1)
    monkeypatch.setattr(import_plan, "code_hash", lambda model: "another")
    assert import_sources([source], tmp_path / "cat", jobs=1).count("imported") == 3


def test_damaged_material_is_imported_again(source, tmp_path, fits):
    import_sources([source], tmp_path / "cat", jobs=1)
    (tmp_path / "cat" / "paint" / "grey.h5").write_bytes(b"half")
    report = import_sources([source], tmp_path / "cat", jobs=1)
    assert statuses(report)["paint/grey"] == "imported"
    assert Catalogue.open(tmp_path / "cat").load("paint/grey")


def test_dry_run_writes_nothing(source, tmp_path, fits):
    report = import_sources([source], tmp_path / "cat", jobs=1, dry_run=True)
    assert report.count("new") == 3
    assert not (tmp_path / "cat").exists()


def test_failed_fit_does_not_stop_the_others(source, tmp_path, fits, monkeypatch):
    good = importing.fit_material

    def broken(material, budget, say=None):
        return importing.FitResult(None, 0.0, "swamp") if material.id == "paint/grey" else good(material, budget)

    monkeypatch.setattr(importing, "fit_material", broken)
    report = import_sources([source], tmp_path / "cat", jobs=1)
    assert (report.count("imported"), report.count("failed")) == (2, 1)
    assert Catalogue.open(tmp_path / "cat").ids() == ("paint/blue-matte", "paint/red-matte")


def test_a_full_disk_stops_the_import_and_the_next_one_goes_on(source, tmp_path, fits, room_for):
    with room_for(2_000):
        report = import_sources([source], tmp_path / "cat", jobs=1)
    assert "no room for the file" in report.stopped and "make room" in report.stopped
    assert (report.outcomes, report.remaining, len(fits)) == ((), 3, 1)
    assert "stopped with 3 to go" in report.sentence
    assert [path.name for path in (tmp_path / "cat").rglob("*") if path.is_file()] == [MARKER]
    assert import_sources([source], tmp_path / "cat", jobs=1).count("imported") == 3


def test_bad_spectrum_fails_its_materials_only(tmp_path, fits):
    source = write_source(tmp_path / "source", spectra=SPECTRA)
    other = write_source(tmp_path / "other", spectra=SPECTRA.replace("0.8", "nan"))
    (other / "paint.toml").write_text(FAMILY.replace('"paint"', '"other"'))
    report = import_sources([source, other], tmp_path / "cat", jobs=1)
    failed = {outcome.id: outcome.reason for outcome in report.outcomes if outcome.status == "failed"}
    assert list(failed) == ["other/{column}-matte"]
    assert "chart.csv: red" in failed["other/{column}-matte"]
    assert report.count("imported") == 4


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"spectra": SPECTRA.replace("0.8", "nan")}, ("chart.csv", "red", "not a number", "700 nm")),
        ({"spectra": SPECTRA.replace("0.8", "-0.8")}, ("chart.csv", "red", "negative", "700 nm")),
        ({"spectra": SPECTRA.replace("0.8", "80.0")}, ("chart.csv", "red", "percent")),
        ({"spectra": SPECTRA.replace("700", "0.7")}, ("chart.csv", "first column")),
        ({"tables": TABLES.replace("HASH", "0" * 64)}, ("chart.csv", "sha256", "0" * 64)),
        ({"tables": TABLES.replace("chart.csv", "gone.csv")}, ("gone.csv", "no such file")),
        ({"tables": TABLES.replace("licence", "license")}, ("sources.toml", "chart.license", "nearest: licence")),
        ({"tables": TABLES.replace('"CC0 1.0"', '""')}, ("sources.toml", "chart.licence", "without its origin")),
        ({"family": FAMILY.replace("kind =", "kinds =")}, ("paint.toml", "kinds", "nearest: kind")),
        ({"family": FAMILY.replace("sigma", "sigmas")}, ("paint.toml", "red-matte.sigmas", "sigma")),
        ({"family": FAMILY.replace("sigma = 0.3", "")}, ("paint.toml", "red-matte", "sigma")),
        ({"family": FAMILY.replace("0.3", "-0.3")}, ("paint.toml", "red-matte.sigma", "-0.3")),
        ({"family": FAMILY.replace("0.5", "50.0")}, ("paint.toml", "grey", "reflectance")),
        ({"family": FAMILY.replace("0.5", "1" + 400 * "0")}, ("paint.toml", "grey", "reflectance")),
        ({"family": FAMILY.replace("0.5", '"half"')}, ("paint.toml", "grey.reflectance", "not a number")),
        ({"family": FAMILY.replace("oren_nayar", "oren_nayer")}, ("paint.toml", "nearest: oren_nayar")),
        ({"family": FAMILY.replace('table = "chart"', 'table = "charts"')}, ("paint.toml", "nearest: chart")),
        ({"family": FAMILY.replace('column = "{column}"', 'column = "rad"')}, ("chart.csv", "nearest: red")),
        ({"family": FAMILY.replace('"grey"', '"../grey"')}, ("paint.toml", "name", "../grey")),
        ({"family": FAMILY.replace('"paint"', '"Paint"')}, ("paint.toml", "family", "lower-case")),
        ({"family": FAMILY.replace('"analytic"', '"guess"')}, ("paint.toml", "guess", "measured")),
        ({"family": FAMILY + "x = ["}, ("paint.toml", "not valid TOML")),
    ],
    ids=lambda value: None if isinstance(value, dict) else value[-1],
)
def test_refusals_name_file_and_place(tmp_path, change, said):
    found = refusals(write_source(tmp_path / "source", **change))
    assert found
    text = "\n".join(found.values())
    for part in said:
        assert part in text, text


def test_paths_that_are_no_source(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_sources(tmp_path / "gone")
    with pytest.raises(InputError, match="nothing to import"):
        read_sources(tmp_path)
    (tmp_path / "report.pdf").write_bytes(b"%PDF-1.7")
    with pytest.raises(InputError, match=r"(?s)not a material source.*\.brdf"):
        read_sources(tmp_path / "report.pdf")


def test_id_used_twice_fails_the_second(source, tmp_path, fits):
    report = import_sources([source, source], tmp_path / "cat", jobs=1)
    assert report.count("imported") == 3
    assert all("used twice" in outcome.reason for outcome in report.outcomes if outcome.status == "failed")


def test_folder_with_other_files_is_not_taken_for_a_catalogue(source, tmp_path, fits):
    with pytest.raises(InputError, match="not a catalogue"):
        import_sources([source], source, jobs=1)
    assert not (source / MARKER).exists()


def test_what_a_killed_import_left_behind_does_not_stop_the_next(source, tmp_path, fits):
    folder = tmp_path / "cat"
    folder.mkdir()
    for name in (".writable", ".catalogue.0a1b2c3d.toml"):
        (folder / name).write_bytes(b"")
    assert import_sources([source], folder, jobs=1).count("imported") == 3
    assert len(Catalogue.open(folder).ids()) == 3


def test_several_processes_may_make_one_folder(tmp_path):
    """Each tries whether it can write there; none may trip over what another wipes away."""
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(made_folder, [tmp_path / "cat"] * 200))
    assert list((tmp_path / "cat").iterdir()) == []


def test_file_in_place_of_the_folder(source, tmp_path, fits):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file: "):
        import_sources([source], tmp_path / "file", jobs=1)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs a folder that even root cannot write to")
def test_unwritable_folder_is_named(source, fits):
    with pytest.raises(InputError, match=r"(?s)/proc/metamer: the folder cannot be made.*--catalogue"):
        import_sources([source], "/proc/metamer", jobs=1)


def test_interrupt_keeps_what_is_finished(source, tmp_path, fits):
    def stop(done, total, outcome):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(ImportInterrupted) as caught:
        import_sources([source], tmp_path / "cat", jobs=1, progress=stop)
    assert "2 imported; stopped with 1 to go" in caught.value.report.sentence
    assert len(Catalogue.open(tmp_path / "cat").ids()) == 2
    assert import_sources([source], tmp_path / "cat", jobs=1).count("imported") == 1


@pytest.mark.slow
def test_measured_files_are_imported_and_come_back_exactly(shared_data, tmp_path, fits):
    report = import_sources([shared_data / "brdf" / "cornell-spectral"], tmp_path / "cat", jobs=1)
    assert statuses(report) == dict.fromkeys(
        ("measured/garnet-red", "measured/krylon-blue", "measured/mystique"), "imported"
    )
    record = Catalogue.open(tmp_path / "cat").load("measured/krylon-blue")
    (source,) = read_sources(shared_data / "brdf" / "cornell-spectral" / "krylon_blue.brdf")
    assert record.provenance.kind == "measured" and record.model == source.model
    for name, value in source.parameters.items():
        np.testing.assert_array_equal(record.parameters[name], value, err_msg=name)
    assert import_sources([shared_data / "brdf" / "cornell-spectral"], tmp_path / "cat", jobs=1).count("skipped") == 3


def test_truncated_measured_file_is_named(tmp_path):
    (tmp_path / "cut.brdf").write_text("3\n400 500 600\n0 0 0.1 0 0.1 0.1\n")
    assert "cut.brdf" in refusals(tmp_path / "cut.brdf")["cut.brdf"]


@pytest.mark.slow
def test_ctrl_c_in_the_middle_of_a_parallel_import(tmp_path):
    """A real command, real fits, a real signal: no partial file, no process left, and a second run completes."""
    family = FAMILY.replace("0.3", "0.31") + "".join(
        f'[[material]]\nname = "grey-{n}"\nmodel = "oren_nayar"\nreflectance = {{ constant = 0.{n} }}\nsigma = 0.{n}\n'
        for n in range(1, 6)
    )
    source, cat = write_source(tmp_path / "source", family=family), tmp_path / "cat"
    # A shell's background job hands an ignored SIGINT down to all of its children.
    listen = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "
        "from metamer.cli.main import main; sys.exit(main())"
    )
    words = ["catalogue", "import", str(source), "--into", str(cat), "--budget", "20", "--jobs", "2"]
    process = subprocess.Popen(
        [sys.executable, "-c", listen, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    for line in process.stdout:
        if "imported" in line:
            break
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=patient(60))
    assert process.returncode == 130, (out, err)
    assert "Traceback" not in err
    assert "the same command goes on from here" in err
    deadline = time.monotonic() + patient(10)
    while _group_alive(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not _group_alive(process.pid)
    # Even after a slow start of the command its source was at rest, and what it saw of it is kept.
    files = sorted(path.name for path in cat.rglob("*") if path.is_file() and path.name != import_history.FILE)
    assert files and not [name for name in files if name.startswith(".")]
    before = Catalogue.open(cat).ids()
    assert 0 < len(before) < 8
    assert not any(Catalogue.open(cat).verify().values())
    again = import_sources([source], cat, jobs=1, budget=20.0)
    assert (again.count("skipped"), again.count("imported")) == (len(before), 8 - len(before))
    assert len(Catalogue.open(cat).ids()) == 8


def _group_alive(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
