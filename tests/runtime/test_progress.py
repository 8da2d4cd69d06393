"""Time left of work: within a factor of two of what is left, from a tenth of it on, or nothing is said."""

import heapq

import pytest
from metamer.runtime.progress import TimeLeft


class Work:
    """Stages of work on a clock of its own, and the time that was said to be left."""

    def __init__(self, *stages: tuple[str, float], jobs: int = 1) -> None:
        self.now, self.said = 1000.0, []
        self.left = TimeLeft(stages, jobs, lambda: self.now)

    def step(self, done: int, total: int, name: str, seconds: float) -> None:
        """Do the work up to `done` in so many seconds."""
        self.now += seconds
        self.left.heard(done, total, name)
        self.said.append((self.now, self.left.seconds))

    def factors(self, begin: float = 0.1) -> list[float]:
        """Return what was said over what was left, from a share of all the time on and until 2 s before the end."""
        first, end = 1000.0, self.now
        told = [(at, left) for at, left in self.said if at - first >= begin * (end - first) and end - at > 2.0]
        return [left / (end - at) for at, left in told if left is not None]


def test_time_left_is_that_of_all_stages_within_a_factor_of_two():
    # Twice as long as was expected, by both.
    work = Work(("visibility", 5.0), ("drawing", 40.0))
    work.step(0, 100, "visibility", 0.5)
    for done in range(1, 101):
        work.step(done, 100, "visibility", 0.1)
    for done in range(13):
        work.step(done, 12, "drawing", 80.0 / 12 if done else 0.5)
    assert all(0.5 <= factor <= 2.0 for factor in work.factors()) and len(work.factors()) > 20


def test_time_left_expects_nothing_of_stages_that_are_left_out():
    work = Work(("visibility", 500.0), ("drawing", 20.0))
    for done in range(11):
        work.step(done, 10, "drawing", 2.0)
    assert all(0.5 <= factor <= 2.0 for factor in work.factors()) and len(work.factors()) > 5


def test_a_stage_that_is_done_twice_is_two_stages():
    work = Work(("visibility", 10.0), ("visibility", 10.0), ("drawing", 30.0))
    for _ in range(2):
        for done in range(11):
            work.step(done, 10, "visibility", 1.0)
    for done in range(11):
        work.step(done, 10, "drawing", 3.0)
    assert all(0.5 <= factor <= 2.0 for factor in work.factors()) and len(work.factors()) > 20


def test_a_slow_begin_says_little_of_the_rest():
    work = Work()
    for done in range(1, 247):
        work.step(done, 246, f"paint/{done}", 20.0 if done == 1 else 0.3)
    assert all(0.5 <= factor <= 2.0 for factor in work.factors(0.3)) and len(work.factors()) > 200


def test_nothing_is_said_before_a_tenth_is_done():
    work = Work()
    for done in range(1, 101):
        work.step(done, 100, "paint", 1.0)
    assert [left is None for _, left in work.said] == [done < 10 for done in range(1, 101)]
    assert work.said[-1][1] == 0.0


def test_a_stage_that_is_heard_of_late_began_when_the_one_before_ended():
    work = Work()
    work.step(1, 4, "paint", 10.0)
    assert work.left.seconds == pytest.approx(30.0)


def test_what_takes_longer_than_was_expected_is_never_nearly_done():
    work, left = Work(), []
    work.left.expect("a", "merl", 90.0)
    work.left.expect("b", "merl", 90.0)
    work.left.done("b", 90.0)
    work.left.at("a")
    for work.now in (1080.0, 1090.0, 1200.0, 2000.0):
        left.append(work.left.seconds)
    assert min(left) > 0.0 and left[-1] > left[-2]


def test_nothing_left_takes_no_time_and_nothing_known_has_no_words():
    left = TimeLeft()
    assert left.seconds is None
    left.expect("a", "merl", 90.0)
    assert left.seconds is None
    left.done("a", 10.0)
    assert left.seconds == 0.0


def test_what_nobody_timed_teaches_nothing():
    left = TimeLeft(jobs=2)
    for name in "abcd":
        left.expect(name, "merl", 90.0)
    left.done("a", 0.0)
    assert left.seconds is None
    left.done("b", 30.0)
    assert left.seconds == pytest.approx(30.0)


def test_what_takes_longest_and_what_comes_alone_bound_the_rest():
    left = TimeLeft(jobs=4)
    for name, seconds in (("a", 6.0), ("b", 40.0), ("c", 3.0)):
        left.expect(name, name, seconds)
    left.expect("report", "report", 7.0, "last")
    assert "report" in left and "d" not in left
    left.done("a", 12.0)
    # Twice as long as was expected, all of it.
    left.at("c")
    assert left.seconds == pytest.approx(2.0 * (40.0 + 7.0))
    left.expect("rows", "rows", 4.0, "behind")
    assert left.seconds == pytest.approx(2.0 * (40.0 + 4.0 + 7.0))


def in_processes(jobs, each, *, begin=0.1):
    """Factors of what is said over what is left of work in some processes; `each`: kind, weight, seconds that it takes,
    and how many steps tell of it on its way.
    """
    work = Work(jobs=jobs)
    for number, (kind, weight, _, _) in enumerate(each):
        work.left.expect(number, kind, weight)
    free, events = [1000.0] * jobs, []
    for number, (_, _, seconds, steps) in enumerate(each):
        start = heapq.heappop(free)
        heapq.heappush(free, start + seconds)
        events += [(start + seconds * step / steps, number, step / steps) for step in range(steps + 1)]
    events += [(1000.0 + 0.01 * step * (max(free) - 1000.0), -1, 0.0) for step in range(101)]
    for work.now, number, share in sorted(events):
        if number >= 0:
            work.left.at(number, share)
        else:
            work.said.append((work.now, work.left.seconds))
    return work.factors(begin)


def test_kinds_that_were_weighed_wrongly_are_corrected_by_what_is_done():
    # First of their kind in each process, and cheap ones after them; rows; a slow machine.
    each = [*[("first", 6.5, 30.0, 12)] * 2, *[("further", 1.3, 8.0, 4), ("rows", 0.5, 2.0, 3)] * 20]
    found = in_processes(2, each)
    assert all(0.5 <= factor <= 2.0 for factor in found) and len(found) > 80


def test_one_long_item_tells_by_its_own_steps():
    found = in_processes(2, [("reference", 1.0, 40.0, 30), ("rows", 0.1, 4.0, 3)])
    assert all(0.5 <= factor <= 2.0 for factor in found) and len(found) > 60


def test_many_short_items_and_a_few_long_ones_are_weighed_by_kind():
    each = [("merl", 90.0, 50.0, 20)] * 3 + [("lambert", 0.1, 0.2, 1)] * 60 + [("formula", 2.0, 1.0, 2)] * 40
    found = in_processes(2, each)
    assert all(0.5 <= factor <= 2.0 for factor in found) and len(found) > 80


def test_a_kind_is_known_by_the_later_of_its_own():
    left = TimeLeft()
    for number, (kind, seconds) in enumerate([("a", 8.0), ("a", 8.0), ("a", 2.0), ("a", 2.0), ("b", 100.0)]):
        left.expect(number, kind, 1.0)
        left.done(number, seconds)
    for number in (5, 6):
        left.expect(number, "a", 1.0)
    assert left.seconds == pytest.approx(4.0)


@pytest.mark.parametrize(("evenly", "seconds"), [(True, 60.0), (False, 0.5)])
def test_a_share_falls_where_more_turns_out_to_be_left(evenly, seconds):
    """Work that is told evenly counts so; for all else it is as if nothing had been heard since."""
    work = Work()
    work.left.expect("a", "reference", 1.0, evenly=evenly)
    work.left.at("a")
    work.now += 10.0
    work.left.at("a", 0.5)
    assert work.left.seconds == pytest.approx(10.0)
    work.now += 10.0
    work.left.at("a", 0.25)
    assert work.left.seconds == pytest.approx(seconds, abs=2.0)
