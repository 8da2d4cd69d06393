"""The harness that kills builds of rays, at work: a few kills of a small scene. More: transfer_kills.py."""

import importlib
import sys

import pytest

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="finds processes in /proc")


@pytest.fixture(scope="module")
def harness():
    return importlib.import_module("transfer_kills")


@pytest.mark.stress
def test_a_build_that_is_killed_ends_in_the_same_bytes(harness, tmp_path):
    (row,) = harness.rounds(tmp_path, count=1, kills=2, jobs=1, balls=1, rays=64)
    assert row["command"] + row["nothing"] == 2
    assert row["blocks"] == sorted(row["blocks"])


@pytest.mark.slow
def test_a_block_that_no_undisturbed_build_has_is_seen(harness, tmp_path):
    scene = harness.scene_file(tmp_path, 1)
    with pytest.raises(RuntimeError, match="undisturbed"):
        harness.killed_round(tmp_path / "other", scene, {}, 4.0, 1, 1, 16, seed=0)
