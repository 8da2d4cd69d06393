"""Large scenes: fewer sites are traced than there are, and what they say is as good."""

import numpy as np
import pytest
import visibility_truth as measure
from metamer.lighting.mesh.shapes import plane, speed_shape, sphere
from metamer.lighting.visibility import adaptive_sampling, precompute
from metamer.lighting.visibility.adaptive_sampling import Surroundings, thinned
from metamer.lighting.visibility.precompute import computed_visibility


def traced_sites(monkeypatch, scene):
    """The visibility, and the places of all sites that were traced, scaled."""
    places, whole = [], precompute.traced
    with monkeypatch.context() as patched:
        patched.setattr(precompute, "traced", lambda s, n, o: places.append(s) or whole(s, n, o))
        found = computed_visibility(scene)
    return found, np.concatenate(places)


@pytest.fixture(scope="module")
def scene(scene_of):
    """2,600 vertices, most of them where little changes."""
    return scene_of(speed_shape(4), sphere(1, 0.3).placed(translate=(0.0, 1.2, 0.0)))


@pytest.mark.slow
def test_few_sites_are_as_good_as_all(scene, monkeypatch):
    whole, places = traced_sites(monkeypatch, scene)
    assert len(places) == len(whole.whole)
    monkeypatch.setattr(adaptive_sampling, "WHOLE", 100)
    few, places = traced_sites(monkeypatch, scene)
    assert len(places) < 0.7 * len(few.whole)
    assert few.vertices == whole.vertices and few.bytes_a_vertex <= 100.0
    known = measure.truth(scene, 800, 48)
    wrong, exact = measure.misclassified(few, known), measure.misclassified(whole, known)
    assert wrong < exact + 0.001


def test_small_scenes_are_traced_whole(scene_of, monkeypatch):
    monkeypatch.setattr(adaptive_sampling, "thinned", lambda *_: pytest.fail("thinned"))
    assert computed_visibility(scene_of(speed_shape(2))).vertices < adaptive_sampling.WHOLE


def test_what_stands_close_by_is_seen_however_small(scene_of, monkeypatch):
    """A pin on a floor whose sites see nothing of it from where the first of them are."""
    pin = sphere(2).placed(scale=(0.004, 0.05, 0.004), translate=(0.31, 0.04, 0.17))
    floor = scene_of(plane(2.0, 2.0), pin)
    monkeypatch.setattr(adaptive_sampling, "WHOLE", 100)
    monkeypatch.setattr("metamer.lighting.visibility.refinement.MOST_VERTICES", 4096)
    monkeypatch.setattr(precompute, "_TRAINING", 64)
    monkeypatch.setattr(precompute, "_FEW", 64)
    found, places = traced_sites(monkeypatch, floor)
    radius = 0.5 * np.linalg.norm(np.subtract(*floor.bounds[::-1]))
    off = np.linalg.norm((places * radius + np.mean(floor.bounds, axis=0))[:, [0, 2]] - [0.31, 0.17], axis=1)
    above = (len(found.whole) - 162) / 2
    near = ((off < 0.1) & (off > 0.01)).sum()
    assert near > 0.9 * above * np.pi * 0.1**2 / 4.0 and len(places) < 0.5 * len(found.whole)


def test_nothing_is_taken_for_nothing_before_all_sites_say_so(scene_of, monkeypatch):
    """Sheets side by side, of which none hides another: every site is asked."""
    monkeypatch.setattr(adaptive_sampling, "WHOLE", 100)
    beside = scene_of(plane(1.0, 1.0), plane(1.0, 1.0).placed(translate=(2.0, 0.0, 0.0)))
    asked, whole = [], precompute.traced
    monkeypatch.setattr(precompute, "traced", lambda s, n, o: asked.extend(s) or whole(s, n, o))
    assert computed_visibility(beside) is None
    assert len(np.unique(np.round(asked, 12), axis=0)) == len(asked) > 300


def test_what_changes_evenly_is_foretold_and_what_jumps_is_traced():
    """On a plane: values linear in the place, and beyond a line others."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-0.7, 0.7, 80), np.linspace(-0.7, 0.7, 80)))
    around = Surroundings(np.column_stack([x, 0.0 * x, y]), np.tile([0.0, 1.0, 0.0], (len(x), 1)))
    true = np.column_stack([32.0 * (0.2 * x + 0.1 * y), np.where(x > 0.2, 32.0, 0.0)])
    codes, asked = np.full(true.shape, np.nan, dtype=np.float32), []

    def trace(which):
        codes[which] = true[which]
        asked.extend(which.tolist())

    known = np.arange(0, len(x), 97)
    codes[known] = true[known]
    traced = thinned(around, codes, known, trace, np.zeros(len(x), dtype=bool))
    assert sorted([*asked, *known]) == traced.tolist() and len(traced) < 0.45 * len(x)
    off = np.abs(codes - true) / 32.0
    assert off[:, 0].max() < 0.01 and (off[:, 1] > 0.3).mean() < 0.01
    close = np.abs(x - 0.2) < 0.02
    assert np.isin(np.flatnonzero(close), traced).mean() > 0.9


@pytest.mark.parametrize(("apart", "share"), [(0.02, 1.0), (0.1, 0.65), (0.2, 0.65)])
def test_a_dark_shell_close_behind_a_surface_says_nothing_of_it(apart, share):
    """The surface changes nowhere, and few of its sites are known; the shell's normals are the same. Where it
    is nearer than sites are to each other, all are asked.
    """
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-0.7, 0.7, 40), np.linspace(-0.7, 0.7, 40)))
    count = len(x)
    places = np.concatenate([np.column_stack([x, 0.0 * x, y]), np.column_stack([x, 0.0 * x + apart, y])])
    around = Surroundings(places, np.tile([0.0, 1.0, 0.0], (2 * count, 1)))
    surface = np.arange(2 * count) >= count
    codes, dark = np.full((2 * count, 4), np.nan, dtype=np.float32), np.zeros(2 * count, dtype=bool)

    def trace(which):
        codes[which], dark[which] = np.where(surface[which, None], 16.0, -16.0), ~surface[which]

    known = np.concatenate([np.arange(0, count, 3), np.arange(count, 2 * count, 97)])
    trace(known)
    traced = thinned(around, codes, known, trace, dark)
    np.testing.assert_allclose(codes[surface], 16.0, atol=1.0)
    np.testing.assert_allclose(codes[~surface], -16.0, atol=1.0)
    assert len(traced) <= share * len(codes)


@pytest.mark.parametrize("order", [1, -1])
def test_sites_that_cells_keep_apart_are_not_sorted_into_finer_ones_again(order):
    rng = np.random.default_rng(2)
    around = Surroundings(rng.uniform(-1.0, 1.0, (300, 3)), rng.normal(size=(300, 3)))
    for width in (0.3 * 0.5 ** np.arange(-2, 8))[::order]:
        cells = np.floor(around.both / width)
        first = np.sort(np.unique(cells, axis=0, return_index=True)[1])
        np.testing.assert_array_equal(around.one_a_cell(width), first)
    assert len(around.one_a_cell(1.2)) < 300 and len(around.one_a_cell(0.3 * 0.5**7)) == 300
