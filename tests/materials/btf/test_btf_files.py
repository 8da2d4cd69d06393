"""Images in files: decoded one by one, kept within a limit, held to their digests, and filled from their neighbours."""

import io
from collections import OrderedDict
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from btf_sets import NINE, written
from metamer.materials.btf.decoding import Coding, uplifted_basis
from metamer.materials.btf.files import BtfFiles, HeldCodes
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.surface import MeasuredBtf
from metamer.materials.core.points import Points
from metamer.materials.formats.btf_names import directions_of
from metamer.materials.records.hdf5_tree import mapping_from, mapping_node, read_tree, write_tree
from metamer.materials.records.stored_array import StoredArray
from metamer.materials.records.stored_files import StoredFiles
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.srgb import srgb_to_linear
from metamer.spectral.upsampling import xyz_from_rgb
from PIL import Image

SRGB = Coding("srgb", np.ones(1))


def files(folder, coding=SRGB, size=(4, 4), basis=None, index=None, data=None, views=NINE, lights=NINE):
    names = tuple(sorted(path.name for path in folder.iterdir()))
    data = data or StoredFiles.of(folder, names)
    index = np.arange(len(names)).reshape(len(views), len(lights), -1) if index is None else index
    starts = np.concatenate([[0], np.cumsum(data.sizes)]) if isinstance(data, StoredFiles) else None
    hemispheres = Hemisphere(directions_of(views)), Hemisphere(directions_of(lights))
    return BtfFiles(*hemispheres, *size, basis or uplifted_basis(), data, starts, index, coding)


def test_an_image_is_what_its_codes_are_as_fractions_of_white(tmp_path):
    codes = written(tmp_path)
    images = files(tmp_path)
    expected = srgb_to_linear(codes[3, 5] / 255.0) / np.pi
    np.testing.assert_allclose(images.image(3, 5), expected, rtol=1e-6)
    linear = files(tmp_path, Coding("linear", np.array([0.5, 0.25, 2.0])))
    np.testing.assert_allclose(linear.image(3, 5), codes[3, 5] / 255.0 / np.pi / [0.5, 0.25, 2.0], rtol=1e-6)


def test_a_cosine_that_is_not_in_the_numbers_is_put_in(tmp_path):
    codes = written(tmp_path)
    images = files(tmp_path, Coding("linear", np.ones(1), includes_cosine=False))
    light = next(at for at, (theta, _) in enumerate(NINE) if theta == 60)
    np.testing.assert_allclose(images.image(0, light), codes[0, light] / 255.0 * 0.5 / np.pi, rtol=1e-6)


@pytest.mark.parametrize(("channels", "grey"), [(3, False), (1, False), (1, True)])
def test_equal_numbers_of_many_texels_are_decoded_once(monkeypatch, channels, grey):
    coding, decoded = Coding("srgb", np.ones(1) if grey else np.array([0.5, 0.25, 2.0])), []
    codes = np.random.default_rng(3).integers(0, 256, (500, 4, channels)).astype(np.uint8)
    expected = coding.reflected(coding.decoded(codes, grey), 1.0).astype(np.float32)
    of_codes = Coding.decoded
    monkeypatch.setattr(
        Coding, "decoded", lambda self, some, grey: decoded.append(some.size) or of_codes(self, some, grey)
    )
    np.testing.assert_array_equal(coding.reflectance(codes, 1.0, grey), expected)
    assert decoded == [256 * channels]
    few = codes[:5]
    np.testing.assert_array_equal(coding.reflectance(few, 1.0, grey), expected[:5])
    assert decoded[1:] == [few.size]


@pytest.mark.parametrize("coding", [SRGB, Coding("linear", np.array([0.5, 0.25, 2.0]), includes_cosine=False)])
def test_texels_of_several_images_are_those_of_each(tmp_path, coding):
    written(tmp_path)
    whole = files(tmp_path, coding)
    whole.index[4, 3] = -1
    some = replace(whole, _kept=OrderedDict())
    some.image(4, 5)
    images = np.repeat([2, 4 * 9 + 3, 4 * 9 + 5, 7 * 9], [1, 2, 3, 1])
    places = np.random.default_rng(2).integers(0, 16, (len(images), 4))
    expected = [whole.image(*divmod(int(one), 9)).reshape(-1, 3)[places[at]] for at, one in enumerate(images)]
    for _ in range(3):  # from files, from files once more and held, and held
        np.testing.assert_array_equal(some.texels(images, places), expected)
    assert (some.held.slot[[2, 4 * 9 + 5, 7 * 9]] >= 0).tolist() == [True, False, True]


def test_images_are_read_as_their_files_lie(tmp_path, monkeypatch):
    """So a block of several is unpacked once, however views and lights follow each other in it."""
    written(tmp_path)
    images = files(tmp_path, index=np.arange(81).reshape(9, 9, 1).swapaxes(0, 1)[:, ::-1])
    read, codes = [], BtfFiles._codes
    monkeypatch.setattr(
        BtfFiles, "_codes", lambda self, *pair: read.append(self.index[(*pair, 0)]) or codes(self, *pair)
    )
    rng = np.random.default_rng(5)
    wi, wo = (directions_of(rng.uniform((0, 0), (89, 360), (900, 2))) for _ in range(2))
    MeasuredBtf(images, np.zeros((9, 9, 3))).at(Points(wi, wo, rng.random((900, 2))))
    assert read == list(range(81))


@pytest.mark.parametrize(("kind", "times"), [("JPEG", 1), ("PNG", 2)])
def test_a_photograph_is_opened_once(monkeypatch, kind, times):
    data, opened, open_ = io.BytesIO(), [], Image.open
    Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(data, kind)
    monkeypatch.setattr(Image, "open", lambda *given, **named: opened.append(kind) or open_(*given, **named))
    found = SRGB.codes(data.getvalue(), Path("a"))
    assert len(opened) == times
    np.testing.assert_array_equal(found, np.asarray(open_(data)))


def test_images_are_held_from_when_one_is_asked_for_again():
    held, codes = HeldCodes(9, 100), np.arange(40, dtype=np.uint8).reshape(4, 5, 2)

    def after(*images):
        for image in images:
            held.offer(image, [codes + image])
        return np.flatnonzero(held.slot >= 0).tolist()

    assert after(0, 1, 2) == []
    assert after(1) == [1]
    held.offer(4, [codes.astype(np.float32)])
    assert after(3, 2) == [1, 3]
    (found,) = held.texels(np.array([3, 1]), np.array([[7], [19]]))
    np.testing.assert_array_equal(found, [[[17, 18]], [[39, 40]]])


def test_images_that_are_kept_stay_below_the_limit_and_are_read_once(tmp_path):
    written(tmp_path)
    heard = []
    data = replace(
        StoredFiles.of(tmp_path, tuple(sorted(path.name for path in tmp_path.iterdir()))), heard=heard.append
    )
    size = 4 * 4 * 3 * 4
    images = replace(files(tmp_path, data=data), kept_bytes=3 * size)
    for light in (0, 1, 2, 0, 1, 2):
        images.image(4, light)
    assert len(heard) == 3
    images.image(4, 3)
    images.image(4, 0)
    assert len(heard) == 5
    assert sum(image.nbytes for image in images._kept.values()) <= 3 * size
    none = replace(images, kept_bytes=0, _kept=type(images._kept)())
    none.image(0, 0)
    assert not none._kept


def test_a_file_that_changes_is_refused_by_name(tmp_path):
    written(tmp_path)
    sealed = StoredFiles.of(tmp_path, tuple(sorted(path.name for path in tmp_path.iterdir()))).sealed()
    images = files(tmp_path, data=sealed)
    changed = tmp_path / sealed.names[40]
    content = bytearray(changed.read_bytes())
    content[-20] ^= 1
    changed.write_bytes(content)
    images.image(4, 3)
    with pytest.raises(InputError, match="not what it was") as caught:
        images.image(4, 4)
    assert caught.value.file == changed
    changed.write_bytes(content[:-5])
    with pytest.raises(InputError, match="not what it was") as caught:
        images.image(4, 4)
    assert caught.value.file == changed
    changed.unlink()
    with pytest.raises(InputError, match="no such file") as caught:
        images.image(4, 4)
    assert caught.value.file == changed and not sealed.is_there
    with pytest.raises(InputError, match="no such file"):
        sealed.check_is_there()


def test_files_are_one_array_of_bytes_in_any_blocks(tmp_path):
    rng = np.random.default_rng(0)
    contents = [rng.bytes(size) for size in (5, 3 << 20, 1, 6 << 20, 70)]
    for number, content in enumerate(contents):
        (tmp_path / f"{number}").write_bytes(content)
    stored = StoredFiles.of(tmp_path, tuple("01234")).sealed()
    whole = b"".join(contents)
    assert np.asarray(stored).tobytes() == whole
    assert stored.read(slice(4, 9)).tobytes() == whole[4:9]
    joined = stored.joined()
    assert [(where[0].start, where[0].stop) for where, _ in joined.chunks()] == [
        (0, 4 << 20),
        (4 << 20, 8 << 20),
        (8 << 20, len(whole)),
    ]
    assert np.asarray(joined).tobytes() == whole and isinstance(joined, StoredArray)


def test_a_copy_is_heard_of_once_and_is_the_same_bytes(tmp_path):
    written(tmp_path / "wool")
    heard = []
    names = tuple(sorted(path.name for path in (tmp_path / "wool").iterdir()))
    stored = StoredFiles.of(tmp_path / "wool", names).sealed()
    copied = mapping_node({"images": replace(stored, heard=heard.append)}, copy=True)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        write_tree(file, copied)
    assert sum(heard) == stored.nbytes
    with h5py.File(tmp_path / "a.h5") as file:
        back = mapping_from(read_tree(file, tmp_path / "a.h5"))["images"]
    assert type(back) is StoredArray and np.asarray(back).tobytes() == np.asarray(stored).tobytes()


@pytest.mark.parametrize("gone", [(2, 4), (0, 0), (8, 8)])
def test_a_missing_image_is_made_of_the_lights_around_it(tmp_path, gone):
    """Where all is smooth in light, what is filled is near what was there."""
    from PIL import Image

    for view in range(9):
        for light, (theta, phi) in enumerate(NINE):
            level = 200 * np.cos(np.radians(theta)) * (1 + 0.02 * np.cos(np.radians(phi)))
            Image.fromarray(np.full((4, 4, 3), round(level), np.uint8)).save(tmp_path / f"{view}{light}.png")
    images = files(tmp_path, Coding("linear", np.ones(1)))
    index = images.index.copy()
    index[gone] = -1
    filled = replace(images, index=index)
    assert filled.missing.tolist() == [list(gone)]
    ratio = filled.image(*gone).mean() / images.image(*gone).mean()
    # Around the normal, the lights are 30 degrees away, where the cosine is 0.87.
    assert ratio == pytest.approx(1.0, abs=0.15)
    assert np.array_equal(filled.image(1, 1), images.image(1, 1))


def test_under_a_single_light_a_missing_image_is_made_of_the_views_around_it(tmp_path):
    written(tmp_path, lights=[(0, 0)])
    images = files(tmp_path, lights=[(0, 0)])
    index = images.index.copy()
    index[0] = -1
    filled = replace(images, index=index)
    around = np.stack([images.image(view, 0) for view in range(1, 9)])
    assert (filled.image(0, 0) <= around.max(axis=0) + 1e-6).all()
    assert (filled.image(0, 0) >= around.min(axis=0) - 1e-6).all()


def picture_bytes(values, form="PNG"):
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(values).save(file, form)
    return file.getvalue()


def test_images_of_one_wavelength_each_are_grey(tmp_path):
    rng = np.random.default_rng(3)
    codes = rng.integers(0, 65536, (2, 2, 4, 3, 3)).astype(np.uint16)
    for view in range(2):
        for light in range(2):
            for band in range(3):
                name = tmp_path / f"{view}{light}{band}.png"
                name.write_bytes(picture_bytes(codes[view, light, ..., band]))
    two = [(0, 0), (40, 90)]
    basis = SpectralBasis.sampled(np.array([450.0, 550.0, 650.0]))
    images = files(tmp_path, Coding("linear", np.array([1.0, 0.5, 2.0])), (4, 3), basis, views=two, lights=two)
    np.testing.assert_allclose(images.image(1, 0), codes[1, 0] / 65535.0 / np.pi / [1.0, 0.5, 2.0], rtol=1e-6)
    (tmp_path / "101.png").write_bytes(picture_bytes(rng.integers(0, 255, (4, 3, 3)).astype(np.uint8)))
    with pytest.raises(InputError, match="in colour"):
        files(tmp_path, Coding("linear", np.ones(1)), (4, 3), basis, views=two, lights=two).image(1, 0)


def test_openexr_is_read_by_its_channels(tmp_path):
    rng = np.random.default_rng(4)
    planes = {name: rng.random((4, 3)).astype(np.float32) for name in "XYZ"}
    write_exr(tmp_path / "a.exr", {}, planes)
    one = [(0, 0)]
    coding = Coding("xyz", np.ones(1), channels=("X", "Y", "Z"))
    found = files(tmp_path, coding, (4, 3), views=one, lights=one).image(0, 0)
    back = np.pi * found.astype(np.float64) @ xyz_from_rgb().T
    np.testing.assert_allclose(back, np.stack([planes[name] for name in "XYZ"], axis=-1), rtol=1e-5, atol=1e-6)
    with pytest.raises(InputError, match="channels unlike"):
        files(tmp_path, replace(coding, channels=("R", "G", "B")), (4, 3), views=one, lights=one).image(0, 0)
    with pytest.raises(InputError, match="floats are linear"):
        files(tmp_path, replace(coding, encoding="srgb"), (4, 3), views=one, lights=one).image(0, 0)


@pytest.mark.parametrize("left", [5, 200, -30])
def test_damaged_openexr_is_refused_by_its_own_name_alone(tmp_path, left):
    write_exr(tmp_path / "a.exr", {}, {"green": np.ones((8, 8))})
    data = (tmp_path / "a.exr").read_bytes()[:left]
    with pytest.raises(InputError) as refused:
        Coding("linear", (1.0,), channels=("green",)).codes(data, tmp_path / "theirs.exr")
    assert refused.value.file == tmp_path / "theirs.exr" and "/" not in str(refused.value.found)


def test_three_coefficients_are_a_colour_and_its_spectrum():
    basis = uplifted_basis()
    rgb = np.random.default_rng(0).random((50, 3))
    np.testing.assert_allclose(basis.project(basis.reconstruct(rgb)), rgb, atol=1e-12)
    assert basis.reconstruct(np.ones(3)) == pytest.approx(np.ones(81), abs=1e-5)


def test_a_surface_comes_back_from_its_parameters(tmp_path):
    written(tmp_path)
    images = replace(files(tmp_path, Coding("srgb", np.array([0.5, 0.6, 0.7]), False)), texel_mm=0.2, offset=-1.5)
    before = MeasuredBtf(images, np.random.default_rng(0).random((9, 9, 3)))
    after = MeasuredBtf.from_parameters(before.parameters())
    assert np.array_equal(after.images.image(2, 3), images.image(2, 3))
    assert (after.images.texel_mm, after.images.offset) == (0.2, -1.5)
    np.testing.assert_allclose(after.means, before.means, rtol=1e-6)
    assert np.array_equal(after.wavelengths_nm, before.wavelengths_nm)


def test_what_is_no_coding_is_refused():
    with pytest.raises(InputError, match="not a white"):
        Coding("srgb", np.array([1.0, 0.0, 1.0]))
    with pytest.raises(InputError, match="encoding"):
        Coding("gamma", np.ones(1))
