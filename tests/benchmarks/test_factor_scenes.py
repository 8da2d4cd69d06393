"""The protocol's spheres as scenes, and fluorescent surfaces drawn on them."""

import numpy as np
import pytest
from metamer.benchmarks.factor import fluorescence
from metamer.benchmarks.factor.cases import fluorescent_cases
from metamer.benchmarks.factor.figures import fluorescent_figures
from metamer.benchmarks.factor.scenes import lit_pixels, picture_statistics, reference_xyz, rendered_xyz
from metamer.benchmarks.fluorescence import made_up
from metamer.materials.analytic import OrenNayar
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.factored.pack import FactoredBrdf
from metamer.materials.fitting.fit import fit
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.software.backend import software_session

NM = np.arange(380.0, 781.0, 5.0)
PIXELS, ANGLES = 20, (35.0, 80.0)
D65 = {"D65": illuminant("D65")}


@pytest.fixture(scope="module")
def drawn():
    with software_session() as renderer:
        return fluorescence.draw(renderer, FluorescentLambert(made_up()[0]), PIXELS, ANGLES)


def test_lit_pixels_are_those_of_the_protocol():
    lit = lit_pixels(64, (10.0,))
    # The protocol has the upper half only, and the whole outline.
    assert lit.sum() == pytest.approx(2 * len(sphere_protocol(64, True, (10.0,)).wi), rel=0.02)


def test_renderer_and_rays_agree_as_the_protocol_says():
    """An error on the scenes is that of the packs on the protocol's directions."""
    brdf = OrenNayar(Spectrum.sampled(NM, np.linspace(0.2, 0.8, NM.size), "reflectance"), 0.5)
    packs = fit(brdf, budget=5.0, ranks=(2,), pixels=32).fast.packs
    with software_session() as renderer:
        shown = rendered_xyz(renderer, packs, D65, 48)
    found = picture_statistics(reference_xyz(brdf, D65, 48)[0], shown[0], D65["D65"])
    protocol = sphere_protocol(96, True)
    expected = protocol.compare(protocol.reference(brdf), protocol.sample(FactoredBrdf(packs)))
    assert found["mean"] == pytest.approx(expected.mean, rel=0.1)
    assert found["p95"] == pytest.approx(expected.p95, rel=0.1)


def test_statistics_are_of_lit_pixels_only():
    reference = np.full((1, 8, 8, 3), 0.5)
    sample = np.where(lit_pixels(8, (0.0,))[..., None], reference, 0.0)
    assert picture_statistics(reference, sample, D65["D65"], (0.0,)) == dict.fromkeys(
        ("mean", "p95", "p99", "max"), 0.0
    )


def test_drawn_fluorescence_is_the_full_matrix(drawn):
    lit = lit_pixels(PIXELS, ANGLES)
    white = observer("1931_2").white(D65["D65"])
    assert np.percentile(delta_e_xyz(drawn.reference[0][lit], drawn.packs[0][lit], white), 99) < 0.1


def test_what_leaves_fluorescence_out_is_right_where_it_was_measured(drawn):
    lit = lit_pixels(PIXELS, ANGLES)
    lights = fluorescence.row_lights()
    assert tuple(lights) == ("D65", "A", "D65 UV-free")
    for index, (name, light) in enumerate(lights.items()):
        white = observer("1931_2").white(light)
        far = {
            key: float(np.percentile(delta_e_xyz(drawn.reference[index][lit], found[index][lit], white), 99))
            for key, found in drawn.without.items()
        }
        assert far["diagonal"] > 2.0, (name, far)
        assert (far["reflectance"] < 0.2 and far["rgb"] < 0.1) == (name == "D65"), (name, far)


def test_reflectance_of_a_fluorescent_surface_exceeds_its_diagonal():
    brdf = FluorescentLambert(made_up()[0])
    pack = fluorescence.reflectance_pack(brdf, D65["D65"])
    diagonal = brdf.bispectral.reflectance.samples
    assert np.all(pack.palette.values[0][0] >= diagonal - 1e-12) and np.any(pack.palette.values[0][0] > diagonal + 0.05)


def test_card_has_every_picture_and_the_polar_plot_the_emission(drawn):
    case = fluorescent_cases()[0]
    card = fluorescent_figures(case, FluorescentLambert(made_up()[0]), drawn, PIXELS)
    assert [shown["light"] for shown in card["pictures"]] == list(fluorescence.row_lights())
    assert all(len(shown["shots"]) == 7 for shown in card["pictures"])
    radii = {name: np.array(curve) for name, curve in card["polar"]["radii"].items()}
    np.testing.assert_allclose(radii["packs"], radii["reference"], rtol=1e-4)
    assert np.all(radii["diagonal"] < 0.95 * radii["reference"])
