"""Cameras and lights that can show nothing are named; those that can are left in peace."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.lighting.mesh import shapes
from metamer.lighting.mesh.files import cleaned_mesh
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.reference import placement
from metamer.lighting.reference.geometry import visible_geometry
from metamer.lighting.reference.placement import looks_past, placement_warnings, why_black, winding_number
from metamer.lighting.scene import Part, Scene
from metamer.lighting.scene_file.files import load_scene
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer

EXAMPLES = sorted((Path(__file__).resolve().parents[3] / "examples").glob("*.toml"))
D65 = illuminant("D65")


def sun(direction=(0.3, 0.5, 1.0)) -> DirectionalLight:
    return DirectionalLight(direction, D65, name="sun")


def lamp(*position: float) -> PointLight:
    return PointLight(position, D65, 100.0, name="lamp")


def box(size: float = 1.0, without: int | None = None, inwards: bool = False, centre=(0.0, 0.0, 0.0)) -> Mesh:
    """A cube of twelve triangles, `size` from its middle to a side; `without` leaves one of its six sides out."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    if without is not None:
        sides = np.delete(sides, without, axis=0)
    faces = np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])
    return cleaned_mesh(size * corners + np.array(centre), faces[:, ::-1] if inwards else faces)


def ball(x: float = 0.0, radius: float = 1.0) -> Mesh:
    moved = np.eye(4)
    moved[0, 3] = x
    return shapes.sphere(3, radius).transformed(moved)


def scene(meshes: dict[str, Mesh], lights, position, target=(0.0, 0.0, 0.0), **camera) -> Scene:
    parts = tuple(Part(name, mesh, "any") for name, mesh in meshes.items())
    view = Camera("view", position, target, width=24, height_px=24, samples=1, **camera)
    return Scene(parts, tuple(lights), (view,), observer("1931_2"))


@pytest.mark.parametrize(
    ("mesh", "point", "expected"),
    [
        (ball(), (0.0, 0.0, 0.0), 1.0),
        (ball(), (0.9, 0.0, 0.0), 1.0),
        (ball(), (1.1, 0.0, 0.0), 0.0),
        (box(inwards=True), (0.3, 0.2, 0.1), -1.0),
        (box(without=5), (0.0, 0.0, 0.0), 5 / 6),
        (shapes.plane(2, 2), (0.0, -1.0, 0.0), 1 / 6),
    ],
)
def test_winding_numbers_are_shares_of_all_directions(mesh, point, expected):
    assert winding_number(mesh, np.array(point)) == pytest.approx(expected, abs=1e-12)


def test_a_camera_inside_a_body_is_named_with_it():
    (line,) = placement_warnings(scene({"floor": shapes.plane(), "ball": ball()}, [sun()], (0.2, 0.1, 0.3)))
    assert 'camera "view"' in line and 'part "ball"' in line and "floor" not in line and "\n" not in line


@pytest.mark.parametrize("inwards", [False, True])
def test_a_camera_in_a_room_without_a_light_is_named_whichever_way_its_walls_face(inwards):
    room = scene({"room": box(2, inwards=inwards), "ball": ball(0.9, 0.2)}, [sun(), lamp(0, 0, 3)], (0, 0, 0.5))
    (line,) = placement_warnings(room)
    assert 'inside part "room", and no light does' in line
    assert "is black" in why_black(room)[0]


def test_a_light_in_a_body_in_the_room_of_the_camera_is_named_with_that_body_alone():
    room = scene({"room": box(2), "ball": ball(0.9, 0.2)}, [lamp(0.9, 0, 0)], (0, 0, 0.5))
    (line,) = placement_warnings(room)
    assert line.startswith('light "lamp" stands inside part "ball": ')


def test_an_orthographic_camera_inside_a_body_is_named_too():
    inside = scene({"ball": ball()}, [sun()], (0.0, 0.0, 0.5), projection="orthographic")
    assert 'inside part "ball"' in placement_warnings(inside)[0]


def test_a_light_inside_a_body_is_named_with_body_and_camera():
    (line,) = placement_warnings(
        scene({"ball": ball(), "floor": shapes.plane()}, [sun(), lamp(0.5, 0.1, 0)], (0, 1, 5))
    )
    assert all(word in line for word in ('light "lamp"', 'part "ball"', 'camera "view"')) and "\n" not in line


def test_a_light_inside_a_body_that_faces_inwards_is_named_to_a_camera_outside():
    assert 'inside part "box"' in placement_warnings(scene({"box": box(inwards=True)}, [lamp(0, 0, 0)], (0, 0, 5)))[0]


@pytest.mark.parametrize("height", [0.0, 5e-4, -5e-4])
def test_a_light_on_a_surface_is_named_on_either_side_of_it(height):
    flat = shapes.plane(2, 2)
    (line,) = placement_warnings(scene({"table": flat}, [lamp(0.1, height, 0.2)], (0, 2, 5)))
    assert 'light "lamp" stands on the surface of part "table"' in line


def test_a_light_on_a_closed_body_is_said_once():
    (line,) = placement_warnings(scene({"ball": ball()}, [lamp(*(0.9999 * ball().vertices[7]))], (0, 0, 5)))
    assert 'on the surface of part "ball"' in line


@pytest.mark.parametrize(
    ("case", "meshes", "lights", "position"),
    [
        ("between two balls", {"left": ball(-1.5), "right": ball(1.5)}, [sun()], (0.01, 0.0, 0.4)),
        ("in a room with an open side", {"room": box(2, without=5)}, [sun()], (0.1, 0.2, 0.3)),
        ("in a room with a small window", {"room": box(2, without=5), "wall": None}, [sun()], (0.1, 0.2, -1.9)),
        ("in a room that faces inwards, lit from within", {"room": box(2, inwards=True)}, [lamp(1, 1, 1)], (0, 0, 0.5)),
        ("in a cube as a room, lit from within", {"room": box(2), "ball": ball(0.9, 0.2)}, [lamp(1, 1, 1)], (0, 0, 1)),
        ("in a house of two walls", {"out": box(2.2), "in": box(2.0, inwards=True)}, [lamp(1, 1, 1)], (0, 0, 0.5)),
        ("under a cloth", {"cloth": shapes.cloth(20)}, [sun(), lamp(0, 3, 0)], (0.1, 0.3, 0.1)),
        ("close above a floor", {"floor": shapes.plane(50, 50), "ball": ball()}, [lamp(0, 3, 0)], (0.0, 0.01, 4.0)),
        ("a lamp close to a table", {"table": shapes.plane(2, 2), "ball": ball()}, [lamp(0.0, 1.05, 0.0)], (0, 1, 5)),
        (
            "a camera that looks out of a ball's hollow",
            {"left": ball(-1.05), "right": ball(1.05)},
            [sun()],
            (0, 0, 0.2),
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_no_word_is_said_of_what_shows_something(case, meshes, lights, position):
    meshes = {name: mesh for name, mesh in meshes.items() if mesh is not None}
    assert placement_warnings(scene(meshes, lights, position, (0.2, 0.1, -1.0))) == ()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_no_word_is_said_of_the_examples(path):
    for camera in (loaded := load_scene(path)).cameras:
        small = replace(camera, width=24, height_px=24, samples=1)
        assert placement_warnings(loaded, camera) == ()
        assert why_black(loaded, small) == ()


def test_a_crack_leaves_a_body_closed_and_a_window_opens_it():
    fine = shapes.sphere(5)
    cracked = Mesh(fine.vertices, fine.normals, fine.faces[1:])
    opened = Mesh(fine.vertices, fine.normals, fine.faces[fine.vertices[fine.faces[:, 0], 2] < 0.9])
    assert placement_warnings(scene({"ball": cracked}, [sun()], (0.1, 0.0, 0.2)))
    assert placement_warnings(scene({"ball": opened}, [sun()], (0.1, 0.0, 0.2))) == ()


def test_a_mesh_that_nothing_stands_in_is_not_looked_into(monkeypatch):
    """The box around a part is enough for most."""
    asked = []
    monkeypatch.setattr(placement, "winding_number", lambda mesh, point: asked.append(mesh) or 0.0)
    inside_one_box = scene({"far": ball(5.0), "near": box(without=5)}, [sun(), lamp(0, 0, 9)], (0.1, 0.2, 0.3))
    assert placement_warnings(inside_one_box) == ()
    assert asked == [inside_one_box.parts[1].mesh]


def test_a_camera_that_looks_away_is_told_how_far():
    away = scene({"ball": ball()}, [sun()], (0, 0, 5), (0, 0, 9))
    line = looks_past(away, away.camera())
    assert line.startswith('camera "view" sees nothing: it looks 180 degrees past') and 'part "ball"' in line


def test_a_light_behind_all_that_is_seen_is_named():
    flat = shapes.plane(2, 2)
    (line,) = why_black(scene({"table": flat}, [sun((0, -1, 0.1)), lamp(0, -3, 0)], (0, 5, 1)))
    assert all(word in line for word in ('camera "view" is black', 'part "table"', 'lights "sun", "lamp"'))


def test_a_picture_without_a_surface_is_not_called_black():
    assert why_black(scene({"ball": ball()}, [sun()], (0, 0, 5), (0, 0, 9))) == ()


def test_light_that_reaches_anything_needs_no_word_and_rays_that_were_traced_serve_again(monkeypatch):
    lit = scene({"ball": ball()}, [sun()], (0, 0, 5))
    traced = visible_geometry(lit, lit.camera())
    monkeypatch.setattr(placement, "visible_geometry", lambda *_: pytest.fail("traced again"))
    assert why_black(lit, lit.camera(), traced) == ()


def test_a_large_picture_is_explained_with_few_rays(monkeypatch):
    traced = []
    monkeypatch.setattr(placement, "visible_geometry", lambda *asked: traced.append(asked) or visible_geometry(*asked))
    large = scene({"ball": ball()}, [sun((0, 0, -1))], (0, 0, 5))
    assert why_black(large, replace(large.camera(), width=16000, height_px=8000, samples=4))
    ((_, small),) = traced
    assert small.width * small.height_px <= 250_000 and small.samples == 1
    assert small.width == pytest.approx(2 * small.height_px, abs=2)
