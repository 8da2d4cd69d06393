"""The 2004 paper's way on a draped cloth, small."""

import json

import pytest
from btf_samples import bumps
from metamer.benchmarks.papers.transfer_tensors import clustered_harmonic
from metamer.benchmarks.transfer import benchmark, draped_btf, scenes
from metamer.runtime.errors import InputError


@pytest.fixture(scope="module")
def found():
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(draped_btf, "SIDE", 12)
        patched.setattr(draped_btf, "BUDGET", 15.0)
        patched.setattr(draped_btf, "_SIZE", 3)
        patched.setattr(clustered_harmonic, "_COORDINATES", 24)
        patched.setattr(draped_btf, "_EDGE", 0.7)
        patched.setattr(draped_btf, "_RAYS", 96)
        patched.setattr(draped_btf, "BOUNCES", 2)
        patched.setattr(draped_btf, "btf_cases", lambda *_: pytest.fail("traces a BTF"))
        images = bumps(4, 4, views=3, lights=5)
        yield draped_btf.draped_rows(lambda line: None, images, divisions=8)


@pytest.mark.slow
def test_rows_have_what_is_promised(found):
    assert [row["method"] for row in found] == ["paper-2004", "paper-2004, no clusters"]
    for row in found:
        assert row["scene"] == draped_btf.NAME and row["regions"] == 3 and row["vertices"] > 100
        assert row["relight_ms"]["all"] >= row["relight_ms"]["material"] > row["relight_ms"]["view"] > 0.0
    json.dumps(found)
    assert "paper-2004" in benchmark.report({"rows": found})


@pytest.mark.slow
def test_it_is_near_to_paths(found):
    """The basis of harmonics alone costs a mean of some 1.5; without the walls' light it would be far off."""
    for row in found:
        assert 0.1 < row["delta_e94"]["mean"] < 3.0
        assert row["delta_e94"]["mean"] < row["delta_e94"]["p95"] <= row["delta_e94"]["p99"]
    assert found[1]["delta_e94"]["mean"] <= found[0]["delta_e94"]["mean"] + 0.3


def test_it_is_measured_where_it_is_asked_for(monkeypatch):
    monkeypatch.setitem(benchmark.EXTRA, draped_btf.NAME, lambda progress: ["a row"])
    monkeypatch.setattr(scenes, "SIDE", 8)
    assert benchmark.run(case=draped_btf.NAME) == {"rows": ["a row"]}
    with pytest.raises(InputError, match="draped-cloth"):
        benchmark.run(case="kitchen")
