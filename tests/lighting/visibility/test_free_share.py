"""The free share of a lobe, against the integral of Wang et al. 2009, eqs. 28 to 30."""

import numpy as np
import pytest
from metamer.lighting.visibility.free_share import LARGEST_ERROR, free_share
from metamer.runtime.errors import InputError

NODES, SHARES = np.polynomial.legendre.leggauss(200)
ANGLES = np.linspace(-np.pi / 2.0, np.pi / 2.0, 61)


def integral(angle, sharpness):
    """The lobe over the lune between the horizon of its axis and a great circle at `angle`, of the whole hemisphere.

    In the frame of the lobe, with xi from the boundary's pole and t from the axis across the boundary:
    exp(lambda (sin xi cos t - 1)) sin xi.
    """
    reach = min(np.pi / 2.0, 9.0 / np.sqrt(max(sharpness, 1e-9)))
    xi = reach * NODES

    def up_to(end):
        end = np.sign(end) * min(abs(end), reach)
        t = 0.5 * end * (NODES + 1.0)
        values = np.exp(sharpness * (np.cos(xi)[:, None] * np.cos(t) - 1.0)) * np.cos(xi)[:, None]
        return 0.5 * end * (SHARES[:, None] * SHARES * values).sum()

    return 0.5 + 0.5 * up_to(angle) / up_to(np.pi / 2.0)


@pytest.mark.parametrize("sharpness", [0.0, 0.01, 0.3, 1.0, 2.0, 3.2, 5.0, 8.0, 15.0, 40.0, 200.0, 3e3, 1e5])
def test_it_is_the_integral_to_its_stated_error(sharpness):
    exact = np.array([integral(angle, sharpness) for angle in ANGLES])
    assert np.abs(free_share(ANGLES, sharpness) - exact).max() <= LARGEST_ERROR


def test_no_sharpness_between_is_worse():
    sharpness = np.geomspace(0.05, 500.0, 60)
    for angle in (0.2, 0.5, 0.9, 1.3):
        exact = np.array([integral(angle, each) for each in sharpness])
        assert np.abs(free_share(np.full(60, angle), sharpness) - exact).max() <= LARGEST_ERROR


@pytest.mark.parametrize("sharpness", [0.0, 1e-9, 1.0, 1e6, 1e300, np.inf])
def test_it_grows_from_nothing_to_all(sharpness):
    share = free_share(np.linspace(-2.0, 2.0, 401), sharpness)
    assert share[0] == 0.0 and share[-1] == 1.0 and share[200] == 0.5
    assert (np.diff(share) >= 0.0).all()
    assert share + share[::-1] == pytest.approx(1.0)


@pytest.mark.parametrize("sharpness", [-1.0, np.nan])
def test_what_is_no_sharpness_is_refused(sharpness):
    with pytest.raises(InputError, match="sharpness"):
        free_share(np.zeros(2), np.array([1.0, sharpness]))
