"""The mean of maps against the slow, obvious one; and spectra of colours that stay below 1."""

import io

import numpy as np
import pytest
from metamer.materials.formats.gltf import emission_of
from metamer.materials.formats.pictures.stand_in import Colour, Number, SurfaceMaps, reflectance_of
from metamer.materials.svbrdf.textures import Texture, blocks
from metamer.runtime.errors import InputError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.srgb import srgb_to_linear
from metamer.spectral.upsampling import METHODS, xyz_from_rgb
from PIL import Image


def texture(tmp_path, values, encoding="linear"):
    file = io.BytesIO()
    Image.fromarray(np.asarray(values, np.uint8)).save(file, "PNG")
    return Texture("a", file.getvalue(), encoding, tmp_path / "a.png", "a")


def test_the_mean_is_that_of_every_texel_by_itself(tmp_path):
    random = np.random.default_rng(8)
    base, packed = random.integers(0, 256, (300, 500, 4)), random.integers(0, 256, (300, 500, 3))
    tint = random.integers(0, 256, (300, 500, 3))
    maps = SurfaceMaps(
        base=Colour(texture(tmp_path, base, "sRGB"), (0.9, 0.8, 0.7)),
        metallic=Number(texture(tmp_path, packed), 2, 0.6),
        roughness=Number(texture(tmp_path, packed), 1, 0.5),
        reflected=Colour(texture(tmp_path, tint, "sRGB"), (0.04, 0.05, 0.06)),
        weight=Number(scale=0.9),
        coverage=Number(texture(tmp_path, base, "sRGB"), 3),
    )
    colours = srgb_to_linear(base[..., :3] / 255) * (0.9, 0.8, 0.7)
    facets = srgb_to_linear(tint / 255) * (0.04, 0.05, 0.06)
    metal, share = 0.6 * packed[..., 2:] / 255, base[..., 3:] / 255

    def mean(values):
        return (values * share).sum(axis=(0, 1)) / share.sum()

    found = maps.mean()
    np.testing.assert_allclose(found.diffuse, mean(colours * (1 - metal)), rtol=1e-10)
    np.testing.assert_allclose(found.specular, mean(0.9 * facets * (1 - metal) + colours * metal), rtol=1e-10)
    np.testing.assert_allclose(found.edge, mean(0.9 * (1 - metal) + metal)[0], rtol=1e-10)
    np.testing.assert_allclose(found.roughness, mean(0.5 * packed[..., 1:2] / 255)[0], rtol=1e-10)
    np.testing.assert_allclose(found.opacity, share.mean(), rtol=1e-10)
    assert maps.mean() is found


def test_a_smaller_map_covers_the_larger_one(tmp_path):
    """Each texel of the 2 x 3 map counts for 4 x 2 of the 8 x 6 one."""
    random = np.random.default_rng(8)
    base, metal = random.integers(0, 256, (8, 6, 3)), random.integers(0, 256, (2, 3))
    maps = SurfaceMaps(base=Colour(texture(tmp_path, base)), metallic=Number(texture(tmp_path, metal)))
    spread = metal.repeat(4, axis=0).repeat(2, axis=1)[..., None] / 255
    np.testing.assert_allclose(maps.mean().diffuse, (base / 255 * (1 - spread)).mean(axis=(0, 1)), rtol=1e-12)
    assert maps.mean().sizes == ((8, 6), (2, 3))


@pytest.mark.parametrize(("height", "width"), [(1, 1), (3, 70000), (1000, 130), (70000, 1)])
def test_blocks_cover_every_row_once(height, width):
    rows = [row for block in blocks(height, width) for row in range(block.start, block.stop)]
    assert rows == list(range(height))


@pytest.mark.parametrize("uplift", METHODS)
def test_reflectances_stay_below_one_and_keep_their_colour(uplift):
    weights = observer("1931_2").weights(illuminant("D65"), np.linspace(380.0, 780.0, 81))
    # Smits' own blue comes back as 0.90.
    tolerance = 0.1 if uplift == "smits" else 2e-3
    for rgb in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0), (1.0, 0.0, 1.0), (0.2, 0.5, 0.1), (0.0, 0.0, 0.0)):
        made, note = reflectance_of(rgb, uplift)
        assert made.min() >= 0 and made.max() <= 1
        np.testing.assert_allclose(np.linalg.solve(xyz_from_rgb(), weights @ made), rgb, atol=tolerance)
        assert not note or uplift != "mallett-yuksel"


@pytest.mark.parametrize("rgb", [(1.1, 0.5, 0.5), (-0.1, 0.5, 0.5)])
def test_colours_of_no_reflectance_are_refused(rgb):
    with pytest.raises(InputError, match="no reflectance") as caught:
        reflectance_of(rgb, "mallett-yuksel")
    assert caught.value.found and caught.value.hint


def test_the_mean_of_an_emission_map(tmp_path):
    lit = texture(tmp_path, [[[255, 255, 255], [0, 0, 0]]], "sRGB")
    spectrum, note = emission_of(Colour(lit, (40.0, 40.0, 40.0)), "mallett-yuksel")
    np.testing.assert_allclose(spectrum["linear_rgb"], 20.0)
    y_bar = observer("1931_2").sensitivity(spectrum["wavelengths_nm"])[1]
    assert 683.002 * y_bar @ spectrum["values"] == pytest.approx(20.0, rel=2e-3) and "mean of a map" in note
