"""Lights from maps: stated, made and measured spectra, each against what the file itself shows."""

import numpy as np
import pytest
from metamer.lighting.environment import latlong
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.map_light import load_environment
from metamer.lighting.environment.reduction import MOST_SPECTRA, _metric, fewest_spectra
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.spectral_exr import write_spectral_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.upsampling import METHODS, upsampling, xyz_from_rgb
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from scipy.optimize import nnls

EYE = observer("1931_2")
NM = np.arange(380.0, 781.0, 10.0)
RED = np.where(WORKING_WAVELENGTHS_NM < 590, 0.05, 0.6)


def rgb_map(path, values, **attributes):
    write_exr(path, attributes, {name: values[..., index] for index, name in enumerate("RGB")})
    return path


def coloured(height=16, seed=3):
    """A sky and a ground of many colours, none of them beyond sRGB."""
    return np.random.default_rng(seed).uniform(0.05, 1.0, (height, 2 * height, 3)) ** 2


def at_texels(light):
    """Power of each texel (H,W,L) and its wavelengths, out of fields and spectra."""
    scale = [EYE.luminous(one) for one in light.spectra]
    parts = zip(light.fields, light.spectra, scale, strict=True)
    return sum(field[..., None] / unit * one.samples for field, one, unit in parts), light.spectra[0].wavelengths_nm


# Stated.


def test_a_stated_spectrum_takes_the_luminance_of_the_map(tmp_path):
    values = coloured()
    light = load_environment(rgb_map(tmp_path / "sky.exr", values), illuminant("FL11"), spectrum_name="FL11")
    assert light.origin == "stated" and light.spectra == (illuminant("FL11"),) and light.spectrum is illuminant("FL11")
    luminance = values @ xyz_from_rgb()[1]
    np.testing.assert_allclose(light.fields[0] / light.fields[0, 3, 4], luminance / luminance[3, 4], rtol=1e-6)
    assert [note.partition(": ")[0] for note in light.notes] == ["sky.exr", "sky.exr"]


def test_neither_stated_nor_made_is_asked_for_and_both_are_refused(tmp_path):
    path = rgb_map(tmp_path / "sky.exr", coloured())
    with pytest.raises(InputError, match=r'(?s)RGB in the file.*spectrum = "D65".*uplift = "jakob-hanika"'):
        load_environment(path)
    with pytest.raises(InputError, match=r"(?s)uplift: .*expected: one of the two"):
        load_environment(path, illuminant("D65"), "smits")
    with pytest.raises(UnknownNameError, match="nearest: jakob-hanika"):
        load_environment(path, uplift="jakob-hannika")
    write_exr(tmp_path / "y.exr", {}, {"Y": np.ones((2, 4))})
    for uplift in (None, "smits"):
        with pytest.raises(InputError, match="a map that does not say of what spectrum") as caught:
            load_environment(tmp_path / "y.exr", uplift=uplift)
        assert "uplift =" not in str(caught.value)


def test_a_black_map_and_one_that_is_upside_down(tmp_path):
    black = np.zeros((4, 8, 3))
    with pytest.raises(InputError, match=r"(?s)black\.exr: pixels: a map without light.*black everywhere"):
        load_environment(rgb_map(tmp_path / "black.exr", black), illuminant("D65"))
    black[2:] = 1.0
    with pytest.raises(InputError, match=r"(?s)sends nothing from above.*upside down"):
        load_environment(rgb_map(tmp_path / "below.exr", black), illuminant("D65"))


@pytest.mark.parametrize("row", [0, 5, 13])
def test_a_sun_of_one_texel_gives_the_illuminance_that_is_asked_for(tmp_path, row):
    """It is found by drawing alone, and nothing of it is lost between its neighbours."""
    values = np.zeros((32, 64, 3))
    values[row, 7] = 6e4
    light = load_environment(rgb_map(tmp_path / "sun.exr", values), illuminant("D65"), illuminance_lux=5e4)
    places = np.zeros((40000, 3))
    to, density = light.drawn(places, np.random.default_rng(1).random((40000, 2)))
    sent = light.luminance(places, to)[:, 0] / density
    expected = light.fields[0, row, 7] * latlong.solid_angles(32, 64)[row]
    # Half of what a texel shares with the next row lies in that row, whose texels are larger next to a pole.
    allowed = 0.02 if row else 0.5
    assert sent.mean() == pytest.approx(expected, rel=allowed)
    assert (sent * to[:, 1]).mean() == pytest.approx(5e4, rel=allowed)


def test_the_luminance_of_colours_that_no_light_has(tmp_path):
    """Blue alone of ACES 2065-1 lies outside all colours: its luminance is negative."""
    values = np.ones((4, 8, 3))
    values[1, 6] = (0.0, 0.0, 5.0)
    aces = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
    path = rgb_map(tmp_path / "aces.exr", values, chromaticities=aces)
    with pytest.raises(InputError, match="row 1, column 6: a texel of negative luminance"):
        load_environment(path, illuminant("D65"))


# Made.


@pytest.mark.parametrize("method", METHODS)
def test_white_made_is_d65_itself(tmp_path, method):
    """Ultraviolet included: what fluoresces in D65 fluoresces in it."""
    light = load_environment(rgb_map(tmp_path / "grey.exr", np.full((4, 8, 3), 0.3)), uplift=method)
    assert light.origin == "made" and len(light.spectra) == 1
    d65 = illuminant("D65")
    # The bases of Mallett and Yuksel sum to 1 within a few thousandths.
    np.testing.assert_array_equal(light.spectrum.wavelengths_nm, d65.wavelengths_nm)
    np.testing.assert_allclose(light.spectrum.samples, d65.samples / d65.samples.max(), atol=6e-3)
    assert f"uplifted({method}) x D65" in light.spectrum_name and f"uplifted({method}) x D65" in light.notes[-1]


def test_a_linear_uplift_is_exact_in_three_spectra(tmp_path):
    values = coloured()
    light = load_environment(rgb_map(tmp_path / "sky.exr", values), uplift="mallett-yuksel")
    assert len(light.spectra) == 3 and "3 spectra: exact" in light.notes[-1]
    power, nm = at_texels(light)
    d65 = illuminant("D65")
    inside = (nm >= 380) & (nm <= 780)
    expected = upsampling("mallett-yuksel").spectra(values.astype(np.float32)) * d65.resampled(nm[inside]).samples
    ratio = power[0, 0, inside].sum() / expected[0, 0].sum()
    np.testing.assert_allclose(power[..., inside], ratio * expected, rtol=1e-6, atol=1e-9 * power.max())


@pytest.mark.parametrize("method", ["jakob-hanika", "smits"])
def test_made_spectra_show_patches_as_their_uplift_does(tmp_path, method):
    """Against the uplift of single texels, each folded as a light of its own with the observer."""
    values = coloured(8)
    light = load_environment(rgb_map(tmp_path / "sky.exr", values), uplift=method)
    assert 1 < len(light.spectra) <= MOST_SPECTRA
    power, nm = at_texels(light)
    worst = []
    for row, column in ((1, 3), (4, 9), (7, 15), (2, 0)):
        reflectance = upsampling(method).spectra(values[row, column])
        lit = np.interp(nm, WORKING_WAVELENGTHS_NM, reflectance) * illuminant("D65").resampled(nm).samples
        lights = (Spectrum.sampled(nm, lit, "emission"), Spectrum.sampled(nm, power[row, column], "emission"))
        weights = [EYE.weights(one, WORKING_WAVELENGTHS_NM) for one in lights]
        white = EYE.white(lights[0])
        worst.append(float(delta_e_xyz(weights[0] @ RED, weights[1] @ RED, white)))
        worst.append(float(delta_e_xyz(white, EYE.white(lights[1]), white)))
    assert max(worst) < 1.0 and np.mean(worst) < 0.3


def test_colours_beyond_srgb_have_no_uplift_and_rounding_is_not_beyond(tmp_path):
    values = np.ones((4, 8, 3))
    wide = (0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329)
    light = load_environment(rgb_map(tmp_path / "w.exr", values, chromaticities=wide), uplift="smits")
    assert len(light.spectra) == 1
    # Red of sRGB in those primaries, and rounded: a hair beyond sRGB.
    matrix = np.linalg.solve(light_matrix(wide), xyz_from_rgb())
    values[0] = (matrix @ (1.0, 0.0, 0.0)).astype(np.float16)
    assert load_environment(rgb_map(tmp_path / "r.exr", values, chromaticities=wide), uplift="smits").fields.any()
    values[0] = (0.0, 1.0, 0.0)
    path = rgb_map(tmp_path / "g.exr", values, chromaticities=wide)
    with pytest.raises(InputError, match=r"(?s)colours that sRGB does not hold.*spectrum = "):
        load_environment(path, uplift="smits")
    assert load_environment(path, illuminant("D65")).origin == "stated"


def light_matrix(chromaticities):
    xy = np.reshape(chromaticities, (4, 2))
    columns = np.c_[xy, 1 - xy.sum(axis=1)].T
    return columns[:, :3] * np.linalg.solve(columns[:, :3], columns[:, 3] / columns[1, 3])


# Measured.


def spectral_map(path, power, nm=NM):
    write_spectral_exr(path, Spectrum.sampled(nm, power, "emission"))
    return path


def test_light_of_one_spectrum_is_one_spectrum(tmp_path):
    level = np.random.default_rng(2).uniform(0.0, 5.0, (8, 16, 1))
    power = level * illuminant("FL11").resampled(NM).samples
    light = load_environment(spectral_map(tmp_path / "s.exr", power))
    assert light.origin == "measured" and light.spectrum_name == "s.exr" and len(light.spectra) == 1
    np.testing.assert_allclose(light.fields[0] * level[2, 2, 0], light.fields[0, 2, 2] * level[..., 0], rtol=1e-5)


def test_three_lamps_that_are_nowhere_alone_are_three_spectra_and_show_what_they_showed(tmp_path):
    lamps = np.stack([illuminant(name).averaged(NM).samples for name in ("D65", "A", "FL11")])
    lamps /= lamps.sum(axis=1, keepdims=True)
    shares = np.random.default_rng(4).dirichlet((1, 1, 1), (12, 24))
    shares = 0.05 + 0.85 * shares
    power = shares @ lamps
    light = load_environment(spectral_map(tmp_path / "s.exr", power))
    assert len(light.spectra) == 3, light.notes
    shown, _ = at_texels(light)
    # One scale for all of the light; then each texel as a lamp of its own.
    shown *= power.sum() / shown.sum()
    for texel in ((0, 0), (5, 7), (11, 23)):
        truth = Spectrum.sampled(NM, power[texel].astype(np.float32), "emission")
        kept = Spectrum.sampled(NM, shown[texel], "emission")
        for surface in (RED, RED[::-1], np.ones_like(RED)):
            pair = [EYE.weights(one, WORKING_WAVELENGTHS_NM) @ surface for one in (truth, kept)]
            assert float(delta_e_xyz(*pair, EYE.white(truth))) < 0.5
        assert EYE.luminous(kept) == pytest.approx(EYE.luminous(truth), rel=5e-3)


def test_a_light_of_one_line(tmp_path):
    """546 nm alone: a white without much of X and Z is no reason to fail."""
    power = np.zeros((4, 8, 5))
    power[..., 2] = np.random.default_rng(1).uniform(1, 2, (4, 8))
    light = load_environment(spectral_map(tmp_path / "line.exr", power, np.array([400.0, 545, 546, 547, 700])))
    assert len(light.spectra) == 1 and light.spectrum.samples.tolist() == [0, 0, 1, 0, 0]


def test_a_measured_map_takes_a_stated_spectrum_and_no_uplift(tmp_path):
    path = spectral_map(tmp_path / "s.exr", np.ones((4, 8, NM.size)))
    assert load_environment(path, illuminant("A")).origin == "stated"
    with pytest.raises(InputError, match="needs no uplift"):
        load_environment(path, uplift="smits")


def test_the_smallest_map_of_all_is_a_light(tmp_path):
    light = load_environment(rgb_map(tmp_path / "two.exr", np.array([[[9.0, 0, 0], [1, 1, 1]]])), uplift="smits")
    assert len(light.spectra) == 2
    to, density = light.drawn(np.zeros((50, 3)), np.random.default_rng(1).random((50, 2)))
    assert np.isfinite(to).all() and (density > 0).all()


def test_a_faint_sky_beside_a_sun_keeps_its_own_colour(tmp_path):
    """It is nothing of the light, and all that a mirror shows: spectra are judged by directions too."""
    values = np.full((16, 32, 3), (0.05, 0.1, 0.9))
    values[8:] = (0.3, 0.1, 0.05)
    values[3, 5] = (3e3, 2.9e3, 2.6e3)
    light = load_environment(rgb_map(tmp_path / "sky.exr", values), uplift="jakob-hanika", illuminance_lux=1e4)
    assert len(light.spectra) == 3, light.notes


def test_light_beyond_what_is_seen_is_no_light(tmp_path):
    with pytest.raises(InputError, match=r"(?s)uv\.exr: S0 channels: the light is not known where the observer sees"):
        load_environment(spectral_map(tmp_path / "uv.exr", np.ones((4, 8, 3)), np.array([300.0, 320.0, 340.0])))


def test_texels_without_light_stay_black(tmp_path):
    lamps = np.stack([illuminant(name).averaged(NM).samples for name in ("D65", "A")])
    power = np.random.default_rng(1).uniform(0, 1, (4, 8, 2)) @ lamps
    power[2, 3] = 0.0
    light = load_environment(spectral_map(tmp_path / "s.exr", power))
    assert (light.fields[:, 2, 3] == 0).all() and len(light.spectra) == 2


def test_what_the_most_spectra_cost_is_said():
    """Noise has no few spectra: the error is that of as many as there may be."""
    noise = np.random.default_rng(1).uniform(0, 1, (300, NM.size)) ** 6
    few = fewest_spectra(noise, NM, most=2)
    assert len(few.spectra) == 2 and few.delta_e94[0] > 1.0 and few.delta_e94[1] >= few.delta_e94[0]
    assert (few.spectra >= 0).all() and (few.shares(noise) >= 0).all()


def test_shares_are_the_non_negative_least_squares():
    """As Lawson and Hanson have them, where some are 0."""
    generator = np.random.default_rng(9)
    few = fewest_spectra(generator.uniform(0, 1, (60, NM.size)) ** 3, NM, most=5)
    samples = generator.uniform(0, 1, (80, NM.size)) ** 5
    metric = _metric(NM).towards
    expected = [nnls((few.spectra @ metric.T).T, metric @ one)[0] for one in samples]
    np.testing.assert_allclose(few.shares(samples), expected, rtol=1e-6, atol=1e-9 * np.max(expected))
    assert (np.array(expected) == 0).any()


@pytest.mark.slow
def test_real_maps_in_every_way(shared_data):
    path = shared_data / "light" / "venice_sunset_512.exr"
    if not path.is_file():
        pytest.skip("no maps of light")
    made = load_environment(path, uplift="jakob-hanika")
    assert made.origin == "made" and 2 <= len(made.spectra) <= MOST_SPECTRA
    stated = load_environment(path, illuminant("D65"))
    # Luminance is the same however the light's colours are kept, within the budget.
    total = made.fields.sum(axis=0)
    np.testing.assert_allclose(total.mean(), stated.fields.mean(), rtol=1e-3)
    bright = stated.fields[0] > np.percentile(stated.fields, 50)
    assert np.percentile(np.abs(total / stated.fields[0] - 1)[bright], 99) < 0.02


@pytest.mark.parametrize("shape", [(1, 1, 2), (2, 3, 5), (3, 16, 32)])
def test_luminance_and_density_found_together_are_those_found_apart(shape):
    rng = np.random.default_rng(4)
    spectra = tuple(illuminant(name) for name in ("D65", "A", "FL11"))[: shape[0]]
    light = EnvironmentLight(rng.random(shape) ** 4, spectra, 1000.0, rotation_deg=37.0)
    to = rng.normal(size=(500, 3))
    to[:4] = [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1e-9, 0.0, -1.0]]
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    luminance, density = light.luminance_and_density(to, to)
    np.testing.assert_array_equal(luminance, light.luminance(to, to))
    np.testing.assert_array_equal(density, light.density(to, to))
    # One direction after the other.
    rows, columns = latlong.places(to @ light.world_from_map)
    rows, columns = np.clip(rows * shape[1] - 0.5, 0.0, shape[1] - 1.0), columns * shape[2] - 0.5
    for number, (row, column) in enumerate(zip(rows, columns, strict=True)):
        up, left = int(row), int(np.floor(column))
        lines = light.fields[:, up], light.fields[:, min(up + 1, shape[1] - 1)]
        near, far = left % shape[2], (left + 1) % shape[2]
        above, under = (line[:, near] * (1.0 - (column - left)) + line[:, far] * (column - left) for line in lines)
        np.testing.assert_array_equal(luminance[number], above * (1.0 - (row - up)) + under * (row - up))
