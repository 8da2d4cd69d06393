"""References that differ by what they were drawn with alone are the same, and what moved is still found."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from metamer.calibration.regression.comparison import compare
from metamer.calibration.regression.criteria import default_criteria, statistic
from metamer.calibration.regression.row import ComparedSide, LayerNoise, PixelLayer, Pixels, Row, RowName
from metamer.calibration.regression.sampling_noise import Chance
from metamer.spectral.difference import delta_e_xyz, xyz_from_lab
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer

WHITE = observer("1931_2").white(illuminant("D65"))
STATISTICS = ("mean", "median", "p95", "p99", "max", "share over 1")


def drawn(seed, size, spread=0.3, worst=1.0):
    """A reference in two halves, as references are: XYZ, and the noise that their difference states.

    The noise of a pixel is itself spread over the picture, log-normally, as behind edges and near highlights.
    """
    rng = np.random.default_rng([seed, size])
    scene = np.random.default_rng(size)
    truth = xyz_from_lab(scene.uniform([35, -20, -20], [80, 20, 20], (size, size, 3)), WHITE)
    sigma = 0.012 * worst * np.exp(spread * scene.standard_normal((size, size, 1)))
    halves = truth * (1.0 + sigma * math.sqrt(2.0) * rng.standard_normal((2, size, size, 3)))
    mean = halves.mean(axis=0)
    off = delta_e_xyz(mean, halves[0], WHITE)
    return mean.astype(np.float32), LayerNoise(float(off.mean()), float(np.percentile(off, 99.0)))


def side(path, rows):
    """A review of references alone: pixels and noise by name."""
    made = []
    for name, (xyz, noise) in rows.items():
        pixels = Pixels(xyz, np.ones(xyz.shape[:2], np.float32), WHITE)
        made.append(
            Row(RowName(name, "D65", "1931_2"), {"reference": PixelLayer(lambda held=pixels: held, noise=noise)})
        )
    return ComparedSide(Path(path), "review", tuple(made))


def states(before, after):
    found = compare(side("a", before), side("b", after), default_criteria())
    return [row.state for row in found.rows], found


@pytest.mark.parametrize(("size", "spread", "count"), [(16, 0.3, 24), (16, 0.6, 24), (48, 0.5, 12)])
def test_references_of_other_seeds_are_the_same(size, spread, count):
    before = {f"{seed}": drawn(seed, size, spread) for seed in range(count)}
    after = {f"{seed}": drawn(1000 + seed, size, spread) for seed in range(count)}
    found, result = states(before, after)
    assert found == ["same"] * count
    assert not any("material, light or scene is another" in note for row in result.rows for note in row.notes)


@pytest.mark.parametrize("other", [0.3, 3.0])
def test_a_reference_drawn_to_another_budget_is_the_same(other):
    found, _ = states({"red": drawn(1, 24)}, {"red": drawn(2, 24, worst=other)})
    assert found == ["same"]


@pytest.mark.parametrize(
    ("what", "moved"),
    [
        ("everywhere by twice the noise", lambda xyz, noise: xyz * np.float32(1.0 + 0.06)),
        ("one pixel by far more", lambda xyz, noise: _one_pixel(xyz, 2.5)),
        ("a corner", lambda xyz, noise: np.concatenate([xyz[:8] * np.float32(1.15), xyz[8:]])),
    ],
)
def test_what_moves_by_more_than_chance_is_still_found(what, moved):
    (xyz, noise), (again, other) = drawn(1, 32), drawn(2, 32)
    found, _ = states({"red": (xyz, noise)}, {"red": (moved(again, other), other)})
    assert found == ["changed"], what


def _one_pixel(xyz, factor):
    xyz = xyz.copy()
    xyz[7, 7] *= factor
    return xyz


@pytest.mark.parametrize("shape", [0.8, 1.0, 1.3, 2.0])
@pytest.mark.parametrize("name", STATISTICS)
def test_each_statistic_has_the_bound_of_its_order_statistic(name, shape):
    """Of draws from the distribution that is stated, hardly any come above; and the bound is no wide guess."""
    rng, n, scale = np.random.default_rng(4), 900, 0.7
    mean, p99 = scale * math.gamma(1 + 1 / shape), scale * math.log(100.0) ** (1 / shape)
    floor = Chance.of([LayerNoise(mean, p99)], n).floor(name)
    values = [statistic(name, scale * rng.weibull(shape, n)) for _ in range(300)]
    assert max(values) <= floor
    assert floor <= (6.0 if name == "max" else 3.0) * np.median(values)


def test_two_noises_are_independent_and_none_is_no_chance():
    one = Chance.of([LayerNoise(0.3, 1.0), LayerNoise(0.4, 1.2)], 10**8)
    assert one.mean == pytest.approx(0.5 * 1.05, rel=1e-3)
    assert Chance.of([None, None], 100).floor("max") == 0.0
    assert Chance.of([LayerNoise(0.0, 0.0)], 100).floor("mean") == 0.0
    assert replace(one, pixels=100).floor("max") < replace(one, pixels=10**6).floor("max")


@pytest.mark.slow
@pytest.mark.parametrize("material", ["ramp", "satin"])
def test_200_pairs_of_drawn_references_give_one_false_alarm_at_most(material):
    from metamer.lighting.camera import Camera
    from metamer.lighting.environment.environment import EnvironmentLight
    from metamer.lighting.mesh.shapes import plane, sphere
    from metamer.lighting.reference.reference import reference_images
    from metamer.lighting.scene import Part, Scene, Viewing
    from metamer.materials.analytic import CookTorrance, Lambert
    from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
    from metamer.spectral.spectrum import Spectrum

    ramp = Lambert(Spectrum.sampled(NM, np.linspace(0.1, 0.7, 81)))
    none = Spectrum.sampled(NM, np.zeros(81))
    satin = CookTorrance(none, np.linspace(0.2, 1.4, 81), np.full(81, 3.0), 0.2, 1.0, "ggx", "smith")
    up = np.eye(4)
    up[:3, 3] = (0.4, 1.0, 0.0)
    clouds = 0.1 + np.random.default_rng(5).random((1, 16, 32)) ** 4
    clouds[0, 4, 11] = 300.0
    light = EnvironmentLight(clouds, (illuminant("D65"),), 1000.0)
    camera = Camera(
        position=(0.6, 2.2, 4.0), target=(0.2, 0.3, 0), vertical_fov_deg=40, width=16, height_px=16, samples=1
    )
    parts = (Part("floor", plane(6, 6), material), Part("ball", sphere(4).transformed(up), material))
    scene = Scene(parts, (light,), (camera,), observer("1931_2"), Viewing(reference_illuminance_lux=1000.0))
    drawn_at = {}
    for seed in range(100, 121):
        budget = 6.0 if seed % 2 else 10.0
        found = reference_images(scene, None, {"ramp": ramp, "satin": satin}, budget=budget, seed=seed)
        covered = found.coverage >= 0.999
        drawn_at[seed] = (
            found.xyz[0][covered][None].astype(np.float32),
            LayerNoise(found.noise.mean[0], found.noise.p99[0]),
        )
    pairs = list(combinations(drawn_at, 2))
    before = {f"{a}, {b}": drawn_at[a] for a, b in pairs}
    after = {f"{a}, {b}": drawn_at[b] for a, b in pairs}
    found, _ = states(before, after)
    assert len(found) >= 200 and found.count("changed") <= 1
