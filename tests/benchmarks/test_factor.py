"""The benchmark of factorisation at a small size: its shape, its page, and that the baseline loses as in the paper."""

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from metamer.materials.factors import FactoredBrdf
from metamer.materials.protocol import sphere_protocol
from metamer.spectral.errors import InputError, UnknownNameError
from metamer.viewer import factor_benchmark, factor_figures, factor_points
from metamer.viewer.factor_cases import analytic_cases, chosen_cases, measured_cases
from metamer.viewer.factor_sphere import brdf_xyz, pack_xyz
from metamer.viewer.software import SoftwareRenderer

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


@pytest.fixture(scope="module")
def measured(lines):
    with pytest.MonkeyPatch.context() as patch:
        # One point of each kind is enough to keep the code alive.
        patch.setattr(factor_points, "SIZES", (3, 8))
        patch.setattr(factor_points, "STEPS_NM", (20,))
        patch.setattr(factor_benchmark, "POINT_CASES", ("ashikhmin-shirley-32",))
        patch.setattr(factor_points, "RANKS", (2,))
        return factor_benchmark.run(
            ["oren-nayar-0.52", "ashikhmin-shirley-32"],
            pixels=48,
            picture_pixels=24,
            renderer=SoftwareRenderer(),
            progress=lines.append,
        )


def test_rows_have_the_documented_shape(measured):
    assert [(row["case"], row["light"]) for row in measured["rows"]] == [
        (case, light) for case in ("oren-nayar-0.52", "ashikhmin-shirley-32") for light in ("D65", "FL11")
    ]
    for row in measured["rows"]:
        assert {name: type(value) for name, value in row.items()} == ROW
        assert set(row["frames"]) <= {"io", "hd"} and row["packs"] <= row["rank"]
        baseline = row["baseline"]
        assert set(baseline) == {"tensorly_seconds", "tensorly_relative_error", "dbrdf_delta_e94"}
        assert baseline["tensorly_seconds"] is None
        assert set(row["delta_e94"]) == set(baseline["dbrdf_delta_e94"]) == STATISTICS
        assert row["peak_bytes"] > 0 and row["table_bytes"] > 0


def test_it_is_json_without_the_pictures(measured):
    document = factor_benchmark.document(measured)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert "figures" not in document and {"rows", "points"} <= set(document)


def test_the_distribution_based_brdf_loses_in_every_row(measured):
    assert factor_benchmark.losses(measured["rows"]) == []
    assert "every row" in factor_benchmark.report(measured)


def test_a_row_that_is_lost_is_named():
    even = dict.fromkeys(("mean", "p95", "p99", "max"), 1.0)
    row = {"case": "a", "light": "D65", "delta_e94": even, "baseline": {"dbrdf_delta_e94": {**even, "mean": 2.0}}}
    assert factor_benchmark.losses([row]) == ["a, D65: p95", "a, D65: p99", "a, D65: max"]
    assert "p99" in factor_benchmark.verdict([row])


def test_points_cover_every_kind(measured):
    points = measured["points"]
    assert {point["kind"] for point in points} == {"spectra", "ranks", "frames", "precision"}
    for point in points:
        assert set(point["delta_e94"]) == {"D65", "FL11"}
        assert all(set(found) == STATISTICS for found in point["delta_e94"].values())
        assert point["fit_seconds"] > 0 and point["ms_per_megapixel"] > 0
    p99 = {point["configuration"]: point["delta_e94"]["FL11"]["p99"] for point in points}
    # What the folding of lights is for: a line spectrum is no business of RGB, nor of 20 nm.
    assert p99["balanced 8"] < p99["Peercy 8"] < p99["RGB"] < p99["20 nm"], p99
    assert p99["half"] - p99["single"] < 0.1, p99


def test_progress_is_told(measured, lines):
    assert "1/2 oren-nayar-0.52: fitting" in lines
    assert any("D-BRDF" in line for line in lines)


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
    text = factor_benchmark.page(measured)
    page = Page()
    page.feed(text)
    assert page.open == []
    assert page.images == 2 * 2 * 5
    assert all(source.startswith("data:image/webp;base64,") for source in page.fetched), page.fetched
    assert not re.search(r"url\(|@import|https?://", text)
    assert text.count('class="curve ') == 2 * 3 * 3
    assert text.count("<circle") == 2 * 2 * len(measured["points"])
    assert not re.search(r"\bnan\b", re.sub(r"data:[^\"]*", "", text))


def test_page_without_points_or_pictures(measured):
    text = factor_benchmark.page({**measured, "points": [], "figures": []})
    assert "ashikhmin-shirley-32" in text and "Speed against error" not in text


def test_xyz_of_packs_is_that_of_their_brdf():
    """Two roads to the same colours: folded terms, and spectra under every light."""
    brdf = analytic_cases()[1].make()
    packs = factor_benchmark.fit(brdf, budget=5.0, pixels=32).packs
    protocol = sphere_protocol(24, True)
    lights = ("D65", "FL11")
    np.testing.assert_allclose(
        pack_xyz(packs, protocol, lights), brdf_xyz(FactoredBrdf(packs), protocol, lights), atol=1e-12
    )


def test_polar_radius_is_the_root_of_what_the_formula_says():
    brdf = analytic_cases()[0].make()
    radii = np.array(factor_figures.polar_radii(brdf))
    angles = factor_figures.polar_angles_deg()
    assert radii.shape == (3, len(angles))
    np.testing.assert_allclose(radii[0], radii[0][::-1], atol=2e-5)
    # Rough surfaces send more back towards the light, which is on the positive side.
    assert radii[2][np.argmin(abs(angles - 60))] > radii[2][np.argmin(abs(angles + 60))]


def test_cases_by_name(tmp_path):
    assert [case.name for case in chosen_cases(None)] == [case.name for case in analytic_cases()]
    with pytest.raises(UnknownNameError, match="oren-nayar"):
        chosen_cases(["oren-nayar-0.25"])
    with pytest.raises(InputError, match="no such folder"):
        chosen_cases(None, tmp_path / "nowhere")
    with pytest.raises(InputError, match="no measured materials"):
        chosen_cases(None, tmp_path)


def test_measured_case_is_read(shared_data):
    names = [case.name for case in measured_cases(shared_data)]
    assert {"red-fabric", "blue-metallic-paint", "yellow-matte-plastic"} <= set(names)
    brdf = chosen_cases(["red-fabric"], shared_data)[0].make()
    up = np.array([0.0, 0.0, 1.0])
    assert brdf.isotropic and np.all(brdf.eval(up, up) > 0)


@pytest.mark.slow
def test_tensorly_row():
    pytest.importorskip("tensorly")
    found = factor_benchmark.run(
        ["oren-nayar-0.52"],
        lights=("D65",),
        pixels=32,
        picture_pixels=0,
        points=False,
        baseline=True,
        renderer=SoftwareRenderer(),
    )
    baseline = found["rows"][0]["baseline"]
    assert baseline["tensorly_seconds"] > 0 and 0 < baseline["tensorly_relative_error"] < 0.1
