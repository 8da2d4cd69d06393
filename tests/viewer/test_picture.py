"""Pictures to files: spectra fold back to the XYZ picture, and what is assumed is said."""

from dataclasses import replace
from importlib.metadata import version

import numpy as np
import pytest
from metamer.calibration.report.statistics import compared_pixels
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.factored.pack import FactoredBrdf
from metamer.runtime.errors import ComparisonError, InputError, UnknownNameError, UsageError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formats.exr import read_exr
from metamer.spectral.formats.spectral_exr import read_spectral_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.picture import Picture, check_output, lit_by, picture, reference_picture, render_spectral
from metamer.viewer.render.session import radiance_weights
from metamer.viewer.software.backend import software_session

# Between 5 nm samples, a product of light and reflectance is no longer what the two are one by one.
FOLDED_DELTA_E94 = 0.1
NM = WORKING_WAVELENGTHS_NM


@pytest.fixture(scope="module")
def software():
    return software_session()


def folded(values, scene):
    return values.astype(np.float64) @ radiance_weights(scene.observer, WORKING_WAVELENGTHS_NM).T


@pytest.mark.parametrize("name", ["D65", "A", "FL11"])
@pytest.mark.parametrize("material", ["gloss", "woven"])
def test_spectra_fold_to_the_xyz_picture(scenes, software, material, name):
    scene = lit_by(scenes.sphere_scene(material, size=32, samples=2), name)
    spectra = software.render_spectra(scene, None, scenes.SURFACES, WORKING_WAVELENGTHS_NM)
    assert spectra.shape == (32, 32, 81) and spectra.dtype == np.float32
    xyz, _ = software.render(scene, None, scenes.SURFACES)
    delta = delta_e_xyz(xyz.astype(np.float64), folded(spectra, scene), scene.adopted_white(), "CIE 1994")
    at = np.unravel_index(np.argmax(delta), delta.shape)
    assert delta.max() < FOLDED_DELTA_E94, (at, delta[at], xyz[at], folded(spectra, scene)[at])


def test_spectra_of_two_lights_and_three_parts_add_up(scenes, software):
    """Each light is scaled by itself: the sum of what they send, and not the mixture, has Y = 1 for each."""
    scene = scenes.lamp_scene(size=32, samples=2)
    spectra = software.render_spectra(scene, None, scenes.SURFACES, WORKING_WAVELENGTHS_NM)
    xyz, _ = software.render(scene, None, scenes.SURFACES)
    delta = delta_e_xyz(xyz.astype(np.float64), folded(spectra, scene), scene.adopted_white(), "CIE 1994")
    assert delta.max() < FOLDED_DELTA_E94


def test_gl_renders_the_same_spectra(scenes, software, gl):
    scene = scenes.lamp_scene(size=32, samples=2)
    renderer = gl_session(gl)
    try:
        theirs = renderer.render_spectra(scene, None, scenes.SURFACES, WORKING_WAVELENGTHS_NM)
    finally:
        renderer.close()
    mine = software.render_spectra(scene, None, scenes.SURFACES, WORKING_WAVELENGTHS_NM)
    np.testing.assert_allclose(theirs, mine, rtol=1e-3, atol=1e-4 * mine.max())


def test_perfect_diffuser_under_equal_energy_is_one(scenes, software):
    scene = lit_by(scenes.sphere_scene("white", size=16, samples=1), "E")
    packs = {"white": FactoredBrdf((scenes.lambert_pack(np.ones(81)),))}
    spectra = software.render_spectra(scene, None, packs, WORKING_WAVELENGTHS_NM)
    xyz, _ = software.render(scene, None, packs)
    brightest = np.unravel_index(np.argmax(xyz[..., 1]), xyz.shape[:2])
    np.testing.assert_allclose(spectra[brightest], xyz[brightest][1], rtol=1e-5)
    assert 0.9 < xyz[brightest][1] <= 1.0


def test_any_wavelengths_and_any_basis(scenes, software):
    """A number of wavelengths that is no multiple of three, and packs that a plan has projected."""
    grid = np.arange(400.0, 701.0, 10.0)
    lamp = Spectrum.sampled(grid, illuminant("D65").resampled(grid).samples, "emission")
    scene = scenes.sphere_scene("matt", size=16, samples=1).with_illuminant(lamp, "lamp")
    spectra = software.render_spectra(scene, None, scenes.SURFACES, grid)
    fine = software.render_spectra(scene, None, scenes.SURFACES, WORKING_WAVELENGTHS_NM)
    ratio = spectra[8, 8] / fine[8, 8, 4:65:2]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-5)


def test_a_line_between_wavelengths_is_shared_out_between_its_neighbours(scenes, software):
    """A laser at 532 nm: none of the 81 samples meets it, and all of its light stands in two of them."""
    scene = scenes.sphere_scene("matt", size=16, samples=1)
    line = Spectrum.sampled([531.9, 532.0, 532.1], [0.0, 1.0, 0.0], "emission")
    laser = scene.with_illuminant(line, "laser")
    spectra = software.render_spectra(
        laser, None, {"matt": FactoredBrdf((scenes.lambert_pack(np.full(81, 0.5)),))}, NM
    )[8, 8]
    assert spectra[NM == 530] / spectra[NM == 535] == pytest.approx(1.5, rel=1e-3)
    assert np.count_nonzero(spectra) == 2
    xyz, _ = software.render(laser, None, {"matt": FactoredBrdf((scenes.lambert_pack(np.full(81, 0.5)),))})
    np.testing.assert_allclose(radiance_weights(scene.observer, NM) @ spectra, xyz[8, 8], rtol=0.02)


def test_a_lamp_that_is_finer_than_the_picture_keeps_its_colour(scenes, software):
    """Narrow lines anywhere: every fifth sample makes another lamp of it, its means about them nearly the same one."""
    fine = np.arange(380.0, 780.1, 0.5)
    lines = sum(np.exp(-(((fine - at) / 0.8) ** 2)) for at in (404.7, 436.2, 487.9, 546.8, 577.3, 612.4, 651.8))
    lamp = Spectrum.sampled(fine, 0.02 + lines, "emission")
    eye, to_xyz = observer("1931_2"), radiance_weights(observer("1931_2"), NM)
    white = eye.white(lamp)
    off = []
    for thinned in (lamp.averaged(NM), lamp.resampled(NM)):
        found = to_xyz @ thinned.samples
        off.append(float(delta_e_xyz(white, found / found[1], white)))
    assert off[0] < 0.5 and off[1] > 10 * off[0], off
    assert lamp.averaged(fine) is lamp


def test_light_that_sends_nothing_at_any_wavelength_is_an_error(scenes, software):
    scene = scenes.sphere_scene("matt", size=16, samples=1)
    line = Spectrum.sampled([799.0, 800.0, 801.0], [0.0, 1.0, 0.0], "emission")
    with pytest.raises(InputError, match="sends nothing at these wavelengths"):
        software.render_spectra(scene.with_illuminant(line, "laser"), None, scenes.SURFACES, WORKING_WAVELENGTHS_NM)


def test_material_without_packs_is_an_error(scenes, software):
    with pytest.raises(UnknownNameError, match="unknown material"):
        software.render_spectra(scenes.sphere_scene(), None, {"matt": scenes.SURFACES["matt"]}, WORKING_WAVELENGTHS_NM)


@pytest.mark.parametrize("name", ["1931_2", "1964_10", "2015_2", "2015_10"])
def test_radiance_weights_give_equal_energy_the_white_of_e(name):
    eye = observer(name)
    white = radiance_weights(eye, WORKING_WAVELENGTHS_NM).sum(axis=1)
    assert white[1] == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(white, eye.white(illuminant("E")), atol=1e-6)


@pytest.fixture
def tiny(scenes, tiny_catalogue):
    return scenes.sphere_scene("tiny/satin-green", size=24, samples=2), Catalogue.open(tiny_catalogue)


def test_spectral_file_reads_back(tiny, software, tmp_path):
    scene, catalogue = tiny
    notes = render_spectral(scene, catalogue, tmp_path / "ball.exr", None, software)
    assert notes == ()
    read = read_spectral_exr(tmp_path / "ball.exr")
    packs = {"tiny/satin-green": catalogue.load("tiny/satin-green").drawn()}
    values = software.render_spectra(scene, None, packs, WORKING_WAVELENGTHS_NM)
    np.testing.assert_array_equal(read.spectrum.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    np.testing.assert_array_equal(read.spectrum.samples, values)
    assert read.units == "relative, 1 for the perfect diffuser under equal energy"


def test_preview_in_the_spectral_file_is_as_bright_as_the_picture(tiny, software, tmp_path):
    scene, catalogue = tiny
    render_spectral(scene, catalogue, tmp_path / "ball.exr", None, software)
    _, channels = read_exr(tmp_path / "ball.exr")
    xyz, _ = software.render(scene, None, {"tiny/satin-green": catalogue.load("tiny/satin-green").drawn()})
    luminance = 0.2126 * channels["R"] + 0.7152 * channels["G"] + 0.0722 * channels["B"]
    np.testing.assert_allclose(luminance, xyz[..., 1], atol=2e-3)


def test_light_finer_than_the_picture_is_said(tiny, software, tmp_path):
    scene, catalogue = tiny
    grid = np.arange(380.0, 781.0)
    comb = Spectrum.sampled(
        grid, np.where((grid == 612) | (grid % 5 == 0), 1.0, 0.0) + 30.0 * (grid == 612), "emission"
    )
    (note,) = render_spectral(scene.with_illuminant(comb, "comb"), catalogue, tmp_path / "ball.exr", None, software)
    assert note.startswith("comb is finer than the 81 wavelengths of the picture") and "ΔE94" in note


@pytest.mark.parametrize(("name", "spectral"), [("a.jpg", False), ("a", False), ("a.exr.txt", False), ("a.png", True)])
def test_unknown_kinds_of_file(name, spectral, tmp_path):
    with pytest.raises(UsageError, match=name):
        check_output(tmp_path / name, spectral)


@pytest.mark.parametrize("name", ["a.exr", "a.EXR", "a.png"])
def test_known_kinds_of_file(tiny, software, tmp_path, name):
    scene, catalogue = tiny
    picture(scene, catalogue, None, software).write(tmp_path / name)
    assert (tmp_path / name).stat().st_size > 500


def test_headers_say_what_a_picture_is_of(tiny, software, tmp_path):
    scene, catalogue = tiny
    scene = lit_by(replace(scene, name="Kugel, grün"), "A")
    said = {
        "scene": "Kugel, grün",
        "camera": scene.camera().name,
        "material": "tiny/satin-green",
        "illuminant": "A",
        "observer": "CIE 1931 2 Degree Standard Observer",
        "renderer": software.made_by,
        "software": f"Metamer {version('metamer-colour')}",
    }
    picture(scene, catalogue, None, software).write(tmp_path / "a.exr")
    render_spectral(scene, catalogue, tmp_path / "s.exr", None, software)
    reference_picture(scene, catalogue, None).write(tmp_path / "r.exr")
    for name, maker in (("a", said["renderer"]), ("s", said["renderer"]), ("r", "reference: rays, every wavelength")):
        header, _ = read_exr(tmp_path / f"{name}.exr")
        assert header["renderer"].startswith(maker)
        assert {key: header[key] for key in said} == {**said, "renderer": header["renderer"]}


def test_difference_from_a_reference_is_that_of_pixels_both_show(scenes, software):
    scene = scenes.sphere_scene("gloss", size=16, samples=2)
    xyz, coverage = software.render(scene, None, scenes.SURFACES)
    truth = Picture(scene, scene.camera(), xyz, coverage, "one")
    lighter = replace(truth, xyz=1.1 * xyz, coverage=np.where(np.arange(16) < 8, coverage, 0.5 * coverage))
    off = lighter.difference(truth)
    seen = compared_pixels(np.minimum(coverage, lighter.coverage), xyz, lighter.xyz)
    expected = delta_e_xyz(xyz[seen].astype(np.float64), 1.1 * xyz[seen].astype(np.float64), truth.white, "CIE 1994")
    assert off.pixels == seen.sum() > 20 and off.mean == pytest.approx(expected.mean(), abs=1e-4)
    assert off.max == pytest.approx(expected.max(), abs=1e-4)
    # CIE 1994 weighs by the chroma of the reference.
    assert truth.difference(lighter).mean != off.mean
    for other, said in ((truth, "itself"), (replace(truth, scene=lit_by(scene, "A")), "unlike lights")):
        with pytest.raises(ComparisonError, match=said):
            truth.difference(other)
