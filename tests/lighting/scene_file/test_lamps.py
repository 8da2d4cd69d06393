"""Every format that holds an emission, and every emission of a catalogue, lights a scene; anything else is refused."""

import numpy as np
import pytest
from metamer.lighting.scene_file.files import load_scene
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.formats.spectral_exr import write_spectral_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.spectrum import Spectrum

GRID = np.arange(400.0, 701.0, 10.0)
POWER = np.round(40.0 + 30.0 * np.sin(GRID / 40.0), 3)
ROWS = "".join(f"{nm:g},{value:g}\n" for nm, value in zip(GRID, POWER, strict=True))
PART = '[[part]]\nshape = "sphere"\nsubdivisions = 2\n[[camera]]\n'


def cgats() -> str:
    fields = " ".join(f"SPEC_{nm:g}" for nm in GRID)
    return (
        f'SPECT\n\nDESCRIPTOR "Spectral power of a lamp"\nKEYWORD "SPECTRAL_BANDS"\nSPECTRAL_BANDS "{GRID.size}"\n'
        f'SPECTRAL_START_NM "400.0"\nSPECTRAL_END_NM "700.0"\nSPECTRAL_NORM "1.0"\nNUMBER_OF_FIELDS {GRID.size}\n'
        f"BEGIN_DATA_FORMAT\n{fields}\nEND_DATA_FORMAT\nNUMBER_OF_SETS 1\nBEGIN_DATA\n"
        f"{' '.join(f'{value:g}' for value in POWER)}\nEND_DATA\n"
    )


def tm27() -> str:
    points = "".join(f'<SpectralData wavelength="{w:g}">{v:g}</SpectralData>' for w, v in zip(GRID, POWER, strict=True))
    return (
        '<?xml version="1.0"?>\n<IESTM2714 xmlns="iestm2714" version="1.0"><Header><Manufacturer>Acme</Manufacturer>'
        "<Description>lamp 3</Description></Header><SpectralDistribution><SpectralQuantity>relative</SpectralQuantity>"
        f"{points}</SpectralDistribution></IESTM2714>"
    )


def meter() -> str:
    lines = "".join(f"{nm:g}nm\t{value:g}\n" for nm, value in zip(GRID, POWER, strict=True))
    return f"Model Name\tCV600\nLUX\t100.0\nCCT\t5000\nX\t96.42\nY\t100.0\nZ\t82.49\nR1\t99\nR2\t98\nR3\t97\n{lines}"


FILES = {
    "words.csv": "wavelength (nm),irradiance (mW/m2/nm)\n" + ROWS,
    "silent.csv": "nm,booth\n" + ROWS,
    "headerless.csv": ROWS,
    "tabs.tsv": ("wavelength\tbooth\n" + ROWS).replace(",", "\t"),
    "plain.txt": ROWS.replace(",", " "),
    "power.spd": ROWS.replace(",", " "),
    "argyll.sp": cgats(),
    "standard.spdx": tm27(),
    "meter.txt": meter(),
}


@pytest.fixture
def lit(tmp_path):
    """The one light of a scene whose table says so, and the scene."""

    def load(table, catalogue=None):
        path = tmp_path / "scene.toml"
        path.write_text(f"{PART}[[light]]\n{table}\n", encoding="utf-8")
        loaded = load_scene(path, catalogue)
        return loaded.lights[0], loaded

    return load


def shape_of(spectrum: Spectrum) -> np.ndarray:
    values = spectrum.resampled(GRID).samples
    return values / values.max()


@pytest.mark.parametrize("name", FILES)
def test_every_text_that_gives_an_emission_lights_a_scene(lit, tmp_path, name):
    (tmp_path / name).write_text(FILES[name], encoding="utf-8")
    light, scene = lit(f'spectrum = "{name}"')
    np.testing.assert_allclose(shape_of(light.spectrum), POWER / POWER.max(), rtol=1e-5)
    assert light.spectrum.quantity == "emission" and light.spectrum_name == name
    assert light.illuminance_lux == 1000, "the strength is the photometric one, whatever the unit of the file"
    assert any(f"{name} is known from 400 to 700 nm" in note for note in scene.notes)


def test_a_mat_file_and_a_spectral_picture_of_one_pixel_light_a_scene(lit, tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(tmp_path / "lamp.mat", {"wavelength": GRID, "spectral_power": POWER})
    light, _ = lit('spectrum = "lamp.mat"')
    np.testing.assert_allclose(shape_of(light.spectrum), POWER / POWER.max(), rtol=1e-5)
    image = Spectrum.sampled(GRID, POWER[None, None] / 100.0, "emission")
    write_spectral_exr(tmp_path / "lamp.exr", image, "W.m^-2.sr^-1.nm^-1")
    light, _ = lit('spectrum = "lamp.exr"')
    np.testing.assert_allclose(shape_of(light.spectrum), POWER / POWER.max(), rtol=1e-3)


def test_the_scale_of_a_lamp_is_nothing_to_the_picture(lit, tmp_path):
    for name, factor in (("small.csv", 1e-9), ("fraction.csv", 0.01), ("huge.csv", 1e6)):
        rows = "".join(f"{nm:g},{factor * value:.9g}\n" for nm, value in zip(GRID, POWER, strict=True))
        (tmp_path / name).write_text("nm,lamp\n" + rows)
    whites = [lit(f'spectrum = "{name}"')[1].adopted_white() for name in ("small.csv", "fraction.csv", "huge.csv")]
    np.testing.assert_allclose(whites, np.broadcast_to(whites[0], (3, 3)), rtol=1e-8)


@pytest.mark.parametrize("word", ["reflectance (%)", "transmittance", "Reflectance factor"])
def test_a_file_that_says_it_is_no_lamp_is_refused_with_what_it_is(lit, tmp_path, word):
    rows = "".join(
        f"{nm:g},{value / 100.0 if '%' not in word else value:g}\n" for nm, value in zip(GRID, POWER, strict=True)
    )
    (tmp_path / "paint.csv").write_text(f"wavelength (nm),{word}\n{rows}")
    with pytest.raises(InputError) as caught:
        lit('name = "booth"\nspectrum = "paint.csv"')
    said = str(caught.value)
    assert "paint.csv: not the spectrum of a light" in said and "as the file says itself" in said
    assert word.split()[0].casefold() in said and "scene.toml, light 1 (booth).spectrum" in said


SEVERAL = "nm,warm,cold,\n" + "".join(
    f"{nm:g},{a:g},{b:g},\n" for nm, a, b in zip(GRID, POWER, POWER[::-1], strict=True)
)


def test_a_file_of_several_lamps_asks_which(lit, tmp_path):
    (tmp_path / "lamps.csv").write_text(SEVERAL.replace(",\n", "\n"))
    with pytest.raises(InputError, match=r"(?s)which spectrum of the file\?.*1 \(warm\), 2 \(cold\).*light 1\.entry"):
        lit('spectrum = "lamps.csv"')
    for key in ('entry = "cold"', "entry = 2", 'spectrum_column = "cold"'):
        light, _ = lit(f'spectrum = "lamps.csv"\n{key}')
        np.testing.assert_allclose(shape_of(light.spectrum), POWER[::-1] / POWER.max(), rtol=1e-5)
        assert light.spectrum_name == "cold"
    with pytest.raises(InputError, match=r"(?s)no such spectrum in the file.*found: 3"):
        lit('spectrum = "lamps.csv"\nentry = 3')
    with pytest.raises(UnknownNameError, match="nearest: cold"):
        lit('spectrum = "lamps.csv"\nentry = "cool"')
    with pytest.raises(InputError, match=r"light 1\.spectrum_column: entry and spectrum_column say the same"):
        lit('spectrum = "lamps.csv"\nentry = 1\nspectrum_column = "warm"')
    with pytest.raises(InputError, match=r"light 1\.entry: only a file"):
        lit('spectrum = "D65"\nentry = 1')


@pytest.fixture
def stored(write_spectrum, write_matt, tmp_path):
    folder = tmp_path / "catalogue"
    write_spectrum(folder, "lamps/booth", values=tuple(POWER))
    write_spectrum(folder, "filters/blue", "transmittance", (0.2, 0.5, 0.9))
    write_matt(folder, "paint/red")
    return Catalogue.open(folder)


def test_every_emission_of_the_catalogue_lights_a_scene(lit, stored):
    light, scene = lit('spectrum = "lamps/booth"', stored)
    np.testing.assert_allclose(shape_of(light.spectrum), POWER / POWER.max(), rtol=1e-9)
    assert light.spectrum_name == "lamps/booth"
    assert any("lamps/booth is known from 400 to 700 nm" in note for note in scene.notes)


@pytest.mark.parametrize(("name", "what"), [("filters/blue", "transmittance"), ("paint/red", "reflectance")])
def test_what_is_no_emission_of_the_catalogue_lights_nothing(lit, stored, name, what):
    with pytest.raises(
        InputError, match=rf"(?s)light 1\.spectrum: not the spectrum of a light.*{name}, which is a {what}"
    ):
        lit(f'spectrum = "{name}"', stored)


def test_a_name_near_an_emission_of_the_catalogue_leads_to_it(lit, stored):
    with pytest.raises(UnknownNameError, match=r"light 1\.spectrum: unknown .*\n.*\n.*lamps/booth"):
        lit('spectrum = "lamps/boot"', stored)
    with pytest.raises(UnknownNameError, match="nearest: D65"):
        lit('spectrum = "D66"', stored)


def test_a_name_of_two_things_is_asked_about(lit, stored, tmp_path):
    (tmp_path / "lamps").mkdir()
    (tmp_path / "lamps" / "booth").write_text("nm,lamp\n" + ROWS)
    with pytest.raises(InputError, match=r"(?s)light 1\.spectrum: a file and a material.*write \./lamps/booth"):
        lit('spectrum = "lamps/booth"', stored)
    assert lit('spectrum = "./lamps/booth"', stored)[0].spectrum_name == "./lamps/booth"


def test_an_illuminant_stays_one_whatever_lies_beside_the_scene(lit, tmp_path):
    (tmp_path / "D65").write_text("nm,lamp\n" + ROWS)
    assert lit('spectrum = "D65"')[0].spectrum is illuminant("D65")
