"""Means of factors along their axes: the measure they are taken in, the ends of the axes, and their look-up."""

import numpy as np
import pytest
from metamer.materials.core.axes import Axis, frame_angles
from metamer.materials.core.points import Points
from metamer.materials.factored.pyramids import MOST_LEVELS, axis_levels, filtered_values, level_of, pyramid, width_of
from metamer.materials.fitting.half_precision import rounded_to_half

TURN = 2 * np.pi
AXES = [
    Axis("theta_h", 90, np.pi / 2, "sqrt"),
    Axis("theta_h", 128, 0.1, "sqrt"),
    Axis("theta_h", 3, 1e-3, "sqrt"),
    Axis("theta_h", 400, np.pi / 2, "sqrt"),
    Axis("theta_d", 46, np.pi / 2),
    Axis("theta_o", 2, np.pi / 2),
    Axis("theta_i", 5, 0.4),
    Axis("phi_d", 33, np.pi),
    Axis("phi", 2, np.pi),
    Axis("phi_h", 64, TURN, periodic=True),
    Axis("phi_i", 7, TURN, periodic=True),
    Axis("phi_h", 17, np.pi, periodic=True),
    Axis("phi_d", 33, TURN),
]


def level(axis, number, factor):
    """Node positions of a level, and the factor's means there."""
    made = axis_levels(axis)
    rows = slice(made.starts[number], made.starts[number] + made.sizes[number])
    return made.spacings[number] * np.arange(made.sizes[number]), made.weights[rows] @ factor


def means(pack):
    return pyramid(pack.axes, pack.factors, pack.precision == "half")


def directions(count, seed=0):
    rng = np.random.default_rng(seed)
    pairs = rng.normal(size=(2, count, 3))
    pairs[..., 2] = np.abs(pairs[..., 2])
    return pairs / np.linalg.norm(pairs, axis=-1, keepdims=True)


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_means_are_means(axis):
    made = axis_levels(axis)
    assert len(made.sizes) == len(made.spacings) == len(made.starts) <= MOST_LEVELS
    np.testing.assert_allclose(made.weights.sum(axis=1), 1.0, atol=1e-12)
    assert (made.weights >= 0.0).all()
    np.testing.assert_array_equal(made.weights[: axis.size], np.eye(axis.size))
    rng = np.random.default_rng(1)
    factor = rng.uniform(size=axis.size)
    if axis.periodic:
        factor[-1] = factor[0]
    spread = [np.ptp(level(axis, number, factor)[1]) for number in range(len(made.sizes))]
    assert spread[-1] < 0.2 * spread[0]


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_the_level_of_a_width_is_the_inverse_of_the_width_of_a_level(axis):
    made = axis_levels(axis)
    position = np.linspace(0.0, axis.size - 1.0, 23)
    for number in range(len(made.sizes)):
        found = level_of(axis, position, width_of(axis, position, 2.0**number))
        np.testing.assert_allclose(found, number, atol=1e-9)
    np.testing.assert_array_equal(level_of(axis, position, np.zeros(23)), 0.0)
    np.testing.assert_array_equal(level_of(axis, position, np.full(23, 1e9)), len(made.sizes) - 1)


@pytest.mark.parametrize("number", [1, 2, 3, 4, 5, 6])
@pytest.mark.parametrize("warp", ["linear", "sqrt"])
def test_a_highlight_at_the_pole_is_averaged_over_area(number, warp):
    """A Gaussian over a disc of radius r about it: (1 - exp(-r^2 / s^2)) s^2 / r^2."""
    axis = Axis("theta_h", 400, 0.5, warp)
    width = 0.01
    _, means = level(axis, number, np.exp(-((axis.nodes / width) ** 2)))
    radius = width_of(axis, np.zeros(1), 2.0**number)[0] / np.sqrt(np.pi)
    expected = -np.expm1(-((radius / width) ** 2)) * (width / radius) ** 2
    assert means[0] == pytest.approx(expected, rel=0.01)


def test_a_mean_far_from_the_pole_is_one_along_theta():
    axis = Axis("theta_i", 200, np.pi / 2)
    position, means = level(axis, 4, np.cos(10 * axis.nodes))
    theta = position * axis.maximum / (axis.size - 1)
    # The variance of a disc of area w^2 along its diameter is w^2 / (4 pi).
    width = width_of(axis, position, 16.0)
    damped = np.cos(10 * theta) * np.exp(-0.5 * (10 * width) ** 2 / (4 * np.pi))
    inner = (theta > 1.0) & (theta < 1.4)
    assert np.abs(damped[inner] - np.cos(10 * theta[inner])).max() > 0.05
    np.testing.assert_allclose(means[inner], damped[inner], atol=0.03)


def test_azimuths_are_averaged_around_their_period():
    axis = Axis("phi_h", 65, TURN, periodic=True)
    for number in (2, 3, 4):
        position, means = level(axis, number, np.cos(axis.nodes))
        phi = position * TURN / 64
        np.testing.assert_allclose(means, np.cos(phi) * np.sinc(2.0**number / 64), atol=2e-3)
    assert level(axis, len(axis_levels(axis).sizes) - 1, np.cos(axis.nodes))[1] == pytest.approx(0.0, abs=1e-3)


def test_folded_azimuths_are_mirrored_at_both_ends():
    axis = Axis("phi_d", 33, np.pi)
    for number in (2, 3, 4):
        position, means = level(axis, number, np.cos(3 * axis.nodes))
        phi = position * np.pi / 32
        np.testing.assert_allclose(means, np.cos(3 * phi) * np.sinc(3 * 2.0**number / 64), atol=0.01)


def test_discs_beyond_a_short_axis_see_its_last_node_alone():
    axis = Axis("theta_h", 64, 0.1, "sqrt")
    factor = np.exp(-((axis.nodes / 0.02) ** 2))
    factor[-1] = 0.25
    _, means = level(axis, 7, factor)
    assert means[-1] == pytest.approx(0.25, abs=1e-12)
    assert means[0] < 0.2


@pytest.mark.parametrize("name", ["gloss", "sharp", "brushed", "woven"])
def test_a_sample_without_extent_sees_the_factors_themselves(scenes, name):
    wi, wo = directions(500)
    for pack in scenes.SURFACES[name].packs:
        spanless = Points(wi, wo, spans={pack.frame: np.zeros((500, 4))})
        np.testing.assert_allclose(pack.terms(spanless).value, pack.values(wi, wo), rtol=1e-12, atol=1e-15)


def test_a_sample_that_spans_everything_sees_one_mean(scenes):
    wi, wo = directions(200)
    (pack,) = scenes.SURFACES["brushed"].packs
    at = frame_angles(pack.frame, wi, wo, True)
    found = filtered_values(pack.axes, pack.factors, False, at, np.full((200, 4), 1e3)) / at.scale[:, None]
    assert np.ptp(found, axis=0).max() < 1e-6 * np.abs(found).max()


def test_wider_is_smoother_and_never_jumps(scenes):
    """What is looked up changes steadily with the span, between levels and beyond the last."""
    wi, wo = directions(50)
    pack = scenes.SURFACES["sharp"].packs[1]
    at = frame_angles("hd", wi, wo)
    spans = np.geomspace(1e-5, 10.0, 2000)
    seen = np.stack([filtered_values(pack.axes, pack.factors, False, at, np.full((50, 3), span)) for span in spans])
    assert np.abs(np.diff(seen, axis=0)).max() < 0.02 * np.abs(seen).max()


def test_means_of_a_half_precision_pack_fit_into_16_bits(scenes):
    for pack in (*scenes.SURFACES["sharp"].packs, *scenes.SURFACES["woven"].packs):
        small = rounded_to_half(pack)
        for table, whole in zip(means(small), means(pack), strict=True):
            np.testing.assert_array_equal(table.astype(np.float16), table)
            scale = np.abs(whole).max(axis=0)
            np.testing.assert_allclose(table * scale, whole, atol=1e-3 * scale.max())
