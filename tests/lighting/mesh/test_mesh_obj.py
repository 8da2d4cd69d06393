"""OBJ files: indices from the start and from the last, among vertices, objects, groups and materials."""

import itertools

import numpy as np
import pytest
from metamer.lighting.mesh.files import load_mesh, load_mesh_by_material
from metamer.runtime.errors import InputError

# A tetrahedron whose faces look outwards, with a texture coordinate and a normal for each corner.
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1.5, 0], [0, 0, 2]])
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
UV = np.array([[0, 0], [1, 0], [0, 0.5], [0.25, 1]])
PLACES = (0.0, 5.0, 11.0)


def normals_of(face):
    a, b, c = POINTS[list(face)]
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal)


def body(place, number, form, relative, interleaved, seen):
    """Lines of one tetrahedron; `relative(k)` tells whether the k-th corner counts from the last."""
    v = [f"v {x + place} {y} {z}" for x, y, z in POINTS]
    vt = [f"vt {u} {w}" for u, w in UV] if "t" in form else []
    vn = ["vn {} {} {}".format(*normals_of(face)) for face in FACES] if "n" in form else []
    before = {kind: seen[kind] for kind in seen}
    for kind, rows in (("v", v), ("t", vt), ("n", vn)):
        seen[kind] += len(rows)
    rows = [*v, *vt, *vn] if not interleaved else [r for rs in itertools.zip_longest(vn, vt, v) for r in rs if r]
    corners = itertools.count()
    for number_of_face, face in enumerate(FACES):
        words = []
        for corner in face:
            from_last = relative(next(corners))
            index = {"v": corner, "t": corner, "n": number_of_face}
            said = {
                kind: before[kind] + at + 1 if not from_last else before[kind] + at - seen[kind]
                for kind, at in index.items()
            }
            words.append({"v": "{v}", "vt": "{v}/{t}", "vn": "{v}//{n}", "vtn": "{v}/{t}/{n}"}[form].format(**said))
        rows.append("f " + " ".join(words))
    return rows


COUNTING = {
    "from the start": lambda k: False,
    "from the last": lambda k: True,
    "both ways, face by face": lambda k: k // 3 % 2 == 0,
    "both ways in one face": lambda k: k % 3 == 1,
}
HEADS = {
    "nothing": lambda number: [],
    "objects": lambda number: [f"o body {number}"],
    "groups": lambda number: [f"g left right{number}", "s 1"],
    "materials": lambda number: [f"usemtl paint {number}"],
    "one material and objects": lambda number: [f"o body{number}", "usemtl paint"],
}


def corners_of(mesh, *, uv, normals):
    arrays = [mesh.vertices[mesh.faces]]
    arrays += [mesh.uv[mesh.faces]] if uv else []
    arrays += [mesh.normals[mesh.faces]] if normals else []
    flat = np.concatenate(arrays, axis=-1)
    # In order, beginning with the least corner.
    return sorted(min(np.roll(face, -k, axis=0).round(6).tolist() for k in range(3)) for face in flat)


def expected_corners(form):
    faces = []
    for place in PLACES:
        for face in FACES:
            rows = [POINTS[list(face)] + [place, 0, 0]]
            rows += [UV[list(face)]] if "t" in form else []
            rows += [np.tile(normals_of(face), (3, 1))] if "n" in form else []
            flat = np.concatenate(rows, axis=-1).round(6) + 0.0
            faces.append(min(np.roll(flat, -k, axis=0).tolist() for k in range(3)))
    return sorted(faces)


@pytest.mark.parametrize("head", HEADS)
@pytest.mark.parametrize("counting", COUNTING)
@pytest.mark.parametrize("form", ["v", "vt", "vn", "vtn"])
@pytest.mark.parametrize("interleaved", [False, True], ids=["kind after kind", "kinds mixed"])
def test_indices_of_every_kind_find_their_own_vertices(form, counting, head, interleaved, tmp_path):
    """Three bodies whose faces stand between the vertices of one and the next."""
    seen = {"v": 0, "t": 0, "n": 0}
    lines = []
    for number, place in enumerate(PLACES):
        lines += HEADS[head](number) + body(place, number, form, COUNTING[counting], interleaved, seen)
    path = tmp_path / "bodies.obj"
    path.write_text("\n".join(lines) + "\n")
    mesh = load_mesh(path)
    shown = corners_of(mesh, uv="t" in form, normals="n" in form)
    np.testing.assert_allclose(shown, expected_corners(form), atol=2e-6)
    assert mesh.notes == () if "n" in form else all("no normals in the file" in note for note in mesh.notes)
    by_material = {name: len(mesh.faces) for name, mesh in load_mesh_by_material(path).items()}
    expected = {"materials": {f"paint {k}": 4 for k in range(3)}, "one material and objects": {"paint": 12}}
    assert by_material == expected.get(head, {"": 12})


WRITTEN = {
    "tabs and blanks": lambda text: text.replace(" ", "\t ").replace("\nf", "\n  f").replace("\nv\t", "\n\tv\t"),
    "lines of Windows": lambda text: text.replace("\n", "\r\n"),
    "lines of old Macs": lambda text: text.replace("\n", "\r"),
    "remarks behind lines": lambda text: text.replace("\n", " # 1 2 3\n"),
    "lines that go on": lambda text: text.replace(" 0 ", " 0 \\\n").replace(" 2 ", " \\\n2 "),
    "lines of Windows that go on": lambda text: text.replace(" 2 ", " \\\n2 ").replace("\n", "\r\n"),
    "lines that go on behind a blank": lambda text: text.replace(" 2 ", " \\ \t\n2 "),
    "remarks that end in a folder": lambda text: text.replace("\nf", "\n# kept in C:\\parts\\\nf"),
    "faces with remarks that end in a folder": lambda text: text.replace("3\nf", "3 # of C:\\parts\\\nf"),
    "a library and a material in a folder": lambda text: "mtllib C:\\a\\\n" + text.replace("\nf", "\nusemtl a\\\nf"),
    "weights": lambda text: text.replace("\nf", " 1\nf", 1).replace("\nv", " 1.0\nv"),
    "colours": lambda text: text.replace("\nv", " 0.2 0.3 0.4\nv"),
    "a byte order mark": lambda text: "\ufeff" + text,
    "no last line end": lambda text: text.rstrip("\n"),
    "exponents": lambda text: text.replace("v 1 0 0", "v +1.0e+00 0e-3 .0E0"),
}


@pytest.mark.parametrize("way", WRITTEN)
def test_lines_are_read_however_they_are_written(way, tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 2\nf 1 2 3\nf 2 -1 -2\n"
    path = tmp_path / "two.obj"
    path.write_bytes(WRITTEN[way](text).encode())
    mesh = load_mesh(path)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    areas = sorted(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))
    # Area of (1,0,0) (2,0,2) (0,1,0): |(1,0,2) x (-1,1,0)| / 2 = |(-2,-2,1)| / 2.
    np.testing.assert_allclose(areas, [0.5, 1.5])


HEAD = "# made by hand\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvn 0 0 1\n"


@pytest.mark.parametrize(
    "face, kind, found",
    [
        ("f 1 2 4", "vertex", "index 4"),
        ("f 0 1 2", "vertex", "index 0"),
        ("f 1 2 -4", "vertex", "index -4"),
        ("f 1/1 2/3 3/1", "texture coordinate", "index 3"),
        ("f 1/1 2/-3 3/1", "texture coordinate", "index -3"),
        ("f 1/0 2/1 3/1", "texture coordinate", "index 0"),
        ("f 1//1 2//2 3//1", "normal", "index 2"),
        ("f 1/1/1 2/1/1 3/1/-2", "normal", "index -2"),
        ("f 1 2 3 99999999999", "vertex", "index 99999999999"),
    ],
)
@pytest.mark.parametrize("later", ["", "v 5 5 5\nv 6 6 6\n"], ids=["at the end", "before others"])
def test_an_index_of_nothing_is_refused_with_its_line(face, kind, found, later, tmp_path):
    path = tmp_path / "out.obj"
    face = face.replace("4", "6") if later and face == "f 1 2 4" else face
    found = found.replace("4", "6") if later and found == "index 4" else found
    path.write_text(f"{HEAD}f 1 2 3\n{face}\n{later}")
    with pytest.raises(InputError) as refused:
        load_mesh(path)
    assert f"out.obj: line 9: a face uses a {kind} that is not there" in str(refused.value)
    assert f"found: {found}" in str(refused.value)


@pytest.mark.parametrize(
    "face", ["f 1 2 x", "f 1/1/1/1 2 3", "f /1 2 3", "f 1.5 2 3", "f 1 2 0x3", "f 1 2 99999999999999999999"]
)
def test_a_corner_that_is_no_index_is_refused_with_its_line(face, tmp_path):
    path = tmp_path / "odd.obj"
    path.write_text(f"{HEAD}f 1 2 3\n{face}\n")
    with pytest.raises(InputError, match="line 9: not a corner of a face"):
        load_mesh(path)


@pytest.mark.parametrize("row", ["v 1 2", "v 1 2 z", "vn 0 0", "vt", "v 1,5 0 0"])
def test_a_row_that_is_no_numbers_is_refused_with_its_line(row, tmp_path):
    path = tmp_path / "odd.obj"
    path.write_text(f"{HEAD}{row}\nf 1 2 3\n")
    with pytest.raises(InputError, match="line 8: not a"):
        load_mesh(path)


def test_lines_points_and_curves_are_left_out_and_said(tmp_path):
    path = tmp_path / "much.obj"
    path.write_text(f"{HEAD}f 1 2 3\nl 1 2\nl 2 3\np 1\nf 1 2\ncurv 0 1 1 2\nsurf 0 1 0 1 1 2 3\n")
    mesh = load_mesh(path)
    assert mesh.notes[-4:] == (
        "much: left out, 2 lines",
        "much: left out, 1 points",
        "much: left out, 1 faces with fewer than three corners",
        "much: left out, 2 free-form curves or surfaces",
    )


@pytest.mark.parametrize("line", ["F 1 2 3", "tri 1 2 3", "xf 2 0 0", "scale 1000", "Vertex 0 0 0"])
def test_lines_that_no_obj_has_are_said(line, tmp_path):
    path = tmp_path / "odd.obj"
    path.write_text(f"{HEAD}f 1 2 3\n{line}\n{line}\n")
    assert f"left out, 2 lines of kinds that OBJ does not have: {line.split()[0]!r}" in load_mesh(path).notes[-1]
    path.write_text(f"{HEAD}#note\no a\ng b\ns 1\nmtllib a.mtl\ncsh ls\nlod 3\nf 1 2 3\ndeg 2\nparm u 0 1 \\\n2\nend\n")
    assert not any("kinds" in note for note in load_mesh(path).notes)


def test_a_file_of_lines_alone_is_refused_for_what_it_holds(tmp_path):
    path = tmp_path / "wire.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    with pytest.raises(InputError, match=r"(?s)the mesh is empty.*left out, 1 lines"):
        load_mesh(path)


@pytest.mark.parametrize("forms", [("f 1/1 2/2 3/1", "f 1 2 3 4 5 6"), ("f 1//1 2//1 3//1", "f 1/1 2/2 3/1")])
def test_faces_of_the_same_count_of_numbers_are_told_apart(forms, tmp_path):
    """As many numbers in a line, and another meaning."""
    hexagon = "".join(f"v {np.cos(a)} {np.sin(a)} 0\n" for a in np.arange(6) * np.pi / 3)
    path = tmp_path / "forms.obj"
    path.write_text(f"{hexagon}vt 0 0\nvt 1 0\nvn 0 0 1\n" + "\n".join(forms) + "\n")
    mesh = load_mesh(path)
    areas = [
        {3: 3**0.5 / 4, 6: 6 * 3**0.5 / 4}[len(form.split()) - 1] for form in forms
    ]  # of the triangle 1 2 3 and of the hexagon
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(sum(areas))
    assert mesh.uv is None
    assert any("not every corner has texture coordinates" in note for note in mesh.notes)


def test_normals_on_some_corners_only_are_left_out_and_said(tmp_path):
    path = tmp_path / "some.obj"
    path.write_text(f"{HEAD}f 1//1 2//1 3//1\nf 1 3 2\n")
    mesh = load_mesh(path)
    assert any("not every corner has a normal" in note for note in mesh.notes)


def test_texture_coordinates_of_a_concave_polygon_stay_with_their_corners(tmp_path):
    outline = [(3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3), (0, 0), (3, 0)]
    lines = [f"v {x} {y} 0" for x, y in outline] + [f"vt {x / 3} {y / 3}" for x, y in reversed(outline)]
    path = tmp_path / "U.obj"
    path.write_text("\n".join([*lines, "f " + " ".join(f"{k}/{9 - k}" for k in range(1, 9)), ""]))
    mesh = load_mesh(path)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(7.0)
    np.testing.assert_allclose(mesh.uv, mesh.vertices[:, :2] / 3, atol=1e-12)
    assert (mesh.face_normals[:, 2] == 1.0).all()
