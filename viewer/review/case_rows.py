"""Rows of one case of a review: rendering, comparison and output."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from ...calibration.report.plots import embedded_side, fitted_size
from ...calibration.report.row import ReviewRow, RowColour, WorstPixel, review_row
from ...calibration.report.row_files import DrawnRows
from ...calibration.report.statistics import self_check
from ...materials.catalogue.instrument_reading import GEOMETRY, InstrumentReading
from ...spectral.difference import lab_from_xyz
from ..picture import Warn, picture_words
from .cases import ReviewCase, Setting
from .compare import PictureComparison, compare_pictures
from .draw import ReviewDrawing, draw
from .facts import colours_around, display_swatches, xyz_in
from .files import picture_name, write_row
from .limits import limits_of
from .references import Reference
from .words import held_words, provenance_words
from .worst_pixel import BANDS_NM, PixelSpectra, pixel_spectra


def drawn_case(
    setting: Setting,
    case: ReviewCase,
    truth: Reference,
    folder: Path,
    checked: bool,
    finished: Callable[[ReviewRow], None],
    warn: Warn,
    reading_of: Callable[[str], InstrumentReading],
) -> DrawnRows:
    """Make the rows of one case, with images below `folder`; with `checked` also the report's self-checks."""
    heard, rows, checks = Warnings(warn), [], ()
    spectra = pixel_spectra(setting, case)
    for drawing in draw(setting, case, truth, heard):
        for found in compare_pictures(setting, case, drawing):
            if checked and not checks:
                checks = tuple(self_check(drawing.truth_xyz, drawing.white, found.share))
            rows.append(write_review_row(setting, drawing, found, reading_of(found.material), folder, spectra))
            finished(rows[-1])
    return DrawnRows(tuple(rows), checks, tuple(heard.said))


class Warnings:
    """Collection of distinct warnings."""

    def __init__(self, warn: Warn) -> None:
        self._warn = warn
        self.said: list[str] = []

    def __call__(self, line: str) -> None:
        if line not in self.said:
            self.said.append(line)
            self._warn(line)


def write_review_row(
    setting: Setting,
    drawing: ReviewDrawing,
    found: PictureComparison,
    reading: InstrumentReading,
    out: Path,
    spectra: PixelSpectra,
) -> ReviewRow:
    """Write the images below `out` and return the row; `reading` is the instrument's reading of the material, `spectra`
    returns those of a pixel.
    """
    begun = time.perf_counter()
    scene, display, lit = setting.scene, setting.display, drawing.scene
    words = picture_words(lit, setting.view, setting.renderer.made_by, setting.version)
    cut_outs = {"p": drawing.cut_out, "r": drawing.truth_cut_out}
    limits = limits_of(drawing.sample, found.share, display)
    image, files = write_row(
        out,
        picture_name(found.material, None if drawing.own_light else drawing.illuminant),
        drawing.shown,
        display,
        drawing.sample,
        drawing.truth,
        drawing.coverage,
        found.difference,
        words | {"material": found.material},
        None if limits is None else limits[1],
        {view: image for view, image in cut_outs.items() if _reduced(setting, image)},
    )
    seconds = drawing.seconds | {"compare": found.seconds, "write": time.perf_counter() - begun}
    seconds["write"] += seconds.pop("encode")
    xyz = xyz_in(lit, reading)
    around = tuple((at, seen, lab_from_xyz(seen, drawing.white)) for at, seen in colours_around(lit, reading))
    return review_row(
        material=found.material,
        illuminant=drawing.illuminant,
        observer=scene.observer.name,
        statistics=found.statistics,
        picture=drawing.cut_out,
        reference=drawing.truth_cut_out,
        limits=None if limits is None else limits[0],
        limits_mask=None if limits is None else limits[1],
        delta_e=found.difference,
        budget=setting.budget,
        rows=setting.total,
        image=image,
        files=files,
        seconds=seconds,
        wavelengths_nm=reading.wavelengths_nm,
        reflectance=reading.factor,
        swatch=display_swatches(display, xyz[None], drawing.white)[0],
        colour=RowColour(xyz, lab_from_xyz(xyz, drawing.white), GEOMETRY, around),
        white_xyz=drawing.white,
        shift=found.shift,
        worst=_worst(found, spectra),
        noise=drawing.noise,
        notes=(*drawing.notes, *held_words(lit, setting.geometry, found.material, setting.surfaces[found.material])),
        provenance=provenance_words(setting.records[found.material]),
    )


def _reduced(setting: Setting, image: UInt8[np.ndarray, "H W 4"]) -> bool:
    """Return whether the page embeds a reduced version of the image."""
    full = (image.shape[0], image.shape[1])
    return fitted_size(full, embedded_side(setting.total)) != full


def _worst(found: PictureComparison, spectra: PixelSpectra) -> WorstPixel | None:
    if found.worst is None or found.worst_lab is None:
        return None
    there = float(found.difference[found.worst])
    factors = spectra(found.worst)
    curves = () if factors is None else (BANDS_NM, *factors)
    return WorstPixel(found.worst, there, found.worst_lab[0], found.worst_lab[1], *curves)
