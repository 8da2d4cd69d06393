"""Maps from afar: bumps, roughness and colour averaged together, beside the mean of what every texel shows."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.core.directions import spherical
from metamer.materials.core.points import Points
from metamer.materials.svbrdf.facets import facets, turned_to
from metamer.materials.svbrdf.map_levels import WIDENED, facets_apart, normals_from_afar, spread_from_afar
from metamer.materials.svbrdf.maps import MappedSurface
from metamer.materials.svbrdf.texel_map import TexelMap
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from PIL import Image

SIDE, WIDE = 64, 8
FOLDING = Folding(observer("1931_2"), [illuminant("D65")], np.pi)


def bricks(**others):
    """Bricks and mortar with a grain: what roughness and colour are depends on where normals lean."""
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    height = np.minimum(1.0, 3.0 * np.abs(np.sin(np.pi * x / 16)) * np.abs(np.sin(np.pi * y / 8)))
    rng = np.random.default_rng(0)
    height = height + rng.normal(0.0, 0.06, height.shape)
    along, down = (0.5 * (np.roll(height, -1, axis) - np.roll(height, 1, axis)) for axis in (1, 0))
    normal = np.stack([-0.4 * along, 0.4 * down, np.ones_like(along)], axis=-1).astype(np.float32)
    mortar = np.clip(1.0 - height, 0, 1)[..., None]
    base = np.clip(mortar * (0.5, 0.5, 0.45) + (1 - mortar) * (0.4, 0.1, 0.05), 0, 1).astype(np.float32)
    rough = (0.55 + 0.4 * mortar).astype(np.float32)
    made = MappedSurface(
        WORKING_WAVELENGTHS_NM, TexelMap(base), TexelMap(rough), "mallett-yuksel", normal=TexelMap(normal)
    )
    return replace(made, **others)


def seen_over(form, wi, wo, uv, wide=WIDE):
    """XYZ of the mean of all texels, of the filtered form, and of a point alone."""
    steps = (np.arange(wide) + 0.5) / wide - 0.5
    truth = np.mean(
        [form.shaded_xyz(Points(wi, wo, uv + np.array([a, b]) * wide / SIDE), FOLDING) for a in steps for b in steps],
        axis=0,
    )
    footprint = np.tile(np.array([[wide / SIDE, 0.0], [0.0, -wide / SIDE]]), (len(uv), 1, 1))
    filtered = form.shaded_xyz(Points(wi, wo, uv, footprint, spans={}), FOLDING)
    white = FOLDING.observer.white(FOLDING.lights[0])
    point = form.shaded_xyz(Points(wi, wo, uv), FOLDING)
    return delta_e_xyz(truth, filtered, white), delta_e_xyz(truth, point, white)


def directions(count, seed=0):
    rng = np.random.default_rng(seed)
    theta, phi = np.arcsin(0.98 * np.sqrt(rng.uniform(size=(2, count)))), rng.uniform(0, 2 * np.pi, (2, count))
    return spherical(theta[0], phi[0]), spherical(theta[1], phi[1]), (rng.integers(0, 8, (count, 2)) * 8 + 4) / SIDE


def test_what_eight_by_eight_texels_show_together():
    filtered, point = seen_over(bricks().own_form(1e-3), *directions(600))
    assert filtered.mean() < 0.3 and np.percentile(filtered, 99) < 1.2
    assert filtered.mean() < 0.1 * point.mean()


def test_narrow_highlights_of_eight_by_eight_texels():
    """One highlight, as wide as normals differ, was off by 0.27 and 1.06."""
    filtered, _ = seen_over(bricks(roughness=TexelMap.constant(0.2**0.5)).own_form(1e-3), *directions(600))
    assert filtered.mean() < 0.25 and np.percentile(filtered, 99) < 1.0


def test_real_bricks_of_eight_by_eight_texels(shared_data):
    """One highlight was off by 0.22, and by 2.07 at the 99th percentile."""
    with Image.open(shared_data / "maps" / "brick" / "brick_normal.png") as picture:
        codes = np.asarray(picture.convert("RGB"))[:SIDE, :SIDE]
    normal = TexelMap(np.ascontiguousarray(codes), False, (2.0,), (-1.0,))
    base, rough = TexelMap.constant(0.05, 0.1, 0.3), TexelMap.constant(0.2**0.5)
    surface = MappedSurface(WORKING_WAVELENGTHS_NM, base, rough, "mallett-yuksel", normal=normal)
    filtered, _ = seen_over(surface.own_form(), *directions(600))
    assert filtered.mean() < 0.12 and np.percentile(filtered, 99) < 1.2


def test_normals_apart_on_one_axis_are_two_highlights():
    """Half of the normals lean one way and half the other: exactly what two highlights are."""
    slope, count = 0.2, 50
    wi, wo = (
        spherical(*np.random.default_rng(2).uniform(0.0, 1.0, (2, count))),
        spherical(np.full(count, 0.5), np.ones(count)),
    )
    spread, none = np.broadcast_to([0.04, 0.0, 0.04], (count, 3)), np.zeros((count, 3))
    differ = np.broadcast_to([WIDENED * slope**2, 0.0, 0.0], (count, 3))
    expected = 0.0
    for side in (-1.0, 1.0):
        normal = np.broadcast_to(np.array([side * slope, 0.0, 1.0]) / np.hypot(slope, 1.0), (count, 3))
        to_light, to_viewer = turned_to(normal, wi, wo)
        expected = expected + 0.5 * facets(to_light, to_viewer, spread) * to_light[:, 2]
    np.testing.assert_allclose(facets_apart(wi, wo, spread, differ), expected, rtol=1e-9)
    # Normals that do not differ are one.
    alone = facets(wi, wo, spread) * wi[:, 2]
    np.testing.assert_allclose(facets_apart(wi, wo, spread, none), alone, rtol=1e-12)


def test_a_mask_from_afar_is_what_it_leaves():
    rng = np.random.default_rng(4)
    mask = TexelMap((rng.uniform(size=(SIDE, SIDE, 1)) > 0.5).astype(np.uint8) * np.uint8(255))
    filtered, point = seen_over(bricks(coverage=mask, cutoff=0.5).own_form(1e-3), *directions(80), wide=16)
    assert filtered.mean() < 1.0 < 0.1 * point.mean()


def test_near_by_nothing_is_averaged():
    form = bricks().own_form(1e-3)
    wi, wo, uv = directions(200)
    footprint = np.tile(1e-5 * np.eye(2), (len(uv), 1, 1))
    near = form.shaded_xyz(Points(wi, wo, uv, footprint, spans={}), FOLDING)
    point = form.shaded_xyz(Points(wi, wo, uv), FOLDING)
    assert delta_e_xyz(point, near, FOLDING.observer.white(FOLDING.lights[0])).max() < 0.01


def test_normals_that_are_alike_make_nothing_wider():
    lean = np.broadcast_to([0.3, -0.2], (8, 8, 2))
    means, wider = normals_from_afar(lean)
    assert all(np.abs(level).max() < 1e-12 for level in wider)
    np.testing.assert_allclose(means[-1][0, 0], [0.3, -0.2, np.sqrt(1 - 0.13)])


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_the_mean_of_roughness_is_one_of_logarithms(turn):
    """Of equal matrices it is the matrix; of two multiples of one, their geometric mean."""
    cos, sin = np.cos(turn), np.sin(turn)
    matrix = np.array([0.1 * cos**2 + 0.01 * sin**2, 0.09 * cos * sin, 0.1 * sin**2 + 0.01 * cos**2])
    texels = np.stack([matrix, 4.0 * matrix]).reshape(1, 2, 3)
    np.testing.assert_allclose(spread_from_afar(texels)[-1][0, 0], 2.0 * matrix, rtol=1e-9, atol=1e-15)
