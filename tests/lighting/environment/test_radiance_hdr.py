"""Radiance pictures, in runs, in old runs and in none, whichever way up: read, or refused where they are cut."""

import numpy as np
import pytest
from metamer.lighting.environment.map_file import read_map
from metamer.lighting.environment.radiance_hdr import read_header, read_pixels
from metamer.runtime.errors import InputError
from metamer.spectral.upsampling import xyz_from_rgb

GENERATOR = np.random.default_rng(11)
CODES = GENERATOR.integers(1, 255, (8, 16, 4), dtype=np.uint8)
# Runs to be found, a black texel, and exponents about 1.
CODES[..., 3] = GENERATOR.integers(120, 136, (8, 16))
CODES[2, 3:11] = CODES[2, 3]
CODES[5] = CODES[5, 0]
CODES[6, 6] = 0
HEADER = b"#?RADIANCE\n# by hand\nEXPOSURE=2.0\nFORMAT=32-bit_rle_rgbe\n\n"


def decoded(codes):
    """Return what the format's own library makes of four bytes, one after the other."""
    found = np.zeros((*codes.shape[:-1], 3))
    for place in np.ndindex(codes.shape[:-1]):
        *mantissas, exponent = (int(code) for code in codes[place])
        if exponent:
            found[place] = [(mantissa + 0.5) * 2.0 ** (exponent - 136) for mantissa in mantissas]
    return found


def runs(line):
    """One line in the newer runs, channel after channel."""
    out = bytes([2, 2, len(line) >> 8, len(line) & 255])
    for channel in line.T:
        at = 0
        while at < len(channel):
            same = 1
            while at + same < len(channel) and same < 127 and channel[at + same] == channel[at]:
                same += 1
            if same > 2:
                out += bytes([128 + same, channel[at]])
                at += same
            else:
                out += bytes([1, channel[at]])
                at += 1
    return out


def old_runs(line):
    """One line with repeats written as 1, 1, 1, n; more than 255 as two of them."""
    out, at = b"", 0
    while at < len(line):
        same = 1
        while at + same < len(line) and (line[at + same] == line[at]).all():
            same += 1
        out += bytes(line[at])
        repeats = same - 1
        while repeats:
            out += bytes([1, 1, 1, repeats & 255])
            repeats >>= 8
        at += same
    return out


FORMS = {"plain": bytes, "runs": runs, "old runs": old_runs}


def write(path, codes=CODES, form="runs", header=HEADER, size=None):
    size = size or f"-Y {codes.shape[0]} +X {codes.shape[1]}\n".encode()
    path.write_bytes(header + size + b"".join(FORMS[form](np.ascontiguousarray(line)) for line in codes))
    return path


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_lines(tmp_path, form):
    found = read_map(write(tmp_path / "sky.hdr", form=form))
    assert found.kind == "RGB" and found.size == (8, 16) and "BT.709" in found.notes[0]
    np.testing.assert_allclose(np.stack(found.channels, axis=-1), decoded(CODES), rtol=1e-6)


def test_a_line_that_repeats_more_than_255_times(tmp_path):
    codes = np.tile(CODES[:1, :1], (320, 640, 1))
    found = read_map(write(tmp_path / "even.hdr", codes, "old runs"))
    np.testing.assert_allclose(found.channels[0], decoded(CODES[:1, :1])[0, 0, 0], rtol=1e-6)


@pytest.mark.parametrize("signs", ["-+", "++", "--", "+-"])
@pytest.mark.parametrize("first", "YX")
def test_every_order_of_pixels_shows_the_same_picture(tmp_path, signs, first):
    """The signs are of Y and of X: -Y runs downwards, +X to the right."""
    stored = CODES[:: 1 if signs[0] == "-" else -1, :: 1 if signs[1] == "+" else -1]
    words = [f"{signs[0]}Y 8", f"{signs[1]}X 16"]
    if first == "X":
        stored, words = stored.transpose(1, 0, 2), words[::-1]
    path = write(tmp_path / "sky.hdr", stored, "plain", size=f"{words[0]} {words[1]}\n".encode())
    np.testing.assert_allclose(np.stack(read_map(path).channels, axis=-1), decoded(CODES), rtol=1e-6)


def test_primaries_xyz_and_a_correction_of_colours(tmp_path):
    bt709 = b"PRIMARIES= 0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\n"
    found = read_map(write(tmp_path / "p.hdr", header=HEADER.replace(b"EXPOSURE=2.0\n", bt709)))
    np.testing.assert_allclose(found.xyz_from_channels, xyz_from_rgb(), atol=3e-4)
    assert found.notes == ()
    xyz = read_map(write(tmp_path / "x.hdr", header=HEADER.replace(b"rgbe", b"xyze")))
    assert xyz.kind == "XYZ"
    path = write(tmp_path / "c.hdr", header=HEADER.replace(b"EXPOSURE=2.0\n", b"COLORCORR= 2 1 1\nCOLORCORR= 2 1 4\n"))
    np.testing.assert_allclose(read_pixels(path, read_header(path)) * (4, 1, 4), decoded(CODES), rtol=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_a_cut_picture(tmp_path, form):
    whole = write(tmp_path / "sky.hdr", form=form).read_bytes()
    path = tmp_path / "cut.hdr"
    for share in (0.05, 0.2, 0.5, 0.9, 0.999):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(InputError, match="expected"):
            read_map(path)


def test_damage_anywhere_is_refused_or_read_and_never_more(tmp_path):
    whole = write(tmp_path / "sky.hdr").read_bytes()
    generator = np.random.default_rng(5)
    for at in generator.integers(len(whole), size=300):
        hurt = bytearray(whole)
        hurt[at] ^= 1 << int(generator.integers(8))
        (tmp_path / "hurt.hdr").write_bytes(hurt)
        try:
            read_map(tmp_path / "hurt.hdr")
        except InputError as error:
            assert error.expected or error.hint


@pytest.mark.parametrize(
    ("header", "size", "word"),
    [
        (HEADER.replace(b"32-bit_rle_rgbe", b"png"), b"-Y 8 +X 16\n", "unknown pixels"),
        (HEADER, b"-Y 8 +Y 16\n", "no picture of two sides"),
        (HEADER, b"-Y 0 +X 0\n", "without pixels"),
        (HEADER, b"-Y 8 +X 17\n", "not a latitude-longitude map"),
        (HEADER, b"-Y 500000 +X 1000000\n", "cut short"),
        (b"#?RADIANCE\n", b"no size\n", "a header without an end"),
        (b"#?RADIANCE\nPRIMARIES=1 2\n", b"-Y 8 +X 16\n", "8 numbers"),
        (b"#?RADIANCE\nCOLORCORR=1 0 2\n", b"-Y 8 +X 16\n", "3 numbers"),
    ],
)
def test_a_header_that_fits_nothing(tmp_path, header, size, word, monkeypatch):
    monkeypatch.setattr("metamer.runtime.memory.available_bytes", lambda: None)
    with pytest.raises(InputError, match=word):
        read_map(write(tmp_path / "sky.hdr", header=header, size=size))
