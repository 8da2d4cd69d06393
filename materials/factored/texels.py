"""The factors of a pack as `factors.glsl` reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ..core.axes import Axis, Frame
from ..core.fast import TermShader
from .pyramids import MOST_LEVELS, axis_levels, pyramid

_FILE = Path(__file__).with_name("factors.glsl")


def factor_shader(
    frame: Frame, axes: tuple[Axis, ...], factors: tuple[Float[np.ndarray, "_ R"], ...], half: bool, filtered: bool
) -> TermShader:
    """Factors laid out for the GPU, if `filtered` their means over wider and wider samples too.

    The texture `factors` has a row for every four terms, axes side by side, and within an axis its levels; float16
    where the pack is in half precision, which holds its factors exactly. Uniforms: 1 / maximum, size - 1, first column
    and kind of each axis; of filtered factors also first column, size - 1 and 1 / spacing of each level of each axis,
    padded to `MOST_LEVELS`, and the number of each axis' last.

    Raises
    ------
    InputError : a pack that calls itself half precision holds what 16 bits do not.
    """
    rank = factors[0].shape[1]
    rows = -(-rank // 4)
    tables = pyramid(axes, factors, half) if filtered else factors
    texels = np.zeros((rows, sum(len(table) for table in tables), 4), dtype=np.float32)
    kinds, levels, last_levels, first = [], [], [], 0
    for axis, table in zip(axes, tables, strict=True):
        padded = np.zeros((len(table), rows * 4), dtype=np.float32)
        padded[:, :rank] = table
        texels[:, first : first + len(table)] = padded.reshape(len(table), rows, 4).swapaxes(0, 1)
        kind = 2.0 if axis.periodic else 1.0 if axis.warp == "sqrt" else 0.0
        kinds.append((1.0 / axis.maximum, axis.size - 1.0, float(first), kind))
        if filtered:
            made = axis_levels(axis)
            each = zip(made.starts, made.sizes, made.spacings, strict=True)
            of_axis = [(float(first + at), size - 1.0, 1.0 / spacing) for at, size, spacing in each]
            levels += of_axis + [of_axis[-1]] * (MOST_LEVELS - len(of_axis))
            last_levels.append(len(of_axis) - 1.0)
        first += len(table)
    return TermShader(
        _FILE,
        {"AXES": len(axes)} | ({"MOST_LEVELS": MOST_LEVELS} if filtered else {}),
        {"factors": halved(texels) if half else texels},
        {"axes": kinds, "azimuth_channel": int(frame == "hd")}
        | ({"levels": levels, "last_level": last_levels} if filtered else {}),
    )


def halved(values: np.ndarray) -> np.ndarray:
    """Factors as float16; raises `InputError` where 16 bits do not hold them exactly."""
    with np.errstate(over="ignore"):
        small = values.astype(np.float16)
    if not np.array_equal(small, values):
        worst = values.flat[np.argmax(np.abs(values - np.nan_to_num(small.astype(np.float64))))]
        raise InputError(
            "factors of a half-precision pack do not fit into 16 bits",
            field="factors",
            found=float(worst),
            expected="numbers that 16 bits hold exactly",
            hint="materials.fitting.half_precision.rounded_to_half makes such a pack",
        )
    return small
