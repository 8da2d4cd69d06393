"""Visibility of what a camera sees comes first, as good as the whole; the whole does not depend on it."""

import numpy as np
import pytest
from metamer.lighting.mesh.shapes import cloth, plane, speed_shape, sphere
from metamer.lighting.visibility import adaptive_sampling, precompute
from metamer.lighting.visibility.precompute import SeenPoints, computed_visibility
from visibility_truth import truth

# Points on triangles, a few thousand as a small picture has.
POINTS, DIRECTIONS = 1500, 24


@pytest.fixture(scope="module")
def scene(scene_of):
    """A shape, a ball over it, a sheet that is seen from both sides, and a floor whose triangles are cut."""
    return scene_of(
        speed_shape(2),
        sphere(1, radius=0.3).placed(translate=(0.0, 1.2, 0.0)),
        cloth(6).placed(translate=(2.0, -0.3, 0.0)),
        plane(6.0, 6.0).placed(translate=(0.0, -0.4, 0.0)),
    )


@pytest.fixture(scope="module")
def points(scene):
    """Points on a half of the scene, and rays there."""
    drawn = truth(scene, POINTS, DIRECTIONS)
    middle = np.concatenate([part.mesh.vertices[part.mesh.faces].mean(axis=1) for part in scene.parts])
    return drawn, middle[drawn.faces, 2] > 0.2


def seen_of(points, back=False):
    drawn, which = points
    return SeenPoints(drawn.faces[which], drawn.weights[which], np.full(which.sum(), back))


def found_first(scene, seen, **settings):
    """The whole, and all that was told of before it."""
    told = []
    whole = computed_visibility(scene, seen=seen, on_seen=told.append, **settings)
    return whole, told


def wrong(visibility, points):
    drawn, which = points
    asked = visibility.located(drawn.faces[which], drawn.weights[which])
    free = visibility.signed_distances(*asked, drawn.directions[which]) > 0.0
    return float((free != drawn.free[which])[drawn.counts[which]].mean())


def same(one, other):
    names = ("mean", "axes", "whole", "halves", "steps", "facing", "fronts", "backs", "middles")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


@pytest.mark.slow
@pytest.mark.parametrize("whole", [pytest.param(adaptive_sampling.WHOLE, marks=pytest.mark.slow), 200])
def test_it_is_as_good_as_the_whole_around_these_points(scene, points, monkeypatch, whole):
    """200: most sites of the shape are foretold."""
    monkeypatch.setattr(adaptive_sampling, "WHOLE", whole)
    alone = computed_visibility(scene)
    result, (first,) = found_first(scene, seen_of(points))
    assert same(result, alone)
    assert wrong(first, points) <= 1.2 * wrong(alone, points) + 0.001
    drawn, which = points
    beyond = drawn, ~which
    # Nothing was found there, and what is not known is dark.
    assert wrong(first, beyond) > 0.1 > wrong(alone, beyond)


class Enough(Exception):
    """Raised where the test has seen enough."""


def enough(*_):
    raise Enough


def test_few_sites_are_traced_for_few_points(scene, points, monkeypatch):
    sites, traced = [], precompute.traced
    monkeypatch.setattr(precompute, "traced", lambda starts, *rest: sites.append(len(starts)) or traced(starts, *rest))
    drawn, which = points
    few = SeenPoints(drawn.faces[which][:3], drawn.weights[which][:3], np.zeros(3, dtype=bool))
    with pytest.raises(Enough):
        computed_visibility(scene, seen=few, on_seen=enough)
    assert 0 < sum(sites) < 120


def test_only_the_side_that_is_seen_is_found(scene, points):
    """Sites on the other side of the sheet stay dark."""
    drawn, _ = points
    first = sum(len(part.mesh.faces) for part in scene.parts[:2])
    sheet = (drawn.faces >= first) & (drawn.faces < first + len(scene.parts[2].mesh.faces))
    up = drawn.counts[sheet]
    free = {}
    for back in (False, True):
        told = []
        with pytest.raises(Enough):
            computed_visibility(scene, seen=seen_of((drawn, sheet), back), on_seen=lambda one: enough(told.append(one)))  # noqa: B023
        asked = told[0].located(drawn.faces[sheet], drawn.weights[sheet])
        for side, above in ((False, up), (True, ~up)):
            found = told[0].signed_distances(*asked, drawn.directions[sheet], np.full(sheet.sum(), side))
            free[back, side] = float((found[above] > 0.0).mean())
    assert free[False, False] > 0.6 and free[True, True] > 0.02
    assert free[False, True] == free[True, False] == 0.0


@pytest.mark.slow
def test_a_camera_that_sees_nothing_waits_for_nothing(scene):
    nothing = SeenPoints(np.zeros(0, dtype=int), np.zeros((0, 3)), np.zeros(0, dtype=bool))
    _, (first,) = found_first(scene, nothing)
    assert first.vertices and not len(first.middles)


@pytest.mark.slow_cases("8192", "200")
@pytest.mark.parametrize("whole", [adaptive_sampling.WHOLE, 200])
def test_sites_of_which_none_gave_the_axes(scene, points, monkeypatch, whole):
    """A small part among many may have no such site."""
    monkeypatch.setattr(adaptive_sampling, "WHOLE", whole)
    monkeypatch.setattr(precompute, "_TRAINING", 2)
    monkeypatch.setattr(precompute, "_FEW", 2)
    assert found_first(scene, seen_of(points))[1]


def test_nothing_is_told_where_nothing_hides_anything(scene_of):
    ball = scene_of(sphere(2))
    seen = SeenPoints(np.zeros(1, dtype=int), np.full((1, 3), 1 / 3), np.zeros(1, dtype=bool))
    assert found_first(ball, seen) == (None, [])


def test_it_breaks_off_where_progress_does(scene, points):
    calls = []

    def progress(done, total, what):
        calls.append(done)
        if len(calls) > 1 and calls[-1] == calls[-2]:
            raise Enough

    with pytest.raises(Enough):
        found_first(scene, seen_of(points), progress=progress)
