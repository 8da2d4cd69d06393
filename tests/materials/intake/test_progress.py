"""Progress of an import: how far it is, and how long the rest will take."""

from itertools import pairwise
from types import SimpleNamespace

import pytest
from metamer.materials.fitting.fit import RANKS
from metamer.materials.intake import progress
from metamer.materials.intake.importing import import_sources
from metamer.materials.intake.progress import Doing, in_bytes, share_done
from metamer.materials.intake.sources import read_sources
from metamer.materials.intake.work import fit_material
from metamer.runtime.worker_pool import Task, supervised

GREY = 'family = "grey"\nkind = "analytic"\n[[material]]\nname = "grey"\nmodel = "oren_nayar"\nsigma = 0.3\n'
CONSTANT = "reflectance = { constant = 0.5 }\n"


@pytest.fixture
def grey(tmp_path):
    (tmp_path / "grey.toml").write_text(GREY + CONSTANT)
    return tmp_path / "grey.toml"


def trials(*scores):
    return [SimpleNamespace(score=score, joint=False, lobe=0, rank=1) for score in scores]


@pytest.mark.parametrize(
    ("scores", "share"),
    [((), 0.0), ((8.0,), 0.0), ((8.0, 2.0), 0.05), ((8.0, 0.5), 0.9), ((8.0, 0.1), 0.9), ((float("nan"),), 0.0)],
)
def test_the_share_of_tables_is_the_way_to_the_budget(scores, share):
    assert share_done(trials(*scores), 0.5) == pytest.approx(share)


def grown(*steps):
    return [SimpleNamespace(score=score, joint=True, lobe=0, rank=rank) for rank, score in steps]


def test_the_share_of_growth_is_what_terms_gained_so_far():
    lobe, other = (SimpleNamespace(score=score, joint=False, lobe=at, rank=4) for score, at in ((0.5, 0), (8.0, 1)))
    assert share_done([lobe, other], 0.5) == 0.0
    # Eight terms halved it: sixteen more will do.
    assert share_done([lobe, other, *grown((8, 4.0), (16, 2.0))], 0.5) == pytest.approx(0.1 + 0.6 * (16 / 32) ** 2)
    # At that pace there is no end: the most terms are.
    assert share_done(grown((8, 4.0), (24, 3.9)), 0.5) == pytest.approx(0.1 + 0.6 * (24 / progress.MOST_TERMS) ** 2)
    assert share_done(grown((8, 4.0), (8, 4.0)), 0.5) < 0.2


def test_the_share_of_a_fit_that_is_brought_within_its_bounds_leaves_time_for_it():
    most = progress.MOST_TERMS
    assert share_done(grown((8, 4.0), (most - 8, 2.0), (most, 1.5)), 0.5) == pytest.approx(0.7)


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
    assert all(earlier != later for earlier, later in pairwise(phases)) and heard[-1].share == 0.9


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
