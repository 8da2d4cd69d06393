"""Cook-Torrance against an independent implementation, Mitsuba's `roughconductor`, where Mitsuba is installed."""

import numpy as np
import pytest
from metamer.materials.analytic import CookTorrance
from metamer.materials.core.directions import TAU, spherical
from metamer.spectral.spectrum import Spectrum

pytestmark = pytest.mark.mitsuba

WAVELENGTHS = np.array([450.0, 550.0, 650.0])


@pytest.fixture
def mitsuba():
    module = pytest.importorskip("mitsuba", reason="the optional extra: pip install 'metamer-colour[mitsuba]'")
    before = module.variant()
    module.set_variant("scalar_spectral")
    yield module
    if before:
        module.set_variant(before)


@pytest.mark.parametrize("eta, k, roughness", [(1.5, 0.001, 0.3), (0.2, 3.6, 0.2), (2.9, 3.3, 0.6)])
@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
def test_cook_torrance_with_smith_masking_is_roughconductor(mitsuba, distribution, eta, k, roughness):
    black = Spectrum.sampled(WAVELENGTHS, np.zeros(3))
    brdf = CookTorrance(black, np.full(3, eta), np.full(3, k), roughness, 1.0, distribution, "smith")
    random = np.random.default_rng(0)
    wi, wo = (spherical(np.arccos(random.uniform(0.05, 1, 200)), random.random(200) * TAU) for _ in "io")
    # Mitsuba's wi is where the light is asked for from (the viewer), and its value includes the light's cosine.
    ours = brdf.eval(wi, wo)[:, 1] * wi[:, 2]
    twin = mitsuba.load_dict(
        {
            "type": "roughconductor",
            "distribution": distribution,
            "alpha": roughness,
            "eta": {"type": "uniform", "value": eta},
            "k": {"type": "uniform", "value": k},
        }
    )
    theirs = []
    for light, viewer in zip(wi, wo, strict=True):
        interaction = mitsuba.SurfaceInteraction3f()
        interaction.wi, interaction.wavelengths = mitsuba.Vector3f(*viewer), 550.0
        theirs.append(float(twin.eval(mitsuba.BSDFContext(), interaction, mitsuba.Vector3f(*light))[0]))
    # Mitsuba computes in float32.
    np.testing.assert_allclose(theirs, ours, rtol=2e-5, atol=1e-6 * ours.max())
