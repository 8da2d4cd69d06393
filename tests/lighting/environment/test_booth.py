"""Light booths: where the light in the box goes, and what the lamps are."""

import numpy as np
import pytest
from metamer.lighting.environment.booth import LAMPS, booth_map, lamp_of, light_booth
from metamer.lighting.environment.box import FACES, Box
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer

SIZE = (0.7, 0.6, 0.5)
LEFT, RIGHT, FLOOR, CEILING, BACK, FRONT = range(6)
EYE = observer("1931_2")


@pytest.fixture(scope="module")
def box():
    return Box(SIZE, 0.42)


def test_every_patch_gives_away_what_it_sends(box):
    np.testing.assert_allclose(box.factors.sum(axis=1), 1, rtol=1e-12)
    assert box.factors.min() >= 0
    exchanged = box.areas[:, None] * box.factors
    np.testing.assert_allclose(exchanged, exchanged.T, rtol=1e-9, atol=1e-15)


def test_factors_of_whole_faces_are_those_of_a_cube():
    """Known of a cube: 0.199825 to the opposite one, 0.200044 to each of the others."""
    factors = Box((2.0, 2.0, 2.0), 0.5).factors
    count = len(factors) // len(FACES)
    whole = factors.reshape(6, count, 6, count).sum(axis=3).mean(axis=1)
    np.testing.assert_allclose(whole[LEFT], [0, 0.199825, 0.200044, 0.200044, 0.200044, 0.200044], atol=1e-6)


@pytest.mark.parametrize("reflectance", [0.0, 0.42, 0.9, 1.0])
def test_no_light_is_lost_or_made(reflectance):
    """What the panel sends is taken up by walls and panel, or leaves by the front."""
    box = Box(SIZE, reflectance)
    sent = box.luminances.ravel()
    arrives = box.factors @ sent
    panel, front = (np.zeros_like(box.luminances, dtype=bool) for _ in range(2))
    panel[CEILING, 1:-1, 1:-1], front[FRONT] = True, True
    panel, front = panel.ravel(), front.ravel()
    absorbed = np.where(panel | front, arrives, (1 - reflectance) * arrives)
    assert (box.areas * absorbed).sum() == pytest.approx(box.areas[panel].sum(), rel=1e-12)
    assert (sent[front] == 0).all() and (sent[panel] == 1).all() and (sent >= 0).all()


def test_left_is_right_and_the_front_side_of_the_floor_is_darker(box):
    at = box.luminances
    np.testing.assert_allclose(at[LEFT], at[RIGHT], rtol=1e-12)
    np.testing.assert_allclose(at[FLOOR], at[FLOOR, ::-1], rtol=1e-12)
    np.testing.assert_allclose(at[BACK], at[BACK, ::-1], rtol=1e-12)
    assert at[FLOOR, 5, 0] > at[FLOOR, 5, -1]


def test_walls_are_darker_by_their_reflectance():
    """By it alone where it is small, and by more where light goes round."""
    dark, dim, bright = (Box(SIZE, reflectance).luminances[BACK] for reflectance in (0.001, 0.002, 0.8))
    np.testing.assert_allclose(dim / dark, 2, rtol=2e-3)
    assert (bright / dark > 800).all()


def test_the_map_shows_the_panel_above_walls_around_and_the_dark_in_front():
    field = booth_map(SIZE, 0.42)
    height, width = field.shape
    assert field[0].min() == 1 and field.max() == 1, "straight up is the panel"
    assert 0 < field[-1].max() < 0.2, "straight down is the floor"
    assert field[height // 2, width // 2] == 0, "the middle of the map is the open front"
    assert 0 < field[height // 2, 0] < 0.2, "and its edges are the back"
    np.testing.assert_allclose(field, field[:, ::-1], atol=1e-12)


def test_without_walls_the_panel_alone_gives_the_illuminance():
    """The panel as a softbox, by its closed form."""
    light = light_booth("D65", wall_reflectance=0.0, illuminance_lux=800)
    panel = SoftboxLight((0, 0.45, 0), (0, 0, 0), 0.56, 0.4, illuminant("D65"), 800)
    assert light.fields.max() == pytest.approx(panel.luminance_cd_m2, rel=2e-3)
    lit = light_booth("D65", illuminance_lux=800)
    assert lit.fields.max() < light.fields.max(), "walls help"


def test_only_proportions_count():
    large = light_booth("A", width=7, height=6, depth=5)
    np.testing.assert_allclose(large.fields, light_booth("A").fields, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("booth", "name"), [("D65", "D65"), ("A", "A"), ("TL84", "FL11"), ("tl84", "FL11"), ("CWF", "FL2"), ("U30", "FL12")]
)
def test_lamps_by_the_names_on_booths(booth, name):
    light = light_booth(booth)
    assert light.spectrum is illuminant(name) and light.origin == "stated"
    assert f"CIE {name}" in light.notes[0] and "parallax" in light.notes[-1]
    assert light.spectrum_name == f"booth {booth}"


def test_the_horizon_lamp_is_a_planckian_radiator():
    """Chromaticity of 2300 K on the Planckian locus (Wyszecki and Stiles, table 1(3.11)): x 0.4952, y 0.4155."""
    x, y, z = EYE.white(lamp_of("horizon")[0])
    assert (x / (x + y + z), y / (x + y + z)) == pytest.approx((0.4952, 0.4155), abs=2e-3)


def test_uv_comes_with_daylight_whose_colour_it_hardly_changes():
    light, daylight = lamp_of("UV")[0], illuminant("D65")
    np.testing.assert_allclose(EYE.white(light), EYE.white(daylight), atol=1e-3)

    def power(one):
        nm = np.arange(300.0, 401.0)
        return np.trapezoid(np.interp(nm, one.wavelengths_nm, one.samples), nm)

    assert power(light) == pytest.approx(2 * power(daylight), rel=1e-3)
    assert "assumed" in light_booth("UV").notes[0]


def test_the_lamp_of_a_booth_of_ones_own():
    light = light_booth(spectrum=illuminant("LED-B3"), spectrum_name="ours.csv")
    assert light.spectrum is illuminant("LED-B3") and light.spectrum_name == "ours.csv" and len(light.notes) == 1


@pytest.mark.parametrize(
    ("settings", "field", "words"),
    [
        ({}, "booth", "one lamp"),
        ({"booth": "D65", "spectrum": illuminant("A")}, "booth", "one lamp"),
        ({"booth": "A", "depth": 0}, "depth", "no size"),
        ({"booth": "A", "wall_reflectance": 42}, "wall_reflectance", "not per cent"),
        ({"booth": "A", "illuminance_lux": -1}, "illuminance_lux", "no power"),
    ],
)
def test_what_is_no_booth_is_named(settings, field, words):
    with pytest.raises(InputError, match=words) as caught:
        light_booth(**settings)
    assert caught.value.field == field


def test_an_unknown_booth_says_the_nearest():
    with pytest.raises(UnknownNameError, match="nearest: TL8"):
        light_booth("TL87")
    assert list(LAMPS) == ["D65", "A", "TL84", "CWF", "TL83", "U30", "TL85", "U50", "U40", "WWF", "UV", "horizon"]
