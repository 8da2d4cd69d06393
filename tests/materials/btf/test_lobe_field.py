"""Non-linear reflectance fields: more lobes say more, and hard cases are met."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from btf_sets import UBO, xml3d_btf
from metamer.benchmarks.papers.btf_fields import judged, rfp
from metamer.benchmarks.synthetic_btf.samples import woven
from metamer.materials.btf.decoding import uplifted_basis
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import HeldImages
from metamer.materials.btf.lobe_field import LobeField, lobe_field
from metamer.materials.formats.btf_names import directions_of
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.srgb import srgb_to_linear

ALL = Hemisphere(directions_of(UBO))
FEW = Hemisphere(ALL.directions[:28:4])
RGB = uplifted_basis()
# Mean, 95th and 99th percentile of ΔE94 under D65, with k = 2.
WANTED = {"wool": (4.7, 10.2, 15.0), "corduroy": (5.1, 11.5, 16.0)}


def held(values, views=FEW, lights=ALL, basis=RGB, offset=0.0):
    return HeldImages(views, lights, np.asarray(values, dtype=np.float32), basis, offset=offset)


def made_again(images, field):
    pairs = [[field.reconstruct(v, l) for l in range(len(images.lights))] for v in range(len(images.views))]
    return np.stack([np.stack(row) for row in pairs])


@pytest.fixture(scope="module")
def cloth():
    sample = replace(woven(2, 12, yarns=4, cells=3), samples=2, gathering=4)
    return sample.images(FEW, ALL, basis=SpectralBasis.peercy(sample.dyes.samples, np.ones((81, 1)), 4))


def test_more_lobes_say_more_of_cloth(cloth):
    fields = [lobe_field(cloth, lobes) for lobes in (1, 2, 4)]
    errors = [judged(cloth, field.reconstruct).mean for field in fields]
    assert all(a > b for a, b in pairwise(errors)), errors
    assert errors[1] < judged(cloth, rfp(cloth).reconstruct).mean


@pytest.mark.parametrize(("lobes", "shared", "each"), [(1, True, 9), (2, True, 14), (4, True, 25), (2, False, 24)])
def test_bytes_of_a_texel_and_view(lobes, shared, each):
    """Of three coefficients; what is kept is what is counted."""
    field = lobe_field(held(np.full((7, 81, 1, 2, 3), 0.2)), lobes, shared)
    assert field.bytes_per_texel == 7 * each
    assert (field.axes.dtype, field.exponents.dtype, field.amplitudes.dtype) == (np.uint8, np.uint8, np.int8)


def test_each_coefficient_has_lobes_of_its_own():
    """Red and green from opposite sides: one lobe does for both only where each has its own."""
    draw = np.random.default_rng(0)
    axes = np.array([[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], [0.0, 0.6, 0.8]])
    lobes = np.maximum(ALL.directions @ axes.T, 0.0) ** 8.0
    values = np.einsum("vhwj,lj->vlhwj", draw.uniform(0.1, 0.3, (7, 3, 5, 3)), lobes) + 0.05
    images = held(values)
    own, common = (made_again(images, lobe_field(images, 1, shared)) for shared in (False, True))
    assert np.abs(own - values).max() < 0.01 < 0.05 < np.abs(common - values).max()


def test_matt_white_is_exact():
    """rho cos(theta_i): a lobe along the normal, which codes hold exactly."""
    values = np.broadcast_to((ALL.directions[:, 2] * 0.25)[:, None, None, None], (7, 81, 3, 5, 3))
    for lobes in (1, 2, 4):
        np.testing.assert_allclose(made_again(held(values), lobe_field(held(values), lobes)), values, atol=2e-3)


def test_a_constant_texture_is_exact():
    values = np.full((7, 81, 3, 5, 3), 0.25)
    np.testing.assert_allclose(made_again(held(values), lobe_field(held(values), 2)), values, rtol=5e-5)


def test_a_texel_that_is_black_in_all_images(cloth):
    values = np.array(cloth.values)
    values[:, :, 1, 2] = 0.0
    again = lobe_field(replace(cloth, values=values, offset=0.0), 2)
    for view, light in ((0, 0), (6, 30)):
        made = again.reconstruct(view, light)
        assert np.isfinite(made).all() and (made[1, 2] == 0.0).all() and (made[0, 0] != 0.0).any()


def test_a_highlight_is_met_and_spoils_no_other_texel():
    values = np.full((7, 81, 1, 3, 3), 0.05)
    peak = np.maximum(ALL.directions @ ALL.directions[9], 0.0) ** 40
    values[:, :, 0, 1] += 20.0 * peak[:, None]
    made = made_again(held(values), lobe_field(held(values), 2))
    assert np.abs(made[:, 9, 0, 1] / values[:, 9, 0, 1] - 1.0).max() < 0.05
    np.testing.assert_allclose(made[:, :, 0, [0, 2]], 0.05, atol=0.01)


@pytest.mark.parametrize("shape", [(1, 1), (3, 5)])
def test_one_light_and_few_texels(shape):
    one = Hemisphere(ALL.directions[:1])
    values = np.random.default_rng(0).uniform(0.1, 0.3, (1, 1, *shape, 3))
    images = held(values, one, one)
    np.testing.assert_allclose(lobe_field(images, 2).reconstruct(0, 0), values[0, 0], rtol=0.02)


def test_images_are_registered():
    draw = np.random.default_rng(0)
    flat = draw.uniform(0.1, 0.3, (1, 1, 8, 8, 3)) * ALL.directions[:, 2, None, None, None]
    values = np.broadcast_to(flat, (7, 81, 8, 8, 3))
    images = held(values, offset=2.0)
    field = lobe_field(images, 1)
    np.testing.assert_allclose(field.reconstruct(5, 3), images.registered(5, 3), atol=4e-3)


def test_duplicate_texels_are_alike_and_bits_are_the_same_again(cloth):
    values = np.concatenate([cloth.values[:, :, :2], cloth.values[:, :, :2]], axis=2)
    images = replace(cloth, values=values)
    first, second = lobe_field(images, 2), lobe_field(images, 2)
    np.testing.assert_array_equal(first.amplitudes, second.amplitudes)
    np.testing.assert_array_equal(first.axes, second.axes)
    made = first.reconstruct(3, 40)
    np.testing.assert_allclose(made[:2], made[2:], atol=1e-3)


def test_it_is_stored_and_read_again(cloth):
    field = lobe_field(cloth, 2)
    again = LobeField.from_stored(field.stored(), cloth.basis)
    np.testing.assert_array_equal(field.reconstruct(2, 5), again.reconstruct(2, 5))
    assert again.bytes_per_texel == field.bytes_per_texel


def test_progress_is_heard(cloth):
    shares = []
    lobe_field(cloth, 1, heard=shares.append)
    assert len(shares) >= len(FEW) and shares == sorted(shares) and shares[-1] == 1.0


def test_what_is_refused(cloth):
    for lobes in (0, 9):
        with pytest.raises(InputError, match="number of lobes"):
            lobe_field(cloth, lobes)
    values = np.full((7, 81, 1, 1, 3), 0.2)
    values[4, 7] = np.nan
    with pytest.raises(InputError, match="view 4, light 7"):
        lobe_field(held(values), 1)


@pytest.mark.slow_cases("corduroy")
@pytest.mark.parametrize("name", sorted(WANTED))
def test_measured_cloths_are_met_with_two_lobes(shared_data, name):
    rows, columns = np.mgrid[96:108, 96:108]
    codes = xml3d_btf(shared_data / "btf", name).pixels((rows * 256 + columns).ravel())
    values = srgb_to_linear(np.maximum(codes, 0.0)).reshape(81, 81, 12, 12, 3) / np.pi
    images = held(values[::3], Hemisphere(ALL.directions[::3]))
    field = lobe_field(images, 2)
    assert field.bytes_per_texel * 3 <= 1134
    assert (np.array(judged(images, field.reconstruct)) < WANTED[name]).all()
