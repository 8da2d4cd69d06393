"""Cost and error of colour differences of large images: in single precision, in double, and by
colour-science.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import get_args

import numpy as np

from ..calibration.report.text_tables import columns
from ..spectral.axis_letters import Lab
from ..spectral.colour_library import colour_science
from ..spectral.difference import delta_e_lab, xyz_from_lab
from ..spectral.formula import ADAPTING_LUMINANCE, BACKGROUND, Formula
from ..spectral.illuminants import illuminant
from ..spectral.image_difference import ImageFormula, image_delta_e
from ..spectral.observers import observer
from .timing import best_ms, command, write_json

# Rows that both images are a repetition of, so that drawing numbers takes no time.
_DRAWN = 64


def run(width: int = 3840, height: int = 2160, repeats: int = 3) -> dict:
    """Two images of all colours, some near each other.

    Returns
    -------
    dict for JSON: `pixels`, and `rows` of `formula`, `ms` by way ("image", "one thread", "double", "colour-science"),
    `ratio` (colour-science's time by that of images) and `off`, the largest difference from double precision.
    """
    rng = np.random.default_rng(0)
    drawn = np.stack([rng.uniform(0, 100, (_DRAWN, width)), *rng.uniform(-80, 80, (2, _DRAWN, width))], axis=-1)
    beside = drawn + rng.normal(0.0, 2.0, drawn.shape)
    whole = -(-height // _DRAWN), 1, 1
    first, second = (np.tile(one, whole)[:height] for one in (drawn, beside))
    rows = []
    for formula in get_args(ImageFormula):
        image, double, other = _ways(formula)
        ways = {
            "image": lambda image=image: image(first, second),
            "one thread": lambda image=image: image(first, second, threads=1),
            "double": lambda double=double: double(first, second),
            "colour-science": lambda other=other: other(first, second),
        }
        found = {name: best_ms(way, repeats) for name, way in ways.items()}
        off = np.nanmax(np.abs(image(drawn, beside) - double(drawn, beside)))
        ratio = found["colour-science"] / found["image"]
        rows.append({"formula": formula, "ms": found, "ratio": ratio, "off": float(off)})
    return {"pixels": [width, height], "rows": rows}


def _ways(formula: ImageFormula) -> tuple[Callable, Callable, Callable]:
    """Return the differences of images, in double precision, and by colour-science, each of two images of CIELAB."""
    colour = colour_science()
    if formula != "CAM16-UCS":
        return (
            partial(image_delta_e, method=formula),
            partial(delta_e_lab, method=formula),
            partial(colour.delta_E, method=formula),
        )
    white = observer("1964_10").white(illuminant("D65"))

    def double(*images: Lab) -> np.ndarray:
        reference, sample = (xyz_from_lab(one, white) for one in images)
        return Formula(formula)(reference, sample, white)

    def other(*images: Lab) -> np.ndarray:
        seen = []
        for one in images:
            xyz = 100.0 * colour.Lab_to_XYZ(one, colour.XYZ_to_xy(white))
            with np.errstate(invalid="ignore", divide="ignore"):  # colours that no light has
                cam = colour.XYZ_to_CAM16(xyz, 100.0 * white, ADAPTING_LUMINANCE, BACKGROUND)
                seen.append(colour.JMh_CAM16_to_CAM16UCS(np.stack([cam.J, cam.M, cam.h], axis=-1)))
        return colour.delta_E(*seen, method=formula)

    return partial(image_delta_e, method=formula, white_xyz=white), double, other


def report(figures: dict) -> str:
    """Return the figures as a table."""
    names = [*figures["rows"][0]["ms"]]
    body = [
        [row["formula"], *(f"{row['ms'][name]:.0f}" for name in names), f"{row['ratio']:.1f}", f"{row['off']:.1e}"]
        for row in figures["rows"]
    ]
    title = "{} x {} pixels, milliseconds".format(*figures["pixels"])
    return f"{title}\n{columns(['formula', *names, 'times faster', 'off'], body, left=1)}"


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    args = command(__doc__).parse_args(arguments)
    figures = run()
    print(report(figures))
    write_json(args.json, figures)


if __name__ == "__main__":
    main()
