"""ΔE maps of images on the GPU."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...calibration.report.statistics import FULL_COVERAGE
from ...spectral.adaptation import adaptation_matrix
from ...spectral.formula import Formula
from ...spectral.image_cam16 import cam16_constants
from ...spectral.image_difference import ImageFormula
from .full_screen import FullScreen
from .programs import Programs
from .tile import read

if TYPE_CHECKING:
    import moderngl

#: Formulas by their numbers in `difference.frag`.
FORMULAS: dict[ImageFormula, int] = {"CIE 1994": 1994, "CIE 2000": 2000, "CAM16-UCS": 16}


class DifferencePass:
    """Pass that compares two canvases (`Canvas`) pixel by pixel; twin of `image_delta_e`."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._passes: dict[ImageFormula, FullScreen] = {}

    def release(self) -> None:
        """Free the programs."""
        while self._passes:
            self._passes.popitem()[1].release()

    @property
    def all_programs(self) -> list[Programs]:
        """Return the programs that it draws with."""
        return [one.programs for one in self._passes.values()]

    def draw(
        self,
        onto: moderngl.Texture,
        pair: tuple[moderngl.Texture, moderngl.Texture],
        whites: tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]],
        method: ImageFormula = "CIE 1994",
    ) -> None:
        """Write ΔE of reference and sample to a texture (R32F): -1 for pixels excluded by `compared_pixels`, infinity
        for invalid pixels and where single precision is insufficient, to be completed by `whole`.

        whites : of each, Y = 1. If they differ, the sample is adapted to the white of the reference (Bradford).
        """
        if method not in self._passes:
            self._passes[method] = FullScreen(self._context, "difference.frag", {"FORMULA": FORMULAS[method]})
        values: dict[str, object] = {
            "same_white": column_major(_same_white(*whites)),
            "white": tuple(whites[0]),
            "full_coverage": FULL_COVERAGE,
        }
        if method == "CAM16-UCS":
            of_white = cam16_constants(whites[0])
            values |= of_white._asdict() | {"cones_from_share": column_major(of_white.cones_from_share)}
        self._passes[method].draw(onto, {"reference": pair[0], "sampled": pair[1]}, values)

    def whole(
        self,
        drawn: moderngl.Texture,
        pair: tuple[moderngl.Texture, moderngl.Texture],
        whites: tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]],
        method: ImageFormula = "CIE 1994",
    ) -> Float[np.ndarray, "h w"]:
        """Read the result of `draw`, recompute infinite values in double precision, and write them back.

        As from `delta_e_map`: NaN for pixels that are not compared, infinity for invalid pixels.
        """
        found = read(drawn)[..., 0].copy()
        again = np.isinf(found)
        if again.any():
            first, second = (read(one)[..., :3][again].astype(np.float64) for one in pair)
            again_found = Formula(method)(first, second @ _same_white(*whites).T, np.asarray(whites[0]))
            found[again] = np.where(np.isfinite(again_found), again_found, np.inf)
            drawn.write(found.tobytes())
        return np.where(found < 0.0, np.float32(np.nan), found)


def column_major(matrix: Float[np.ndarray, "3 3"]) -> tuple[float, ...]:
    """Return a matrix in GLSL's column-major order."""
    return tuple(float(one) for one in np.asarray(matrix).T.reshape(-1))


def _same_white(reference: Float[np.ndarray, "3"], sample: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    return np.eye(3) if np.array_equal(reference, sample) else adaptation_matrix(sample, reference)
