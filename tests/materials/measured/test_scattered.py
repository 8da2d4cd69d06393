"""The continuous BRDF through scattered measurements: its symmetries, its limits, and how well it predicts."""

import json
from dataclasses import replace

import numpy as np
import pytest
from metamer.benchmarks import scattered as benchmark
from metamer.materials.core.directions import half_difference, io_angles, io_from_half_difference, spherical
from metamer.materials.formats.cornell import read_cornell
from metamer.materials.measured.measurement import ScatteredMeasurement, estimated_background, prepared
from metamer.materials.measured.scattered import ScatteredBrdf
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

WAVELENGTHS = np.arange(400.0, 701.0, 50.0)
COLOUR = np.array([0.02, 0.03, 0.06, 0.12, 0.2, 0.22, 0.2])


def painted(wi, wo):
    """A glossy paint (N,L): a coloured base under a neutral lobe that grows towards grazing; reciprocal."""
    theta_h, theta_d, _, _ = half_difference(wi, wo)
    lobe = 0.5 * np.exp(-((np.tan(theta_h) / 0.2) ** 2)) * (0.04 + (1 - np.cos(theta_d)) ** 5)
    return COLOUR / np.pi + (lobe / (wi[..., 2] * wo[..., 2]))[..., None]


def measured(background=0.0, missing=0.0, seed=0):
    """Return what an instrument reports of the paint on a coarse grid of angles."""
    theta_i, theta_o, phi = np.radians(
        np.stack(np.meshgrid([10, 30, 50, 65, 80], [8, 25, 41, 59, 79], range(0, 181, 20)))
    )
    theta_i, theta_o, phi = theta_i.ravel(), theta_o.ravel(), phi.ravel()
    wi, wo = spherical(theta_i, 0.0 * theta_i), spherical(theta_o, phi)
    values = np.maximum(painted(wi, wo) - background / wi[:, 2:], 0.0)
    dropped = np.random.default_rng(seed).random(values.shape) < missing
    values[dropped] = 0.0
    return ScatteredMeasurement(WAVELENGTHS, wi, wo, values, dropped, "paint", "synthetic", ("none",))


def hemisphere(count, seed, steepest=89.9):
    random = np.random.default_rng(seed)
    least = np.cos(np.radians(steepest))
    z = least + (1 - least) * random.random(count)
    return spherical(np.arccos(z), 2 * np.pi * random.random(count))


@pytest.fixture(scope="module")
def paint():
    return ScatteredBrdf.from_measurement(measured())


@pytest.fixture(scope="module")
def shifted():
    """The paint through an instrument that subtracts too much."""
    return ScatteredBrdf.from_measurement(measured(background=0.004))


def worst(found, expected):
    gap = np.abs(found - expected)
    at = np.unravel_index(gap.argmax(), gap.shape)
    return f"at {at}: {found[at]!r} against {expected[at]!r}"


def test_goes_through_what_was_measured(paint):
    told = paint.measurement
    found = paint.eval_measured(told.wi, told.wo, exact=True)
    assert found == pytest.approx(told.values, rel=0.02, abs=2e-4), worst(found, told.values)


def test_between_the_measured_pairs(paint):
    wi, wo = hemisphere(500, 1, 75), hemisphere(500, 2, 75)
    assert np.median(np.abs(paint.eval_measured(wi, wo) / painted(wi, wo) - 1)) < 0.02


def test_table_agrees_with_the_interpolant_itself(paint):
    wi, wo = hemisphere(2000, 3, 85), hemisphere(2000, 4, 85)
    exact, looked_up = paint.eval_measured(wi, wo, exact=True), paint.eval_measured(wi, wo)
    assert looked_up == pytest.approx(exact, rel=0.03, abs=1e-4), worst(looked_up, exact)


def test_held_alike_beyond_the_measured_angles(paint):
    """At theta_d beyond the largest measured, table and interpolant follow the same policy."""
    wi = spherical(np.radians(np.linspace(81, 89, 9)), np.zeros(9))
    wo = spherical(np.radians(np.linspace(89, 82, 9)), np.full(9, 3.0))
    exact, looked_up = paint.eval_measured(wi, wo, exact=True), paint.eval_measured(wi, wo)
    assert looked_up == pytest.approx(exact, rel=0.05), worst(looked_up, exact)


def test_wavelengths_are_the_working_grid_with_ends_held(paint):
    assert np.array_equal(paint.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    wi, wo = hemisphere(20, 5), hemisphere(20, 6)
    found, own = paint.eval(wi, wo), paint.eval_measured(wi, wo)
    at = np.searchsorted(WORKING_WAVELENGTHS_NM, WAVELENGTHS)
    assert found[:, at] == pytest.approx(own, rel=1e-9)
    assert np.array_equal(found[:, 0], found[:, at[0]]) and np.array_equal(found[:, -1], found[:, at[-1]])
    assert any("400 to 700 nm" in note for note in paint.notes)


@pytest.mark.slow
def test_mirror_symmetry(shifted):
    wi, wo = hemisphere(300, 7), hemisphere(300, 8)
    mirrored = [1.0, -1.0, 1.0]
    one, other = shifted.eval(wi, wo), shifted.eval(wi * mirrored, wo * mirrored)
    assert one == pytest.approx(other, rel=1e-5, abs=1e-9), worst(one, other)


def test_isotropy(shifted):
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    wi, wo = hemisphere(300, 9), hemisphere(300, 10)
    one, other = shifted.eval(wi, wo), shifted.eval(wi @ turn.T, wo @ turn.T)
    assert one == pytest.approx(other, rel=1e-5, abs=1e-9), worst(one, other)


def test_reciprocity_once_the_background_is_left_out(shifted):
    brdf = ScatteredBrdf(shifted.measurement, shifted.background, shifted.kernel, reciprocal=True)
    wi, wo = hemisphere(300, 11), hemisphere(300, 12)
    there, back = brdf.eval(wi, wo), brdf.eval(wo, wi)
    assert there == pytest.approx(back, rel=1e-5, abs=1e-9), worst(there, back)


def test_departure_from_reciprocity_is_the_recorded_background(shifted):
    assert shifted.background == pytest.approx(np.full(len(WAVELENGTHS), 0.004), rel=0.3)
    assert any("departure from reciprocity" in note for note in shifted.notes)
    wi, wo = hemisphere(500, 13, 60), hemisphere(500, 14, 60)
    there, back = shifted.eval_measured(wi, wo), shifted.eval_measured(wo, wi)
    unclamped = (there > 0) & (back > 0)
    assert unclamped.mean() > 0.9
    found = (there - back)[unclamped]
    expected = (-shifted.background * (1 / wi[:, 2:] - 1 / wo[:, 2:]))[unclamped]
    assert found == pytest.approx(expected, abs=1e-5), worst(found, expected)


def test_no_background_in_a_reciprocal_measurement(paint):
    assert paint.background.max() < 5e-4


def test_no_background_is_guessed_where_many_readings_dropped_out():
    assert not estimated_background(measured(background=0.004, missing=0.2)).any()


def test_few_pairs_still_interpolate():
    few = measured().subset(np.arange(4))
    brdf = ScatteredBrdf.from_measurement(few)
    assert not brdf.background.any()
    found = brdf.eval_measured(few.wi, few.wo, exact=True)
    assert found == pytest.approx(few.values, rel=0.05)


def test_clamped_zeros_count_as_missing_and_not_as_black():
    whole, holed = measured(), measured(missing=0.05)
    brdf = ScatteredBrdf.from_measurement(holed)
    found = brdf.eval_measured(whole.wi, whole.wo)[holed.missing]
    assert found == pytest.approx(whole.values[holed.missing], rel=0.5), worst(found, whole.values[holed.missing])


def test_pair_without_any_reading_is_interpolated_from_the_others():
    told = measured()
    missing = told.missing.copy()
    missing[60] = True
    holed = ScatteredMeasurement(WAVELENGTHS, told.wi, told.wo, np.where(missing, 0.0, told.values), missing)
    found = ScatteredBrdf.from_measurement(holed).eval_measured(told.wi[60], told.wo[60], exact=True)
    assert found == pytest.approx(told.values[60], rel=0.2)


@pytest.mark.slow
def test_exact_duplicates_and_mirror_duplicates_count_once():
    told = measured()
    mirrored = told.wo * [1.0, -1.0, 1.0]
    doubled = ScatteredMeasurement(
        WAVELENGTHS,
        np.concatenate([told.wi] * 3),
        np.concatenate([told.wo, told.wo, mirrored]),
        np.concatenate([told.values] * 3),
        np.concatenate([told.missing] * 3),
    )
    wi, wo = hemisphere(200, 15), hemisphere(200, 16)
    one = ScatteredBrdf.from_measurement(told).eval(wi, wo)
    assert ScatteredBrdf(doubled, np.zeros(len(WAVELENGTHS))).eval(wi, wo) == pytest.approx(one, rel=1e-3, abs=2e-3)


def test_order_of_the_rows_makes_no_difference(shifted):
    told = shifted.measurement
    shuffled = told.subset(np.random.default_rng(17).permutation(len(told)))
    wi, wo = hemisphere(300, 18), hemisphere(300, 19)
    assert np.array_equal(ScatteredBrdf.from_measurement(shuffled).eval(wi, wo), shifted.eval(wi, wo))


def test_grazing_is_finite_not_negative_and_within_the_measured_range(shifted):
    steep = np.radians(89.9)
    phi = np.linspace(0, 2 * np.pi, 50)
    wi, wo = spherical(np.full(50, steep), 0 * phi), spherical(np.full(50, steep), phi)
    level = np.array([1.0, 0.0, 6e-17])
    up = np.array([0.0, 0.0, 1.0])
    for found in (shifted.eval(wi, wo), shifted.eval(wi, up), shifted.eval(up, wo), shifted.eval(level, up)):
        assert np.isfinite(found).all() and found.min() >= 0
        assert found.max() <= shifted.measurement.values.max() * 1.5


def test_zero_on_and_below_the_horizon(paint):
    up = np.array([0.0, 0.0, 1.0])
    for other in ([1.0, 0.0, 0.0], [0.6, 0.0, -0.8]):
        assert not paint.eval(up, np.array(other)).any() and not paint.eval(np.array(other), up).any()


def test_one_lobe_over_half_and_difference_angles(shifted):
    (lobe,) = shifted.lobes()
    assert lobe.frame == "hd" and lobe.brdf is shifted


def test_steeper_than_measured_is_held(paint):
    """Nothing grows on its own beyond the last measured polar angle: 80 degrees here, 79 on the other side."""
    phi = np.linspace(0.0, np.pi, 7)
    at, beyond = (spherical(np.full(7, np.radians(angle)), phi) for angle in (80.0, 89.0))
    for angle in (10.0, 50.0, 80.0):
        wi = spherical(np.full(7, np.radians(angle)), 0.0 * phi)
        found, edge = paint.eval(wi, beyond), paint.eval(wi, at)
        assert found == pytest.approx(edge, rel=1e-6), worst(found, edge)


def test_no_peak_is_invented_towards_the_light():
    """An instrument that cannot look along its own light leaves a hole; it is filled with its rim, never above it."""
    told = measured()
    brdf = ScatteredBrdf.from_measurement(told.subset(half_difference(told.wi, told.wo)[1] > np.radians(8.0)))
    theta, phi = np.meshgrid(np.radians([30.0, 45.0, 60.0, 70.0]), np.radians(np.arange(0.0, 360.0, 30.0)))
    theta, phi = theta.ravel(), phi.ravel()
    rim = brdf.eval(*io_from_half_difference(theta, np.full(theta.shape, np.radians(9.0)), phi))
    for degrees in (0.0, 2.0, 5.0):
        hole = brdf.eval(*io_from_half_difference(theta, np.full(theta.shape, np.radians(degrees)), phi))
        for half in np.unique(theta):
            at = theta == half
            assert hole[at].max() <= 1.1 * rim[at].max(), np.degrees(half)
            assert hole[at].min() >= 0.9 * rim[at].min(), np.degrees(half)


def test_finely_sampled_spectra_become_the_nearest_on_the_working_grid_and_are_said_to():
    told = measured().subset(np.arange(60))
    grid = np.arange(360.0, 831.0)
    values = np.tile(told.values[:, :1], (1, len(grid))) * (1 + 0.002 * (grid - 580))
    fine = replace(told, wavelengths_nm=grid, values=values, missing=np.zeros(values.shape, bool))
    holed = replace(fine, missing=np.broadcast_to(grid == 550, values.shape))
    found = prepared(holed)
    np.testing.assert_array_equal(found.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    np.testing.assert_allclose(found.values[:, 20], values[:, grid == 480.0][:, 0], rtol=1e-3)
    assert not found.missing.any() and "of 471 wavelengths" in found.notes[-1]
    gone = prepared(replace(fine, missing=np.broadcast_to(abs(grid - 550) < 4, values.shape)))
    assert gone.missing.all(axis=0).tolist() == (WORKING_WAVELENGTHS_NM == 550.0).tolist()


@pytest.mark.parametrize("light", ["D65", "A", "FL11", "LED-B3", "HP1"])
def test_an_edge_between_fine_samples_keeps_its_colour(light):
    told = measured().subset(np.arange(60))
    grid = np.arange(360.0, 831.0)
    edge = 0.05 + 0.8 / (1.0 + np.exp(-(grid - 588.0) / 4.0))
    values = np.tile(edge, (len(told.wi), 1))
    fine = replace(told, wavelengths_nm=grid, values=values, missing=np.zeros(values.shape, bool))
    found = prepared(fine)
    seen = observer("1931_2")
    weights = seen.weights(illuminant(light), grid)
    ours = seen.weights(illuminant(light), found.wavelengths_nm) @ found.values[0]
    assert delta_e_xyz(weights @ edge, ours, weights.sum(axis=1)) < 0.002


@pytest.mark.slow
def test_up_to_81_wavelengths_that_are_finer_stay_as_they_were_measured():
    told = measured()
    grid = np.arange(400.0, 640.0, 4.0)
    values = np.tile(told.values[:, :1], (1, len(grid))) * (1 + 0.3 * (np.arange(len(grid)) % 2))
    brdf = ScatteredBrdf.from_measurement(
        replace(told, wavelengths_nm=grid, values=values, missing=np.zeros(values.shape, bool))
    )
    np.testing.assert_array_equal(brdf.wavelengths_nm, grid)
    wi, wo = hemisphere(20, 5), hemisphere(20, 6)
    np.testing.assert_allclose(brdf.eval(wi, wo), brdf.eval_measured(wi, wo), rtol=1e-9)


def test_wavelengths_far_from_the_visible_are_left_out():
    told = measured().subset(np.arange(60))
    grid = np.arange(300.0, 2501.0, 20.0)
    values = np.tile(told.values[:, :1], (1, len(grid)))
    found = prepared(replace(told, wavelengths_nm=grid, values=values, missing=values < 0))
    assert found.wavelengths_nm[[0, -1]].tolist() == [320.0, 840.0]
    infrared = replace(told, wavelengths_nm=told.wavelengths_nm + 1000.0)
    with pytest.raises(InputError, match="nothing visible"):
        prepared(infrared)


def test_pairs_along_the_surface_are_left_out():
    told = measured().subset(np.arange(60))
    steep = told.wo.copy()
    steep[3] = [np.cos(1e-9), 0.0, np.sin(1e-9)]
    found = prepared(replace(told, wo=steep))
    assert len(found) == len(told) - 1 and "1 direction pairs beyond 89 deg" in found.notes[-1]
    with pytest.raises(InputError, match="at grazing"):
        prepared(replace(told, wo=np.tile(steep[3], (len(told), 1))))


def test_the_normal_alone_is_a_measurement():
    up = np.array([[0.0, 0.0, 1.0]])
    told = ScatteredMeasurement(np.array([400.0, 700.0]), up, up, np.array([[0.1, 0.2]]), np.zeros((1, 2), bool))
    wi, wo = spherical(np.array([0.0, 1.0]), np.zeros(2)), spherical(np.array([0.0, 0.7]), np.ones(2))
    found = ScatteredBrdf.from_measurement(told).eval(wi, wo)
    assert np.isfinite(found).all() and found[0, [0, -1]] == pytest.approx([0.1, 0.2], rel=1e-3)


def test_rebuilt_from_its_parameters_bit_for_bit(shifted):
    rebuilt = ScatteredBrdf.from_parameters(shifted.parameters())
    wi, wo = hemisphere(300, 20), hemisphere(300, 21)
    assert np.array_equal(rebuilt.eval(wi, wo), shifted.eval(wi, wo))
    assert rebuilt.notes == shifted.notes and rebuilt.measurement.name == "paint"


def test_parameters_that_are_not_complete():
    with pytest.raises(InputError, match="not complete"):
        ScatteredBrdf.from_parameters({"wi": np.zeros((1, 3))})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"wi": np.array([[0.0, 0.6, -0.8]])}, "not a direction above the surface"),
        ({"wo": np.array([[0.0, 0.0, 2.0]])}, "not a direction above the surface"),
        ({"values": np.array([[0.1, np.nan]])}, "unusable f_r"),
        ({"values": np.array([[0.1, -0.1]])}, "unusable f_r"),
        ({"missing": np.array([[True, True]])}, "nothing was measured"),
    ],
)
def test_measurement_that_cannot_be(change, message):
    up = np.array([[0.0, 0.0, 1.0]])
    good = {"wi": up, "wo": up, "values": np.array([[0.1, 0.2]]), "missing": np.zeros((1, 2), dtype=bool)}
    with pytest.raises(InputError, match=message):
        ScatteredMeasurement(np.array([400.0, 700.0]), **(good | change))


def test_folds_keep_equal_pairs_together():
    told = measured()
    exchanged = ScatteredMeasurement(WAVELENGTHS, told.wo, told.wi, told.values, told.missing)
    folds, other = benchmark.random_folds(told), benchmark.random_folds(exchanged)
    assert np.array_equal(folds, other) and set(folds) == set(range(10))


def test_benchmark_of_a_small_measurement():
    told = measured()
    found = json.loads(json.dumps(benchmark.validate(told, folds=3)))
    assert set(found) == {"tenth", "incidence"}
    rows = found["tenth"]
    for statistic in ("mean", "p95"):
        assert rows["kriged"][statistic] < min(rows["linear"][statistic], rows["nearest"][statistic]), rows


@pytest.mark.slow_cases("krylon_blue", "mystique")
@pytest.mark.parametrize("name", ["garnet_red", "krylon_blue", "mystique"])
def test_left_out_pairs_of_real_paint(shared_data, name):
    """Two of ten folds: clearly better than linear and nearest-neighbour interpolation, by mean and by p95."""
    told = read_cornell(shared_data / "brdf" / "cornell-spectral" / f"{name}.brdf")
    folds = benchmark.random_folds(told)
    found = benchmark.left_out(told, np.where(folds < 2, folds, -1), benchmark.METHODS)
    for statistic in ("mean", "p95"):
        others = min(found["linear"][statistic], found["nearest"][statistic])
        assert found["kriged"][statistic] < 0.6 * others, found


@pytest.mark.slow
def test_real_paint_is_tame_everywhere(shared_data):
    told = read_cornell(shared_data / "brdf" / "cornell-spectral" / "krylon_blue.brdf")
    brdf = ScatteredBrdf.from_measurement(told.subset(np.arange(0, len(told), 3)))
    assert io_angles(told.wi, told.wo)[0].max() < np.radians(81)
    wi, wo = hemisphere(3000, 22), hemisphere(3000, 23)
    found = brdf.eval(wi, wo)
    assert np.isfinite(found).all() and found.min() >= 0 and found.max() <= told.values.max() * 1.5
