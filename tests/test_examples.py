"""Examples that people read first, run as they stand: the numbered examples, and the Python of the README."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from metamer.materials.analytic.ashikhmin_shirley import AshikhminShirley
from metamer.materials.analytic.lambert import Lambert
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.fitting.fit import fit
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.record import MARKER, write_record
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from patience import patient
from pictures import read_xyz_exr

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
LONGEST = 60
RED = np.where(WORKING_WAVELENGTHS_NM < 590, 0.05, 0.6)


def run(name, folder, *arguments, examples=EXAMPLES):
    """Standard output of an example, run by itself in `folder` with warnings as errors."""
    done = subprocess.run(
        [sys.executable, "-W", "error", examples / name, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONUTF8": "1", "TMPDIR": str(folder), "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        encoding="utf-8",
        timeout=patient(300),
    )
    assert done.returncode == 0 and not done.stderr, f"{name}\n{done.stdout}{done.stderr}"
    return done.stdout


def simpler(folder, scene, shape, instead):
    """A copy of the examples, with a mesh of fewer triangles in a scene of the showroom."""
    (folder / "catalogs").symlink_to(ROOT / "catalogs", target_is_directory=True)
    copy = Path(shutil.copytree(EXAMPLES, folder / "examples"))
    path, shape = copy / "showroom" / f"{scene}.toml", f'shape = "{shape}"\n'
    text = path.read_text(encoding="utf-8")
    assert shape in text
    path.write_text(text.replace(shape, instead), encoding="utf-8")
    return copy


def number(pattern, text):
    """The one group of `pattern` in `text`, as a number."""
    found = re.search(pattern, text)
    assert found, f"no {pattern} in\n{text}"
    return float(found[1])


def test_every_example_has_a_test_and_is_short():
    scripts = sorted(EXAMPLES.glob("[0-9]*.py"))
    tested = set(re.findall(r'run\("(\w+\.py)"', Path(__file__).read_text(encoding="utf-8")))
    assert tested == {script.name for script in scripts}
    assert [script.name[:2] for script in scripts] == [f"{number:02}" for number in range(1, len(scripts) + 1)]
    for script in scripts:
        text = script.read_text(encoding="utf-8")
        assert text.startswith('"""') and len(text.splitlines()) < LONGEST, script.name


def test_a_metameric_pair_is_one_colour_under_d65_and_two_elsewhere(tmp_path):
    said = run("01_spectrum_to_colour.py", tmp_path)
    assert number(r"1931_2 D65\s+ΔE94 ([\d.]+)", said) == 0.0
    for light in ("1931_2 A", "1931_2 FL11", "1964_10 D65"):
        assert number(rf"{light}\s+ΔE94 ([\d.]+)", said) > 0.5
    # A green 6/12: Munsell value 6 lies near L* 61 under C, and this chip is a little darker.
    assert number(r"1931_2 +D65 +L\* +([\d.]+)", said) == pytest.approx(57.4, abs=0.1)


@pytest.mark.slow
def test_balanced_basis_beats_peercy_at_every_size(tmp_path):
    said = run("02_choose_a_basis.py", tmp_path)
    rows = re.findall(r"^ *(\d+) +([\d.]+) +([\d.]+)$", said, re.M)
    assert len(rows) == 7
    assert all(float(balanced) < float(peercy) for _, balanced, peercy in rows), said
    assert number(r"One light alone: J = 3, largest ΔE94 (\S+)", said) < 1e-9


@pytest.mark.slow
def test_more_terms_for_a_smaller_budget(tmp_path):
    said = run("03_factor_a_brdf.py", tmp_path)
    rows = re.findall(r"^ *([\d.]+) +io (\d+), hd (\d+) +([\d.]+) +([\d.]+)", said, re.M)
    assert len(rows) == 3
    for budget, _, _, _, p99 in rows[:2]:
        assert float(p99) <= float(budget), said
    reached = [float(p99) for *_, p99 in rows]
    assert reached == sorted(reached, reverse=True), said
    terms = [int(io) + int(hd) for _, io, hd, _, _ in rows]
    assert terms == sorted(terms) and terms[0] < terms[-1], said
    original = number(r"original ([\d.]+)", said)
    assert number(r"packs ([\d.]+)", said) == pytest.approx(original, rel=0.02)


@pytest.mark.slow
def test_picture_and_truth_agree_and_both_files_are_there(tmp_path):
    said = run("04_render_and_compare.py", tmp_path, "pictures")
    assert number(r"max ([\d.]+)", said) < 1.0
    assert (tmp_path / "pictures" / "picture.png").read_bytes().startswith(b"\x89PNG")
    picture, coverage = read_xyz_exr(tmp_path / "pictures" / "picture.exr")
    assert picture.values.shape == (96, 96, 3)
    assert coverage is not None
    # A disc of radius 1 in a view of height 2.2; a sphere of flat faces covers a little less.
    assert coverage.mean() == pytest.approx(np.pi / 2.2**2, rel=0.01)


@pytest.mark.slow
def test_fluorescence_shows_where_the_light_excites_it(tmp_path):
    said = run("06_fluorescence.py", tmp_path, "pictures")
    rows = re.findall(r"^(\S+) +Y ([\d.]+) .*p99 ([\d.]+) .*reflectance ([\d.]+)$", said, re.M)
    assert [row[0] for row in rows] == ["D65", "A", "UV-free"], said
    assert all(float(p99) < 0.05 for _, _, p99, _ in rows), said
    missed = [float(row[3]) for row in rows]
    assert missed[0] > missed[2] > missed[1] > 3, said
    for name in ("D65", "A", "UV-free"):
        picture, _ = read_xyz_exr(tmp_path / "pictures" / f"{name}.exr")
        assert picture.values.shape == (96, 96, 3)


@pytest.mark.slow
def test_a_catalogue_of_two_materials(tmp_path):
    said = run("05_build_a_catalogue.py", tmp_path, "made")
    assert "2 imported" in said and "2 skipped" in said
    assert "nearest: fabric/rust-felt" in said
    assert said.index("fabric/rust-felt: ΔE94") < said.index("fabric/grey-card: ΔE94")
    catalogue = Catalogue.open(tmp_path / "made" / "catalogue")
    assert catalogue.ids() == ("fabric/grey-card", "fabric/rust-felt")
    assert catalogue.verify() == dict.fromkeys(catalogue.ids())
    assert catalogue.load("fabric/rust-felt").error.p99 < 1.0


@pytest.mark.slow
def test_a_neighbour_a_slider_and_pictures_along_it(tmp_path):
    said = run("07_like_this_but.py", tmp_path, "made")
    assert number(r"sample/satin, by ([\d.]+) stops", said) == pytest.approx(1.2, abs=0.2)
    assert "specular_scale: 1, a number >= 0 and <= 20" in said
    assert "diffuse_scale: out of its domain\n  found: 3\n  expected: a number >= 0 and <= 2.5" in said
    means = [float(found) for found in re.findall(r"diffuse_scale [\d.]+: mean Y ([\d.]+)", said)]
    assert len(means) == 3 and means[0] > means[1] + 0.01 > means[2] + 0.02


@pytest.mark.slow
def test_scenes_of_the_showroom_and_a_metameric_pair(tmp_path):
    """All materials are greys here: made soon, and the scene is that of the pictures."""
    folder = tmp_path / "metamer-catalogue"
    folder.mkdir()
    (folder / MARKER).write_text("")
    grey = Lambert(Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(WORKING_WAVELENGTHS_NM.size, 0.4)))
    for name in ("paint/munsell-5r-4-14-gloss", "colorchecker/neutral-8-matte"):
        parameters, family = {"wavelengths_nm": WORKING_WAVELENGTHS_NM, **grey.parameters()}, name.split("/")[0]
        provenance = Provenance("made up for this test", "CC0 1.0", "analytic")
        (folder / family).mkdir()
        record = MaterialRecord(name, family, grey.NAME, parameters, provenance, grey.own_form())
        write_record(record, folder / f"{name}.h5")
    examples = simpler(tmp_path, "gloss", "speed_shape", 'shape = "speed_shape"\nsubdivisions = 2\n')
    said = run("09_showroom.py", tmp_path, "made", "16", "gloss", examples=examples)
    assert number(r"pair, D65: ΔE94 ([\d.]+)", said) < 0.01 and number(r"pair, FL11: ΔE94 ([\d.]+)", said) > 5.0
    assert number(r"gloss: ΔE94 mean ([\d.]+)", said) < 0.5
    assert {path.suffix for path in (tmp_path / "made").glob("*-*.*")} == {".png"}
    assert (tmp_path / "made" / "gloss.png").is_file() and len(list((tmp_path / "made").glob("pair-*.png"))) == 4


@pytest.mark.slow
def test_a_cloth_has_texture_and_its_mean_spectrum_none(tmp_path):
    from PIL import Image

    # Spread out, not draped: nothing hides the light.
    flat = 'shape = "plane"\nwidth = 2\ndepth = 2\n'
    examples = simpler(tmp_path, "twill", "cloth", flat)
    said = run("10_cloth_beside_its_mean.py", tmp_path, "made", "48", "8", examples=examples)
    assert number(r"twill: ΔE94 mean ([\d.]+)", said) < 1.5
    picture = np.asarray(Image.open(tmp_path / "made" / "twill.png").convert("RGB")).astype(float)[14:20]
    hue = np.log((picture[..., 0] + 1.0) / (picture[..., 1] + 1.0))
    assert hue[:, 8:18].std(axis=1).mean() > 1.5 * hue[:, 30:40].std(axis=1).mean()


@pytest.mark.slow
def test_a_metallic_panel_is_light_and_dark(tmp_path):
    from PIL import Image

    examples = simpler(tmp_path, "flop", "speed_shape", 'shape = "speed_shape"\nsubdivisions = 2\n')
    said = run("11_panel_that_flops.py", tmp_path, "made", "48", examples=examples)
    assert "reconstructed(6 angles" in said and number(r"flop: ΔE94 mean ([\d.]+)", said) < 1.0
    picture = np.asarray(Image.open(tmp_path / "made" / "flop.png").convert("RGB")).astype(float)[6:18, 10:38]
    assert picture[..., 1].max() > 4.0 * np.percentile(picture[..., 1], 10)


@pytest.fixture
def tiny_catalogue(tmp_path):
    """The catalogue that Python in the README and in docs/python.md opens, with the one material that it loads."""
    grid = WORKING_WAVELENGTHS_NM
    paint = AshikhminShirley(Spectrum.sampled(grid, RED), Spectrum.sampled(grid, np.full(grid.size, 0.04)), 25.0, 25.0)
    found = fit(paint, budget=5.0, ranks=(1,), pixels=16)
    parameters = {"wavelengths_nm": grid, **paint.parameters()}
    provenance = Provenance("made up for this test", "CC0 1.0", "analytic")
    record = MaterialRecord("colorchecker/red-satin", "colorchecker", paint.NAME, parameters, provenance, found.fast)
    folder = tmp_path / "metamer-catalogue"
    (folder / "colorchecker").mkdir(parents=True)
    (folder / MARKER).write_text("")
    write_record(record, folder / "colorchecker" / "red-satin.h5")
    return tmp_path


def test_a_batch_that_passes_in_daylight_fails_under_lamps(tmp_path):
    said = run("08_match_a_batch.py", tmp_path)
    assert "lighter: pass" in said and "at the limit: not resolved" in said and "other pigment: fail" in said
    assert number(r"other pigment: fail\n  D65, 1964_10: ΔE2000 (\S+)", said) < 0.01
    assert number(r"A, 1964_10: ΔE2000 (\S+) .*greyer", said) > 0.8
    assert "</html>" in (tmp_path / "match.html").read_text(encoding="utf-8")


NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def test_notebooks_are_kept_without_what_they_print():
    """One for each role that the site begins with."""
    assert [path.stem for path in NOTEBOOKS] == ["designer", "developer", "laboratory"]
    for path in NOTEBOOKS:
        cells = [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
        assert cells and not any(cell["outputs"] or cell["execution_count"] for cell in cells), path.name


@pytest.mark.slow
def test_notebooks_run_as_they_stand(monkeypatch, tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    # A kernel ends within seconds, but not on a machine that is busy.
    config = pytest.importorskip("traitlets.config").Config({"KernelManager": {"shutdown_wait_time": patient(120)}})
    options, told = {"timeout": round(patient(120)), "kernel_name": "python3", "config": config}, {}
    for path in NOTEBOOKS:
        made = nbclient.NotebookClient(nbformat.read(path, 4), **options).execute(cwd=tmp_path)
        outputs = [output for cell in made.cells for output in cell.get("outputs", ())]
        assert not [output.text for output in outputs if output.get("name") == "stderr"], path.name
        shown = [kind for output in outputs for kind in output.get("data", ())]
        told[path.stem] = "".join(output.get("text", "") for output in outputs), shown
    designer, shown = told["designer"]
    assert number(r"D65 +ΔE94 ([\d.]+)", designer) == 0.0 < 2.0 < number(r"A +ΔE94 ([\d.]+)", designer)
    assert number(r"beside the reference: mean ([\d.]+)", designer) < 0.05
    assert number(r"beside the master: +mean ([\d.]+)", designer) > 2.0 and shown.count("image/png") == 2
    laboratory, shown = told["laboratory"]
    assert "what was measured?" in laboratory and "1 of 3 passes under every light" in laboratory
    assert re.findall(r"readings/(\S+): ΔE94", laboratory)[0] == "lot-2" and shown.count("text/html") == 3
    developer, shown = told["developer"]
    found = [(float(budget), float(p99)) for budget, p99 in re.findall(r"budget ([\d.]+): p99 ([\d.]+)", developer)]
    assert len(found) == 3 and all(p99 <= budget for budget, p99 in found) and "image/png" in shown


def test_python_of_the_docs(tiny_catalogue, monkeypatch):
    snippets = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(encoding="utf-8"), re.S)
    assert len(snippets) == 7
    monkeypatch.chdir(tiny_catalogue)
    # A smaller picture: its size is not what is shown. The one material of this catalogue is on the sphere.
    text = (ROOT / "examples" / "sphere.toml").read_text(encoding="utf-8").replace("= 256", "= 32")
    Path("sphere.toml").write_text(re.sub(r'material = "[^"]*"', 'material = "mine/dye"', text), encoding="utf-8")
    known = {}
    for snippet in snippets:
        exec(compile(snippet.replace('metamer.shipped_scene("sphere")', '"sphere.toml"'), "python.md", "exec"), known)
    assert known["dyes"]["dye"].samples == pytest.approx(known["dye"].samples, abs=1e-5)
    assert "sample 1" in known["report"].summary and known["lot"].verdict == "pass"
    assert known["picture"].xyz.shape == (32, 32, 3)


def test_python_of_the_readme(tiny_catalogue, monkeypatch):
    snippets = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.S)
    assert snippets
    monkeypatch.chdir(tiny_catalogue)
    known = {}
    for snippet in snippets:
        exec(compile(snippet, "README.md", "exec"), known)
    # By hand, Ashikhmin and Shirley 2000, eq. 3 to 5: half angle 22.5 degrees, light at 45, seen along the normal.
    half = np.pi / 8
    fresnel = 0.04 + 0.96 * (1 - np.cos(half)) ** 5
    gloss = np.pi * 26 / (8 * np.pi) * np.cos(half) ** 25 * fresnel / np.cos(half)
    body = 28 / 23 * 0.96 * (1 - (1 - np.cos(np.pi / 4) / 2) ** 5) * (1 - 0.5**5)
    weights = observer("1931_2").weights(illuminant("FL11"), WORKING_WAVELENGTHS_NM)
    expected = weights @ (body * RED + gloss)
    np.testing.assert_allclose(known["red"].xyz("FL11"), expected, rtol=1e-9)
    assert expected[0] > expected[1] > expected[2]
    assert known["picture"].xyz.shape == (256, 256, 3) and known["picture"].coverage[128, 128] == 1
    assert (tiny_catalogue / "red.png").read_bytes().startswith(b"\x89PNG")
