"""Systems other than POSIX, and processors that libraries have no packages for, what they lack hidden: files are
imported, colours compared and pictures drawn without.
"""

import os
import subprocess
import sys

import numpy as np
import pytest
from filelock import FileLock
from metamer.runtime.files import written_whole
from patience import patient

#: Modules and functions that Windows lacks, hidden from us; libraries that need them are imported before.
HIDE = """
import os, signal, sys
import filelock, h5py, psutil, scipy.io, tempfile  # these ask their own system
for name in ("fcntl", "resource", "pwd", "grp", "termios"):
    sys.modules[name] = None
for name in ("fork", "sysconf", "killpg", "getuid", "geteuid", "mkfifo", "O_NOFOLLOW", "memfd_create", "getpgid"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGHUP", "SIGQUIT", "SIGALRM", "SIGPIPE", "pthread_sigmask", "set_wakeup_fd", "setitimer"):
    if hasattr(signal, name):
        delattr(signal, name)
"""


#: Libraries without packages for some systems on ARM processors, hidden, too.
HIDE_LIBRARIES = """
for name in ("embreex", "moderngl", "glcontext"):
    sys.modules[name] = None
"""


@pytest.fixture
def elsewhere(tmp_path):
    """Runs commands at once, each in a process of its own that has none of this.

    Words of each -> (exit status, output, messages), a list of them where there are several commands.
    """

    def started(words):
        code = f"{HIDE}{HIDE_LIBRARIES}\nfrom metamer.cli.main import main\nsys.exit(main({list(map(str, words))!r}))"
        environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
        environment.pop("METAMER_NO_GL", None)
        pipe = subprocess.PIPE
        return subprocess.Popen(
            [sys.executable, "-c", code], cwd=tmp_path, env=environment, stdout=pipe, stderr=pipe, encoding="utf-8"
        )

    def run(*words, others=()):
        processes = [started(command) for command in (words, *others)]
        said = [process.communicate(timeout=patient(300)) for process in processes]
        done = [(process.returncode, *texts) for process, texts in zip(processes, said, strict=True)]
        return done if others else done[0]

    return run


@pytest.fixture
def chart(tmp_path):
    nm = np.arange(380.0, 781.0, 10.0)
    columns = np.c_[nm, np.linspace(0.1, 0.7, nm.size), np.linspace(0.12, 0.7, nm.size)]
    np.savetxt(tmp_path / "chart.csv", columns, "%.5f", ",", header="nm,standard,lot", comments="")
    return tmp_path / "chart.csv"


def test_samples_are_matched(elsewhere, chart):
    answer = ("--as", "reflectance", "--scale", "fraction")
    code, out, err = elsewhere("match", f"{chart}#standard", f"{chart}#lot", "--tolerance", "CIE 2000 1.0", *answer)
    assert code == 2 and "lot fails under daylight D65" in out, out + err


@pytest.mark.slow
def test_files_are_imported_and_drawn(elsewhere, chart, tmp_path):
    answer = ("--as", "reflectance", "--scale", "fraction", "--catalogue", tmp_path / "kept", "--jobs", "1")
    code, out, err = elsewhere("catalogue", "import", chart, *answer)
    assert code == 0, out + err
    (tmp_path / "ball.toml").write_text(
        '[[part]]\nshape = "sphere"\nsubdivisions = 2\nmaterial = "chart/lot"\n[[camera]]\nwidth = 16\nheight_px = 16\n'
    )
    picture = tmp_path / "ball.png"
    code, out, err = elsewhere("render", "ball.toml", "--catalogue", tmp_path / "kept", "-o", picture)
    assert code == 0 and picture.read_bytes().startswith(b"\x89PNG"), out + err
    assert "numpy" in elsewhere("doctor", "--brief")[1].partition("display")[0]


@pytest.mark.slow
def test_two_importers_share_a_folder(elsewhere, chart, tmp_path):
    """What a killed one left goes; what somebody holds, and what nobody is known to have made, stays."""
    (tmp_path / "second.csv").write_text(chart.read_text())
    kept = tmp_path / "kept"
    answer = ("--as", "reflectance", "--scale", "fraction", "--catalogue", kept, "--jobs", "1")
    commands = [("catalogue", "import", file, *answer) for file in (chart, tmp_path / "second.csv")]
    (code, _, err), (other_code, _, other_err) = elsewhere(*commands[0], others=commands[1:])
    assert code == other_code == 0, err + other_err
    assert len(list(kept.glob("*/*.h5"))) == 4 and not list(kept.rglob("*.lock"))
    killed, unknown = kept / "chart" / ".lot.0123abcd.h5", kept / "chart" / ".lot.89abcdef.h5"
    for file in (killed, unknown, killed.with_name(f"{killed.name}.lock")):
        file.write_bytes(b"")
    with written_whole(kept / "chart" / "held.h5") as held:
        held.write_bytes(b"half")
        lock = held.with_name(f"{held.name}.lock")
        lock.touch()
        with FileLock(lock):
            assert elsewhere(*commands[0])[0] == 0
        assert not killed.exists() and unknown.exists() and held.exists()
    words = ("catalogue", "export", "chart/lot", "--format", "csv", "-o", "l.csv")
    code, out, err = elsewhere(*words, "--catalogue", kept)
    assert code == 0 and (tmp_path / "l.csv").exists() and not list(tmp_path.glob(".metamer*")), out + err
