"""Tasks on a worker of a cluster, without a cluster: code, what it has to hold, threads."""

import threading
from collections import deque
from importlib.util import find_spec

import pytest
from metamer.runtime import dask_cluster
from metamer.runtime.dask_cluster import _drained, _keep, _served, _Unprepared
from metamer.runtime.worker_pool import Lost, Task
from patience import patient

CODE = "today", lambda: "today"


@pytest.fixture(autouse=True)
def fresh_worker(monkeypatch):
    monkeypatch.setattr(dask_cluster, "_starts", {})
    monkeypatch.setattr(dask_cluster, "_thread", dask_cluster._Thread())


def test_a_worker_that_joined_late_says_so_and_gets_what_it_needs():
    held = []
    start = held.append, ("triangles",)
    assert isinstance(_served(CODE, "a", None, len, (held,)), _Unprepared) and not held
    assert _served(CODE, "a", start, len, (held,)) == 1
    assert _served(CODE, "a", None, len, (held,)) == 1, "once for all of its tasks"
    assert isinstance(_served(CODE, "b", None, len, (held,)), _Unprepared), "another command's"


def test_each_thread_of_a_worker_begins_for_itself():
    """Contexts of OpenGL and what is held belong to a thread."""
    begun = []
    _keep("a", (lambda: begun.append(threading.current_thread().name), ()))

    def two_tasks():
        for _ in range(2):
            _served(CODE, "a", None, len, ("",))

    for name in ("one", "other"):
        thread = threading.Thread(target=two_tasks, name=name)
        thread.start()
        thread.join(timeout=patient(30))
    assert begun == ["one", "other"]


def test_a_start_that_fails_is_tried_again_with_the_next_task():
    tries = []

    def start():
        tries.append(len(tries))
        if len(tries) == 1:
            raise ValueError("no room")

    _keep("a", (start, ()))
    with pytest.raises(ValueError, match="no room"):
        _served(CODE, "a", None, len, ("",))
    assert _served(CODE, "a", None, len, ("four",)) == 4 and len(tries) == 2


def test_a_worker_with_other_code_does_nothing():
    done = []
    result = _served(("another day", lambda: "today"), None, None, done.append, (1,))
    assert isinstance(result, Lost) and "another version of metamer" in result.reason and not done


class Future:
    """A task, done when its result is asked for."""

    def __init__(self, call, given):
        self.result, self.release = lambda: call(*given), lambda: None


class Cluster:
    """A cluster in this thread, which does a task when it is sent one; each time it is asked it has a thread more."""

    def __init__(self, loop=None):
        self.loop, self.asked, self.longest, self.sent = loop, 0, 0, deque()

    def nthreads(self):
        self.asked += 1
        return {"worker": self.asked}

    def submit(self, call, *given, **options):
        return Future(call, given)

    def add(self, future):
        self.sent.append(future)
        self.longest = max(self.longest, len(self.sent))

    def __next__(self):
        return self.sent.popleft()


@pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed; it is in the extra `cluster`")
@pytest.mark.parametrize(("a_look_s", "asked", "longest"), [(0.0, 1, 2), (0.6, 11, 10)])
def test_a_scheduler_is_not_asked_for_its_workers_at_each_result(monkeypatch, a_look_s, asked, longest):
    """A second has passed at every other of 21 results, the end among them; more workers are sent more at once."""
    cluster, now = Cluster(), iter(range(1000))
    monkeypatch.setattr("distributed.as_completed", lambda loop: cluster)
    monkeypatch.setattr(dask_cluster.time, "monotonic", lambda: a_look_s * next(now))
    tasks = (Task(number, ("x" * number,)) for number in range(20))
    found = list(_drained(cluster, len, tasks, "tcp://here", CODE, None, None))
    assert found == [(number, number) for number in range(20)]
    assert (cluster.asked, cluster.longest) == (asked, longest)
