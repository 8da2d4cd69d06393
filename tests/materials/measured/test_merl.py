"""MERL tables as BRDFs: exact where measured, whole where readings dropped out, and few terms once fitted."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from metamer.materials.core.directions import TAU, half_difference, io_from_half_difference, spherical
from metamer.materials.fitting.fit import fit
from metamer.materials.formats.merl import SCALES
from metamer.materials.intake.sources import read_sources
from metamer.materials.measured.merl import SHAPE, MerlBrdf, node_angles
from metamer.materials.records.models import rebuild
from metamer.materials.records.source import Rejected
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.upsampling import METHODS, xyz_from_rgb


@cache
def nodes() -> SimpleNamespace:
    """Directions of all nodes, and which are within reach and above the horizon."""
    wi, wo = io_from_half_difference(*np.meshgrid(*node_angles(), indexing="ij"))
    # The last digits of a node's angles decide which side of the horizon it is on.
    above = (wi[..., 2] > 1e-6) & (wo[..., 2] > 1e-6)
    return SimpleNamespace(wi=wi, wo=wo, reached=(wi[..., 2] > 1e-9) & (wo[..., 2] > 1e-9), above=above)


def smooth():
    """A red body under a whitish lobe, with all the symmetries; -1 out of reach."""
    theta_h, theta_d, phi_d = np.meshgrid(*node_angles(), indexing="ij")
    lobe = np.exp(-((np.tan(np.minimum(theta_h, 1.5)) / 0.2) ** 2)) * (1.0 + theta_d)
    body = 0.05 * (1.0 + 0.1 * np.cos(2.0 * phi_d) * np.sin(theta_d))
    values = body[..., None] * np.array([1.0, 0.3, 0.2]) + lobe[..., None] * np.array([0.5, 0.45, 0.4])
    return np.where(nodes().reached[..., None], values, -1.0)


@pytest.fixture(scope="module")
def values():
    return smooth()


@pytest.fixture(scope="module")
def brdf(values):
    return MerlBrdf(values, name="smooth")


def pairs(count, seed):
    random = np.random.default_rng(seed)
    theta = np.arccos(random.uniform(np.cos(np.radians(89.9)), 1.0, (2, count)))
    phi = random.random((2, count)) * TAU
    return spherical(theta[0], phi[0]), spherical(theta[1], phi[1])


def write(path, values):
    stored = np.where(values > 0, values / SCALES, values)
    path.write_bytes(np.array(SHAPE, "<i4").tobytes() + np.moveaxis(stored, -1, 0).astype("<f8").tobytes())
    return path


def worst(found, expected):
    apart = np.abs(found / expected - 1.0)
    at = np.unravel_index(apart.argmax(), apart.shape)
    return apart[at], f"at {at}: {found[at]!r} against {expected[at]!r}"


def some_nodes():
    """All at the ends of each axis, and of the others above the horizon one in seven: any value of each angle."""
    found = np.zeros(SHAPE, dtype=bool)
    found.ravel()[::7] = True
    for axis in range(3):
        np.moveaxis(found, axis, 0)[[0, 1, -2, -1]] = True
    return found & nodes().above


def test_exact_at_its_nodes(brdf, values):
    some = some_nodes()
    apart, evidence = worst(brdf.eval_rgb(nodes().wi[some], nodes().wo[some]), values[some])
    assert apart < 1e-9, evidence


def test_between_the_nodes_it_is_their_mean(brdf, values):
    theta_h, theta_d, phi_d = node_angles()
    half = 0.25 * (np.sqrt(theta_h[10]) + np.sqrt(theta_h[11])) ** 2
    wi, wo = io_from_half_difference(half, 0.5 * (theta_d[20] + theta_d[21]), 0.5 * (phi_d[30] + phi_d[31]))
    np.testing.assert_allclose(brdf.eval_rgb(wi, wo), values[10:12, 20:22, 30:32].mean(axis=(0, 1, 2)), rtol=1e-9)


def test_spectra_have_the_colour_that_was_measured_however_bright():
    bright = MerlBrdf(400.0 * smooth())
    wi, wo = pairs(500, 1)
    light, eye = illuminant("D65"), observer("1931_2")
    xyz = bright.eval(wi, wo) @ eye.weights(light, bright.wavelengths_nm).T
    expected = bright.eval_rgb(wi, wo) @ xyz_from_rgb().T
    assert np.abs(xyz - expected).max() < 1e-3 * expected.max()


def test_reciprocal_mirror_symmetric_isotropic_and_black_below_the_horizon(brdf):
    wi, wo = pairs(2000, 2)
    there = brdf.eval_rgb(wi, wo)
    np.testing.assert_allclose(brdf.eval_rgb(wo, wi), there, rtol=1e-9)
    np.testing.assert_allclose(brdf.eval_rgb(wi * [1, -1, 1], wo * [1, -1, 1]), there, rtol=1e-9)
    turn = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(brdf.eval_rgb(wi @ turn, wo @ turn), there, rtol=1e-9)
    assert there.min() > 0
    assert not np.any(brdf.eval(wi * [1, 1, -1], wo))
    assert not np.any(brdf.eval(wi, wo * [1, 1, 0]))


def test_phi_wraps_around(brdf):
    wi, wo = io_from_half_difference(0.3, 0.9, np.array([0.0, 1e-9, np.pi - 1e-9, np.pi, TAU - 1e-9]))
    np.testing.assert_allclose(brdf.eval_rgb(wi, wo), np.broadcast_to(brdf.eval_rgb(wi[0], wo[0]), (5, 3)), rtol=1e-7)


def test_a_table_that_contradicts_its_mirror_image_is_averaged(values):
    noisy = values.copy()
    noisy[5, 20, 30] *= 1.2
    wi, wo = io_from_half_difference(*(angle[index] for angle, index in zip(node_angles(), (5, 20, 30), strict=True)))
    np.testing.assert_allclose(MerlBrdf(noisy).eval_rgb(wi, wo), 1.1 * values[5, 20, 30], rtol=1e-9)


@pytest.mark.slow
def test_dropouts_are_missing_and_not_black(values):
    random = np.random.default_rng(3)
    lost = random.random(values.shape) < 0.1
    # A reading is lost together with its mirror image, else that one would stand in for it.
    lost[:, :, :90:-1] = lost[:, :, 1:90]
    broken = np.where(lost & nodes().reached[..., None], random.choice([0.0, -1.0], values.shape), values)
    brdf = MerlBrdf(broken)
    apart, evidence = worst(brdf.eval_rgb(nodes().wi[nodes().above], nodes().wo[nodes().above]), values[nodes().above])
    assert apart < 0.1, evidence
    count = int((lost & nodes().reached[..., None]).sum())
    assert brdf.notes[0].startswith(f"{count} of {3 * int(nodes().reached.sum())} readings dropped out")


def test_a_lost_block_is_filled_from_around_it(values):
    broken = values.copy()
    broken[20:40, 30:50] = -1.0
    broken[:, 75:] = 0.0
    brdf = MerlBrdf(broken)
    some = nodes().above & ((broken < 0.0).any(axis=-1) | (broken == 0.0).any(axis=-1) | some_nodes())
    apart, evidence = worst(brdf.eval_rgb(nodes().wi[some], nodes().wo[some]), values[some])
    assert apart < 0.2, evidence


@pytest.mark.slow
def test_a_single_reading_a_channel_is_all_there_is():
    alone = np.full((*SHAPE, 3), -1.0)
    alone[3, 4, 5] = (0.3, 0.2, 0.1)
    wi, wo = pairs(50, 4)
    np.testing.assert_allclose(MerlBrdf(alone).eval_rgb(wi, wo), np.broadcast_to([0.3, 0.2, 0.1], (50, 3)), rtol=1e-12)


def test_bad_tables_are_refused(values):
    with pytest.raises(InputError, match="not a MERL table"):
        MerlBrdf(values[:, :, :90])
    with pytest.raises(InputError, match="green"):
        MerlBrdf(np.where(np.arange(3) == 1, 0.0, values))
    with pytest.raises(InputError, match="finite"):
        MerlBrdf(np.where(values > 1.0, np.nan, values))
    with pytest.raises(UnknownNameError, match="jakob"):
        MerlBrdf(values, "jakob")
    with pytest.raises(InputError, match="values"):
        MerlBrdf.from_parameters({"method": "smits"})


@pytest.mark.slow_cases("jakob-hanika", "smits")
@pytest.mark.parametrize("method", METHODS)
def test_rebuilt_from_its_parameters_bit_for_bit(values, method):
    brdf = MerlBrdf(values, method, "smooth")
    again = rebuild("merl", brdf.parameters())
    wi, wo = pairs(300, 5)
    assert np.array_equal(again.eval(wi, wo), brdf.eval(wi, wo))


def test_imported_under_any_name_with_the_method_in_its_provenance(tmp_path, values):
    path = write(tmp_path / "Red Thing.dat", values)
    (material,) = read_sources(path, "smits")
    assert (material.id, material.model, material.provenance.kind) == ("measured/red-thing", "merl", "uplifted(smits)")
    assert "linear sRGB" in material.provenance.notes
    (same,) = read_sources(path)
    assert same.provenance.kind == "uplifted(mallett-yuksel)"
    assert same.content_hash != material.content_hash
    with pytest.raises(UnknownNameError, match="smits"):
        read_sources(path, "smit")


def test_a_damaged_file_does_not_hold_up_a_folder(tmp_path, values):
    write(tmp_path / "good.binary", values)
    (tmp_path / "torn.binary").write_bytes((tmp_path / "good.binary").read_bytes()[:-8])
    good, torn = read_sources(tmp_path)
    assert good.id == "measured/good"
    assert isinstance(torn, Rejected)
    assert "ends early" in str(torn.reason)


# Terms, then ΔE94 mean and 95th percentile.
BARS = {
    "red-fabric": (32, 0.5, 1.0),
    "blue-metallic-paint": (32, 0.5, 1.0),
    "yellow-matte-plastic": (32, 0.5, 1.0),
    "specular-blue-phenolic": (96, 0.75, 1.5),
    "chrome-steel": (96, 0.75, 1.5),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BARS)
def test_smooth_fits_of_measured_materials_in_few_terms(merl_table, name):
    terms, mean, p95 = BARS[name]
    result = fit(MerlBrdf(merl_table(name)), budget=1.5, pixels=64, ranks=(8, 96))
    assert result.rank <= terms, result
    assert result.error.mean <= mean, result.error
    assert result.error.p95 <= p95, result.error


@pytest.mark.slow
def test_smooth_fits_are_met_at_their_nodes(merl_table):
    brdf = MerlBrdf(merl_table("specular-blue-phenolic"))
    mirrored = brdf.values[:, :, -np.arange(180) % 180]
    known = nodes().above & (brdf.values > 0).all(axis=-1) & (mirrored > 0).all(axis=-1)
    apart, evidence = worst(
        brdf.eval_rgb(nodes().wi[known], nodes().wo[known]), (0.5 * (brdf.values + mirrored))[known]
    )
    assert apart < 1e-9, evidence
    # The highlight itself: theta_h = 0 at every theta_d.
    theta_h, *_ = half_difference(nodes().wi[0], nodes().wo[0])
    assert theta_h.max() < 1e-7
