"""Pictures of spectral textures: both renderers beside the reference, near and far, and from file to report."""

import json
from dataclasses import replace

import numpy as np
import pytest
from metamer.cli.main import main
from metamer.lighting.camera import Camera
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.reference import reference_images
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formats.spectral_exr import write_spectral_texture
from metamer.spectral.illuminants import illuminant
from metamer.viewer.software.backend import software_session

NM = np.arange(400.0, 701.0, 20.0)
LIGHTS = [illuminant(name) for name in ("D65", "A", "FL11")]


def weave(height=33, width=50):
    """Two dyed yarns over one another, and a white mark in the upper left corner: (H,W,L)."""
    y, x = np.mgrid[0:height, 0:width]
    over = (0.5 + 0.5 * np.sin(x * 2 * np.pi / 10) * np.sin(y * 2 * np.pi / 11))[..., None]
    red, blue = 0.05 + 0.6 / (1 + np.exp((590 - NM) / 12)), 0.05 + 0.5 * np.exp(-(((NM - 470) / 40) ** 2))
    woven = over * red + (1 - over) * blue
    woven *= np.random.default_rng(2).uniform(0.9, 1.0, (height, width, 1))
    woven[2:8, 2:14] = 0.9
    return woven


TEXTURE = SpectralTexture(NM, weave())
FORM = TEXTURE.own_form()


@pytest.mark.slow
@pytest.mark.parametrize("filtering", ["linear", "mipmapped"])
def test_both_renderers_agree_in_light_from_all_around(scenes, drawn_by_both, filtering):
    fields = np.random.default_rng(1).random((2, 16, 32))
    sky = EnvironmentLight(fields, tuple(LIGHTS[:2]))
    scene = replace(scene_of(scenes, size=32), lights=(sky,))
    scene = replace(scene, parts=scene.parts[:1])
    both = drawn_by_both(scene, {"cloth": FORM}, filtering)
    assert both.coverage.any() and np.abs(both.theirs - both.mine).max() < 1e-4 * both.mine.max()


def scene_of(scenes, distance=3.0, samples=2, size=64, **mesh):
    floor = shapes.plane(4.0, 4.0)
    parts = [(shapes.speed_shape(4, uv=True).placed(translate=(0, 0.8, 0)), "cloth"), (replace(floor, **mesh), "cloth")]
    eye = distance * np.array([0.3, 0.8, 1.0])
    camera = Camera("c", eye, (0, 0.4, 0), vertical_fov_deg=40.0, width=size, height_px=size, samples=samples)
    return scenes.scene_of(parts, [scenes.sun(), scenes.lamp()], camera)


@pytest.mark.parametrize("repeats", [1.0, -2.0], ids=["as it is", "repeated and mirrored"])
def test_pictures_are_the_reference_point_for_point(scenes, make_session, repeats):
    scene = scene_of(scenes, uv=repeats * shapes.plane(4.0, 4.0).uv)
    truth = reference_images(scene, None, {"cloth": TEXTURE}, LIGHTS)
    with make_session() as renderer:
        shown = renderer.render_many(scene, None, {"cloth": FORM}, LIGHTS)
    for (xyz, coverage), reference, light in zip(shown, truth.xyz, LIGHTS, strict=True):
        whole = (coverage == 1.0) & (truth.coverage == 1.0)
        off = delta_e_xyz(reference[whole], xyz[whole].astype(float), scene.observer.white(light))
        assert whole.mean() > 0.3 and np.median(off) < 0.02 and np.percentile(off, 95) < 0.5


@pytest.mark.parametrize("filtering", ["linear", "mipmapped"])
@pytest.mark.parametrize("distance", [2.5, 40.0], ids=["near", "far"])
def test_gl_and_numpy_agree(scenes, drawn_by_both, filtering, distance):
    assert drawn_by_both(scene_of(scenes, distance, size=48), {"cloth": FORM}, filtering).off.max() < 0.1


def test_far_away_means_are_nearer_to_many_samples(scenes, make_session):
    """Some twenty texels a sample: what lies between is not seen without."""
    scene = scene_of(scenes, 30.0, samples=1, size=48, uv=12.0 * shapes.plane(4.0, 4.0).uv)
    fine = replace(scene.camera(), samples=16)
    with software_session() as many:
        truth, whole = many.render(scene, fine, {"cloth": FORM})
    found = {}
    for filtering in ("linear", "mipmapped"):
        with make_session(filtering) as renderer:
            xyz, _ = renderer.render(scene, None, {"cloth": FORM})
        inside = whole == 1.0
        found[filtering] = delta_e_xyz(truth[inside].astype(float), xyz[inside].astype(float), scene.adopted_white())
    assert np.mean(found["mipmapped"]) < 0.5 * np.mean(found["linear"])


def test_another_light_folds_kept_terms(scenes, make_session):
    scene = scene_of(scenes)
    with make_session() as renderer:
        plain = renderer.render_many(scene, None, {"cloth": FORM}, LIGHTS[1:2])
        renderer.configure(keeps_terms=True)
        renderer.render_many(scene, None, {"cloth": FORM}, LIGHTS[:1])
        terms = [dict(piece.terms) for piece in renderer.cache.pieces]
        (kept,) = renderer.render_many(scene, None, {"cloth": FORM}, LIGHTS[1:2])
        assert terms[0] and all(piece.terms == old for piece, old in zip(renderer.cache.pieces, terms, strict=True))
    np.testing.assert_allclose(kept[0], plain[0][0], rtol=1e-4, atol=1e-5)


def test_the_mark_is_in_the_upper_left_corner(scenes, make_session):
    wall = shapes.plane(1.0, 1.0).placed(rotate_deg=(90, 0, 0))
    camera = Camera("c", (0, 0, 3), (0, 0, 0), (0, 1, 0), "orthographic", height=1.0, width=50, height_px=33, samples=1)
    camera = replace(camera, width=33)
    scene = scenes.scene_of([(wall, "cloth")], [scenes.sun((0.0, 0.0, 1.0))], camera)
    with make_session() as renderer:
        xyz, _ = renderer.render(scene, None, {"cloth": FORM})
    row, column = np.unravel_index(np.argmax(xyz[..., 2]), xyz.shape[:2])
    assert row < 10 and column < 12, (row, column)


@pytest.mark.slow
def test_from_file_to_picture_thumbnail_and_report(tmp_path, capsys):
    write_spectral_texture(tmp_path / "weave.exr", weave().astype(np.float32), NM, False, "not stated", {})
    catalogue = tmp_path / "cat"
    assert main(["catalogue", "import", str(tmp_path / "weave.exr"), "--into", str(catalogue), "--jobs", "1"]) == 0
    sheet = tmp_path / "sheet.png"
    assert main(["catalogue", "preview", str(catalogue), "--png", str(sheet), "--renderer", "software"]) == 0
    assert sheet.stat().st_size > 10_000
    (tmp_path / "scene.toml").write_text(
        """
[scene]
name = "Ball"
observer = "1931_2"
[[part]]
name = "ball"
shape = "sphere"
subdivisions = 4
material = "textures/weave"
[[light]]
kind = "directional"
direction_to_light = [0.3, 0.5, 1.0]
illuminance_lux = 1000.0
spectrum = "D65"
[[camera]]
position = [0, 0, 4]
target = [0, 0, 0]
vertical_fov_deg = 36
width = 64
height_px = 64
samples = 2
[review]
on = "ball"
materials = ["textures/*"]
illuminants = ["D65", "FL11", "A"]
"""
    )
    out = tmp_path / "out"
    words = ["review", tmp_path / "scene.toml", "--catalogue", catalogue, "--out", out, "--renderer", "software"]
    assert main([*map(str, words), "--jobs", "1"]) == 0
    rows = json.loads((out / "review.json").read_text())["results"]
    assert len(rows) == 3 and all(row["delta_e94"]["p99"] < 0.5 for row in rows)
    capsys.readouterr()
