"""Distributions of half vectors as Gaussians, against the distributions themselves."""

import numpy as np
import pytest
from metamer.benchmarks.papers.gaussian_lobes import ndf
from metamer.materials.analytic.cook_torrance import beckmann, ggx, smith_ggx
from metamer.materials.core.directions import spherical
from metamer.materials.core.protocol import sphere_protocol
from metamer.runtime.errors import InputError
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM


def _hemisphere(rows):
    """Half vectors, dense near the pole, and the solid angle of each."""
    edges = 0.5 * np.pi * (np.arange(rows + 1) / rows) ** 1.5
    around = np.pi * (np.arange(2 * rows) + 0.5) / rows
    to = spherical(*np.meshgrid(0.5 * (edges[1:] + edges[:-1]), around, indexing="ij")).reshape(-1, 3)
    return to, np.repeat((np.cos(edges[:-1]) - np.cos(edges[1:])) * np.pi / rows, 2 * rows)


HALF, SOLID = _hemisphere(60)
COS2, SIN2 = HALF[:, 2] ** 2, HALF[:, 0] ** 2 + HALF[:, 1] ** 2


def _apart(found, expected, solid=SOLID):
    """Relative L2."""
    return np.sqrt((solid @ (found - expected) ** 2) / (solid @ expected**2))


@pytest.mark.parametrize(
    ("lobes", "expected", "most"),
    [
        (ndf.beckmann(0.045), beckmann(COS2, SIN2, 0.045), 0.01),
        (ndf.beckmann(0.2), beckmann(COS2, SIN2, 0.2), 0.06),
        (ndf.ward(0.15), np.exp(-SIN2 / COS2 / 0.15**2) / (np.pi * 0.15**2), 0.03),
        (ndf.blinn_phong(100.0), 102.0 / (2.0 * np.pi) * HALF[:, 2] ** 100, 0.02),
    ],
)
def test_round_distributions_are_one_lobe(lobes, expected, most):
    assert lobes.sharpness.shape == (1,)
    assert _apart(ndf.slice_of(lobes, HALF), expected) < most


def _brushed(along, across):
    exponent = (along * HALF[:, 0] ** 2 + across * HALF[:, 1] ** 2) / SIN2
    return np.sqrt((along + 1.0) * (across + 1.0)) / (2.0 * np.pi) * HALF[:, 2] ** exponent


# Relative L2 that so many lobes leave of Ashikhmin and Shirley's (75, 1200), the paper's brushed metal.
LEFT = {1: 0.64, 3: 0.28, 5: 0.13, 7: 0.06}


@pytest.mark.parametrize("count", LEFT)
def test_a_brushed_metal_takes_several_lobes_along_its_wide_axis(count):
    lobes = ndf.ashikhmin_shirley(75.0, 1200.0, count)
    assert len(lobes.sharpness) == count
    assert _apart(ndf.slice_of(lobes, HALF), _brushed(75.0, 1200.0)) < LEFT[count]
    turned = ndf.ashikhmin_shirley(1200.0, 75.0, count)
    swapped = HALF[:, [1, 0, 2]]
    np.testing.assert_allclose(ndf.slice_of(turned, swapped), ndf.slice_of(lobes, HALF), rtol=1e-9)


def test_an_anisotropic_ward_with_equal_axes_is_the_isotropic_one():
    one, seven = ndf.ward(0.2), ndf.ward(0.2, 0.2, 7)
    np.testing.assert_allclose(ndf.slice_of(seven, HALF), ndf.slice_of(one, HALF))
    wide = np.exp(-((HALF[:, 0] / 0.3) ** 2 + (HALF[:, 1] / 0.1) ** 2) / COS2) / (np.pi * 0.03)
    assert _apart(ndf.slice_of(ndf.ward(0.3, 0.1, 7), HALF), wide) < 0.06


# Mean ΔE94 of a gold sphere under the protocol's lights, by roughness and number of lobes.
GGX_ERROR = {
    (0.1, 4): 0.7,
    (0.1, 6): 0.08,
    (0.3, 4): 0.12,
    (0.3, 6): 0.06,
    (0.02, 6): 0.35,
    (1.0, 2): 0.01,
    (0.14, 6): 0.12,
}


@pytest.mark.parametrize(("roughness", "count"), GGX_ERROR)
def test_ggx_looks_as_it_does_in_a_few_lobes(roughness, count):
    sphere = sphere_protocol(64)
    half = sphere.wi + sphere.wo
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    colour = sphere.weights(WORKING_WAVELENGTHS_NM).sum(axis=0) * [1.0, 0.85, 0.5]
    smooth = np.pi * smith_ggx(sphere.wi, roughness) * smith_ggx(sphere.wo, roughness) * sphere.wi[:, 2]
    exact = ggx(half[:, 2] ** 2, half[:, 0] ** 2 + half[:, 1] ** 2, roughness) * smooth
    lobes = ndf.ggx(roughness, count)
    assert len(lobes.sharpness) == count and (lobes.amplitude >= 0.0).all()
    found = ndf.slice_of(lobes, half) * smooth
    assert sphere.differences(exact[:, None] * colour, found[:, None] * colour).mean() < GGX_ERROR[roughness, count]


def test_ggx_of_any_roughness_has_its_top_and_sums_to_about_one():
    for roughness in np.geomspace(1e-4, 1.0, 25):
        lobes = ndf.ggx(roughness, 6)
        assert np.isfinite(lobes.amplitude).all()
        projected = SOLID @ (ndf.slice_of(lobes, HALF) * HALF[:, 2]) if roughness > 0.05 else 1.0
        assert projected == pytest.approx(1.0, abs=0.02)
        assert lobes.amplitude.sum() == pytest.approx(1.0 / (np.pi * roughness**2), rel=0.2)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: ndf.ggx(0.0), "roughness"),
        (lambda: ndf.ggx(1.5), "roughness"),
        (lambda: ndf.ggx(0.2, 5), "count"),
        (lambda: ndf.ashikhmin_shirley(10.0, 100.0, 8), "count"),
        (lambda: ndf.ward(0.2, 0.1, 0), "count"),
    ],
)
def test_what_has_no_lobes_is_refused(make, field):
    with pytest.raises(InputError, match=field):
        make()
