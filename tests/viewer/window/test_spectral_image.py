"""Spectral pictures under any light and observer: as the spectra themselves would be folded."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime import memory
from metamer.runtime.errors import InputError
from metamer.spectral.bispectral import Bispectral, fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.spectral_exr import (
    RELATIVE_UNITS,
    write_bispectral_exr,
    write_spectral_exr,
    write_spectral_texture,
)
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import OBSERVERS, observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from metamer.viewer.picture import picture, render_spectral
from metamer.viewer.render.session import radiance_weights
from metamer.viewer.software.backend import software_session
from metamer.viewer.window.image_frame import ImageFrame
from metamer.viewer.window.image_probe import image_reading
from metamer.viewer.window.light_choice import LightChoice
from metamer.viewer.window.spectral_image_file import picture_memory, read_spectral_picture
from metamer.viewer.window.state import Session

NM = WORKING_WAVELENGTHS_NM
RNG = np.random.default_rng(3)
VALUES = 0.05 + 0.9 * RNG.random((5, 7, len(NM)))
D65, A = illuminant("D65"), illuminant("A")


@pytest.fixture
def reflectance(tmp_path):
    write_spectral_exr(tmp_path / "r.exr", Spectrum.sampled(NM, VALUES, "reflectance"))
    return read_spectral_picture(tmp_path / "r.exr")


@pytest.mark.parametrize("who", OBSERVERS)
@pytest.mark.parametrize("light", ["D65", "A", "FL11"])
def test_reflectances_fold_as_the_observer_folds_each(reflectance, who, light):
    eye, power = observer(who), illuminant(light)
    found = reflectance.folded(eye, power)
    wanted = VALUES @ eye.weights(power, NM).T
    np.testing.assert_allclose(found.values, wanted, rtol=2e-5)
    np.testing.assert_array_equal(found.white_xyz, eye.white(power))
    assert reflectance.kind == "reflectance" and found.values.dtype == np.float32


def test_values_are_read_as_they_lie_in_the_file(reflectance):
    np.testing.assert_array_equal(reflectance.spectrum(2, 3), VALUES[2, 3].astype(np.float32).astype(float))
    mean = VALUES[1:3, 2:6].astype(np.float32).mean(axis=(0, 1), dtype=float)
    np.testing.assert_allclose(reflectance.region(slice(1, 3), slice(2, 6)), mean, rtol=1e-6)
    np.testing.assert_array_equal(reflectance.wavelengths_nm, NM)


@pytest.fixture(scope="module")
def rendered(scenes, tiny_catalogue, tmp_path_factory):
    """A scene's spectral picture in D65, and its XYZ in D65 and A, as it is drawn in each."""
    scene = scenes.sphere_scene("tiny/satin-green", 24)
    catalogue, renderer = Catalogue.open(tiny_catalogue), software_session()
    scene = replace(scene, lights=tuple(light.with_spectrum(D65, "D65") for light in scene.lights))
    path = tmp_path_factory.mktemp("rendered") / "s.exr"
    render_spectral(scene, catalogue, path, None, renderer)
    lit = scene.with_illuminant(A, "A")
    return (
        read_spectral_picture(path),
        picture(scene, catalogue, None, renderer),
        picture(lit, catalogue, None, renderer),
    )


def test_a_rendered_picture_has_the_colours_that_the_renderer_gives_in_its_own_light_and_in_another(rendered):
    spectral, in_d65, in_a = rendered
    assert spectral.relative and spectral.light == "D65" and spectral.notes == ()
    for found, wanted in (
        (spectral.folded(in_d65.scene.observer), in_d65),
        (spectral.folded(in_a.scene.observer, A), in_a),
    ):
        off = delta_e_xyz(wanted.xyz.astype(float), found.values.astype(float), wanted.white)
        assert off.max() < 0.2
        assert float(delta_e_xyz(wanted.white, found.white_xyz, wanted.white)) < 0.1


def test_the_spectrum_that_is_probed_has_the_colour_beside_it(gl, rendered, tiny_catalogue):
    spectral, in_d65, _ = rendered
    frame = ImageFrame(gl, spectral, Catalogue.open(tiny_catalogue))
    weights = radiance_weights(in_d65.scene.observer, spectral.wavelengths_nm)
    for name in ("D65", "A"):
        choice = replace(LightChoice.named(name), dimming=0.5)
        reading = image_reading(frame, Session(), 0, choice, "1931_2", (12, 10))
        assert reading.xyz[1] > 0.01 and np.isnan(reading.spectra.reflectance).all()
        np.testing.assert_allclose(weights @ reading.spectra.reflected, reading.xyz, rtol=1e-9)
    frame.release()


def test_a_lamp_that_the_own_one_cannot_be_replaced_by_is_refused(rendered):
    spectral, in_d65, _ = rendered
    line = Spectrum.sampled(NM, np.where(np.abs(NM - 550.0) < 20.0, 1.0, 0.0), "emission")
    with pytest.raises(InputError) as raised:
        spectral.folded(in_d65.scene.observer, D65, own_light=line)
    assert "sends nothing at 380" in raised.value.found


def test_emission_in_absolute_units_asks_for_the_white_s_luminance_and_light(tmp_path):
    radiance = np.ones((1, 2, len(NM)))
    write_spectral_exr(tmp_path / "e.exr", Spectrum.sampled(NM, radiance, "emission"))
    emission, eye = read_spectral_picture(tmp_path / "e.exr"), observer("1931_2")
    with pytest.raises(InputError, match="in which light was this made"):
        emission.folded(eye)
    with pytest.raises(InputError, match="how bright is white"):
        emission.folded(eye, own_light=D65)
    # 683.002 lm/W times the integral of y-bar: radiance 1 W/(m^2 sr nm) of equal energy.
    luminance = 683.002 * float(np.trapezoid(eye.cmfs[:, 1], eye.wavelengths_nm))
    folded = emission.folded(eye, own_light=illuminant("E"), luminance=luminance)
    np.testing.assert_allclose(folded.values[0, 0], folded.white_xyz, rtol=1e-5)


def test_a_luminance_that_nothing_asks_for_is_refused(rendered, reflectance):
    for one in (rendered[0], reflectance):
        with pytest.raises(InputError, match="nothing asks for"):
            one.folded(observer("1931_2"), D65, luminance=100.0)


def test_a_reflectance_without_a_light_has_no_colour(reflectance):
    with pytest.raises(InputError, match="no colour without a light"):
        reflectance.folded(observer("1931_2"))


def test_what_fluoresces_folds_as_its_donaldson_matrix(tmp_path):
    nm = np.arange(360.0, 761.0, 20.0)
    dye = fluorophore(
        Spectrum.sampled(nm, np.full(len(nm), 0.4)),
        0.5 * np.exp(-(((nm - 420.0) / 40.0) ** 2)),
        np.exp(-(((nm - 560.0) / 40.0) ** 2)),
        0.7,
    )
    write_bispectral_exr(tmp_path / "f.exr", dye, (2, 3))
    found, eye = read_spectral_picture(tmp_path / "f.exr"), observer("1964_10")
    assert len(found.planes) > len(found.wavelengths_nm) == len(nm)
    for name in ("D65", "A", "FL2"):
        wanted = Bispectral(nm, nm, dye.matrix).fold(illuminant(name), eye)
        np.testing.assert_allclose(found.folded(eye, illuminant(name)).values[1, 2], wanted, rtol=1e-4)


def test_a_picture_that_does_not_fit_is_refused_in_numbers_before_it_is_read(reflectance, tmp_path, monkeypatch):
    cost = picture_memory(tmp_path / "r.exr")
    # R, G and B are read, too.
    assert cost.samples == 5 * 7 * (len(NM) + 3) and cost.reading == 8 * cost.samples == 2 * cost.kept
    monkeypatch.setattr(memory, "available_bytes", lambda: cost.reading - 1)
    with pytest.raises(InputError, match="not enough memory") as raised:
        read_spectral_picture(tmp_path / "r.exr")
    assert raised.value.file == tmp_path / "r.exr" and "while it is read" in raised.value.found
    monkeypatch.setattr(memory, "available_bytes", lambda: cost.reading)
    read_spectral_picture(tmp_path / "r.exr")


def test_what_holds_no_number_or_less_than_nothing_is_counted(tmp_path):
    values = VALUES.copy()
    values[0, 0, 3], values[1, 1, :2] = np.nan, -0.1
    write_spectral_texture(tmp_path / "n.exr", values, NM, False)
    found = read_spectral_picture(tmp_path / "n.exr")
    assert found.notes == (f"1 of {values.size} values are no numbers", f"2 of {values.size} values are below 0")
    xyz = found.folded(observer("1931_2"), D65).values
    assert np.isnan(xyz[0, 0]).all() and np.isfinite(xyz[1:]).all()


@pytest.mark.parametrize(
    ("channels", "problem"),
    [
        ({"R": 1.0}, "no spectral channels"),
        ({"T.500,0nm": 0.5}, "one wavelength"),
        ({"T.500,0nm": 0.5, "S0.600,0nm": 0.5}, "emission and reflectance"),
        ({"T.500,0nm": 0.5, "T.600,0nm": 0.5, "a.T.500,0nm": 0.5}, "the same"),
        ({"T.500,0nm": 0.5, "T.600,0nm": 0.5, "T.500,0nm.700,0nm": 0.1}, "re-radiation"),
        ({"T.500,0nm": 0.5, "T.600,0nm": 0.5, "T.500,0nm.500,0nm": 0.1}, "re-radiation"),
    ],
)
def test_what_is_no_spectral_picture_is_refused_by_name(tmp_path, channels, problem):
    write_exr(tmp_path / "x.exr", {}, {name: np.full((2, 2), value) for name, value in channels.items()})
    with pytest.raises(InputError, match=problem) as raised:
        read_spectral_picture(tmp_path / "x.exr")
    assert raised.value.file == tmp_path / "x.exr"


def test_relative_units_are_those_that_metamer_writes(rendered):
    assert rendered[0].units == RELATIVE_UNITS
