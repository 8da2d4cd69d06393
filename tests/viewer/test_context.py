"""The one function that makes a GL context, and what it says when it cannot."""

import pytest
from metamer.spectral.errors import MetamerError
from metamer.viewer import context as module


def test_context_is_new_enough(gl):
    assert gl.version_code >= module.REQUIRED_VERSION
    assert module.describe(gl).startswith("OpenGL 4.")


def test_environment_forces_the_software_path(monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    with pytest.raises(module.NoGL, match="METAMER_NO_GL") as caught:
        module.create_context()
    assert isinstance(caught.value, MetamerError)
    assert module.INSTALL_LINE in str(caught.value)


def test_failure_names_back_ends_and_packages(monkeypatch):
    import moderngl

    monkeypatch.delenv("METAMER_NO_GL", raising=False)

    def refuse(**_options):
        raise OSError("libEGL.so.1: cannot open shared object file")

    monkeypatch.setattr(moderngl, "create_context", refuse)
    with pytest.raises(module.NoGL) as caught:
        module.create_context()
    message = str(caught.value)
    assert "EGL: libEGL.so.1" in message and "default back end:" in message
    assert "libegl1" in message and "libgl1-mesa-dri" in message
