"""BTFs from afar: coarser texels are means of finer ones, and both renderers draw them."""

from dataclasses import replace

import numpy as np
import pytest
from btf_samples import bumps, sky
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.materials.btf.corners import by_cluster, level_count, levels_at
from metamer.materials.btf.form import BtfForm, palette_of
from metamer.materials.btf.local_pca import LocalPca, Size, local_pca
from metamer.materials.btf.metric import folding_of
from metamer.materials.btf.mip_levels import TexelLevel
from metamer.materials.btf.paper_pca import paper_pca
from metamer.materials.btf.texels import BtfTexels
from metamer.materials.core.points import Points
from metamer.materials.svbrdf.texels import between, levels_of
from metamer.spectral.difference import delta_e_xyz
from metamer.viewer.software.backend import software_session

FINE = Size(64, 4, 16, 0.1, 0.2)


@pytest.fixture(scope="module")
def images():
    return bumps(20, 27, views=4, lights=3)


@pytest.fixture(scope="module", params=["ours", "the paper's"])
def form(request, images):
    return local_pca(images, FINE) if request.param == "ours" else paper_pca(images, 4, 16)


@pytest.fixture(scope="module")
def texels(form):
    return BtfTexels(form, palette_of(form.basis))


def off(basis, truth, found):
    folding = folding_of(("D65",))
    to_xyz, white = np.pi * folding.coefficients(basis), folding.weights(basis.wavelengths_nm).sum(axis=0)
    return delta_e_xyz(truth @ to_xyz, found @ to_xyz, white)


def shown(level, view, light):
    """(H,W,J) of a level's texels."""
    table = level.table[level.number.ravel(), view, light]
    return np.einsum("tc,tcj->tj", level.weights, table).reshape(*level.number.shape, -1)


def test_every_level_shows_the_mean_of_the_images(images, texels):
    """As far off as the means of what the texels themselves show, and not much farther."""
    levels, pairs = texels.levels(True), [(0, 0), (5, 3), (20, 12), (32, 18)]
    assert [level.number.shape for level in levels] == [(20, 27), (10, 13), (5, 6), (2, 3), (1, 1)]
    truth = [levels_of(images.image(*pair)) for pair in pairs]
    own = [levels_of(shown(levels[0], *pair)) for pair in pairs]
    for number, level in enumerate(levels):
        found = [off(images.basis, one[number], shown(level, *pair)) for one, pair in zip(truth, pairs, strict=True)]
        least = [off(images.basis, one[number], mean[number]) for one, mean in zip(truth, own, strict=True)]
        assert np.mean(np.concatenate(found, axis=None)) < np.mean(np.concatenate(least, axis=None)) + 0.25
    # A single texel is in a cluster of its own: nothing is left.
    for one, pair in zip(own, pairs, strict=True):
        np.testing.assert_allclose(shown(levels[-1], *pair), one[-1], rtol=1e-4)


def looks(count, seed=0):
    draw = np.random.default_rng(seed)
    wi, wo = (np.abs(draw.normal(size=(count, 3))) + np.array([0.0, 0.0, 0.3]) for _ in range(2))
    wi, wo = (one / np.linalg.norm(one, axis=1, keepdims=True) for one in (wi, wo))
    return Points(wi, wo, draw.uniform(-1.0, 2.0, (count, 2)))


def spanning(points, wide):
    """Give points footprints of `wide` texels of 27 x 20 each way."""
    footprint = np.tile(np.diag([wide / 27, wide / 20]), (len(points), 1, 1))
    return replace(points, footprint=footprint, spans={})


def test_from_near_nothing_changes_and_nothing_is_worked_out(texels, monkeypatch):
    def refused(self):
        raise AssertionError("coarser texels are not needed")

    monkeypatch.setattr(type(texels.form), "coarser", refused)
    points = looks(300)
    np.testing.assert_array_equal(texels.terms(spanning(points, 0.9)).value, texels.terms(points).value)
    gathering = BtfForm(texels).environment_form()
    near, plain = (gathering.lobes(one) for one in (spanning(points, 0.9), points))
    np.testing.assert_array_equal(near.value, plain.value)
    np.testing.assert_array_equal(near.matt, plain.matt)


def test_from_afar_a_look_shows_the_mean_over_what_it_spans(texels):
    """Beside the sum over a fine grid of looks; one look at four texels is far off."""
    points, wide = looks(200), 6.0
    grid = (np.stack(np.meshgrid(np.arange(12), np.arange(12)), axis=-1).reshape(-1, 2) + 0.5) / 12 - 0.5
    truth = np.mean([texels.terms(replace(points, uv=points.uv + at * wide / (27, 20))).value for at in grid], axis=0)
    basis = texels.form.basis
    found = off(basis, truth, texels.terms(spanning(points, wide)).value)
    bare = off(basis, truth, texels.terms(points).value)
    assert found.mean() < 0.35 * bare.mean() and np.percentile(found, 95) < 0.35 * np.percentile(bare, 95)


def test_from_farther_than_the_texture_is_wide_there_is_one_colour(texels):
    points = looks(50)
    moved = replace(points, uv=points.uv + np.random.default_rng(3).uniform(size=(50, 2)))
    first, second = (texels.terms(spanning(one, 200.0)).value for one in (points, moved))
    np.testing.assert_allclose(first, second, rtol=1e-5)


@pytest.mark.parametrize("wide", [2.0, 2.9, 5.0, 16.0])
def test_nothing_jumps_where_the_texture_meets_itself(texels, wide):
    points, shift = looks(100), 1e-5
    for axis in range(2):
        uv = points.uv.copy()
        uv[:, axis] = np.rint(uv[:, axis])
        left, right = uv.copy(), uv.copy()
        left[:, axis] -= shift
        right[:, axis] += shift
        one, other = (texels.terms(spanning(replace(points, uv=at), wide)).value for at in (left, right))
        np.testing.assert_allclose(one, other, atol=2e-3 * np.abs(one).max())


def test_clusters_of_four_texels_are_each_looked_up_once(texels):
    """Beside every texel on its own."""
    level, uv = texels.whole, looks(500).uv
    rows, columns, shares = between(uv, *level.number.shape)
    truth, found = np.zeros((500, 3)), np.zeros((500, 3))
    for corner in range(4):
        place = rows[:, corner] * 27 + columns[:, corner]
        table = level.table[level.number.ravel()[place], 3, 4]
        truth += shares[:, corner, None] * np.einsum("nc,ncj->nj", level.weights[place], table)
    looked_up = 0
    for here, cluster, weights in by_cluster(level, uv):
        found[here] += np.einsum("nc,ncj->nj", weights, level.table[cluster, 3, 4])
        looked_up += len(here)
    np.testing.assert_allclose(found, truth, atol=1e-6 * np.abs(truth).max())
    alike = np.sort(level.number[rows, columns], axis=1)
    assert looked_up == 500 + np.count_nonzero(np.diff(alike, axis=1)), "each cluster once"


def test_what_counts_nothing_is_not_looked_up():
    """In the middle of a texel the other three count nothing."""
    level = TexelLevel(np.arange(4).reshape(2, 2), np.ones((4, 1), np.float32), np.ones((4, 1, 1, 1, 1), np.float32))
    ((here, cluster, weights),) = by_cluster(level, np.array([[0.25, 0.75]]))
    assert (here.tolist(), cluster.tolist(), weights.tolist()) == ([0], [0], [[1.0]])


def test_levels_are_the_same_bits_again(form):
    again = replace(form) if isinstance(form, LocalPca) else type(form).from_stored(form.stored(), form.basis)
    for one, other in zip(form.coarser(), again.coarser(), strict=True):
        assert one is not other
        np.testing.assert_array_equal(one.number, other.number)
        np.testing.assert_array_equal(one.weights, other.weights)
        np.testing.assert_array_equal(one.table, other.table)


@pytest.mark.parametrize("shape", [(1, 1), (1, 2), (3, 5)])
def test_textures_of_a_few_texels(shape):
    images = bumps(*shape, views=3, lights=3)
    form = local_pca(images, FINE)
    assert 1 + len(form.coarser()) == level_count(*shape)
    texels = BtfTexels(form, palette_of(form.basis))
    points = replace(looks(20), footprint=np.tile(np.eye(2), (20, 1, 1)), spans={})
    assert np.isfinite(texels.terms(points).value).all()


@pytest.mark.parametrize("made", [lambda images: local_pca(images, FINE), lambda images: paper_pca(images, 4, 2)])
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_textures_of_one_colour_or_none_are_the_same_from_afar(made, share):
    images = bumps(5, 6, views=3, lights=3)
    values = np.broadcast_to(share * images.values[:, :, :1, :1], images.values.shape)
    texels = BtfTexels(form := made(replace(images, values=values.astype(np.float32))), palette_of(images.basis))
    assert len(form.coarser()) == 2
    points = looks(30)
    near, far = (texels.terms(one).value for one in (points, spanning(points, 20.0)))
    np.testing.assert_allclose(far, near, rtol=1e-4, atol=1e-7)


def test_shares_of_levels_are_one_in_all():
    footprint = np.geomspace(1e-3, 40.0, 50)[:, None, None] * np.eye(2)
    total = np.zeros(50)
    for number, here, share in levels_at(footprint, (20, 27), 50):
        assert 0 <= number < level_count(20, 27)
        total[here] += share
    np.testing.assert_allclose(total, 1.0, atol=1e-12)


def ground(scenes, lights, repeats, samples=1):
    plane = shapes.plane(6.0, 6.0)
    plane = replace(plane, uv=repeats * plane.uv)
    camera = Camera(
        "c", (0.3, 2.0, 5.0), (0.0, 0.0, 0.0), vertical_fov_deg=50.0, width=40, height_px=30, samples=samples
    )
    return scenes.scene_of([(plane, "cloth")], lights, camera)


@pytest.mark.slow_cases("ours-sky", "the paper's-sky")
@pytest.mark.parametrize("lit", ["sun", "sky"])
def test_gl_and_numpy_agree_from_afar(scenes, drawn_by_both, form, texels, lit):
    scene = ground(scenes, [scenes.sun()] if lit == "sun" else [sky(1)], 6.0)
    both = drawn_by_both(scene, {"cloth": BtfForm(texels)}, "mipmapped")
    assert both.coverage.mean() > 0.3 and both.off.max() < 0.1


@pytest.mark.slow_cases("ours-sky", "the paper's-sky")
@pytest.mark.parametrize("lit", ["sun", "sky"])
def test_a_picture_from_afar_is_that_of_many_samples(scenes, texels, lit):
    lights = [scenes.sun()] if lit == "sun" else [sky(1)]
    surfaces, few = {"cloth": BtfForm(texels)}, ground(scenes, lights, 6.0)
    with software_session() as plain, software_session("mipmapped") as filtered:
        truth, covered = plain.render(ground(scenes, lights, 6.0, samples=6), None, surfaces)
        sparkling, smooth = (one.render(few, None, surfaces)[0] for one in (plain, filtered))
    inside = covered == 1.0
    white = few.adopted_white()
    found, bare = (
        delta_e_xyz(truth[inside].astype(float), one[inside].astype(float), white).mean() for one in (smooth, sparkling)
    )
    assert found < 0.5 * bare
