"""Joint refinement: the objective never rises, nothing drifts, seams stay closed, and it is deterministic."""

from itertools import pairwise

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley
from metamer.materials.core.axes import Axis
from metamer.materials.core.brdf import Brdf
from metamer.materials.core.directions import spherical
from metamer.materials.core.protocol import LIGHTS, sphere_protocol
from metamer.materials.fitting.axis_samples import AxisSamples
from metamer.materials.fitting.fit import fit
from metamer.materials.fitting.joint import JointProblem, new_terms, refined, refined_without_extrapolation
from metamer.materials.fitting.pack_samples import PackSamples
from metamer.materials.fitting.term_growth import merged
from metamer.materials.fitting.visible_pairs import seen_pairs
from metamer.materials.fitting.visible_samples import seen_samples
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

L = len(WORKING_WAVELENGTHS_NM)
RED = Spectrum.sampled(WORKING_WAVELENGTHS_NM, 0.05 + 0.6 * np.linspace(0.0, 1.0, L) ** 2)
GREY = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(L, 0.04))
PAIRS = 6000
IO = (Axis("theta_i", 12, 0.5 * np.pi), Axis("theta_o", 12, 0.5 * np.pi), Axis("phi", 9, np.pi))
HD = (Axis("theta_h", 16, 0.5 * np.pi, "sqrt"), Axis("theta_d", 12, 0.5 * np.pi), Axis("phi_d", 9, np.pi))
TURNED = (
    Axis("theta_h", 12, 0.5 * np.pi, "sqrt"),
    Axis("theta_d", 8, 0.5 * np.pi),
    Axis("phi_d", 9, 2 * np.pi, periodic=True),
    Axis("phi_h", 10, 2 * np.pi, periodic=True),
)


class Whole(Brdf):
    """A BRDF that names no lobes."""

    def __init__(self, brdf):
        self.brdf, self.wavelengths_nm, self.isotropic = brdf, brdf.wavelengths_nm, brdf.isotropic

    def eval(self, wi, wo):
        return self.brdf.eval(wi, wo)


@pytest.fixture(scope="module")
def glossy():
    return AshikhminShirley(RED, GREY, 12.0, 12.0)


@pytest.fixture(scope="module")
def samples(glossy):
    return seen_samples(glossy, PAIRS)


@pytest.fixture(scope="module")
def packs(samples):
    first, _ = new_terms((), samples, "hd", HD, 2, 0)
    second, _ = new_terms((first,), samples, "io", IO, 2, 0)
    return first, second


def test_no_step_raises_the_objective(samples, packs):
    problem = JointProblem(packs, samples)
    state, left = problem.factors(), [samples.cost(packs)]
    for _ in range(6):
        state, now = problem.sweep(state)
        left.append(now)
    assert all(later <= earlier * (1 + 1e-12) for earlier, later in pairwise(left)), left
    assert left[-1] < 0.9 * left[0]
    # The residual that the sweep states is the one that the packs leave.
    assert samples.cost(problem.packs_of(state)) == pytest.approx(left[-1], rel=1e-6)


def test_the_objective_is_the_squared_delta_e_of_small_errors_under_every_light(samples):
    """Colour by colour: what is not kept apart for a sample counts by its mean weight."""
    rng = np.random.default_rng(1)
    small = 1e-5 * rng.standard_normal(samples.targets.shape) * np.abs(samples.targets)
    true = np.zeros(len(small))
    for light in LIGHTS:
        weights = sphere_protocol(16, light=light).weights(WORKING_WAVELENGTHS_NM)
        xyz, error = (np.pi * values @ samples.synthesis @ weights for values in (samples.targets, small))
        true += 0.3 * delta_e_xyz(xyz, xyz + error, weights.sum(axis=0)) ** 2
    counted = np.sum(np.einsum("ksn,ns->kn", samples.sensitivity, small) ** 2, axis=0) / samples.importance
    assert counted.sum() == pytest.approx(true.sum(), rel=0.05)
    assert (counted <= true * 1.02 + 1e-12).all()


def test_guards_bring_packs_back_between_their_limits_and_cost_nothing_there(samples, packs):
    bright = tuple(pack.recoloured(-pack.palette.values[0]) for pack in packs)
    limits = np.stack([np.full(L, -0.01), np.full(L, 50.0)])
    wi, wo = samples.wi[::40], samples.wo[::40]
    cost = samples.cost(packs)
    watched = samples.with_guards(wi, wo, limits, cost)
    assert watched.cost(packs) == pytest.approx(cost, rel=1e-9)

    def lowest(some):
        return np.pi * sum(pack.shade(wi, wo) for pack in some).min()

    before, after = lowest(bright), lowest(refined_without_extrapolation(bright, watched, 4))
    assert before < -0.1
    assert after > 0.1 * before


def test_black_samples_have_finite_weights():
    black = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.zeros(L))
    samples = seen_samples(AshikhminShirley(black, black, 50.0, 50.0), 2000)
    assert np.isfinite(samples.sensitivity).all() and np.isfinite(samples.base_weight).all()
    # L* is linear near black, 903.3 a unit of Y.
    dark = samples.xyz[:, 1] < 1e-6
    assert dark.any()
    assert (samples.base_weight[dark] > 0).all()


def test_samples_are_never_the_protocol_s_own_and_show_what_it_shows():
    wi, wo, importance = seen_pairs(4000, 0, True)
    sphere = sphere_protocol(64)
    own = {tuple(row) for row in np.round(np.hstack([sphere.wi, sphere.wo]), 9)}
    assert not own & {tuple(row) for row in np.round(np.hstack([wi, wo]), 9)}
    assert (wi[:, 2] > 0).all() and (wo[:, 2] > 0).all()
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1.0, rtol=1e-12)
    # Weighted by importance, points are as common as on a disk: mean cos(theta_o) under head-on light is 2/3.
    ahead = np.sum(wi * wo, axis=1) > np.cos(np.radians(20.0))
    assert np.average(wo[ahead, 2], weights=importance[ahead]) == pytest.approx(2 / 3, abs=0.03)


@pytest.mark.parametrize("count", [4000, 57_000])
@pytest.mark.parametrize("isotropic", [True, False])
def test_errors_that_rise_as_radiance_does_at_the_edge_of_a_sphere_do_not_rule(count, isotropic):
    """Errors of 1 / cos(theta_o) in the outermost 0.25 % count as its area does at the error where it begins."""
    _, wo, importance = seen_pairs(count, 0, isotropic)
    cosine = wo[:, 2]
    edge = cosine < 0.05
    assert edge.sum() > 50 * count / 4000
    counted = np.sum((importance * (0.05 / cosine) ** 2)[edge])
    assert counted == pytest.approx(0.05**2 * importance.sum(), rel=0.2)


def summed(axis, curvature):
    """Curvature (N, R, R) summed over each interval, times powers 0 to 2 of the samples' fractions."""
    sums = np.zeros((axis.size - 1, 3, *curvature.shape[1:]))
    for power in range(3):
        np.add.at(sums[:, power], axis.below, axis.fraction[:, None, None] ** power * curvature)
    return sums


def summed_to_either_end(axis, aims):
    """Gradients (N, R) summed over each interval, times the samples' shares of its ends."""
    right = np.zeros((axis.size - 1, 2, aims.shape[1]))
    for end, share in enumerate((1.0 - axis.fraction, axis.fraction)):
        np.add.at(right[:, end], axis.below, share[:, None] * aims)
    return right


def test_nodes_that_no_sample_touches_do_not_drift():
    rng = np.random.default_rng(0)
    position, rank = 3.0 + 4.0 * rng.random(500), 2
    axis = AxisSamples.of(position, 12, False)
    seen, aim = rng.random((500, 3, rank)), rng.random((500, rank))
    sums = summed(axis, np.einsum("nkr,nks->nrs", seen, seen))
    moved = axis.step(np.ones((12, rank)), sums, summed_to_either_end(axis, aim), np.zeros((11, rank)))
    assert np.abs(moved[3:8]).max() > 0.01
    # They follow their neighbour, less and less, and never run ahead of it.
    assert (np.abs(moved[0]) <= np.abs(moved[3]) + 1e-12).all()
    assert (np.abs(moved[11]) <= np.abs(moved[7]) + np.abs(moved[8]) + 1e-12).all()


@pytest.mark.parametrize("periodic", [False, True])
def test_a_factor_is_solved_for_as_a_dense_system_would(periodic):
    """Against one dense least-squares problem of all nodes, the proximal term included."""
    rng = np.random.default_rng(2)
    size, rank, count = 7, 3, 400
    axis = AxisSamples.of(rng.random(count) * (size - 1), size, periodic)
    factor = rng.standard_normal((size, rank))
    if periodic:
        factor[-1] = factor[0]
    seen, left = rng.standard_normal((count, 3, rank)), rng.standard_normal((count, 3))
    aim = np.einsum("nkr,nk->nr", seen, left)
    curvature, rounding = np.einsum("nkr,nks->nrs", seen, seen), rng.random((size - 1, rank))
    found = axis.step(factor, summed(axis, curvature), summed_to_either_end(axis, aim), rounding)
    nodes = size - 1 if periodic else size
    rows = np.zeros((count, nodes))
    rows[np.arange(count), axis.below] += 1 - axis.fraction
    rows[np.arange(count), (axis.below + 1) % nodes] += axis.fraction
    flat = (rows[:, None, :, None] * seen[:, :, None, :]).reshape(3 * count, -1)
    matrix = flat.T @ flat
    at_nodes = np.zeros((nodes, rank))
    np.add.at(at_nodes, np.arange(size - 1), rounding)
    np.add.at(at_nodes, np.arange(1, size) % nodes, rounding)
    matrix += np.diag(at_nodes.reshape(-1))
    pull = 1e-3 * np.diag(matrix).reshape(nodes, rank).mean(axis=0)
    chain = np.eye(nodes)
    if periodic:
        tied = 2 * np.eye(nodes) - np.roll(np.eye(nodes), 1, axis=0) - np.roll(np.eye(nodes), -1, axis=0)
    else:
        steps = np.diff(np.eye(nodes), axis=0)
        tied = steps.T @ steps
    proximal = np.kron(chain + 100.0 * tied, np.diag(pull))
    expected = np.linalg.solve(matrix + proximal, flat.T @ left.reshape(-1))
    np.testing.assert_allclose(found[:nodes], expected.reshape(nodes, rank), rtol=1e-8, atol=1e-10)
    if periodic:
        np.testing.assert_array_equal(found[-1], found[0])


@pytest.mark.parametrize("scale", [1e-40, 1.0, 1e30])
@pytest.mark.parametrize("anisotropic", [False, True])
def test_a_turn_lowers_the_cost_as_far_as_a_dense_problem_does_however_large_its_terms_are(scale, anisotropic):
    """Against all samples at once in double precision; a term is `scale` times as large as the other."""
    brdf = AshikhminShirley(RED, GREY, 4.0, 20.0 if anisotropic else 4.0)
    samples = seen_samples(brdf, 1500)
    pack, _ = new_terms((), samples, "hd", TURNED if anisotropic else HD, 2, 0, 2)
    problem = JointProblem((pack,), samples)
    *factors, spectral = problem.factors()
    spectral = spectral * np.array([1.0, scale])
    met = PackSamples(pack, samples)
    left = samples.targets.T - spectral @ met.terms(factors).T
    for turn in met.turns:
        rest = np.empty((len(samples.wi), 2))
        met.put_rest(turn, factors, rest)
        shaded = met.shaded(turn, rest, factors[turn.mode], spectral)
        whole = spectral @ met.terms(factors).T
        np.testing.assert_allclose(shaded, whole, rtol=1e-9, atol=1e-12 * np.abs(shaded).max())
        step = met.step(turn, rest, factors[turn.mode], spectral, samples.half_gradient(left))
        expected = dense_step(turn, rest, factors[turn.mode], spectral, samples, left)
        moved, best = (met.shaded(turn, rest, one, spectral) for one in (step, expected))
        np.testing.assert_allclose(moved, best, atol=2e-3 * np.abs(best).max())
        assert cost(samples, left - moved) <= cost(samples, left)
        assert cost(samples, left - moved) <= 1.001 * cost(samples, left - best)


@pytest.mark.parametrize("times", [1e2, 1e3, 1e6])
def test_guards_that_count_far_more_than_samples_do_not_blur_what_samples_ask_for(glossy, times):
    samples = seen_samples(glossy, 1500)
    (pack, _), some = new_terms((), samples, "hd", HD, 4, 0, 2), slice(None, None, 40)
    watched = samples.with_guards(samples.wi[some], samples.wo[some], np.zeros((2, L)), 1.0)
    count, rng = len(watched.guards), np.random.default_rng(4)
    typical = np.abs(samples.sensitivity).mean()
    # One direction of colour each: in the others, terms may move.
    watched.sensitivity[0, :, -count:] = times * typical * rng.standard_normal(watched.sensitivity[0, :, -count:].shape)
    *factors, spectral = JointProblem((pack,), samples).factors()
    met = PackSamples(pack, watched)
    left = watched.targets.T - spectral @ met.terms(factors).T
    # The guards are satisfied already: samples alone decide where to go.
    left[:, -count:] = 0.0
    for turn in met.turns:
        rest = np.empty((len(watched.wi), 4))
        met.put_rest(turn, factors, rest)
        step = met.step(turn, rest, factors[turn.mode], spectral, watched.half_gradient(left))
        expected = dense_step(turn, rest, factors[turn.mode], spectral, watched, left)
        np.testing.assert_allclose(step, expected, rtol=0.0, atol=2e-6 * np.abs(expected).max())


def cost(samples, left):
    return float(np.vdot(left, samples.half_gradient(left)))


def dense_step(turn, rest, factor, spectral, samples, left):
    """The same step from sums over all samples in double precision."""
    order = turn.axis.order
    curvature = np.einsum("ksn,ktn->nst", samples.sensitivity, samples.sensitivity)
    curvature += samples.base_weight[:, None, None] * np.eye(len(spectral))
    unsorted = np.empty_like(rest)
    unsorted[order] = rest
    along = np.einsum("sr,nst,tq->nrq", spectral, curvature, spectral)
    sums = summed(turn.axis, along * unsorted[:, :, None] * unsorted[:, None, :])
    aims = unsorted * (samples.half_gradient(left).T @ spectral)
    return turn.axis.step(factor, sums, summed_to_either_end(turn.axis, aims), np.zeros(sums[:, 0, 0].shape))


def test_an_anisotropic_pack_is_continuous_where_its_azimuths_wrap():
    brdf = AshikhminShirley(RED, GREY, 4.0, 20.0)
    samples = seen_samples(brdf, PAIRS)
    pack, _ = new_terms((), samples, "hd", TURNED, 3, 0)
    (pack,), _ = refined((pack,), samples, 4)
    for axis, factor in zip(pack.axes, pack.factors, strict=True):
        if axis.periodic:
            np.testing.assert_array_equal(factor[0], factor[-1])
    turn, near = 2 * np.pi, 1e-9
    for azimuth in (0.0, 1.0):
        wo = spherical(np.full(3, 0.5), azimuth + np.array([near, turn - near, turn + near]))
        shaded = pack.shade(spherical(np.full(3, 0.7), azimuth), wo)
        np.testing.assert_allclose(shaded, np.broadcast_to(shaded[:1], shaded.shape), atol=1e-6 * np.abs(shaded).max())
        # Turning both about the normal past the seam of phi_h.
        both = [spherical(np.full(2, theta), phi + np.array([-near, near])) for theta, phi in ((0.7, 0.0), (0.4, 0.0))]
        either = pack.shade(*both)
        np.testing.assert_allclose(either[0], either[1], atol=1e-6 * np.abs(either).max())


def test_refining_packs_of_two_frames_together_beats_either_alone(samples, packs):
    both, relative = refined(packs, samples)
    (alone,), other = refined(packs[:1], samples)
    assert relative < other < 1.0
    assert [pack.frame for pack in both] == ["hd", "io"]
    joined = merged((*both, alone))
    assert [(pack.frame, pack.rank) for pack in joined] == [("hd", 4), ("io", 2)]
    wi, wo = spherical(np.array([0.2, 0.9]), 0.0), spherical(np.array([0.5, 0.1]), 2.0)
    apart = sum(pack.shade(wi, wo) for pack in (*both, alone))
    np.testing.assert_allclose(sum(pack.shade(wi, wo) for pack in joined), apart, rtol=1e-12)


@pytest.mark.slow
def test_a_brdf_that_names_no_lobes_is_split_and_the_same_seed_gives_the_same_bits():
    def found():
        trials, satin = [], Whole(AshikhminShirley(RED, GREY, 4.0, 4.0))
        return fit(satin, budget=1e-6, ranks=(2, 4), pixels=32, seed=5, tried=trials.append), trials

    (one, trials), (other, _) = found(), found()
    assert any(trial.joint for trial in trials)
    assert {"io", "hd"} <= {word for trial in trials for word in trial.frame.split(" + ")}
    assert one.error == other.error
    assert [trial.score for trial in one.trials] == [trial.score for trial in other.trials]
    for a, b in zip(one.fast.packs, other.fast.packs, strict=True):
        np.testing.assert_array_equal(a.palette.values, b.palette.values)
        for left, right in zip(a.factors, b.factors, strict=True):
            np.testing.assert_array_equal(left, right)
    assert one.stopped in ("none left to try", "more terms stopped paying")


@pytest.mark.slow
def test_refinement_never_worsens_what_was_measured(glossy):
    table = fit(Whole(glossy), budget=1e-6, ranks=(4,), pixels=32, method="weighted")
    joint = fit(Whole(glossy), budget=1e-6, ranks=(4,), pixels=32)
    assert joint.rank == table.rank == 4
    assert joint.score <= table.score
