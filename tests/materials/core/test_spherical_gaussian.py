"""Spherical Gaussians in closed form, against sums over the sphere and at the ends of what a sharpness may be."""

from itertools import pairwise

import numpy as np
import pytest
from metamer.materials.core.directions import spherical
from metamer.materials.core.spherical_gaussian import Gaussians, area, share_in_hemisphere, sharpness_of_area
from scipy.integrate import quad

UP = np.array([0.0, 0.0, 1.0])
NODES, WEIGHTS = np.polynomial.legendre.leggauss(120)


def _sphere():
    """Directions and solid angles of a quadrature that is exact for all that is smooth."""
    around = 2.0 * np.pi * (np.arange(240) + 0.5) / 240
    to = spherical(*np.meshgrid(np.arccos(NODES), around, indexing="ij")).reshape(-1, 3)
    return to, np.repeat(WEIGHTS, 240) * 2.0 * np.pi / 240


TO, SOLID = _sphere()


def _lobe(axis, sharpness, amplitude=1.0):
    axis = np.asarray(axis, dtype=float)
    return Gaussians(axis / np.linalg.norm(axis), np.array(sharpness), np.array(amplitude))


PAIRS = [
    (_lobe([0, 0, 1], 3.0, 2.0), _lobe([1, 2, 0.5], 7.0, 0.5)),
    (_lobe([0.2, -1, 1], 1e-6), _lobe([1, 0, 0], 40.0)),
    (_lobe([0, 0, 1], 1e-6), _lobe([0, 0, -1], 1e-6)),
    (_lobe([0, 0.6, 0.8], 25.0), _lobe([0, -0.6, -0.8], 25.0)),
    (_lobe([0, 0.6, 0.8], 25.0), _lobe([0, -0.6, -0.8], 24.0)),
    (_lobe([1, 1, 1], 60.0), _lobe([1, 1, 0.98], 60.0)),
]


@pytest.mark.parametrize("sharpness", [0.0, 1e-6, 0.3, 10.0, 300.0])
def test_integral_is_that_of_the_sphere(sharpness):
    lobe = _lobe([0.3, -0.4, 0.5], sharpness, 1.7)
    assert lobe.integral == pytest.approx(float(SOLID @ lobe.value(TO)), rel=1e-9)


@pytest.mark.parametrize("sharpness", [1e5, 1e8])
def test_a_very_sharp_lobe_has_its_limit(sharpness):
    lobe = _lobe([0.3, -0.4, 0.5], sharpness)
    assert lobe.integral == pytest.approx(2.0 * np.pi / sharpness, rel=1e-12)
    assert lobe.value(lobe.axis) == 1.0
    aside = lobe.axis + np.cross(lobe.axis, UP) * 1e-4
    assert lobe.value(aside) == pytest.approx(np.exp(-0.5 * sharpness * np.sum((aside - lobe.axis) ** 2)), rel=1e-6)


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_a_product_is_the_product_in_every_direction(first, second):
    product = first.product(second)
    np.testing.assert_allclose(product.value(TO), first.value(TO) * second.value(TO), rtol=1e-9, atol=1e-300)
    assert np.linalg.norm(product.axis) == pytest.approx(1.0)
    assert first.inner(second) == pytest.approx(float(SOLID @ (first.value(TO) * second.value(TO))), rel=1e-8)


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_inner_products_are_the_printed_ones_where_those_can_be_worked_out(first, second):
    """Eq. 4: 4 pi mu1 mu2 sinh(d) / (d exp(lambda1 + lambda2))."""
    distance = np.linalg.norm(first.sharpness * first.axis + second.sharpness * second.axis)
    whole = first.sharpness + second.sharpness
    ratio = np.sinh(distance) / distance if distance > 1e-12 else 1.0
    printed = 4.0 * np.pi * first.amplitude * second.amplitude * ratio / np.exp(whole)
    assert first.inner(second) == pytest.approx(float(printed), rel=1e-8)


def test_opposite_lobes_of_one_sharpness_make_a_constant():
    product = _lobe([0, 0, 1], 2.5).product(_lobe([0, 0, -1], 2.5))
    assert product.sharpness == 0.0
    np.testing.assert_allclose(product.value(TO), np.exp(-5.0), rtol=1e-12)
    assert product.integral == pytest.approx(4.0 * np.pi * np.exp(-5.0))


def test_exponents_that_overflow_as_printed_do_not():
    first, second = _lobe([0, 0, 1], 1e8), _lobe([1e-4, 0, 1], 1e8)
    # Two narrow lobes in the plane: exp(-lambda d^2 / 4) pi / lambda, at a distance d.
    apart = np.sum((first.axis - second.axis) ** 2)
    expected = np.exp(-1e8 * apart / 4.0) * np.pi / 1e8
    assert first.inner(second) == pytest.approx(expected, rel=1e-6)
    with np.errstate(over="ignore"):
        assert np.isinf(np.sinh(2e8))
    assert _lobe([0, 0, 1], 1e8).inner(_lobe([0, 0, -1], 1e8)) == 0.0
    assert _lobe([0, 0, 1], 1e8).inner(_lobe([1, 0, 0], 1e-6)) == pytest.approx(2e-8 * np.pi, rel=1e-5)


def test_a_lobe_among_many_is_as_one_alone():
    """Shapes broadcast: (4, 1) lobes with (3,) are 4 x 3 pairs."""
    random = np.random.default_rng(5)
    axis = random.normal(size=(7, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    many = Gaussians(axis[:4, None], np.array([[1.0], [3.0], [9.0], [27.0]]), np.ones((4, 1)))
    few = Gaussians(axis[4:], np.array([2.0, 4.0, 8.0]), np.ones(3))
    inner = many.inner(few)
    assert inner.shape == (4, 3)
    alone = Gaussians(axis[2], np.array(9.0), np.array(1.0)).inner(Gaussians(axis[5], np.array(4.0), np.array(1.0)))
    assert inner[2, 1] == pytest.approx(float(alone))


def test_area_is_where_a_lobe_is_above_a_tenth_and_its_inverse_undoes_it():
    sharpness = np.array([3.0, 50.0, 4000.0])
    for one in (3.0, 12.0):
        above = SOLID[_lobe([0, 0, 1], one).value(TO) >= 0.1].sum()
        assert area(np.array(one)) == pytest.approx(above, rel=0.05)
    np.testing.assert_allclose(sharpness_of_area(area(sharpness)), sharpness)
    assert area(np.array(0.0)) == area(np.array(1e-6)) == 4.0 * np.pi


def _exact_share(theta_d, sharpness):
    """Integrate the share by circles about the lobe's axis, of which so much lies inside."""

    def circle(theta):
        across = -np.cos(theta) * np.sin(theta_d) / (np.sin(theta) * np.cos(theta_d) + 1e-300)
        return np.exp(sharpness * (np.cos(theta) - 1.0)) * np.sin(theta) * 2.0 * np.arccos(np.clip(across, -1, 1))

    edge = abs(theta_d)
    ends = [0.0, *sorted({edge, np.pi - edge, min(8.0 / np.sqrt(sharpness), 3.0)}), np.pi]
    whole = sum(quad(circle, a, b, epsabs=1e-14, epsrel=1e-11, limit=200)[0] for a, b in pairwise(ends))
    return whole / float(_lobe([0, 0, 1], sharpness).integral)


@pytest.mark.parametrize("sharpness", [1e-6, 1.0, 30.0, 3000.0])
@pytest.mark.parametrize("theta_d", [-1.5, -0.3, -0.01, 0.02, 0.2, 1.2])
def test_the_share_in_a_hemisphere_is_exact(theta_d, sharpness):
    assert share_in_hemisphere(np.array(theta_d), np.array(sharpness)) == pytest.approx(
        _exact_share(theta_d, sharpness), abs=1e-9
    )


def test_two_hemispheres_are_the_sphere_even_for_the_sharpest():
    theta_d = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 41)[:, None]
    sharpness = np.array([0.0, 1e-6, 1.0, 1e4, 1e8])
    share = share_in_hemisphere(theta_d, sharpness)
    np.testing.assert_allclose(share + share[::-1], 1.0, atol=1e-12)
    assert (np.diff(share, axis=0) >= -1e-15).all()
    np.testing.assert_allclose(share[-1, -1], 1.0, atol=1e-12)


def test_products_over_a_hemisphere_are_the_sums_over_it():
    first, second = _lobe([0.2, 0.1, 1], 4.0), _lobe([1, 0, 0.3], 2.0)
    normal = np.array([-0.48, 0.6, 0.64])
    # The edge crosses texels of the quadrature, of which 28 800 make up the sphere.
    inside = SOLID * (TO @ normal > 0.0)
    expected = float(inside @ (first.value(TO) * second.value(TO)))
    assert first.product(second).over_hemisphere(normal) == pytest.approx(expected, rel=2e-3)
    both = [first.product(second).over_hemisphere(side) for side in (normal, -normal)]
    assert sum(both) == pytest.approx(float(first.inner(second)))
