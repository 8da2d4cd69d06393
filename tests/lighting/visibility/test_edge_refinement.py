"""Sites between vertices, where what the ends of an edge see is far apart."""

import numpy as np
import pytest
from metamer.lighting.mesh.shapes import cloth, plane, speed_shape, sphere
from metamer.lighting.vectors import dot, unit
from metamer.lighting.visibility import cache, edge_refinement, refinement
from metamer.lighting.visibility.precompute import computed_visibility
from visibility_truth import misclassified, truth


@pytest.fixture(autouse=True)
def undivided(monkeypatch):
    monkeypatch.setattr(refinement, "MOST_VERTICES", 10)


@pytest.fixture(scope="module")
def scene(scene_of):
    """A coarse ball, close to a rod that throws narrow shadows onto it."""
    rod = sphere(2).placed(scale=(0.06, 1.5, 0.06), translate=(1.15, 0.0, 0.0))
    return scene_of(sphere(3), rod)


@pytest.fixture(scope="module")
def found(scene):
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(refinement, "MOST_VERTICES", 10)
        return computed_visibility(scene)


def test_middles_stand_where_something_is_near(found, scene):
    assert 20 < len(found.middles) <= 0.5 * found.vertices
    first = found.middles[(found.middles < found.vertices).all(axis=1)]
    places = np.concatenate([part.mesh.vertices for part in scene.parts])[first].mean(axis=1)
    on_ball = places[first[:, 0] < 642]
    # To the other half the rod is below the horizon, but for its ends and what rises between rays, a texel apart.
    way = scene.parts[1].mesh.vertices[:, None] - on_ball
    sines = dot(way, unit(on_ball)) / np.linalg.norm(way, axis=-1)
    assert (sines.max(axis=0) > -np.sin(np.deg2rad(5.7))).all()


def test_between_vertices_less_is_wrong(found, scene, monkeypatch):
    known = truth(scene, 1500, 64)
    monkeypatch.setattr(edge_refinement, "APART", 9.0)
    assert misclassified(found, known) < 0.85 * misclassified(computed_visibility(scene), known)


@pytest.mark.slow
def test_a_mesh_that_is_fine_enough_is_what_it_was(scene_of, monkeypatch):
    """No middle, and every number as if there were no such thing."""
    smooth = scene_of(sphere(3), plane(5.0, 5.0).placed(translate=(0.0, -3.0, 0.0)))
    monkeypatch.setattr(edge_refinement, "APART", 9.0)
    never = computed_visibility(smooth)
    monkeypatch.setattr(edge_refinement, "APART", 0.5)
    other = computed_visibility(smooth)
    assert not len(other.middles) and other.refinement.whole[: len(smooth.parts[0].mesh.faces)].all()
    assert all((getattr(never, name) == getattr(other, name)).all() for name in ("whole", "halves", "fronts", "steps"))


def test_both_sides_of_a_sheet_have_them_and_it_stays_below_a_hundred_bytes(scene_of, monkeypatch):
    monkeypatch.setattr(edge_refinement, "APART", 0.02)
    folded = computed_visibility(scene_of(cloth(12)))
    middles = slice(folded.vertices, None)
    assert 0 < len(folded.middles) < 0.2 * folded.vertices and folded.bytes_a_vertex <= 100.0
    assert (folded.fronts[middles] >= 0).all() and (folded.backs[middles] >= 0).all()
    assert len(set(folded.fronts[middles]) | set(folded.backs[middles])) == 2 * len(folded.middles)


def test_however_far_apart_all_is_there_are_no_more_than_the_bar_allows(scene_of, monkeypatch):
    monkeypatch.setattr(edge_refinement, "APART", 0.0)
    most = computed_visibility(scene_of(speed_shape(2), sphere(1, 0.3).placed(translate=(0.0, 1.3, 0.0))))
    assert len(most.middles) == int(0.5 * (162 + 42)) and most.bytes_a_vertex <= 100.0
    assert len(np.unique(most.middles, axis=0)) == len(most.middles)


def test_they_are_kept_on_disk(found, scene, tmp_path, monkeypatch):
    """Read again, the triangles are cut as they were."""
    kept = cache.scene_visibility(scene, tmp_path)
    monkeypatch.setattr(cache, "computed_visibility", lambda *_: pytest.fail("computed again"))
    again = cache.scene_visibility(scene, tmp_path)
    asked = truth(scene, 200, 4)
    for one, other in zip(
        kept.located(asked.faces, asked.weights), again.located(asked.faces, asked.weights), strict=True
    ):
        assert (one == other).all()
    assert (again.middles == found.middles).all() and (again.whole == found.whole).all()
