"""Made-up samples: what a plane sends back is known, and the rest has to keep to physics."""

from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from metamer.benchmarks.synthetic_btf.dyes import DYES, dyed, together
from metamer.benchmarks.synthetic_btf.rays import PeriodicRays
from metamer.benchmarks.synthetic_btf.relief import Relief
from metamer.benchmarks.synthetic_btf.samples import corduroy, flat, leather, woven
from metamer.benchmarks.synthetic_btf.synthetic import SyntheticBtf
from metamer.benchmarks.synthetic_btf.transport import MATT, CoatGloss
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum


def of_degrees(*degrees):
    theta, phi = np.radians(np.asarray(degrees, dtype=float)).T
    return Hemisphere(np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1))


FEW = of_degrees((0, 0), (30, 40), (60, 130), (75, 250))
TWO = of_degrees((20, 10), (50, 200))


def greys(*values):
    return Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.outer(values, np.ones(81)))


def some(kind=woven, seed=3, **more):
    sample = kind(seed, 16, cells=3, **({"yarns": 4} if kind is woven else {}))
    return replace(sample, **({"samples": 2, "gathering": 4} | more))


def test_a_flat_field_is_exactly_lambert():
    dyes = together(dyed("madder", [1.0]), dyed("indigo", [0.5, 1.0]))
    sample = flat(5, dyes, depth=2.0, cells=2)
    values = sample.images(FEW, FEW).values
    steep = FEW.directions[:, 2]
    # Seen from straight above nothing is displaced.
    dye = sample.relief.dye[::2, ::2]
    expected = dyes.samples[dye] / np.pi * steep[:, None, None, None]
    np.testing.assert_allclose(values[0], expected, rtol=1e-6)
    mean = values[1:].mean(axis=(2, 3)) / steep[:, None]
    assert (mean.max(axis=1) / mean.min(axis=1) - 1.0).max() < 1e-5, "f_r of a flat field knows no light"


@pytest.mark.parametrize("texels", [1, 2])
def test_a_single_texel(texels):
    sample = flat(texels, greys(0.4))
    values = sample.images(FEW, FEW).values
    assert values.shape == (4, 4, texels, texels, 81)
    np.testing.assert_allclose(
        values, np.broadcast_to((0.4 / np.pi * FEW.directions[:, 2])[:, None, None, None], values.shape), rtol=1e-6
    )
    bumps = np.array([[0.0, 1.0], [2.0, 0.3]])
    rough = SyntheticBtf(Relief(bumps, np.zeros((2, 2), dtype=np.int64), (1, 1)), greys(0.8))
    images = rough.images(FEW, FEW).values
    assert np.isfinite(images).all() and (images >= 0.0).all() and images.max() > 0.0


def test_a_field_below_the_plane_is_displaced_as_the_offset_says():
    """At 45 degrees and three texels down, an image is the one from above, three columns or rows further on."""
    sample = flat(8, dyed("indigo", np.linspace(0, 3, 9)), depth=3.0)
    views = of_degrees((0, 0), (45, 0), (45, 90), (45, 180), (45, 270))
    images = sample.images(views, FEW)
    assert images.offset == -3.0
    above = images.image(0, 1)
    for view, (columns, rows) in enumerate(((3, 0), (0, -3), (-3, 0), (0, 3)), start=1):
        np.testing.assert_allclose(images.image(view, 1), np.roll(above, (rows, columns), axis=(0, 1)), rtol=1e-5)


@pytest.mark.parametrize("kind", [woven, corduroy, leather])
def test_the_offset_is_what_a_sweep_finds(kind):
    """Views of even light, moved back by h tan(theta), fit each other best near the stated h."""
    sample = replace(
        kind(5, 24, cells=3), samples=2, gathering=0, plane=kind(5, 24, cells=3).relief.heights.max() + 3.0
    )
    views = of_degrees(*[(45, phi) for phi in range(0, 360, 90)], (0, 0))
    lights = of_degrees((0, 0), *[(50, phi) for phi in range(0, 360, 60)])
    sampled = SpectralBasis.sampled(sample.dyes.wavelengths_nm)
    one = SpectralBasis("sampled", sampled.wavelengths_nm, sampled.analysis[:, 40:41], sampled.synthesis[:, 40:41])
    images = sample.images(views, lights, basis=one)
    light = images.values.mean(axis=1)[..., 0]
    light = light / light.mean(axis=(1, 2), keepdims=True) - 1.0
    steps = np.arange(0, 12)
    moves = [(1, 1), (0, -1), (1, -1), (0, 1)]
    off = []
    for h in steps:
        moved = [np.roll(light[v], -h * sign, axis=axis) for v, (axis, sign) in enumerate(moves)]
        off.append(np.mean([(one * light[4]).mean() for one in moved]))
    assert abs(steps[np.argmax(off)] + images.offset) < 1.6, (off, images.offset)


def test_direct_light_is_reciprocal():
    """Over a whole tile f_r is the same both ways, shadows and what is hidden included."""
    sample = replace(woven(3, 24, yarns=4, cells=8, gloss=CoatGloss(0.1, 8.0)), gathering=0, samples=8)
    mean = sample.images(FEW, FEW).values.mean(axis=(2, 3)).astype(np.float64)
    f_r = mean / FEW.directions[:, 2][:, None]
    off = np.abs(f_r - f_r.swapaxes(0, 1)).max(axis=2) / f_r.mean(axis=2)
    assert off.max() < 0.02, off


def test_no_energy_is_made():
    """White cloth under even light from above sends back at most what it gets; without bounces less."""
    directions = of_degrees(*product((8, 25, 42, 58, 74), range(0, 360, 45)))
    sample = some(dyes=greys(*[1.0] * 24), gloss=MATT)
    weight = np.sin(np.arccos(directions.directions[:, 2]))
    weight = np.pi * weight * directions.directions[:, 2] / (weight * directions.directions[:, 2]).sum()
    once, more = (
        np.einsum("v,vlhw->lhw", weight, replace(sample, gathering=rays).images(directions, TWO).values[..., 40]).mean(
            (1, 2)
        )
        for rays in (0, 4)
    )
    incoming = TWO.directions[:, 2]
    assert (once < more).all() and (more < 1.03 * incoming).all(), (once, more, incoming)


@pytest.mark.slow
def test_the_bounce_converges_with_rays():
    errors = []
    best = some(gathering=32).transport(TWO, TWO).gathered(0, 24).sum(axis=1)
    for rays in (2, 4, 8):
        found = some(gathering=rays).transport(TWO, TWO).gathered(0, 24).sum(axis=1)
        errors.append(np.sqrt(np.mean((found - best) ** 2)))
        assert abs(found.mean() / best.mean() - 1.0) < 0.03
    assert all(a > 1.6 * b for a, b in pairwise(errors)), errors


@pytest.mark.parametrize("kind", [woven, corduroy, leather])
def test_it_tiles(kind):
    """Cut elsewhere, the same surface has the same light, and rays meet the same facets: there is no seam."""
    sample = some(kind, gathering=0)
    cells, side = sample.relief.cells, len(sample.relief.heights)
    moved = sample.relief.shifted(5, 9)
    random = np.random.default_rng(2)
    starts = np.concatenate([random.random((4000, 2)) * [16, -16], np.full((4000, 1), 12.0)], axis=1)
    to = random.normal(size=(4000, 3))
    to[:, 2] = -np.abs(to[:, 2]) - 0.05
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    before = PeriodicRays(sample.relief).first(starts, to)
    after = PeriodicRays(moved).first(starts + np.array([9.0, -5.0, 0.0]), to)
    row, column, half = np.unravel_index(before, (side, side, 2))
    expected = np.ravel_multi_index(((row + 5 * cells) % side, (column + 9 * cells) % side, half), (side, side, 2))
    # A ray that passes an edge within float32 may go either way.
    assert (before >= 0).all() and (after != expected).mean() < 1e-3
    a, b = (replace(sample, relief=each).transport(FEW, FEW).direct for each in (sample.relief, moved))
    a = np.roll(a.reshape(side, side, 2, 4), (5 * cells, 9 * cells), axis=(0, 1))
    assert (np.abs(a - b.reshape(a.shape)) > 1e-5).mean() < 2e-3


def test_a_ray_goes_on_over_many_tiles():
    """A wall stands in one place of a long tile: rays just above the ground meet it wherever they start."""
    heights = np.zeros((2, 40))
    heights[:, 7] = 1.0
    relief = Relief(heights, np.zeros((2, 40), dtype=np.int64), (2, 40))
    angles = np.radians([3.0, 77.0, 183.0, 260.0])
    to = np.stack([0.02 * np.cos(angles), np.sin(angles), np.full(4, 1e-4)], axis=1)
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    starts = np.tile([20.0, -1.0, 0.01], (4, 1))
    assert np.abs(12.0 / to[:, 0]).max() > 3000.0
    assert not PeriodicRays(relief).free(starts, to).any()
    assert PeriodicRays(relief).free(starts, np.tile([0.6, 0.0, 0.8], (4, 1))).all()


@pytest.mark.slow
def test_the_bounce_tiles():
    sample = some(gathering=16)
    moved = replace(sample, relief=sample.relief.shifted(5, 9))
    a, b = (each.transport(TWO, TWO).coefficients(0, 24)[1].sum(axis=(3, 4)) for each in (sample, moved))
    assert np.abs(np.roll(a, (5, 9), axis=(1, 2)) - b).mean() < 0.05 * b.mean()


def test_coefficients_are_the_images_at_every_wavelength():
    """Also with other dyes, without a ray."""
    sample = some(gloss=CoatGloss(0.2, 20.0))
    transport = sample.transport(FEW, TWO)
    for dyes in (sample.dyes, together(dyed("weld", np.ones(12)), dyed("cochineal", np.linspace(0.1, 2, 12)))):
        images = sample.dyed(dyes).images(FEW, TWO, transport=transport).values
        once, twice = transport.coefficients(1, 24)
        rho = dyes.samples
        expected = once @ rho + np.einsum("vhwpq,pl,ql->vhwl", twice, rho, rho, optimize=True)
        expected += transport.lobe(1, sample.gloss)[..., None]
        np.testing.assert_allclose(images[:, 1], expected, rtol=2e-5, atol=1e-7)


def test_a_reduced_basis_is_the_sampled_one_projected():
    """Products are made at wavelengths: projecting afterwards is the same."""
    sample = some()
    full = sample.images(TWO, TWO)
    basis = SpectralBasis.peercy(sample.dyes.samples, np.ones((81, 1)), 5)
    reduced = sample.images(TWO, TWO, basis=basis)
    np.testing.assert_allclose(reduced.values, basis.project(full.values.astype(float)), atol=2e-6)
    assert reduced.values.dtype == np.float32 and reduced.basis is basis


@pytest.mark.parametrize("kind", [woven, corduroy, leather])
def test_the_same_seed_gives_the_same_bits(kind):
    a, b = some(kind).images(TWO, TWO).values, some(kind).images(TWO, TWO).values
    assert np.array_equal(a, b)
    other = some(kind, seed=4)
    assert not np.array_equal(a, other.images(TWO, TWO).values)


def test_a_plain_weave_and_colours_of_ones_own():
    sample = woven(1, 8, yarns=2, weave="plain", warp=greys(0.2), weft=greys(0.6), cells=3)
    assert set(np.unique(sample.relief.dye)) == {0, 1}
    assert np.isfinite(sample.images(TWO, TWO).values).all()


def test_progress_is_told_to_the_end():
    told = []
    some().images(TWO, TWO, lambda *step: told.append(step))
    assert {"shadows", "light between facets", "views", "folding dyes"} == {words for _, _, words in told}
    assert all(0 < done <= steps for done, steps, _ in told) and told[-1][0] == told[-1][1]


def test_dyes_are_reflectances_that_darken():
    for name in DYES:
        weak, strong = dyed(name, [0.2, 2.0]).samples
        assert (strong > 0.0).all() and (strong <= weak + 1e-12).all() and (weak < 1.0).all()


@pytest.mark.parametrize(
    ("words", "wrong"),
    [
        ("unknown dye", lambda: dyed("mauve", [1.0])),
        ("strength", lambda: dyed("weld", [-1.0])),
        ("unknown weave", lambda: woven(1, weave="satin")),
        ("does not tile", lambda: woven(1, yarns=6)),
        ("nothing that could be traced", lambda: leather(1, 0)),
        ("do not fit its texels", lambda: Relief(np.zeros((4, 6)), np.zeros((4, 6), dtype=np.int64), (2, 2))),
        ("not a number", lambda: Relief(np.full((2, 2), np.nan), np.zeros((2, 2), dtype=np.int64), (2, 2))),
        ("dyes", lambda: replace(some(), dyes=greys(0.5))),
        ("horizon", lambda: some().transport(of_degrees((89.5, 0)), TWO)),
        ("another sample", lambda: some().images(FEW, TWO, transport=some().transport(FEW, TWO))),
        (
            "other wavelengths",
            lambda: some().images(TWO, TWO, basis=SpectralBasis.sampled(np.arange(400.0, 700.0, 10))),
        ),
    ],
)
def test_what_cannot_be_is_refused(words, wrong):
    with pytest.raises(InputError, match=words):
        wrong()
