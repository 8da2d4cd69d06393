"""The benchmark of factorisation at a small size: its shape, its page, and that the baseline loses as in the paper."""

import json
import re
from dataclasses import replace
from functools import partial
from html.parser import HTMLParser

import numpy as np
import pytest
from metamer.benchmarks import filtering
from metamer.benchmarks.factor import benchmark, figures, methods, report, scenes
from metamer.benchmarks.factor import growth as decompositions
from metamer.benchmarks.factor import points as configurations
from metamer.benchmarks.factor.cases import analytic_cases, chosen_cases, fluorescent_cases
from metamer.benchmarks.factor.measured import measured_cases
from metamer.benchmarks.factor.sphere import folded_xyz, pack_folds
from metamer.benchmarks.factor.timing import Stopwatch
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.factored.pack import FactoredBrdf
from metamer.materials.fitting.fit import fit
from metamer.materials.fitting.half_precision import rounded_to_half
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.viewer.software.backend import software_session

pytestmark = pytest.mark.slow

STATISTICS = {"mean", "p95", "p99", "max"}
ROW = {
    "case": str,
    "light": str,
    "frames": list,
    "packs": int,
    "rank": int,
    "fit_seconds": float,
    "table_bytes": int,
    "peak_bytes": int,
    "relative_error": float,
    "delta_e94": dict,
    "ms_per_megapixel": float,
    "baseline": dict,
}


@pytest.fixture(scope="module")
def lines():
    return []


FITTED = ("oren-nayar-0.52", "ashikhmin-shirley-32")
DYE = "dye-blue-to-green"
FLUORESCENT_LIGHTS = ("D65", "A", "D65 UV-free")


def filtered(renderer, progress):
    """One point as `filtering_points` gives it; that benchmark has its own test."""
    found = dict.fromkeys(("mean", "p95", "p99", "max"), 0.5)
    return [
        {
            "kind": "filtering",
            "case": "gloss",
            "configuration": "2x2 samples, linear",
            "ms_per_megapixel": 5.0,
            "geometry_ms_per_megapixel": 9.0,
            "delta_e94": found,
        }
    ]


@pytest.fixture(scope="module")
def measured(lines):
    with pytest.MonkeyPatch.context() as patch:
        # One point of each kind is enough to keep the code alive.
        patch.setattr(configurations, "SIZES", (3, 8))
        patch.setattr(configurations, "STEPS_NM", (20,))
        patch.setattr(configurations, "_PICTURE_PIXELS", 24)
        patch.setattr(scenes, "_SUBDIVISIONS", 3)
        patch.setattr(Stopwatch, "SIZE", 64)
        scenes.sphere_scenes.cache_clear()
        # One number of terms is asked for: within no budget it is reached on finer grids, in four times the time.
        patch.setattr(configurations, "fit", lambda brdf, budget, **asked: fit(brdf, budget=5.0, pixels=32, **asked))
        patch.setattr(benchmark, "POINT_CASES", {"ashikhmin-shirley-32": configurations.FitChoice((2,), ("io",), 2)})
        patch.setattr(methods, "QUICK", methods.Effort((1, 2, 4), 2, (16, 16, 13), (8, 8, 9, 9)))
        patch.setattr(decompositions, "QUICK", ((0.1, 0.15), (2, 4), 0.1))
        patch.setattr(filtering, "filtering_points", filtered)
        found = benchmark.run(
            [*FITTED, DYE],
            pixels=48,
            picture_pixels=24,
            ranks=(2,),
            renderer=software_session(),
            progress=lines.append,
        )
    scenes.sphere_scenes.cache_clear()
    return found


def test_rows_have_the_documented_shape(measured):
    assert [(row["case"], row["light"]) for row in measured["rows"]] == [
        *((case, light) for case in FITTED for light in ("D65", "FL11")),
        *((DYE, light) for light in FLUORESCENT_LIGHTS),
    ]
    for row in measured["rows"]:
        assert {name: type(value) for name, value in row.items()} == ROW
        assert set(row["frames"]) <= {"io", "hd"} and row["packs"] <= row["rank"]
        baseline = row["baseline"]
        assert set(baseline) == {"tensorly_seconds", "tensorly_relative_error", "dbrdf_delta_e94"}
        assert baseline["tensorly_seconds"] is None
        assert set(row["delta_e94"]) == STATISTICS
        # A D-BRDF cannot send light out at another wavelength.
        assert (
            baseline["dbrdf_delta_e94"] is None
            if row["case"] == DYE
            else set(baseline["dbrdf_delta_e94"]) == STATISTICS
        )
        assert row["peak_bytes"] > 0 and row["table_bytes"] > 0


def test_it_is_json_without_the_pictures(measured):
    document = report.result_document(measured)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert "figures" not in document
    assert {"rows", "points", "packs_needed", "speed", "growth", "fluorescence"} <= set(document)


def test_the_distribution_based_brdf_loses_in_every_row(measured):
    assert report.losses(measured["rows"]) == []
    assert "every row" in report.report(measured)
    fluorescent = [row for row in measured["rows"] if row["case"] == DYE]
    assert "No row" in report.baseline_loses(fluorescent)


def test_a_row_that_is_lost_is_named():
    even = dict.fromkeys(("mean", "p95", "p99", "max"), 1.0)
    row = {"case": "a", "light": "D65", "delta_e94": even, "baseline": {"dbrdf_delta_e94": {**even, "mean": 2.0}}}
    assert report.losses([row]) == ["a, D65: p95", "a, D65: p99", "a, D65: max"]
    assert "p99" in report.baseline_loses([row])


def test_points_cover_every_kind(measured):
    points = measured["points"]
    assert {point["kind"] for point in points} == {"spectra", "ranks", "frames", "precision", "paper", "filtering"}
    for point in points:
        lights = {"D65"} if point["kind"] == "filtering" else {"D65", "FL11"}
        assert set(point["delta_e94"]) == lights
        assert all(set(found) == STATISTICS for found in point["delta_e94"].values())
        assert point["ms_per_megapixel"] > 0
        assert point["fit_seconds"] is None if point["kind"] == "filtering" else point["fit_seconds"] > 0
    p99 = {p["configuration"]: p["delta_e94"]["FL11"]["p99"] for p in points if p["kind"] != "filtering"}
    # The purpose of folding lights: neither RGB nor steps of 20 nm can show a line spectrum.
    assert p99["balanced 8"] < p99["Peercy 8"] < p99["RGB"] < p99["20 nm"], p99
    assert abs(p99["half"] - p99["single"]) < 0.1, p99


def test_half_precision_is_what_is_drawn(measured, monkeypatch):
    """The renderer is handed packs whose factors fit into 16 bits, and says so."""
    handed = []
    monkeypatch.setattr(
        configurations, "rendered_xyz", lambda renderer, packs, lights, pixels: handed.append(packs) or real(pixels)
    )
    real = lambda pixels: np.zeros((1, 5, pixels, pixels, 3))  # noqa: E731
    monkeypatch.setattr(configurations, "reference_xyz", lambda brdf, lights, pixels: real(pixels) + 0.1)

    class Watch(Stopwatch):
        def __init__(self):
            self.renderer = software_session()

        def milliseconds(self, packs):
            return 1.0

    brdf = analytic_cases()[1].make()
    found = configurations.fit(brdf, budget=5.0, pixels=32, precision="single")
    stored = replace(found, fast=FactoredBrdf(tuple(map(rounded_to_half, found.fast.packs))))
    fitted = configurations.FittedPoint(stored, 1.0, found.fast.packs)
    points = configurations.precision_points("x", brdf, fitted, Watch(), ("D65",), 8, lambda line: None)
    assert [point["configuration"] for point in points] == ["single", "half"]
    single, half = handed
    assert all(pack.precision == "single" for pack in single) and all(pack.precision == "half" for pack in half)
    for pack in half:
        for factor in pack.factors:
            np.testing.assert_array_equal(factor, factor.astype(np.float16).astype(float))


def test_packs_of_the_papers_methods(measured):
    tried = [point for point in measured["points"] if point["kind"] == "paper"]
    assert {(point["frame"], point["method"]) for point in tried} == {
        (frame, method) for frame in ("io", "hd") for method in ("joint", "incremental", "refitted")
    }
    assert {point["packs"] for point in tried if point["frame"] == "io"} == {1, 2, 4}
    assert {point["packs"] for point in tried if point["frame"] == "hd"} == {1, 2}
    (d65, fl11) = measured["packs_needed"]
    assert d65["light"] == "D65" and fl11["light"] == "FL11" and d65["paper_2010"] == 22
    assert len(d65["needed"]) == 6 and all(count is None or count in (1, 2, 4) for count in d65["needed"].values())


def test_least_number_of_packs_that_is_good_enough():
    def point(packs, p99):
        return {"frame": "io", "method": "joint", "packs": packs, "delta_e94": {"D65": {"p99": p99}}}

    points = [point(4, 0.2), point(1, 3.0), point(2, 0.9), point(8, 1.5)]
    assert methods.packs_needed(points, "D65", 1.0) == {"io, joint": 2}
    assert methods.packs_needed(points, "D65", 0.1) == {"io, joint": None}


def test_fluorescent_rows_are_drawn_and_compared_with_what_else_there_is(measured):
    rows = {row["light"]: row for row in measured["fluorescence"]["without"]}
    assert tuple(rows) == FLUORESCENT_LIGHTS
    assert "400 nm" in measured["fluorescence"]["lights"]
    for light, row in rows.items():
        p99 = {name: found["p99"] for name, found in row["delta_e94"].items()}
        assert p99["packs"] < 0.2 and p99["diagonal"] > 2.0, (light, p99)
    # A reflectance measured under D65 is right there, and wrong under any light with less to excite it.
    under_a = {name: found["p99"] for name, found in rows["A"]["delta_e94"].items()}
    assert rows["D65"]["delta_e94"]["rgb"]["p99"] < 0.2 < 2.0 < min(under_a["reflectance"], under_a["rgb"])
    sizes = measured["fluorescence"]["two_surfaces"]
    assert [row["J"] for row in sizes] == sorted(row["J"] for row in sizes) and sizes[-1]["max"] < 0.1


def test_growth_is_over_resolution_and_rank(measured):
    growth = measured["growth"]
    assert [(row["over"], row["rank"]) for row in growth] == [
        *(("resolution", 16), ("resolution", 16)),
        *(("rank", 2), ("rank", 4)),
    ]
    assert growth[0]["nodes"] < growth[1]["nodes"]
    assert growth[3]["relative_error"] < growth[2]["relative_error"]
    for row in growth:
        assert row["peak_bytes"] > row["table_bytes"] == 8 * 8 * row["nodes"] and row["seconds"] > 0


def test_progress_is_told(measured, lines):
    assert "1/3 oren-nayar-0.52: fitting" in lines and "3/3 dye-blue-to-green: drawing" in lines
    assert any("D-BRDF" in line for line in lines)
    # Trials are told once, not again while bytes are counted.
    again = lines.index("2/3 ashikhmin-shirley-32: fitting once more, to count bytes")
    assert "terms after" in lines[again - 1] and "terms after" not in lines[again + 1]


# Kinds in the legends of the two surfaces with points: all but filtering, and filtering.
KEYS = 5 + 1


class Page(HTMLParser):
    """Everything that a browser would fetch, and the tags that are open."""

    VOID = ("meta", "img", "br", "link", "path", "circle", "input")

    def __init__(self):
        super().__init__()
        self.fetched, self.images, self.open = [], 0, []

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in ("src", "href", "srcset", "action", "xlink:href"):
                self.fetched.append(value)
        self.images += tag == "img"
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag


def test_page_is_self_contained_and_whole(measured):
    text = report.page(measured)
    page = Page()
    page.feed(text)
    assert page.open == []
    assert page.images == 2 * 2 * 5 + 3 * 7
    assert all(source.startswith("data:image/webp;base64,") for source in page.fetched), page.fetched
    assert not re.search(r"url\(|@import|https?://", text)
    assert text.count('class="curve ') == 3 * 3 * 3
    # Two lights and two costs a point; filtering has one light, and no seconds to fit.
    assert text.count('<g class="mark kind-') == 4 * (len(measured["points"]) - 1) + 1 + KEYS
    assert not re.search(r"\bnan\b", re.sub(r"data:[^\"]*", "", text))


def test_page_without_points_or_pictures(measured):
    bare = {"points": [], "figures": [], "packs_needed": [], "growth": [], "fluorescence": {"without": []}}
    text = report.page({**measured, **bare})
    assert "ashikhmin-shirley-32" in text
    assert not any(words in text for words in ("Speed against error", "How a decomposition grows", "Fluorescence, and"))


def test_page_and_text_show_both_sides_of_the_speed_bar(measured):
    brdf = analytic_cases()[0].make()
    row = decompositions.speed_row("matt", brdf, (9, 10, 9, 4), 3, 4)
    assert row["times_faster"] == pytest.approx(row["tensorly_seconds"] / row["seconds"])
    assert row["error_ratio"] == pytest.approx(row["relative_error"] / row["tensorly_relative_error"])
    assert set(row["methods"]) == {"joint", "incremental", "refitted"} and row["peak_bytes"] > row["table_bytes"]
    for part in row["parts"]:
        assert part["times_faster"] == pytest.approx(part["tensorly_seconds"] / part["seconds"])
    both = {**measured, "speed": [row]}
    assert "times faster" in report.report(both) and "times faster" in report.page(both)
    assert all(part["part"] in report.report(both) for part in row["parts"])


def test_xyz_of_packs_is_that_of_their_brdf():
    """Two roads to the same colours: folded terms, and spectra under every light."""
    brdf = analytic_cases()[1].make()
    packs = benchmark.fit(brdf, budget=5.0, pixels=32).fast.packs
    protocol = sphere_protocol(24, True)
    lights = ("D65", "FL11")
    terms = folded_xyz(packs, protocol, [pack_folds(packs, protocol, light) for light in lights])
    np.testing.assert_allclose(terms, protocol.references(FactoredBrdf(packs), lights), atol=1e-12)
    np.testing.assert_allclose(terms, protocol.samples(FactoredBrdf(packs), lights), atol=1e-12)


def test_polar_radius_is_the_root_of_what_the_formula_says():
    brdf = analytic_cases()[0].make()
    radii = np.array(figures.polar_radii(brdf))
    angles = figures.polar_angles_deg()
    assert radii.shape == (3, len(angles))
    np.testing.assert_allclose(radii[0], radii[0][::-1], atol=2e-5)
    # Rough surfaces send more back towards the light, which is on the positive side.
    assert radii[2][np.argmin(abs(angles - 60))] > radii[2][np.argmin(abs(angles + 60))]


def test_cases_by_name(tmp_path):
    own = (*analytic_cases(), *fluorescent_cases())
    assert [case.name for case in chosen_cases(None)] == [case.name for case in own]
    with pytest.raises(UnknownNameError, match="oren-nayar"):
        chosen_cases(["oren-nayar-0.25"])
    with pytest.raises(InputError, match="no such folder"):
        chosen_cases(None, tmp_path / "nowhere")
    with pytest.raises(InputError, match="no measured materials"):
        chosen_cases(None, tmp_path)


def test_measured_cases_are_of_every_family(shared_data):
    names = [case.name for case in measured_cases(shared_data)]
    assert {"red-fabric", "blue-metallic-paint", "yellow-matte-plastic"} <= set(names)
    assert {"garnet_red", "krylon_blue", "mystique", "BiSpectral-1", "BiSpectral-2"} <= set(names)
    assert sum(name.endswith("_rgb") for name in names) == 4 and len(set(names)) == len(names)
    up = np.array([0.0, 0.0, 1.0])
    for name in ("red-fabric", "mystique", "cc_iris_purple_gem_rgb", "BiSpectral-2"):
        brdf = chosen_cases([name], shared_data)[0].make()
        # Scattered readings are looked up in a table of all directions, which takes seconds and has its own tests.
        assert brdf.isotropic and (name == "mystique" or np.all(brdf.eval(up, up) > 0)), name


def test_tensorly_row(monkeypatch):
    monkeypatch.setattr(Stopwatch, "SIZE", 64)
    monkeypatch.setattr(decompositions, "speed_row", partial(decompositions.speed_row, shape=(16, 20, 16, 8), rank=4))
    found = benchmark.run(
        ["oren-nayar-0.52"],
        lights=("D65",),
        pixels=32,
        budget=5.0,
        ranks=(2,),
        picture_pixels=0,
        points=False,
        baseline=True,
        renderer=software_session(),
    )
    baseline = found["rows"][0]["baseline"]
    (speed,) = found["speed"]
    assert speed["case"] == "oren-nayar-0.52" and speed["tensorly_seconds"] == baseline["tensorly_seconds"]
    assert baseline["tensorly_seconds"] > 0 and 0 < baseline["tensorly_relative_error"] < 0.1
