"""Local PCA as it was published: what it keeps, how it is drawn, hard cases."""

import numpy as np
import pytest
from btf_samples import bumps
from metamer.materials.btf.clustered_form import ClusteredForm
from metamer.materials.btf.form import palette_of
from metamer.materials.btf.images import HeldImages
from metamer.materials.btf.paper_pca import paper_pca
from metamer.materials.btf.texels import BtfTexels
from metamer.materials.core.points import Points
from metamer.runtime.errors import InputError


@pytest.fixture(scope="module")
def bumpy():
    return bumps(views=4, lights=4)


def decoded(form):
    """All images again, (V,Lt,H,W,J)."""
    table, weights = form.table()[form.number], form.weights.astype(float)
    return (table[..., 0, :] + np.einsum("hwc,hwvlcj->hwvlj", weights, table[..., 1:, :])).transpose(2, 3, 0, 1, 4)


def relative(form, images):
    return np.sqrt(np.mean((decoded(form) - images.values) ** 2) / np.mean(images.values**2))


def with_values(images, values):
    return HeldImages(images.views, images.lights, values.astype(np.float32), images.basis)


def test_more_clusters_and_components_leave_less(bumpy):
    errors = [relative(paper_pca(bumpy, *size), bumpy) for size in ((1, 1), (4, 2), (8, 6))]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 0.02


def test_one_cluster_is_plain_least_squares(bumpy):
    """As near as the singular value decomposition of the centred values gets, but for the rounding to 8 bits."""
    rows = bumpy.values.transpose(2, 3, 0, 1, 4).reshape(bumpy.height * bumpy.width, -1).astype(float)
    mean = rows.mean(axis=0)
    left, squares, right = np.linalg.svd(rows - mean, full_matrices=False)
    best = mean + (left[:, :5] * squares[:5]) @ right[:5]
    expected = np.sqrt(np.mean((best - rows) ** 2) / np.mean(rows**2))
    assert expected <= relative(paper_pca(bumpy, 1, 5), bumpy) < 1.1 * expected + 0.003


def test_images_are_taken_as_they_were_measured(bumpy):
    """A surface that is displaced is not moved back."""
    displaced = HeldImages(bumpy.views, bumpy.lights, bumpy.values, bumpy.basis, offset=2.0)
    np.testing.assert_array_equal(paper_pca(displaced, 4, 2).brdfs, paper_pca(bumpy, 4, 2).brdfs)


def test_it_is_drawn_as_it_is_decoded(bumpy):
    """At the middle of a texel, from a measured view under a measured light."""
    form = paper_pca(bumpy, 4, 3)
    assert isinstance(form, ClusteredForm)
    wo, wi = bumpy.views.directions[[7, 12]], bumpy.lights.directions[[3, 9]]
    uv = np.array([[(5 + 0.5) / bumpy.width, 1.0 - (2 + 0.5) / bumpy.height]] * 2)
    found = BtfTexels(form, palette_of(form.basis)).terms(Points(wi, wo, uv)).value
    again = decoded(form)
    np.testing.assert_allclose(found, [again[7, 3, 2, 5], again[12, 9, 2, 5]], rtol=1e-3)


def test_numbers_are_of_8_bits(bumpy):
    kept = paper_pca(bumpy, 4, 3).stored()
    assert all(kept[name].dtype.itemsize == 1 for name in ("number", "weights", "brdfs"))
    assert np.abs(kept["brdfs"].astype(int)).max() == 127


def test_a_constant_texture_is_one_cluster_and_exact(bumpy):
    same = with_values(bumpy, np.broadcast_to(bumpy.values[:, :, :1, :1], bumpy.values.shape))
    form = paper_pca(same, 8, 2)
    assert len(form.brdfs) == 1
    np.testing.assert_allclose(decoded(form), same.values, atol=same.values.max() / 200)


@pytest.mark.parametrize("shape", [(1, 1), (3, 5)])
def test_a_few_texels(shape):
    few = bumps(*shape, views=3, lights=3)
    assert relative(paper_pca(few), few) < 0.02


def test_an_all_black_sample(bumpy):
    np.testing.assert_array_equal(decoded(paper_pca(with_values(bumpy, 0.0 * bumpy.values))), 0.0)


def test_a_seed_is_the_same_bits(bumpy):
    first, second = (paper_pca(bumpy, 4, 3, seed=5).stored() for _ in range(2))
    for name in first:
        np.testing.assert_array_equal(first[name], second[name])


def test_what_cannot_be_done_is_refused(bumpy):
    with pytest.raises(InputError, match="clusters"):
        paper_pca(bumpy, 300)
    values = bumpy.values.copy()
    values[5, 7, 2, 2, 1] = np.nan
    with pytest.raises(InputError, match="not finite"):
        paper_pca(with_values(bumpy, values))
