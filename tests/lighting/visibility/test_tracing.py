"""Visibility from one site, beside what geometry says: slits, wires, far balls, the horizon."""

import numpy as np
import pytest
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.visibility.occluders import Occluders
from metamer.lighting.visibility.tracing import MAP, texels, traced

UP = np.array([[0.0, 1.0, 0.0]])


def plates(edges, far=200.0, height=1.0):
    """Triangles of level strips between pairs of x, endless along z."""
    found = []
    for low, high in edges:
        a, b, c, d = ((x, height, z) for x, z in ((low, -far), (high, -far), (high, far), (low, far)))
        found += [(a, b, c), (a, c, d)]
    return np.array(found)


def turned(triangles, angle):
    """About the vertical."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return (triangles @ np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])).astype(np.float32)


def seen_above(triangles):
    """`traced` of the origin under some triangles, and which texels lie well above its horizon."""
    found = traced(np.zeros((1, 3)), UP, Occluders(triangles))
    return found, texels()[:, 1] > np.sin(np.deg2rad(15.0))


def gap(width_deg, angle):
    """Signed angles of all texels to the edges of a strip overhead of such a width, positive inside."""
    half = np.deg2rad(0.5 * width_deg)
    across = texels() @ np.array([np.cos(angle), 0.0, -np.sin(angle)])
    # Edges are great circles: planes through the origin and the line (+-tan(half), 1, z).
    right = np.arcsin(np.clip(across * np.cos(half) - texels()[:, 1] * np.sin(half), -1.0, 1.0))
    left = np.arcsin(np.clip(-across * np.cos(half) - texels()[:, 1] * np.sin(half), -1.0, 1.0))
    return -np.maximum(left, right)


@pytest.mark.parametrize("thing", ["slit", "wire"])
@pytest.mark.parametrize("width_deg", [8.0, 20.0])
def test_slits_and_wires_wider_than_a_texel_are_where_they_are(thing, width_deg):
    off = []
    for angle in np.linspace(0.0, np.pi, 12, endpoint=False):
        edge = np.tan(np.deg2rad(0.5 * width_deg))
        strips = [(-300.0, -edge), (edge, 300.0)] if thing == "slit" else [(-edge, edge)]
        found, above = seen_above(turned(plates(strips), angle))
        expected = gap(width_deg, angle) * (1.0 if thing == "slit" else -1.0)
        assert not found.all_free and not found.dark.any()
        # The sign of a texel is that of its own ray.
        clear = above & (np.abs(expected) > 1e-3)
        assert (np.sign(found.distances[0, clear]) == np.sign(expected[clear])).all()
        off.append(np.rad2deg(np.abs(found.distances[0, above] - expected[above])))
    off = np.concatenate(off)
    assert off.mean() < 0.5 and np.percentile(off, 99.0) < 2.5


def test_a_wire_thinner_than_a_texel_is_seen_by_the_share_of_sites_that_its_width_is():
    width_deg, seen = 1.5, 0
    edge, rng = np.tan(np.deg2rad(0.5 * width_deg)), np.random.default_rng(3)
    for _ in range(40):
        # A short wire: it ends, and stands anywhere.
        end = np.tan(np.deg2rad(4.0))
        x, z = rng.uniform(-0.5, 0.5, 2)
        wire = plates([(-edge, edge)], far=end) + np.array([x, 0.0, z])
        found, _ = seen_above(turned(wire, rng.uniform(0.0, np.pi)))
        hidden = (found.distances < 0.0)[0, texels()[:, 1] > 0.0].sum()
        # Never more of it than there is, and a texel.
        assert hidden <= 4
        seen += hidden > 0
    assert 4 < seen < 36


@pytest.mark.parametrize("radius_deg", [4.0, 12.0, 40.0])
def test_whether_a_far_lamp_is_hidden_by_a_ball_is_known_to_a_degree_or_two(radius_deg):
    rng, off = np.random.default_rng(5), []
    for _ in range(12):
        towards = np.append(rng.normal(size=2), 1.2)[[0, 2, 1]]
        towards /= np.linalg.norm(towards)
        ball = sphere(4, radius=np.sin(np.deg2rad(radius_deg)))
        found, above = seen_above((ball.vertices[ball.faces] + towards).astype(np.float32))
        expected = np.arccos(np.clip(texels() @ towards, -1.0, 1.0)) - np.deg2rad(radius_deg)
        near = above & (np.abs(expected) < np.deg2rad(20.0))
        off.append(np.rad2deg(np.abs(found.distances[0, near] - expected[near])))
    off = np.concatenate(off)
    assert off.mean() < 0.7 and np.percentile(off, 99.0) < 2.5


def test_what_rises_a_little_above_the_horizon_is_seen_along_it():
    """A wall all around, 8 degrees high, but for a door."""
    door, high = 0.35, np.tan(np.deg2rad(8.0))
    corners = np.linspace(door, 2.0 * np.pi - door, 120)
    low = np.stack([np.cos(corners), np.full(120, -0.5), np.sin(corners)], axis=1)
    top = low + np.array([0.0, 0.5 + high, 0.0])
    wall = np.concatenate(
        [np.stack([low[:-1], low[1:], top[1:]], axis=1), np.stack([low[:-1], top[1:], top[:-1]], axis=1)]
    )
    found, _ = seen_above(wall.astype(np.float32))
    elevation = np.rad2deg(np.arcsin(texels()[:, 1]))
    azimuth = np.abs(np.arctan2(texels()[:, 2], texels()[:, 0]))
    overhead = (elevation > 11.0) & (elevation < 40.0) & (azimuth > door + 0.5)
    off = np.abs(np.rad2deg(found.distances[0, overhead]) - (elevation[overhead] - 8.0))
    assert off.mean() < 1.0 and (found.distances[0, overhead] > 0.0).all()
    # Just below the horizon it is as just above.
    below = (texels()[:, 1] <= 0.0) & (texels()[:, 1] > -np.sin(np.deg2rad(6.0)))
    wide, behind = azimuth > door + 0.2, azimuth < door - 0.2
    assert (found.distances[0, below & wide] < 0.0).all() and (found.distances[0, below & behind] > 0.0).all()


def test_sites_that_see_one_thing_see_it_everywhere():
    lid = plates([(-500.0, 500.0)], far=500.0)
    found = traced(np.zeros((2, 3)), np.concatenate([UP, -UP]), Occluders(lid.astype(np.float32)))
    assert found.dark.tolist() == [True, False] and not found.all_free
    np.testing.assert_allclose(found.distances, np.outer([-1.0, 1.0], np.full(MAP**2, 0.5 * np.pi)), rtol=1e-6)
    assert traced(np.zeros((1, 3)), -UP, Occluders(lid.astype(np.float32))).all_free


def test_a_site_costs_fewer_rays_than_a_map_of_its_own_twice_as_fine(monkeypatch):
    asked, free = [], Occluders.free
    monkeypatch.setattr(Occluders, "free", lambda self, starts, to: asked.append(len(to)) or free(self, starts, to))
    strips = plates([(-300.0, -0.4), (0.4, 300.0)])
    traced(np.zeros((1, 3)), UP, Occluders(strips.astype(np.float32)))
    assert sum(asked) < 0.7 * 0.5 * (2 * MAP) ** 2
