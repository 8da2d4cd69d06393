"""Models of displays, their choice, their inverse and its tables, beside what simulated displays truly show."""

import numpy as np
import pytest
from metamer.benchmarks.display.simulated import NM, SimulatedDisplay
from metamer.calibration.display.aim import PICTURE_WHITE_XYZ, aimed, largest_luminance
from metamer.calibration.display.characterise import characterise
from metamer.calibration.display.choice import choose
from metamer.calibration.display.cube import make_cube, tetrahedral
from metamer.calibration.display.drift import without_drift
from metamer.calibration.display.icc import matrix_profile, profile_error
from metamer.calibration.display.inverse import Inverse
from metamer.calibration.display.model_fit import fit
from metamer.calibration.display.patches import patches
from metamer.calibration.display.readings import Readings
from metamer.calibration.display.record import read_record
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz


@pytest.fixture(scope="module")
def held():
    codes = np.random.default_rng(11).random((300, 3))
    codes[:60] = codes[:60, :1]
    return codes


@pytest.fixture(scope="module")
def lcd_cube(lcd_choice):
    return make_cube(lcd_choice.model)


def off(display, model, codes):
    white = display.xyz(np.ones((1, 3)))[0]
    return delta_e_xyz(display.xyz(codes), model.xyz(codes), white)


def test_an_lcd_is_followed_by_its_curves(simulated, lcd_choice, held):
    assert lcd_choice.model.name in ("matrix-trc", "residual")
    assert off(simulated["LCD"], lcd_choice.model, held).mean() < 0.3


def test_a_display_that_does_not_add_up_gets_no_matrix(simulated, wrgb, wrgb_choice, held):
    assert wrgb_choice.additivity.refuses and wrgb_choice.additivity.luminance > 1.5
    assert wrgb_choice.model.name == "minima" and "minima" in wrgb_choice.reason
    assert off(simulated["WRGB OLED"], wrgb_choice.model, held).mean() < 0.2
    for name in ("gog", "matrix-trc"):
        with pytest.raises(InputError, match="channels do not add up"):
            choose(wrgb, name)


def test_nine_patches(simulated):
    """Corners and a grey are enough for gains and gammas, and for nothing else; fewer are refused."""
    readings = simulated["CRT"].measured(patches(9), 0)
    found = choose(readings)
    assert found.model.name == "gog" and "nothing can be held back" in found.reason
    assert set(found.left_out) == {"matrix-trc", "residual", "minima"}
    with pytest.raises(InputError, match="too few patches"):
        choose(readings.taken(np.arange(6)))
    with pytest.raises(InputError, match="not enough for this model"):
        choose(readings, "minima")


def test_nine_patches_of_a_display_that_does_not_add_up_are_refused(simulated):
    with pytest.raises(InputError, match="channels do not add up"):
        choose(simulated["WRGB OLED"].measured(patches(9), 0))


def test_drift_is_taken_out(simulated):
    codes = patches(125)

    def warming(place):
        return 1.0 - 0.03 * np.exp(-3.0 * place)[:, None] * np.array([1.0, 1.0, 1.2])

    display = simulated["RGB OLED"]
    drifted, steady = display.measured(codes, 5, warming), display.measured(codes, 5)
    truth, end = display.xyz(codes), warming(np.array([1.0]))
    white = truth[0] * end[0]
    left = delta_e_xyz(truth * end, without_drift(drifted).readings.xyz, white).mean()
    without = delta_e_xyz(truth * end, steady.xyz * end, white).mean()
    assert left < without + 0.05
    assert delta_e_xyz(truth * end, drifted.xyz, white).mean() > without + 0.1


def test_a_display_that_limits_its_brightness(simulated):
    """White after light patches is darker than after dark ones: no drift, and it is said."""
    readings = simulated["RGB OLED"].measured(patches(61), 0)
    before = np.concatenate([[0.0], readings.codes[:-1].mean(axis=1)])
    limited = Readings(readings.codes, readings.xyz * (1.0 - 0.25 * before * readings.codes.mean(axis=1))[:, None])
    warnings = characterise(limited, model="residual").warnings
    assert any("limits its brightness" in words for words in warnings)
    assert not characterise(readings, model="residual").warnings


def test_a_display_that_clips_at_90_percent(simulated):
    display = simulated["CRT"]
    codes = patches(61)
    clipped = Readings(codes, display.xyz(np.minimum(codes / 0.9, 1.0)))
    assert any("clips there" in words for words in characterise(clipped, model="residual").warnings)


def test_an_instrument_that_saturates(simulated, lcd):
    """Its largest readings are all alike: greys stop rising, and it is said."""
    most = 0.8 * lcd.white_xyz
    saturated = Readings(lcd.codes, np.minimum(lcd.xyz, most))
    assert any("clips there" in words for words in characterise(saturated, model="residual").warnings)


def test_the_inverse_reaches_every_colour_that_can_be_shown(wrgb_choice, held):
    model = wrgb_choice.model
    dark = np.concatenate([held, held**4, np.round(held)])
    codes, left = Inverse(model, model.white_xyz).codes(model.xyz(dark))
    assert left.max() < 0.02
    assert codes.min() >= 0.0 and codes.max() <= 1.0


def test_the_inverse_is_never_worse_than_its_lattice(wrgb_choice):
    """Colours that nothing shows: no codes of a finer lattice come nearer by what can be seen."""
    model = wrgb_choice.model
    levels = np.linspace(0.0, 1.0, 22)
    lattice = np.stack(np.meshgrid(levels, levels, levels), axis=-1).reshape(-1, 3)
    shown = model.xyz(lattice)
    beyond = model.xyz(np.eye(3)) * np.array([[1.3, 0.6, 0.5], [0.5, 1.3, 0.5], [0.8, 0.5, 1.4]])
    _, left = Inverse(model, model.white_xyz).codes(beyond)
    for wanted, found in zip(beyond, left, strict=True):
        best = delta_e_xyz(np.broadcast_to(wanted, shown.shape), shown, model.white_xyz).min()
        assert found <= best + 0.05


def test_a_flat_tone_curve_has_an_inverse(simulated):
    """A display whose lower fifth is black: Newton's method has nothing to divide by."""
    display = simulated["CRT"]
    crushed = SimulatedDisplay("crushed", display.emitters,
                               lambda codes: display.drive(np.maximum(codes - 0.2, 0.0) / 0.8), 95.0)  # fmt: skip
    model = choose(Readings(patches(61), crushed.xyz(patches(61)))).model
    codes = np.random.default_rng(2).random((100, 3))
    assert Inverse(model, model.white_xyz).codes(model.xyz(codes))[1].max() < 0.05


@pytest.mark.slow
def test_the_cube_follows_the_inverse(lcd_choice, wrgb_choice, held):
    for choice, most in ((lcd_choice, 0.3), (wrgb_choice, 1.0)):
        model = choice.model
        wanted = model.xyz(held)
        codes, _ = Inverse(model, model.white_xyz).codes(wanted)
        found = np.clip(make_cube(model).look_up(wanted), 0.0, 1.0)
        apart = delta_e_xyz(model.xyz(codes), model.xyz(found), model.white_xyz)
        assert apart.mean() < 0.06 and np.percentile(apart, 95) < 0.25 and apart.max() < most


def test_what_cannot_be_shown_leaves_the_codes(lcd_choice, lcd_cube):
    """So that it is counted; and what can be shown does not."""
    model, cube = lcd_choice.model, lcd_cube
    inside = 0.02 + 0.96 * np.random.default_rng(6).random((200, 3))
    codes = cube.look_up(model.xyz(inside))
    assert codes.min() > -1e-3 and codes.max() < 1.0 + 1e-3
    red = model.xyz(np.array([[1.0, 0.0, 0.0]]))
    beyond = red * np.array([1.1, 1.0, 0.6])
    assert cube.look_up(beyond).max() > 1.001 or cube.look_up(beyond).min() < -0.001
    assert cube.look_up(model.white_xyz * 1.05).max() > 1.001


def test_greys_never_go_back(lcd_choice, wrgb_choice, lcd_cube):
    """Down to greys darker than the display's black, where one channel after the other comes to its end."""
    for model, cube in ((lcd_choice.model, lcd_cube), (wrgb_choice.model, make_cube(wrgb_choice.model))):
        greys = np.linspace(0.0, 1.0, 1025)[:, None] ** 3 * aimed(model).white_xyz
        codes = np.clip(cube.look_up(greys), 0.0, 1.0)
        assert np.max(np.maximum.accumulate(codes, axis=0) - codes) < 0.25 / 255.0
        assert codes[-1].min() > 0.5


def test_codes_below_black_go_on_as_the_channels_do(wrgb_choice):
    """A blue less than none takes nothing from what red and green give together with white sub-pixels."""
    model = wrgb_choice.model
    without, below = (model.mixed(np.array([[0.5, 0.4, blue]])) for blue in (0.0, -0.05))
    alone = model.mixed(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.05]]))
    assert below - without == pytest.approx(alone[1:] - alone[:1], rel=1e-9)
    assert np.all(below < without)


def test_white_that_is_read_often_is_believed(simulated):
    """By a seed whose other patches pull white away, by nearly the ΔE94 of 0.4 that is seen."""
    display = simulated["RGB OLED"]
    readings = display.measured(patches(125), 4)
    once = np.flatnonzero(~(readings.codes >= 1.0).all(axis=1) | (np.arange(len(readings)) == len(readings) - 1))
    truth, white = display.xyz(np.ones((1, 3)))[0], np.ones((1, 3))
    often = fit("residual", readings.averaged()).xyz(white)[0]
    assert delta_e_xyz(truth, often, truth) < 0.15
    assert delta_e_xyz(readings.white_xyz, often, truth) < 0.1
    assert delta_e_xyz(readings.white_xyz, fit("residual", readings.taken(once)).xyz(white)[0], truth) > 0.2


def test_white_without_drift_is_the_mean_of_all_its_readings(simulated):
    """Its own noise is not taken for a course."""
    readings = simulated["LCD"].measured(patches(125), 1)
    found = without_drift(readings)
    assert found.luminance == 1.0 and np.array_equal(found.readings.xyz, readings.xyz)


def test_the_brightest_white_has_whole_codes(simulated):
    """In eight bits it is nearer to what was aimed at, for a hundredth of its luminance at most."""
    off = []
    for name, kind in (("sRGB LED", "gog"), ("CRT", "residual"), ("LCD with cross-talk", "residual")):
        model = fit(kind, simulated[name].measured(patches(61), 0).averaged())
        most, aim = largest_luminance(model, PICTURE_WHITE_XYZ), aimed(model)
        assert 0.99 * most - 1e-9 <= aim.white_xyz[1] <= most
        levels = most * np.array([[1.0], [0.9999], [1.0001]])
        whites = np.concatenate([aim.white_xyz[None], PICTURE_WHITE_XYZ * levels])
        codes, left = Inverse(model, model.white_xyz).codes(whites)
        assert left[2] <= 0.02 < left[3]
        shown = model.xyz(np.round(codes * 255.0) / 255.0)
        off.append([delta_e_xyz(white, one, white) for white, one in zip(whites[:2], shown[:2], strict=True)])
    after, before = np.array(off).T
    assert np.all(after <= before + 1e-9) and after.mean() < 0.9 * before.mean()


def test_tetrahedra_keep_the_diagonal():
    """On greys nothing of other hues is mixed in."""
    nodes = np.random.default_rng(1).random((5, 5, 5, 3))
    at = np.arange(5)
    diagonal = nodes[at, at, at]
    places = np.linspace(0.0, 1.0, 17)
    found = tetrahedral(nodes, np.repeat(places[:, None], 3, axis=1))
    wanted = np.stack([np.interp(places, at / 4.0, diagonal[:, c]) for c in range(3)], axis=1)
    assert np.abs(found - wanted).max() < 1e-12


def test_a_white_outside_what_the_display_shows(lcd_choice):
    with pytest.raises(InputError, match="cannot show this white as brightly"):
        aimed(lcd_choice.model, "d65", 500.0)
    with pytest.raises(InputError, match="cannot show this white"):
        aimed(lcd_choice.model, (0.72, 0.27))
    with pytest.raises(InputError, match="without a luminance"):
        aimed(lcd_choice.model, "d65", 100.0, absolute=False)


@pytest.mark.parametrize(
    ("seen_by", "xy"), [("1931_2", (0.3127, 0.3290)), ("1964_10", (0.3138, 0.3310)), ("2015_2", (0.3135, 0.3308))]
)
def test_d65_is_that_of_the_observer(lcd_choice, seen_by, xy):
    """CIE 015:2018, table 9.1 (1931, 1964)."""
    aim = aimed(lcd_choice.model, "d65", 80.0, seen_by=seen_by)
    np.testing.assert_allclose(aim.white_xyz[:2] / aim.white_xyz.sum(), xy, atol=1.5e-4)
    np.testing.assert_allclose(aim.adapted @ PICTURE_WHITE_XYZ, aim.white_xyz, rtol=1e-9)
    assert f"D65, x {xy[0]:.4f}"[:-1] in aim.words


def test_black_by_both_ways(lcd_choice):
    aim = aimed(lcd_choice.model, "d65", 80.0)
    black, white = np.zeros(3), PICTURE_WHITE_XYZ
    assert np.allclose(aim.xyz(white), aim.white_xyz) and np.allclose(aim.xyz(white, "bpc"), aim.white_xyz)
    assert np.allclose(aim.xyz(black), 0.0) and np.allclose(aim.xyz(black, "bpc"), aim.black_xyz)
    matrix, offset = aim.compensation()
    grey = 0.2 * white
    assert np.allclose(aim.xyz(matrix @ grey + offset), aim.xyz(grey, "bpc"))


def test_spectra_let_any_observer_be_used(simulated):
    display, codes = simulated["WRGB OLED"], patches(61)
    readings = Readings(codes, display.xyz(codes), spectra=display.spectra(codes))
    found = characterise(readings, observer="2015_10").record
    truth = display.xyz(np.ones((1, 3)), "2015_10")[0]
    assert found.model.xyz(np.ones((1, 3)))[0] == pytest.approx(truth, rel=2e-3)
    assert readings.spectra is not None and readings.spectra.wavelengths_nm is NM
    with pytest.raises(InputError, match="readings of another observer"):
        characterise(Readings(codes, display.xyz(codes)), observer="2015_10")


def test_a_record_comes_back_as_it_was(wrgb, tmp_path):
    found = characterise(wrgb, model="minima").record
    found.write(tmp_path / "d.json")
    again = read_record(tmp_path / "d.json")
    codes = np.random.default_rng(0).random((50, 3))
    assert np.array_equal(again.model.xyz(codes), found.model.xyz(codes))
    assert again.digest == found.digest and again.notes == found.notes
    assert np.array_equal(again.readings.repeats, found.readings.repeats) and again.readings.repeats.max() > 4
    (tmp_path / "d.json").write_text('{"metamer_display": 1}')
    with pytest.raises(InputError, match="a damaged file of a display"):
        read_record(tmp_path / "d.json")
    (tmp_path / "d.json").write_text("[]")
    with pytest.raises(InputError, match="not a characterised display"):
        read_record(tmp_path / "d.json")


def test_a_matrix_profile_is_read_by_littlecms(lcd, tmp_path):
    from PIL import Image, ImageCms

    averaged = lcd.averaged()
    profile = matrix_profile(averaged, "An LCD")
    path = tmp_path / "lcd.icc"
    path.write_bytes(profile.encoded())
    assert ImageCms.getProfileDescription(ImageCms.getOpenProfile(str(path))).strip() == "An LCD"
    assert profile_error(profile, averaged)[0] < 0.5
    lab = ImageCms.createProfile("LAB")
    transform = ImageCms.buildTransform(
        str(path), lab, "RGB", "LAB", renderingIntent=ImageCms.Intent.RELATIVE_COLORIMETRIC
    )
    codes = np.array([[255, 255, 255], [255, 0, 0], [128, 128, 128], [30, 200, 90]], dtype=np.uint8)
    image = ImageCms.applyTransform(Image.fromarray(codes[None]), transform)
    found = np.asarray(image)[0].astype(float)
    found = np.stack(
        [found[:, 0] * 100.0 / 255.0, *(found[:, c] - 256.0 * (found[:, c] > 127) for c in (1, 2))], axis=1
    )
    from metamer.calibration.display.icc import D50_XYZ
    from metamer.spectral.difference import lab_from_xyz

    light = np.stack(
        [np.interp(codes[:, c] / 255.0, np.linspace(0, 1, 1024), profile.curves[c]) for c in range(3)], axis=1
    )
    wanted = lab_from_xyz(light @ profile.columns, D50_XYZ)
    # Eight bits of Lab.
    assert np.abs(found - wanted).max() < 1.1
