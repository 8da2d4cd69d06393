"""One step more than a fit took: what it would have paid, by what was tried."""

from types import SimpleNamespace

import numpy as np
import pytest
from metamer.materials.analytic import OrenNayar
from metamer.materials.core.fit_error import FitError
from metamer.materials.fitting.candidate_scoring import Trial
from metamer.materials.fitting.fit import fit, one_more_step
from metamer.materials.fitting.term_growth import Growth
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

ERROR = FitError(0.1, 0.2, 0.3, 0.4, "D65", "1931_2", "sphere", 0.0)


def grown(*steps, candidate="lobes", joint=True):
    return [Trial(0, "hd", rank, 0.0, ERROR, score, True, candidate, joint) for rank, score in steps]


@pytest.mark.parametrize(
    ("trials", "ended", "expected"),
    [
        # The last sixteen terms took a fifth off: so would sixteen more.
        (grown((64, 1.0), (80, 0.8)), (80, 0.9), (16, 0.72)),
        # More terms were tried, and are what they were, as much as bounds cost more.
        (grown((64, 1.0), (80, 0.8), (96, 0.6)), (80, 0.9), (16, 0.675)),
        (grown((64, 1.0), (80, 0.8), (96, 1.2)), (80, 0.8), (16, 1.2)),
        # The better of two trials with as many terms.
        (grown((8, 4.0), (16, 3.0), (16, 2.0)), (16, 2.0), (8, 1.0)),
        # Terms that gained nothing promise nothing.
        (grown((8, 1.0), (16, 1.1)), (16, 1.1), (8, 1.1)),
        # Nothing was added, or by another candidate or for a lobe alone.
        (grown((8, 1.0)), (8, 1.0), None),
        (grown((4, 2.0), candidate="io") + grown((8, 1.0)), (8, 1.0), None),
        (grown((4, 2.0), joint=False) + grown((8, 1.0)), (8, 1.0), None),
        ([], (8, 1.0), None),
    ],
)
def test_one_more_step_is_what_was_tried_or_what_the_last_step_paid(trials, ended, expected):
    found = one_more_step(trials, "lobes", *ended)
    assert found == (expected if expected is None else pytest.approx(expected))


@pytest.mark.slow_cases("1e-06-False")
@pytest.mark.parametrize(("budget", "met"), [(5.0, True), (1e-6, False)])
def test_a_fit_says_what_it_aimed_at_and_what_it_came_to(budget, met):
    red = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.linspace(0.1, 0.6, len(WORKING_WAVELENGTHS_NM)))
    found = fit(OrenNayar(red, 0.35), budget=budget, ranks=(1, 2), pixels=32)
    assert (found.error.budget, found.error.score) == (budget, found.score)
    assert (found.error.score <= budget) is met


@pytest.mark.parametrize(
    ("rank", "score", "more"),
    [(16, 0.7, 4), (16, 0.8, 8), (32, 0.7, 8), (48, 0.8, 16), (64, 0.7, 16), (80, 0.51, 16), (92, 0.7, 4)],
)
def test_steps_near_the_budget_are_small_while_terms_are_few(rank, score, more):
    growth = Growth.__new__(Growth)
    growth.settings = SimpleNamespace(budget=0.5, ranks=(1, 96))
    assert growth._more(SimpleNamespace(rank=rank, judgement=SimpleNamespace(score=score))) == more
