"""One case of a review drawn: the sample from fast forms beside the truth from the original data, light by light."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...calibration.row import ReferenceNoise
from ...lighting.scene import Scene
from ...spectral.image import ColourImage
from ..picture import Warn, say_if_clipped
from .cases import Case, Setting
from .references import Reference


@dataclass(frozen=True, eq=False)
class Drawing:
    """A case under one illuminant.

    scene : as it is lit. illuminant : its name, `own_light` where each light keeps its own spectrum. white (3,).
    sample, truth : XYZ, float32, and the `coverage` of each; truth_xyz (H, W, 3) : in float64.
    shown, truth_shown (H, W, 3) : encoded for the display.
    noise : of the truth, where directions were drawn for it.
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
    shown: Float[np.ndarray, "H W 3"]
    truth_shown: Float[np.ndarray, "H W 3"]
    noise: ReferenceNoise | None
    notes: tuple[str, ...]
    seconds: dict[str, float]


def draw(setting: Setting, case: Case, reference: Reference, warn: Warn) -> Iterator[Drawing]:
    """The case under each illuminant; pictures that the display clips are said."""
    scene, display = setting.scene, setting.display
    begun = time.perf_counter()
    shown = dict(case.surfaces)
    pictures = setting.renderer.render_many(case.scene, setting.view, shown, setting.spectra)
    each = {
        "render": (time.perf_counter() - begun) / len(setting.names),
        "reference": reference.seconds / len(setting.names),
    }
    rows = zip(setting.names, setting.spectra, pictures, reference.xyz, strict=True)
    for number, (name, spectrum, (sample_xyz, coverage), truth_xyz) in enumerate(rows):
        lit = case.scene if spectrum is None else case.scene.with_illuminant(spectrum, name)
        white = lit.adopted_white()
        background = white * scene.viewing.background_reflectance
        sample, truth = ColourImage(sample_xyz, "xyz", white), ColourImage(truth_xyz, "xyz", white)
        begun = time.perf_counter()
        shown_rgb, notes = display.encode(sample, coverage, background, setting.gpu)
        truth_rgb, _ = display.encode(truth, setting.geometry.coverage, background, setting.gpu)
        if notes:
            said_of = f"the picture of {' and '.join(case.judged)} under {name}"
            say_if_clipped(scene, said_of, sample, np.asarray(coverage), display, warn)
        seconds = {**each, "encode": (time.perf_counter() - begun) / len(case.judged)}
        both = coverage, setting.geometry.coverage
        yield Drawing(
            lit,
            name,
            spectrum is None,
            white,
            sample,
            truth,
            truth_xyz,
            both,
            shown_rgb,
            truth_rgb,
            reference.noise_of(number),
            tuple(notes),
            seconds,
        )
