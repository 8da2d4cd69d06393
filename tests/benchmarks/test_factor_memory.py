"""Memory that fitting takes, counted without the evaluations of the BRDF."""

import numpy as np
import pytest
from metamer.benchmarks.factor.memory import table_bytes, timed_and_weighed
from metamer.materials.analytic import OrenNayar
from metamer.materials.core.axes import Axis
from metamer.materials.core.brdf import Brdf, Lobe
from metamer.materials.fitting.fit import fit
from metamer.spectral.spectrum import Spectrum

NM = np.arange(380.0, 781.0, 5.0)
UP = np.array([[0.0, 0.0, 1.0]])
MEGABYTE = 1 << 20


class Wasteful(Brdf):
    """Takes 64 MB for each evaluation and gives them back; two lobes of itself."""

    wavelengths_nm = NM
    isotropic = True

    def eval(self, wi, wo):
        wasted = np.ones(8 * MEGABYTE)
        return np.zeros((*np.broadcast_shapes(wi.shape, wo.shape)[:-1], NM.size)) * wasted[0]

    def lobes(self):
        return (Lobe("io", self), Lobe("hd", self))


def work(first, second):
    """Holds `first` MB between the evaluations of the first and of the second lobe, then `second` MB."""

    def run(brdf):
        one, other = brdf.lobes()
        one.brdf.eval(UP, UP)
        held = np.ones(first * MEGABYTE // 8)
        del held
        other.brdf.eval(UP, UP)
        held = np.ones(second * MEGABYTE // 8)
        return held.size

    return run


@pytest.mark.parametrize(("first", "second"), [(5, 2), (2, 5)])
def test_evaluations_do_not_count_and_every_stretch_between_them_does(first, second):
    found, seconds, again, peak = timed_and_weighed(Wasteful(), work(first, second))
    assert again == found == second * MEGABYTE // 8 and seconds > 0
    assert 5 * MEGABYTE <= peak < 6 * MEGABYTE


def test_table_is_the_one_that_packs_were_found_from():
    """Two spectral dimensions, also where a pack has fewer terms than that."""
    rough = OrenNayar(Spectrum.sampled(NM, np.linspace(0.1, 0.9, NM.size), "reflectance"), 0.5)
    axes = (Axis("theta_i", 9, 1.5), Axis("theta_o", 8, 1.5), Axis("phi", 7, np.pi))
    found = fit(rough, budget=5.0, ranks=(1,), axes=axes, pixels=32)
    assert found.rank == 1 and found.fast.packs[0].axes == axes
    assert table_bytes(rough, found) == 8 * 9 * 8 * 7 * 2
