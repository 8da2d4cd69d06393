"""Rows of one case of a review: drawn, compared and written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...calibration.report.row import ReviewRow
from ...calibration.report.row_files import DrawnRows
from ...calibration.report.statistics import self_check
from ...materials.catalogue.instrument_reading import InstrumentReading
from ..picture import Warn
from .cases import ReviewCase, Setting
from .compare import compare_pictures
from .draw import draw
from .references import Reference
from .worst_pixel import pixel_spectra
from .write import write_review_row


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
    """Return the rows of one case, their pictures below `folder`; with `checked` also the report's checks of itself."""
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
    """Warnings as they are said, each once."""

    def __init__(self, warn: Warn) -> None:
        self._warn = warn
        self.said: list[str] = []

    def __call__(self, line: str) -> None:
        if line not in self.said:
            self.said.append(line)
            self._warn(line)
