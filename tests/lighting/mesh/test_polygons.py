"""Polygons cut into triangles: areas worked out apart, whichever corner comes first and however they lie in space."""

import numpy as np
import pytest
from metamer.lighting.mesh.polygons import triangulated

OUTLINES = {
    "square": ([(0, 0), (2, 0), (2, 2), (0, 2)], 4.0),
    "arrowhead": ([(0, 0), (4, 0), (1, 1), (0, 4)], 4.0),
    "flat arrowhead": ([(0, 0), (10, 0), (5, 1), (0, 8)], 25.0),
    "U": ([(3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3), (0, 0), (3, 0)], 7.0),
    "L": ([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)], 5.0),
    "plus": ([(1, 0), (2, 0), (2, 1), (3, 1), (3, 2), (2, 2), (2, 3), (1, 3), (1, 2), (0, 2), (0, 1), (1, 1)], 5.0),
    "comb": ([(0, 0), (7, 0), (7, 3), (6, 3), (6, 1), (5, 1), (5, 3), (4, 3), (4, 1), (3, 1), (3, 3), (0, 3)], 17.0),
    "spiral": ([(0, 0), (5, 0), (5, 5), (1, 5), (1, 2), (3, 2), (3, 3), (2, 3), (2, 4), (4, 4), (4, 1), (0, 1)], 15.0),
    "star": ([(0, 3), (-1, 1), (-3, 0), (-1, -1), (0, -3), (1, -1), (3, 0), (1, 1)], 12.0),
    "corner on a side": ([(0, 0), (1, 0), (2, 0), (2, 2), (0, 2)], 4.0),
    "repeated corner": ([(0, 0), (2, 0), (2, 2), (2, 2), (1, 0.5), (0, 2)], 2.5),
    "first corner again": ([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3), (0, 0)], 5.0),
    "hole by a bridge": ([(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)], 12.0),
    "two squares at a corner": ([(0, 0), (1, 0), (1, 1), (2, 1), (2, 2), (1, 2), (1, 1), (0, 1)], 2.0),
}
TURN = np.linalg.qr(np.array([[2.0, 1, -1], [0.5, 3, 1], [1, -1, 2]]))[0]
PLACES = {
    "flat": lambda xy: np.c_[xy, np.zeros(len(xy))],
    "on its side": lambda xy: np.c_[xy[:, 1], np.zeros(len(xy)), xy[:, 0]],
    "turned": lambda xy: np.c_[xy, np.zeros(len(xy))] @ TURN.T,
    "far away": lambda xy: np.c_[xy, np.zeros(len(xy))] @ TURN.T + 4096.0,
}


def area_vectors(points, corners):
    a, b, c = (points[corners[:, k]] for k in range(3))
    return 0.5 * np.cross(b - a, c - a)


@pytest.mark.parametrize("backwards", [False, True], ids=["as said", "backwards"])
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", OUTLINES)
def test_triangles_fill_an_outline_and_wind_as_it_does(name, place, backwards):
    outline, area = OUTLINES[name]
    points = PLACES[place](np.array(outline, dtype=float))
    towards = np.cross(*(PLACES[place](np.eye(3)[:2, :2]) - PLACES[place](np.zeros((2, 2)))))
    for first in range(len(points)):
        turned = np.roll(points[::-1] if backwards else points, first, axis=0)
        cut = triangulated(turned, np.array([len(points)]))
        vectors = area_vectors(turned, cut.corners)
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1).sum(), area, rtol=1e-9)
        np.testing.assert_allclose(vectors.sum(axis=0), towards * (-area if backwards else area), atol=1e-8)
        assert cut.crossing == 0 and cut.notes("mesh") == []


def test_many_polygons_at_once_keep_their_order_and_corners():
    shapes = [np.array(outline, dtype=float) for outline, _ in OUTLINES.values()]
    points = np.concatenate([PLACES["turned"](shape) + 10 * k for k, shape in enumerate(shapes)])
    cut = triangulated(points, np.array([len(shape) for shape in shapes]))
    areas = np.bincount(cut.polygon, np.linalg.norm(area_vectors(points, cut.corners), axis=1))
    np.testing.assert_allclose(areas, [area for _, area in OUTLINES.values()], rtol=1e-9)
    assert (np.diff(cut.polygon) >= 0).all()


@pytest.mark.parametrize("height", [-0.3, 0.2])
@pytest.mark.parametrize("name", ["arrowhead", "U", "star", "plus"])
def test_a_polygon_that_is_not_flat_is_cut_as_its_shadow(name, height):
    """Corners off the plane by turns: the triangles' shadows fill the outline's, and none is turned over."""
    outline, area = OUTLINES[name]
    points = np.c_[np.array(outline, dtype=float), height * (np.arange(len(outline)) % 2)]
    cut = triangulated(points, np.array([len(points)]))
    shadows = area_vectors(points, cut.corners)[:, 2]
    assert (shadows > 0.0).all()
    assert shadows.sum() == pytest.approx(area)


def test_a_convex_polygon_is_a_fan_from_its_first_corner():
    cut = triangulated(PLACES["flat"](np.array([(0, 0), (2, 0), (3, 1), (2, 2), (0, 2)], float)), np.array([5]))
    assert cut.corners.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]


@pytest.mark.parametrize(
    "outline",
    [
        [(0, 0), (2, 2), (2, 0), (0, 2)],
        [(0, 0), (3, 3), (3, 0), (0, 2)],
        [(np.cos(a), np.sin(a)) for a in np.arange(5) * 4 * np.pi / 5],
    ],
    ids=["bow tie", "uneven bow tie", "pentagram"],
)
def test_an_outline_that_crosses_itself_is_said(outline):
    cut = triangulated(PLACES["flat"](np.array(outline, dtype=float)), np.array([len(outline)]))
    assert cut.crossing == 1
    assert "cross themselves" in cut.notes("mesh")[0]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_corners_that_are_not_finite_are_left_to_whoever_takes_the_triangles(bad):
    points = np.array([[0, 0, 0], [1, 0, 0], [bad, 1, 0], [0, 1, 0]])
    assert len(triangulated(points, np.array([4])).corners) == 2


def test_nothing_is_no_triangles():
    cut = triangulated(np.empty((0, 3)), np.empty(0, dtype=np.int64))
    assert cut.corners.shape == (0, 3) and cut.polygon.shape == (0,)
