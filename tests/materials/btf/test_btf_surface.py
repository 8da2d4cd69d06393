"""A BTF as a surface: what was measured comes back, and what lies between is mixed."""

from dataclasses import replace

import numpy as np
import pytest
from btf_sets import NINE, UBO, held
from metamer.materials.btf import form
from metamer.materials.btf import surface as surface_module
from metamer.materials.btf.images import BtfImages, HeldImages, displacement
from metamer.materials.btf.surface import MeasuredBtf
from metamer.materials.core.points import Points
from metamer.materials.formats.btf_names import directions_of
from metamer.runtime.errors import InputError


def surface(images):
    return MeasuredBtf(images, images.values.mean(axis=(2, 3)).astype(np.float64))


def middles(height, width):
    """(u, v) of the middle of every texel, row by row from the top."""
    rows, columns = np.mgrid[:height, :width]
    return np.stack([(columns + 0.5) / width, 1.0 - (rows + 0.5) / height], axis=-1).reshape(-1, 2)


def points(wi, wo, uv):
    return Points(*(np.array(np.broadcast_to(each, (len(uv), 3)), dtype=float) for each in (wi, wo)), uv)


def test_in_measured_directions_and_the_middle_of_texels_it_is_what_was_measured():
    images = held()
    uv = middles(3, 5)
    for view, light in ((0, 0), (3, 6), (8, 1)):
        wi, wo = images.lights.directions[light], images.views.directions[view]
        found = surface(images).at(points(wi, wo, uv))
        expected = images.basis.reconstruct(images.values[view, light].reshape(-1, 3).astype(np.float64) / wi[2])
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-8)


def test_between_texels_it_is_linear_and_beyond_the_edge_it_goes_on_from_the_other():
    images = held()
    wi, wo = images.lights.directions[2], images.views.directions[1]
    texels = images.basis.reconstruct(images.values[1, 2].astype(np.float64) / wi[2])
    found = surface(images).at(points(wi, wo, np.array([[0.2, 0.5], [0.0, 0.5], [2.3, -0.5]])))
    np.testing.assert_allclose(found[0], (texels[1, 0] + texels[1, 1]) / 2, rtol=1e-5)
    np.testing.assert_allclose(found[1], (texels[1, 4] + texels[1, 0]) / 2, rtol=1e-5)
    np.testing.assert_allclose(found[2], texels[1, 1], rtol=1e-5)


def test_between_directions_three_views_and_three_lights_count():
    images = held()
    wi, wo = directions_of([(40, 20)]), directions_of([(20, 200)])
    index, share = images.lights.shares(wi, falling=True)
    at, part = images.views.shares(wo)
    value = sum(
        part[0, a] * share[0, b] * images.values[at[0, a], index[0, b], 0, 0] for a in range(3) for b in range(3)
    )
    found = surface(images).at(points(wi, wo, middles(3, 5)[:1]))
    np.testing.assert_allclose(found[0], images.basis.reconstruct(value / wi[0, 2]), rtol=1e-5)


@pytest.mark.parametrize("offset", [2.0, -1.5])
def test_registered_views_show_the_same_texel(offset):
    """A pattern is seen displaced by each view; registered, every view shows it in its place."""
    pattern = np.random.default_rng(2).uniform(0.1, 0.3, (24, 32, 3))
    images = held(size=(24, 32))
    values = np.empty_like(images.values)
    moved = displacement(images.views.directions, offset)
    for view in range(9):
        rows, columns = np.mgrid[:24, :32]
        whole = np.rint(moved[view]).astype(int)
        shown = pattern[(rows - whole[1]) % 24, (columns - whole[0]) % 32]
        values[view] = shown * images.lights.directions[:, None, None, 2:]
    # Directions at which displacements are whole texels.
    straight = np.flatnonzero(np.abs(moved - np.rint(moved)).max(axis=1) < 1e-9)
    images = replace(images, values=values, offset=offset)
    uv = middles(24, 32)
    for view in straight:
        found = surface(images).at(points(images.lights.directions[3], images.views.directions[view], uv))
        np.testing.assert_allclose(found, images.basis.reconstruct(pattern.reshape(-1, 3)), rtol=1e-5)
    assert len(straight)


def test_a_view_is_displaced_along_its_azimuth():
    """At 45 degrees, by h0: from the right, what stands high is seen farther left, and from above farther down."""
    moved = displacement(directions_of([(45, 0), (45, 90), (0, 0)]), 3.0)
    np.testing.assert_allclose(moved, [[-3, 0], [0, 3], [0, 0]], atol=1e-9)


def test_light_that_grazes_is_held_as_f_r():
    images = held()
    low, lower = (directions_of([(theta, 0)]) for theta in (75, 89.9))
    wo, uv = images.views.directions[0], middles(3, 5)
    one, other = (surface(images).at(points(wi, wo, uv)) for wi in (low, lower))
    np.testing.assert_allclose(one, other, rtol=1e-4)
    below = surface(images).at(points([[0.8, 0.0, -0.6]], wo, uv))
    assert not below.any()


@pytest.mark.parametrize("size", [(1, 1), (3, 5)])
def test_few_texels(size):
    images, uv = held(size=size), np.random.default_rng(7).random((7, 2))
    found = surface(images).at(points(images.lights.directions[4], images.views.directions[4], uv))
    assert np.isfinite(found).all() and (found > 0).all()
    if size == (1, 1):
        np.testing.assert_allclose(found, found[:1].repeat(7, axis=0), rtol=1e-12)


@pytest.mark.parametrize(("views", "lights"), [(NINE, [(30, 40)]), ([(0, 0)], NINE), ([(10, 10)], [(20, 20)])])
def test_a_single_light_or_a_single_view(views, lights):
    images = held(views, lights)
    rng = np.random.default_rng(4)
    wi, wo = (directions_of(rng.uniform((0, 0), (89, 360), (50, 2))) for _ in range(2))
    found = surface(images).at(Points(wi, wo, rng.random((50, 2))))
    assert np.isfinite(found).all() and (found > 0).all()


def test_a_ring_and_a_view_that_are_missing_are_bridged():
    views = [at for at in UBO if at[0] != 45 and at != (30, 60)]
    images = held(views, [(0, 0), (40, 0), (40, 120), (40, 240)], size=(1, 2))
    directions = directions_of([(45, 7), (30, 60), (52, 200)])
    found = surface(images).at(points(images.lights.directions[1], directions, np.full((3, 2), 0.25)))
    assert (found > 0).all()


class Counted(BtfImages):
    """Images that know which of them were asked for."""

    def __init__(self, images):
        self.images, self.asked = images, []
        for name in ("views", "lights", "height", "width", "basis", "offset"):
            setattr(self, name, getattr(images, name))

    def image(self, view, light):
        self.asked.append((view, light))
        return self.images.image(view, light)


def test_each_image_is_asked_for_once_a_call_however_many_points(monkeypatch):
    counted = Counted(held(size=(2, 2)))
    means = counted.images.values.mean(axis=(2, 3)).astype(np.float64)
    rng = np.random.default_rng(5)
    wi, wo = (directions_of(rng.uniform((0, 0), (89, 360), (3000, 2))) for _ in range(2))
    some = Points(wi, wo, rng.random((3000, 2)))
    whole = MeasuredBtf(counted, means).at(some)
    assert len(counted.asked) == len(set(counted.asked)) == 81
    # Whatever the pieces that they are looked up in, and to the last bit the same.
    pieces, texels = [], counted.texels
    counted.texels = lambda images, places: pieces.append(len(images)) or texels(images, places)
    counted.asked.clear()
    monkeypatch.setattr(surface_module, "_AT_ONCE", 500)
    np.testing.assert_array_equal(MeasuredBtf(counted, means).at(some), whole)
    assert len(counted.asked) == len(set(counted.asked)) == 81
    assert len(pieces) > 20


def test_the_average_is_the_mean_over_texels():
    images = held(size=(6, 6))
    mean = surface(images).average()
    rng = np.random.default_rng(6)
    wi, wo = (directions_of(rng.uniform((0, 0), (85, 360), (4, 2))) for _ in range(2))
    for one, other in zip(wi, wo, strict=True):
        texels = surface(images).at(points(one, other, middles(6, 6)))
        np.testing.assert_allclose(mean.eval(one, other), texels.mean(axis=0), rtol=1e-5)
    assert not mean.isotropic and mean.eval(wi[0], -wo[0]).max() == 0.0


def test_its_own_form_is_asked_with_its_images_and_the_budget(monkeypatch):
    asked = []
    monkeypatch.setattr(form, "btf_form", lambda images, budget: asked.append((images, budget)))
    images = held()
    surface(images).own_form(0.3)
    assert asked == [(images, 0.3)]


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="means do not fit"):
        MeasuredBtf(held(), np.zeros((9, 9, 2)))
    with pytest.raises(InputError, match="no files"):
        surface(held()).parameters()
    assert isinstance(held(), HeldImages)
