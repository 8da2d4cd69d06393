"""Reflectance fields as a fast form: what polynomials keep, hard cases, and what a file keeps of it."""

import numpy as np
import pytest
from btf_samples import bumps, of_degrees
from metamer.materials.btf.field_texels import FieldTexels
from metamer.materials.btf.form import FieldForm, palette_of
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import HeldImages
from metamer.materials.btf.polynomials import monomials, polynomials
from metamer.materials.core.points import Points
from metamer.runtime.errors import InputError


@pytest.fixture(scope="module")
def bumpy():
    return bumps()


def form_of(images):
    return FieldForm(FieldTexels(polynomials(images), palette_of(images.basis)))


def with_values(images, values):
    return HeldImages(images.views, images.lights, values.astype(np.float32), images.basis, offset=images.offset)


def of_polynomials(images, seed=0):
    """Images that are polynomials of the light, and these (V,H,W,6,J)."""
    draw = np.random.default_rng(seed)
    kept = draw.normal(scale=0.03, size=(len(images.views), images.height, images.width, 6, images.basis.size))
    values = np.einsum("lm,vhwmj->vlhwj", monomials(images.lights.directions), kept)
    return with_values(images, values), kept


def test_what_is_a_polynomial_is_kept_to_half_a_step(bumpy):
    images, kept = of_polynomials(bumpy)
    found = polynomials(images)
    decoded = found.codes * found.steps[:, None, None] + found.lowest[:, None, None]
    assert (np.abs(decoded - kept) <= 0.51 * found.steps[:, None, None] + 1e-6).all()
    assert found.bytes_per_texel == 6 * 3 * len(images.views)


def test_at_measured_directions_texels_are_what_the_field_says(bumpy):
    form = form_of(bumpy)
    field = form.texels.form
    texels = np.array([0, 17, 100])
    every = dict(zip(texels.tolist(), field.decoded(texels), strict=True))
    view, light = 7, 9
    image = field.reconstruct(view, light)
    for texel, values in every.items():
        row, column = divmod(texel, bumpy.width)
        uv = np.array([[(column + 0.5) / bumpy.width, 1.0 - (row + 0.5) / bumpy.height]])
        points = Points(bumpy.lights.directions[light, None], bumpy.views.directions[view, None], uv)
        np.testing.assert_allclose(form.texels.terms(points).value[0], image[row, column], atol=1e-9)
        np.testing.assert_allclose(values[view, light], image[row, column], atol=1e-12)


def test_views_are_mixed_linearly_and_light_is_not(bumpy):
    """Between two views of a ring their mean; between two lights what the polynomial has there."""
    form, field = form_of(bumpy), form_of(bumpy).texels.form
    uv = np.array([[0.5 / bumpy.width, 1.0 - 0.5 / bumpy.height]])
    light = of_degrees([(37.0, 41.0)])
    zero = np.zeros(1, dtype=int)
    expected = field.at(zero, zero, zero, light)
    found = form.texels.terms(Points(light, bumpy.views.directions[:1], uv)).value
    np.testing.assert_allclose(found, expected, atol=1e-12)
    one, other = 0, 1
    middle = of_degrees([(7.5, 0.0)])
    mean = 0.5 * (field.at(zero + one, zero, zero, light) + field.at(zero + other, zero, zero, light))
    np.testing.assert_allclose(form.texels.terms(Points(light, middle, uv)).value, mean, atol=1e-9)


def test_light_below_the_lowest_ring_is_held(bumpy):
    """f_r stays what it is at the lowest ring, so that values fall with the cosine, to 0 at the horizon."""
    form = form_of(bumpy)
    low, lower = of_degrees([(60.0, 35.0)]), of_degrees([(84.0, 35.0)])
    assert bumpy.lights.lowest == pytest.approx(0.5)
    uv, wo = np.array([[0.3, 0.3]]), of_degrees([(20.0, 10.0)])
    np.testing.assert_allclose(form.at(Points(low, wo, uv)), form.at(Points(lower, wo, uv)), rtol=1e-9)
    below = of_degrees([(95.0, 35.0)])
    assert not form.texels.terms(Points(below, wo, uv)).value.any()
    held, share = bumpy.lights.held(np.concatenate([low, lower, below]))
    np.testing.assert_allclose(held, np.repeat(low, 3, axis=0), atol=1e-12)
    np.testing.assert_allclose(share, [1.0, np.cos(np.radians(84.0)) / 0.5, 0.0], atol=1e-12)


def test_measured_lights_at_the_horizon_divide_by_nothing():
    lights = Hemisphere(of_degrees([(0.0, 0.0), (90.0, 0.0), (90.0, 120.0), (90.0, 240.0)]))
    held, share = lights.held(of_degrees([(90.0, 10.0), (89.9999, 50.0), (40.0, 0.0), (180.0, 0.0)]))
    assert np.isfinite(held).all() and np.isfinite(share).all() and share[2] == 1.0 and share[3] == 0.0


@pytest.mark.parametrize("shape", [(1, 1), (3, 5)])
def test_a_few_texels(shape):
    images, _ = of_polynomials(bumps(*shape, views=3, lights=4))
    found = polynomials(images)
    np.testing.assert_allclose(found.reconstruct(2, 3), images.image(2, 3), atol=0.003)


def test_a_single_light_is_kept_where_it_is():
    images = bumps(4, 4, views=4, lights=1)
    np.testing.assert_allclose(polynomials(images).reconstruct(5, 0), images.image(5, 0), atol=0.002)


def test_a_constant_texture_is_exact(bumpy):
    images, _ = of_polynomials(bumpy)
    same = with_values(images, np.broadcast_to(images.values[:, :, :1, :1], images.values.shape))
    np.testing.assert_allclose(polynomials(same).reconstruct(3, 4), same.image(3, 4), atol=1e-6)


def test_an_all_black_sample(bumpy):
    found = polynomials(with_values(bumpy, 0.0 * bumpy.values))
    np.testing.assert_array_equal(found.reconstruct(3, 4), 0.0)


def test_a_field_is_of_registered_images(bumpy):
    """Where it stands above the plane, views are moved back first."""
    above = HeldImages(bumpy.views, bumpy.lights, bumpy.values, bumpy.basis, offset=2.0)
    registered = np.stack(
        [[above.registered(v, lit) for lit in range(len(bumpy.lights))] for v in range(len(bumpy.views))]
    )
    np.testing.assert_array_equal(polynomials(above).codes, polynomials(with_values(bumpy, registered)).codes)


def test_numbers_that_are_none_are_refused(bumpy):
    values = bumpy.values.copy()
    values[5, 7, 2, 2, 1] = np.nan
    with pytest.raises(InputError, match="not finite"):
        polynomials(with_values(bumpy, values))


def test_what_a_file_keeps_draws_the_same(bumpy):
    form = form_of(bumpy)
    again = FieldForm.from_stored(form.stored(), form.error)
    draw = np.random.default_rng(0)
    wi, wo = (np.abs(draw.normal(size=(50, 3))) for _ in range(2))
    points = Points(
        *(side / np.linalg.norm(side, axis=1, keepdims=True) for side in (wi, wo)), draw.uniform(size=(50, 2))
    )
    np.testing.assert_array_equal(again.texels.terms(points).value, form.texels.terms(points).value)


def test_an_unknown_kind_of_field_is_refused(bumpy):
    kept = form_of(bumpy).stored() | {"kind": "splines"}
    with pytest.raises(InputError, match="kind"):
        FieldForm.from_stored(kept, None)


def test_another_palette_is_refused(bumpy):
    with pytest.raises(InputError, match="palette"):
        FieldTexels(polynomials(bumpy), palette_of(bumps(2, 2, views=1, lights=1).basis.truncated(2)))
