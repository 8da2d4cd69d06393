"""A fast start: nothing heavy is imported before it is needed."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = ("colour", "scipy", "matplotlib", "moderngl", "trimesh", "h5py", "tensorly", "OpenEXR", "PyOpenColorIO", "PIL")


def heavy_after(code):
    """Heavy packages that a fresh interpreter holds after running `code`."""
    report = f"import sys; print('HEAVY', *(name for name in {HEAVY!r} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", f"{code}\n{report}"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return done.stdout.splitlines()[-1].split()[1:]


def test_spectral_modules_import_nothing_heavy():
    package = Path(importlib.util.find_spec("metamer.spectral").origin).parent
    names = [".".join(path.relative_to(package).with_suffix("").parts) for path in package.rglob("*.py")]
    modules = [f"metamer.spectral.{name}" for name in names if not name.endswith("__init__")]
    assert len(modules) > 12
    assert heavy_after(f"import {', '.join(modules)}") == []


def test_help_imports_nothing_heavy():
    if importlib.util.find_spec("metamer.cli.main") is None:
        pytest.skip("no command yet")
    code = """
from metamer.cli.main import main
try:
    main(["--help"])
except SystemExit as ended:
    assert not ended.code, ended.code
"""
    assert heavy_after(code) == []


def test_the_door_to_colour_science_lets_nothing_out():
    """No warning, though importing it warns, and no change in how numpy prints numbers."""
    code = """
import warnings
warnings.simplefilter("error")
import numpy as np
before = np.get_printoptions()
from metamer.spectral.colour_library import colour_science
colour_science()
assert np.get_printoptions() == before, np.get_printoptions()
"""
    assert "colour" in heavy_after(code)
