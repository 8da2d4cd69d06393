"""BTFs that are odd, each from files of images to a picture."""

import shutil
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from btf_cloths import NINE, SAID, UBO, cloth, draped, drawn, error_of, imported, refused, saved
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.upsampling import xyz_from_rgb
from metamer.viewer.gl.backend import gl_session


def shown_alike(scenes, gl, fast):
    mine, theirs = drawn(scenes, fast), drawn(scenes, fast, gl_session(gl))
    assert delta_e_xyz(mine.astype(float), theirs.astype(float), draped(scenes).adopted_white()).max() < 0.1


@pytest.mark.slow
def test_a_cloth_that_is_not_odd(scenes, gl, tmp_path):
    found = imported(saved(tmp_path / "wool", cloth()), tmp_path / "cat")
    assert error_of(found) < 0.8
    assert drawn(scenes, found.fast)[..., 1].max() > 0.1
    shown_alike(scenes, gl, found.fast)


def test_a_constant_texture_is_one_cluster_and_exact(scenes, tmp_path):
    flat = np.repeat(np.repeat(cloth(size=(1, 1)), 8, axis=2), 8, axis=3)
    found = imported(saved(tmp_path / "felt", flat), tmp_path / "cat")
    assert not found.fast.texels.form.number.any() and len(found.fast.texels.table) == 1
    assert error_of(found) < 0.1
    drawn(scenes, found.fast)


@pytest.mark.slow
def test_a_texel_that_is_black_in_every_image(scenes, gl, tmp_path):
    values = cloth()
    values[:, :, 2, 3] = 0.0
    found = imported(saved(tmp_path / "hole", values), tmp_path / "cat")
    assert error_of(found) < 0.8
    shown_alike(scenes, gl, found.fast)
    (row,) = found.fast.texels.form.decoded(np.array([2 * 8 + 3]))
    assert np.abs(row).max() < 0.02


def test_every_image_is_black(scenes, tmp_path):
    found = imported(saved(tmp_path / "soot", 0.0 * cloth()), tmp_path / "cat")
    assert error_of(found) == pytest.approx(0.0, abs=1e-6)
    assert np.abs(drawn(scenes, found.fast)).max() < 1e-6


def test_highlights_beyond_full_scale(scenes, tmp_path):
    values = cloth(shine=4.0)
    assert np.mean(values > 1.0) > 0.05
    found = imported(saved(tmp_path / "satin", values), tmp_path / "cat")
    assert error_of(found) < 2.0
    drawn(scenes, found.fast)


def test_a_view_is_missing(scenes, tmp_path):
    views = [one for one in NINE if one != (30, 90)]
    found = imported(saved(tmp_path / "wool", cloth(views), views), tmp_path / "cat")
    assert len(found.fast.texels.form.views) == 8 and error_of(found) < 0.8
    drawn(scenes, found.fast)


def test_a_ring_is_missing(scenes, tmp_path):
    views = [one for one in NINE if one[0] != 30]
    found = imported(saved(tmp_path / "wool", cloth(views), views), tmp_path / "cat")
    assert len(found.fast.texels.form.views) == 5 and error_of(found) < 0.8
    drawn(scenes, found.fast)


def test_an_image_is_missing(scenes, tmp_path):
    folder = saved(tmp_path / "wool", cloth())
    gone = sorted(folder.iterdir())[40]
    gone.unlink()
    # One of 81 is more than may be missing without a word.
    assert gone.name[6:-4] in str(refused(folder, tmp_path / "cat"))


@pytest.mark.parametrize("which", ["view", "light"])
def test_directions_below_the_horizon_are_refused(tmp_path, which):
    odd = [*NINE[:-1], (100, 270)]
    views, lights = (odd, NINE) if which == "view" else (NINE, odd)
    folder = saved(tmp_path / "wool", cloth(), views, lights)
    reason = str(refused(folder, tmp_path / "cat"))
    assert "100" in reason and "horizon" in reason


def test_a_single_light(scenes, tmp_path):
    found = imported(saved(tmp_path / "wool", cloth(lights=[(30, 0)]), lights=[(30, 0)]), tmp_path / "cat")
    assert error_of(found) < 0.8
    drawn(scenes, found.fast)


@pytest.mark.parametrize("size", [(1, 1), (3, 5)])
def test_few_texels(scenes, tmp_path, size):
    found = imported(saved(tmp_path / "wool", cloth(size=size)), tmp_path / "cat")
    assert found.fast.texels.form.number.shape == size and error_of(found) < 0.8
    drawn(scenes, found.fast)


@pytest.mark.slow
def test_names_with_other_running_numbers_are_the_same_material(tmp_path):
    values, numbers = cloth(), iter(np.random.default_rng(3).permutation(900))
    usual = saved(tmp_path / "wool", values)
    other = tmp_path / "other" / "wool"
    other.mkdir(parents=True)
    for path in sorted(usual.iterdir()):
        shutil.copy2(path, other / f"{next(numbers) + 7}{path.name[5:]}")
    one, two = imported(usual, tmp_path / "a"), imported(other, tmp_path / "b")
    assert error_of(one) == error_of(two)
    np.testing.assert_array_equal(one.fast.texels.form.weights, two.fast.texels.form.weights)


def test_images_of_several_sizes_are_refused_by_name(tmp_path):
    folder = saved(tmp_path / "wool", cloth())
    odd = sorted(folder.iterdir())[17]
    saved(tmp_path / "large", cloth(NINE[:1], NINE[:1], (9, 8)), NINE[:1], NINE[:1])
    (large,) = (tmp_path / "large").iterdir()
    shutil.copy2(large, odd)
    reason = str(refused(folder, tmp_path / "cat"))
    assert odd.name in reason and "9" in reason and "8" in reason


@pytest.mark.slow
def test_a_zip_in_a_zip_is_refused_and_the_inner_one_is_read(tmp_path):
    folder = saved(tmp_path / "wool", cloth())
    with zipfile.ZipFile(tmp_path / "inner.zip", "w") as archive:
        for path in sorted(folder.iterdir()):
            archive.write(path, f"wool/{path.name}")
    with zipfile.ZipFile(tmp_path / "outer.zip", "w") as archive:
        archive.write(tmp_path / "inner.zip", "inner.zip")
    assert "archive inside an archive" in str(refused(tmp_path / "outer.zip", tmp_path / "cat"))
    assert error_of(imported(tmp_path / "inner.zip", tmp_path / "other")) < 0.8


@pytest.mark.slow
def test_a_white_that_is_not_1_is_divided_by(scenes, tmp_path):
    values = cloth()
    plain = imported(saved(tmp_path / "wool", values), tmp_path / "a")
    dim = imported(saved(tmp_path / "dim" / "wool", 0.5 * values), tmp_path / "b", replace(SAID, white=(0.5,)))
    assert error_of(dim) < 0.8
    one, two = (drawn(scenes, found.fast) for found in (plain, dim))
    off = delta_e_xyz(one.astype(float), two.astype(float), draped(scenes).adopted_white())
    # As dark as they are, images of 8 bits are coarser.
    assert off.mean() < 0.5


def test_more_clusters_than_there_are_kinds_of_texels_die(scenes, tmp_path):
    """Two kinds of texels for the dozens of clusters of every size."""
    two = cloth(size=(1, 2))
    board = np.tile(two, (1, 1, 8, 4, 1))
    found = imported(saved(tmp_path / "board", board), tmp_path / "cat")
    number = found.fast.texels.form.number
    assert len(found.fast.texels.table) <= 2 and error_of(found) < 0.3
    # Texels that are the same are the same afterwards.
    assert (number == number[:1, :2].repeat(8, axis=0).reshape(8, 1, 2).repeat(4, axis=1).reshape(8, 8)).all()
    weights = found.fast.texels.form.weights
    assert (weights[:, ::2] == weights[:1, :1]).all() and (weights[:, 1::2] == weights[:1, 1:2]).all()
    drawn(scenes, found.fast)


@pytest.mark.slow
def test_a_name_without_directions_is_passed_over_or_refused(tmp_path):
    folder = saved(tmp_path / "wool", cloth(), name=UBO)
    shutil.copy2(next(folder.iterdir()), folder / "thumbnail.png")
    assert error_of(imported(folder, tmp_path / "cat")) < 0.8


def test_a_list_shows_the_colour_of_all_texels(tmp_path):
    """As an instrument reads it whose aperture is wider than the texture: of means at 45 degrees, from eight sides."""
    views, lights = [(0, 0), *((45, phi) for phi in range(0, 360, 45))], [(45, phi) for phi in range(0, 360, 45)]
    values = cloth(views, lights)
    record = imported(saved(tmp_path / "wool", values, views, lights), tmp_path / "catalogue")
    summary = Catalogue.open(tmp_path / "catalogue").summary(record.id)
    linear = values[0].mean(axis=(0, 1, 2)) / np.sqrt(0.5)
    np.testing.assert_allclose(summary.xyz, xyz_from_rgb() @ linear, atol=2e-3)
    assert summary.lab is not None
