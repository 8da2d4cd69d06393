"""A moving picture has as many pixels as leave it fluent, and is slow where nothing else helps."""

import pytest
from metamer.viewer.window.coarseness import COARSEST, SLOW, Coarseness


def after(fixed, pixels, count=40, spikes=()):
    """Resolutions of pictures that take `fixed` seconds and `pixels` more at full resolution."""
    coarseness, found = Coarseness(), []
    for number in range(count):
        found.append(coarseness.pixels)
        coarseness.took(0.2 if number in spikes else fixed + pixels / coarseness.pixels**2)
    return found


@pytest.mark.parametrize(
    ("fixed", "pixels", "wanted"),
    [
        (0.012, 0.002, 1),  # a fast GPU: fluent with all pixels
        (0.010, 0.016, 2),  # fluent with a quarter
        (0.012, 0.040, 2),  # never 60 a second within a half: 30 with a quarter
        (0.030, 0.020, 3),
        (0.010, 0.020, 2),
        (0.020, 0.150, 2),  # never fluent: the finest that is not slow
        (0.030, 0.400, 3),
        (0.100, 0.400, COARSEST),  # always slow
    ],
)
def test_it_comes_to_rest_at_the_finest_resolution_of_the_best_rate(fixed, pixels, wanted):
    assert set(after(fixed, pixels)[12:]) == {wanted}


@pytest.mark.parametrize(("fixed", "pixels"), [(0.012, 0.002), (0.010, 0.016), (0.030, 0.020)])
def test_a_picture_that_the_machine_was_busy_in_changes_nothing_for_long(fixed, pixels):
    assert after(fixed, pixels, 60, spikes=(20, 31))[-1] == after(fixed, pixels)[-1]


def test_a_first_picture_that_compiles_shaders_is_not_held_against_its_resolution():
    assert after(0.012, 0.002, spikes=(0,))[-1] == 1
    assert after(0.010, 0.016, spikes=(0, 1))[-1] == 2


def test_a_finer_resolution_is_tried_only_where_it_cannot_be_slow():
    for pixels in (0.05, 0.1, 0.2, 0.4, 0.8):
        taken = [0.005 + pixels / one**2 for one in after(0.005, pixels)]
        assert max(taken[1:]) <= max(SLOW, taken[0])


def test_after_a_rest_it_looks_anew():
    coarseness = Coarseness()
    for _ in range(20):
        coarseness.took(0.03 / coarseness.pixels**2)
    assert coarseness.pixels == 2
    coarseness.rest()
    for _ in range(20):
        coarseness.took(0.008)
    assert coarseness.pixels == 1
