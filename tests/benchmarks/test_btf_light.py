"""`metamer bench btf`: light from all around, views left out, times, and coded BTFs."""

import json
from dataclasses import replace

import numpy as np
import pytest
from btf_samples import bumps, rings
from metamer.benchmarks.btf import environments, png_components, speed
from metamer.benchmarks.btf.held_out_views import HeldOut
from metamer.benchmarks.btf.png_components import CodedBtf
from metamer.benchmarks.btf.speed import form_times
from metamer.benchmarks.btf.under_light import Surround, gather_form
from metamer.benchmarks.papers.btf_fields import lafortune, ptm, rfp
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.materials.btf.form import SIZES, btf_form
from metamer.materials.btf.images import HeldImages
from metamer.materials.btf.light_basis import light_functions
from metamer.materials.btf.lobe_field import lobe_field
from metamer.runtime.errors import InputError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer


@pytest.fixture(scope="module")
def bumpy():
    return bumps(8, 8, views=5, lights=5)


@pytest.fixture(scope="module")
def lights(bumpy):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(environments, "TURNS", 3)
        patch.setattr(environments, "ROWS", 32)
        functions = light_functions(bumpy.lights)
        made = (environments.low_sun, environments.half_sky)
        yield [one for each in made for one in environments.tilted_lights(each(), bumpy.lights, functions)]


@pytest.fixture(scope="module")
def surround(bumpy, lights):
    return Surround.of(bumpy, lights, 2)


def test_a_matt_sample_under_even_light_is_as_bright_as_its_reflectance(bumpy):
    """Whichever way it is turned; what falls off below the lowest measured light is in the hats' sums."""
    even = EnvironmentLight(np.ones((1, 32, 64)), (illuminant("A"),))
    for light in environments.tilted_lights(even, bumpy.lights, light_functions(bumpy.lights)):
        matt = 0.5 / np.pi * bumpy.lights.directions[:, 2] @ light.hats
        y = (np.ones((1, 81)) * matt[0]) @ light.folding.weights(np.linspace(380.0, 780.0, 81))
        np.testing.assert_allclose(y[0], 0.5 * light.white, rtol=0.03)


def test_white_is_the_diffuser_where_most_light_arrives(lights):
    for some in (lights[:3], lights[3:]):
        lux = [one.functions[-9].sum() for one in some]
        np.testing.assert_allclose(some[0].folding.scale, np.pi / max(lux))
        np.testing.assert_allclose(some[0].white[1], 1.0, rtol=1e-3)


def test_light_itself_is_no_error_and_more_terms_leave_less(surround):
    assert surround.error(lambda light: light.hats) == (0.0, 0.0, 0.0)
    few, many = (surround.error(surround.balanced(terms)) for terms in (4, 20))
    assert many[0] < 0.5 * few[0]


def test_as_many_balanced_terms_as_harmonics_lose_less_under_a_sun(bumpy, lights):
    sun = Surround.of(bumpy, lights[:3], 1)
    assert sun.error(sun.balanced(25))[0] < sun.error(sun.harmonic())[0]
    assert sun.light == "1 environments x 3 turns"


@pytest.mark.slow
def test_what_renderers_gather_of_a_form_is_near_the_truth(bumpy, surround):
    texels = btf_form(bumpy, SIZES["fine"]).texels
    values = surround.decoded(texels)
    np.testing.assert_allclose(values.mean(), surround.values.mean(), rtol=0.01)
    alone = surround.error(lambda light: light.hats, values, texels.form.basis)
    whole = surround.error(gather_form(texels), values, texels.form.basis)
    assert 0.0 < alone[0] < whole[0] < 2.0


def test_held_views_are_those_of_every_fourth(bumpy):
    held = HeldOut.of(bumpy)
    assert held is not None
    # From the 6 + 12 + 18 + 20 views between 15 and 60 degrees.
    assert (len(held.judged.views), len(held.fitted.views)) == (14, 43)
    np.testing.assert_array_equal(held.judged.image(0, 3), bumpy.image(1, 3))
    (mean, _, p99), epsilon = held.error(held.fitted.image)
    assert 0.0 < mean < p99 and epsilon > 0.0


def test_views_that_change_evenly_are_predicted_exactly():
    """What is linear in the plane in which directions lie."""
    few = bumps(2, 2, views=6, lights=2)
    plane = 0.2 + 0.02 * few.views.corners[: len(few.views), 0]
    values = np.broadcast_to(plane[:, None, None, None, None], few.values.shape).astype(np.float32)
    held = HeldOut.of(replace(few, values=values))
    assert held is not None
    (_, _, p99), _ = held.error(held.fitted.image)
    assert p99 < 1e-3


def test_too_few_views_are_held_out_of_none():
    assert HeldOut.of(bumps(3, 3, views=1, lights=2)) is None


@pytest.mark.slow
def test_every_form_that_can_be_drawn_is_timed(bumpy, monkeypatch):
    monkeypatch.setattr(speed, "PIXELS", 16)
    monkeypatch.setattr(speed, "TURNS", 1)
    forms = [ptm(bumpy), rfp(bumpy), lafortune(bumpy), lobe_field(bumpy, 2), btf_form(bumpy, SIZES["small"]).texels]
    for form in forms:
        fold, pixels = form_times(form, 64, bumpy.views, bumpy.lights, bumpy.basis)
        assert fold is not None and pixels is not None and fold > 0.0 and pixels > 0.0


@pytest.mark.slow
def test_what_is_timed_is_what_is_drawn(bumpy):
    """All forms of nearly exact images give about the same colours: those of the images."""
    light = np.exp(8.0 * (bumpy.lights.directions @ [0.48, 0.36, 0.8] - 1.0)) * bumpy.lights.solid_angles
    to_xyz = bumpy.basis.fold(illuminant("D65"), observer("1931_2"))
    place, view, share = np.arange(64), np.full((64, 3), 7), np.tile([1.0, 0.0, 0.0], (64, 1)).astype(np.float32)
    truth = np.einsum("l,lhwj,kj->hwk", light, bumpy.values[7], to_xyz).reshape(64, 3)
    for form, off in ((rfp(bumpy), 0.15), (lobe_field(bumpy, 2), 0.05), (btf_form(bumpy, SIZES["fine"]).texels, 0.02)):
        fold = speed.fold_of(form, bumpy.lights, bumpy.basis)
        assert fold is not None
        assert np.abs(fold()(place, view, share) - truth).mean() < off * truth.mean()


def _written(folder, side=4, block=3, size=2):
    """A coded BTF of random numbers, and what they stand for."""
    from PIL import Image

    draw = np.random.default_rng(2)
    blocks = -(-81 // block)
    (folder / "meta.json").write_text(
        json.dumps({"imageSize": str(side), "numDirections": "81", "blockSize": str(block), "numComp": str(size)})
    )
    planes = draw.integers(100, 255, (size, blocks, side * side)).astype(np.uint8)
    images = draw.integers(128, 160, (blocks, 81 * block, 3, size)).astype(np.uint8)
    sigma = np.tile(np.array([[0, 9], [0, 4]], np.uint8), (blocks, 1, 1))
    for name, numbers in [*((str(k), plane) for k, plane in enumerate(planes)), ("R", None)]:
        flat = np.concatenate([images.ravel(), sigma.ravel()]) if numbers is None else numbers.ravel()
        padded = np.zeros(-(-len(flat) // 4) * 4, np.uint8)
        padded[: len(flat)] = flat
        Image.fromarray(padded.reshape(1, -1, 4)).save(folder / f"{name}.png")
    weights = np.array([0.9, 0.4])
    encoded = np.einsum("kbp,bfck,k->bfpc", planes / 127.5 - 1.0, images / 127.5 - 1.0, weights)
    encoded = np.maximum(encoded, 0.0).reshape(blocks * block, 81, side, side, 3)[:81]
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def test_a_coded_btf_is_read_as_it_was_written(tmp_path):
    linear = _written(tmp_path)
    read = CodedBtf.read(tmp_path)
    images = read.crop(4, 0.0)
    np.testing.assert_allclose(images.values, linear / np.pi, rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(images.views.directions, rings(), atol=1e-12)
    assert read.offset == 0.0


def test_a_crop_is_registered_from_beyond_its_edge(tmp_path):
    _written(tmp_path, side=8)
    read = CodedBtf.read(tmp_path)
    whole, middle = read.crop(8, 0.0), read.crop(2, 1.0)
    whole = HeldImages(whole.views, whole.lights, whole.values.astype(np.float32), whole.basis, offset=1.0)
    for view in (0, 5, 40):
        expected = whole.registered(view, 3)[3:5, 3:5]
        np.testing.assert_allclose(middle.values[view, 3], expected, rtol=3e-3, atol=1e-4)


def test_what_is_no_coded_btf_is_told(tmp_path):
    with pytest.raises(InputError, match=r"meta\.json"):
        CodedBtf.read(tmp_path)
    _written(tmp_path)
    with pytest.raises(InputError, match="--texels"):
        CodedBtf.read(tmp_path).crop(5, 0.0)
    (tmp_path / "1.png").write_bytes((tmp_path / "R.png").read_bytes()[:40])
    with pytest.raises(InputError, match=r"1\.png"):
        CodedBtf.read(tmp_path)


@pytest.mark.slow
def test_measured_surfaces_lie_where_they_are_known_to(shared_data):
    for name, offset in (("wool", 4.0), ("corduroy", 5.5)):
        assert abs(png_components.CodedBtf.read(shared_data / "btf" / name).offset - offset) < 0.5
