"""Progress of an import: how far it is, and how long the rest will take."""

import inspect
from itertools import pairwise
from types import SimpleNamespace

import pytest
from metamer.materials.fitting import refinement
from metamer.materials.fitting.fit import RANKS
from metamer.materials.intake import progress
from metamer.materials.intake.importing import import_sources
from metamer.materials.intake.progress import OUT_OF_BOUNDS, Doing, in_bytes, share_done
from metamer.materials.intake.sources import read_sources
from metamer.materials.intake.work import fit_material
from metamer.runtime.progress import TimeLeft
from metamer.runtime.worker_pool import Task, supervised

GREY = 'family = "grey"\nkind = "analytic"\n[[material]]\nname = "grey"\nmodel = "oren_nayar"\nsigma = 0.3\n'
CONSTANT = "reflectance = { constant = 0.5 }\n"


@pytest.fixture
def grey(tmp_path):
    (tmp_path / "grey.toml").write_text(GREY + CONSTANT)
    return tmp_path / "grey.toml"


def tried(*steps):
    return [SimpleNamespace(rank=rank, score=score, joint=joint, lobe=0) for rank, score, joint in steps]


# A metal by a formula and a measured paint: seconds of one core, and a trial (terms, score, whether all packs were
# refined together) or the words while packs are brought within their bounds; last, when the fit was stored.
METAL = [
    (1.7, (1, 6.36, False)), (1.9, (2, 1.8, False)), (2.9, (3, 0.87, False)), (3.5, (3, 0.55, True)),
    (4.4, (4, 1.08, False)), (4.8, (5, 0.5, False)), (5.3, (6, 0.46, False)),
    (5.8, "6 terms: 10 places are"), (6.1, "6 terms: 17 places are"), (6.5, "6 terms: 11 places are"),
    (7.1, "6 terms: 5 places are"), (7.4, "6 terms: 3 places are"), (8.8, None),
]  # fmt: skip
PAINT = [
    (4.4, (1, 25.6, False)), (5.2, (2, 8.04, False)), (8.2, (8, 3.76, False)), (11.0, (8, 2.85, True)),
    (12.8, (8, 2.86, True)), (14.5, (8, 2.84, True)), (19.3, (16, 1.31, True)), (31.9, (24, 0.95, True)),
    (43.0, (32, 0.8, True)), (57.2, (48, 0.6, True)), (72.3, "56 terms: 112 places are"),
    (77.0, "56 terms: 41 places are"), (81.9, "56 terms: 11 places are"), (83.0, (56, 0.44, True)), (84.1, None),
]  # fmt: skip


@pytest.mark.parametrize("history", [METAL, PAINT])
def test_the_time_left_of_a_fit_is_within_a_factor_of_two(history):
    trials, clock, factors, end = [], [0.0], [], history[-1][0]
    left = TimeLeft(now=lambda: clock[0])
    left.expect("fit", "merl", 90.0, evenly=True)
    left.at("fit")
    for clock[0], what in history[:-1]:
        phase = f"{what} {OUT_OF_BOUNDS}" if isinstance(what, str) else ""
        if not phase:
            trials += tried(what)
        left.at("fit", share_done(trials, 0.5, phase))
        seconds = left.seconds
        if seconds is not None and 0.1 * end < clock[0] < min(0.9 * end, end - 2.0):
            factors.append(seconds / (end - clock[0]))
    assert all(0.5 <= factor <= 2.0 for factor in factors) and len(factors) > 7, factors


def test_no_share_of_a_fit_is_told_without_a_score():
    assert share_done([], 0.5) == share_done(tried((1, float("nan"), False)), 0.5) == 0.0


def test_the_share_of_a_fit_falls_where_more_terms_are_needed_than_seemed():
    early, late = (share_done(tried((2, 4.0, False), (8, 0.7, True), *more), 0.5) for more in ([], [(16, 0.69, True)]))
    assert 0.0 < late < early < 0.5
    # No more terms than a fit has at the most are expected.
    most = share_done(tried((8, 4.0, True), (progress.MOST_TERMS, 3.9, True)), 0.5)
    assert most > 0.4


def test_words_of_bounds_are_those_of_fits():
    assert OUT_OF_BOUNDS in inspect.getsource(refinement)


def test_most_terms_are_those_of_fits():
    assert RANKS[-1] == progress.MOST_TERMS


@pytest.mark.parametrize(("total", "words"), [(4_000_000_000, "hashing, 2 GB of 4 GB"), (0, "hashing, 2 GB read")])
def test_bytes_are_told_now_and_then(monkeypatch, total, words):
    now, said = [10.0], []
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: now[0]))
    heard = in_bytes("hashing", total, said.append)
    for _ in range(3):
        heard(500_000_000)
    assert not said
    now[0] += 1.0
    heard(500_000_000)
    heard(500_000_000)
    assert said == [Doing(words, 0.5 if total else 0.0)]


def test_a_fit_says_its_phases_and_trials(grey):
    (material,) = read_sources(grey)
    heard = []
    fitted = fit_material(material, 3.0, heard.append)
    phases = [doing.phase for doing in heard]
    assert phases[:3] == ["preparing", "looking at the original", "tabulating in io"]
    trials = [doing for doing in heard if "p99" in doing.phase]
    assert len(trials) == len(fitted.trials) and all(" in io, p99 " in doing.phase for doing in trials)
    # Every trial is announced before it is made.
    assert all(earlier != later for earlier, later in pairwise(phases)) and 0.4 < heard[-1].share < 1.0


def test_a_fit_in_another_process_is_heard_here(grey):
    (material,) = read_sources(grey)
    heard = []
    ((_, fitted),) = supervised(fit_material, [Task("key", (material, 3.0))], 1, lambda *told: heard.append(told))
    assert [doing.phase for _, doing in heard[:2]] == ["preparing", "looking at the original"]
    assert not fitted.reason


@pytest.mark.slow_cases("True")
@pytest.mark.parametrize("apart", [False, True])
def test_an_import_says_what_begins_and_what_it_is_at(grey, tmp_path, apart):
    begun, heard = [], []
    import_sources(
        [grey],
        tmp_path / "cat",
        jobs=1,
        budget=3.0,
        apart=apart,
        begins=lambda pending, jobs: begun.append(([(one.id, one.model) for one in pending], jobs.count)),
        doing=lambda material_id, doing: heard.append((material_id, doing.phase)),
    )
    assert begun == [([("grey/grey", "oren_nayar")], 1)]
    assert heard[:3] == [("grey/grey", phase) for phase in ("reading", "preparing", "looking at the original")]
    assert len(heard) > 3
