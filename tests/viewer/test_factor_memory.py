"""What fitting takes, counted without the evaluations of the BRDF."""

import numpy as np
import pytest
from metamer.materials.analytic import OrenNayar
from metamer.materials.brdf import Brdf, Lobe
from metamer.materials.factors import Axis, FactorPack
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.factor_memory import spectral_size, table_bytes, timed_and_weighed

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
    found, seconds, peak = timed_and_weighed(Wasteful(), work(first, second))
    assert found == second * MEGABYTE // 8 and seconds > 0
    assert 5 * MEGABYTE <= peak < 6 * MEGABYTE


def test_spectral_size_is_the_rank_of_the_spectra():
    rng = np.random.default_rng(0)
    matt = OrenNayar(Spectrum.sampled(NM, np.full(NM.size, 0.5), "reflectance"), 0.0)
    assert spectral_size(matt) == 1

    class Two(Brdf):
        wavelengths_nm, isotropic = NM, True
        spectra = rng.uniform(0.1, 1.0, (2, NM.size))

        def eval(self, wi, wo):
            wi, wo = np.broadcast_arrays(wi, wo)
            return np.stack([wi[..., 2], wo[..., 2] ** 2], axis=-1) @ self.spectra

    assert spectral_size(Two()) == 2


def test_table_has_the_nodes_of_the_pack_and_the_spectra_of_the_lobe():
    """Also where a pack has fewer terms than the spectra have dimensions."""
    axes = (Axis("theta_i", 5, 1.5), Axis("theta_o", 4, 1.5), Axis("phi", 3, 3.0))
    factors = tuple(np.ones((axis.size, 1)) for axis in axes)
    pack = FactorPack("io", axes, factors, np.ones((1, NM.size)), SpectralBasis.sampled(NM))
    rough = OrenNayar(Spectrum.sampled(NM, np.linspace(0.1, 0.9, NM.size), "reflectance"), 0.5)
    size = spectral_size(rough)
    assert size == 2 and table_bytes(rough, (pack,)) == 8 * 5 * 4 * 3 * size
