"""Comparison of images with the reference: ΔE94 over the pixels of each judged material."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...calibration.report.statistics import DeltaEStatistics, delta_e_map, delta_e_statistics, mean_shift
from ...lighting.reference.geometry import VisibleGeometry
from ...lighting.scene import Scene
from ...runtime.errors import InputError
from ...spectral.difference import lab_from_xyz
from .cases import ReviewCase, Setting
from .draw import ReviewDrawing


@dataclass(frozen=True, eq=False)
class PictureComparison:
    """Comparison of one material: its share (H, W) of each pixel, ΔE94 (H, W) there, and statistics.

    shift : mean ΔL*, Δa*, Δb*, image minus reference. worst : row and column of the largest ΔE94, and CIELAB (2, 3) of
    reference and image there; None without valid pixels.
    """

    material: str
    share: Float[np.ndarray, "H W"]
    difference: Float[np.ndarray, "H W"]
    statistics: DeltaEStatistics
    shift: tuple[float, float, float] | None
    worst: tuple[int, int] | None
    worst_lab: Float[np.ndarray, "2 3"] | None
    seconds: float


def compare_pictures(setting: Setting, case: ReviewCase, drawing: ReviewDrawing) -> Iterator[PictureComparison]:
    """Yield the comparison of each judged material, over its pixels.

    Raises
    ------
    InputError : a material and illuminant without comparable pixels.
    """
    for material in case.judged:
        begun = time.perf_counter()
        share = np.minimum(drawing.coverage[0], _share_of(setting.geometry, case.scene, material))
        difference = delta_e_map(drawing.truth_xyz, drawing.sample.values, drawing.white, share)
        statistics = _statistics(difference, material, drawing.illuminant)
        labs = [lab_from_xyz(xyz, drawing.white) for xyz in (drawing.truth_xyz, drawing.sample.values)]
        shift = mean_shift(difference, *labs)
        worst = None if shift is None else _worst(difference)
        worst_lab = None if worst is None else np.array([lab[worst] for lab in labs], dtype=np.float64)
        seconds = time.perf_counter() - begun
        yield PictureComparison(material, share, difference, statistics, shift, worst, worst_lab, seconds)


def _worst(difference: Float[np.ndarray, "H W"]) -> tuple[int, int]:
    """Find the largest difference among valid pixels."""
    at = np.argmax(np.where(np.isfinite(difference), difference, -1.0))
    row, column = np.unravel_index(int(at), difference.shape)
    return int(row), int(column)


def _statistics(difference: Float[np.ndarray, "H W"], material_id: str, illuminant_name: str) -> DeltaEStatistics:
    try:
        return delta_e_statistics(difference)
    except InputError as reason:
        raise reason.at(field=f"{material_id} under {illuminant_name}") from None


def _share_of(geometry: VisibleGeometry, scene: Scene, material_id: str) -> Float[np.ndarray, "H W"]:
    """Return the share (H,W) of each pixel covered by a material."""
    wearing = [index for index, part in enumerate(scene.parts) if part.material == material_id]
    pixels = geometry.pixel[np.isin(geometry.part, wearing)]
    hits = np.bincount(pixels, minlength=geometry.rows * geometry.width)
    return hits.reshape(geometry.rows, geometry.width) / geometry.samples
