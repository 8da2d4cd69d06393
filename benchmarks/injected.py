"""Changes of known kind and size put between two reviews: which of them `metamer report` finds, and which it claims.

Every material of a catalogue is there as a matt surface of the curve that a 45:0 instrument reads of it, so that what
is changed is known exactly. Colours are drawn and compared as everywhere: pictures, references, all rows.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ..calibration.regression.comparison import compare
from ..calibration.regression.criteria import default_criteria
from ..calibration.regression.result import Result
from ..calibration.regression.review_folder import review_side
from ..calibration.regression.row import Layer, LayerKind, Pixels, Side
from ..calibration.text_tables import columns
from ..lighting.lights import DirectionalLight
from ..lighting.scene import Scene
from ..lighting.scene_files import load_scene, shipped_scene
from ..materials.axes import Axis
from ..materials.catalogue import Catalogue
from ..materials.factored.pack import FactoredBrdf, FactorPack
from ..materials.reading import Reading
from ..materials.records.material import MaterialRecord, Provenance
from ..materials.records.record import MARKER, write_record
from ..spectral.difference import lab_from_xyz, xyz_from_lab
from ..spectral.errors import ComparisonError
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from ..spectral.palette import Palette
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..viewer.review import review
from ..viewer.software import SoftwareRenderer
from .measuring import command, write_json

LIGHTS = ("D65", "A", "FL11")
# By how much a metamer is moved, where it stays between 0 and 1.
_METAMER = 0.05
_BAND_NM = 600.0


def run(catalogue: Path | None = None, pattern: str = "*", size: int = 24) -> dict:
    """Each change over all materials that fit, under `LIGHTS`.

    Returns
    -------
    dict for JSON: `materials`, and `rows` of `change`, `rows`, `found` (called changed), `alarms` (warned or failed),
    `mean` and `floor` (the median over rows of the largest layer's mean ΔE94 and of its floor), or `refused`.
    """
    curves = _read(Catalogue.open(catalogue), pattern)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        before = _reviewed(place / "before", curves, size)
        rows = [_row("nothing", compare(before, _reviewed(place / "again", curves, size), default_criteria()))]
        for number, (name, change) in enumerate(_CURVES.items()):
            changed = {material: change(curve) for material, curve in curves.items()}
            after = _reviewed(place / f"curves{number}", changed, size)
            rows.append(_row(name, compare(before, after, default_criteria())))
        turned = _reviewed(place / "turned", curves, size, turn_deg=0.5)
        rows.append(_row("light turned by 0.5 degrees", compare(before, turned, default_criteria())))
        for name, change in (("one wrong pixel, 5 L*", _wrong_pixel), ("drift of 0.2 L*", _drifted)):
            rows.append(_row(name, compare(before, _altered(before, change), default_criteria())))
        try:
            swapped = _reviewed(place / "swapped", curves, size, eye="1964_10")
            rows.append(_row("swapped observer", compare(before, swapped, default_criteria())))
        except ComparisonError as reason:
            rows.append({"change": "swapped observer", "refused": str(reason).splitlines()[0]})
    return {"materials": len(curves), "rows": rows}


def report(figures: dict) -> str:
    """The figures as a table."""
    body = [
        [row["change"], "refused", "", "", "", ""]
        if "refused" in row
        else [row["change"], *(str(row[key]) for key in ("rows", "found", "alarms")), *_short(row)]
        for row in figures["rows"]
    ]
    headings = ["change", "rows", "found", "alarms", "mean ΔE94", "floor"]
    return f"{figures['materials']} materials under {', '.join(LIGHTS)}\n{columns(headings, body)}"


def _short(row: Mapping[str, Any]) -> list[str]:
    return [f"{row[key]:.2g}" for key in ("mean", "floor")]


def _read(catalogue: Catalogue, pattern: str) -> dict[str, Float[np.ndarray, " L"]]:
    """The curve of each material that has a plain one, held between 0 and 0.98 as a matt surface has to be."""
    curves = {}
    for material in catalogue.match_surfaces(pattern):
        reading = Reading.of(catalogue.surface(material).brdf())
        if reading.brdf is None:
            curve = np.interp(WORKING_WAVELENGTHS_NM, reading.wavelengths_nm, reading.factor)
            curves[material] = np.clip(curve, 0.0, 0.98)
    return curves


def _reviewed(
    folder: Path, curves: Mapping[str, Float[np.ndarray, " L"]], size: int, turn_deg: float = 0.0, eye: str = "1931_2"
) -> Side:
    materials = folder / "catalogue"
    for material, curve in curves.items():
        _write_matt(materials, material, curve)
    catalogue = Catalogue.open(materials)
    scene = _scene(next(iter(curves)), size, turn_deg)
    scene = replace(scene, observer=observer(eye))
    options = {"illuminants": LIGHTS, "materials": ("*",), "version": version("metamer")}
    with SoftwareRenderer() as renderer:
        review(scene, catalogue, folder / "review", renderer=renderer, **options)
    return review_side(folder / "review")


def _scene(material: str, size: int, turn_deg: float) -> Scene:
    scene = load_scene(shipped_scene())
    scene = replace(scene, review=None).with_material(scene.reviewed_part, material)
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    lights = tuple(
        replace(one, direction_to_light=turn @ one.direction_to_light) if isinstance(one, DirectionalLight) else one
        for one in scene.lights
    )
    cameras = tuple(replace(one, width=size, height_px=size, samples=2) for one in scene.cameras)
    return replace(scene, lights=lights, cameras=cameras)


def _write_matt(folder: Path, material: str, curve: Float[np.ndarray, " L"]) -> None:
    """A matt surface, which its one term stands for exactly."""
    axes = tuple(Axis(name, 2, end) for name, end in (("theta_h", 1.6), ("theta_d", 1.6), ("phi_d", 3.2)))
    factors = (np.full((2, 1), 1 / np.pi), np.ones((2, 1)), np.ones((2, 1)))
    pack = FactorPack("hd", axes, factors, Palette.of(curve[None]))
    parameters = {"wavelengths_nm": WORKING_WAVELENGTHS_NM, "reflectance": curve}
    said = Provenance("a benchmark", "none", "analytic")
    record = MaterialRecord(material, material.partition("/")[0], "lambert", parameters, said, FactoredBrdf((pack,)))
    path = folder / f"{material}.h5"
    path.parent.mkdir(parents=True, exist_ok=True)
    (folder / MARKER).write_text("schema = 2\n", encoding="utf-8")
    write_record(record, path)


def _one_band(curve: Float[np.ndarray, " L"]) -> Float[np.ndarray, " L"]:
    changed = curve.copy()
    changed[np.searchsorted(WORKING_WAVELENGTHS_NM, _BAND_NM)] *= 1.01
    return changed


def _metamer(curve: Float[np.ndarray, " L"]) -> Float[np.ndarray, " L"]:
    """The same XYZ under D65 for the CIE 1931 observer: moved in what none of its weights sees."""
    weights = observer("1931_2").weights(illuminant("D65"), WORKING_WAVELENGTHS_NM)
    wish = np.cos(np.linspace(0.0, 14.0, curve.size))
    unseen = wish - weights.T @ np.linalg.solve(weights @ weights.T, weights @ wish)
    unseen /= np.abs(unseen).max()
    room = np.where(unseen > 0, (0.99 - curve) / np.maximum(unseen, 1e-9), curve / np.maximum(-unseen, 1e-9))
    return curve + min(_METAMER, float(room.min())) * unseen


# What is done to curves, by its name.
_CURVES = {"1 % of one band": _one_band, "metamer under D65": _metamer}


def _altered(side: Side, change: Callable[[Pixels], Pixels]) -> Side:
    """A side whose pictures are changed as they are loaded; its references are not."""

    def changed(kind: LayerKind, layer: Layer) -> Layer:
        # Without their file, which is on the other side too: what is compared is what is changed here.
        return replace(layer, file=None, load=(lambda: change(layer.load())) if kind == "picture" else layer.load)

    rows = tuple(
        replace(row, layers={kind: changed(kind, layer) for kind, layer in row.layers.items()}) for row in side.rows
    )
    return replace(side, path=side.path / "altered", rows=rows)


def _wrong_pixel(pixels: Pixels) -> Pixels:
    lab = lab_from_xyz(pixels.xyz, pixels.white_xyz)
    middle = tuple(length // 2 for length in lab.shape[:2])
    lab[middle][0] += 5.0
    return replace(pixels, xyz=xyz_from_lab(lab, pixels.white_xyz).astype(pixels.xyz.dtype))


def _drifted(pixels: Pixels) -> Pixels:
    lab = lab_from_xyz(pixels.xyz, pixels.white_xyz)
    lab[..., 0] += 0.2
    return replace(pixels, xyz=xyz_from_lab(lab, pixels.white_xyz).astype(pixels.xyz.dtype))


def _row(name: str, result: Result) -> dict:
    largest = [max(row.layers.values(), key=lambda one: one.mean) for row in result.rows]
    return {
        "change": name,
        "rows": len(result.rows),
        "found": sum(row.state not in ("same", "identical") for row in result.rows),
        "alarms": sum(row.tier != "pass" for row in result.rows),
        "mean": float(np.median([one.mean for one in largest])),
        "floor": float(np.median([one.floor_mean for one in largest])),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = command(__doc__)
    parser.add_argument("--catalogue", type=Path, metavar="CAT", help="default: as everywhere")
    parser.add_argument("--materials", default="*", metavar="PATTERN", help="default: all")
    args = parser.parse_args(arguments)
    figures = run(args.catalogue, args.materials)
    print(report(figures))
    write_json(args.json, figures)


if __name__ == "__main__":
    main()
