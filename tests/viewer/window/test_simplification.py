"""Meshes of fewer triangles."""

from dataclasses import replace

import numpy as np
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh import shapes
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.scene import Part, Scene
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.viewer.window.simplification import is_closed, simplified, simplified_scene


def scene_of(*meshes):
    parts = tuple(Part(f"part{number}", mesh, "paint") for number, mesh in enumerate(meshes))
    light = DirectionalLight(np.array([0.0, 1.0, 0.0]), illuminant("D65"), 1000.0)
    return Scene(parts, (light,), (Camera(),), observer("1931_2"))


def test_a_ball_of_fewer_triangles_is_still_a_ball():
    ball = shapes.sphere(5)
    coarse = simplified(replace(ball, uv=None), 3000)
    assert 1000 < len(coarse.faces) <= 3000
    np.testing.assert_allclose(np.linalg.norm(coarse.vertices, axis=1), 1.0, atol=0.02)
    assert (np.einsum("vi,vi->v", coarse.normals, coarse.vertices) > 0.99).all()
    # Wound as it was: outwards.
    outwards = np.einsum("fi,fi->f", coarse.face_normals, coarse.vertices[coarse.faces].mean(axis=1))
    assert (outwards > 0.9).all()


def test_what_has_few_triangles_or_a_texture_stays_as_it_is():
    ball = replace(shapes.sphere(4), uv=None)
    assert simplified(ball, len(ball.faces)) is ball
    textured = replace(ball, uv=ball.vertices[:, :2])
    assert simplified(textured, 10) is textured
    scene = scene_of(ball)
    assert simplified_scene(scene, len(ball.faces)) is scene


def test_a_thin_plate_keeps_both_of_its_sides():
    x, z = np.meshgrid(np.linspace(-1.0, 1.0, 41), np.linspace(-1.0, 1.0, 41))
    points = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    corner = (np.arange(40)[:, None] * 41 + np.arange(40)).ravel()
    faces = np.concatenate([corner[:, None] + (0, 41, 1), corner[:, None] + (1, 41, 42)])
    top = Mesh(points, np.tile([0.0, 1.0, 0.0], (len(points), 1)), faces)
    under = replace(top, vertices=top.vertices - 1e-4 * top.normals, normals=-top.normals, faces=top.faces[:, ::-1])
    both = replace(
        top,
        vertices=np.concatenate([top.vertices, under.vertices]),
        normals=np.concatenate([top.normals, under.normals]),
        faces=np.concatenate([top.faces, under.faces + len(top.vertices)]),
    )
    coarse = simplified(both, len(both.faces) // 8)
    assert len(coarse.faces) < len(both.faces) // 4
    up = coarse.normals[:, 1] > 0.0
    assert 0.3 < up.mean() < 0.7
    assert (up[coarse.faces].all(axis=1) == (coarse.face_normals[:, 1] > 0.0)).all()


def test_of_a_scene_the_large_meshes_lose_triangles_and_materials_stay():
    ball, small = replace(shapes.sphere(5), uv=None), shapes.plane(4.0, 4.0)
    scene = scene_of(ball, small)
    coarse = simplified_scene(scene, 4000)
    assert sum(len(part.mesh.faces) for part in coarse.parts) <= 4000
    assert [part.material for part in coarse.parts] == [part.material for part in scene.parts]
    assert len(coarse.parts[1].mesh.faces) == len(small.faces)


def test_closed_meshes_are_told_from_open_ones():
    ball, sheet = shapes.sphere(2), shapes.plane(2.0, 2.0)
    assert is_closed(ball) and is_closed(shapes.speed_shape(2, uv=True)) and not is_closed(sheet)
    opened = Mesh(ball.vertices, ball.normals, ball.faces[1:], name="a hole")
    turned = Mesh(ball.vertices, ball.normals, np.concatenate([ball.faces[:1, ::-1], ball.faces[1:]]), name="a flip")
    assert not is_closed(opened) and not is_closed(turned)
