"""Images from files instead of rendering: an XYZ image, or the matching row of a baseline."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ...calibration.regression.baseline import MANIFEST, baseline_side
from ...calibration.regression.picture_files import read_xyz
from ...calibration.regression.row import Pixels, Row
from ...runtime.errors import InputError


def read_still(path: str | Path, shows: Mapping[str, str]) -> Pixels:
    """Read XYZ, coverage and white of an image.

    Parameters
    ----------
    path : an OpenEXR in XYZ, a baseline's folder, or the `baseline.json` in it.
    shows : settings of the other side, by the names of a row: "material", "light", "observer", "scene", "view". A
        baseline's row matches if all common names are equal.

    Raises
    ------
    InputError : an unreadable image, without XYZ or white; no matching row of the baseline, or several.
    """
    path = Path(path)
    if path.name == MANIFEST:
        path = path.parent
    if not path.is_dir():
        return read_xyz(path)
    rows = baseline_side(path).rows
    fitting = [row for row in rows if _shows(row, shows)]
    if len(fitting) != 1:
        wanted = ", ".join(f"{name} {value}" for name, value in shows.items() if value)
        there = "; ".join(str(row.name) for row in (fitting or rows)[:4])
        raise InputError(
            "several rows of the baseline show this" if fitting else "no row of the baseline shows this",
            file=path,
            field="rows",
            found=f"{wanted}; there: {there}{' ...' if len(fitting or rows) > 4 else ''}",
            expected="one row of the same material, light, observer, scene and view",
            hint="choose what a row of it shows, or name the picture's own .exr",
        )
    layers = fitting[0].layers
    return (layers.get("picture") or next(iter(layers.values()))).load()


def _shows(row: Row, shows: Mapping[str, str]) -> bool:
    names = zip(row.name._fields, row.name, strict=True)
    return all(not mine or not shows.get(name) or mine == shows[name] for name, mine in names)
