"""Systems other than POSIX, what they lack hidden: files are imported, colours compared and pictures drawn without."""

import os
import subprocess
import sys

import numpy as np
import pytest

#: Modules and functions that Windows lacks, hidden from us; libraries that need them are imported before.
HIDE = """
import os, signal, sys
import h5py, psutil, scipy.io, tempfile  # these ask their own system
for name in ("fcntl", "resource", "pwd", "grp", "termios"):
    sys.modules[name] = None
for name in ("fork", "sysconf", "killpg", "getuid", "geteuid", "mkfifo", "O_NOFOLLOW", "memfd_create", "getpgid"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGHUP", "SIGQUIT", "SIGALRM", "SIGPIPE", "pthread_sigmask", "set_wakeup_fd", "setitimer"):
    if hasattr(signal, name):
        delattr(signal, name)
"""


@pytest.fixture
def elsewhere(tmp_path):
    """Runs the command in a process of its own that has none of this: words -> (exit status, output, messages)."""

    def run(*words):
        code = f"{HIDE}\nfrom metamer.cli.main import main\nsys.exit(main({list(map(str, words))!r}))"
        environment = {**os.environ, "METAMER_NO_GL": "1", "XDG_CACHE_HOME": str(tmp_path / "cache")}
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, encoding="utf-8"
        )
        return done.returncode, done.stdout, done.stderr

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
