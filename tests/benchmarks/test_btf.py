"""`metamer bench btf`: what its rows say, and that they say what there is."""

import json

import numpy as np
import pytest
from btf_samples import bumps
from metamer.benchmarks.btf import benchmark, cases, environments, spectral, speed, under_light
from metamer.benchmarks.btf.comparison import rows_of
from metamer.benchmarks.btf.methods import BYTES, methods, stored_bytes
from metamer.benchmarks.btf.rows import BARS, btf_row, seen_error, with_bars, within
from metamer.materials.formats.btf_names import directions_of
from metamer.runtime.errors import InputError

pytestmark = pytest.mark.slow

FEW = directions_of([(0, 0)] + [(theta, phi) for theta in (30, 60) for phi in range(0, 360, 60)])
KEYS = {
    "case", "method", "texels", "bytes_per_texel", "fit_cpu_seconds", "fold_ms", "ms_per_megapixel", "light",
    "delta_e94", "epsilon", "published_epsilon", "registered", "size",
    "dictionary_bytes", "offset", "bar",
}  # fmt: skip


@pytest.fixture(scope="module")
def small():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cases, "TRACED", (8, 8))
        patch.setattr(cases, "DIRECTIONS", FEW)
        some = {"half-sky": environments.half_sky, "low-sun": environments.low_sun}
        patch.setattr(under_light, "environments", lambda data: some)
        patch.setattr(environments, "TURNS", 2)
        patch.setattr(environments, "ROWS", 16)
        patch.setattr(speed, "PIXELS", 16)
        yield


@pytest.fixture(scope="module")
def figures(small):
    return benchmark.run(full=True, case="synthetic-dyes")


def test_rows_say_what_was_fitted_how_and_how_well(figures):
    json.dumps(figures)
    assert figures["missing"] == list(cases.MEASURED)
    for one in figures["rows"]:
        assert set(one) == KEYS and set(one["delta_e94"]) == {"mean", "p95", "p99"}
        each = [one["delta_e94"][name] for name in ("mean", "p95", "p99")]
        assert 0.0 < each[0] <= each[1] <= each[2] < 100.0
    bare = {"held-views", "light-basis-16", "light-basis-sh25", *spectral.NAMES}
    assert {one["method"] for one in figures["rows"]} == bare.union(*(rows_of(way) for way in methods(True)))
    assert "synthetic-dyes" in benchmark.report(figures) and "METAMER_DATA" in benchmark.report(figures)


def test_more_bytes_buy_less_error(figures):
    by = {(one["method"], one["size"]): one["delta_e94"]["mean"] for one in figures["rows"]}
    assert by["rfp", None] < by["ptm", None]
    assert by["lpca", "finest"] < by["lpca", "small"]
    assert by["end-to-end", "finest"] < by["end-to-end", "small"]


def test_spectra_are_right_under_a_light_that_no_fit_saw(figures):
    by = {(one["method"], one["light"]): one for one in figures["rows"]}
    mean = {name: by[name, "HP1"]["delta_e94"]["mean"] for name in spectral.NAMES}
    assert mean["spectral"] < 0.75 * min(mean[name] for name in spectral.UPLIFTS[:-1])
    assert abs(mean["spectral"] - mean["spectral-8"]) < 0.05
    # A camera's colours are themselves right.
    assert by["rgb-mallett-yuksel", "D65"]["delta_e94"]["mean"] < 1.3 * by["spectral", "D65"]["delta_e94"]["mean"]


def test_claims_are_those_of_the_rows_that_there_are(figures):
    found = {one["claim"]: one for one in figures["claims"]}
    assert len(found) == 8
    (size,) = (one for claim, one in found.items() if claim.startswith("bytes of the dictionary"))
    assert size["kept"] == (size["found"] <= 1.05)
    assert "which no fit saw" in benchmark.report(figures)
    some = [one for one in figures["rows"] if one["method"] == "spectral"]
    assert spectral.claims(some) == [] and spectral.claims([]) == []


def test_a_quick_run_has_fewer_rows(small):
    quick = benchmark.run(method="ptm")["rows"]
    assert [one["case"] for one in quick] == ["synthetic-dyes"]
    full = benchmark.run(full=True, method="ptm")["rows"]
    assert [one["case"] for one in full] == ["synthetic-dyes", "synthetic-corduroy", "synthetic-leather"]
    assert {one["texels"] for one in full} == {64}


def test_names_that_there_are_not_are_told(small):
    with pytest.raises(InputError, match="synthetic-dyes"):
        benchmark.run(case="velvet")
    with pytest.raises(InputError, match="lpca-paper"):
        benchmark.run(method="jpeg")


def test_nothing_lost_is_no_error_and_epsilon_is_of_encoded_numbers(small):
    images = cases.btf_cases(None, False)[0].measured()
    assert seen_error(images, images.image) == ((0.0, 0.0, 0.0), 0.0)
    (mean, _, _), epsilon = seen_error(images, lambda view, light: 0.0 * images.image(view, light))

    assert mean > 1.0 and epsilon > 0.05


def test_bytes_are_those_of_the_data_sets():
    random = np.random.default_rng(0).integers(0, 256, 5000).astype(np.uint8)
    assert 5000 <= stored_bytes({"of": {"random": random}}) < 5200
    assert stored_bytes({"same": np.zeros(5000, np.uint8), "text": "no data set"}) < 500


def test_a_form_of_so_many_bytes_has_clusters_for_all_of_them():
    images, ways = bumps(40, 40, views=3, lights=3), {way.size: way for way in methods(True)}
    medium, filled = (ways[size].make(images) for size in ("medium", "30 B"))
    assert medium.bytes_per_texel < filled.bytes_per_texel <= 1.01 * BYTES
    # There are no more clusters than a byte can number.
    assert filled.bytes_per_texel > 25.0 or len(filled.form.table) > 250


def made(case, method, texels, mean, bytes_per_texel):
    return btf_row(case, method, "D65", texels, (mean, 2 * mean, 3 * mean), bytes_per_texel=bytes_per_texel)


def test_a_bar_is_held_by_the_best_form_that_is_small_enough():
    rows = [
        made("wool", "lpca", 16384, 3.0, 10.0),
        made("wool", "lpca", 16384, 1.5, 29.0),
        made("wool", "lpca", 16384, 0.9, 31.0),
        made("wool", "lpca", 4096, 0.5, 29.0),
        made("wool", "ptm", 16384, 0.5, 18.0),
    ]
    found = with_bars(rows)
    assert [one["bar"] is not None for one in found] == [False, True, False, False, False]
    assert found[1]["bar"]["mean"] == BARS["wool", "lpca"].mean
    assert within(found[1]) is True and within(found[4]) is None
    over = with_bars([made("wool", "lpca", 16384, 1.5, 40.0)])[0]
    assert within(over) is False


def test_the_plane_of_a_surface_is_said_and_held_to_what_was_found():
    moved = [
        btf_row(case, "lpca", "D65", 64, (1.0, 2.0, 3.0), offset=at) for case, at in (("wool", 4.3), ("corduroy", 7.0))
    ]
    shown = benchmark.report({"missing": [], "claims": [], "rows": moved})
    assert "wool: the surface is 4.30 texels above the measured plane, 4 within 0.5: kept" in shown
    assert "5.5 within 0.5: MISSED" in shown


def test_the_papers_rows_stand_beside_ours():
    assert made("corduroy", "rfp", 64, 5.0, 1458.0)["published_epsilon"] == 0.0513
    assert made("wool", "rfnl-2", 64, 5.0, 1134.0)["published_epsilon"] == 0.0582
    assert made("wool", "lpca", 64, 2.0, 29.0)["published_epsilon"] is None
    shown = benchmark.report({"missing": [], "claims": [], "rows": [made("wool", "rfp", 64, 6.0, 1458.0)]})
    assert "0.072" in shown and "aluminium" in shown
