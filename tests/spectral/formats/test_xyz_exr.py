"""XYZ pictures in OpenEXR."""

import os

import numpy as np
import OpenEXR
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.colour_library import colour_science
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.xyz_exr import LINEAR_SPACES, write_rgb_exr, write_xyz_exr
from metamer.spectral.image import ColourImage
from pictures import read_xyz_exr

WHITE = np.array([0.95047, 1.0, 1.08883])


def picture(rng):
    values = rng.normal(0.3, 1.0, (4, 7, 3)).astype(np.float32)
    values[0, 0], values[1, 1], values[2, 2] = 1e-20, 6e4, -0.5
    return ColourImage(values, "xyz", WHITE)


def test_a_full_disk_leaves_the_picture_that_was_there(tmp_path, room_for):
    path = tmp_path / "x.exr"
    path.write_bytes(b"old")
    noise = np.random.default_rng(0).normal(size=(64, 64)).astype(np.float32)
    with (
        room_for(2000),
        pytest.raises(InputError, match=r"(?s)x\.exr: the OpenEXR picture cannot be written.*make room"),
    ):
        write_exr(path, {}, {"Y": noise})
    assert path.read_bytes() == b"old" and [entry.name for entry in tmp_path.iterdir()] == ["x.exr"]


def test_round_trip_is_exact_in_float32(tmp_path, rng):
    written, coverage = picture(rng), rng.uniform(0, 1, (4, 7)).astype(np.float32)
    write_xyz_exr(tmp_path / "x.exr", written, coverage)
    found, alpha = read_xyz_exr(tmp_path / "x.exr")
    np.testing.assert_array_equal(found.values, written.values)
    np.testing.assert_array_equal(alpha, coverage)
    np.testing.assert_allclose(found.white_xyz, WHITE, rtol=1e-7)
    assert found.space == "xyz"


def test_without_coverage(tmp_path, rng):
    write_xyz_exr(tmp_path / "x.exr", picture(rng))
    assert read_xyz_exr(tmp_path / "x.exr")[1] is None


def test_nan_is_kept(tmp_path, rng):
    written = picture(rng)
    written.values[3, 3, 1] = np.nan
    write_xyz_exr(tmp_path / "x.exr", written)
    assert np.argwhere(np.isnan(read_xyz_exr(tmp_path / "x.exr")[0].values)).tolist() == [[3, 3, 1]]


def test_adapted_space_comes_back(tmp_path, rng):
    write_xyz_exr(tmp_path / "x.exr", ColourImage(picture(rng).values, "xyz_d65", WHITE))
    assert read_xyz_exr(tmp_path / "x.exr")[0].space == "xyz_d65"


def test_notes_and_the_axes_of_xyz_are_in_the_header(tmp_path, rng):
    write_xyz_exr(tmp_path / "x.exr", picture(rng), notes={"illuminant": "FL11"})
    with OpenEXR.File(str(tmp_path / "x.exr"), separate_channels=True) as file:
        header = dict(file.header())  # the file empties its own on closing
    assert header["illuminant"] == "FL11"
    np.testing.assert_allclose(header["chromaticities"], (1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3), rtol=1e-6)


def header_of(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return dict(file.header()), {name: channel.pixels for name, channel in file.channels().items()}


def test_the_header_says_what_x_y_z_are(tmp_path, rng):
    write_xyz_exr(tmp_path / "x.exr", picture(rng), illuminance_lux=1000.0)
    said, _ = header_of(tmp_path / "x.exr")
    assert "not adapted" in said["comments"] and "perfect diffuser" in said["comments"]
    np.testing.assert_allclose(said["adoptedNeutral"], WHITE[:2] / WHITE.sum(), rtol=1e-6)
    assert said["whiteLuminance"] == pytest.approx(1000.0 / np.pi)
    write_xyz_exr(tmp_path / "y.exr", ColourImage(picture(rng).values, "xyz_d65", WHITE))
    said, _ = header_of(tmp_path / "y.exr")
    assert "adapted to D65" in said["comments"] and "whiteLuminance" not in said


@pytest.mark.parametrize(
    ("space", "theirs", "identity"),
    [
        ("acescg", "ACEScg", "lin_ap1_scene"),
        ("rec709", "ITU-R BT.709", "lin_rec709_scene"),
        ("rec2020", "ITU-R BT.2020", "lin_rec2020_scene"),
    ],
)
def test_linear_spaces_are_those_of_colour_science(tmp_path, rng, space, theirs, identity):
    """Primaries, white, the matrix, and Bradford between the whites, by another library."""
    colour = colour_science()
    white = np.array([1.09850, 1.0, 0.35585])
    image, expected = ColourImage(picture(rng).values, "xyz", white), colour.RGB_COLOURSPACES[theirs]
    coverage = rng.uniform(0, 1, (4, 7)).astype(np.float32)
    said = write_rgb_exr(tmp_path / "x.exr", image, space, coverage, {"observer": "whose"}, 500.0)
    header, channels = header_of(tmp_path / "x.exr")
    to = np.array([expected.whitepoint[0], expected.whitepoint[1]])
    np.testing.assert_allclose(
        np.reshape(header["chromaticities"], (4, 2)), [*expected.primaries, to], atol=1e-6, rtol=0.0
    )
    assert header["colorInteropID"] == identity and header["observer"] == "whose"
    assert header["whiteLuminance"] == pytest.approx(500.0 / np.pi)
    np.testing.assert_allclose(header["adoptedNeutral"], to, atol=1e-6)
    to_white = np.array([to[0] / to[1], 1.0, (1 - to.sum()) / to[1]])
    adapted = colour.adaptation.chromatic_adaptation_VonKries(
        image.values.astype(np.float64), white, to_white, transform="Bradford"
    )
    matrix = np.linalg.inv(colour.normalised_primary_matrix(expected.primaries, to))
    rgb = adapted @ matrix.T
    for at, name in enumerate("RGB"):
        np.testing.assert_allclose(channels[name], rgb[..., at], rtol=2e-4, atol=1e-4)
    np.testing.assert_array_equal(channels["A"], coverage)
    beyond = int((rgb < -1e-6).any(axis=-1).sum())
    assert beyond and "Bradford" in said[0] and said[1].startswith(f"{beyond} pixels")


@pytest.mark.parametrize("space", LINEAR_SPACES)
def test_white_becomes_one_of_each(tmp_path, space):
    """The white of the lights, whatever it is; a picture within the gamut has nothing more said of it."""
    white = np.array([1.2, 1.0, 0.3])
    image = ColourImage(np.tile(white, (2, 2, 1)).astype(np.float32), "xyz", white)
    said = write_rgb_exr(tmp_path / "x.exr", image, space)
    _, channels = header_of(tmp_path / "x.exr")
    assert len(said) == 1
    for name in "RGB":
        np.testing.assert_allclose(channels[name], 1.0, atol=1e-6)


def test_row_zero_is_the_top(tmp_path):
    values = np.zeros((2, 1, 3), np.float32)
    values[0] = 1
    write_xyz_exr(tmp_path / "x.exr", ColourImage(values, "xyz", WHITE))
    with OpenEXR.File(str(tmp_path / "x.exr"), separate_channels=True) as file:
        assert file.channels()["Y"].pixels[:, 0].tolist() == [1.0, 0.0]


def test_rgb_picture_is_refused(tmp_path):
    write_exr(tmp_path / "x.exr", {}, {name: np.zeros((1, 1)) for name in "RGB"})
    with pytest.raises(InputError, match="not an XYZ picture"):
        read_xyz_exr(tmp_path / "x.exr")


def test_picture_without_its_white_is_refused(tmp_path):
    write_exr(tmp_path / "x.exr", {}, {name: np.zeros((1, 1)) for name in "XYZ"})
    with pytest.raises(InputError, match="does not say which white"):
        read_xyz_exr(tmp_path / "x.exr")


def test_four_channels_are_no_colour_image():
    with pytest.raises(InputError, match="not an image of three channels"):
        ColourImage.__post_init__(_unchecked(np.zeros((2, 2, 4))))


def _unchecked(values):
    found = object.__new__(ColourImage)
    for field, value in (("values", values), ("space", "xyz"), ("white_xyz", WHITE)):
        object.__setattr__(found, field, value)
    return found


# Writing.


def test_missing_folder(tmp_path, rng):
    with pytest.raises(InputError, match="no such folder to write to") as caught:
        write_xyz_exr(tmp_path / "nowhere" / "x.exr", picture(rng))
    assert "make the folder first" in str(caught.value)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_unwritable_folder(tmp_path, rng):
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(InputError, match="the folder cannot be written to"):
            write_xyz_exr(tmp_path / "x.exr", picture(rng))
    finally:
        tmp_path.chmod(0o700)


def test_folder_that_refuses_says_why(tmp_path, rng, monkeypatch):
    """As a read-only disk does, for whoever runs the tests."""

    def refuse(path, **_):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr("pathlib.Path.touch", refuse)
    with pytest.raises(InputError, match="the folder cannot be written to") as caught:
        write_xyz_exr(tmp_path / "x.exr", picture(rng))
    assert "found: Read-only file system" in str(caught.value)


def test_a_picture_cut_short_is_refused_without_the_librarys_own_chatter(tmp_path, capfd):
    path = tmp_path / "x.exr"
    write_exr(path, {}, {"Y": np.random.default_rng(0).normal(size=(64, 64)).astype(np.float32)})
    path.write_bytes(path.read_bytes()[:-500])
    with pytest.raises(InputError, match="cannot be read"):
        read_xyz_exr(path)
    assert capfd.readouterr() == ("", "")
    os.write(2, b"heard again")
    assert capfd.readouterr().err == "heard again"
