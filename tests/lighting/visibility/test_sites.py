"""Sites, where rays start."""

import numpy as np
import pytest
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.visibility.occluders import OFFSET, Occluders
from metamer.lighting.visibility.sites import pieces_of, scaled_triangles, sites


def found_in(scene):
    return sites(scene, pieces_of(scene), Occluders(scaled_triangles(scene)))


def place(scene, point):
    low, high = scene.bounds
    return (np.asarray(point) - 0.5 * (low + high)) / (0.5 * np.linalg.norm(high - low))


def test_duplicate_vertices_of_a_uv_seam_are_one_site(scene_of):
    seamed, whole = sphere(3, uv=True), sphere(3)
    found = found_in(scene_of(seamed))
    assert len(seamed.vertices) > len(whole.vertices) == len(found)
    assert (found.backs == -1).all() and sorted(set(found.fronts.tolist())) == list(range(len(found)))


def test_a_vertex_nobody_uses_has_no_site(scene_of):
    ball = sphere(2)
    mesh = Mesh(np.vstack([[9.0, 9.0, 9.0], ball.vertices]), np.vstack([[0.0, 1.0, 0.0], ball.normals]), ball.faces + 1)
    found = found_in(scene_of(mesh))
    assert found.fronts[0] == -1 and (found.fronts[1:] >= 0).all() and len(found) == len(ball.vertices)


def test_a_smooth_vertex_starts_above_itself(scene_of):
    ball = sphere(3)
    scene = scene_of(ball)
    found = found_in(scene)
    expected = place(scene, ball.vertices) + OFFSET * ball.normals
    assert np.abs(found.starts[found.fronts] - expected).max() < 1e-12


def test_a_sheet_has_sites_on_both_sides_inside_its_rim(scene_of):
    scene = scene_of(plane(2.0, 2.0))
    found = found_in(scene)
    corners = place(scene, scene.parts[0].mesh.vertices)
    fronts, backs = found.starts[found.fronts], found.starts[found.backs]
    assert fronts[:, 1] == pytest.approx(OFFSET) and backs[:, 1] == pytest.approx(-OFFSET)
    assert (np.abs(fronts[:, [0, 2]]) < np.abs(corners[:, [0, 2]]).max()).all()
    assert (found.normals[found.backs] == -found.normals[found.fronts]).all()


def test_the_foot_of_a_wall_starts_on_the_wall_above_the_floor(scene_of, box):
    scene = scene_of(box(), plane(4.0, 4.0))
    found = found_in(scene)
    foot = np.flatnonzero((scene.parts[0].mesh.vertices[:, 1] == 0.0) & (scene.parts[0].mesh.normals[:, 1] == 0.0))
    assert len(foot) == 8
    assert (found.starts[found.fronts[foot], 1] > place(scene, (0, 0, 0))[1] + 1e-3).all()


def test_a_vertex_that_touches_the_floor_starts_above_it(scene_of):
    """The lowest vertex of a ball looks down: just off its surface it would be under the floor."""
    ball = sphere(3)
    lowest = int(ball.vertices[:, 1].argmin())
    scene = scene_of(ball.placed(translate=(0.0, -ball.vertices[lowest, 1], 0.0)), plane(4.0, 4.0))
    found = found_in(scene)
    assert found.starts[found.fronts[lowest], 1] > place(scene, (0, 0, 0))[1]


def test_starts_do_not_hang_on_place_and_size_of_the_scene(scene_of, box):
    meshes = (box(), sphere(2).placed(translate=(2, 1, 0)), plane(8.0, 8.0))
    moved = [mesh.placed(scale=1e3, translate=(5e4, -2e4, 1e4)) for mesh in meshes]
    one, other = found_in(scene_of(*meshes)), found_in(scene_of(*moved))
    assert np.abs(one.starts[one.fronts] - other.starts[other.fronts]).max() < 1e-9
