"""A session changes one thing at a time: pictures are those of a new session, and what stays valid is kept."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.viewer.gl.backend import GLBackend
from metamer.viewer.gl.live import Canvas
from metamer.viewer.gl.tile import read
from metamer.viewer.render.scene_layers import RenderSettings
from metamer.viewer.render.session import ReadPictures, RenderSession
from metamer.viewer.software.backend import NumpyBackend, software_session


@pytest.fixture(params=["numpy", "GL"])
def session(request):
    backend = GLBackend(request.getfixturevalue("gl")) if request.param == "GL" else NumpyBackend()
    with RenderSession(backend, RenderSettings(keeps_terms=True)) as made:
        yield made


def same(picture, scene, scenes, camera=None):
    xyz, coverage = software_session().render(scene, camera, scenes.SURFACES)
    np.testing.assert_array_equal(picture[1], coverage)
    np.testing.assert_allclose(picture[0], xyz, rtol=2e-4, atol=2e-5)


def test_each_change_shows_and_keeps_what_it_does_not_touch(scenes, session):
    scene, warm = scenes.lamp_scene(size=24), illuminant("A")
    session.set_scene(scene, {name: scenes.SURFACES[name] for name in scene.material_ids})
    same(session.picture(), scene, scenes)
    (piece,), geometry = session.cache.pieces, session.cache.geometry
    tile, terms = piece.tile, dict(piece.terms)

    session.set_illuminant(warm)
    same(session.picture(), scene.with_illuminant(warm), scenes)
    session.set_observer(observer("1964_10"))
    scene = replace(scene, observer=observer("1964_10"))
    same(session.picture(), scene.with_illuminant(warm), scenes)
    assert piece.terms == terms and piece.tile is tile

    session.set_material("part0", "sharp", scenes.SURFACES["sharp"])
    scene = scene.with_material("part0", "sharp")
    same(session.picture(), scene.with_illuminant(warm), scenes)
    assert piece.tile is tile and piece.terms != terms

    session.set_camera(scenes.lamp_scene(size=17).camera())
    same(session.picture(), scene.with_illuminant(warm), scenes, session.camera)
    assert session.cache.geometry is geometry and session.cache.pieces[0] is not piece
    session.set_illuminant(None)
    session.set_camera(None)
    same(session.picture(), scene, scenes)


def test_one_call_is_no_other_way(scenes, session):
    """`render` begins anew: nothing that was set before shows in it."""
    scene = scenes.lamp_scene(size=16)
    session.set_scene(scenes.sphere_scene(size=16), scenes.SURFACES)
    session.set_illuminant(illuminant("A"))
    session.picture()
    same(session.render(scene, None, scenes.SURFACES), scene, scenes)
    assert session.scene is scene


def test_canvas_on_the_gpu_holds_what_is_read_back(scenes, gl, monkeypatch):
    """In one window and in several, on a canvas that held something else."""
    scene = scenes.lamp_scene(size=24)
    texture = gl.texture((24, 24), 4, np.full((24, 24, 4), 7.0, dtype=np.float32).tobytes(), dtype="f4")
    canvas = Canvas(texture)
    with RenderSession(GLBackend(gl)) as session:
        session.set_scene(scene, scenes.SURFACES)
        for tile in (None, 30):
            session.release()
            session.configure(tile_samples=tile)
            session.draw(canvas)
            drawn = session.draw(ReadPictures(session.camera))
            np.testing.assert_array_equal(read(texture), np.dstack([drawn.xyz[0], drawn.coverage]))
    canvas.release()
    texture.release()


def test_a_session_without_a_scene_says_what_to_call():
    with software_session() as session, pytest.raises(InputError, match="set_scene"):
        session.picture()


def test_names_that_are_not_there_change_nothing(scenes):
    scene = scenes.sphere_scene(size=8)
    with software_session() as session:
        session.set_scene(scene, scenes.SURFACES)
        with pytest.raises(UnknownNameError):
            session.set_material("lid", "matt", scenes.SURFACES["matt"])
        with pytest.raises(UnknownNameError):
            session.set_scene(scenes.sphere_scene("glos", size=8), scenes.SURFACES)
        with pytest.raises(UnknownNameError, match="linear, mipmapped"):
            session.configure(filtering="trilinear")
        with pytest.raises(TypeError):
            session.configure(threads=2)
        assert session.scene is scene and session.settings == RenderSettings()
        same(session.picture(), scene, scenes)
