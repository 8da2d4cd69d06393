"""`metamer catalogue export` as people call it."""

from pathlib import Path

import numpy as np
import pytest
from metamer.cli.main import main
from metamer.materials.analytic import Lambert
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.record import MARKER, write_record
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory):
    folder = tmp_path_factory.mktemp("catalogue")
    (folder / MARKER).touch()
    said = Provenance("made up", "CC0", "analytic")
    for name, level in (("grey/light", 0.7), ("grey/deep", 0.1)):
        brdf = Lambert(Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(81, level)))
        parameters = {**brdf.parameters(), "wavelengths_nm": WORKING_WAVELENGTHS_NM}
        record = MaterialRecord(name, "grey", "lambert", parameters, said, None)
        write_record(record, folder / f"{name}.h5")
    return folder


def run(capsys, *words):
    code = main(["catalogue", "export", *map(str, words)])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_a_table_of_two(capsys, catalogue, tmp_path):
    out = tmp_path / "greys.csv"
    code, said, _ = run(capsys, "grey/*", "grey/deep", "--catalogue", catalogue, "--format", "csv", "-o", out)
    assert code == 0 and str(out) in said and "Lambert" in said
    entries = read_spectra(out).entries
    assert [entry.name for entry in entries] == ["grey/deep", "grey/light"]
    assert entries[0].spectrum.samples[0] == 0.1


def test_a_catalogue_from_the_environment(capsys, catalogue, tmp_path, monkeypatch):
    monkeypatch.setenv("METAMER_CATALOGUE", str(catalogue))
    code, _, _ = run(capsys, "grey/deep", "--format", "mitsuba", "-o", tmp_path / "scene")
    assert code == 0 and (tmp_path / "scene" / "scene.xml").is_file()


@pytest.mark.parametrize(
    "words, expected",
    [
        (("grey/depe", "--format", "csv"), "nearest: grey/deep"),
        (("blue/*", "--format", "csv"), "unknown material"),
        (("grey/deep", "--format", "cvs"), "nearest: csv"),
        (("grey/deep", "--format", "exr", "there"), "--force"),
    ],
)
def test_mistakes_are_explained(capsys, catalogue, tmp_path, words, expected):
    out = tmp_path / "x"
    if words[-1] == "there":
        out.write_text("mine")
        words = words[:-1]
    code, _, told = run(capsys, *words, "--catalogue", catalogue, "-o", out)
    assert code == (64 if "cvs" in words else 4) and expected in told, told
    assert not out.exists() or out.read_text() == "mine"


def test_force(capsys, catalogue, tmp_path):
    out = tmp_path / "x.cxf"
    out.write_text("mine")
    words = ("grey/deep", "--catalogue", catalogue, "--format", "cxf", "-o", out)
    assert run(capsys, *words)[0] == 4
    assert run(capsys, *words, "--force")[0] == 0
    assert read_spectra(out).entries[0].name == "grey/deep"


def test_a_folder_without_room_is_refused_with_what_to_do(capsys, catalogue, tmp_path, monkeypatch):
    made = Path.mkdir

    def refuse(path, *args, **options):
        if path.parent == tmp_path:
            raise OSError(30, "Read-only file system")
        made(path, *args, **options)

    monkeypatch.setattr(Path, "mkdir", refuse)
    out = tmp_path / "x.csv"
    code, _, err = run(capsys, "grey/deep", "--catalogue", catalogue, "--format", "csv", "-o", out)
    assert code == 4 and "found: Read-only file system" in err and "try: name a folder that you may write to" in err


def test_what_is_true_of_every_file_is_said_once(capsys, catalogue, tmp_path):
    (tmp_path / "swatches").mkdir()
    code, said, _ = run(capsys, "grey/*", "--catalogue", catalogue, "--format", "exr", "-o", tmp_path / "swatches")
    assert code == 0 and said.count(".exr") == 2
    assert said.count("float32") == 1 and "all 2: values are float32" in said
    assert said.count("reflectance of the Lambert model") == 2, "what names its material stays with it"
