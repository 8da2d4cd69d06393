"""Fixtures that tests of pictures share: both renderers, and shadows worked out at few vertices."""

import pytest
from metamer.lighting.visibility import precompute, refinement
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.software.backend import software_session


@pytest.fixture(autouse=True)
def few_vertices(monkeypatch):
    """Both renderers take what hides a light from the same vertices; more of them are tested where they are found."""
    monkeypatch.setattr(refinement, "MOST_VERTICES", 400)
    monkeypatch.setattr(precompute, "_TRAINING", 400)


@pytest.fixture(params=["numpy", "GL"])
def make_session(request):
    """Makes sessions of one of the renderers, of the filtering that is asked for."""
    if request.param == "GL":
        gl = request.getfixturevalue("gl")
        return lambda *filtering: gl_session(gl, *filtering)
    return software_session
