"""Fluorescent materials from a bispectral picture through the catalogue to pictures."""

import numpy as np
import pytest
from metamer.cli.main import main
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.reference.reference import reference_image
from metamer.lighting.scene import Part, Scene
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.fitting.fit import fit
from metamer.materials.formats.bispectral import MOST_SURFACES, read_bispectral
from metamer.materials.intake.importing import import_sources
from metamer.runtime.errors import InputError
from metamer.spectral.bispectral import fluorophore
from metamer.spectral.folding import Folding
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.palette import DonaldsonPalette
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.software.backend import software_session
from pictures import read_xyz_exr

NM = np.arange(380.0, 781.0, 20.0)
EYE = observer("1931_2")


def dye(absorbed, sent):
    bumps = (np.exp(-(((NM - centre) / 35.0) ** 2)) for centre in (absorbed, sent))
    return fluorophore(Spectrum.sampled(NM, np.full(NM.size, 0.25)), 0.6 * next(bumps), next(bumps), 0.9)


DYES = (dye(440, 520), dye(500, 600))


def write_picture(path, pixels):
    """A bispectral picture (1,W) of matrices (W,L,L)."""
    channels = {}
    for row, column in np.argwhere(np.tril(np.ones((NM.size, NM.size)))):
        name = f"T.{NM[column]:.1f}nm".replace(".", ",").replace(",", ".", 1)
        name += "" if row == column else f".{NM[row]:.1f}nm".replace(".", ",").replace(",", ".", 1)
        channels[name] = np.array([[matrix[row, column] for matrix in pixels]], np.float32)
    write_exr(path, {}, channels)


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory):
    folder = tmp_path_factory.mktemp("notes")
    write_picture(folder / "Notes.exr", [DYES[i].matrix for i in (1, 1, 0, 1)])
    report = import_sources([folder / "Notes.exr"], folder / "catalogue", jobs=1)
    assert [outcome.status for outcome in report.outcomes] == ["imported", "imported"], report
    return Catalogue.open(folder / "catalogue")


def scene_of(material):
    camera = Camera(projection="orthographic", width=32, height_px=32, samples=2)
    lamp = DirectionalLight((1.0, 1.0, 2.0), illuminant("D65"), illuminance_lux=1000.0)
    return Scene((Part("ball", sphere(4), material),), (lamp,), (camera,), EYE)


def test_one_material_a_distinct_pixel_in_order(catalogue):
    assert catalogue.ids() == ("measured/notes-1", "measured/notes-2")
    for name, truth in zip(catalogue.ids(), (DYES[1], DYES[0]), strict=True):
        np.testing.assert_allclose(catalogue.load(name).brdf().bispectral.matrix, truth.matrix, atol=1e-7)


def test_what_is_stored_still_shines(catalogue):
    record = catalogue.load("measured/notes-1")
    (pack,) = record.summands
    assert isinstance(pack.palette, DonaldsonPalette)
    assert record.error.maximum < 1e-6
    for name in ("D65", "A", "FL11"):
        expected = record.brdf().bispectral.fold(illuminant(name), EYE)
        np.testing.assert_array_equal(pack.palette.folded(Folding(EYE, [illuminant(name)]))[0, 0], expected)
        assert (expected > record.brdf().bispectral.without_emission().fold(illuminant(name), EYE)).all()


def test_picture_from_the_catalogue_is_the_reference(catalogue):
    record, scene = catalogue.load("measured/notes-2"), scene_of("measured/notes-2")
    truth, _ = reference_image(scene, None, {record.id: record.brdf()})
    with software_session() as renderer:
        shown, _ = renderer.render(scene, None, {record.id: record.drawn()})
    assert np.percentile(np.abs(truth - shown), 99) < 1e-3


def test_a_second_import_changes_nothing(catalogue):
    report = import_sources([catalogue.folder.parent / "Notes.exr"], catalogue.folder, jobs=1)
    assert [outcome.status for outcome in report.outcomes] == ["skipped", "skipped"]


def test_a_fit_that_would_lose_the_emission_is_refused():
    with pytest.raises(InputError, match="not fitted"):
        fit(FluorescentLambert(DYES[0]), pixels=16)


def test_pictures_that_give_no_material(tmp_path):
    write_exr(tmp_path / "plain.exr", {}, {f"T.{nm},0nm": np.full((1, 1), 0.5, np.float32) for nm in (400, 500)})
    with pytest.raises(InputError, match="no re-radiation"):
        read_bispectral(tmp_path / "plain.exr")
    write_picture(tmp_path / "many.exr", [DYES[0].matrix * x for x in np.linspace(0.5, 1.0, MOST_SURFACES + 1)])
    with pytest.raises(InputError, match="too many different pixels"):
        read_bispectral(tmp_path / "many.exr")
    broken = DYES[0].matrix.copy()
    broken[:, 3] = 0.5
    broken = np.tril(broken)
    write_picture(tmp_path / "broken.exr", [DYES[0].matrix, broken])
    with pytest.raises(InputError, match=r"broken.exr: pixel \(0, 1\): more power"):
        read_bispectral(tmp_path / "broken.exr")


SCENE = """
[[part]]
name = "ball"
shape = "sphere"
material = "measured/bispectral-1"

[[light]]
kind = "directional"
direction_to_light = [1, 1, 2]
illuminance_lux = 1000
spectrum = "uv_free.csv"

[[camera]]
name = "front"
projection = "orthographic"
position = [0, 0, 4]
target = [0, 0, 0]
height = 2.2
width = 24
height_px = 24
"""


@pytest.mark.slow
def test_command_imports_and_renders_the_real_picture(shared_data, tmp_path):
    """Import, render under three lights, and the slow truth of the same scene."""

    def metamer(*words):
        assert main([*map(str, words)]) == 0, words

    source = shared_data / "spectra" / "exr" / "BiSpectral.exr"
    metamer("catalogue", "import", source, "--into", tmp_path / "cat", "--jobs", 1)
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    nm = np.arange(300.0, 831.0)
    power = np.where(nm <= 400, 0.0, illuminant("D65").resampled(nm).samples)
    rows = [f"{wavelength:g},{value:.6f}" for wavelength, value in zip(nm, power, strict=True)]
    (tmp_path / "uv_free.csv").write_text("\n".join(["wavelength_nm,lamp", *rows]) + "\n", encoding="utf-8")
    for light in (("--illuminant", "D65"), ("--illuminant", "A"), ()):
        common = ("render", tmp_path / "scene.toml", "--catalogue", tmp_path / "cat", *light)
        metamer(*common, "-o", tmp_path / "fast.exr", "--renderer", "software")
        metamer(*common, "-o", tmp_path / "slow.exr", "--reference")
        fast, slow = (read_xyz_exr(tmp_path / name)[0].values for name in ("fast.exr", "slow.exr"))
        assert slow.max() > 0.3
        assert np.percentile(np.abs(fast - slow), 99) < 2e-3
