"""Softboxes against closed forms: what they give a surface, by formula and by drawing, from near, far and behind."""

import numpy as np
import pytest
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.runtime.errors import InputError
from metamer.spectral.illuminants import illuminant

D65 = illuminant("D65")


def softbox(position=(0, 3, 0), target=(0, 0, 0), width=1.2, height=0.7, **more):
    return SoftboxLight(position, target, width, height, D65, **more)


def drawn(light, point, count=60000, seed=1):
    """Directions, densities and luminances of many draws from one point."""
    points = np.tile(np.asarray(point, dtype=float), (count, 1))
    to, density = light.drawn(points, np.random.default_rng(seed).random((count, 2)))
    return points, to, density, light.luminance(points, to)[:, 0]


def below_the_middle(width, height, distance):
    """Configuration factor of a small plane that faces a rectangle's middle: four times that of a corner."""
    a, b = 0.5 * width / distance, 0.5 * height / distance
    first = a / np.hypot(1, a) * np.arctan(b / np.hypot(1, a))
    return 4 / (2 * np.pi) * (first + b / np.hypot(1, b) * np.arctan(a / np.hypot(1, b)))


@pytest.mark.parametrize("distance", [0.05, 0.5, 3.0, 100.0])
def test_the_target_receives_what_was_asked_for(distance):
    light = softbox(position=(1, distance, 2), target=(1, 0, 2), illuminance_lux=750)
    expected = 750 / (np.pi * below_the_middle(1.2, 0.7, distance))
    assert light.luminance_cd_m2 == pytest.approx(expected, rel=1e-9)
    _, to, density, luminance = drawn(light, (1, 0, 2))
    assert np.mean(luminance * to[:, 1] / density) == pytest.approx(750, rel=0.02)


@pytest.mark.parametrize(
    "point", [(0.3, 0.4, -0.2), (0, 2.9, 0), (4, 2.5, 0), (30, -200, 5), (0.6, 0, 0.35), (9, 2.999, 1)]
)
def test_drawing_finds_what_the_formula_gives(point):
    light = softbox()
    points, to, density, luminance = drawn(light, point)
    assert (luminance == light.luminance_cd_m2).all()
    np.testing.assert_allclose(np.linalg.norm(to, axis=1), 1, rtol=1e-14)
    np.testing.assert_allclose(light.density(points, to), density, rtol=1e-9)
    expected = light.irradiance_vectors(points[:1])[0]
    found = np.mean(luminance[:, None] / density[:, None] * to, axis=0)
    np.testing.assert_allclose(found, expected, atol=0.02 * np.linalg.norm(expected))
    away = light.distance(points, to)
    ends = points + away[:, None] * to
    np.testing.assert_allclose(ends @ light.axes[2], light.position @ light.axes[2], atol=1e-9 * np.linalg.norm(point))


def test_it_is_even_by_solid_angle():
    """Of a quarter of the directions, a quarter of the draws: the density is one number."""
    light = softbox(width=4, height=4)
    _, to, density, _ = drawn(light, (0, 2, 0))
    np.testing.assert_allclose(density, density[0], rtol=1e-12)
    assert 1 / density[0] == pytest.approx(4 * np.arcsin(4 / 5), rel=1e-12), "a pyramid of two by two over one"
    right, up, _ = light.axes
    for side in (to @ right > 0, to @ up > 0):
        assert side.mean() == pytest.approx(0.5, abs=0.01)


def test_small_and_large_agree_where_they_meet():
    """By area and by solid angle are the same from far off."""
    light = softbox()
    near, far = (np.array([[0.0, 3 - d, 0.0]]) for d in (289.0, 291.0))
    down = np.array([[0.0, 1.0, 0.0]])
    densities = [light.density(one, down)[0] * (1.2 * 0.7) / (3 - one[0, 1]) ** 2 for one in (near, far)]
    np.testing.assert_allclose(densities, 1, rtol=1e-5)


def test_from_behind_and_from_the_side_it_is_black():
    light = softbox()
    for point in ((0, 3.5, 0), (0.2, 300, 0), (0, 3, 0), (5, 3, 0)):
        points, to, density, luminance = drawn(light, point, 500)
        assert (luminance == 0).all() and np.isfinite(density).all() and np.isfinite(to).all()
        np.testing.assert_array_equal(light.irradiance_vectors(points[:1]), 0)
        with np.errstate(all="raise"):
            np.testing.assert_array_equal(luminance / density, 0)


def test_a_ray_that_passes_it_by_meets_nothing():
    light = softbox()
    points = np.zeros((4, 3))
    to = np.array([[0.0, -1, 0], [1, 0, 0], [0.3, 1, 0], [0.0, 1, 0]])
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    np.testing.assert_array_equal(light.luminance(points, to)[:, 0] > 0, [False, False, False, True])
    np.testing.assert_array_equal(light.distance(points, to), [np.inf, np.inf, np.inf, 3])
    np.testing.assert_array_equal(light.density(points, to) > 0, [False, False, False, True])


@pytest.mark.parametrize(
    ("position", "up", "expected"),
    [((0, 3, 0), None, (0, 0, -1)), ((0, 0, 3), None, (0, 1, 0)), ((0, 3, 0), (1, 1, 0), (1, 0, 0))],
)
def test_which_way_up_it_is(position, up, expected):
    axes = softbox(position=position, up=up).axes
    np.testing.assert_allclose(axes[1], expected, atol=1e-15)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1)


def test_another_spectrum_keeps_place_and_strength():
    light = softbox(illuminance_lux=300, name="key").with_spectrum(illuminant("A"), "A")
    assert light.spectra == (illuminant("A"),) and light.spectrum_name == "A" and light.name == "key"
    assert light.luminance_cd_m2 == softbox(illuminance_lux=300).luminance_cd_m2


def test_it_counts_with_what_the_middle_of_the_scene_receives():
    box = np.array([-1.0, -1, -1]), np.array([1.0, 1, 1])
    assert softbox().counted_from(*box) == pytest.approx((1000, 3, 3))
    assert softbox(target=(0, 5, 0)).counted_from(*box)[0] == 0


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"target": (0, 3, 0)}, "target", "faces nowhere"),
        ({"width": 0}, "width", "no size"),
        ({"height": float("inf")}, "height", "no size"),
        ({"up": (0, 1, 0)}, "up", "along the direction"),
        ({"illuminance_lux": 0}, "illuminance_lux", "no power"),
        ({"position": (0, 3)}, "position", "not a point"),
    ],
)
def test_what_is_no_softbox_is_named(changes, field, words):
    with pytest.raises(InputError, match=words) as caught:
        softbox(**changes)
    assert caught.value.field == field
