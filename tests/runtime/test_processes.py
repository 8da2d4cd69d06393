"""Processes that may die: what a death costs, and what is left when the parent goes."""

import inspect
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest
from metamer.runtime.errors import MetamerError
from metamer.runtime.worker_pool import Lost, Task, each_done, in_order, supervised
from patience import patient

# Work that a fresh Python can import: each call is one that the standard library has.
linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks for processes in /proc")


def alive(pid):
    try:
        return "Z (zombie)" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


def test_results_come_back_with_their_keys():
    assert sorted(supervised(pow, (Task(n, (n, 2)) for n in range(6)), 2)) == [(n, n * n) for n in range(6)]


def test_nothing_to_do_starts_nothing():
    assert list(supervised(pow, [], 0)) == []


def test_tasks_are_asked_for_when_a_process_is_free():
    asked = []

    def tasks():
        for number in range(6):
            asked.append(number)
            yield Task(number, (number, 2))

    with closing(supervised(pow, tasks(), 2)) as results:
        next(results)
        assert len(asked) < 6


def test_a_task_that_kills_its_process_fails_after_a_second_try_and_the_others_are_done():
    """Exit code 7 stands for any sudden end; the other tasks are numbers to add to it."""
    tasks = [Task(code, (f"import os; {code}",)) for code in ("0", "os._exit(7)", "1", "os._exit(7) ")]
    results = dict(supervised(exec, tasks, 2))
    assert results["0"] is None and results["1"] is None
    for code in ("os._exit(7)", "os._exit(7) "):
        assert isinstance(results[code], Lost) and "exit code 7" in results[code].reason


def test_a_task_whose_process_was_killed_once_is_done_the_second_time(tmp_path):
    """As the system kills one of two that together need too much memory."""
    flag = tmp_path / "been-here"
    code = f"import os, pathlib, signal; f = pathlib.Path({str(flag)!r})\n"
    code += "if not f.exists():\n    f.touch(); os.kill(os.getpid(), signal.SIGKILL)"
    (result,) = supervised(exec, [Task("key", (code,))], 1)
    assert result == ("key", None) and flag.exists()


def test_signal_9_is_told_as_what_it_often_is():
    code = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    ((_, lost),) = supervised(exec, [Task("key", (code,))], 1)
    assert "signal 9" in lost.reason and "memory" in lost.reason


def said_on_the_way(number, say=None):
    for step in range(number):
        say(step)
    return number


def test_what_a_task_says_comes_before_its_result(tmp_path, monkeypatch):
    """And no matter how many tasks say something at once."""
    (tmp_path / "talking.py").write_text(inspect.getsource(said_on_the_way))
    monkeypatch.syspath_prepend(tmp_path)
    from talking import said_on_the_way as work  # type: ignore[import-not-found]

    heard: dict[int, list] = {}
    tasks = [Task(number, (number,)) for number in (3, 1, 0, 200)]
    for key, result in supervised(work, tasks, 2, lambda key, what: heard.setdefault(key, []).append(what)):
        assert heard.get(key, []) == list(range(key)) and result == key
    for jobs in (1, 2):
        heard.clear()
        told = in_order(work, [(3,), (0,), (1,)], jobs, heard=lambda at, what: heard.setdefault(at, []).append(what))
        assert list(told) == [3, 0, 1] and heard == {0: [0, 1, 2], 2: [0]}


def test_large_arguments_and_results_pass():
    text = "x" * (5 << 20)
    ((_, result),) = supervised(str.upper, [Task("key", (text,))], 1)
    assert result == text.upper()


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_in_order_and_as_they_come(jobs):
    tasks = [(n, 2) for n in range(5)]
    assert list(in_order(pow, tasks, jobs)) == [n * n for n in range(5)]
    assert sorted(each_done(pow, tasks, jobs)) == [n * n for n in range(5)]
    assert list(in_order(pow, [], jobs)) == list(each_done(pow, [], jobs)) == []


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_a_task_raises_is_raised_here(jobs):
    with pytest.raises(ZeroDivisionError):
        list(in_order(divmod, [(1, 1), (1, 0)], jobs))


def test_what_cannot_travel_is_told():
    with pytest.raises(Exception, match="pickle"):
        list(in_order(eval, [("lambda: 0",), ("0",)], 2))


def test_a_death_ends_what_needs_every_result():
    with pytest.raises(MetamerError, match=r"ended abruptly .exit code 7"):
        list(in_order(exec, [("pass",), ("import os; os._exit(7)",)], 2))


def test_every_process_starts_as_told():
    start = os.putenv, ("METAMER_TOLD", "yes")
    assert list(in_order(os.system, [('test "$METAMER_TOLD" = yes',)] * 3, 2, start)) == [0, 0, 0]


def test_no_semaphore_and_no_shared_memory_is_taken():
    """What the system keeps after an abrupt end, with a warning of Python's on the way out."""
    script = (
        "from multiprocessing import resource_tracker as tracker\n"
        "from metamer.runtime.worker_pool import in_order\n"
        "kept = []\n"
        "tracker.register = tracker._resource_tracker.register = lambda *what: kept.append(what)\n"
        "if __name__ == '__main__':\n"
        "    print(list(in_order(pow, [(2, 2), (3, 2)], 2)), kept)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=patient(120))
    assert done.stdout == "[4, 9] []\n", done.stdout + done.stderr


@linux
def test_a_process_that_dies_while_idle_is_replaced():
    with closing(supervised(os.getpid, (Task(n, ()) for n in range(3)), 1)) as results:
        _, pid = next(results)
        os.kill(pid, signal.SIGKILL)
        assert len(list(results)) == 2


@linux
def test_every_process_is_deaf_to_ctrl_c():
    """The first, too: what Python starts beside it lets the signal through again."""
    script = (
        "import signal\n"
        "from metamer.runtime.worker_pool import Task, supervised\n"
        "if __name__ == '__main__':\n"
        "    tasks = [Task(n, (signal.SIG_BLOCK, [])) for n in range(3)]\n"
        "    print(*(signal.SIGINT in blocked for _, blocked in supervised(signal.pthread_sigmask, tasks, 3)))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=patient(120))
    assert done.stdout.split() == ["True"] * 3, done.stdout + done.stderr


@linux
def test_stopping_early_ends_the_processes_at_once():
    results = supervised(exec, [Task(0, ("pass",)), Task(1, ("import time; time.sleep(600)",))], 2)
    next(results)
    import multiprocessing

    ours = [child.pid for child in multiprocessing.active_children()]
    assert len(ours) >= 2
    begin = time.monotonic()
    results.close()
    assert time.monotonic() - begin < 60
    assert not any(alive(pid) for pid in ours)


@linux
def test_processes_end_with_a_parent_that_is_killed():
    """In the middle of a task, too: nobody is there to take its result."""
    script = (
        "from metamer.runtime.worker_pool import Task, supervised\n"
        "import multiprocessing, os, signal\n"
        "if __name__ == '__main__':\n"
        "    results = supervised(exec, [Task(0, ('pass',)), Task(1, ('import time; time.sleep(600)',))], 2)\n"
        "    next(results)\n"
        "    print(*(child.pid for child in multiprocessing.active_children()), flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=patient(120))
    ours = [int(pid) for pid in done.stdout.split()]
    assert done.returncode == -9 and len(ours) == 2, done.stderr
    deadline = time.monotonic() + patient(30)
    while any(alive(pid) for pid in ours) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(alive(pid) for pid in ours)


def test_one_thread_of_blas_is_asked_for_before_numpy_comes_and_only_then():
    words = "import os\nfrom metamer.runtime.worker_pool import one_thread\n{}one_thread()\n"
    say = "print(os.environ.get('OPENBLAS_NUM_THREADS'))"
    bare = {name: value for name, value in os.environ.items() if not name.endswith(("_THREADS", "_MAXIMUM_THREADS"))}

    def said(first: str, **more: str) -> str:
        command = [sys.executable, "-c", words.format(first) + say]
        return subprocess.run(command, env=bare | more, capture_output=True, text=True, check=True).stdout.strip()

    assert said("") == "1"
    assert said("", OPENBLAS_NUM_THREADS="4") == "4"
    assert said("import numpy\n") == "None"


def test_a_script_without_a_guard_is_run_once(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "import math\nfrom metamer.runtime.worker_pool import each_done\n"
        "print('begun')\nprint(sorted(each_done(math.sqrt, [(4.0,), (9.0,)], 2)))\n"
        "import sys\nassert sys.modules['__main__'].__file__ == __file__\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=patient(120))
    assert (done.stdout, done.stderr) == ("begun\n[2.0, 3.0]\n", "")


def _temporary():
    import tempfile

    return tempfile.tempdir


def test_processes_know_the_temporary_folder_and_do_not_try_it():
    import tempfile

    assert [found for _, found in supervised(_temporary, [Task(0, ())], 1)] == [tempfile.gettempdir()]
