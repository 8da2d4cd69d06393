"""Probes: the colour of the picture, spectra of the original data, and points that stay on their surfaces."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.environment.booth import light_booth
from metamer.lighting.reference.reference import reference_images
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.record import MARKER, write_record
from metamer.runtime.errors import InputError
from metamer.spectral.bispectral import fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.display.transform import DISPLAY_WHITE_XYZ, DisplayTransform
from metamer.viewer.picture import picture
from metamer.viewer.software.backend import software_session
from metamer.viewer.window.displayed_value import displayed
from metamer.viewer.window.picking import Picker
from metamer.viewer.window.places import Pin
from metamer.viewer.window.probe import FAST, ORIGINAL, Prober
from metamer.viewer.window.state import Adaptation
from metamer.viewer.window.viewpoint import Viewpoint, orbited

# Parity with the headless renderer that probes are held to.
PARITY = 0.05
BALL, FLOOR = "part0", "part2"


@pytest.fixture(scope="module")
def catalogue(tiny_catalogue):
    return Catalogue.open(tiny_catalogue)


@pytest.fixture(scope="module")
def scene(scenes):
    found = scenes.lamp_scene("tiny/copper", 24)
    return found.with_material("part1", "tiny/satin-green").with_material(FLOOR, "tiny/rough-blue")


@pytest.fixture(scope="module")
def headless(scene, catalogue):
    return picture(scene, catalogue, None, software_session())


@pytest.fixture(scope="module")
def prober(scene, catalogue):
    return Prober(scene, catalogue)


def folded(scene, spectra):
    """XYZ of what a probe says that leaves, by the trapezoid rule on its own wavelengths."""
    eye, nm = scene.observer, spectra.wavelengths_nm
    functions = np.stack([np.interp(nm, eye.wavelengths_nm, one, 0.0, 0.0) for one in eye.cmfs.T])
    even = np.trapezoid(eye.cmfs[:, 1], eye.wavelengths_nm)
    return np.trapezoid(functions * spectra.reflected, nm, axis=1) / even


def test_probes_have_the_colour_of_the_headless_picture(scene, headless, prober):
    lit = headless.coverage > 0.99
    worst, seen = 0.0, set()
    for row in range(1, 24, 4):
        for column in range(0, 24, 4):
            reading = prober.at(scene.camera(), column, row)
            assert reading.coverage == pytest.approx(headless.coverage[row, column], abs=1e-6)
            if lit[row, column]:
                off = delta_e_xyz(headless.xyz[row, column].astype(float), reading.xyz, headless.white)
                worst, seen = max(worst, float(off)), seen | set(reading.materials)
    assert worst <= PARITY and seen == {"tiny/copper", "tiny/satin-green", "tiny/rough-blue"}


def test_spectra_are_those_that_the_reference_sees(scene, catalogue, prober):
    """Folded, they come to its XYZ; what arrives, to what the perfect diffuser would show."""
    surfaces = {name: catalogue.surface(name).surface() for name in scene.material_ids}
    found = reference_images(scene, None, surfaces).xyz[0]
    checked = 0
    for row, column in ((12, 12), (20, 6), (21, 20), (8, 15), (14, 10)):
        reading = prober.at(scene.camera(), column, row)
        assert reading.spectra.made_of == ORIGINAL
        np.testing.assert_allclose(folded(scene, reading.spectra), found[row, column], rtol=2e-3, atol=1e-6)
        checked += found[row, column].max() > 0.01
    assert checked >= 3


def test_a_matt_surface_has_its_own_reflectance_under_any_light(scene, catalogue, prober):
    surface = catalogue.surface("tiny/matt-red").surface()
    one = scene.with_material(FLOOR, "tiny/matt-red").with_illuminant(illuminant("FL11"), "FL11")
    prober.turn_to(one)
    spectra = prober.at(one.camera(), 4, 21).spectra
    at_own = np.interp(surface.wavelengths_nm, spectra.wavelengths_nm, spectra.reflectance)
    inside = (surface.wavelengths_nm >= 360.0) & (surface.wavelengths_nm <= 830.0)
    np.testing.assert_allclose(at_own[inside], surface.reflectance.samples[inside], atol=1e-9)
    np.testing.assert_allclose(spectra.reflected, spectra.incident * spectra.reflectance, atol=1e-12)
    prober.turn_to(scene)


def test_what_a_probe_reads_against_the_reference_is_the_error_of_the_fast_form(scene, prober):
    reading = prober.at(scene.camera(), 12, 20)
    truth = prober.truth(scene.camera(), reading)
    assert truth.noise is None
    assert truth.delta_e == pytest.approx(float(delta_e_xyz(truth.xyz, reading.xyz, reading.white)))
    assert truth.delta_e < 2.0


def test_colours_are_told_in_every_way(prober, scene):
    reading = prober.at(scene.camera(), 4, 21)
    x, y = reading.xy
    assert reading.xyz[0] == pytest.approx(reading.xyz[1] * x / y)
    lightness, chroma, hue = reading.lch
    a, b = chroma * np.cos(np.radians(hue)), chroma * np.sin(np.radians(hue))
    np.testing.assert_allclose(reading.lab, [lightness, a, b], atol=1e-9)
    assert 0.0 <= hue < 360.0


def test_nothing_is_told_where_nothing_is_seen(scenes, catalogue):
    scene = scenes.sphere_scene("tiny/copper", 16)
    reading = Prober(scene, catalogue).at(scene.camera(), 0, 0)
    assert reading.parts == () and reading.coverage == 0.0 and reading.spectra is None and reading.xy is None
    with pytest.raises(InputError, match="no pixel of the picture"):
        Prober(scene, catalogue).at(scene.camera(), 16, 0)


def test_under_a_booth_spectra_are_of_the_fast_form_and_fold_to_the_picture_s_colour(scenes, catalogue):
    scene = replace(scenes.sphere_scene("tiny/satin-green", 16), lights=(light_booth("TL84"),))
    headless = picture(scene, catalogue, None, software_session())
    prober = Prober(scene, catalogue)
    reading = prober.at(scene.camera(), 8, 5)
    assert reading.spectra.made_of == FAST
    assert float(delta_e_xyz(headless.xyz[5, 8].astype(float), reading.xyz, headless.white)) <= PARITY
    assert float(delta_e_xyz(reading.xyz, folded(scene, reading.spectra), reading.white)) < 0.5
    assert np.nanmin(reading.spectra.reflectance) > 0.0 and np.nanmax(reading.spectra.reflectance) < 1.5
    truth = prober.truth(scene.camera(), reading)
    assert truth.noise is not None and truth.noise < 0.5 and truth.delta_e < 2.0


def test_what_fluoresces_sends_back_more_than_its_reflectance(scenes, tmp_path):
    nm = np.arange(300.0, 781.0, 10.0)
    dye = fluorophore(
        Spectrum.sampled(nm, np.full(len(nm), 0.3)),
        0.5 * np.exp(-(((nm - 400.0) / 30.0) ** 2)),
        np.exp(-(((nm - 560.0) / 30.0) ** 2)),
        0.8,
    )
    brdf = FluorescentLambert(dye)
    said = Provenance("made for tests", "CC0-1.0", "analytic")
    (tmp_path / "cat").mkdir()
    (tmp_path / "cat" / MARKER).write_text("schema = 2\n")
    record = MaterialRecord("dye/yellow", "dye", brdf.NAME, brdf.parameters(), said, brdf.own_form())
    (tmp_path / "cat" / "dye").mkdir()
    write_record(record, tmp_path / "cat" / "dye" / "yellow.h5")
    catalogue = Catalogue(tmp_path / "cat")
    scene = scenes.sphere_scene("dye/yellow", 12)
    prober = Prober(scene, catalogue)
    reading = prober.at(scene.camera(), 6, 5)
    spectra = reading.spectra
    np.testing.assert_allclose(folded(scene, spectra), reading.xyz, rtol=5e-3)
    glow = spectra.reflected / spectra.incident
    near = np.argmin(np.abs(spectra.wavelengths_nm - 560.0))
    assert glow[near] > 1.2 * spectra.reflectance[near]
    assert float(delta_e_xyz(prober.truth(scene.camera(), reading).xyz, reading.xyz, reading.white)) < 0.05


def test_a_pin_stays_on_its_surface_whatever_the_camera(scene, catalogue):
    picker, camera = Picker(scene), scene.camera()
    pin = picker.pin(camera, 12.4, 12.6, "nose")
    assert pin.part == BALL and picker.sight(camera, pin).pixel == (12, 12)
    for degrees in (-30.0, 20.0, 40.0):
        turned = orbited(Viewpoint.of(camera), degrees, 5.0).camera(48, 48, 3)
        column, row = picker.sight(turned, pin).pixel
        again = picker.pin(turned, column + 0.5, row + 0.5, "again")
        assert again.part == BALL
        assert np.linalg.norm(again.position(scene) - pin.position(scene)) < 0.1
    behind = orbited(Viewpoint.of(camera), 180.0).camera(48, 48, 3)
    assert picker.sight(behind, pin) == replace(picker.sight(behind, pin), pixel=None, why=f"hidden by {BALL}")


def test_a_pin_tells_why_it_is_not_seen(scene):
    picker = Picker(scene)
    pin = Pin("p", FLOOR, 0, (0.2, 0.3, 0.5))
    away = Viewpoint("away", (0.0, 5.0, 50.0), (0.0, 5.0, 100.0)).camera(16, 16)
    assert picker.sight(away, pin).why == "behind the camera"
    beside = Viewpoint("beside", (0.0, 0.0, 50.0), (40.0, 0.0, 0.0)).camera(16, 16)
    assert picker.sight(beside, pin).why == "outside of the picture"
    assert picker.pin(scene.camera(), 12.0, 0.2, "sky") is None
    with pytest.raises(InputError, match="no such triangle"):
        picker.sight(away, replace(pin, triangle=10**6))
    flat = Viewpoint("flat", (0.0, 4.0, 4.0), projection="orthographic", extent=9.0).camera(32, 32, 2)
    seen = picker.pin(flat, 18.2, 17.9, "flat")
    assert picker.sight(flat, seen).pixel == (18, 17)


def test_white_is_shown_as_white_and_what_is_brighter_as_clipped():
    display, white = DisplayTransform(), observer("1931_2").white(illuminant("A"))
    shown = displayed(white, white, display, Adaptation())
    assert shown.codes == (255, 255, 255) and shown.clipped == ""
    assert displayed(2.0 * white, white, display, Adaptation()).clipped == "R above, G above, B above"
    assert displayed(white, white, display, Adaptation(), exposure=-1.0).codes == (188, 188, 188)
    assert displayed(white, white, display, Adaptation(degree=0.0)).clipped == "R above"
    behind = displayed(np.zeros(3), white, display, Adaptation(), surround=50.0, coverage=0.0)
    assert behind.codes == (119, 119, 119)
    assert "below" in displayed(np.array([0.1, 0.4, 0.1]), DISPLAY_WHITE_XYZ, display, Adaptation()).clipped


def test_a_probe_goes_on_with_another_light_and_observer(scene, catalogue):
    prober = Prober(scene, catalogue)
    before = prober.at(scene.camera(), 4, 21)
    other = replace(scene.with_illuminant(illuminant("FL11"), "FL11"), observer=observer("2015_10"))
    prober.turn_to(other)
    after, fresh = prober.at(other.camera(), 4, 21), Prober(other, catalogue).at(other.camera(), 4, 21)
    np.testing.assert_array_equal(after.xyz, fresh.xyz)
    assert after.light == "FL11" and after.observer != before.observer
    with pytest.raises(InputError, match="unknown material"):
        prober.turn_to(other.with_material(BALL, "tiny/none"))
    np.testing.assert_array_equal(prober.at(other.camera(), 4, 21).xyz, fresh.xyz)
