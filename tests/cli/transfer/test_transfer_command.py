"""`metamer transfer`: how many bounces a scene needs, what its parts put on each other, and the rays that are kept."""

import json

import pytest
from metamer.lighting.transfer import hits, ray_cache
from metamer.materials.intake.importing import import_sources


def test_a_ball_needs_no_bounce(metamer, scene, tiny_catalogue, tmp_path):
    file = tmp_path / "found.json"
    code, said, _ = metamer("transfer", "show", scene, "--catalogue", tiny_catalogue, "--rays", 16, "--json", file)
    assert code == 0
    assert "needs no bounce" in said
    assert "no part changes the colour of another" in said
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["bounces"] == 0
    assert [one["delta_e94"]["max"] for one in found["pairs"]] == [0.0]


def test_a_floor_below_a_ball(metamer, scene, tiny_catalogue, tmp_path):
    text = scene.read_text(encoding="utf-8")
    material = text.split('material = "')[1].split('"')[0]
    floor = f'[[part]]\nname = "floor"\nshape = "plane"\ntranslate = [0, -1, 0]\nmaterial = "{material}"\n\n'
    scene.write_text(text.replace("[[part]]", floor + "[[part]]", 1), encoding="utf-8")
    file = tmp_path / "found.json"
    code, said, _ = metamer("transfer", "show", scene, "--catalogue", tiny_catalogue, "--rays", 16, "--json", file)
    assert code == 0
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["bounces"] >= 1
    assert f"needs {found['bounces']} bounce" in said
    on = {(one["on"], one["by"]): one["delta_e94"]["mean"] for one in found["pairs"]}
    ball = next(one["part"] for one in found["parts"] if one["part"] != "floor")
    assert on[ball, "floor"] > 1.0


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--rays", "0"], 64, "at least 1"),
        (["--illuminant", "D66"], 64, "D66"),
        (["--json", "/nowhere/found.json"], 4, "nowhere"),
    ],
)
def test_what_is_refused(metamer, scene, tiny_catalogue, words, code, said):
    found, _, err = metamer("transfer", "show", scene, "--catalogue", tiny_catalogue, *words)
    assert found == code
    assert said in err


def test_what_was_built_is_shown_without_tracing(metamer, scene, tiny_catalogue, tmp_path, monkeypatch):
    folder, words = tmp_path / "rays", ["--catalogue", tiny_catalogue, "--rays", 16]
    code, said, _ = metamer("transfer", "build", scene, *words, "--into", folder)
    assert code == 0
    assert " vertices of 16 rays, " in said
    assert "MB in 1 block; " in said
    assert len(list(folder.iterdir())) == 1
    monkeypatch.setattr(ray_cache, "_traced", lambda *_: pytest.fail("traced again"))
    assert metamer("transfer", "show", scene, *words, "--kept", folder)[0] == 0
    assert "1 of which were there" in metamer("transfer", "build", scene, *words, "--into", folder)[1]


def test_without_a_folder_they_are_in_the_cache(metamer, scene, tiny_catalogue, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    words = [scene, "--catalogue", tiny_catalogue, "--rays", 16]
    assert metamer("transfer", "build", *words)[0] == 0
    assert len(list((tmp_path / "metamer" / "transfer").iterdir())) == 1
    monkeypatch.setattr(ray_cache, "_traced", lambda *_: pytest.fail("traced again"))
    assert metamer("transfer", "show", *words)[0] == 0
    monkeypatch.setenv("METAMER_CACHE_GB", "0")
    code, _, err = metamer("transfer", "build", *words)
    assert code == 4 and "name one by -o" in err


FAMILY = """family = "tiny"
kind = "analytic"
[[material]]
name = "matt-red"
model = "lambert"
reflectance = { constant = %s }
"""


@pytest.mark.slow
def test_a_material_that_changes_while_a_build_runs_does_no_harm(metamer, scene, tmp_path, monkeypatch):
    """The rays are the same bytes, and what is shown of them is shown with the new material."""
    source, catalogue = tmp_path / "tiny.toml", tmp_path / "changing"

    def imported(reflectance):
        source.write_text(FAMILY % reflectance, encoding="utf-8")
        import_sources([source], catalogue, jobs=1)

    imported(0.2)
    monkeypatch.setattr(hits, "_AT_ONCE", 64 * 16)
    words, traced, calls = [scene, "--catalogue", catalogue, "--rays", 16], ray_cache._traced, []
    metamer("transfer", "build", *words, "--into", tmp_path / "calm")

    def changing(*given):
        calls.append(given)
        if len(calls) == 3:
            imported(0.7)
        return traced(*given)

    monkeypatch.setattr(ray_cache, "_traced", changing)
    code, _, _ = metamer("transfer", "build", *words, "--into", tmp_path / "rays", "--processes", 1)
    assert code == 0 and len(calls) > 3
    calm, rays = ({f.name: f.read_bytes() for f in (tmp_path / name).iterdir()} for name in ("calm", "rays"))
    assert calm == rays
    calls.clear()
    _, said, _ = metamer("transfer", "show", *words, "--kept", tmp_path / "rays")
    assert not calls and " 0.70 " in said
