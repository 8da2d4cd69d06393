"""Measured files as sources: known by content, and refused in words however they are damaged.

Every refusal says which file, what in it, what was found, what was expected and what to do next.
"""

import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from metamer.materials.formats import bispectral, cornell, merl, rgl
from metamer.materials.formats.naming import id_word
from metamer.materials.records.models import rebuild
from metamer.materials.records.source import MaterialSource
from metamer.runtime.errors import InputError
from metamer.spectral.formats.exr import write_exr

MERL_BODY = 3 * 90 * 90 * 180 * 8
MERL_HEADER = np.array(merl.SHAPE, "<i4").tobytes()
TYPES = {"uint8": 1, "float32": 10}


def tensor_file():
    """A small isotropic RGL file in RGB, as the container's description has it."""
    random = np.random.default_rng(4)

    def values(*shape):
        return (0.2 + random.random(shape)).astype(np.float32)

    fields = {
        "description": np.frombuffer(b"for tests", np.uint8),
        "phi_i": np.zeros(1, np.float32),
        "theta_i": np.radians([0, 40, 80]).astype(np.float32),
        "ndf": values(1, 5).repeat(4, axis=0),
        "sigma": values(1, 5).repeat(4, axis=0),
        "vndf": values(1, 3, 4, 5),
        "luminance": values(1, 3, 4, 4),
        "rgb": values(1, 3, 3, 4, 4),
        "jacobian": np.ones(1, np.uint8),
    }
    head, offset = rgl.MAGIC + bytes([1, 0]) + struct.pack("<I", len(fields)), 512
    for name, field in fields.items():
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ", field.ndim, TYPES[field.dtype.name], offset)
        head += struct.pack(f"<{field.ndim}Q", *field.shape)
        offset += field.nbytes
    return head.ljust(512, b"\0") + b"".join(field.tobytes() for field in fields.values())


def cornell_text():
    rows = [
        f"{np.radians(theta):.5f} 0.0 {np.radians(other):.5f} {phi:.4f} 0.1 0.2 0.3"
        for theta in (10, 40, 70)
        for other in (5, 35, 65)
        for phi in (0.0, 1.6, 3.1)
    ]
    return ("# laboratory\n# sample\n3\n400 500 600\n" + "\n".join(rows) + "\n").encode()


def bispectral_picture(path):
    nm = (400.0, 500.0, 600.0)
    channels = {f"T.{value:.0f},0nm": np.full((2, 2), 0.4, np.float32) for value in nm}
    channels |= {"T.400,0nm.500,0nm": np.full((2, 2), 0.1, np.float32)}
    write_exr(path, {}, channels)
    return path.read_bytes()


def read(reader, path):
    return list(reader.read_sources(path, "mallett-yuksel"))


def assert_says_everything(said, path):
    assert said.file == path
    assert said.field and said.found is not None and said.expected and said.hint, str(said)


@pytest.fixture
def whole(tmp_path):
    """(reader, name, content) of a small whole file a format."""
    return {
        "rgl": (rgl, "a.bsdf", tensor_file()),
        "cornell": (cornell, "a.brdf", cornell_text()),
        "bispectral": (bispectral, "a.exr", bispectral_picture(tmp_path / "made.exr")),
    }


@pytest.mark.parametrize("kind", ["rgl", "cornell", "bispectral"])
def test_known_by_content_under_any_name(tmp_path, whole, kind):
    reader, _, content = whole[kind]
    path = tmp_path / "no.suffix"
    path.write_bytes(content)
    others = [other for other, _, _ in whole.values() if other is not reader]
    assert reader.recognises(path, content[:4096])
    assert not any(other.recognises(path, content[:4096]) for other in [*others, merl])
    found = read(reader, path)
    assert found and all(isinstance(each, MaterialSource) and rebuild(each.model, each.parameters) for each in found)
    assert all(each.original["file"] == "no.suffix" for each in found)


def test_merl_is_known_by_its_header(tmp_path):
    assert merl.recognises(tmp_path / "any", MERL_HEADER + b"\0" * 8)
    assert merl.recognises(tmp_path / "a.BINARY", b"")
    assert not merl.recognises(tmp_path / "any", b"\0" * 40)


@pytest.mark.parametrize(
    ("head", "known"),
    [
        (b"3\n400 500 600\n0 0 0 0 1 1 1\n", True),
        (b"\xef\xbb\xbf# a comment\n\n  3 # wavelengths\n400\n500\n600\n", True),
        (b"31\n" + b" ".join(b"%d" % nm for nm in range(400, 710, 10)), True),
        (b"81\n" + b"\n".join(b"%.200f" % nm for nm in range(380, 785, 5)), True),
        (b"400 0.5\n500 0.6\n", False),
        (b"3\n600 400 500\n", False),
        (b"3\n600 500 400\n", True),
        (b"3\n400, 500, 600\n", True),
        (b"3\n1 2 3\n", False),
        (b"3\n400 five 600\n", False),
        (b"3\n", False),
        (b"", False),
        (b"wavelength,a\n400,0.1\n", False),
    ],
)
def test_cornell_is_known_by_its_list_of_wavelengths(tmp_path, head, known):
    assert cornell.recognises(tmp_path / "any.txt", head[:4096]) == known


@pytest.mark.parametrize("kind", ["rgl", "cornell", "bispectral"])
def test_a_file_cut_anywhere_says_what_to_do(tmp_path, whole, kind, capfd):
    reader, name, content = whole[kind]
    path = tmp_path / name
    for length in {0, 1, 3, 11, 12, 13, 14, 40, *range(60, len(content) - 3, max(len(content) // 40, 1))}:
        path.write_bytes(content[:length])
        try:
            read(reader, path)
        except InputError as said:
            assert_says_everything(said, path)
        else:
            # A text that ends with a whole row is a shorter measurement, and looks like any other.
            assert kind == "cornell" and len(content[:length].splitlines()[-1].split()) == 7


@pytest.mark.parametrize("size", [0, 4, 12, 400, 12 + MERL_BODY - 8, 12 + MERL_BODY + 8])
def test_a_merl_file_of_another_size_says_what_to_do(tmp_path, size):
    path = tmp_path / "a.binary"
    with path.open("wb") as file:
        file.write(MERL_HEADER[:size])
        file.truncate(size)
    with pytest.raises(InputError) as caught:
        read(merl, path)
    assert_says_everything(caught.value, path)


@pytest.mark.parametrize("header", [b"\0" * 12, np.array([90, 90, 90], "<i4").tobytes(), b"not a number"])
def test_a_merl_file_of_another_kind_says_what_to_do(tmp_path, header):
    path = tmp_path / "a.binary"
    path.write_bytes(header + b"\0" * 100)
    with pytest.raises(InputError) as caught:
        read(merl, path)
    assert_says_everything(caught.value, path)


def test_a_merl_file_of_zeros_says_what_to_do(tmp_path):
    path = tmp_path / "a.binary"
    with path.open("wb") as file:
        file.write(MERL_HEADER)
        file.truncate(12 + MERL_BODY)
    with pytest.raises(InputError, match="no value is positive") as caught:
        read(merl, path)
    assert_says_everything(caught.value, path)


@pytest.mark.parametrize("reader", [merl, rgl, cornell])
def test_a_file_that_is_not_there_is_named(tmp_path, reader):
    with pytest.raises(InputError) as caught:
        read(reader, tmp_path / "none.brdf")
    assert caught.value.file == tmp_path / "none.brdf" and caught.value.hint


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), kind=st.sampled_from(["rgl", "cornell", "bispectral"]))
def test_damaged_bytes_are_refused_in_words(tmp_path, whole, data, kind):
    reader, name, content = whole[kind]
    raw = bytearray(content)
    for _ in range(data.draw(st.integers(1, 6))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / name
    path.write_bytes(raw)
    reader.recognises(path, bytes(raw[:4096]))
    try:
        found = read(reader, path)
    except InputError as said:
        assert said.file == path and said.hint, str(said)
        return
    assert all(rebuild(each.model, each.parameters) for each in found)


@pytest.mark.parametrize(
    "listed", [b"400 500 0", b"0 500 600", b"500 500 600", b"400 nan 600", b"4e5 5e5 6e5", b".4 .5 .6"]
)
def test_a_damaged_list_of_wavelengths_says_what_to_do(tmp_path, listed):
    path = tmp_path / "a.brdf"
    path.write_bytes(cornell_text().replace(b"400 500 600", listed))
    with pytest.raises(InputError) as caught:
        read(cornell, path)
    assert_says_everything(caught.value, path)


@pytest.mark.parametrize("value", [1e9, 1.5, -0.5, np.nan])
def test_a_damaged_pixel_of_a_bispectral_picture_says_what_to_do(tmp_path, value):
    path = tmp_path / "a.exr"
    channels = {f"T.{nm},0nm": np.full((2, 2), 0.4, np.float32) for nm in (400, 500, 600)}
    channels["T.500,0nm"][1, 0] = value
    write_exr(path, {}, channels | {"T.400,0nm.500,0nm": np.full((2, 2), 0.1, np.float32)})
    with pytest.raises(InputError) as caught:
        read(bispectral, path)
    assert_says_everything(caught.value, path)


@pytest.mark.parametrize(("name", "reader"), [("cornell-spectral", cornell), ("rgl", rgl)])
def test_real_files_become_sources(shared_data, name, reader):
    for path in sorted((shared_data / "brdf" / name).iterdir()):
        with path.open("rb") as file:
            assert reader.recognises(path, file.read(4096)), path
        (found,) = read(reader, path)
        assert found.id.startswith("measured/") and found.original["units"]


def test_names_without_latin_letters_make_ids_of_their_own():
    """Two tables called 赤 1 and 青 1 are two materials, not both "1"; an accent is no hyphen."""
    assert id_word("赤 1") != id_word("青 1")
    assert id_word("Crème") == "creme" and id_word("garnet-red-2") == "garnet-red-2"
