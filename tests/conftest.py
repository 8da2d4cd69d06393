"""Fixtures that every test folder shares: the real data beside the project, and a GL context where there is one."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from jaxtyping import install_import_hook

# Shapes in signatures are checked while tests run, and only then.
install_import_hook("metamer", "beartype.beartype")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of measured files that are not part of the project; tests that need them skip without it."""
    folder = Path(os.environ.get("METAMER_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no measured data at {folder}; set METAMER_DATA to the folder that holds brdf/, spectra/, meshes/")
    return folder


TINY = """
family = "tiny"
kind = "analytic"
notes = "made for tests"

[[material]]
name = "matt-red"
model = "lambert"
reflectance = { table = "babelcolor", column = "red" }

[[material]]
name = "rough-blue"
model = "oren_nayar"
reflectance = { table = "babelcolor", column = "blue" }
sigma = 0.35

[[material]]
name = "satin-green"
model = "ashikhmin_shirley"
diffuse = { table = "babelcolor", column = "green" }
specular = { constant = 0.04 }
exponent_u = 25.0
exponent_v = 25.0

[[material]]
name = "copper"
model = "cook_torrance"
diffuse = { constant = 0.0 }
eta = { table = "copper", column = "n" }
k = { table = "copper", column = "k" }
roughness = 0.4
specular_weight = 1.0
distribution = "beckmann"
masking = "smith"
"""


@pytest.fixture(scope="session")
def tiny_catalogue(tmp_path_factory) -> Path:
    """Folder of a catalogue of four materials, imported by the command; to be read only."""
    folder = tmp_path_factory.mktemp("tiny")
    shutil.copytree(ROOT / "catalogs" / "shipped", folder / "source", ignore=shutil.ignore_patterns("[!s]*.toml"))
    (folder / "source" / "tiny.toml").write_text(TINY, encoding="utf-8")
    words = ["catalogue", "import", folder / "source", "--into", folder / "catalogue", "--jobs", "2", "--budget", "1"]
    done = subprocess.run([sys.executable, "-m", "metamer.cli.main", *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "catalogue"


@pytest.fixture(scope="session")
def gl():
    """A headless moderngl context, or a skip that says what the machine lacks."""
    from metamer.viewer.context import NoGL, create_context

    try:
        return create_context()
    except NoGL as reason:
        pytest.skip(str(reason))
