"""Processes that may die: what a death costs, and what is left when the parent goes."""

import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest
from metamer.materials.intake import workers
from metamer.materials.intake.workers import Lost, Task, free_memory, jobs_that_fit, supervised

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


def test_large_arguments_and_results_pass():
    text = "x" * (5 << 20)
    ((_, result),) = supervised(str.upper, [Task("key", (text,))], 1)
    assert result == text.upper()


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
        "from metamer.materials.intake.workers import Task, supervised\n"
        "if __name__ == '__main__':\n"
        "    tasks = [Task(n, (signal.SIG_BLOCK, [])) for n in range(3)]\n"
        "    print(*(signal.SIGINT in blocked for _, blocked in supervised(signal.pthread_sigmask, tasks, 3)))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
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
        "from metamer.materials.intake.workers import Task, supervised\n"
        "import multiprocessing, os, signal\n"
        "if __name__ == '__main__':\n"
        "    results = supervised(exec, [Task(0, ('pass',)), Task(1, ('import time; time.sleep(600)',))], 2)\n"
        "    next(results)\n"
        "    print(*(child.pid for child in multiprocessing.active_children()), flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    ours = [int(pid) for pid in done.stdout.split()]
    assert done.returncode == -9 and len(ours) == 2, done.stderr
    deadline = time.monotonic() + 30
    while any(alive(pid) for pid in ours) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(alive(pid) for pid in ours)


@pytest.mark.parametrize(
    ("wanted", "free", "cores", "jobs"),
    [(None, 10_000, 4, 4), (None, 2_500, 4, 2), (None, 10, 4, 1), (None, None, 4, 4), (8, 10, 4, 8)],
)
def test_as_many_processes_as_memory_holds(monkeypatch, wanted, free, cores, jobs):
    """Unless somebody asks for more."""
    monkeypatch.setattr(workers, "free_memory", lambda: free)
    monkeypatch.setattr(workers, "usable_cores", lambda: cores)
    assert jobs_that_fit(wanted, 1000) == jobs


@linux
def test_free_memory_is_a_number_of_bytes():
    assert free_memory() is not None and free_memory() > 1 << 20
