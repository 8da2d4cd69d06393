"""PLY, OFF and STL files, as text and as bytes, against areas and volumes worked out apart."""

import itertools
import struct

import numpy as np
import pytest
from metamer.lighting.mesh.files import load_mesh
from metamer.runtime.errors import InputError

from .gltf_files import area, volume

# A U of area 7 and circumference 16 that stands 2 high: caps of eight corners, concave, and eight walls.
OUTLINE = [(3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3), (0, 0), (3, 0)]
U_POINTS = np.array([(x, y, z) for z in (0, 2) for x, y in OUTLINE], dtype=float)
U_FACES = [tuple(range(7, -1, -1)), tuple(range(8, 16)), *((k, (k + 1) % 8, 8 + (k + 1) % 8, 8 + k) for k in range(8))]
U_AREA, U_VOLUME = 2 * 7 + 16 * 2, 14
# The same walls, each as two triangles: faces of three kinds in one file.
MIXED = [*U_FACES[:5], *((a, b, c) for w in U_FACES[5:] for a, b, c in ((w[0], w[1], w[2]), (w[0], w[2], w[3])))]
CODES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
CODES |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f"}
CODES |= {"float64": "d"}


def write_ply(path, elements, form="ascii", line_end="\n", comments=("made by hand",)):
    """Elements as (name, properties, rows); a property is (type, name) or (count type, type, name)."""
    lines = ["ply", f"format {form} 1.0", *(f"comment {words}" for words in comments)]
    for name, properties, rows in elements:
        lines.append(f"element {name} {len(rows)}")
        lines += [f"property {'list ' if len(told) == 3 else ''}{' '.join(told)}" for told in properties]
    data = line_end.join([*lines, "end_header", ""]).encode()
    order = "<" if "little" in form else ">"
    for _, properties, rows in elements:
        for row in rows:
            words = []
            for told, value in zip(properties, row, strict=True):
                values = [value] if len(told) == 2 else [len(value), *value]
                kinds = [told[0]] if len(told) == 2 else [told[0], *[told[1]] * len(value)]
                words += (
                    [f"{v:g}" for v in values]
                    if form == "ascii"
                    else [struct.pack(order + CODES[k], v) for k, v in zip(kinds, values, strict=True)]
                )
            data += (" ".join(words) + line_end).encode() if form == "ascii" else b"".join(words)
    path.write_bytes(data)
    return path


def points(rows, kind="float"):
    whole = kind not in ("float", "double", "float32", "float64")
    return ("vertex", [(kind, name) for name in "xyz"], [[int(v) if whole else v for v in row] for row in rows])


def faces(rows, counted="uchar", kind="int", name="vertex_indices"):
    return ("face", [(counted, kind, name)], [[row] for row in rows])


FORMS = ["ascii", "binary_little_endian", "binary_big_endian"]


def assert_is_u(mesh):
    np.testing.assert_allclose(mesh.bounds, ([0, 0, 0], [3, 3, 2]))
    assert area(mesh) == pytest.approx(U_AREA)
    assert volume(mesh) == pytest.approx(U_VOLUME)


@pytest.mark.parametrize("kind", ["float", "double", "short", "uint8", "int32", "float32"])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("shape", ["concave caps and walls", "corners of three kinds"])
def test_polygons_of_a_ply_keep_their_area(shape, form, kind, tmp_path):
    told = U_FACES if shape.startswith("concave") else MIXED
    assert_is_u(load_mesh(write_ply(tmp_path / "u.ply", [points(U_POINTS, kind), faces(told)], form)))


@pytest.mark.parametrize("name", ["vertex_index", "vertex_indices"])
@pytest.mark.parametrize("counted", ["uchar", "ushort", "int", "uint8"])
@pytest.mark.parametrize("kind", ["uchar", "short", "uint", "int32"])
@pytest.mark.parametrize("form", FORMS[1:])
def test_lists_of_every_type(form, kind, counted, name, tmp_path):
    assert_is_u(load_mesh(write_ply(tmp_path / "u.ply", [points(U_POINTS), faces(U_FACES, counted, kind, name)], form)))


@pytest.mark.parametrize("form", FORMS)
def test_rows_of_unlike_lengths_that_add_up_to_those_of_even_ones(form, tmp_path):
    """Faces of 4, 3 and 5 corners take as many bytes as three of 4."""
    rows = [
        [0, 0, 0],
        [1, 0, 0],
        [1, 1, 0],
        [0, 1, 0],
        [2, 0, 0],
        [3, 0, 0],
        [2, 1, 0],
        [4, 0, 0],
        [6, 0, 0],
        [6, 2, 0],
        [5, 3, 0],
        [4, 2, 0],
    ]
    told = [(0, 1, 2, 3), (4, 5, 6), (7, 8, 9, 10, 11)]
    mesh = load_mesh(write_ply(tmp_path / "three.ply", [points(rows), faces(told)], form))
    assert area(mesh) == pytest.approx(1 + 0.5 + 5)


@pytest.mark.parametrize("form", FORMS)
def test_properties_and_elements_between_those_that_are_read(form, tmp_path):
    vertex = ("vertex", [("uchar", "red"), ("double", "z"), ("float", "x"), ("uchar", "int", "rings"), ("float", "y")],
              [[7, z, x, list(range(k % 3)), y] for k, (x, y, z) in enumerate(U_POINTS)])  # fmt: skip
    told = [("uchar", "flag"), ("uchar", "float", "weights"), ("uchar", "int", "vertex_indices"), ("float", "quality")]
    face = ("face", told, [[1, [0.5] * (k % 2), row, 0.25] for k, row in enumerate(U_FACES)])
    camera = ("camera", [("float", "view"), ("uchar", "uchar", "name")], [[1.0, [65, 66]]])
    assert_is_u(load_mesh(write_ply(tmp_path / "u.ply", [camera, vertex, ("nothing", [("int", "a")], []), face], form)))


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("form", FORMS)
def test_lines_of_a_header_end_in_any_way(form, line_end, tmp_path):
    assert_is_u(load_mesh(write_ply(tmp_path / "u.ply", [points(U_POINTS), faces(U_FACES)], form, line_end)))


@pytest.mark.parametrize("names", [("texture_u", "texture_v"), ("u", "v"), ("s", "t")])
@pytest.mark.parametrize("form", FORMS)
def test_texture_coordinates_and_normals_by_vertex(form, names, tmp_path):
    top = U_POINTS[8:]
    rows = [[*row, 0.0, 0.6, 0.8, row[0] / 4, row[1] / 8] for row in top]
    told = [("float", name) for name in ("x", "y", "z", "nx", "ny", "nz", *names)]
    mesh = load_mesh(write_ply(tmp_path / "u.ply", [("vertex", told, rows), faces([tuple(range(8))])], form))
    assert area(mesh) == pytest.approx(7)
    np.testing.assert_allclose(mesh.uv, mesh.vertices[:, :2] / [4, 8], atol=1e-7)
    np.testing.assert_allclose(mesh.normals, np.tile([0, 0.6, 0.8], (len(mesh.vertices), 1)), atol=1e-7)


@pytest.mark.parametrize("form", FORMS)
def test_texture_coordinates_by_corner_stay_with_polygons_of_unlike_counts(form, tmp_path):
    told = [("uchar", "int", "vertex_indices"), ("uchar", "float", "texcoord")]
    uv = {
        face: [(number + U_POINTS[c][0] / 4, U_POINTS[c][1] / 8 - U_POINTS[c][2]) for c in face]
        for number, face in enumerate(MIXED)
    }
    rows = [[face, list(itertools.chain(*uv[face]))] for face in MIXED]
    mesh = load_mesh(write_ply(tmp_path / "u.ply", [points(U_POINTS), ("face", told, rows)], form))
    assert_is_u(mesh)
    expected = mesh.vertices[:, :2] / [4, 8] - mesh.vertices[:, 2:] * [0, 1]
    number = mesh.uv[:, 0] - expected[:, 0]
    np.testing.assert_allclose(mesh.uv[:, 1], expected[:, 1], atol=1e-6)
    np.testing.assert_allclose(number, number.round(), atol=1e-6)
    # Each triangle has those of one face.
    assert np.ptp(number.round()[mesh.faces], axis=1).max() == 0


def test_one_triangle_has_the_texture_coordinates_of_its_corners(tmp_path):
    """As many corners as vertices, in another order."""
    told = [("uchar", "int", "vertex_indices"), ("uchar", "float", "texcoord")]
    mesh = load_mesh(
        write_ply(
            tmp_path / "one.ply",
            [points([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), ("face", told, [[(1, 2, 0), (1, 0, 0, 1, 0, 0)]])],
        )
    )
    np.testing.assert_allclose(mesh.uv, mesh.vertices[:, :2])


def test_texture_coordinates_of_some_faces_are_left_out_and_said(tmp_path):
    told = [("uchar", "int", "vertex_indices"), ("uchar", "float", "texcoord")]
    rows = [[face, [0.0] * (2 * len(face) * (k != 1))] for k, face in enumerate(U_FACES)]
    mesh = load_mesh(write_ply(tmp_path / "u.ply", [points(U_POINTS), ("face", told, rows)]))
    assert mesh.uv is None and "u: not every corner has texture coordinates; they are left out" in mesh.notes


@pytest.mark.parametrize("form", FORMS)
def test_strips_of_triangles_all_look_the_same_way(form, tmp_path):
    """Two strips in one row, parted by -1, and one in a row of its own."""
    rows = [[k // 2, -(k % 2), 0] for k in range(6)] + [[k // 2, -(k % 2), 5] for k in range(5)]
    strips = ("tristrips", [("int", "int", "vertex_indices")], [[[0, 1, 2, 3, 4, 5, -1, 6, 7, 8]], [[7, 8, 9, 10]]])
    mesh = load_mesh(write_ply(tmp_path / "bands.ply", [points(rows), strips], form))
    assert len(mesh.faces) == 4 + 1 + 2 and area(mesh) == pytest.approx(3.5)
    # The last strip begins on the other side.
    assert sorted(mesh.face_normals[:, 2].round(6).tolist()) in ([-1.0] * 5 + [1.0] * 2, [-1.0] * 2 + [1.0] * 5)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("index", [16, -1, 200])
def test_an_index_of_nothing_is_refused(index, form, tmp_path):
    told = [*U_FACES[:-1], (0, 1, index)]
    with pytest.raises(InputError, match=rf"(?s)u\.ply: face: .*not there.*found: {index}\n.*0 to 15"):
        load_mesh(write_ply(tmp_path / "u.ply", [points(U_POINTS), faces(told)], form))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("told", [U_FACES, MIXED], ids=["two kinds", "three kinds"])
def test_a_ply_that_ends_early_or_late_is_refused(told, form, tmp_path):
    path = write_ply(tmp_path / "u.ply", [points(U_POINTS), faces(told)], form)
    data = path.read_bytes()
    for cut in (1, 2, 9, 40, 200):
        path.write_bytes(data[:-cut])
        if form != "ascii" or cut > 2:
            with pytest.raises(InputError, match=r"u\.ply"):
                load_mesh(path)
    path.write_bytes(data + (b"7 7\n" if form == "ascii" else b"\1\2\3"))
    with pytest.raises(InputError, match="more than the header says"):
        load_mesh(path)


@pytest.mark.parametrize(
    "line, words",
    [
        ("element face many", "line 6"),
        ("property half x", "line 6"),
        ("property list float int vertex_indices", "line 6"),
        ("format text 1.0", "line 6"),
        ("what is this", "line 6"),
    ],
)
def test_a_line_of_a_header_that_says_nothing_is_refused(line, words, tmp_path):
    path = tmp_path / "odd.ply"
    path.write_text(
        f"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n{line}\nend_header\n"
    )
    with pytest.raises(InputError, match=f"{words}: not a line of a header"):
        load_mesh(path)


def test_faces_of_two_corners_and_edges_are_left_out_and_said(tmp_path):
    edge = ("edge", [("int", "vertex1"), ("int", "vertex2")], [[0, 1], [1, 2]])
    mesh = load_mesh(write_ply(tmp_path / "u.ply", [points(U_POINTS), faces([*U_FACES, (0, 1)]), edge]))
    assert_is_u(mesh)
    assert "u: left out, 2 rows of edge" in mesh.notes
    assert "u: left out, 1 faces with fewer than three corners" in mesh.notes


@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index"])
def test_polygons_under_another_name_are_left_out_and_said(name, tmp_path):
    quads = ("quad", [("uchar", "int", name)], [[[0, 1, 2, 3]], [[0, 3, 2, 1]]])
    mesh = load_mesh(write_ply(tmp_path / "u.ply", [points(U_POINTS), faces(U_FACES), quads]))
    assert_is_u(mesh)
    assert "u: left out, 2 rows of quad" in mesh.notes


def test_points_alone_are_refused(tmp_path):
    with pytest.raises(InputError, match="the mesh is empty"):
        load_mesh(write_ply(tmp_path / "u.ply", [points(U_POINTS)]))


OFF_ROWS = [f"{x:g} {y:g} {z:g}" for x, y, z in U_POINTS]
OFF_FACES = [f"{len(face)} " + " ".join(map(str, face)) for face in U_FACES]
COUNTS = f"{len(OFF_ROWS)} {len(OFF_FACES)} 0"
OFFS = {
    "plain": ["OFF", COUNTS, *OFF_ROWS, *OFF_FACES],
    "counts behind the word": [f"OFF {COUNTS}", *OFF_ROWS, *OFF_FACES],
    "counts at the word": [f"OFF{COUNTS}", *OFF_ROWS, *OFF_FACES],
    "remarks and empty lines": [
        "OFF # by hand",
        "",
        "# counts",
        COUNTS,
        *(f"{row} # a point" for row in OFF_ROWS),
        "",
        *OFF_FACES,
    ],
    "colours of faces": ["OFF", COUNTS, *OFF_ROWS, *(f"{face} 0.5 0.25 1 1" for face in OFF_FACES)],
    "colours of vertices": ["COFF", COUNTS, *(f"{row} 255 0 0 255" for row in OFF_ROWS), *OFF_FACES],
    "normals": ["NOFF", COUNTS, *(f"{row} 0 0 1" for row in OFF_ROWS), *OFF_FACES],
    "texture coordinates": ["STOFF", COUNTS, *(f"{row} {0.25 * k} 0.5" for k, row in enumerate(OFF_ROWS)), *OFF_FACES],
}


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize("kind", OFFS)
def test_polygons_of_an_off_keep_their_area(kind, line_end, tmp_path):
    path = tmp_path / "u.off"
    path.write_bytes(line_end.join(OFFS[kind]).encode())
    mesh = load_mesh(path)
    assert area(mesh) == pytest.approx(U_AREA)
    if kind == "normals":
        assert not any("no normals" in note for note in mesh.notes)
        return
    assert_is_u(mesh)
    if kind == "texture coordinates":
        places = [tuple(row) for row in U_POINTS.tolist()]
        number = np.array([places.index(tuple(row)) for row in mesh.vertices.tolist()])
        np.testing.assert_allclose(mesh.uv, np.stack([0.25 * number, 0 * number + 0.5], axis=1))


@pytest.mark.parametrize(
    "lines, words",
    [
        ([], "line 1: not an OFF file"),
        (["solid cube"], "line 1: not an OFF file"),
        (["4OFF", COUNTS], "line 1: a kind of OFF that is not read"),
        (["OFF BINARY"], "line 1: a kind of OFF that is not read"),
        (["OFF", "many"], "line 2: no counts"),
        (["OFF", "3 1 0", "0 0 0", "1 0 0", "0 1 0"], "cut short"),
        (["OFF", "3 1 0", "0 0 0", "1 0 0", "0 1 0", "3 0 1 2", "3 0 2 1"], "more than the header says"),
        (["OFF", "3 1 0", "0 0 0", "1 0", "0 1 0", "3 0 1 2"], "line 4: not a vertex"),
        (["OFF", "3 1 0", "0 0 0", "1 0 0", "0 1 0", "3 0 1 3"], "line 6: a face uses a vertex"),
        (["OFF", "3 1 0", "0 0 0", "1 0 0", "0 1 0", "3 0 1 -1"], "line 6: a face uses a vertex"),
        (["OFF", "3 1 0", "0 0 0", "1 0 0", "0 1 0", "4 0 1 2"], "line 6: not a face"),
    ],
)
def test_an_off_that_is_damaged_is_refused_with_its_line(lines, words, tmp_path):
    path = tmp_path / "odd.off"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=words):
        load_mesh(path)


@pytest.mark.parametrize("corners", [3, 4, 5])
def test_a_text_stl_of_other_facets_than_triangles_is_refused(corners, tmp_path):
    vertices = "".join(f"vertex {np.cos(a)} {np.sin(a)} 0\n" for a in np.arange(corners) * 2 * np.pi / corners)
    facet = f"facet normal 0 0 1\nouter loop\n{vertices}endloop\nendfacet\n"
    path = tmp_path / "facets.stl"
    path.write_text(f"solid one\n{facet * 3}endsolid one\n")
    if corners == 3:
        assert area(load_mesh(path)) == pytest.approx(3 * 3 * 3**0.5 / 4)
        return
    with pytest.raises(InputError, match=rf"(?s)facets\.stl.*not triangles.*{3 * corners} vertices in 3 facets"):
        load_mesh(path)


@pytest.mark.parametrize("name", ["one", "body of vertices", ""])
@pytest.mark.parametrize("facet", ["facet normal 0 0 1\nouter loop\n", "facet normal 0 0 1 outer loop\n"])
def test_a_text_stl_is_read_whatever_it_is_called_and_however_its_lines_end(facet, name, tmp_path):
    text = f"solid {name}\n{facet}vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop endfacet\nendsolid {name}\n"
    for line_end, words in (("\n", str), ("\r\n", str), ("\n", str.upper)):
        path = tmp_path / "one.stl"
        path.write_bytes(words(text).replace("\n", line_end).encode())
        assert area(load_mesh(path)) == pytest.approx(0.5)


@pytest.mark.parametrize("solids", [1, 2, 3])
def test_a_text_stl_whose_last_solid_does_not_end_is_refused(solids, tmp_path):
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    text = "".join(f"solid s{k}\n{facet * 2}endsolid s{k}\n" for k in range(solids))
    path = tmp_path / "cut.stl"
    path.write_text(text)
    assert area(load_mesh(path)) == pytest.approx(solids)
    path.write_text(text.rpartition("endsolid")[0])
    with pytest.raises(InputError, match=r"cut\.stl: the mesh file is cut short"):
        load_mesh(path)


@pytest.mark.parametrize("head", [b"made here", b"solid body\0"])
@pytest.mark.parametrize("off", [-60, -1, 1, 50])
def test_a_binary_stl_of_another_length_is_refused_for_it(off, head, tmp_path):
    """Not for a library that reads texts and is not there."""
    facet = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0)
    whole = struct.pack("<80sI", head, 2) + 2 * facet
    path = tmp_path / "cut.stl"
    path.write_bytes(whole)
    assert area(load_mesh(path)) == pytest.approx(1.0)
    path.write_bytes(whole[:off] if off < 0 else whole + bytes(off))
    with pytest.raises(InputError, match=rf"cut\.stl: an STL file of another length.*\n  found: {184 + off} bytes"):
        load_mesh(path)


@pytest.mark.parametrize("form", ["binary", "text", "upper case"])
@pytest.mark.parametrize(("normal", "against"), [((0, 0, 1), 0), ((0, 0, -1), 2), ((0, 0, 0), 0), ((0.1, 0, -9), 2)])
def test_normals_of_an_stl_against_its_corners_are_said(form, normal, against, tmp_path):
    corners = (0, 0, 0, 1, 0, 0, 0, 1, 0)
    path = tmp_path / "sheet.stl"
    if form == "binary":
        path.write_bytes(struct.pack("<80sI", b"", 2) + 2 * struct.pack("<12fH", *normal, *corners, 0))
    else:
        vertices = "".join("vertex {} {} {}\n".format(*corners[k : k + 3]) for k in (0, 3, 6))
        facet = "facet normal {} {:.1e} {}\nouter loop\n".format(*normal) + f"{vertices}endloop\nendfacet\n"
        text = f"solid normal view\n{2 * facet}endsolid normal view\n"
        path.write_text(text.upper() if form == "upper case" else text)
    notes = [note for note in load_mesh(path).notes if "against" in note]
    assert len(notes) == bool(against) and all(f"{against} of 2 facets" in note for note in notes)


@pytest.mark.parametrize("form", ["binary", "binary that begins with solid", "text", "text of two solids"])
def test_an_stl_keeps_its_area_and_volume(form, tmp_path):
    fan = [(a, face[k], face[k + 1]) for face in U_FACES[2:] for a in face[:1] for k in range(1, len(face) - 1)]
    # The caps by hand: three rectangles each.
    fan += [(7, 6, 3), (7, 3, 2), (0, 7, 2), (0, 2, 1), (5, 4, 3), (5, 3, 6)]
    fan += [(15, 11, 14), (15, 10, 11), (8, 10, 15), (8, 9, 10), (13, 11, 12), (13, 14, 11)]
    path = tmp_path / "u.stl"
    if form.startswith("binary"):
        head = (b"solid u" if "solid" in form else b"made by hand").ljust(80)
        rows = [struct.pack("<12fH", 0, 0, 0, *U_POINTS[list(face)].reshape(-1), 0) for face in fan]
        path.write_bytes(head + struct.pack("<I", len(rows)) + b"".join(rows))
    else:
        facets = [
            "facet normal 0 0 0\nouter loop\n"
            + "".join("vertex {} {} {}\n".format(*U_POINTS[c]) for c in face)
            + "endloop\nendfacet\n"
            for face in fan
        ]
        half = len(facets) // 2
        parts = [facets] if form == "text" else [facets[:half], facets[half:]]
        path.write_text("".join(f"solid s{k}\n{''.join(part)}endsolid s{k}\n" for k, part in enumerate(parts)))
    mesh = load_mesh(path)
    assert_is_u(mesh)
    assert mesh.part_names == (("s0", "s1") if form == "text of two solids" else ("u",))
