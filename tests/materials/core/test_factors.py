"""Factor packs: axes, linear look-up, both frames, folding with a light."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.core.axes import AXIS_NAMES, Axis, frame_angles
from metamer.materials.core.directions import half_difference, io_angles, spherical
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.palette import Palette

RIGHT, TURN = 0.5 * np.pi, 2.0 * np.pi
AXES = {
    "io": (Axis("theta_i", 17, RIGHT), Axis("theta_o", 12, RIGHT), Axis("phi", 9, np.pi)),
    "hd": (Axis("theta_h", 20, 1.2, "sqrt"), Axis("theta_d", 11, RIGHT), Axis("phi_d", 9, np.pi)),
}
AZIMUTH = {
    "io": (Axis("phi", 9, TURN, periodic=True), Axis("phi_i", 7, TURN, periodic=True)),
    "hd": (Axis("phi_d", 9, TURN, periodic=True), Axis("phi_h", 7, TURN, periodic=True)),
}
WAVELENGTHS_NM = np.arange(400.0, 701.0, 50.0)


def a_pack(frame: str, rank: int = 5, anisotropic: bool = False) -> FactorPack:
    generator = np.random.default_rng(7)
    axes = (*AXES[frame][:2], *AZIMUTH[frame]) if anisotropic else AXES[frame]
    factors = tuple(generator.standard_normal((axis.size, rank)) for axis in axes)
    basis = SpectralBasis.sampled(WAVELENGTHS_NM)
    return FactorPack(frame, axes, factors, Palette.of(generator.standard_normal((rank, basis.size)), basis))


def pairs(count: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Directions all over both hemispheres, below the horizon included."""
    u = np.random.default_rng(1).random((4, count))
    return spherical(u[0] * 0.55 * np.pi, u[1] * TURN), spherical(u[2] * 0.55 * np.pi, u[3] * TURN)


@pytest.mark.parametrize("warp", ["linear", "sqrt"])
def test_position_of_every_node_is_its_index(warp):
    axis = Axis("theta_h", 31, 0.7, warp)
    assert axis.nodes[0] == 0.0
    assert axis.nodes[-1] == pytest.approx(0.7)
    np.testing.assert_allclose(axis.position(axis.nodes), np.arange(31.0), atol=1e-9)


def test_position_is_held_past_the_ends_and_wrapped_on_a_periodic_axis():
    np.testing.assert_array_equal(Axis("theta_h", 5, 1.0).position(np.array([-0.5, 3.0])), [0.0, 4.0])
    around = Axis("phi_h", 9, TURN, periodic=True)
    np.testing.assert_allclose(around.position(np.array([-0.25, 0.25, 1.25]) * TURN), [6.0, 2.0, 2.0], atol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (("theta", 5, 1.0), "name"),
        (("theta_i", 1, 1.0), "theta_i"),
        (("theta_i", 5, -1.0), "theta_i"),
        (("theta_i", 5, float("nan")), "theta_i"),
    ],
)
def test_an_unusable_axis_is_refused(arguments, field):
    with pytest.raises(InputError) as refusal:
        Axis(*arguments)
    assert refusal.value.field == field


@pytest.mark.parametrize("anisotropic", [False, True])
@pytest.mark.parametrize("frame", ["io", "hd"])
def test_look_up_equals_np_interp_along_every_axis(frame, anisotropic):
    pack = a_pack(frame, anisotropic=anisotropic)
    wi, wo = pairs()
    at = frame_angles(frame, wi, wo, anisotropic)
    expected = np.repeat(at.scale[:, None], pack.rank, axis=1)
    for axis, factor in zip(pack.axes, pack.factors, strict=True):
        x, nodes = at.angles[axis.name], axis.nodes
        if axis.warp == "sqrt":
            x, nodes = np.sqrt(x), np.sqrt(nodes)
        expected *= np.stack([np.interp(x, nodes, column) for column in factor.T], axis=1)
    found = pack.values(wi, wo)
    worst = np.unravel_index(np.argmax(np.abs(found - expected)), found.shape)
    evidence = f"worst at {worst}: {found[worst]}, {expected[worst]}"
    np.testing.assert_allclose(found, expected, atol=1e-12, err_msg=evidence)


def test_frames_apply_the_cosine_and_the_horizon():
    wi, wo = pairs()
    lit = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    np.testing.assert_array_equal(frame_angles("io", wi, wo).scale, lit)
    np.testing.assert_array_equal(frame_angles("hd", wi, wo).scale, np.where(lit, wi[:, 2], 0.0))
    for frame in ("io", "hd"):
        assert not a_pack(frame).shade(wi, wo)[~lit].any()


def test_angles_are_those_of_directions():
    wi, wo = pairs()
    io, hd = frame_angles("io", wi, wo).angles, frame_angles("hd", wi, wo).angles
    for name, expected in zip(AXIS_NAMES["io"], io_angles(wi, wo), strict=False):
        np.testing.assert_array_equal(io[name], expected)
    theta_h, theta_d, phi_d, _ = half_difference(wi, wo)
    np.testing.assert_array_equal(hd["theta_h"], theta_h)
    np.testing.assert_array_equal(hd["theta_d"], theta_d)
    np.testing.assert_allclose(np.cos(hd["phi_d"]), np.cos(phi_d), atol=1e-12)
    assert hd["phi_d"].max() <= np.pi


def test_angles_worked_out_once_serve_many_packs_in_either_precision():
    wi, wo = (w.reshape(20, 20, 3) for w in pairs())
    at = frame_angles("hd", wi, wo)
    for rank in (1, 4, 24):
        pack = a_pack("hd", rank)
        np.testing.assert_array_equal(pack.values_at(at), pack.values(wi, wo))
        single = pack.values_at(at, np.float32)
        assert single.dtype == np.float32
        assert single.shape == (20, 20, rank)
        np.testing.assert_allclose(single, pack.values(wi, wo), rtol=2e-5, atol=2e-5)


def test_angles_of_another_frame_are_refused():
    with pytest.raises(InputError, match="angles of another frame"):
        a_pack("hd").values_at(frame_angles("io", *pairs()))
    with pytest.raises(InputError, match="angles of another frame"):
        a_pack("hd", anisotropic=True).values_at(frame_angles("hd", *pairs()))


def folded(pack, light, eye):
    return pack.palette.folded(Folding(eye, [light]))[0]


def test_folding_with_a_light_equals_shading_every_wavelength():
    pack, (wi, wo) = a_pack("hd"), pairs()
    light, eye = illuminant("FL2"), observer("1931_2")
    expected = pack.shade(wi, wo) @ eye.weights(light, WAVELENGTHS_NM).T
    np.testing.assert_allclose(pack.values(wi, wo) @ folded(pack, light, eye), expected, atol=1e-12)


def test_another_basis_shades_to_the_same_colour():
    grid = np.arange(380.0, 781.0, 5.0)
    light, eye = illuminant("D65"), observer("1931_2")
    spectral = np.random.default_rng(2).random((3, 81))
    axes = AXES["io"]
    pack = FactorPack(
        "io", axes, tuple(np.ones((a.size, 3)) for a in axes), Palette.of(spectral, SpectralBasis.sampled(grid))
    )
    small = pack.in_basis(SpectralBasis.balanced(spectral, eye.weights(light, grid).T))
    assert small.palette.basis.size == 3
    np.testing.assert_allclose(folded(small, light, eye), folded(pack, light, eye), atol=1e-12)
    coarse = pack.in_basis(SpectralBasis.sampled(grid[::2]))
    np.testing.assert_allclose(coarse.spectra, spectral[:, ::2], atol=1e-12)


def test_factored_brdf_divides_by_the_cosine_and_sums_its_packs():
    packs = a_pack("io"), a_pack("hd")
    wi, wo = pairs()
    found = FactoredBrdf(packs).eval(wi, wo)
    lit = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    expected = sum(pack.shade(wi, wo) for pack in packs)[lit] / wi[lit, 2:]
    np.testing.assert_allclose(found[lit], expected, rtol=1e-12)
    assert not found[~lit].any()
    assert FactoredBrdf(packs).isotropic
    assert not FactoredBrdf((a_pack("io", anisotropic=True),)).isotropic


def test_packs_that_do_not_fit_together_are_refused():
    pack = a_pack("io")
    cases = {
        "axes do not belong": {"frame": "hd"},
        "factors do not fit": {"factors": (pack.factors[0][:-1], *pack.factors[1:])},
        "not finite": {"factors": (np.nan * pack.factors[0], *pack.factors[1:])},
        "several entries": {"palette": Palette(np.repeat(pack.palette.values, 2, axis=0), pack.palette.basis)},
    }
    for words, change in cases.items():
        with pytest.raises(InputError, match=words):
            replace(pack, **change)
    with pytest.raises(InputError, match="no summands"):
        FactoredBrdf(())
    grid = SpectralBasis.sampled(WAVELENGTHS_NM + 1.0)
    with pytest.raises(InputError, match="different wavelengths"):
        FactoredBrdf((pack, FactorPack("io", pack.axes, pack.factors, Palette.of(pack.palette.values[0], grid))))


def test_what_is_stored_comes_in_the_order_that_files_have():
    """HDF5 lays attributes down as they come: another order would be other bytes for the same pack."""
    kept = a_pack("hd", anisotropic=True).stored()
    assert list(kept) == ["frame", "basis", "precision", "spectral", "wavelengths_nm", "axes"]
    assert list(kept["axes"]) == ["theta_h", "theta_d", "phi_d", "phi_h"]
    assert list(kept["axes"]["phi_h"]) == ["position", "maximum", "warp", "periodic", "factor", "nodes"]


def test_a_folding_keeps_nothing_of_bases_of_samples_but_their_wavelengths():
    """A fit makes thousands of packs, each with a basis of samples of its own."""
    folding = Folding(observer("1931_2"), [illuminant("D65")])
    one, other = (folding.coefficients(SpectralBasis.sampled(WAVELENGTHS_NM)) for _ in range(2))
    assert one is other is folding.weights(WAVELENGTHS_NM)
