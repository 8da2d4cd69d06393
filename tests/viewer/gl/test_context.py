"""The one function that makes a GL context, and what it says when it cannot."""

import numpy as np
import pytest
from metamer.runtime.distribution import system_hint
from metamer.runtime.errors import MetamerError
from metamer.viewer.display.gl_pass import DisplayPass
from metamer.viewer.display.transform import DisplayTransform
from metamer.viewer.gl import context as module
from metamer.viewer.gl.backend import gl_session


def test_context_is_new_enough(gl):
    assert gl.version_code >= module.REQUIRED_VERSION
    assert module.describe(gl).startswith("OpenGL 4.")


def test_environment_forces_the_software_path(monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    with pytest.raises(module.NoGL, match="METAMER_NO_GL") as caught:
        module.create_context()
    assert isinstance(caught.value, MetamerError)
    assert system_hint(module.SYSTEM_PACKAGES) in str(caught.value)


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


def test_renderers_with_contexts_of_their_own_draw_in_turn(gl, scenes):
    """In the newest context alone, all others would draw black, without an error."""
    scene, surfaces = scenes.sphere_scene(size=16, samples=1), dict(scenes.SURFACES)
    with gl_session() as first:
        alone, coverage = first.render(scene, None, surfaces)
        assert coverage.any()
        with gl_session() as second:
            for renderer in (first, second, gl_session(gl), first):
                renderer.release()
                drawn, covered = renderer.render(scene, None, surfaces)
                np.testing.assert_array_equal(covered, coverage)
                np.testing.assert_array_equal(drawn, alone)
        again, _ = first.render(scene, None, surfaces)
        np.testing.assert_array_equal(again, alone)


def test_a_display_transform_stays_in_its_context(gl):
    encode = DisplayPass(gl, DisplayTransform())
    grey = np.full((4, 4, 3), 0.2)
    before = encode(grey)
    module.release_context(module.create_context())
    np.testing.assert_array_equal(encode(grey), before)
    assert before.min() > 0.1
