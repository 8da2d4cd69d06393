"""Hard cases of whole fits: spectra of one band, line light, wrap-around, trials as they go."""

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, OrenNayar
from metamer.materials.core.directions import spherical
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.factored.pack import FactoredBrdf
from metamer.materials.fitting.fit import fit
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

L = len(WORKING_WAVELENGTHS_NM)
PIXELS = 48
RED = Spectrum.sampled(WORKING_WAVELENGTHS_NM, 0.05 + 0.6 * np.linspace(0.0, 1.0, L) ** 2)
BAND = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.where(WORKING_WAVELENGTHS_NM == 550.0, 0.9, 0.0))
GREY = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(L, 0.04))


def test_spectra_that_are_zero_but_in_one_band():
    found = fit(OrenNayar(BAND, 0.35), pixels=PIXELS)
    assert found.error.p99 <= 0.7
    lit = np.flatnonzero(WORKING_WAVELENGTHS_NM == 550.0)
    for pack in found.fast.packs:
        dark = np.delete(pack.palette.values[0], lit, axis=1)
        assert np.abs(dark).max() < 1e-6 * np.abs(pack.palette.values[0]).max()


def test_a_light_of_one_line_a_nanometre_wide():
    brdf = AshikhminShirley(RED, GREY, 20.0, 20.0)
    packs = fit(brdf, pixels=PIXELS).fast.packs
    line = np.arange(540.0, 553.0)
    light = Spectrum.sampled(line, np.where(line == 546.0, 1.0, 0.0), "emission")
    weights = observer("1931_2").weights(light, WORKING_WAVELENGTHS_NM).T
    sphere = sphere_protocol(PIXELS)
    original, ours = (
        np.pi * (it.eval(sphere.wi, sphere.wo) @ weights) * sphere.wi[:, 2:] for it in (brdf, FactoredBrdf(packs))
    )
    assert np.abs(weights).max() > 0
    error = np.percentile(np.abs(ours - original)[:, 1], 99)
    assert error < 0.01 * original[:, 1].max(), (error, original[:, 1].max())


def test_the_azimuth_wraps_around_without_a_seam():
    packs = fit(AshikhminShirley(RED, GREY, 20.0, 20.0), pixels=PIXELS).fast.packs
    turn = 2.0 * np.pi
    wi, near = spherical(np.full(4, 0.8), 0.0), 1e-7
    either = [spherical(np.full(4, 0.6), np.array([0.0, near, turn - near, turn])), spherical(np.full(4, 0.6), np.pi)]
    for wo in either:
        shaded = sum(pack.shade(wi, wo) for pack in packs)
        np.testing.assert_allclose(shaded, np.broadcast_to(shaded[:1], shaded.shape), rtol=1e-4)


@pytest.mark.slow
def test_the_order_of_materials_does_not_matter():
    """With joint refinement too: a budget out of reach makes sure that it runs."""
    brdfs = [OrenNayar(RED, 0.35), AshikhminShirley(RED, GREY, 4.0, 4.0)]
    forward = [fit(brdf, budget=1e-6, ranks=(2,), pixels=16) for brdf in brdfs]
    backward = [fit(brdf, budget=1e-6, ranks=(2,), pixels=16) for brdf in reversed(brdfs)][::-1]
    assert all(any(trial.joint for trial in found.trials) for found in forward)
    for one, other in zip(forward, backward, strict=True):
        for a, b in zip(one.fast.packs, other.fast.packs, strict=True):
            np.testing.assert_array_equal(a.palette.values, b.palette.values)


def test_every_trial_is_told_and_the_best_is_kept():
    trials = []
    found = fit(AshikhminShirley(RED, GREY, 20.0, 20.0), pixels=PIXELS, tried=trials.append)
    assert {trial.lobe for trial in trials} == {0, 1}
    for lobe, pack in enumerate(found.fast.packs):
        own = [trial for trial in trials if trial.lobe == lobe]
        assert [trial.rank for trial in own] == sorted(trial.rank for trial in own)
        assert [trial.rank for trial in own if trial.kept][-1] == pack.rank


@pytest.mark.slow_cases("hd")
@pytest.mark.parametrize("frame", ["io", "hd"])
def test_a_frame_can_be_asked_for(frame):
    found = fit(OrenNayar(RED, 0.35), budget=50.0, frame=frame, ranks=(1,), pixels=PIXELS)
    assert [pack.frame for pack in found.fast.packs] == [frame]


@pytest.mark.slow_cases("weighted")
@pytest.mark.parametrize("method", ["weighted", "incremental", "refitted"])
def test_every_method_is_judged_by_the_same_protocol(method):
    brdf = OrenNayar(RED, 0.35)
    found = fit(brdf, budget=1e-6, ranks=(8,), pixels=PIXELS, method=method)
    assert found.rank == 8
    assert [trial.joint for trial in found.trials] == [False]
    sphere = sphere_protocol(PIXELS).under(found.error.light)
    again = sphere.compare(sphere.reference(brdf), sphere.sample(found.fast))
    assert again.p99 == pytest.approx(found.error.p99, rel=1e-6)
    assert found.error.p99 < 3.0
    smooth = fit(brdf, budget=1e-6, ranks=(8,), pixels=PIXELS, method=method, smooth=True)
    assert not np.array_equal(smooth.fast.packs[0].factors[0], found.fast.packs[0].factors[0])


def test_packs_come_as_they_are_stored_and_are_measured_as_such():
    brdf = AshikhminShirley(RED, GREY, 20.0, 20.0)
    half, single = (fit(brdf, pixels=PIXELS, precision=precision) for precision in ("auto", "single"))
    assert half.storage.half and "half precision adds" in half.storage.reason
    assert {pack.precision for pack in half.fast.packs} == {"half"}
    for pack in half.fast.packs:
        for factor in pack.factors:
            np.testing.assert_array_equal(factor.astype(np.float16), factor)
    assert {pack.precision for pack in single.fast.packs} == {"single"}
    assert single.error != half.error
    assert half.error.p99 == pytest.approx(single.error.p99, abs=0.1)
    assert half.stored_bytes < 0.75 * single.stored_bytes
    assert half.stopped == "budget met"
