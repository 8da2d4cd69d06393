"""Assertions on colours for tests: differences beyond the limits fail, and leave evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from ...runtime.distribution import installed_version
from ...runtime.errors import InputError
from ...runtime.files import made_folder, written_whole
from ...spectral.formats.exr import write_exr
from ...spectral.formats.xyz_exr import write_xyz_exr
from ...spectral.formula import Formula
from ...spectral.image import ColourImage
from .change import change
from .comparison import compare
from .criteria import Criteria, criteria_of, default_criteria, read_criteria
from .outputs import as_json
from .page import render_page
from .picture_files import SeenSpectra
from .result import Result
from .row import FLOAT32_ROUNDOFF, FLOAT64_ROUNDOFF, ComparedSide, PixelLayer, Pixels, Row, RowName
from .sources import side_of
from .words import as_text


@runtime_checkable
class HasColours(Protocol):
    """Picture as `metamer.render` returns it."""

    @property
    def xyz(self) -> np.ndarray:
        """(H,W,3), Y = 1 for the white."""
        ...

    @property
    def white(self) -> np.ndarray:
        """(3,)."""
        ...

    @property
    def coverage(self) -> np.ndarray:
        """(H,W) from 0 to 1."""
        ...


#: Sides of a comparison: a file or folder, a picture, or XYZ (...,3) and its white (3,).
Colours = str | Path | HasColours | tuple[np.ndarray, np.ndarray]


def assert_colour_close(
    reference: Colours,
    sample: Colours,
    criteria: Criteria | str | Path | Sequence[dict] | None = None,
    *,
    evidence: str | Path | None = None,
    seen: SeenSpectra | None = None,
    display: str | None = None,
) -> Result:
    """Assert that a sample is close to its reference; returns the comparison.

    Parameters
    ----------
    criteria : a TOML file, its `criteria` as dicts, or `Criteria`; None is `default_criteria()`. Warnings pass.
    evidence : folder for figures, page, and of pictures both sides and the map of ΔE94, if the test fails.
    seen : lights and observer of spectra and readings. display : of PNG that do not state it.

    Raises
    ------
    AssertionError : a criterion fails, or a row is missing; the message has the table.
    ComparisonError, InputError : the two cannot be compared; an input cannot be used.
    """
    __tracebackhide__ = True
    asked = _criteria(criteria)
    before, after = (
        _side(one, name, seen or SeenSpectra(), display) for one, name in ((reference, "reference"), (sample, "sample"))
    )
    result = compare(before, after, asked)
    if result.tier != "fail":
        return result
    words = as_text(result)
    if evidence is not None:
        try:
            folder = made_folder(evidence)
            _write_evidence(result, before, after, folder)
            words += f"\nEvidence: {folder}"
        except (InputError, OSError) as reason:
            # Colours that are not close are what the test is about, and not a full disk.
            words += f"\nEvidence could not be written: {reason}"
    raise AssertionError(f"colours are not close\n{words}")


def _criteria(given: Criteria | str | Path | Sequence[dict] | None) -> Criteria:
    if given is None or isinstance(given, Criteria):
        return given or default_criteria()
    return read_criteria(Path(given)) if isinstance(given, str | Path) else criteria_of({"criteria": list(given)})


def _side(given: Colours, name: str, seen: SeenSpectra, display: str | None) -> ComparedSide:
    if isinstance(given, str | Path):
        return side_of(Path(given), seen, display)
    if isinstance(given, tuple):
        xyz, white = (np.asarray(one) for one in given)
        coverage = None
    else:
        xyz, white, coverage = np.asarray(given.xyz), np.asarray(given.white), np.asarray(given.coverage)
    pixels = _pixels(xyz, white, coverage, name)
    # The same picture object on both sides is told by its memory.
    layer = PixelLayer(lambda: pixels)
    # No path of a file: two sides that are nowhere are not one side.
    return ComparedSide(Path(f"<{name}>"), "picture", (Row(RowName("", "", ""), {"picture": layer}),))


def _pixels(xyz: np.ndarray, white: np.ndarray, coverage: np.ndarray | None, name: str) -> Pixels:
    if xyz.ndim < 1 or xyz.shape[-1] != 3 or white.shape != (3,) or not xyz.size:
        raise InputError(
            "not colours and their white",
            field=name,
            found=f"shapes {xyz.shape} and {white.shape}",
            expected="XYZ (...,3) and XYZ (3,)",
        )
    # Colours of any shape are rows of a picture; views, so that memory that is shared is seen.
    rows = xyz if xyz.ndim == 3 else xyz.reshape(1, -1, 3)
    step = FLOAT32_ROUNDOFF if rows.dtype == np.float32 else FLOAT64_ROUNDOFF
    covered = np.ones(rows.shape[:2], np.float32) if coverage is None else coverage
    return Pixels(rows, covered, white.astype(np.float64), step)


def _write_evidence(result: Result, before: ComparedSide, after: ComparedSide, folder: Path) -> None:
    """Write figures and page; for two single pictures also the pixels."""
    page = render_page(result, before, after, installed_version())
    for name, text in (("regression.json", as_json(result, installed_version())), ("index.html", page)):
        with written_whole(folder / name) as beside:
            beside.write_text(text, encoding="utf-8")
    if len(before.rows) == len(after.rows) == 1 and "picture" in before.rows[0].layers:
        pair = [side.rows[0].layers["picture"].load() for side in (before, after)]
        for name, pixels in zip(("reference", "sample"), pair, strict=True):
            write_xyz_exr(folder / f"{name}.exr", _image(pixels), pixels.coverage)
        delta_e = change(pair[0], replace(pair[1]), (Formula("CIE 1994"),), "evidence", rounding=False).maps["CIE 1994"]
        write_exr(folder / "delta-e94.exr", {"picture": "CIE 1994; NaN: not compared"}, {"deltaE94": delta_e})


def _image(pixels: Pixels) -> ColourImage:
    values: Float[np.ndarray, "H W 3"] = np.asarray(pixels.xyz, dtype=np.float32)
    return ColourImage(values, "xyz", pixels.white_xyz)
