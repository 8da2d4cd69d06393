"""Maps of files, drawn texel by texel: which way is up, where they lie, and what is asked."""

import numpy as np
import pytest
from metamer.materials.core.points import Points
from metamer.materials.formats import maps
from metamer.materials.formats.pictures.normal_maps import green_of, normals_of
from metamer.materials.intake.sources import read_sources
from metamer.materials.records.models import rebuild
from metamer.materials.records.source import Rejected
from metamer.materials.svbrdf.textures import Texture
from metamer.runtime.errors import InputError
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.import_options import NO_ANSWER, ImportOptions
from metamer.spectral.srgb import srgb_to_linear
from PIL import Image

RNG = np.random.default_rng(11)
BASE = RNG.integers(0, 256, (32, 48, 3)).astype(np.uint8)
UP = np.array([[0.0, 0.0, 1.0]])


def save(path, values):
    Image.fromarray(np.asarray(values, np.uint8)).save(path)
    return path


def bumps(green="opengl", depth=1.5, noise=0.0):
    """The normal map of waves that run across each other."""
    y, x = np.mgrid[0:32, 0:48]
    height = np.sin(2 * np.pi * (x / 24 + y / 16)) + np.cos(2 * np.pi * (x / 12 - y / 32))
    along, down = (0.5 * (np.roll(height, -1, axis) - np.roll(height, 1, axis)) for axis in (1, 0))
    rng = np.random.default_rng(0)
    along, down = (slope + rng.normal(0, noise, slope.shape) if noise else slope for slope in (along, down))
    normal = np.stack([-depth * along, (depth if green == "opengl" else -depth) * down, np.ones_like(along)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.round(127.5 * (normal + 1)).astype(np.uint8)


def read(path, answer=NO_ANSWER):
    (found,) = maps.read_sources(path, "mallett-yuksel", answer)
    return found


def surface_of(path, answer=NO_ANSWER):
    found = read(path, answer)
    assert found.model == "maps" and "each of which is rendered" in found.provenance.notes
    return rebuild(found.model, found.parameters)


def lean_at(surface, row, column):
    """x and y of the normal of a texel."""
    return surface.texels(np.array([row]), np.array([column])).normal[0]


@pytest.mark.parametrize(
    ("name", "green"),
    [("wall_nor_gl", "opengl"), ("wall_nor_dx", "directx"), ("wall_NormalGL", "opengl"), ("wall_NormalDX", "directx")],
)
def test_normal_maps_of_both_conventions_by_their_names(tmp_path, name, green):
    """Both show the same bumps."""
    albedo = save(tmp_path / "wall_diff.png", BASE)
    save(tmp_path / f"{name}.png", bumps(green))
    lean, truth = lean_at(surface_of(albedo), 3, 7), bumps("opengl")[3, 7] / 127.5 - 1
    np.testing.assert_allclose(lean, truth[:2] / np.linalg.norm(truth), atol=0.006)


@pytest.mark.parametrize("green", ["opengl", "directx"])
def test_normal_maps_of_both_conventions_prove_themselves(tmp_path, green):
    albedo = save(tmp_path / "wall_diff.png", BASE)
    save(tmp_path / "wall_normal.png", bumps(green))
    lean, truth = lean_at(surface_of(albedo), 3, 7), bumps("opengl")[3, 7] / 127.5 - 1
    np.testing.assert_allclose(lean, truth[:2] / np.linalg.norm(truth), atol=0.006)
    assert "slopes are those of one height" in read(albedo).provenance.notes
    other = "directx" if green == "opengl" else "opengl"
    with pytest.raises(InputError, match="not what --normal-map says"):
        read(albedo, ImportOptions(normal_map=other))


def test_a_normal_map_that_proves_nothing_is_asked_about(tmp_path):
    albedo = save(tmp_path / "wall_diff.png", BASE)
    rough = 127.5 + RNG.normal(0, 40, (32, 48, 3)) * (1, 1, 0) + (0, 0, 100)
    save(tmp_path / "wall_normal.png", np.clip(rough, 0, 255))
    with pytest.raises(InputError, match="does not say which way is up") as caught:
        read(albedo)
    assert (caught.value.file, caught.value.field) == (albedo, "wall_normal.png")
    assert "--normal-map" in caught.value.hint and "--maps mean" in caught.value.hint
    leans = [lean_at(surface_of(albedo, ImportOptions(normal_map=green)), 5, 5) for green in ("opengl", "directx")]
    np.testing.assert_allclose(leans[0], leans[1] * (1, -1))
    assert read(albedo, ImportOptions(maps="mean")).model == "lambert"


def test_maps_without_slopes_along_v_need_no_answer(tmp_path):
    flat = np.tile(np.array([[[128, 128, 255]]], np.uint8), (8, 8, 1))
    path = save(tmp_path / "flat.png", flat)
    assert green_of(Texture("normal", path.read_bytes(), "linear", path, "normal")) == "opengl"


def test_zero_normals_are_refused_by_their_place_or_mended(tmp_path):
    albedo = save(tmp_path / "wall_diff.png", BASE)
    values = bumps()
    values[4, 9] = 127
    save(tmp_path / "wall_nor_gl.png", values)
    with pytest.raises(InputError, match=r"normal without length|points below") as caught:
        read(albedo)
    assert caught.value.field == "normal, row 4, column 9" and caught.value.file == albedo
    assert "--maps mended" in caught.value.hint
    mended = read(albedo, ImportOptions(maps="mended"))
    assert "1 of 1536 normals" in mended.provenance.notes
    assert not lean_at(rebuild(mended.model, mended.parameters), 4, 9).any()


def test_a_normal_map_without_blue_has_what_x_and_y_leave(tmp_path):
    albedo = save(tmp_path / "wall_diff.png", BASE)
    for blue in (0, 255):
        values = bumps()
        values[..., 2] = blue
        save(tmp_path / "wall_nor_gl.png", values)
        found = read(albedo)
        assert "has no blue" in found.provenance.notes
        lean = lean_at(rebuild(found.model, found.parameters), 3, 7)
        np.testing.assert_allclose(lean, bumps()[3, 7, :2] / 127.5 - 1, atol=1e-6)
    save(tmp_path / "wall_nor_gl.png", bumps()[..., 0])
    with pytest.raises(InputError, match="without colours"):
        read(albedo)


def test_normal_maps_of_floats(tmp_path):
    vector = np.array([0.36, 0.48, 0.8])
    path = tmp_path / "a_nor_gl.exr"
    write_exr(path, {}, {name: np.full((2, 3), vector[at], np.float32) for at, name in enumerate("RGB")})
    normal, _ = normals_of(Texture("normal", path.read_bytes(), "linear", path, "normal"), "directx")
    np.testing.assert_allclose(normal.decoded(normal.values)[0, 0], vector * (1, -1, 1), rtol=1e-6)


def test_roughness_metal_and_masks_are_drawn(tmp_path):
    albedo = save(tmp_path / "w_albedo.png", BASE)
    rough, metal = RNG.integers(0, 256, (2, 32, 48)).astype(np.uint8)
    mask = (RNG.uniform(size=(32, 48)) > 0.5).astype(np.uint8) * np.uint8(255)
    for name, values in (("gloss", rough), ("metallic", metal), ("opacity", mask), ("ao", metal)):
        save(tmp_path / f"w_{name}.png", values)
    found = read(albedo)
    surface = rebuild(found.model, found.parameters)
    texels = surface.texels(np.array([1, 2]), np.array([5, 6]))
    share = metal[[1, 2], [5, 6]] / 255.0
    np.testing.assert_allclose(texels.body, srgb_to_linear(BASE[[1, 2], [5, 6]] / 255) * (1 - share)[:, None])
    alpha = np.maximum((1 - rough[[1, 2], [5, 6]] / 255.0) ** 2, 0.002)
    np.testing.assert_allclose(texels.spread[:, 0], alpha**2)
    np.testing.assert_allclose(texels.covers, mask[[1, 2], [5, 6]] / 255.0)
    assert "not rendered: occlusion" in found.provenance.notes and "what lies behind is seen" in found.provenance.notes
    assert surface.cutout is not None
    assert found.provenance.kind == "uplifted(mallett-yuksel)"
    save(tmp_path / "w_opacity.png", rough)
    assert "opacity map is no mask" in read(albedo).provenance.notes


def test_texels_that_are_all_alike_are_a_uniform_material(tmp_path):
    albedo = save(tmp_path / "w_albedo.png", np.full((4, 4, 3), 99))
    save(tmp_path / "w_nor_gl.png", np.tile(np.array([[[128, 128, 255]]], np.uint8), (4, 4, 1)))
    assert read(albedo).model == "lambert"


def test_a_matt_set_is_perfectly_diffuse(tmp_path):
    surface = surface_of(save(tmp_path / "w_albedo.png", BASE))
    wi = np.array([[0.6, 0.0, 0.8]])
    found = surface.at(Points(wi, UP, np.array([[0.5 / 48, 1 - 0.5 / 32]])))
    expected = surface.spectra(srgb_to_linear(BASE[:1, 0] / 255.0)) / np.pi
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_answers_reach_the_maps_of_a_folder(tmp_path):
    save(tmp_path / "w_albedo.png", BASE)
    ((drawn,), (mean,)) = (read_sources(tmp_path, answer=ImportOptions(maps=how)) for how in (None, "mean"))
    assert not isinstance(drawn, Rejected) and (drawn.model, mean.model) == ("maps", "lambert")


def test_a_specular_map_is_asked_about_and_drawn_as_it_was_answered(tmp_path):
    albedo = save(tmp_path / "dif.png", BASE)
    save(tmp_path / "rgh.png", RNG.integers(60, 200, (32, 48)))
    specular = RNG.integers(5, 110, (32, 48, 3)).astype(np.uint8)
    path = save(tmp_path / "spe.png", specular)
    asked = read(albedo)
    assert "say it with --specular-map" in asked.provenance.notes
    assert not rebuild(asked.model, asked.parameters).reflected.values.shape[0] > 1
    for words, expected in (("f0-srgb", srgb_to_linear(specular / 255.0)), ("f0-linear", specular / 255.0)):
        found = read(albedo, ImportOptions(specular_map=words))
        surface = rebuild(found.model, found.parameters)
        texels = surface.texels(np.array([3]), np.array([7]))
        np.testing.assert_allclose(texels.facets[0], expected[3, 7], rtol=1e-12)
        np.testing.assert_allclose(texels.body[0], srgb_to_linear(BASE[3, 7] / 255.0), rtol=1e-12)
        np.testing.assert_allclose(texels.through, 1.0 - expected[3, 7].max(), rtol=1e-12)
        assert "as you said" in found.provenance.notes and "not rendered" not in found.provenance.notes
        mean = read(albedo, ImportOptions(maps="mean", specular_map=words))
        colour = surface.spectra(expected.reshape(-1, 3).mean(axis=0)[None])[0]
        np.testing.assert_allclose(mean.parameters["specular"], colour, rtol=1e-6)
    path.rename(tmp_path / "spe_linear.png")
    with pytest.raises(InputError, match="not what --specular-map says"):
        read(albedo, ImportOptions(specular_map="f0-srgb"))
    save(tmp_path / "reflection.png", specular)
    with pytest.raises(InputError, match="two maps of one property"):
        read(albedo, ImportOptions(specular_map="f0-linear"))


def test_specular_maps_of_floats_are_linear(tmp_path):
    albedo = save(tmp_path / "dif.png", BASE)
    shown = RNG.uniform(0.02, 0.3, (3, 32, 48)).astype(np.float32)
    write_exr(tmp_path / "spe.exr", {}, dict(zip("RGB", shown, strict=True)))
    with pytest.raises(InputError, match="not what --specular-map says"):
        read(albedo, ImportOptions(specular_map="f0-srgb"))
    found = read(albedo, ImportOptions(specular_map="f0-linear"))
    assert "no roughness map: taken as 1" in found.provenance.notes
    texels = rebuild(found.model, found.parameters).texels(np.array([3]), np.array([7]))
    np.testing.assert_allclose(texels.facets[0], shown[:, 3, 7], rtol=1e-6)


def test_a_measured_set_of_four_maps(shared_data):
    """Of a greeting card: its facets reflect 2 to 7 % at the normal, and some are tinted."""
    found = read(shared_data / "maps" / "card_blue" / "dif.png", ImportOptions(specular_map="f0-srgb"))
    surface = rebuild(found.model, found.parameters)
    facets = np.concatenate([texels.facets for _, texels in surface.blocks()])
    assert (
        surface.size == (256, 256) and 0.02 < np.median(facets, axis=0).min() < np.median(facets, axis=0).max() < 0.07
    )
