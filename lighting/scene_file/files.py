"""Reader of `scene.toml`: checks every key and fills in defaults; docs/scene.md describes the format."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from fnmatch import fnmatchcase
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ...calibration.display.icc_profile import PREFIX, SCREEN
from ...materials.formats.input_file import head_of, is_zip
from ...materials.formats.registry import format_for, label
from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import existing_file, read_text
from ...spectral.adaptation import CONE_FROM_XYZ
from ...spectral.formats import exr
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ..camera import Camera
from ..lights import DirectionalLight, Light
from ..mesh import shapes
from ..mesh.cost import SAID_FROM_SECONDS, MeshCost, file_cost
from ..mesh.files import SUFFIXES, load_mesh
from ..mesh.mesh import Mesh
from ..scene import Part, Review, Scene, Viewing, bounds_of, check_lit, framing_camera, held_off_notes, illuminances_lux
from .keys import (
    CAMERA,
    INTERREFLECTION,
    PART,
    REVIEW,
    SCENE,
    SHAPES,
    TABLES,
    VIEWING,
    errors_at,
    taken,
)
from .light_tables import read_light
from .mesh_materials import worn_meshes

DEFAULT_MATERIAL = "colorchecker/neutral-5-matte"
# Hint for image files given instead of a scene.
_PICTURE = (
    "write a scene.toml that has it as a map, a light or a material (docs/scene.md); metamer view opens EXR images"
)
_PICTURES = ("PNG", "JPEG", "TIFF", "WEBP", "BMP", "GIF", "PSD")


def scene_file(path: str | Path) -> Path:
    """Return the path of a scene after checking its tables; raises `InputError` for any other file."""
    _tables(path)
    return Path(path)


def possible_scene(path: str | Path) -> Path:
    """Return the path of a file that may be a scene, valid or not; raises `InputError` for files of other kinds."""
    path, expected = Path(path), "a scene.toml"
    if not path.suffix and len(path.parts) == 2 and not path.parent.exists():
        one = path.as_posix()
        hint = f'write a scene.toml with a [[part]] that has shape = "sphere" and material = "{one}" (docs/scene.md)'
        hint += f"; `metamer view {one}` shows a material on a shape"
        raise InputError("no such file; this may be a material, not a scene", file=one, expected=expected, hint=hint)
    existing_file(path)
    if path.suffix.lower() in SUFFIXES:
        hint = f'write a scene.toml with a [[part]] that has mesh = "{path.name}" and material = "ID" (docs/scene.md)'
        raise InputError("a mesh, not a scene", file=path, found=path.suffix, expected=expected, hint=hint)
    if b"\0" in (head := head_of(path)):
        _refuse_other_kinds(path, head)
    return path


def _refuse_other_kinds(path: Path, head: bytes) -> None:
    """Raise `InputError` for materials, archives and images, recognised by their first bytes."""
    from PIL import Image

    Image.init()
    reader = None
    if head.startswith(exr.MAGIC) or any((of := Image.OPEN[name][1]) and of(head[:16]) for name in _PICTURES):
        kind, hint = "a picture", _PICTURE
    elif (reader := format_for(path)) is not None:
        kind = "a material or a measurement"
        hint = 'import it, and write a scene.toml with a [[part]] that has its id as material = "ID" (docs/scene.md)'
    elif is_zip(head):
        kind, hint = "an archive", "unpack it, and name the scene.toml in it"
    else:
        return
    found = label(reader, path) if reader is not None else None
    raise InputError(f"{kind}, not a scene", file=path, found=found, expected="a scene.toml", hint=hint)


def _tables(path: str | Path) -> dict[str, Any]:
    """Parse the tables of a scene, with the checks that need neither a mesh nor a catalogue, which may take minutes to
    load: keys of some tables, names and repetition of the others.
    """
    path = possible_scene(path)
    try:
        document = tomllib.loads(read_text(path, "a scene.toml"))
    except tomllib.TOMLDecodeError as reason:
        if path.suffix.lower() != ".toml":
            _refuse_other_kinds(path, head_of(path))
        hint = 'correct it there; such a file starts with [[part]] and a line like: shape = "sphere"'
        raise InputError("not a TOML file", file=path, found=str(reason), hint=hint) from reason
    for key, value in document.items():
        if key not in TABLES:
            raise UnknownNameError("table", key, TABLES, file=path, field=key)
        repeated = key in ("part", "light", "camera")
        if repeated and not (isinstance(value, list) and all(isinstance(item, dict) for item in value)):
            raise InputError("not a list of tables", file=path, field=key, expected=f"[[{key}]], in double brackets")
        if not repeated and not isinstance(value, dict):
            raise InputError("not a table", file=path, field=key, expected=f"[{key}]")
    single = {"scene": SCENE, "viewing": VIEWING, "interreflection": INTERREFLECTION, "review": REVIEW}
    for name, keys in single.items():
        taken(document.get(name, {}), keys, path, name)
    for number, table in enumerate(document.get("camera", []), 1):
        taken(table, CAMERA, path, _where("camera", number, table))
    return document


def load_scene(
    path: str | Path, catalogue: Any = None, say: Callable[[str], None] | None = None, *, swept: bool = False
) -> Scene:
    """Load `scene.toml`; docs/scene.md describes the format.

    Parameters
    ----------
    path : of the file; meshes and measured spectra are relative to it.
    catalogue : a `Catalogue`, or any object with its `ids()`, which must include the scene's materials; lights may name
        its emissions. None skips the check of materials.
    say : called with a message before each long step, such as reading a large mesh.
    swept : True if the reviewed part gets other materials: its own, and those of the scene's review, need not be in the
        catalogue.

    Raises
    ------
    InputError, UnknownNameError : with the file, the key, and the nearest names there are.

    >>> [part.name for part in load_scene(shipped_scene("patches")).parts]
    ['chips/1', 'chips/2', 'chips/3', 'chips/4', 'chips/5', 'chips/6']
    """
    document, path = _tables(path), Path(path)
    known_ids = None if catalogue is None else tuple(catalogue.ids())
    head = taken(document.get("scene", {}), SCENE, path, "scene")
    with errors_at(path, "scene.observer"):
        seen_by = observer(head.get("observer", "1931_2"))
    if not document.get("part"):
        raise InputError("a scene without parts", file=path, field="part", expected="at least one [[part]]")
    named, notes = _names(document["part"])
    tables = enumerate(zip(document["part"], named, strict=True), 1)
    unworn = document.get("review", {}).get("on", named[0]) if swept else None
    parts = [part for k, (table, name) in tables for part in _parts(table, k, name, path, known_ids, say, unworn)]
    low, high = bounds_of(part.mesh for part in parts)
    notes += [note for part in parts for note in part.mesh.notes]
    lights: list[Light] = []
    for k, table in enumerate(document.get("light", []), 1):
        light, said = read_light(table, _where("light", k, table), k, path, seen_by, catalogue, say)
        lights.append(light)
        notes += said
    if not lights:
        lights = [DirectionalLight(**DirectionalLight.DEFAULTS, spectrum=illuminant("D65"), spectrum_name="D65")]
        notes.append("no light given: one directional light, D65, 1000 lx, from the upper left front")
    notes += held_off_notes(lights, low, high)
    cameras = [_camera(table, k, path, low, high) for k, table in enumerate(document.get("camera", []), 1)]
    if not cameras:
        cameras = [framing_camera(low, high)]
        notes.append("no camera given: one from the front that frames the scene")
    illuminances = illuminances_lux(lights, low, high)
    check_lit(illuminances, path)
    viewing = _viewing(document.get("viewing", {}), path, illuminances)
    review = None
    if "review" in document:
        own = zip(map(_own, document["part"]), named, strict=True)
        shared = {word for word, name in own if word != name} - {table.get("name") for table in document["part"]}
        review = _review(document["review"], path, [part.name for part in parts], shared, None if swept else known_ids)
    bounces = taken(document.get("interreflection", {}), INTERREFLECTION, path, "interreflection").get("bounces", 0)
    with errors_at(path, None):
        return Scene(
            tuple(parts),
            tuple(lights),
            tuple(cameras),
            seen_by,
            viewing,
            head.get("name", path.stem),
            review,
            tuple(dict.fromkeys(notes)),
            path,
            bounces,
        )


def _own(table: Mapping[str, Any]) -> str:
    """Return a part's own name: `name`, its shape or its file's name; "" if none of these is text."""
    found = next((table[key] for key in ("name", "shape", "mesh") if key in table), "")
    return "" if not isinstance(found, str) else found if "name" in table or "shape" in table else Path(found).stem


def _names(tables: Sequence[Mapping[str, Any]]) -> tuple[list[str], list[str]]:
    """Return a unique name for each part, numbered for parts without `name` that would share one, and notes on
    these.
    """
    taken_names = {_own(table) for table in tables if "name" in table}
    names, notes = [], []
    for number, table in enumerate(tables, 1):
        name, count = _own(table), 1
        while "name" not in table and name in taken_names:
            count += 1
            name = f"{_own(table)} {count}"
        taken_names.add(name)
        names.append(name)
        if name != _own(table):
            notes.append(f'part {number} is called "{name}": there is another "{_own(table)}"')
    return names, notes


def _parts(
    table: dict,
    number: int,
    name: str,
    path: Path,
    known_ids: tuple[str, ...] | None,
    say: Callable[[str], None] | None,
    unworn: str | None = None,
) -> Iterator[Part]:
    """Yield the parts of a table. unworn : name of a part whose material is never rendered."""
    where = _where("part", number, table)
    shape = table.get("shape")
    if (shape is None) == ("mesh" not in table):
        found = "neither" if shape is None else "both"
        raise InputError("a part is a shape or a mesh", file=path, field=where, found=found, expected="shape or mesh")
    if shape is not None and shape not in SHAPES:
        raise UnknownNameError("shape", str(shape), SHAPES, file=path, field=f"{where}.shape")
    options = SHAPES[shape] if shape is not None else {}
    got = taken(table, PART | options, path, where)
    foreign = {"material": "materials, one id a patch"} if shape == "patches" else {"materials": "material"}
    foreign = {} if shape is None else foreign
    if "materials" in got and isinstance(got["materials"], dict) == (shape is not None):
        expected = "material" if shape not in ("patches", None) else "a list of ids" if shape else "a table of ids"
        found = "a table" if shape is not None else "a list"
        raise InputError("not of this part", file=path, field=f"{where}.materials", found=found, expected=expected)
    if "materials" in got and "mesh_part" in got:
        hint = "leave mesh_part out: `materials` parts the mesh by itself"
        raise InputError(
            "both parts and materials", file=path, field=f"{where}.materials", found="mesh_part", hint=hint
        )
    if shape is not None:
        foreign |= dict.fromkeys(("mesh_part", "crease_deg"), "a mesh, not a shape")
    for field, right in foreign.items():
        if field in got:
            raise InputError("not a key of this part", file=path, field=f"{where}.{field}", expected=right)
    places = ("scale", "rotate_deg", "translate", "uv_scale", "uv_rotate_deg", "uv_size_mm")
    place = {key: got[key] for key in places if key in got}
    default = DEFAULT_MATERIAL if not known_ids or DEFAULT_MATERIAL in known_ids else known_ids[0]
    settings = {key: got[key] for key in options if key in got}
    if "uv" in options:
        # Parts can have a texture by default.
        settings.setdefault("uv", True)
    made: list[tuple[str, Mesh, str, dict[str, Any]]]
    with errors_at(path, where):
        if shape == "patches":
            ids = got.get("materials") or [default]
            chips = shapes.patches(len(ids), **settings)
            made = [(f"{name}/{k}", chip, id_, {}) for k, (chip, id_) in enumerate(zip(chips, ids, strict=True), 1)]
        elif shape is not None:
            _foretold(MeshCost(shapes.triangles(shape, **settings)), f"making {shape} {name!r}", path, say)
            made = [(name, getattr(shapes, shape)(**settings), got.get("material", default), {})]
        else:
            file = path.parent / got["mesh"]
            if file.is_file() and file.suffix.lower() in SUFFIXES:
                _foretold(file_cost(file), f"reading {file.name}", file, say)
            if "materials" in got:
                place_in = (got.get("material"), float(got.get("crease_deg", 40.0)), path, f"{where}.materials")
                worn = worn_meshes(file, got["materials"], *place_in)
                made = [(f"{name}/{piece}" if piece else name, mesh, id_, own) for piece, mesh, id_, own in worn]
            else:
                made = [(name, _file_mesh(file, got), got.get("material", default), {})]
    for part_name, mesh, material, own in made:
        if known_ids is not None and material not in known_ids and unworn not in (name, part_name):
            raise UnknownNameError("material", material, known_ids, file=path, field=f"{where}.material")
        with errors_at(path, where):
            # A piece's own texture size, in either key, replaces that of the whole part.
            sized = {"uv_scale", "uv_size_mm"}
            rest = {key: value for key, value in place.items() if not (sized & own.keys() and key in sized)}
            there = mesh.placed(**(rest | own))
        yield Part(part_name, there, material, static=bool(got.get("static", False)))


def _foretold(cost: MeshCost, what: str, place: Path, say: Callable[[str], None] | None) -> None:
    """Raise `InputError` for a mesh that does not fit into memory, and announce one that takes long."""
    cost.check_room(place)
    if say is not None and cost.seconds >= SAID_FROM_SECONDS:
        say(f"{what}: {cost.words}")


def _file_mesh(file: Path, got: Mapping[str, Any]) -> Mesh:
    return load_mesh(file, float(got.get("crease_deg", 40.0)), got.get("mesh_part"))


def _camera(table: dict, number: int, path: Path, low: np.ndarray, high: np.ndarray) -> Camera:
    where = _where("camera", number, table)
    got = taken(table, CAMERA, path, where)
    got.setdefault("name", f"camera {number}" if number > 1 else "camera")
    with errors_at(path, where):
        if "position" not in got:
            if "target" in got:
                hint = "give both, or neither for a camera that frames the scene"
                raise InputError("a target but no position", field="position", hint=hint)
            return framing_camera(low, high, **got)
        got.setdefault("target", 0.5 * (low + high))
        return Camera(**got).fitted(low, high)


def _viewing(table: dict, path: Path, illuminances: np.ndarray) -> Viewing:
    got = taken(table, VIEWING, path, "viewing")
    got.setdefault("reference_illuminance_lux", float(illuminances.sum()))
    if got.get("adaptation", "Bradford") not in CONE_FROM_XYZ:
        raise UnknownNameError("adaptation", got["adaptation"], CONE_FROM_XYZ, file=path, field="viewing.adaptation")
    # Files are relative to the scene's folder, as everywhere.
    if "://" not in (config := got.get("ocio_config", "://")):
        got["ocio_config"] = str(path.parent / config)
    if (display := got.get("display", "")).startswith(PREFIX) and display != SCREEN:
        got["display"] = f"{PREFIX}{path.parent / display.removeprefix(PREFIX)}"
    with errors_at(path, "viewing"):
        return Viewing(**got)


def _review(table: dict, path: Path, parts: list[str], shared: Set[str], known_ids: tuple[str, ...] | None) -> Review:
    """Read the review table. shared : names that several parts would have without numbers."""
    got = taken(table, REVIEW, path, "review")
    on = got.get("on", parts[0])
    if "on" in got and on.partition("/")[0] in shared:
        raise InputError(
            "several parts are called so",
            file=path,
            field="review.on",
            found=on,
            expected="one of them",
            hint="give the part that is meant a `name`, and name it here",
        )
    if on not in parts:
        raise UnknownNameError("part", on, parts, file=path, field="review.on")
    review = Review(on, **{key: tuple(got[key]) for key in ("materials", "illuminants") if key in got})
    with errors_at(path, "review.illuminants"):
        for name in review.illuminants:
            illuminant(name)
    for pattern in review.materials:
        if known_ids is not None and not any(fnmatchcase(id_, pattern) for id_ in known_ids):
            raise UnknownNameError("material", pattern, known_ids, file=path, field="review.materials")
    return review


def _where(kind: str, number: int, table: Mapping[str, Any]) -> str:
    name = table.get("name")
    return f"{kind} {number} ({name})" if isinstance(name, str) else f"{kind} {number}"


def shipped_scene(name: str = "sphere") -> Path:
    """Return the path of a scene shipped with Metamer, for `load_scene`; raises `UnknownNameError` with the existing
    ones.

    >>> shipped_scene("speed_shape").name
    'speed_shape.toml'
    """
    path = Path(str(files("metamer.examples"))) / f"{name}.toml"
    if not path.is_file():
        raise UnknownNameError("scene", name, sorted(scene.stem for scene in path.parent.glob("*.toml")))
    return path
