"""One material on disk: a self-contained HDF5 file with the original data, the factor packs and their measured error.

Layout (schema 1), read back in five lines of h5py (docs/catalogue.md):

    /                    attributes format, schema, id, family, model, source_hash, checksum
    /provenance          attributes source, licence, geometry, kind, notes
    /parameters/NAME     what `model` is rebuilt from; text is an attribute of /parameters
    /packs/K             attributes frame, basis; spectral (R,J), wavelengths_nm (L,) [, analysis, synthesis (L,J)]
                         [, excitation_nm (Li,), donaldson (L,Li)]: a fluorescent surface, J = 1
    /packs/K/axes/NAME   attributes position, maximum, warp, periodic; factor (n,R), nodes (n,) in radians
    /error               attributes of `FitError`
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..spectral.basis import SpectralBasis
from ..spectral.bispectral import Bispectral
from ..spectral.errors import InputError, UnknownNameError
from ..spectral.files import made_folder, written_whole
from ..spectral.fluorescent_basis import FluorescentBasis
from .brdf import Brdf
from .factors import Axis, FactorPack, FitError

if TYPE_CHECKING:
    from .analytic.model import AnalyticBrdf

FORMAT = "metamer-material"
SCHEMA = 1
SUFFIX = ".h5"
# What makes a folder a catalogue.
MARKER = "catalogue.toml"


@dataclass(frozen=True)
class Provenance:
    """Where a material's numbers come from.

    kind : "measured" (the directional data were), "analytic" (a model carries published spectra or optical constants)
    or "uplifted(METHOD)" (spectra were made up from tristimulus values: never colour-critical).
    geometry : of the measurement, such as "45:0"; "" where it does not apply or is not stated.
    """

    source: str
    licence: str
    kind: str
    geometry: str = ""
    notes: str = ""

    def __post_init__(self) -> None:
        known = self.kind in ("measured", "analytic") or (self.kind.startswith("uplifted(") and self.kind.endswith(")"))
        if not known:
            expected = "measured, analytic or uplifted(METHOD)"
            raise InputError("unknown kind of provenance", field="kind", found=repr(self.kind), expected=expected)
        for field in ("source", "licence"):
            if not getattr(self, field).strip():
                raise InputError("provenance is incomplete", field=field, found="nothing", expected="a sentence")


@dataclass(frozen=True)
class MaterialRecord:
    """What a catalogue stores of a material.

    Attributes
    ----------
    id : "family/name" in lower case, the file's path in its catalogue.
    model : NAME of the original BRDF's class; `parameters` is what it is rebuilt from (arrays, numbers, text), with
        `wavelengths_nm` among them.
    packs : the factored form, in the basis "sampled" on the working wavelengths (nothing spectral is lost).
    error : measured difference between the two, and how it was measured.
    source_hash : SHA-256 of the source data and of the settings of the fit; a re-import compares it.
    """

    id: str
    family: str
    model: str
    parameters: Mapping[str, Any]
    provenance: Provenance
    packs: tuple[FactorPack, ...]
    error: FitError | None
    source_hash: str = ""

    def brdf(self) -> Brdf:
        """The original BRDF, at every wavelength: the truth that `packs` stand for."""
        return rebuild(self.model, self.parameters)


def model_named(name: str, file: Path | None = None, field: str | None = "model") -> type[AnalyticBrdf]:
    """The analytic model of that NAME; raises `UnknownNameError` where this version has none."""
    from .analytic import MODELS

    models = {model.NAME: model for model in MODELS}
    if name not in models:
        raise UnknownNameError("model", name, models, file=file, field=field)
    return models[name]


def rebuild(model: str, parameters: Mapping[str, Any]) -> Brdf:
    """The BRDF that a record's `model` and `parameters` stand for."""
    if model == "scattered":
        from .scattered import ScatteredBrdf

        return ScatteredBrdf.from_parameters(parameters)
    if model == "merl":
        from .merl import MerlBrdf

        return MerlBrdf.from_parameters(parameters)
    if model == "rgl":
        from .rgl import RglBrdf

        return RglBrdf.from_parameters(parameters)
    if model == "fluorescent_lambert":
        from .fluorescent import FluorescentLambert

        return FluorescentLambert.from_parameters(parameters)
    rest = dict(parameters)
    return model_named(model).from_parameters(rest.pop("wavelengths_nm"), rest)


def slug(name: str) -> str:
    """A name fit for an id: "5R 4/14" -> "5r-4-14"."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def write_record(record: MaterialRecord, path: Path) -> None:
    """Write `record` beside `path`, flush it to the disk and rename it: a reader never meets half a file."""
    import h5py

    made_folder(path.parent)
    try:
        with written_whole(path) as beside:
            with h5py.File(beside, "w") as file:
                _fill(file, record)
                file.attrs["checksum"] = _checksum(file)
            with beside.open("rb") as file:
                os.fsync(file.fileno())
    except OSError as reason:
        raise InputError("cannot write the material", file=path, found=reason.strerror or str(reason)) from None


def read_record(path: Path) -> MaterialRecord:
    """The record in `path`; raises `InputError` naming a file that is not one, is damaged or is of another version."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            _check(file, path)
            return _record(file)
    except FileNotFoundError:
        raise InputError("no such file", file=path) from None
    except (OSError, KeyError, ValueError, TypeError, RuntimeError) as reason:
        raise damaged(path, str(reason)) from None


def read_source_hash(path: Path) -> str | None:
    """`source_hash` of the record in `path`, or None where there is none that can be read in full."""
    try:
        return read_record(path).source_hash
    except InputError:
        return None


def damaged(path: Path, reason: str) -> InputError:
    """The refusal of a file that cannot be read."""
    hint = "import the material again: metamer catalogue import"
    return InputError(
        "not a readable material file", file=path, found=reason.split("\n")[0], expected="HDF5", hint=hint
    )


def _fill(file: Any, record: MaterialRecord) -> None:
    file.attrs.update(format=FORMAT, schema=SCHEMA, id=record.id, family=record.family, model=record.model)
    file.attrs["source_hash"] = record.source_hash
    file.create_group("provenance").attrs.update(dataclasses.asdict(record.provenance))
    parameters = file.create_group("parameters")
    for name, value in record.parameters.items():
        if isinstance(value, str):
            parameters.attrs[name] = value
        else:
            _dataset(parameters, name, value)
    for index, pack in enumerate(record.packs):
        group = file.create_group(f"packs/{index}")
        group.attrs.update(frame=pack.frame, basis=pack.basis.name)
        _dataset(group, "spectral", pack.spectral)
        _dataset(group, "wavelengths_nm", pack.basis.wavelengths_nm)
        if isinstance(pack.basis, FluorescentBasis):
            _dataset(group, "excitation_nm", pack.basis.bispectral.wavelengths_in_nm)
            _dataset(group, "donaldson", pack.basis.bispectral.matrix)
        elif not pack.basis.is_sampled:
            _dataset(group, "analysis", pack.basis.analysis)
            _dataset(group, "synthesis", pack.basis.synthesis)
        for position, (axis, factor) in enumerate(zip(pack.axes, pack.factors, strict=True)):
            place = group.create_group(f"axes/{axis.name}")
            place.attrs.update(position=position, maximum=axis.maximum, warp=axis.warp, periodic=axis.periodic)
            _dataset(place, "factor", factor)
            _dataset(place, "nodes", axis.nodes)
    if record.error is not None:
        file.create_group("error").attrs.update(dataclasses.asdict(record.error))


def _dataset(group: Any, name: str, value: Any) -> None:
    array = np.asarray(value)
    if array.dtype.kind not in "fiub":
        raise InputError("cannot be stored", field=name, found=f"{array.dtype} values", expected="numbers or text")
    # Lossless, and only where it pays: HDF5 cannot compress a scalar and a few numbers only grow.
    options = {"compression": "gzip", "shuffle": True} if array.size > 256 else {}
    group.create_dataset(name, data=array, **options)


def _check(file: Any, path: Path) -> None:
    if file.attrs.get("format") != FORMAT:
        raise InputError(
            "not a material file", file=path, field="format", found=file.attrs.get("format"), expected=FORMAT
        )
    if file.attrs["schema"] != SCHEMA:
        raise InputError(
            "written by another version",
            file=path,
            field="schema",
            found=file.attrs["schema"],
            expected=str(SCHEMA),
            hint="import the material again, or upgrade metamer",
        )
    found = _checksum(file)
    if found != file.attrs["checksum"]:
        raise InputError(
            "content has changed since it was written",
            file=path,
            field="checksum",
            found=found,
            expected=str(file.attrs["checksum"]),
            hint="import the material again: metamer catalogue import",
        )


def _record(file: Any) -> MaterialRecord:
    error = FitError(**_attributes(file["error"])) if "error" in file else None
    parameters: dict[str, Any] = _attributes(file["parameters"])
    parameters |= {name: data[()] if data.shape else data[()].item() for name, data in file["parameters"].items()}
    count = len(file["packs"]) if "packs" in file else 0
    return MaterialRecord(
        id=file.attrs["id"],
        family=file.attrs["family"],
        model=file.attrs["model"],
        parameters=parameters,
        provenance=Provenance(**_attributes(file["provenance"])),
        packs=tuple(_pack(file[f"packs/{index}"], error) for index in range(count)),
        error=error,
        source_hash=file.attrs["source_hash"],
    )


def _pack(group: Any, error: FitError | None) -> FactorPack:
    wavelengths_nm = group["wavelengths_nm"][()]
    kind = FactorPack
    if "donaldson" in group:
        from .fluorescent import FluorescentPack as kind

        surface = Bispectral(group["excitation_nm"][()], wavelengths_nm, group["donaldson"][()])
        basis = FluorescentBasis.of(surface)
    elif "analysis" in group:
        basis = SpectralBasis(group.attrs["basis"], wavelengths_nm, group["analysis"][()], group["synthesis"][()])
    else:
        basis = SpectralBasis.sampled(wavelengths_nm)
    places = sorted(group["axes"].items(), key=lambda place: place[1].attrs["position"])
    factors = tuple(place["factor"][()] for _, place in places)
    axes = tuple(
        Axis(name, len(factor), float(at.attrs["maximum"]), at.attrs["warp"], bool(at.attrs["periodic"]))
        for (name, at), factor in zip(places, factors, strict=True)
    )
    return kind(group.attrs["frame"], axes, factors, group["spectral"][()], basis, error)


def _attributes(node: Any) -> dict[str, Any]:
    return {name: _plain(value) for name, value in node.attrs.items()}


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _checksum(file: Any) -> str:
    """SHA-256 of every attribute and every value in the order of their names; independent of HDF5's own layout."""
    digest = hashlib.sha256()

    def add(name: str, node: Any) -> None:
        for key in sorted(node.attrs):
            if (name, key) != ("", "checksum"):
                digest.update(f"{name}@{key}={_plain(node.attrs[key])!r}\n".encode())
        if hasattr(node, "shape"):
            values = node[()]
            digest.update(f"{name}:{node.shape}:{node.dtype}\n".encode() + np.ascontiguousarray(values).tobytes())

    nodes: list[str] = []
    file.visit(nodes.append)
    add("", file)
    for name in sorted(nodes):
        add(name, file[name])
    return digest.hexdigest()
