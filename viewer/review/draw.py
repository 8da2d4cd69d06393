"""Rendering of one case of a review: image from fast forms and reference from original data, light by light."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from ...calibration.report.row import ReferenceNoise
from ...lighting.scene import Scene
from ...spectral.image import ColourImage
from ..picture import Warn, cut_out, say_if_clipped
from .cases import ReviewCase, Setting
from .references import Reference


@dataclass(frozen=True, eq=False)
class ReviewDrawing:
    """Rendered case under one illuminant.

    scene : under the illuminant. illuminant : its name, `own_light` for the lights' own spectra. white (3,).
    sample, truth : XYZ, float32, and the `coverage` of each; truth_xyz (H, W, 3) : in float64.
    shown (h, w, 3) : encoded for the display, over the scene's background. cut_out (h, w, 4), truth_cut_out (H, W, 4) :
    image and reference in 8 bits without background, transparent outside surfaces; the shown image may be larger.
    noise : of the reference; None without sampling.
    notes : of the display transform. seconds : of the steps "render", "reference" and "encode".
    """

    scene: Scene
    illuminant: str
    own_light: bool
    white: Float[np.ndarray, "3"]
    sample: ColourImage
    truth: ColourImage
    truth_xyz: Float[np.ndarray, "H W 3"]
    coverage: tuple[Float[np.ndarray, "H W"], Float[np.ndarray, "H W"]]
    shown: Float[np.ndarray, "h w 3"]
    cut_out: UInt8[np.ndarray, "h w 4"]
    truth_cut_out: UInt8[np.ndarray, "H W 4"]
    noise: ReferenceNoise | None
    notes: tuple[str, ...]
    seconds: dict[str, float]


def draw(setting: Setting, case: ReviewCase, reference: Reference, warn: Warn) -> Iterator[ReviewDrawing]:
    """Yield the case under each illuminant; warn of images that the display clips."""
    scene, display = setting.scene, setting.display
    begun = time.perf_counter()
    shown = dict(case.surfaces)
    pictures = setting.renderer.render_many(case.scene, setting.view, shown, setting.spectra)
    larger = [None] * len(pictures)
    if setting.shown_view is not None:
        larger = setting.renderer.render_many(case.scene, setting.shown_view, shown, setting.spectra)
    each = {
        "render": (time.perf_counter() - begun) / len(setting.names),
        "reference": reference.seconds / len(setting.names),
    }
    rows = zip(setting.names, setting.spectra, pictures, larger, reference.xyz, strict=True)
    for number, (name, spectrum, picture, large, truth_xyz) in enumerate(rows):
        (sample_xyz, coverage), (shown_xyz, shown_coverage) = picture, large or picture
        lit = case.scene if spectrum is None else case.scene.with_illuminant(spectrum, name)
        white = lit.adopted_white()
        background = white * scene.viewing.background_reflectance
        sample, truth = ColourImage(sample_xyz, "xyz", white), ColourImage(truth_xyz, "xyz", white)
        pictured = ColourImage(shown_xyz, "xyz", white)
        begun = time.perf_counter()
        shown_rgb, notes = display.encode(pictured, shown_coverage, background, setting.gpu)
        sample_cut_out = cut_out(pictured, shown_coverage, setting.display, setting.gpu)
        truth_cut_out = cut_out(truth, setting.geometry.coverage, setting.display, setting.gpu)
        if notes:
            said_of = f"the picture of {' and '.join(case.judged)} under {name}"
            say_if_clipped(scene, said_of, sample, np.asarray(coverage), display, warn)
        seconds = {**each, "encode": (time.perf_counter() - begun) / len(case.judged)}
        both = coverage, setting.geometry.coverage
        yield ReviewDrawing(
            lit,
            name,
            spectrum is None,
            white,
            sample,
            truth,
            truth_xyz,
            both,
            shown_rgb,
            sample_cut_out,
            truth_cut_out,
            reference.noise_of(number),
            tuple(notes),
            seconds,
        )
