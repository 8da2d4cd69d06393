"""Sliders of materials: what there is to move, how far, and the material that comes of it."""

from dataclasses import fields

import numpy as np
import pytest
from metamer.materials.analytic import MODELS, AshikhminShirley, CookTorrance, Lambert, OrenNayar
from metamer.materials.analytic.glossmeter import gloss_of
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.brdf import Brdf
from metamer.materials.records.record_colour import colour_folding, radiance_factor_45_0
from metamer.materials.search.edited_material import VariedCatalogue, varied, varied_along
from metamer.materials.search.sliders import changed, slider, sliders
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

EVEN = np.ones(WORKING_WAVELENGTHS_NM.shape)


def flat(value):
    return Spectrum.sampled(WORKING_WAVELENGTHS_NM, value * EVEN)


COAT = AshikhminShirley(flat(0.4), flat(0.04), 25.0, 25.0)
METAL = CookTorrance(flat(0.0), 0.2 * EVEN, 3.5 * EVEN, 0.3, 1.0)


@pytest.fixture
def tiny(tiny_catalogue):
    return Catalogue.open(tiny_catalogue)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.NAME)
def test_every_number_of_every_model_has_a_slider_and_a_domain(model):
    """Whoever adds a model adds its sliders: a number without a domain would be checked by nobody."""
    numbers = {field.name for field in fields(model) if field.init and str(field.type) == "float"}
    assert numbers == set(model.domains())
    for example in model.examples(WORKING_WAVELENGTHS_NM):
        there = {one.name: one for one in sliders(example)}
        assert numbers <= set(there)
        for one in there.values():
            assert one.domain.holds(one.value) and one.shown[0] <= one.value <= one.shown[1]
            for value in (one.value, *one.shown):
                assert type(one.at(value)) is model


def test_a_slider_at_its_value_changes_nothing():
    for surface in (COAT, METAL):
        for one in sliders(surface):
            same = one.at(one.value).parameters()
            for name, value in surface.parameters().items():
                assert np.array_equal(same[name], value)


def test_a_metal_has_no_slider_of_a_black_body():
    assert [one.name for one in sliders(METAL)] == ["roughness", "specular_weight"]
    names = [one.name for one in sliders(COAT)]
    assert names == ["diffuse_scale", "specular_scale", "exponent_u", "exponent_v"]


def test_smoother_is_glossier_and_the_body_stays():
    there = slider(METAL, "roughness")
    assert there.logarithmic and there.shown == (0.002, 1.0)
    stops = [gloss_of(there.at(value), colour_folding(), 0.0).stops for value in there.steps(0.4, 0.05, 4)]
    assert np.all(np.diff(stops) > 0.5)


def test_a_scale_multiplies_the_reflectance_and_ends_where_it_would_be_more_than_all():
    there = slider(Lambert(flat(0.3)), "reflectance_scale")
    assert there.value == 1.0 and there.shown[1] == pytest.approx(1 / 0.3)
    half, whole = (radiance_factor_45_0(there.at(value)) for value in (0.5, there.shown[1]))
    np.testing.assert_allclose(half, 0.15 * EVEN, rtol=1e-12)
    np.testing.assert_allclose(whole, EVEN, rtol=1e-12)
    assert whole.max() * np.pi <= np.pi * (1 + 1e-15)


@pytest.mark.parametrize(
    ("surface", "name", "value", "expected"),
    [
        (METAL, "roughness", 0.0, "> 0 and <= 1"),
        (METAL, "roughness", 1.001, "> 0 and <= 1"),
        (METAL, "roughness", float("nan"), "> 0 and <= 1"),
        (METAL, "specular_weight", -0.1, ">= 0 and <= 1"),
        (COAT, "exponent_u", float("inf"), "> 0"),
        (COAT, "diffuse_scale", 2.6, ">= 0 and <= 2.5"),
        (OrenNayar(flat(0.5), 0.3), "sigma", 2.0, ">= 0 and <= 1.5708 radians"),
    ],
)
def test_a_parameter_out_of_bounds_is_refused_and_never_brought_back(surface, name, value, expected):
    there = slider(surface, name)
    for refused in (lambda: there.at(value), lambda: there.steps(there.value, value, 3)):
        with pytest.raises(InputError, match=f"{name}: out of its domain") as raised:
            refused()
        assert raised.value.expected == f"a number {expected}"


def test_steps_of_what_begins_above_nought_are_ratios():
    assert slider(METAL, "roughness").steps(0.1, 0.4, 3) == pytest.approx((0.1, 0.2, 0.4))
    assert slider(METAL, "specular_weight").steps(0, 1, 3) == pytest.approx((0.0, 0.5, 1.0))


def test_an_unknown_parameter_is_said_with_those_that_there_are():
    with pytest.raises(UnknownNameError) as raised:
        changed(METAL, {"roughnes": 0.1}, "metal/silver")
    assert "metal/silver" in str(raised.value) and "nearest: roughness" in str(raised.value)


def test_a_table_has_no_parameters_but_neighbours():
    class Table(Brdf):
        NAME = "merl"

        def eval(self, wi, wo):
            return 0.0

    with pytest.raises(InputError, match=r"found: merl: measured(.|\n)*catalogue like metal/x"):
        sliders(Table(), "metal/x")


def test_a_varied_material_is_one_like_any_other(tiny):
    """It has a fast form with a measured error, and says in its id and its notes what was changed."""
    before = tiny["tiny/satin-green"]
    after = varied(before, {"exponent_u": 100, "exponent_v": 100, "diffuse_scale": 0.5})
    assert after.id == "tiny/satin-green with exponent_u 100, exponent_v 100, diffuse_scale 0.5"
    assert after.provenance.notes.endswith("changed: exponent_u 100, exponent_v 100, diffuse_scale 0.5")
    assert after.provenance.kind == before.provenance.kind
    assert after.surface().exponent_u == 100.0 and before.surface().exponent_u == 25.0
    assert after.error is not None and after.error.p99 <= 1.0
    assert after.lab()[0] < before.lab()[0] - 10.0


def test_a_catalogue_with_more_has_all_that_it_had(tiny):
    made = varied(tiny["tiny/matt-red"], {"reflectance_scale": 0.5})
    more = VariedCatalogue.of(tiny, [made])
    assert more.surface(made.id) is made
    assert more["tiny/copper"].id == "tiny/copper" and len(more) == len(tiny)
    other = varied(tiny["tiny/matt-red"], {"reflectance_scale": 0.25})
    assert set(VariedCatalogue.of(more, [other]).made) == {made.id, other.id}
    with pytest.raises(UnknownNameError):
        tiny.surface(made.id)


def test_nothing_changed_is_no_other_material(tiny):
    with pytest.raises(InputError, match="nothing is changed"):
        varied(tiny["tiny/copper"], {})


@pytest.mark.slow
def test_steps_fitted_by_processes_are_those_of_this_one(tiny):
    ranges = {"reflectance_scale": (1.0, 0.5)}
    here, there = (list(varied_along(tiny["tiny/matt-red"], ranges, 2, jobs=jobs)) for jobs in (1, 2))
    assert [one.id for one in here] == [one.id for one in there]
    for one, other in zip(here, there, strict=True):
        assert one.error == other.error
        assert np.array_equal(one.fast.packs[0].palette.samples, other.fast.packs[0].palette.samples)
