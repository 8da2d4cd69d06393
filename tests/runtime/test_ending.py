"""Signals end a command by their own way, wherever it is: cleared away, one line, the right code."""

import os
import subprocess
import sys

import pytest
from metamer.runtime import locks, private_folder
from metamer.runtime.errors import InputError
from metamer.runtime.files import check_writable, half_written, written_whole
from metamer.runtime.locks import alone_at_work, made_and_held, remove_abandoned
from metamer.runtime.shutdown import clearing, saying, undisturbed
from patience import patient

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

START = """
import os, signal, sys, time, pathlib
signal.signal(signal.SIGINT, signal.default_int_handler)
# The parent of the tests may have had this one ignored (nohup), and children keep that.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from metamer.runtime.shutdown import clearing, end_on_signals, finished, saying, undisturbed
end_on_signals()
here = pathlib.Path(sys.argv[1])
def hit(number=signal.SIGINT): os.kill(os.getpid(), number)
"""


def ended(code, folder):
    """Code, lines of stderr, and files left of a process that did this to itself."""
    words = [sys.executable, "-c", START + code, str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=patient(60))
    return done.returncode, done.stderr.splitlines(), sorted(path.name for path in folder.iterdir())


LINE = "metamer: interrupted; nothing half-written is left behind."


@pytest.mark.parametrize(
    ("name", "number", "word"),
    [("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "terminated"), ("SIGHUP", 129, "gone")],
)
def test_code_and_line_say_which_signal_it_was(tmp_path, name, number, word):
    code, said, _ = ended(f"hit(signal.{name})\ntime.sleep(60)", tmp_path)
    assert code == number and len(said) == 1 and word in said[0]


@pytest.mark.parametrize(
    "place",
    [
        "class Gone:\n    def __del__(self): hit(); time.sleep(0.01)\nGone()",
        "import weakref\nclass Gone: 0\nit = Gone()\nref = weakref.ref(it, lambda _: (hit(), time.sleep(1)))\ndel it",
        "try:\n    hit(); time.sleep(60)\nexcept BaseException:\n    pass",
        "try:\n    pass\nfinally:\n    hit()\n    time.sleep(60)",
        "import threading\nthreading.Thread(target=hit).start()\ntime.sleep(60)",
        "sorted([3, 1, 2], key=lambda n: hit() or n)\ntime.sleep(60)",
    ],
    ids=["del", "weak reference", "except", "finally", "thread", "callback"],
)
def test_no_place_swallows_a_signal(tmp_path, place):
    """Python prints an exception in the first two and goes on."""
    assert ended(
        f"with clearing((here / 'half').unlink):\n    (here / 'half').touch()\n    exec({place!r})", tmp_path
    ) == (
        130,
        [LINE],
        [],
    )


def test_a_main_thread_that_does_not_answer_is_not_waited_for(tmp_path):
    """As deep in a library: a call that goes on when a signal comes, and looks at none."""
    code = (
        "import ctypes, threading\n"
        "libc = ctypes.CDLL(None)\n"
        "threading.Timer(0.3, hit).start()\n"
        "with clearing((here / 'half').unlink):\n"
        "    (here / 'half').touch()\n"
        "    lock = (ctypes.c_char * 256)()\n"
        "    libc.pthread_mutex_init(lock, None)\n"
        "    libc.pthread_mutex_lock(lock)\n"
        "    libc.pthread_mutex_lock(lock)\n"
    )
    assert ended(code, tmp_path) == (130, [LINE], [])


def test_an_end_that_hangs_is_cut_short(tmp_path):
    assert ended("with clearing(lambda: time.sleep(600)):\n    hit()\n    time.sleep(60)", tmp_path)[0] == 130


def test_what_fails_while_clearing_does_not_keep_the_rest(tmp_path):
    code = (
        "def fail(): raise SystemExit(7)\n"
        "with clearing((here / 'half').unlink), clearing(fail), saying(fail), saying(lambda: 'Two\\nof three.'):\n"
        "    (here / 'half').touch()\n"
        "    hit()\n"
        "    time.sleep(60)\n"
    )
    assert ended(code, tmp_path) == (130, [f"{LINE} Two of three."], [])


def test_steps_that_belong_together_are_not_torn_apart(tmp_path):
    code = (
        "with undisturbed():\n    hit()\n    (here / 'one').touch()\n    (here / 'two').touch()\n(here / 'no').touch()"
    )
    assert ended(code, tmp_path) == (130, [LINE], ["one", "two"])


def test_a_second_signal_changes_nothing(tmp_path):
    code = "with clearing(lambda: (hit(), hit(signal.SIGTERM), (here / 'half').unlink())):\n"
    assert ended(code + "    (here / 'half').touch()\n    hit()\n    time.sleep(60)", tmp_path) == (130, [LINE], [])


def test_what_was_said_before_comes_out(tmp_path):
    words = [sys.executable, "-c", START + "print('first')\nhit()\ntime.sleep(60)", str(tmp_path)]
    assert subprocess.run(words, capture_output=True, text=True, timeout=patient(60)).stdout == "first\n"


def test_when_all_is_done_a_signal_changes_nothing(tmp_path):
    """Python takes its time to shut down: the result is whole, and so is the exit code."""
    code = "finished(2)\nimport atexit\natexit.register(hit)\nsys.exit(2)"
    assert ended(code, tmp_path) == (2, [], [])


def test_what_the_process_was_told_to_ignore_is_ignored(tmp_path):
    code = START.replace("signal.default_int_handler", "signal.SIG_IGN") + "hit()\ntime.sleep(0.1)\nprint('on')"
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, timeout=patient(60)
    )
    assert (done.returncode, done.stdout) == (0, "on\n")


def test_blocks_do_their_duty_without_a_signal(tmp_path):
    done = []
    with pytest.raises(ZeroDivisionError), clearing(lambda: done.append("cleared")), saying(str), undisturbed():
        _ = 1 // 0
    assert done == ["cleared"]


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The folder of temporary files."""
    monkeypatch.setattr(private_folder.tempfile, "gettempdir", lambda: str(tmp_path))
    return tmp_path


def test_private_folders_go_and_so_do_those_of_killed_processes(temporary):
    with private_folder.private_folder() as folder:
        (folder / "file").write_text("here")
        left = temporary / f"metamer-{'0' * 32}"
        left.mkdir()
        (left / "file").write_text("left behind")
        others = [temporary / "metamer-catalogue", temporary / f"metamer-{'0' * 31}"]
        for other in others:
            other.mkdir()
        with private_folder.private_folder():
            assert folder.is_dir() and not left.exists()
    assert sorted(temporary.iterdir()) == sorted(others)


@pytest.mark.parametrize("in_memory", [True, False])
def test_bytes_are_a_file_as_long_as_the_block_lasts(temporary, monkeypatch, in_memory):
    if not in_memory:
        monkeypatch.setattr(private_folder, "_OPEN_FILES", temporary / "none")
    elif not private_folder._OPEN_FILES.is_dir():
        pytest.skip("no files in memory on this system")
    data = bytes(range(256)) * 1000
    with pytest.raises(ZeroDivisionError), private_folder.file_of(data, "map.exr") as path:
        assert path.is_file() and path.stat().st_size == len(data) and path.read_bytes() == data
        assert len(list(temporary.iterdir())) == (0 if in_memory else 1)
        _ = 1 // 0
    assert not path.exists() and not list(temporary.iterdir())


@pytest.fixture(params=["itself", "beside"])
def where(request, monkeypatch):
    """Locks on files and folders themselves, and on files beside them as on systems without POSIX's module of locks."""
    if request.param == "beside":
        pytest.importorskip("filelock")
        monkeypatch.setitem(sys.modules, "fcntl", None)


@pytest.mark.usefixtures("where")
def test_a_folder_that_is_cleared_away_while_it_is_made_is_made_again(temporary, monkeypatch):
    """Between making and locking it, another process may take it for abandoned."""
    locked, tries = locks._locked, []

    def late(path, make=True):
        tries.append(path)
        if len(tries) == 1:
            path.rmdir()
        return locked(path, make)

    monkeypatch.setattr(locks, "_locked", late)
    monkeypatch.setattr(private_folder, "clear_abandoned", lambda: None)
    with private_folder.private_folder() as folder:
        assert folder.is_dir() and len(tries) == 2
    assert not list(temporary.iterdir())


def test_what_a_killed_writer_left_goes_before_the_next_one_writes(tmp_path):
    path = tmp_path / "fit.json"
    (tmp_path / ".fit.0123abcd.json").write_text("half")
    (tmp_path / ".fit.other.0123abcd.json").write_text("another file's")
    with written_whole(path) as beside:
        check_writable(path)
        assert set(half_written(tmp_path)) == {tmp_path / ".fit.other.0123abcd.json", beside}
        beside.write_text("whole")
    assert path.read_text() == "whole"


KILLED = """
import os, sys, pathlib
if sys.argv[2] == "beside":
    import filelock
    sys.modules["fcntl"] = None
from metamer.runtime.locks import made_and_held
here = pathlib.Path(sys.argv[1])
with made_and_held(here / "file", (here / "file").touch), made_and_held(here / "folder", (here / "folder").mkdir):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.mark.usefixtures("where")
def test_what_a_process_holds_is_abandoned_once_it_is_killed(tmp_path, request):
    words = [sys.executable, "-c", KILLED, str(tmp_path), request.node.callspec.params["where"]]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == b"held\n"
        held = sorted(tmp_path.rglob("*"))
        assert not remove_abandoned(tmp_path / "file") and not remove_abandoned(tmp_path / "folder")
        assert sorted(tmp_path.rglob("*")) == held
        holder.kill()
    assert remove_abandoned(tmp_path / "file") and remove_abandoned(tmp_path / "folder")
    assert not list(tmp_path.iterdir()) and not remove_abandoned(tmp_path / "file")


@pytest.mark.usefixtures("where")
def test_one_process_is_alone_at_work(tmp_path):
    with (
        alone_at_work(tmp_path, "somebody is here"),
        pytest.raises(InputError, match="somebody is here"),
        alone_at_work(tmp_path, "somebody is here"),
    ):
        pass
    with alone_at_work(tmp_path, "somebody is here"):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.timeout(20)
@pytest.mark.usefixtures("where")
def test_a_lock_that_another_process_keeps_is_not_waited_for_for_ever(tmp_path, monkeypatch):
    """A process that only looks whether something is held may be stopped while it looks."""
    monkeypatch.setattr(locks, "PATIENCE_S", 0.05)
    path = tmp_path / "file"
    with (
        made_and_held(path, path.touch),
        pytest.raises(InputError, match=r"(?s)cannot be locked.*still locked by another process after 0\.05 s"),
        made_and_held(path, path.touch),
    ):
        pass


@pytest.mark.usefixtures("where")
def test_where_nothing_can_be_locked_nothing_is_taken_for_left_behind(tmp_path, monkeypatch):
    def refused(descriptor):
        raise OSError(37, "No locks available")

    monkeypatch.setattr(locks, "_lock_descriptor", refused)
    path = tmp_path / "file"
    with made_and_held(path, path.touch), alone_at_work(tmp_path, ""), alone_at_work(tmp_path, ""):
        assert not remove_abandoned(path) and path.exists()


def test_the_command_hears_signals_before_it_imports_anything_else():
    """The moment before is Python's own: nothing that takes time stands in it."""
    code = (
        "import sys\nbefore = set(sys.modules)\nfrom metamer.cli import main\nnew = set(sys.modules) - before\n"
        "print(*sorted(name for name in new if name.startswith('metamer.')))\n"
        "print(*({'argparse', 'numpy', 'jaxtyping', 'rich', 'multiprocessing'} & new))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=patient(60))
    assert done.stdout.splitlines() == ["metamer.cli metamer.cli.main metamer.runtime metamer.runtime.shutdown", ""]


def test_the_trial_of_the_temporary_folder_leaves_no_file(tmp_path):
    """Python writes a file there when it is first asked; the signal comes while that lies there."""
    code = """
import tempfile
from metamer.runtime.private_folder import temporary_folder
os.environ["TMPDIR"] = str(here)
unlink = os.unlink
def disturbed(path, **more):
    hit()
    time.sleep(0.2)
    unlink(path, **more)
os.unlink = tempfile._os.unlink = disturbed
temporary_folder()
time.sleep(30)
"""
    code_, lines, left = ended(code, tmp_path)
    assert (code_, lines, left) == (130, [LINE], [])
