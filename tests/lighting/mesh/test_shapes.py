import numpy as np
import pytest
from metamer.lighting.mesh import shapes
from metamer.runtime.errors import InputError

CLOSED = {"sphere": shapes.sphere(4), "speed_shape": shapes.speed_shape(5)}
OPEN = {"cloth": shapes.cloth(60), "plane": shapes.plane(), "patch": shapes.patches(3, tilt_deg=8)[1]}


@pytest.mark.parametrize("name", CLOSED)
def test_closed_shapes_are_watertight_and_wind_outwards(name, watertight):
    mesh = CLOSED[name]
    assert watertight(mesh)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 > 0


@pytest.mark.parametrize("name", [*CLOSED, *OPEN])
def test_normals_agree_with_the_triangles(name):
    mesh = (CLOSED | OPEN)[name]
    cosine = np.einsum("fki,fi->fk", mesh.normals[mesh.faces], mesh.face_normals)
    assert cosine.min() > 0.98, f"worst triangle {np.argmin(cosine.min(axis=1))}"


def test_the_spheres_volume_and_outline():
    mesh = shapes.sphere()
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(4 / 3 * np.pi, rel=3e-4)
    edges = np.concatenate([a + b, b + c, c + a]) / 2
    assert np.linalg.norm(edges, axis=1).min() > 1 - 1e-4


def test_the_speed_shape_is_convex_at_its_ends_and_hollow_on_its_back():
    mesh = shapes.speed_shape()
    # Normal curvature from edges: (n_b - n_a).(p_b - p_a) / |p_b - p_a|^2, positive where convex.
    a, b = np.concatenate([mesh.faces[:, [k, (k + 1) % 3]] for k in range(3)]).T
    step = mesh.vertices[b] - mesh.vertices[a]
    curvature = np.einsum("ij,ij->i", mesh.normals[b] - mesh.normals[a], step) / np.einsum("ij,ij->i", step, step)
    middle = 0.5 * (mesh.vertices[a] + mesh.vertices[b])
    assert curvature[np.abs(middle[:, 0]) > 1.5].min() > 0
    # Across the back, from left to right, the section dips: both sides lean towards the middle line.
    back = (np.abs(mesh.vertices[:, 0]) < 0.2) & (mesh.normals[:, 1] > 0.7)
    side = mesh.vertices[back][:, 2]
    inner = (np.abs(side) > 0.05) & (np.abs(side) < 0.15)
    assert inner.sum() > 50
    assert (mesh.normals[back][inner][:, 2] * np.sign(side[inner])).max() < 0


@pytest.mark.parametrize("name", ["speed_shape", "cloth"])
def test_standing_on_the_floor(name):
    assert (CLOSED | OPEN)[name].bounds[0][1] == 0


def test_refining_the_speed_shape_brings_normals_and_triangles_together_at_first_order():
    worst = []
    for subdivisions in (4, 5, 6):
        mesh = shapes.speed_shape(subdivisions)
        mean = mesh.normals[mesh.faces].mean(axis=1)
        mean /= np.linalg.norm(mean, axis=1, keepdims=True)
        worst.append(1 - np.einsum("ij,ij->i", mean, mesh.face_normals).min())
    # 1 - cos of an error of order h falls with h^2.
    assert worst[0] / worst[1] > 3.5
    assert worst[1] / worst[2] > 3.5


def test_patches_stand_side_by_side():
    chips = shapes.patches(4, gap=0.5)
    assert [float(chip.bounds[0][0]) for chip in chips] == pytest.approx([-2.75, -1.25, 0.25, 1.75])
    assert all((chip.normals == [0, 0, 1]).all() for chip in chips)


def test_no_patches_is_an_error():
    with pytest.raises(InputError, match="no patches"):
        shapes.patches(0)
