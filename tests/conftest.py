"""Fixtures that every test folder shares: the real data beside the project, and a GL context where there is one."""

import os
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


@pytest.fixture(scope="session")
def gl():
    """A headless moderngl context, or a skip that says what the machine lacks."""
    from metamer.viewer.context import NoGL, create_context

    try:
        return create_context()
    except NoGL as reason:
        pytest.skip(str(reason))
