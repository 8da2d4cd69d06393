"""Files of one row of a review: names and content."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from ...calibration.report.plots import lossless, mask_png
from ...calibration.report.review_data import BESIDE
from ...runtime.files import written_whole
from ...spectral.formats.exr import write_exr
from ...spectral.formats.xyz_exr import write_xyz_exr
from ...spectral.image import ColourImage
from ..display.png import write_png
from ..display.transform import DisplayTransform

#: Folder of images, next to the page.
PICTURES = "pictures"

# Names kept unchanged: materials in lower case, lights in upper case, so that names never differ by case alone.
_PLAIN_MATERIAL = re.compile(r"[a-z0-9_-]+(/[a-z0-9_-]+)*")
_PLAIN_LIGHT = re.compile(r"[A-Z0-9-]+")
_OWN_LIGHT = "as_lit"
_LONGEST = 100
# Device names reserved by Windows, with any suffix.
_DEVICES = frozenset({"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(10))})


def picture_name(material_id: str, light: str | None) -> str:
    """Return the file name, without suffix, of a material's images under a light; None: the scene's own lights.

    Names of different pairs differ on every file system, also case-insensitive ones: `/` becomes `~`, and a name with
    other unsafe characters is simplified and followed by `~~` and digits of its hash.

    >>> picture_name("paint/red", "D65"), picture_name("Paint/bright red", "FL11"), picture_name("paint/red", None)
    ('paint~red.D65', 'Paint~bright-red~~55bafbe75786.FL11', 'paint~red.as_lit')
    """
    return f"{_kept(material_id, _PLAIN_MATERIAL)}.{_OWN_LIGHT if light is None else _kept(light, _PLAIN_LIGHT)}"


def _kept(name: str, plain: re.Pattern[str]) -> str:
    slashless = name.replace("/", "~")
    if plain.fullmatch(name) and len(name) <= _LONGEST and name not in _DEVICES:
        return slashless
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:12]
    return f"{re.sub(r'[^A-Za-z0-9_~-]+', '-', slashless)[:_LONGEST]}~~{digest}"


def write_row(
    out: Path,
    name: str,
    shown_rgb: Float[np.ndarray, "_ _ 3"],
    display: DisplayTransform,
    sample: ColourImage,
    reference: ColourImage,
    coverage: tuple[Float[np.ndarray, "H W"], Float[np.ndarray, "H W"]],
    delta_e: Float[np.ndarray, "H W"],
    said: Mapping[str, str],
    limits_mask: UInt8[np.ndarray, "H W"] | None = None,
    cut_outs: Mapping[str, UInt8[np.ndarray, "_ _ 4"]] | None = None,
) -> tuple[str, dict[str, str]]:
    """Write the image of a row and the data of its figures; return paths relative to `out`: the PNG, the others by
    label.

    Parameters
    ----------
    name : from `picture_name`.
    shown_rgb : image, encoded for `display`.
    sample, reference : XYZ of image and reference, and the `coverage` of each.
    delta_e : ΔE94 of the two; NaN if not compared, infinite if invalid.
    said : attributes for every header, by name.
    cut_outs : image ("p") and reference ("r") without background, if the page embeds reduced versions.
    limits_mask : non-zero where the display cannot show the image; written unless 0 everywhere.
    """
    files = {
        "XYZ EXR": f"{PICTURES}/{name}.exr",
        "reference EXR": f"{PICTURES}/{name}.reference.exr",
        "ΔE94 EXR": f"{PICTURES}/{name}.delta-e94.exr",
    }
    image = f"{PICTURES}/{name}.png"
    words = [f"{label}: {text}" for label, text in said.items()]
    write_png(out / image, shown_rgb, display=display, words=words)
    write_xyz_exr(out / files["XYZ EXR"], sample, coverage[0], {**said, "picture": "sample"})
    write_xyz_exr(out / files["reference EXR"], reference, coverage[1], {**said, "picture": "reference"})
    what = {**said, "picture": "CIE 1994 (graphic arts) of sample and reference; NaN: not compared, inf: no number"}
    write_exr(out / files["ΔE94 EXR"], what, {"deltaE94": delta_e})
    for view, cut_out in (cut_outs or {}).items():
        files[BESIDE[view]] = f"{PICTURES}/{name}{'' if view == 'p' else '.reference'}.webp"
        with written_whole(out / files[BESIDE[view]]) as beside:
            beside.write_bytes(lossless(cut_out))
    if limits_mask is not None and limits_mask.any():
        files["limits PNG"] = f"{PICTURES}/{name}.limits.png"
        with written_whole(out / files["limits PNG"]) as beside:
            beside.write_bytes(mask_png(limits_mask))
    return image, files
