"""Light that vertices lose, beside sums over rays to every texel of it."""

import numpy as np
import pytest
import visibility_truth as measure
from metamer.lighting.environment import latlong
from metamer.lighting.environment.bright_light import BrightLight
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.vectors import unit
from metamer.lighting.visibility import compression, tracing
from metamer.lighting.visibility.hidden_light import HiddenLight
from metamer.lighting.visibility.precompute import computed_visibility
from metamer.materials.core.environment_form import bends
from metamer.spectral.illuminants import illuminant

HEIGHT, WIDTH = 32, 64
TO = latlong.texel_directions(HEIGHT, WIDTH)
FLAT = TO.reshape(-1, 3)
ANGLES = np.repeat(latlong.solid_angles(HEIGHT, WIDTH), WIDTH)


@pytest.fixture(scope="module")
def scene(scene_of):
    return scene_of(sphere(3).placed(translate=(0.0, 1.0, 0.0)), plane(5.0, 5.0))


@pytest.fixture(scope="module")
def visibility(scene):
    return computed_visibility(scene)


@pytest.fixture(scope="module")
def truth(scene):
    return measure.truth(scene, 300, FLAT)


@pytest.fixture(scope="module")
def light():
    """A sky with a wide glow low in it, in two colours, and no narrow part."""
    glow = np.exp(20.0 * (TO @ unit(np.array([0.8, 0.3, 0.4])) - 1.0))
    sky = np.where(TO[..., 1] > 0.0, 1.0 + 0.5 * TO[..., 1], 0.2)
    return EnvironmentLight(np.stack([sky, 30.0 * glow]), (illuminant("D65"), illuminant("A")))


def test_points_lose_what_rays_say_and_its_moments(visibility, truth, light):
    bright = BrightLight.of(light)
    assert bright.narrow == 0
    hidden = HiddenLight.of(visibility, bright)
    vertices, weights = visibility.located(truth.faces, truth.weights)
    lost, whole = hidden.between(visibility.sites(vertices, None), weights)
    cosine = np.maximum(truth.normals @ FLAT.T, 0.0) * ANGLES
    sent = light.fields.reshape(2, -1).T
    each = (bends(FLAT)[:, :, None] * sent[:, None]).reshape(len(FLAT), -1)
    expected = ((cosine * ~truth.free) @ each).reshape(-1, 9, 2)
    most = (cosine @ sent).max(axis=0)
    assert np.abs(whole - cosine @ sent).mean(axis=0).max() < 0.005 * most.min()
    assert (np.abs(lost - expected) / most).mean() < 0.004 and np.percentile(np.abs(lost - expected) / most, 99) < 0.04
    # A point that sees all of its sky loses nothing, and nobody loses more than there is.
    assert (lost[:, 0] <= whole * (1.0 + 1e-5)).all() and lost[:, 0].min() >= 0.0


def test_codes_of_half_a_byte_are_found_again():
    codes = np.random.default_rng(1).normal(size=(50, 24)).astype(np.float32) * np.geomspace(10.0, 0.1, 24)
    whole, halves, steps = compression.pack_codes(codes.astype(np.float32))
    assert whole.shape == (50, 16) and halves.shape == (50, 4) and whole.nbytes + halves.nbytes == 50 * 20
    found = compression.unpack_codes(whole, halves) * steps
    assert (np.abs(found - codes) <= 0.5001 * steps).all()
    none = compression.pack_codes(np.zeros((3, 0), np.float32))
    assert compression.unpack_codes(*none[:2]).shape == (3, 0)


def test_codes_that_come_with_a_basis_are_those_that_it_finds():
    """Sites that see nothing have the code of that, whatever their weights."""
    rng = np.random.default_rng(0)
    dark = np.arange(60) % 3 == 0
    distances = np.clip(rng.normal(size=(60, 4)) @ rng.normal(size=(4, 1024)), -1.5, 1.5).astype(np.float32)
    distances[dark] = -0.5 * np.pi
    values, weights = compression.bent(distances), rng.uniform(0.1, 1.0, distances.shape).astype(np.float32)
    normals = unit(rng.normal(size=(60, 3)))
    basis, codes = compression.fitted_basis(values, weights, normals, dark, 16)
    again = compression.encoded(basis, values[~dark], weights[~dark], normals[~dark])
    np.testing.assert_allclose(codes[~dark], again, atol=2e-3 * np.abs(again).max())
    np.testing.assert_array_equal(codes[dark], np.tile(basis.hidden, (dark.sum(), 1)))
    np.testing.assert_allclose(basis.mean + basis.axes @ basis.hidden, values[0], atol=0.02)
    # None that is dark, and a few that are alike: no terms.
    basis, codes = compression.fitted_basis(np.ones((5, 1024), np.float32), weights[:5], normals[:5], np.zeros(5, bool))
    assert codes.shape == (5, 0) and basis.axes.shape == (1024, 0)


@pytest.mark.parametrize("terms", [1, 7, 8])
@pytest.mark.parametrize("ridge", [compression._RIDGE, 0.0])
def test_least_squares_are_solved_row_by_row(terms, ridge, monkeypatch):
    """Also where no weight determines them, and without a ridge the triangle has no factor: then the shortest."""
    monkeypatch.setattr(compression, "_RIDGE", ridge)
    rng = np.random.default_rng(terms)
    axes = np.linalg.qr(rng.normal(size=(1024, terms)))[0].astype(np.float32)
    values, weights = rng.normal(size=(5, 1024)).astype(np.float32), rng.uniform(0.2, 1.0, (5, 1024)).astype(np.float32)
    # Nothing, and one texel.
    weights[3:] = 0.0
    weights[4, 5] = 1.0
    codes = compression._solved(weights, compression._products(axes), (weights * values) @ axes, 0.0)
    for code, value, weight in zip(codes[:3], values, weights.astype(np.float64), strict=False):
        expected = np.linalg.solve((axes.T * weight) @ axes + ridge * np.eye(terms), axes.T @ (weight * value))
        np.testing.assert_allclose(code, expected, atol=1e-4)
    np.testing.assert_array_equal(codes[3], 0.0)
    there = (codes[4] @ axes.T - values[4])[5]
    assert abs(there) <= 1e-3 + ridge / np.square(axes[5]).sum() * np.abs(values[4])[5]


def test_codes_are_the_weighted_least_squares():
    """At normals all around; a few steps leave out as much as the solution. What no weight determines is projected."""
    values, weights, normals = _hidden_by_simple_things(np.random.default_rng(3), 3.0)
    basis = compression.quick_basis(values, np.zeros(len(values), dtype=bool), 48)
    codes = compression.encoded(basis, values, weights, normals)
    off, left = (values - basis.mean).astype(np.float64), []
    projected = off @ basis.axes
    solved = np.stack(
        [
            np.linalg.lstsq(np.sqrt(weight)[:, None] * basis.axes, np.sqrt(weight) * one, rcond=None)[0]
            for weight, one in zip(weights.astype(np.float64), off, strict=True)
        ]
    )
    for found in (solved, codes, projected):
        left.append((weights * np.square(off - found @ basis.axes.T)).sum())
    assert left[1] <= 1.02 * left[0] and left[2] > 1.3 * left[0]
    some = slice(0, 5)
    plain = compression.encoded(basis, values[some], np.zeros_like(weights[some]), normals[some])
    np.testing.assert_allclose(plain, projected[some], atol=1e-3)


def _hidden_by_simple_things(rng, tilt):
    """Values, weights and normals of sites beside a wall at any height, a slit of any width, a disc of any size."""
    to = tracing.texels()
    normals = unit(np.array([0.0, 1.0, 0.0]) + tilt * rng.normal(size=(360, 3)))
    along, size = unit(rng.normal(size=(360, 3))), rng.uniform(0.02, 0.9, 360)[:, None]
    angle = np.arccos(np.clip(along @ to.T, -1.0, 1.0))
    beyond = angle - 0.5 * np.pi
    kinds = np.stack([size + beyond, 0.3 * size - np.abs(beyond), angle - size])
    distances = kinds[np.arange(360) % 3, np.arange(360)].astype(np.float32)
    return compression.bent(distances), compression.importance(distances, normals), normals


def test_a_quick_basis_leaves_out_as_much_as_a_fitted_one():
    """Sites lie between those that it was made of."""
    values, weights, normals = _hidden_by_simple_things(np.random.default_rng(2), 0.2)
    none, left = np.zeros(240, dtype=bool), []
    quick = compression.quick_basis(values[:240], none, 48)
    for basis in (compression.fitted_basis(values[:240], weights[:240], normals[:240], none, 48)[0], quick):
        codes = compression.encoded(basis, values[240:], weights[240:], normals[240:])
        off = basis.mean + codes @ basis.axes.T - values[240:]
        left.append(float((weights[240:] * off**2).sum()))
    assert left[1] <= 1.1 * left[0]
    # A site that sees nothing has a code, too, though there was none in the fit.
    np.testing.assert_allclose(quick.mean + quick.axes @ quick.hidden, compression.bent(-0.5 * np.pi), atol=0.05)


def test_normals_are_kept_in_two_numbers(visibility, scene):
    normals = np.concatenate([part.mesh.normals for part in scene.parts])
    kept = visibility.site_normals[visibility.fronts[: len(normals)]]
    assert np.abs(kept - normals).max() < 2e-4
    # The floor is seen from below too, and its back looks down.
    backs = visibility.backs[visibility.backs >= 0]
    assert len(backs) and (visibility.site_normals[backs][:, 1] < -0.999).all()
