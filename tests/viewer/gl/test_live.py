"""Pictures that stay on the GPU are those that are read back, and nothing is done twice for them."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh import shapes
from metamer.lighting.scene import Part
from metamer.runtime.errors import InputError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.viewer.gl import resources
from metamer.viewer.gl import tile as tile_module
from metamer.viewer.gl.backend import GLBackend, gl_session
from metamer.viewer.gl.live import LiveSession
from metamer.viewer.gl.resources import Owner
from metamer.viewer.gl.side import CanvasSide
from metamer.viewer.gl.tile import read
from metamer.viewer.render import geometry
from metamer.viewer.render.raster import window_triangles
from metamer.viewer.render.scene_layers import RenderSettings
from metamer.viewer.render.view import view_of


@pytest.fixture
def live(gl):
    renderer = LiveSession(GLBackend(gl), RenderSettings(keeps_terms=True))
    yield renderer
    renderer.close()


@pytest.fixture
def owner(gl):
    kept = Owner(gl)
    yield kept
    kept.release()


def counted(monkeypatch, holder, name):
    """Record each call of a function."""
    calls, real = [], getattr(holder, name)

    def counting(*args, **kwargs):
        calls.append(args)
        return real(*args, **kwargs)

    monkeypatch.setattr(holder, name, counting)
    return calls


def orbited(camera, angle):
    x, y, z = camera.position
    turned = np.cos(angle) * x + np.sin(angle) * z, y, np.cos(angle) * z - np.sin(angle) * x
    return replace(camera, position=turned)


@pytest.mark.parametrize("tile", [None, 32])
def test_canvases_hold_the_pictures_of_both_sides(scenes, gl, live, owner, tile):
    live.session.configure(tile_samples=tile)
    scene = scenes.lamp_scene(size=40)
    other = replace(scene.with_material("part0", "brushed"), observer=observer("1964_10"))
    sides = [CanvasSide(scene, scenes.SURFACES), CanvasSide(other, scenes.SURFACES, illuminant("FL11"))]
    canvases = [owner.texture((40, 40), 4) for _ in sides]
    done = list(live.drawing(live.sides.prepared(sides, scene.camera()), canvases))
    assert [one[:2] for one in done] == [(number, len(done)) for number in range(1, len(done) + 1)]
    assert len(done) == (1 if tile is None else 16)
    with gl_session(gl) as once:
        for side, canvas in zip(sides, canvases, strict=True):
            xyz, coverage = once.render_many(side.scene, None, scenes.SURFACES, (side.illuminant,))[0]
            np.testing.assert_array_equal(read(canvas)[..., 3], coverage)
            off = np.abs(read(canvas)[..., :3] - xyz).max(axis=-1)
            assert (off > 0.002).mean() <= (1e-3 if tile else 0.0) and np.median(off) < 1e-6


def test_another_camera_builds_no_geometry(scenes, live, owner, monkeypatch):
    scene = scenes.lamp_scene(size=24, samples=1)
    canvas = owner.texture((24, 24), 4)
    triangles, grids = counted(monkeypatch, geometry, "_triangles"), counted(monkeypatch, geometry, "shadow_grid")
    for turn in range(4):
        live.draw([CanvasSide(scene, scenes.SURFACES)], orbited(scene.camera(), 0.2 * turn), [canvas])
    assert (len(triangles), len(grids)) == (1, len(scene.lights))


def test_another_light_or_observer_works_out_no_terms(scenes, live, owner, monkeypatch):
    scene = scenes.lamp_scene(size=24)
    canvases = [owner.texture((24, 24), 4) for _ in range(2)]
    terms, tiles = (counted(monkeypatch, live.session.backend, name) for name in ("terms", "tile"))
    for light, who in ((None, "1931_2"), ("A", "1931_2"), ("FL11", "1964_10")):
        seen = replace(scene, observer=observer(who))
        lit = None if light is None else illuminant(light)
        sides = [CanvasSide(one, scenes.SURFACES, lit) for one in (seen, seen.with_material("part0", "sharp"))]
        live.draw(sides, scene.camera(), canvases)
        counts = len(terms), len(tiles)
        assert live.knows(live.sides.prepared(sides, scene.camera()))
        if light is None:
            first = counts
    assert not live.knows(live.sides.prepared(sides, orbited(scene.camera(), 0.1)))
    assert not live.knows(
        live.sides.prepared([CanvasSide(scene.with_material("part0", "brushed"), scenes.SURFACES)], scene.camera())
    )
    assert counts == first and first[1] == 1 and first[0] > 4


def test_sides_of_other_geometry_are_refused(scenes, live, owner):
    scene = scenes.lamp_scene(size=8, samples=1)
    canvases = [owner.texture((8, 8), 4) for _ in range(2)]
    sun = DirectionalLight(np.array([0.0, 1.0, 0.0]), illuminant("D65"), 500.0)
    more = (*scene.parts, Part("more", shapes.sphere(1), "matt"))
    for other in (replace(scene, lights=(sun,)), replace(scene, parts=more)):
        with pytest.raises(InputError, match="different geometry"):
            live.draw(
                [CanvasSide(scene, scenes.SURFACES), CanvasSide(other, scenes.SURFACES)], scene.camera(), canvases
            )


def test_a_drawing_that_is_left_half_way_leaves_nothing_wrong(scenes, gl, live, owner):
    live.session.configure(tile_samples=24)
    scene = scenes.lamp_scene(size=24)
    canvas = owner.texture((24, 24), 4)
    steps = live.drawing(live.sides.prepared([CanvasSide(scene, scenes.SURFACES)], scene.camera()), [canvas])
    next(steps)
    steps.close()
    live.draw([CanvasSide(scene, scenes.SURFACES)], scene.camera(), [canvas])
    with gl_session(gl) as once:
        xyz, _ = once.render(scene, None, scenes.SURFACES)
    assert np.abs(read(canvas)[..., :3] - xyz).max() < 1e-3


def test_a_slope_stays_one_when_it_is_enlarged(live, owner):
    across = np.arange(8, dtype=np.float32)
    small = owner.texels(np.tile(across[None, :, None], (6, 1, 4)))
    large = owner.texture((24, 18), 4)
    live.enlarge(small, large)
    wanted = np.clip((np.arange(24) + 0.5) / 3.0 - 0.5, 0.0, 7.0)
    np.testing.assert_allclose(read(large), np.broadcast_to(wanted[None, :, None], (18, 24, 4)), atol=1e-5)


# Pixels of a large picture along a side of one of a small one, as the window has them at most.
_ENLARGED = 4


def _between(values, count):
    """Linearly between the middles of pixels along the first axis."""
    at = np.clip((np.arange(count) + 0.5) / _ENLARGED - 0.5, 0.0, len(values) - 1.0)
    return np.stack([np.interp(at, np.arange(len(values)), column) for column in values.T], axis=1)


@pytest.mark.parametrize(
    ("what", "share"),
    [("a highlight's edge", 0.4), ("a shadow's edge", 1.0), ("a wire", 1.0), ("a slope's end", 1.0)],
)
def test_enlarged_pictures_have_no_rims_and_are_nearer_than_lines_where_they_are_smooth(live, owner, what, share):
    """Drawn at the middles of the small picture's pixels; aslant, so that all phases are there."""

    def drawn(height, width, step):
        y, x = step * (np.mgrid[:height, :width] + 0.5)
        across = x + 0.3 * y - 9.0
        return {
            "a highlight's edge": np.exp(-0.5 * (across / 3.0) ** 2),
            "a shadow's edge": np.where(across > 0.0, 1.0, 0.1),
            "a wire": np.where(np.abs(across) < 0.6, 1.0, 0.1),
            "a slope's end": 0.1 + 0.1 * np.maximum(across, 0.0),
        }[what].astype(np.float32)

    few, true = drawn(14, 16, 1.0), drawn(14 * _ENLARGED, 16 * _ENLARGED, 1.0 / _ENLARGED)
    small = owner.texels(np.repeat(few[..., None], 4, axis=2))
    large = owner.texture(true.shape[::-1], 4)
    live.enlarge(small, large)
    found, lines = read(large)[..., 0], _between(_between(few, len(true)).T, true.shape[1]).T
    assert few.min() <= found.min() and found.max() <= few.max()
    inner = slice(_ENLARGED, -_ENLARGED), slice(_ENLARGED, -_ENLARGED)
    assert np.abs(found - true)[inner].mean() <= share * np.abs(lines - true)[inner].mean()


@pytest.mark.parametrize("name", ["lamp_scene", "sphere_scene"])
def test_a_window_of_a_view_has_the_triangles_that_are_cut_out_of_all(scenes, name):
    scene = getattr(scenes, name)(size=48)
    view = view_of(geometry.scene_geometry(scene), scene.camera())
    for window in view.windows(36):
        some = view.triangles(window)
        every = window_triangles(view.clip, view.depth, view.scene.faces, view.perspective, view.size, window)
        for field in ("corners", "nearness", "inverse_w", "parent", "cut", "weights"):
            np.testing.assert_array_equal(getattr(some, field), getattr(every, field))
        assert (some.key_base, some.key_shift) == (every.key_base, every.key_shift)


@pytest.mark.parametrize("tile", [None, 32])
def test_nothing_is_seen_of_what_new_textures_hold(scenes, gl, live, owner, monkeypatch, tile):
    """Software GL clears the memory that it gives; a GPU leaves what was there before."""
    scene = scenes.lamp_scene(size=40)
    side, other = CanvasSide(scene, scenes.SURFACES), CanvasSide(scene, scenes.SURFACES, illuminant("FL11"))
    canvas = owner.texture((40, 40), 4)
    real = Owner.texture

    def dirty(self, size, components, data=None, dtype="f4"):
        if data is None:
            data = np.full(
                (size[1], size[0], components), np.nan, np.float16 if dtype == "f2" else np.float32
            ).tobytes()
        return real(self, size, components, data, dtype)

    monkeypatch.setattr(Owner, "texture", dirty)
    live.session.configure(tile_samples=tile)
    with gl_session(gl) as once:
        for shown in (side, other):
            live.draw([shown], scene.camera(), [canvas])
            xyz, coverage = once.render_many(shown.scene, None, scenes.SURFACES, (shown.illuminant,))[0]
            assert np.isfinite(xyz).all()
            np.testing.assert_array_equal(read(canvas)[..., 3], coverage)
            np.testing.assert_allclose(read(canvas)[..., :3], xyz, atol=2e-3)


def test_a_camera_that_moves_makes_no_new_textures_and_reads_nothing_back(scenes, live, owner, monkeypatch):
    scene = scenes.lamp_scene(size=40, samples=1)
    live.session.configure(keeps_terms=False)
    canvas = owner.texture((40, 40), 4)
    made = counted(monkeypatch, type(owner.context), "texture")
    reads = counted(monkeypatch, tile_module, "read")
    for turn in range(4):
        made.clear()
        live.draw([CanvasSide(scene, scenes.SURFACES)], orbited(scene.camera(), 0.01 * turn), [canvas])
    assert not made and not reads


def test_textures_that_nobody_uses_are_kept_as_far_as_there_is_room(gl, monkeypatch):
    resources.release_spares(gl)
    monkeypatch.setattr(resources, "MOST_SPARE", 3 * 16 * 64)
    kept = [Owner(gl) for _ in range(4)]
    textures = [one.texture((8, 8), 4) for one in kept]
    for one in kept:
        one.release()
    freed = [type(texture.mglo).__name__ == "InvalidObject" for texture in textures]
    assert freed.count(True) == 1
    again = Owner(gl)
    assert again.texture((8, 8), 4) in textures and again.texture((8, 8), 2) not in textures
    assert again.texture((16, 16), 4) not in textures
    again.release()
    resources.release_spares(gl)
    assert all(type(texture.mglo).__name__ == "InvalidObject" for texture in textures)


def test_windows_begin_in_the_middle_and_are_the_whole_picture(scenes):
    scene = scenes.lamp_scene(size=40)
    view = view_of(geometry.scene_geometry(scene), scene.camera())
    times = np.zeros((120, 120), dtype=int)
    windows = list(view.windows(36))
    for one in windows:
        times[one.top : one.top + one.height, one.left : one.left + one.width] += 1
    assert (times == 1).all() and len(windows) == 16
    assert (windows[0].left, windows[0].top) == (36, 36) and windows[-1].left + windows[-1].top == 2 * 108


def test_triangles_beside_and_behind_the_eye_are_in_the_windows_that_show_them(scenes):
    """A floor that the camera stands on: corners behind it have no place in the picture."""
    scene = scenes.lamp_scene(size=32, samples=1)
    near = replace(scene.camera(), position=(0.5, -0.8, 2.0), target=(0.0, -0.7, 0.0))
    view = view_of(geometry.scene_geometry(scene), near)
    for window in view.windows(8):
        every = window_triangles(view.clip, view.depth, view.scene.faces, view.perspective, view.size, window)
        np.testing.assert_array_equal(view.triangles(window).parent, every.parent)


def test_a_dimmed_light_is_as_much_darker(scenes, live, owner):
    scene = scenes.lamp_scene(size=16)
    canvases = [owner.texture((16, 16), 4) for _ in range(2)]
    sides = [CanvasSide(scene, scenes.SURFACES), CanvasSide(scene, scenes.SURFACES, dimming=0.25)]
    live.draw(sides, scene.camera(), canvases)
    np.testing.assert_allclose(read(canvases[1])[..., :3], 0.25 * read(canvases[0])[..., :3], atol=1e-6)
    np.testing.assert_array_equal(read(canvases[1])[..., 3], read(canvases[0])[..., 3])


def test_what_closed_meshes_show_from_behind_is_not_missed(scenes, live, owner):
    scene = scenes.lamp_scene(size=32, samples=1)
    canvases = [owner.texture((32, 32), 4) for _ in range(2)]
    live.draw([CanvasSide(scene, scenes.SURFACES)], scene.camera(), canvases[:1])
    drawn = len(live.session.cache.view.triangles(next(live.session.cache.view.windows())).parent)
    live.session.release()
    live.session.cache.one_sided = frozenset(id(part.mesh) for part in scene.parts[:2])
    live.draw([CanvasSide(scene, scenes.SURFACES)], scene.camera(), canvases[1:])
    assert len(live.session.cache.view.triangles(next(live.session.cache.view.windows())).parent) < 0.6 * drawn
    np.testing.assert_array_equal(read(canvases[0]), read(canvases[1]))


def test_a_picture_that_is_begun_in_steps_is_the_same(scenes, live, owner):
    scene = scenes.lamp_scene(size=24)
    canvas = owner.texture((24, 24), 4)
    sides = [CanvasSide(scene, scenes.SURFACES)]
    assert not live.sides.has_worked_out(sides)
    live.sides.work_out(sides)
    assert live.sides.has_worked_out(sides)
    prepared = live.sides.prepared(sides, scene.camera())
    assert len(list(live.beginning(prepared))) == 2 + len(scene.lights)
    for _ in live.drawing(prepared, [canvas]):
        pass
    first = read(canvas).copy()
    assert not list(live.beginning(prepared))
    live.session.release()
    live.draw(sides, scene.camera(), [canvas])
    np.testing.assert_array_equal(first, read(canvas))
