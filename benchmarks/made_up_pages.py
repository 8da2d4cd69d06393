"""Every kind of page that Metamer writes, of so many rows of made-up materials: spheres in a grey booth.

What chance leaves in a reference is drawn into it, for it is what lossless pictures are large by.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..calibration.regression.comparison import compare
from ..calibration.regression.criteria import default_criteria
from ..calibration.regression.page import render_page
from ..calibration.regression.row import FLOAT32_ROUNDOFF, ComparedSide, LayerKind, PixelLayer, Pixels, Row, RowName
from ..calibration.regression.row_pictures import srgb
from ..calibration.report.history import Run
from ..calibration.report.preview_page import PreviewCard, write_preview_page
from ..calibration.report.report import write_report
from ..calibration.report.row import ReviewRow, RowColour, WorstPixel, review_row
from ..calibration.report.sprite_sheets import SpriteSheets
from ..calibration.report.statistics import DeltaEStatistics, SelfCheck
from ..spectral.difference import delta_e_lab, lab_from_xyz
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from ..spectral.sample import Sample
from ..spectral.spectrum import Spectrum
from ..viewer.match import match

LIGHTS = ("D65", "A", "FL11")
_EYE = "1931_2"
_SIDE = 128
_NM = np.arange(380.0, 781.0, 10.0)
# Noise of a reference's pixel as a share of its light: a mean ΔE94 of some 0.1, the limit of reviews.
_NOISE = 6e-3


class _Plan:
    basis_size = 8
    reasons = ("Made up: 8 coefficients.",)


def review_page(folder: Path, rows: int) -> Path:
    """Write the page of `metamer review`, the second run."""
    made = [_review_row(*_named(number), rows) for number in range(rows)]
    before = [Run("2026-01-01T00:00:00+00:00", "0", "pass", {row.name: row.statistics.p99 for row in made})]
    checks = (SelfCheck("L* by 1", 1.0, 1.0),)
    return write_report(folder, made, _Plan(), "made up", 1.0, ["Made up."], "0", checks=checks, history=before)[0]


def regression_page(folder: Path, rows: int) -> Path:
    """Write the page of `metamer report`: every tenth row is identical, the others moved."""
    sides = []
    for path, off in (("before", 1.0), ("after", 1.01)):
        found = [_side_row(number, off if number % 10 else 1.0) for number in range(rows)]
        sides.append(ComparedSide(Path(path), "review", tuple(found)))
    result = compare(sides[0], sides[1], default_criteria())
    return _written(folder / "regression.html", render_page(result, sides[0], sides[1], "0", [result.as_run("0")] * 2))


def match_page(folder: Path, rows: int) -> Path:
    """Write the page of `metamer match`: so many samples, under three lights."""
    rng = np.random.default_rng(0)
    samples = [_sample(f"lot {number:04}", 1.0 + rng.normal(0.0, 0.02)) for number in range(rows)]
    report = match(_sample("master", 1.0), samples, "CMC 2:1 1.0", repeatability=0.05)
    return _written(folder / "match.html", report.html())


def catalogue_page(folder: Path, rows: int) -> Path:
    """Write the page of `metamer catalogue preview`: so many materials."""
    cards, sheets = [], SpriteSheets()
    for number in range(rows):
        name = _named(len(LIGHTS) * number)[0]
        xyz, white = _sphere(number, "D65"), _white("D65")
        sheets.add(srgb(Pixels(xyz, np.ones(xyz.shape[:2]), white))[0])
        lab, facts = tuple(lab_from_xyz(_colour(number, "D65"), white)), {"Licence": "CC0", "Source": "made up"}
        family, p99 = name.split("/")[0], 0.1 + 0.001 * (number * 37 % rows)
        caption = f"fit: p99 {p99:.2f}"
        cards.append(PreviewCard(name, family, "analytic", "reflectance", caption, facts, lab, p99))
    write_preview_page(folder / "catalogue.html", cards, sheets, "Made up", "Spheres under D65.")
    return folder / "catalogue.html"


#: By the name of the page, what writes one of so many rows into a folder.
PAGES: dict[str, Callable[[Path, int], Path]] = {
    "review": review_page,
    "regression": regression_page,
    "match": match_page,
    "catalogue": catalogue_page,
}


def _written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def _named(number: int) -> tuple[str, str, int]:
    """Material, light, and which material that is, of a row."""
    material, light = divmod(number, len(LIGHTS))
    return f"{('paint', 'metal', 'plastic')[material % 3]}/sample-{material:03}", LIGHTS[light], material


@cache
def _white(light: str) -> Float[np.ndarray, "3"]:
    return observer(_EYE).white(illuminant(light))


def _reflectance(material: int) -> Float[np.ndarray, " L"]:
    """Return a smooth curve, another one of each material."""
    edge, width, height = 430.0 + 61.0 * material % 250.0, 15.0 + 7.0 * material % 40.0, 0.2 + 0.1 * material % 0.6
    return 0.05 + height / (1.0 + np.exp(-(_NM - edge) / width))


def _colour(material: int, light: str) -> Float[np.ndarray, "3"]:
    return observer(_EYE).weights(illuminant(light), _NM) @ _reflectance(material)


@cache
def _shape() -> tuple[Float[np.ndarray, "H W"], Float[np.ndarray, "H W"], Float[np.ndarray, "H W"]]:
    """Shade a sphere from the front: what a matt surface makes of light, what a gloss does, and where there is any."""
    y, x = np.mgrid[-1.1 : 1.1 : _SIDE * 1j, -1.1 : 1.1 : _SIDE * 1j]
    z = np.sqrt(np.clip(1.0 - x * x - y * y, 0.0, None))
    return np.clip(0.5 * x - 0.4 * y + 0.76 * z, 0.03, 1.0), 0.4 * z**60, (z > 0.0).astype(np.float64)


def _sphere(material: int, light: str, noise: int | None = None) -> Float[np.ndarray, "H W 3"]:
    """XYZ of a picture; `noise` is the seed of what chance adds."""
    matt, gloss, there = _shape()
    white = _white(light)
    booth = 0.2 * white
    xyz = np.where(there[..., None] > 0, matt[..., None] * _colour(material, light) + gloss[..., None] * white, booth)
    if noise is not None:
        xyz = xyz * (1.0 + _NOISE * np.random.default_rng(noise).standard_normal(there.shape) * there)[..., None]
    return xyz


def _review_row(material: str, light: str, number: int, rows: int) -> ReviewRow:
    white, there = _white(light), _shape()[2]
    xyz = {"picture": _sphere(number, light), "reference": _sphere(number, light, noise=number)}
    shown = {name: srgb(Pixels(one, there, white))[0] for name, one in xyz.items()}
    off = delta_e_lab(lab_from_xyz(xyz["reference"], white), lab_from_xyz(xyz["picture"], white))
    off = np.where(there > 0, off * (0.5 + 0.1 * (number % 12)), np.nan)
    known = off[there > 0]
    mean, p95, p99, most = known.mean(), *np.percentile(known, [95.0, 99.0]), known.max()
    lab, factor = lab_from_xyz(_colour(number, light), white), _reflectance(number)
    return review_row(
        material, light, _EYE, **shown, delta_e=off, budget=1.0, rows=rows, image="picture.png",
        statistics=DeltaEStatistics(float(mean), float(p95), float(p99), float(most), known.size),
        files={"XYZ EXR": "picture.exr", "reference": "reference.exr", "ΔE map": "map.exr"}, shift=(0.1, -0.2, 0.05),
        worst=WorstPixel((1, 2), float(most), lab, lab + 0.5, _NM, factor, 1.01 * factor), white_xyz=white,
        wavelengths_nm=_NM, reflectance=factor, swatch=(120, 80, 40), notes=("Made up.",),
        seconds={"render": 0.1, "reference": 2.0}, colour=RowColour(_colour(number, light), lab, "45a:0"),
        provenance={"Source": "made up", "Licence": "CC0", "Kind": "analytic", "Quantity": "reflectance"},
    )  # fmt: skip


def _side_row(number: int, off: float) -> Row:
    material, light, which = _named(number)
    layers: dict[LayerKind, PixelLayer] = {
        "picture": _layer(which, light, off, None),
        "reference": _layer(which, light, off, number),
    }
    name = RowName(material, light, observer(_EYE).name, "booth", "front")
    return Row(name, layers, {"p99": 0.3})


def _layer(material: int, light: str, off: float, noise: int | None) -> PixelLayer:
    return PixelLayer(partial(_pixels, material, light, off, noise))


def _pixels(material: int, light: str, off: float, noise: int | None) -> Pixels:
    xyz = (off * _sphere(material, light, noise)).astype(np.float32)
    return Pixels(xyz, _shape()[2].astype(np.float32), _white(light), FLOAT32_ROUNDOFF)


def _sample(name: str, gain: float) -> Sample:
    curve = _reflectance(2) * gain
    return Sample(name, "made up", (Spectrum.sampled(_NM, np.clip(curve, 0.0, 1.0), "reflectance"),))
