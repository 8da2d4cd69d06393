"""One material on disk: a self-contained HDF5 file with the original data, the fast form and its measured error.

Layout (schema 2), read back in five lines of h5py (docs/catalogue.md):

    up to a line feed    the head: JSON, see `record_head`
    /                    attributes format, schema, id, family, model, source_hash, checksum
    /provenance          attributes source, licence, geometry, kind, notes
    /parameters/NAME     what `model` is rebuilt from; text is an attribute of /parameters
    /original/NAME       the measurement as it came; text is an attribute of /original
    .../NAME/values      of a large array, its chunks the blocks of `stored_array`; or, where it stays in another file,
                         attributes file, file_size, place, shape, dtype of /parameters/NAME or /original/NAME
    .../NAME/digests     SHA-256 of each block (n,32), uint8
    /packs/K             attributes frame, basis, precision; spectral (R,J), wavelengths_nm (L,)
                         [, analysis, synthesis (L,J)]
                         [, excitation_nm (Li,), donaldson (L,Li)]: a fluorescent surface, J = 1
    /packs/K/axes/NAME   attributes position, maximum, warp, periodic; factor (n,R), nodes (n,) in radians;
                         factors of precision "half" are float16
    /FORM                in place of packs, what another fast form keeps (`FORMS`), such as /texture
    /error               attributes of `FitError`; lights, a row a light
    /trials              a table (N,): what the fit tried, one column a field of `Trial`

A record of few numbers has all of this as text in the data set `packed` (`hdf5_file`).
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from ...runtime.errors import InputError
from ...runtime.files import made_folder, written_whole
from ..btf.form import BtfForm, FieldForm
from ..core.fast import Fast
from ..core.fit_error import FitError
from ..factored.pack import FactoredBrdf
from ..svbrdf.maps_form import MapsForm
from ..svbrdf.texture_form import TextureForm
from .hdf5_file import read_behind, write_behind
from .hdf5_tree import Node, form_from, form_node, mapping_from, mapping_node, tree_checksum
from .material import MaterialRecord, Provenance
from .record_head import (
    FORMAT,
    IMPORT_AGAIN,
    NAME_A_MATERIAL,
    SCHEMA,
    check_head,
    head_bytes,
    head_of,
    no_such_file,
    other_schema,
    read_head,
)
from .stored_array import StoredArray
from .trial_table import lights_from, trial_table, trials_from

SUFFIX = ".h5"
# File that makes a folder a catalogue.
MARKER = "catalogue.toml"

#: The fast forms that a record may hold, by the group of the file that they lie in.
FORMS: dict[str, type[Fast]] = {form.NAME: form for form in (FactoredBrdf, TextureForm, MapsForm, BtfForm, FieldForm)}


def material_path(folder: Path, material_id: str) -> Path:
    """Return the path of a material in a catalogue."""
    return folder / f"{material_id}{SUFFIX}"


def check_id(material_id: object) -> None:
    """Raise an `InputError` where an id is not "family/name", of parts that are no hidden files."""
    parts = material_id.split("/") if isinstance(material_id, str) else []
    if len(parts) < 2 or not all(part and not part.startswith(".") for part in parts):
        hint = f"such as script/{material_id}" if len(parts) == 1 and parts[0].strip(".") else None
        raise InputError("not an id of a material", field="id", found=material_id, expected="family/name", hint=hint)


def write_marker(folder: Path) -> None:
    """Make an empty folder a catalogue."""
    with written_whole(folder / MARKER) as beside:
        beside.write_text(f"# One HDF5 file a material; read it with metamer, or with h5py.\nschema = {SCHEMA}\n")


def check_marker(folder: Path) -> None:
    """Raise `InputError` if the catalogue in `folder` has a schema that this version does not know."""
    try:
        schema = tomllib.loads((folder / MARKER).read_text(encoding="utf-8")).get("schema")
    except FileNotFoundError:
        hint = "name the folder that an import has made: metamer catalogue import --catalogue FOLDER"
        expected = f"a folder that holds {MARKER}"
        raise InputError("not a catalogue", file=folder, expected=expected, hint=hint) from None
    except (OSError, ValueError) as reason:
        found, hint = str(reason), "import into a new folder: metamer catalogue import SOURCE --catalogue FOLDER"
        raise InputError(
            "the catalogue's own file cannot be read", file=folder / MARKER, found=found, hint=hint
        ) from None
    if schema not in (None, SCHEMA):
        hint = "use the metamer that made it, or import into a new folder: --catalogue FOLDER"
        expected = f"schema = {SCHEMA}"
        raise InputError(
            "a catalogue of another schema", file=folder / MARKER, found=schema, expected=expected, hint=hint
        )


def write_record(record: MaterialRecord, path: Path, *, copy: bool = True) -> None:
    """Write `record` beside `path`, flush it to the disk and rename it, so that readers never see half a file.

    copy : write large arrays of other files (`StoredArray`), too; else the record refers to them by place and digests.

    Raises
    ------
    InputError : something in the record cannot be stored, or the folder cannot be written to or has no room.
    """
    if not record.is_surface and record.measured_spectrum() is None:
        expected = "wavelengths_nm (L,) and values (L,)"
        raise InputError("a spectrum without samples", file=path, field="original", expected=expected)
    made_folder(path.parent)
    tree = _tree(record, copy)
    checksum = tree.attributes["checksum"] = tree_checksum(tree)
    head = head_bytes(head_of(record, checksum), path)
    try:
        with written_whole(path) as beside:
            write_behind(head, tree, beside)
    except OSError as reason:
        raise InputError("cannot write the material", file=path, found=reason.strerror or str(reason)) from None


def read_record(path: Path, *, check_colour: bool = False) -> MaterialRecord:
    """Return the record in `path`; raises `InputError` naming a file that is none, is damaged or of another version.

    Large arrays are left where they are, as `StoredArray`: each block is checked when it is read.

    check_colour : also verify the colour in the head, which takes longer than all else.
    """
    try:
        tree = read_behind(path, partial(_check_version, path=path))
        checksum = _checked(tree, path)
        record = _record(tree, path)
    except FileNotFoundError:
        raise no_such_file(path) from None
    except (OSError, KeyError, ValueError, TypeError, RuntimeError) as reason:
        raise damaged(path, str(reason)) from None
    check_head(read_head(path), record, checksum, path, check_colour)
    return record


def stored_arrays(record: MaterialRecord) -> tuple[StoredArray, ...]:
    """Return the large arrays of a record, which stay in their files on reading."""
    values = (*record.parameters.values(), *record.original.values())
    return tuple(value for value in values if isinstance(value, StoredArray))


def check_large(record: MaterialRecord, path: Path, heard: Callable[[int], None] = lambda read: None) -> None:
    """Verify the large arrays in a record's own file, `path`, and the existence of other files with such arrays.

    Raises `InputError` for a changed block, or a missing file. heard : receives the bytes read.
    """
    for array in stored_arrays(record):
        if array.file == path.absolute():
            replace(array, heard=heard).check()
        else:
            array.check_is_there()


def damaged(path: Path, reason: str) -> InputError:
    """Return the refusal of a file that cannot be read."""
    found = reason.split("\n")[0]
    return InputError("not a readable material file", file=path, found=found, expected="HDF5", hint=IMPORT_AGAIN)


def _check_version(attributes: Mapping[str, Any], path: Path) -> None:
    if attributes.get("format") != FORMAT:
        raise InputError(
            "not a material file",
            file=path,
            field="format",
            found=attributes.get("format"),
            expected=FORMAT,
            hint=NAME_A_MATERIAL,
        )
    if attributes["schema"] != SCHEMA:
        raise other_schema(path, attributes["schema"])


def _checked(tree: Node, path: Path) -> str:
    found = tree_checksum(tree)
    if found != tree.attributes["checksum"]:
        raise InputError(
            "content has changed since it was written",
            file=path,
            field="checksum",
            found=found,
            expected=str(tree.attributes["checksum"]),
            hint=IMPORT_AGAIN,
        )
    return found


def _tree(record: MaterialRecord, copy: bool) -> Node:
    tree = Node(
        {
            "format": FORMAT,
            "schema": SCHEMA,
            "id": record.id,
            "family": record.family,
            "model": record.model,
            "source_hash": record.source_hash,
        }
    )
    tree.children["provenance"] = mapping_node(dataclasses.asdict(record.provenance))
    tree.children["parameters"] = mapping_node(record.parameters, copy)
    tree.children["original"] = mapping_node(record.original, copy)
    # A record without a fast form has an empty group of packs.
    form, kept = ("packs", {}) if record.fast is None else (record.fast.NAME, record.fast.stored())
    tree.children[form] = form_node(kept)
    if record.error is not None:
        tree.children["error"] = _error_node(record.error)
    if record.trials:
        tree.children["trials"] = Node(value=trial_table(record.trials))
    return tree


def _record(tree: Node, path: Path) -> MaterialRecord:
    error = _error(tree["error"]) if "error" in tree.children else None
    form = next((name for name in FORMS if name in tree.children), None)
    if form is None:
        raise KeyError(f"no fast form of this version: {', '.join(FORMS)}")
    kept = form_from(tree[form])
    try:
        fast = FORMS[form].from_stored(kept, error) if kept else None
    except (LookupError, TypeError, ValueError):
        # The checksum holds: it is what was written, by a version whose form had other parts.
        words = "a fast form of another version, or of none"
        raise InputError(
            words,
            file=path,
            field=form,
            found=", ".join(kept),
            expected="parts that this version writes",
            hint=IMPORT_AGAIN,
        ) from None
    return MaterialRecord(
        id=tree.attributes["id"],
        family=tree.attributes["family"],
        model=tree.attributes["model"],
        parameters=mapping_from(tree["parameters"]),
        provenance=Provenance(**tree["provenance"].attributes),
        fast=fast,
        source_hash=tree.attributes["source_hash"],
        original=mapping_from(tree["original"]),
        trials=trials_from(tree["trials"].array) if "trials" in tree.children else (),
    )


def _error_node(error: FitError) -> Node:
    figures = {name: value for name, value in vars(error).items() if name != "lights" and value is not None}
    node = Node(figures)
    if error.lights:
        node.children["lights"] = Node(value=trial_table(error.lights))
    return node


def _error(node: Node) -> FitError:
    lights = lights_from(node["lights"].array) if "lights" in node.children else ()
    return FitError(**node.attributes, lights=lights)
