"""Choice of the fast form of a BTF: by name, by its budget, and by one measure for all."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from btf_samples import bumps
from metamer.cli.catalogue import import_ as catalogue_import
from metamer.materials.btf.form import NAMES, BtfForm, FieldForm, btf_form
from metamer.materials.btf.images import HeldImages
from metamer.materials.btf.metric import folding_of
from metamer.materials.btf.polynomials import monomials, polynomials
from metamer.materials.btf.texel_error import TexelSample, measured, worst_mean
from metamer.materials.core.points import Points
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formats.import_options import BtfFormName


@pytest.fixture(scope="module")
def bumpy():
    return bumps(views=3, lights=3)


@pytest.fixture(scope="module")
def noisy():
    """Each texel and view a polynomial of its own: full rank, so that no few components do, and a field is exact."""
    images = bumps(8, 8, views=3, lights=3)
    draw = np.random.default_rng(3)
    kept = 0.03 * draw.normal(size=(len(images.views), 8, 8, 6, 3)) + [[0], [0], [0], [0], [0], [0.15]]
    values = np.einsum("lm,vhwmj->vlhwj", monomials(images.lights.directions), kept).astype(np.float32)
    return HeldImages(images.views, images.lights, values, images.basis)


def test_the_stated_error_is_that_of_all_texels_where_there_are_few(bumpy):
    field = polynomials(bumpy)
    error = measured(bumpy, field, seed=3)
    folding = folding_of(("D65",))
    to_xyz, white = np.pi * folding.coefficients(bumpy.basis), folding.weights(bumpy.basis.wavelengths_nm).sum(axis=0)
    off = [
        delta_e_xyz(bumpy.image(view, light) @ to_xyz, field.reconstruct(view, light) @ to_xyz, white)
        for view in range(len(bumpy.views))
        for light in range(len(bumpy.lights))
    ]
    by_light = {row.light: row for row in error.lights}
    np.testing.assert_allclose(by_light["D65"].mean, np.mean(off), rtol=1e-4)
    np.testing.assert_allclose(by_light["D65"].maximum, np.max(off), rtol=1e-3)
    assert "192 texels" in error.protocol and error.p99 == max(row.p99 for row in error.lights)


@pytest.mark.slow
def test_a_form_of_the_sample_alone_is_judged_as_one_of_the_whole(bumpy):
    """Polynomials are found texel by texel: but for their steps, few texels tell what all would be."""
    sample = TexelSample.drawn(bumpy, 5)
    whole, alone = sample.error_of(polynomials(bumpy)), sample.alone().error_of(polynomials(sample.alone().images))
    assert whole.mean == pytest.approx(alone.mean, abs=0.05)


@pytest.mark.slow
def test_all_forms_are_judged_by_the_same_texels(bumpy):
    ours, fields = btf_form(bumpy, 0.5, name="lpca"), btf_form(bumpy, 0.5, name="rfp")
    assert isinstance(ours, BtfForm) and isinstance(fields, FieldForm)
    assert ours.error.protocol == fields.error.protocol
    sample = TexelSample.drawn(bumpy, 1)
    assert sample.error_of(ours.texels.form) == ours.error
    assert sample.error_of(fields.texels.form) == fields.error


@pytest.mark.slow
def test_a_field_is_taken_where_local_pca_is_far_off(noisy):
    """And within the budget, or near it, local PCA is."""
    found = btf_form(noisy, 0.4)
    assert isinstance(found, FieldForm)
    ours = btf_form(noisy, 0.4, name="lpca")
    assert isinstance(ours, BtfForm) and worst_mean(ours.error) > 2 * 0.4
    assert worst_mean(found.error) < 0.5 * worst_mean(ours.error)
    assert isinstance(btf_form(noisy, worst_mean(ours.error)), BtfForm)
    assert found.note.startswith("fast form rfp, chosen by its error: ΔE94")


@pytest.mark.slow
def test_local_pca_stays_where_it_is_better(bumpy):
    """However far it is from a budget that nothing is within."""
    found = btf_form(bumpy, 1e-6)
    assert isinstance(found, BtfForm) and not found.note


def test_a_name_is_taken_at_its_word(bumpy):
    """A field that is asked for needs no reason."""
    found = btf_form(bumpy, 0.5, name="rfp")
    assert isinstance(found, FieldForm) and not found.note


def test_names_are_the_same_wherever_they_are_asked_for():
    assert get_args(BtfFormName) == catalogue_import.BTF_FORMS == NAMES


@pytest.mark.slow_cases(
    "rfnl-4", "rfnl-2-separate", "rfnl-4-separate", "lpca-paper", "rfnl-1", "rfnl-1-separate", "lpca", "rfnl-2"
)
@pytest.mark.parametrize("name", NAMES)
def test_every_form_is_heard_of_from_0_to_1_kept_in_a_file_and_draws_the_same(bumpy, name):
    heard: list[float] = []
    found = btf_form(bumpy, 1.0, heard=heard.append, name=name)
    assert heard == sorted(heard) and 0.0 <= heard[0] < 0.2 and heard[-1] <= 1.0
    kept = found.stored()
    again = type(found).from_stored(kept, found.error)
    assert type(again.texels.form) is type(found.texels.form)
    draw = np.random.default_rng(0)
    wi, wo = (np.abs(draw.normal(size=(30, 3))) for _ in range(2))
    points = Points(
        *(side / np.linalg.norm(side, axis=1, keepdims=True) for side in (wi, wo)), draw.uniform(size=(30, 2))
    )
    np.testing.assert_allclose(again.texels.terms(points).value, found.texels.terms(points).value, rtol=1e-5)
    with pytest.raises(InputError, match="unknown kind"):
        type(found).from_stored(kept | {"kind": "wavelets"}, None)


def test_a_form_that_there_is_not_is_refused(bumpy):
    with pytest.raises(UnknownNameError, match="rfp"):
        btf_form(bumpy, 0.5, name="wavelets")


@pytest.mark.slow
def test_a_registered_set_is_judged_by_registered_images(bumpy):
    above = HeldImages(bumpy.views, bumpy.lights, bumpy.values, bumpy.basis, offset=1.5)
    error = btf_form(above, 0.5, name="rfp").error
    assert "registered by 1.5" in error.protocol
    flat = replace(above, offset=0.0)
    assert worst_mean(measured(flat, polynomials(above), 1)) > 1.2 * worst_mean(error)
