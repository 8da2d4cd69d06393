"""The container of glTF files: chunks, buffers, views and accessors, in bounds or refused."""

import json
import struct

import pytest
from metamer.materials.formats import gltf
from metamer.materials.formats.gltf_container import open_gltf
from metamer.runtime.errors import InputError
from PIL import Image


def glb(document, binary=b"", version=2):
    """A .glb, its chunks padded as the specification has it."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        binary += b"\0" * (-len(binary) % 4)
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", version, 12 + len(chunks)) + chunks


def one_material(binary=b"", version=2, **changes):
    return glb({"asset": {"version": "2.0"}, "materials": [{"name": "paint"}]} | changes, binary, version)


BROKEN = {
    "empty": (b"", "JSON"),
    "cut in the header": (one_material()[:9], "header"),
    "cut in the JSON": (one_material()[:60], "length"),
    "version 1 of GLB": (one_material(version=1), "version"),
    "version 1.0": (one_material(asset={"version": "1.0"}), "asset.version"),
    "a later version": (one_material(asset={"version": "2.1", "minVersion": "2.1"}), "asset.minVersion"),
    "no version": (one_material(asset={}), "asset.version"),
    "not JSON": (b"{ materials", "JSON"),
    "a list": (b"[]", "JSON"),
    "deep": (b'{"asset":' + b"[" * 100000, "JSON"),
    "NaN": (b'{"asset": {"version": "2.0"}, "materials": [{"emissiveFactor": [NaN, 0, 0]}]}', "JSON"),
    "no materials": (one_material(materials=[]), "materials"),
    "materials of another kind": (one_material(materials=[1]), "materials"),
    "a view beyond its buffer": (
        one_material(buffers=[{"byteLength": 0}], bufferViews=[{"buffer": 0, "byteLength": 9}]),
        "bufferViews[0].byteLength",
    ),
    "a buffer cut short": (
        one_material(b"1234", buffers=[{"byteLength": 100}]),
        "buffers[0].byteLength",
    ),
    "an accessor beyond its view": (
        one_material(
            b"12345678",
            buffers=[{"byteLength": 8}],
            bufferViews=[{"buffer": 0, "byteLength": 8}],
            accessors=[{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 1}],
        ),
        "accessors[0].count",
    ),
}


@pytest.mark.parametrize(("raw", "field"), BROKEN.values(), ids=BROKEN)
def test_files_that_are_refused(tmp_path, raw, field):
    path = tmp_path / "a.gltf"
    path.write_bytes(raw)
    with pytest.raises(InputError) as caught:
        list(gltf.read_sources(path, "mallett-yuksel"))
    said = caught.value
    assert said.file == path and said.field == field
    assert said.found is not None and said.expected and said.hint


ACCESSORS = {
    "packed": ({"type": "VEC3", "count": 2}, {}, 24),
    "after each other": ({"type": "VEC3", "count": 2}, {"byteStride": 16}, 28),
    "from the middle": ({"type": "SCALAR", "count": 1, "byteOffset": 4}, {}, 8),
    "no values": ({"type": "MAT4", "count": 0}, {}, 0),
    "columns at multiples of four bytes": ({"type": "MAT3", "componentType": 5120, "count": 2}, {}, 23),
}


@pytest.mark.parametrize(("accessor", "view", "size"), ACCESSORS.values(), ids=ACCESSORS)
def test_an_accessor_may_fill_its_view_to_the_last_byte(tmp_path, accessor, view, size):
    """Section 3.6.2.4 of the specification: offset + stride (count - 1) + the size of an element."""
    for length in (size, size - 1):
        made = one_material(
            b"\0" * 40,
            buffers=[{"byteLength": 40}],
            bufferViews=[{"buffer": 0, "byteLength": max(length, 0)} | view],
            accessors=[{"bufferView": 0, "componentType": 5126} | accessor],
        )
        path = tmp_path / "a.glb"
        path.write_bytes(made)
        if length == size or size == 0:
            assert open_gltf(path).binary[1] == 40
        else:
            with pytest.raises(InputError, match="values beyond their view"):
                open_gltf(path)


def test_bytes_after_the_file_s_own_length_are_left_alone(tmp_path):
    path = tmp_path / "a.glb"
    path.write_bytes(one_material() + b"a signature")
    assert [material.text("name") for material in open_gltf(path).root.children("materials")] == ["paint"]


def windows_file(folder, uri):
    """A .gltf as exporters on Windows write it, whose one picture is called `uri`."""
    pbr = {"baseColorTexture": {"index": 0}}
    made = {"asset": {"version": "2.0"}, "materials": [{"name": "paint", "pbrMetallicRoughness": pbr}]}
    path = folder / "a.gltf"
    path.write_text(json.dumps(made | {"textures": [{"source": 0}], "images": [{"uri": uri}]}))
    return path


@pytest.mark.parametrize("uri", ["textures\\x.png", ".\\textures/x.png", "textures%5Cx.png"])
def test_backslashes_part_folders_and_that_is_said(tmp_path, uri):
    (tmp_path / "textures").mkdir()
    picture = tmp_path / "textures" / "x.png"
    Image.new("RGB", (2, 2), (200, 100, 50)).save(picture)
    path = windows_file(tmp_path, uri)
    (found,) = gltf.read_sources(path, "mallett-yuksel")
    assert found.original["maps.pbrMetallicRoughness.baseColorTexture"].tobytes() == picture.read_bytes()
    assert "backslashes in the names of pictures" in found.provenance.notes
    assert [one.resolve() for one in gltf.companions(path)] == [picture]


def test_a_file_that_is_called_by_its_backslash_is_taken_as_it_is(tmp_path):
    (tmp_path / "textures").mkdir()
    Image.new("RGB", (2, 2)).save(tmp_path / "textures" / "x.png")
    Image.new("RGB", (2, 2), (255, 255, 255)).save(tmp_path / "textures\\x.png")
    (found,) = gltf.read_sources(windows_file(tmp_path, "textures\\x.png"), "mallett-yuksel")
    whole = (tmp_path / "textures\\x.png").read_bytes()
    assert found.original["maps.pbrMetallicRoughness.baseColorTexture"].tobytes() == whole
    assert "backslashes" not in found.provenance.notes


@pytest.mark.parametrize(
    ("uri", "problem"),
    [
        ("..\\secret.png", "not fetched"),
        ("textures\\..\\..\\secret.png", "not fetched"),
        ("\\secret.png", "not fetched"),
        ("textures\\link.png", "leads out of the folder"),
        ("textures\\none.png", "no such file"),
    ],
)
def test_backslashes_lead_nowhere_else(tmp_path, uri, problem):
    inner = tmp_path / "in"
    (inner / "textures").mkdir(parents=True)
    Image.new("RGB", (2, 2)).save(tmp_path / "secret.png")
    (inner / "textures" / "link.png").symlink_to(tmp_path / "secret.png")
    (found,) = gltf.read_sources(windows_file(inner, uri), "mallett-yuksel")
    assert problem in found.reason.problem
