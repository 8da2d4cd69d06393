"""Tables of BRDFs and their look-up."""

import dataclasses
from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, CoatedDiffuse, CookTorrance, Lambert
from metamer.materials.core.axes import Axis, frame_angles
from metamer.materials.core.brdf import Brdf
from metamer.materials.core.directions import io_from_half_difference, spherical
from metamer.materials.fitting.brdf_table import BrdfTable, node_directions, tabulate
from metamer.materials.fitting.lobe_table import LobeTable
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import Spectrum

RIGHT, TURN = 0.5 * np.pi, 2.0 * np.pi
WAVELENGTHS_NM = np.array([450.0, 550.0, 650.0])
RED = Spectrum.sampled(WAVELENGTHS_NM, [0.1, 0.2, 0.7])
GREY = Spectrum.sampled(WAVELENGTHS_NM, [0.05, 0.05, 0.05])
IO = (Axis("theta_i", 40, RIGHT), Axis("theta_o", 40, RIGHT), Axis("phi", 25, np.pi))
HD = (Axis("theta_h", 60, RIGHT, "sqrt"), Axis("theta_d", 40, RIGHT), Axis("phi_d", 25, np.pi))


@dataclass(frozen=True, eq=False)
class TabulatedBrdf(Brdf):
    """A table as a BRDF: multilinear between nodes; corners that no real pair of directions reaches take no part."""

    table: BrdfTable

    @property
    def wavelengths_nm(self) -> np.ndarray:
        """The table's own."""
        return self.table.wavelengths_nm

    @property
    def isotropic(self) -> bool:
        """Isotropy: the grid has no azimuth about the normal."""
        return len(self.table.axes) == 3

    def eval(self, wi, wo):
        """f_r in 1/sr."""
        at = frame_angles(self.table.frame, wi, wo, not self.isotropic)
        positions = [axis.position(at.angles[axis.name]) for axis in self.table.axes]
        below = [
            np.minimum(p.astype(np.intp), axis.size - 2) for p, axis in zip(positions, self.table.axes, strict=True)
        ]
        total, weight = np.zeros((len(at.scale), len(self.wavelengths_nm))), np.zeros(len(at.scale))
        for corner in product((0, 1), repeat=len(below)):
            index = tuple(b + c for b, c in zip(below, corner, strict=True))
            share = np.prod(
                [p - b if c else 1.0 - (p - b) for p, b, c in zip(positions, below, corner, strict=True)], axis=0
            )
            share = share * self.table.reached[index]
            total += share[:, None] * self.table.values[index]
            weight += share
        lit = at.scale > 0
        # Frame io holds the cosine, and its scale is 1: divide it out. A pair whose corners are all out of reach is 0.
        cosine = np.cos(at.angles["theta_i"]) if self.table.frame == "io" else 1.0
        divisor = np.where(lit & (weight > 0), weight * cosine, np.inf)
        return (total / divisor[:, None]).reshape(*at.batch, -1)


def pairs(count: int = 500, steepest: float = 75.0) -> tuple[np.ndarray, np.ndarray]:
    u, top = np.random.default_rng(4).random((4, count)), np.radians(steepest)
    return spherical(u[0] * top, u[1] * TURN), spherical(u[2] * top, u[3] * TURN)


@pytest.mark.parametrize(("frame", "axes"), [("io", IO), ("hd", HD)])
def test_look_up_in_either_frame_gives_the_brdf_back(frame, axes):
    brdf = AshikhminShirley(RED, GREY, 10.0, 10.0)
    wi, wo = pairs()
    truth, found = brdf.eval(wi, wo), TabulatedBrdf(tabulate(brdf, frame, axes)).eval(wi, wo)
    off = np.abs(found / truth - 1.0)
    worst = np.unravel_index(np.argmax(off), off.shape)
    # In frame io the crease at theta_i = theta_o runs diagonally through the cells.
    evidence = f"{frame}: {found[worst]} for {truth[worst]} at {wi[worst[0]]}, {wo[worst[0]]}"
    assert off.max() < (0.15 if frame == "io" else 0.04), evidence


@pytest.mark.parametrize(("frame", "axes"), [("io", IO), ("hd", HD)])
def test_nodes_are_exact(frame, axes):
    brdf = AshikhminShirley(RED, GREY, 10.0, 10.0)
    table = tabulate(brdf, frame, axes)
    wi, wo = node_directions(frame, axes)
    inside = (wi[..., 2] > 0.05) & (wo[..., 2] > 0.05)
    found = TabulatedBrdf(table).eval(wi[inside], wo[inside])
    np.testing.assert_allclose(found, brdf.eval(wi[inside], wo[inside]), rtol=1e-8)


def test_out_of_reach_nodes_are_masked_zero_and_take_no_part():
    brdf = AshikhminShirley(RED, GREY, 10.0, 10.0)
    table = tabulate(brdf, "hd", HD)
    wi, wo = io_from_half_difference(*np.meshgrid(*(axis.nodes for axis in HD), indexing="ij"))
    below = (wi[..., 2] <= 0) | (wo[..., 2] <= 0)
    assert 0.1 < below.mean() < 0.5
    assert not table.reached[below].any()
    assert not table.values[~table.reached].any()
    spiked = table.values.copy()
    spiked[~table.reached] = 1e9
    wi, wo = pairs(steepest=89.0)
    np.testing.assert_array_equal(
        TabulatedBrdf(dataclasses.replace(table, values=spiked)).eval(wi, wo), TabulatedBrdf(table).eval(wi, wo)
    )


@pytest.mark.parametrize(("frame", "axes"), [("io", IO), ("hd", HD)])
def test_grazing_to_89_9_degrees_is_finite(frame, axes):
    wi, wo = pairs(2000, steepest=89.9)
    wi = np.concatenate([wi, np.tile(spherical(np.radians(89.9), 0.3), (2000, 1))])
    wo = np.concatenate([wo, spherical(np.radians(89.9), np.linspace(0.0, TURN, 2000))])
    found = TabulatedBrdf(tabulate(AshikhminShirley(RED, GREY, 50.0, 50.0), frame, axes)).eval(wi, wo)
    assert np.isfinite(found).all()
    assert (found >= 0).all()


def test_lambert_is_exact_up_to_the_horizon_in_frame_hd():
    found = TabulatedBrdf(tabulate(Lambert(RED), "hd", HD)).eval(*pairs(2000, steepest=88.0))
    np.testing.assert_allclose(found, np.broadcast_to(RED.samples / np.pi, found.shape), rtol=1e-12)


def test_below_the_horizon_is_zero():
    table = tabulate(Lambert(RED), "io", IO)
    up, down = np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, -0.8]])
    assert not TabulatedBrdf(table).eval(up, down).any()
    assert not TabulatedBrdf(table).eval(down, up).any()


@pytest.mark.slow_cases("hd-axes1")
@pytest.mark.parametrize(
    ("frame", "axes"),
    [
        ("io", (*IO[:2], Axis("phi", 33, TURN, periodic=True), Axis("phi_i", 33, TURN, periodic=True))),
        ("hd", (*HD[:2], Axis("phi_d", 33, TURN, periodic=True), Axis("phi_h", 33, TURN, periodic=True))),
    ],
)
def test_anisotropic_tables_have_an_azimuth(frame, axes):
    brdf = AshikhminShirley(RED, GREY, 4.0, 12.0)
    tabulated = TabulatedBrdf(tabulate(brdf, frame, axes))
    assert not tabulated.isotropic
    wi, wo = pairs(300, steepest=60.0)
    truth, found = brdf.eval(wi, wo), tabulated.eval(wi, wo)
    assert np.abs(found / truth - 1.0).max() < 0.08


def test_spectra_are_projected_while_tabulating():
    brdf = AshikhminShirley(RED, GREY, 10.0, 10.0)
    columns = np.array([[1.0, 0.5], [0.0, 1.0], [-1.0, 0.25]])
    whole, projected = tabulate(brdf, "hd", HD), tabulate(brdf, "hd", HD, columns)
    np.testing.assert_allclose(projected.values, whole.values @ columns, atol=1e-12)


def test_a_table_that_does_not_fit_its_axes_is_refused():
    table = tabulate(Lambert(RED), "io", IO)
    with pytest.raises(InputError, match="do not belong"):
        BrdfTable("hd", IO, WAVELENGTHS_NM, table.values, table.reached)
    with pytest.raises(InputError, match="does not fit"):
        BrdfTable("io", IO, WAVELENGTHS_NM, table.values[1:], table.reached[1:])


def lobes_of(spectrum, roughness=0.3):
    return CoatedDiffuse(spectrum, 1.5, roughness).lobes()


def test_coats_over_other_bodies_share_a_table_whose_packs_are_those_of_their_own():
    observed = np.array([[0.2, 0.1, 0.6], [0.3, 0.7, 0.1], [0.4, 0.2, 0.0]])
    (body, coat), (other_body, other_coat) = lobes_of(RED), lobes_of(GREY)
    axes = {"io": tuple(Axis(axis.name, 9, axis.maximum, axis.warp) for axis in IO)}
    axes["hd"] = tuple(Axis(axis.name, 9, axis.maximum, axis.warp) for axis in HD)
    shared = LobeTable.shared(coat, observed, axes["hd"])
    assert LobeTable.shared(other_coat, observed, axes["hd"]) is shared
    own = LobeTable.of(other_coat, observed, axes["hd"])
    np.testing.assert_array_equal(own.values, shared.values)
    for rank, seed, method in ((1, 0, "joint"), (2, 0, "joint"), (2, 1, "joint"), (2, 0, "refitted"), (2, 0, "joint")):
        (pack, left), (expected, residual) = (table.pack(rank, seed, method) for table in (shared, own))
        assert left == residual
        for found, factor in zip((*pack.factors, pack.spectra), (*expected.factors, expected.spectra), strict=True):
            np.testing.assert_array_equal(found, factor)
    # Whatever the table depends on tells it from others.
    assert LobeTable.shared(other_coat, 2.0 * observed, axes["hd"]) is not shared
    assert LobeTable.shared(lobes_of(RED, 0.2)[1], observed, axes["hd"]) is not shared
    assert LobeTable.shared(body, observed, axes["io"]) is not LobeTable.shared(other_body, observed, axes["io"])
    facets = CookTorrance(RED, np.full(3, 1.5), np.zeros(3), 0.3, 1.0).lobes()[0]
    assert LobeTable.shared(facets, observed, axes["hd"]) is not LobeTable.shared(facets, observed, axes["hd"])
