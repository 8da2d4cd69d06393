"""Cost of a picture of given packs: milliseconds a megapixel, with everything kept that can be kept."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from ...lighting.camera import Camera
from ...lighting.lights import DirectionalLight
from ...lighting.mesh import shapes
from ...lighting.scene import Part, Scene
from ...materials.factored.pack import FactoredBrdf, FactorPack
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...viewer.render.session import RenderSession


class Stopwatch:
    """Times pictures of a wall that fills the view, seen and lit at angles that change from pixel to pixel."""

    WORDS: ClassVar[str] = (
        "geometry kept; look-ups, products, sum over terms and reading back; the median of five pictures"
    )

    #: Pixels along a side.
    SIZE: ClassVar[int] = 384

    def __init__(self, renderer: RenderSession) -> None:
        self.renderer = renderer
        size = self.SIZE
        self._camera = Camera(
            "above", (0.3, 3.0, 0.2), (0.0, 0.0, 0.0), vertical_fov_deg=60.0, width=size, height_px=size, samples=1
        )
        light = DirectionalLight(np.array([0.4, 0.8, 0.3]), illuminant("D65"), 1000.0)
        wall = Part("wall", shapes.plane(10.0, 10.0), "material")
        self._scene = Scene((wall,), (light,), (self._camera,), observer("1931_2"))

    def milliseconds(self, packs: tuple[FactorPack, ...]) -> float:
        """Time a megapixel of XYZ: every term folded with the light first."""
        return self._timed(lambda: self.renderer.render(self._scene, self._camera, {"material": FactoredBrdf(packs)}))

    def spectral_milliseconds(self, packs: tuple[FactorPack, ...], wavelengths_nm: np.ndarray) -> float:
        """Time a megapixel of spectra: every wavelength carried to the pixel."""
        return self._timed(
            lambda: self.renderer.render_spectra(
                self._scene, self._camera, {"material": FactoredBrdf(packs)}, wavelengths_nm
            )
        )

    def _timed(self, draw: Callable[[], object]) -> float:
        draw()
        taken = []
        for _ in range(5):
            start = time.perf_counter()
            draw()
            taken.append(time.perf_counter() - start)
        return 1e3 * float(np.median(taken)) / (self._camera.width * self._camera.height_px / 1e6)
