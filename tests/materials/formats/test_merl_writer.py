"""MERL tables that are written: at the nodes, what was asked of the BRDF; out of a table, the table."""

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, Lambert
from metamer.materials.core.directions import io_from_half_difference
from metamer.materials.formats.merl import DARKEST, SCALES, merl_table, read_merl, write_merl
from metamer.materials.measured.merl import SHAPE, MerlBrdf, MerlMeasurement, node_angles
from metamer.runtime.errors import InputError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from metamer.spectral.upsampling import upsampling, xyz_from_rgb


def brdf_of(reflectance):
    return Lambert(Spectrum.sampled(WORKING_WAVELENGTHS_NM, reflectance))


@pytest.fixture(scope="module")
def gloss():
    body = upsampling("mallett-yuksel").spectra(np.array([0.3, 0.2, 0.1]))
    coat = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(81, 0.04))
    return AshikhminShirley(Spectrum.sampled(WORKING_WAVELENGTHS_NM, body), coat, 40.0, 40.0)


@pytest.mark.slow
def test_nodes_hold_the_brdf_in_linear_srgb(tmp_path, gloss):
    values, notes = merl_table(gloss)
    write_merl(tmp_path / "x.binary", values)
    back = read_merl(tmp_path / "x.binary").values
    weights = observer("1931_2").weights(illuminant("D65"), WORKING_WAVELENGTHS_NM)
    theta_h, theta_d, phi_d = node_angles()
    rng = np.random.default_rng(3)
    checked = 0
    for h, d, p in zip(*(rng.integers(0, size, 300) for size in (90, 90, 180)), strict=True):
        wi, wo = io_from_half_difference(theta_h[h], theta_d[d], phi_d[p])
        if min(wi[2], wo[2]) <= 1e-9:
            np.testing.assert_allclose(back[h, d, p], -SCALES)
            continue
        rgb = np.linalg.solve(xyz_from_rgb(), weights @ gloss.eval(wi, wo))
        np.testing.assert_allclose(back[h, d, p], rgb, rtol=1e-12)
        checked += 1
    assert checked > 100 and "linear sRGB" in notes[0]


def test_a_file_holds_what_it_was_given_to_the_last_bit(tmp_path):
    values = np.random.default_rng(2).uniform(0.0, 5.0, (*SHAPE, 3))
    write_merl(tmp_path / "x.binary", values)
    back = read_merl(tmp_path / "x.binary").values
    assert np.max(np.abs(back - values) / np.spacing(np.abs(values))) <= 1.0


def test_a_table_that_was_read_comes_back_bit_for_bit(tmp_path):
    rng = np.random.default_rng(1)
    planes = np.where(rng.random((90, 90, 180, 3)) < 0.1, -1.0, rng.lognormal(size=(90, 90, 180, 3)))
    planes[0, 0, :5] = 0.0
    values, notes = merl_table(MerlBrdf.from_measurement(MerlMeasurement("x", planes * SCALES)))
    write_merl(tmp_path / "x.binary", values)
    np.testing.assert_array_equal(read_merl(tmp_path / "x.binary").values, planes * SCALES)
    assert notes == ("the table as it was read",)


def test_grey_is_grey(tmp_path):
    values, _ = merl_table(brdf_of(np.full(81, 0.5)))
    there = values[..., 0] > 0
    np.testing.assert_allclose(values[there], 0.5 / np.pi, rtol=1e-9)


def test_what_srgb_cannot_hold_is_said_and_never_lost_as_no_reading():
    line = np.zeros(81)
    line[24] = 1.0
    values, notes = merl_table(brdf_of(line))
    there = values[..., 1] > 0
    assert (values[there] >= DARKEST).all() and (values[there][:, 0] == DARKEST).all()
    assert "outside sRGB" in notes[1]


def test_shapes_and_numbers_that_are_no_table(tmp_path):
    for values in (np.zeros((2, 2, 2, 3)), np.full((90, 90, 180, 3), np.nan)):
        with pytest.raises(InputError, match="not a MERL table"):
            write_merl(tmp_path / "x.binary", values)
    assert list(tmp_path.iterdir()) == []


def test_an_anisotropic_surface_has_no_table(gloss):
    with pytest.raises(InputError, match="anisotropic"):
        merl_table(AshikhminShirley(gloss.diffuse, gloss.specular, 10.0, 100.0))
