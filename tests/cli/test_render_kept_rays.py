"""`metamer render --bounces` over rays that an earlier command has kept."""

import numpy as np
import pytest
from metamer.lighting.transfer import ray_cache
from metamer.lighting.visibility import refinement
from metamer.spectral.formats.exr import read_exr

FLOOR = '[[part]]\nname = "floor"\nshape = "plane"\ntranslate = [0, -1, 0]\nmaterial = "tiny/matt-red"\n\n'


def test_a_second_picture_of_the_same_geometry_traces_nothing(metamer, scene, tiny_catalogue, tmp_path, monkeypatch):
    monkeypatch.setattr(refinement, "MOST_VERTICES", 200)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    scene.write_text(scene.read_text(encoding="utf-8").replace("[[part]]", FLOOR + "[[part]]", 1), encoding="utf-8")
    words = [scene, "--catalogue", tiny_catalogue, "--renderer", "software", "--bounces", 1]
    code, _, err = metamer("render", *words, "-o", tmp_path / "first.exr")
    assert code == 0, err
    assert list((tmp_path / "metamer" / "transfer").iterdir())
    monkeypatch.setattr(ray_cache, "_traced", lambda *_: pytest.fail("traced again"))
    assert metamer("render", *words, "-o", tmp_path / "second.exr")[0] == 0
    first, second = (read_exr(tmp_path / f"{name}.exr")[1]["Y"] for name in ("first", "second"))
    assert np.array_equal(first, second)
