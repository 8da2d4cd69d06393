"""A BRDF out of readings at several angles: what it keeps to, what it tells, and how near it comes to other paints."""

import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from metamer.materials.core.directions import spherical
from metamer.materials.effect_coating import flake_tilt
from metamer.materials.effect_coating.coated_pair import CoatedPair
from metamer.materials.effect_coating.fit import AngleReadings, body_albedo, reconstructed
from metamer.materials.effect_coating.flake_tilt import FlakeTilt
from metamer.materials.effect_coating.off_specular import light_and_detector
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.measurement import geometry_in
from metamer.spectral.observers import observer

NM = np.arange(400.0, 701.0, 10.0)
SIX = tuple(f"45as{away}" for away in (-15, 15, 25, 45, 75, 110))
FIVE, THREE = SIX[1:], ("45as15", "45as45", "45as110")
TWELVE = (*SIX, *(f"15as{away}" for away in (-45, -30, -15, 15, 45, 80)))
SIXTEEN = (*TWELVE, "45as25az90", "45as60az125.3", "15as38.3az43", "15as46.9az104.5")
BLUE = 0.05 + 0.3 * np.exp(-(((NM - 450.0) / 40.0) ** 2))
RED = 0.03 + 0.4 / (1.0 + np.exp(-(NM - 600.0) / 12.0))


def directions(notations):
    return light_and_detector([geometry_in(one) for one in notations])


def read(paint, notations=SIX, noise=0.0):
    wi, wo = directions(notations)
    random = np.random.default_rng(5)
    values = paint(wi, wo) * (1.0 + noise * random.standard_normal((len(wi), 1)))
    return AngleReadings(NM, wi, wo, values)


def hemisphere(count=400, seed=3, steepest=80.0, mirror=7.0):
    """Pairs of directions that are not near the mirror's."""
    random = np.random.default_rng(seed)
    theta = np.arccos(1.0 - (1.0 - np.cos(np.radians(steepest))) * random.random((2, 4 * count)))
    wi, wo = spherical(theta[0], 0.0), spherical(theta[1], 2.0 * np.pi * random.random(4 * count))
    far = np.sum(wi * (-1.0, -1.0, 1.0) * wo, axis=1) < np.cos(np.radians(mirror))
    return wi[far][:count], wo[far][:count]


def differences(reference, sample, wi=None):
    """ΔE94 of f_r under D65 for 10 degrees."""
    weights = observer("1964_10").weights(illuminant("D65"), NM).T
    seen = np.pi if wi is None else np.pi * wi[:, 2:]
    return delta_e_xyz(seen * reference @ weights, seen * sample @ weights, weights.sum(axis=0))


def matt(colour):
    return lambda wi, wo: np.broadcast_to(colour / np.pi, (len(wi), len(NM)))


def metallic(colour=BLUE, flakes=0.5, width=0.2, coat=0.01):
    """Flakes whose tilts are Gaussian, over a matt base, under a coat of Schlick's reflectance: no flake-tilt model."""

    def evaluate(wi, wo):
        pair = CoatedPair.of(wi, wo)
        through = (1.0 - schlick(wi[:, 2])) * (1.0 - schlick(wo[:, 2]))
        leaning = np.exp(-((pair.tilt / width) ** 2)) / (np.pi * width**2)
        half = wi + wo
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        tan2 = 1.0 / half[:, 2] ** 2 - 1.0
        gloss = np.exp(-tan2 / coat**2) / (np.pi * coat**2 * half[:, 2] ** 4) * schlick(np.sum(half * wi, axis=1)) / 4.0
        body = np.outer(through, colour / np.pi) + np.outer(through * leaning, flakes * (0.4 + 0.6 * colour)) / 8.0
        return body + (gloss / np.maximum(wi[:, 2], wo[:, 2]))[:, None]

    return evaluate


def schlick(cosine):
    return 0.04 + 0.96 * (1.0 - cosine) ** 5


def pearl(index, thickness_nm, base=0.03, width=0.15):
    """Flakes with a thin film of that index: two beams interfere."""

    def evaluate(wi, wo):
        pair = CoatedPair.of(wi, wo)
        within = np.sqrt(1.0 - (1.5 / index * np.sin(pair.incidence)) ** 2)
        phase = 4.0 * np.pi * index * thickness_nm * within[:, None] / NM
        return pair.flakes(width)[:, None] * (0.52 - 0.5 * np.cos(phase)) + np.outer(pair.matt(), base + 0.0 * NM)

    return evaluate


PAINTS = {
    "matt": matt(RED),
    "aluminium": metallic(np.full(len(NM), 0.03), 0.9, 0.12),
    "blue metallic": metallic(),
    "fine flakes": metallic(RED, 0.3, 0.35),
    "semi-gloss red": metallic(RED, 0.0, 0.2, coat=0.25),
    "pearl": pearl(1.46, 350.0),
    "black": matt(np.full(len(NM), 1e-5)),
}


@cache
def reconstructed_of(name, angles):
    """A paint's model, of readings without noise."""
    return reconstructed(read(PAINTS[name], angles))


@pytest.mark.parametrize("angles", [THREE, FIVE, SIX, TWELVE, SIXTEEN], ids=len)
@pytest.mark.parametrize("name", PAINTS)
def test_light_and_eye_may_change_places_and_nothing_is_negative(name, angles):
    brdf = reconstructed_of(name, angles)
    wi, wo = hemisphere(steepest=89.999, mirror=0.0)
    one, other = brdf.eval(wi, wo), brdf.eval(wo, wi)
    assert np.isfinite(one).all() and (one >= 0.0).all()
    assert one == pytest.approx(other, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", PAINTS)
@pytest.mark.parametrize(("angles", "mean", "most"), [(SIX, 0.1, 0.5), (TWELVE, 0.2, 1.5)], ids=["six", "twelve"])
def test_it_goes_through_its_readings(name, angles, mean, most):
    readings, brdf = read(PAINTS[name], angles), reconstructed_of(name, angles)
    off = differences(readings.values, brdf.eval(readings.wi, readings.wo))
    assert off.mean() <= mean and off.max() <= most
    assert body_albedo(brdf).max() <= 1.0 and brdf.scale == 1.0


@pytest.mark.parametrize("angles", [SIX, TWELVE], ids=len)
@pytest.mark.parametrize("name", PAINTS)
def test_it_is_nearer_to_a_paint_than_its_face_taken_for_matt(name, angles):
    wi, wo = hemisphere()
    true = PAINTS[name](wi, wo)
    readings = read(PAINTS[name], angles)
    found = differences(true, reconstructed(readings).eval(wi, wo), wi).mean()
    face = differences(true, np.broadcast_to(readings.values[SIX.index("45as45")], true.shape), wi).mean()
    # A matt paint is one already: the coat that is assumed over it costs something at grazing angles.
    assert found < (2.0 if name in ("matt", "black") else 0.6 * face + 0.3)


def test_a_matt_paint_comes_out_nearly_matt():
    wi, wo = hemisphere(steepest=60.0)
    brdf = reconstructed(read(matt(RED)))
    assert differences(matt(RED)(wi, wo), brdf.eval(wi, wo), wi).mean() < 0.7
    assert brdf.interference == 0.0


@pytest.mark.parametrize("width", [0.14, 0.2, 0.3])
def test_a_semi_gloss_coat_is_told_by_the_readings_and_a_glossy_one_is_assumed(width):
    assert reconstructed(read(metallic(RED, 0.0))).needle
    semi = reconstructed(
        read(lambda wi, wo: matt(RED)(wi, wo) + CoatedPair.of(wi, wo).coat(width, needle=False)[:, None])
    )
    assert not semi.needle and semi.coat_roughness == pytest.approx(width, rel=0.2)


def test_what_a_gloss_meter_says_of_the_coat_is_kept():
    brdf = reconstructed(read(metallic()), needle=0.012)
    assert brdf.needle and brdf.coat_roughness == 0.012


FILMS = [(2.5, 80.0), (2.5, 120.0), (1.46, 250.0), (1.46, 350.0), (1.38, 400.0), (1.6, 300.0), (2.9, 100.0)]


@pytest.mark.parametrize(("index", "thickness"), FILMS)
def test_interference_is_told_by_readings_of_one_tilt(index, thickness):
    found = reconstructed(read(pearl(index, thickness)))
    assert found.interference == pytest.approx((1.5 / index) ** 2, rel=0.3)
    wi, wo = hemisphere(steepest=65.0)
    true = pearl(index, thickness)(wi, wo)
    blind = reconstructed(read(pearl(index, thickness)), interference=0.0)
    off, without = (differences(true, one.eval(wi, wo), wi).mean() for one in (found, blind))
    assert off < 0.9 * without


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("name", ["matt", "aluminium", "blue metallic", "fine flakes", "semi-gloss red", "black"])
def test_paints_without_interference_have_none(name, noise):
    assert reconstructed(read(PAINTS[name], SIX, noise)).interference == 0.0


@pytest.mark.parametrize("angles", [THREE, FIVE, SIX[:2] + SIX[3:4]], ids=["three", "five", "one behind"])
def test_without_two_readings_of_one_tilt_interference_is_not_told(angles):
    readings = read(pearl(1.46, 350.0), angles)
    told = "45as-15" in angles
    assert readings.tell_interference == told and (reconstructed(readings).interference > 0.0) == told


@pytest.mark.parametrize("count", [1, 2])
def test_too_few_angles_make_no_brdf(count):
    with pytest.raises(InputError, match="too few angles"):
        read(metallic(), SIX[:count])


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_reading_that_is_no_number_is_refused(bad):
    readings = read(metallic())
    values = readings.values.copy()
    values[2, 3] = bad
    with pytest.raises(InputError, match="no number"):
        replace(readings, values=values)


@pytest.mark.parametrize("dark", [-0.002, -1e-6, 0.0, 1e-6])
def test_a_black_flop_may_be_read_at_or_below_zero(dark):
    readings = read(metallic(np.full(len(NM), 0.02), 0.9, 0.1))
    values = readings.values.copy()
    values[4:] = dark
    brdf = reconstructed(replace(readings, values=values))
    wi, wo = hemisphere()
    assert np.isfinite(brdf.eval(wi, wo)).all()
    off = differences(np.maximum(values, 0.0), brdf.eval(readings.wi, readings.wo))
    assert off.max() <= 0.5


def test_a_silver_reflects_more_than_a_perfect_diffuser_beside_the_mirror():
    silver = metallic(np.full(len(NM), 0.1), 1.6, 0.12)
    readings = read(silver)
    assert np.pi * readings.values.max() > 3.0
    off = differences(readings.values, reconstructed(readings).eval(readings.wi, readings.wo))
    assert off.max() <= 0.5 and reconstructed(readings).scale == 1.0


def test_the_order_of_the_angles_changes_nothing():
    readings = read(metallic(), TWELVE)
    order = np.random.default_rng(1).permutation(12)
    turned = AngleReadings(NM, readings.wi[order], readings.wo[order], readings.values[order])
    wi, wo = hemisphere()
    assert reconstructed(turned).eval(wi, wo) == pytest.approx(reconstructed(readings).eval(wi, wo), rel=1e-6)


def test_an_instrument_may_light_from_where_another_one_looks():
    readings = read(metallic())
    inverse = AngleReadings(NM, readings.wo, readings.wi, readings.values)
    wi, wo = hemisphere()
    assert reconstructed(inverse).eval(wi, wo) == pytest.approx(reconstructed(readings).eval(wi, wo), rel=1e-9)


def test_a_body_that_would_reflect_more_than_it_receives_is_made_darker():
    wi, wo = directions(SIX)
    brdf = reconstructed(AngleReadings(NM, wi, wo, np.full((6, len(NM)), 2.0 / np.pi)))
    assert brdf.scale < 1.0
    assert (brdf.scale * body_albedo(brdf)).max() == pytest.approx(1.0)


def test_it_is_rebuilt_from_its_parameters_bit_for_bit():
    brdf = reconstructed(read(pearl(2.5, 120.0)))
    again = FlakeTilt.from_parameters(brdf.parameters())
    wi, wo = hemisphere()
    assert np.array_equal(again.eval(wi, wo), brdf.eval(wi, wo))
    kept = brdf.parameters()
    del kept["tilts"]
    with pytest.raises(InputError, match="not complete"):
        FlakeTilt.from_parameters(kept)


def test_a_record_does_not_change_with_the_constants_of_another_version(monkeypatch):
    brdf = reconstructed(read(PAINTS["blue metallic"]))
    kept, wi, wo = brdf.parameters(), *hemisphere()
    before = brdf.eval(wi, wo)
    for name in ("FLOOR", "TILT_LENGTH", "INCIDENCE_LENGTH"):
        monkeypatch.setattr(flake_tilt, name, 0.1)
    assert np.array_equal(FlakeTilt.from_parameters(kept).eval(wi, wo), before)


def test_a_fit_takes_a_tenth_of_a_second():
    readings = read(metallic(), SIXTEEN)
    reconstructed(readings)
    start = time.process_time()
    reconstructed(readings)
    assert time.process_time() - start < 0.5


@pytest.mark.parametrize(
    ("notation", "polar", "azimuth"),
    [
        ("45as25az90", 50.1, 33.4),
        ("45as60az125.3", 45.0, 90.0),
        ("15as38.3az43", 50.1, 33.4),
        ("15as46.9az104.5", 45.0, 90.0),
    ],
)
def test_detectors_out_of_plane_are_two_fixed_ones(notation, polar, azimuth):
    _, wo = directions([notation])
    assert np.degrees(np.arccos(wo[0, 2])) == pytest.approx(polar, abs=0.1)
    assert np.degrees(np.arctan2(wo[0, 1], -wo[0, 0])) == pytest.approx(azimuth, abs=0.1)


def test_a_light_that_is_not_stated_or_a_detector_below_the_surface_is_refused():
    for notation in ("as15", "45as-60", "45as140"):
        with pytest.raises(InputError, match="above the surface"):
            directions([notation])
