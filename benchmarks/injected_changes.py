"""Changes of known kind and size put into the shipped review: which `metamer report` finds, and which it claims.

The review of `examples/sphere.toml` is recorded as a baseline and rendered again after each change, as `metamer report
run` does: materials whose data were edited are fitted anew, a light is turned in the scene's file, an observer is
swapped in the suite. What no file says, a wrong pixel and a drift, is put into the pictures. Every row is then held
against what single precision shows of it: none may have moved beyond its stated floor and be called the same.
"""

from __future__ import annotations

import importlib.util
import re
import shutil
import tempfile
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ..calibration.regression.baseline import as_recorded, baseline_side, record
from ..calibration.regression.change import change
from ..calibration.regression.comparison import compare
from ..calibration.regression.criteria import default_criteria
from ..calibration.regression.result import Result, RowResult
from ..calibration.regression.row import ComparedSide, LayerKind, PixelLayer, Pixels, Row, RowName
from ..calibration.regression.row_pictures import srgb
from ..calibration.regression.suite import read_suite
from ..calibration.report.text_tables import columns
from ..lighting.scene_file.files import shipped_scene
from ..materials.catalogue.catalogue import Catalogue
from ..materials.catalogue.material import Material
from ..materials.intake.work import fit_material
from ..materials.records.material import MaterialRecord
from ..materials.records.record import MARKER, material_path, write_record
from ..materials.records.source import MaterialSource
from ..runtime.errors import ComparisonError, InputError
from ..runtime.worker_pool import in_order, usable_cores
from ..spectral.difference import lab_from_xyz, xyz_from_lab
from ..spectral.formula import Formula
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from ..viewer.software.backend import software_session
from ..viewer.suite_run import environment, run_suite
from .flip import flip
from .timing import command, write_json

# ΔE94 that edited materials are fitted to, as an import does.
_FITTED_TO = 0.5
_BAND_NM = 600.0
# By how much a metamer is moved, where it stays between 0 and 1.
_METAMER = 0.05
_TURN_DEG = 0.5
_94 = Formula("CIE 1994")

Parameters = Mapping[str, Any]


@dataclass(frozen=True)
class Place:
    """Folders of the benchmark, and its materials that fit `pattern`, `size` pixels wide."""

    folder: Path
    catalogue: Catalogue
    pattern: str
    size: int
    jobs: int


def run(catalogue: Path | None = None, pattern: str = "*", size: int = 64, jobs: int = 1) -> dict:
    """Return each change over all materials that fit.

    Returns
    -------
    dict for JSON: `materials`, `size`, and `rows` of `change`, `rows` (whose material was changed), `found` (called
    changed), `below` (called the same: what moved lies below the stated floor), `missed` (called the same though single
    precision shows more than the floor), `alarms` (warned or failed), `size` and `floor` (the median over rows of the
    largest layer's mean ΔE94, in single precision, and of its stated floor), `flip` (of FLIP as an sRGB display
    shows it, None without the extra `flip`), or `refused`.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Place(Path(folder), Catalogue.open(catalogue), pattern, size, jobs)
        exact = _rendered(place, "before", place.catalogue)
        record(exact, place.folder / "baseline", {"name": "Shipped"}, environment())
        before = baseline_side(place.folder / "baseline")
        rows = [_row("nothing", before, exact, _rendered(place, "again", place.catalogue))]
        for number, (name, edit) in enumerate(_EDITS.items()):
            edited, ids = _edited(place, f"edited{number}", edit)
            rows.append(_row(name, before, exact, _rendered(place, f"of{number}", edited), ids))
        turned = _rendered(place, "turned", place.catalogue, turn_deg=_TURN_DEG)
        rows.append(_row(f"light turned by {_TURN_DEG:g} degrees", before, exact, turned))
        rows += [_row(name, before, exact, _altered(exact, into)) for name, into in _INTO_PICTURES.items()]
        swapped = _rendered(place, "swapped", place.catalogue, eye="1964_10")
        rows.append(_row("observer swapped", before, exact, swapped))
        unsaid = replace(swapped, rows=tuple(_named_as(a, b) for a, b in zip(swapped.rows, exact.rows, strict=True)))
        rows.append(_row("observer swapped, and not said", before, exact, unsaid))
    return {"materials": len({one.name.material for one in exact.rows}), "size": size, "rows": rows}


def report(figures: dict) -> str:
    """Return the figures as a table."""
    counts, ends = ("rows", "found", "below", "missed", "alarms"), ("size", "floor", "flip")
    body = [
        [row["change"], f"refused: {row['refused']}", *[""] * 7]
        if "refused" in row
        else [row["change"], *(str(row[key]) for key in counts), *(_short(row[key]) for key in ends)]
        for row in figures["rows"]
    ]
    headings = ["change", "rows", "found", "below the floor", "missed", "alarms", "mean ΔE94", "floor", "FLIP"]
    return f"{figures['materials']} materials, {figures['size']} pixels wide\n{columns(headings, body)}"


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.2g}"


def _rendered(
    place: Place, name: str, catalogue: Catalogue, turn_deg: float = 0.0, eye: str = "1931_2"
) -> ComparedSide:
    """Return the shipped review as a suite, rendered."""
    folder = place.folder / name
    suite = shipped_suite(folder, place.pattern, place.size, turn_deg, eye)
    with software_session() as renderer:
        return run_suite(read_suite(suite), catalogue, folder / "out", renderer, jobs=place.jobs)


def shipped_suite(folder: Path, pattern: str, size: int, turn_deg: float = 0.0, eye: str = "1931_2") -> Path:
    """Return the suite of the shipped review, written into a new folder: of the materials that fit, `size` pixels
    wide."""
    folder.mkdir()
    (folder / "scene.toml").write_text(_scene(size, turn_deg), encoding="utf-8")
    words = f'name = "Shipped"\nscenes = ["scene.toml"]\nmaterials = ["{pattern}"]\nobservers = ["{eye}"]\n'
    suite = folder / "suite.toml"
    suite.write_text(f"[suite]\n{words}", encoding="utf-8")
    return suite


def _scene(size: int, turn_deg: float) -> str:
    text = shipped_scene().read_text(encoding="utf-8")
    (light,) = tomllib.loads(text)["light"]
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turned = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ light["direction_to_light"]
    text = re.sub(r"direction_to_light = \[.*\]", f"direction_to_light = {turned.tolist()}", text)
    return re.sub(r"^(width|height_px) = \d+$", rf"\1 = {size}", text, flags=re.MULTILINE)


def _edited(
    place: Place, name: str, edit: Callable[[Parameters], Parameters | None]
) -> tuple[Catalogue, frozenset[str]]:
    """Return a catalogue of edited materials, fitted anew, and which; what cannot be edited so is there as it was."""
    folder = place.folder / name
    folder.mkdir()
    shutil.copyfile(place.catalogue.folder / MARKER, folder / MARKER)
    sources = []
    for material in place.catalogue.match_surfaces(place.pattern):
        one = place.catalogue.load(material)
        path = material_path(folder, material)
        path.parent.mkdir(exist_ok=True)
        parameters = edit(one.parameters)
        if parameters is None:
            shutil.copyfile(place.catalogue.path(material), path)
        else:
            sources.append(_source(one, parameters))
    fits = in_order(fit_material, [(source, _FITTED_TO) for source in sources], place.jobs)
    for source, fitted in zip(sources, fits, strict=True):
        if fitted.fast is None:
            raise InputError("could not be fitted", field=source.id, found=fitted.reason)
        made = MaterialRecord(source.id, source.family, source.model, source.parameters, source.provenance, fitted.fast)
        write_record(made, material_path(folder, source.id))
    return Catalogue.open(folder), frozenset(source.id for source in sources)


def _source(one: Material, parameters: Parameters) -> MaterialSource:
    return MaterialSource(one.id, one.family, one.model, parameters, one.provenance, Path(one.id))


def _one_band(parameters: Parameters) -> Parameters:
    """Return every curve of a formula, 1 % more at one of its wavelengths."""
    band = int(np.argmin(np.abs(parameters["wavelengths_nm"] - _BAND_NM)))
    factor = np.ones(len(parameters["wavelengths_nm"]))
    factor[band] = 1.01
    curves = {name: factor * value for name, value in parameters.items() if _is_curve(name, value)}
    return {**parameters, **curves}


def _metamer(parameters: Parameters) -> Parameters | None:
    """Return a body colour of the same XYZ under D65 for the CIE 1931 observer, moved in what none of its weights
    sees."""
    name = next((one for one in ("reflectance", "diffuse") if np.any(parameters.get(one, 0.0))), None)
    if name is None:
        return None
    nm, curve = parameters["wavelengths_nm"], np.asarray(parameters[name])
    weights = observer("1931_2").weights(illuminant("D65"), nm)
    wish = np.cos(np.linspace(0.0, 14.0, curve.size))
    unseen = wish - weights.T @ np.linalg.solve(weights @ weights.T, weights @ wish)
    unseen /= np.abs(unseen).max()
    up, down = unseen > 0, unseen < 0
    room = np.concatenate([(0.99 - curve[up]) / unseen[up], curve[down] / -unseen[down]])
    return {**parameters, name: curve + min(_METAMER, float(room.min())) * unseen}


def _is_curve(name: str, value: Any) -> bool:
    return name != "wavelengths_nm" and isinstance(value, np.ndarray) and value.ndim == 1


# Edits of the data of materials by name; None for materials without what is edited.
_EDITS: Mapping[str, Callable[[Parameters], Parameters | None]] = {
    f"1 % of one band, {_BAND_NM:g} nm": _one_band,
    "a metamer under D65": _metamer,
}


def _altered(side: ComparedSide, into: Callable[[Float[np.ndarray, "H W 3"]], None]) -> ComparedSide:
    """Return a side whose pictures' CIELAB is changed as they are loaded; its references are not."""

    def changed(layer: PixelLayer) -> Pixels:
        pixels = layer.load()
        lab = lab_from_xyz(pixels.xyz, pixels.white_xyz)
        into(lab)
        return replace(pixels, xyz=xyz_from_lab(lab, pixels.white_xyz).astype(pixels.xyz.dtype))

    def held(kind: LayerKind, layer: PixelLayer) -> PixelLayer:
        # Without their file, which is on the other side too: what is compared is what is changed here.
        return replace(layer, file=None, load=(lambda: changed(layer)) if kind == "picture" else layer.load)

    rows = tuple(
        replace(row, layers={kind: held(kind, layer) for kind, layer in row.layers.items()}) for row in side.rows
    )
    return replace(side, path=side.path / "altered", rows=rows)


def _raised(by: float, one_pixel: bool) -> Callable[[Float[np.ndarray, "H W 3"]], None]:
    """L* raised in all pixels, or in the one in the middle: ΔE94 is as much."""

    def into(lab: Float[np.ndarray, "H W 3"]) -> None:
        middle = tuple(length // 2 for length in lab.shape[:2])
        lab[(*middle, 0) if one_pixel else (..., 0)] += by

    return into


_INTO_PICTURES = {
    "one wrong pixel, ΔE94 5": _raised(5.0, True),
    "one wrong pixel, ΔE94 0.05": _raised(0.05, True),
    "a drift of ΔE94 0.2": _raised(0.2, False),
    "a drift of ΔE94 0.01": _raised(0.01, False),
}


def _named_as(row: Row, other: Row) -> Row:
    return replace(row, name=other.name)


def _row(
    name: str, before: ComparedSide, exact: ComparedSide, after: ComparedSide, ids: frozenset[str] | None = None
) -> dict:
    """One line: what the comparison with the baseline says, beside what single precision shows."""
    try:
        result = compare(before, as_recorded(after), default_criteria())
    except ComparisonError as reason:
        return {"change": name, "refused": str(reason).splitlines()[0].rpartition(": ")[2]}
    chosen = [row for row in result.rows if ids is None or row.name.material in ids]
    shown = _shown(exact, after)
    called = [row.state not in ("same", "identical") for row in chosen]
    beyond = [_beyond(row, shown[row.name]) for row in chosen]
    sizes = [max(mean for mean, *_ in shown[row.name].values()) for row in chosen]
    flips = [flip for row in chosen for _, _, flip in shown[row.name].values() if flip is not None]
    return {
        "change": name,
        "rows": len(chosen),
        "found": sum(called),
        "below": sum(row.state == "same" for row in chosen),
        "missed": sum(more and not found for found, more in zip(called, beyond, strict=True)),
        "alarms": _alarms(result, chosen),
        "size": float(np.median(sizes)),
        "floor": float(np.median([max(one.floor_mean for one in row.layers.values()) for row in chosen])),
        "flip": float(np.median(flips)) if flips else None,
    }


def _alarms(result: Result, rows: Sequence[RowResult]) -> int:
    """Rows that warned or failed; all of them where the comparison found none of what it puts in itself."""
    return sum(row.tier != "pass" for row in rows) if result.valid else len(rows)


#: Mean and largest ΔE94 of a layer, and mean FLIP.
Figures = tuple[float, float, float | None]


def _shown(exact: ComparedSide, after: ComparedSide) -> dict[RowName, dict[LayerKind, Figures]]:
    """Compute what each layer shows between the two in single precision, before a baseline rounds them."""
    now = {row.name: row for row in after.rows}
    found: dict[RowName, dict[LayerKind, Figures]] = {}
    for row in exact.rows:
        found[row.name] = {}
        for kind, layer in row.layers.items():
            pair = layer.load(), now[row.name].layers[kind].load()
            moved = change(*pair, (_94,), str(row.name), rounding=False).maps[_94.name]
            values = moved[~np.isnan(moved)]
            found[row.name][kind] = float(values.mean(dtype=np.float64)), float(values.max()), _flip(*pair)
    return found


def _flip(before: Pixels, after: Pixels) -> float | None:
    """Mean FLIP of both as an sRGB display shows them, eight bits and all."""
    if importlib.util.find_spec("flip_evaluator") is None:
        return None
    reference, sample = (srgb(one)[0].astype(np.float32) / np.float32(255.0) for one in (before, after))
    return float(flip(reference, sample).mean())


def _beyond(row: RowResult, shown: Mapping[LayerKind, Figures]) -> bool:
    """Return whether a layer moved by more than twice what the row says that rounding may hide: it should have been
    found.
    """
    return any(
        mean > 2.0 * row.layers[kind].floor_mean or most > 2.0 * row.layers[kind].floor_max
        for kind, (mean, most, _) in shown.items()
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = command(__doc__)
    parser.add_argument("--catalogue", type=Path, metavar="CAT", help="default: as everywhere")
    parser.add_argument("--materials", default="*", metavar="PATTERN", help="default: all")
    parser.add_argument("--size", type=int, default=64, metavar="PX", help="width of the pictures (64)")
    parser.add_argument("--jobs", type=int, default=usable_cores(), metavar="N", help="default: one a core")
    args = parser.parse_args(arguments)
    figures = run(args.catalogue, args.materials, args.size, args.jobs)
    print(report(figures))
    write_json(args.json, figures)


if __name__ == "__main__":
    main()
