"""What a colour difference of two large images costs, and how far off it is: in single precision, in double, and by
colour-science.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

import numpy as np

from ..calibration.text_tables import columns
from ..spectral.colour_library import colour_science
from ..spectral.difference import delta_e
from ..spectral.image_difference import ImageFormula, image_delta_e
from .measuring import best_ms, command, write_json

# Rows that both images are a repetition of, so that drawing numbers takes no time.
_DRAWN = 64


def run(width: int = 3840, height: int = 2160, repeats: int = 3) -> dict:
    """Two images of all colours, some near each other.

    Returns
    -------
    dict for JSON: `pixels`, and `rows` of `formula`, `ms` by way ("image", "one thread", "double", "colour-science"),
    `ratio` (colour-science's time by that of images) and `off`, the largest difference from double precision.
    """
    colour = colour_science()
    rng = np.random.default_rng(0)
    drawn = np.stack([rng.uniform(0, 100, (_DRAWN, width)), *rng.uniform(-80, 80, (2, _DRAWN, width))], axis=-1)
    beside = drawn + rng.normal(0.0, 2.0, drawn.shape)
    whole = -(-height // _DRAWN), 1, 1
    first, second = (np.tile(one, whole)[:height] for one in (drawn, beside))
    rows = []
    for formula in get_args(ImageFormula):
        ways = {
            "image": lambda formula=formula: image_delta_e(first, second, formula),
            "one thread": lambda formula=formula: image_delta_e(first, second, formula, threads=1),
            "double": lambda formula=formula: delta_e(first, second, formula),
            "colour-science": lambda formula=formula: colour.delta_E(first, second, method=formula),
        }
        found = {name: best_ms(way, repeats) for name, way in ways.items()}
        off = np.abs(image_delta_e(drawn, beside, formula) - delta_e(drawn, beside, formula)).max()
        ratio = found["colour-science"] / found["image"]
        rows.append({"formula": formula, "ms": found, "ratio": ratio, "off": float(off)})
    return {"pixels": [width, height], "rows": rows}


def report(figures: dict) -> str:
    """The figures as a table."""
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
