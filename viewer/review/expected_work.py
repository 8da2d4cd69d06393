"""Expected work of a review, for estimating the remaining time.

Each case has a reference, computed in separate processes, and rows; the report of all comes last. Only ratios of
seconds matter: `TimeLeft` scales them by the work done.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from ...lighting.camera import Camera
from ...lighting.scene import Scene
from ...materials.catalogue.catalogue import Catalogue
from ...materials.records.models import MEASURED
from ...materials.records.record_head import read_head
from ...runtime.progress import TimeLeft
from ..render.picture_cost import picture_cost
from .cases import pictured_scenes, reviewed_lights_of

# A reference beside that of a gloss paint: of matt materials, of measured ones, and of those whose sums over directions
# a process has from one before.
_MATT, _MEASURED, _FURTHER = 0.3, 4.0, 0.2
_MATT_MODELS = ("lambert", "oren_nayar", "fluorescent_lambert")
# Models whose references take longer than that of a gloss paint, in parts of it.
_METAL, _METAL_MODELS = 3.0, ("cook_torrance",)
# Seconds of a row, and of each pixel of its pictures; and of a row in the report.
_ROW, _ROW_PIXEL, _REPORT_ROW = 0.1, 3e-6, 0.05
# Seconds of the first case's: of shaders, and of light that is gathered once.
_FIRST_ROWS = 4.0


class ReviewWork:
    """Work of one review in an estimate for several successive ones, identified by `out`."""

    def __init__(self, out: Path, left: TimeLeft) -> None:
        self._out, self._left = out, left

    def expect(
        self,
        scenes: Sequence[tuple[Scene, Sequence[str]]],
        catalogue: Catalogue,
        views: tuple[Camera, Camera | None],
        lights: int,
        jobs: int,
    ) -> None:
        """Set the expected cases, each a scene and its judged materials, and the number of lights; idempotent.

        In each process the first case of a model takes longer than later ones.
        """
        if (self._out, "report") in self._left:
            return
        self._left.jobs = jobs
        compared, shown = views
        size = compared.width * compared.height_px + (0 if shown is None else shown.width * shown.height_px)
        each = picture_cost(scenes[0][0], compared, "reference").seconds
        known: Counter[tuple[str, ...]] = Counter()
        rows = 0
        for number, (scene, judged) in enumerate(scenes):
            models = tuple(read_head(catalogue.path(name))["model"] for name in scene.material_ids)
            known[models] += 1
            seconds, of = each * max(map(_beside_gloss, models)), f"reference of {', '.join(models)}"
            if known[models] > jobs:
                seconds, of = _FURTHER * seconds, f"further {of}"
            self._left.expect((self._out, "reference", number), of, seconds, evenly=True)
            count = len(judged) * lights
            self._left.expect((self._out, "rows", number), "rows", count * (_ROW + _ROW_PIXEL * size), "behind")
            rows += count
        self._left.expect((self._out, "report"), "report", _REPORT_ROW * rows, "last")

    def expect_scene(
        self,
        scene: Scene,
        catalogue: Catalogue,
        camera: str | None,
        materials: Sequence[str] | None,
        illuminants: Sequence[str] | None,
        jobs: int,
    ) -> None:
        """Set the expected cases of a later review: see `review`."""
        views = scene.camera(camera), None
        lights = len(reviewed_lights_of(scene, illuminants))
        self.expect(pictured_scenes(scene, catalogue, materials), catalogue, views, lights, jobs)

    def there(self, number: int) -> None:
        """Mark a case whose rows exist."""
        for what in ("reference", "rows"):
            self._left.done((self._out, what, number), 0.0)

    def first(self, number: int) -> None:
        """Mark the case whose rows are drawn first."""
        self._left.expect((self._out, "rows", number), "first rows", _FIRST_ROWS, "behind")

    def traced(self, number: int, share: float) -> None:
        """Set the finished share of a case's reference."""
        self._left.at((self._out, "reference", number), share)

    def rows(self, number: int, share: float) -> None:
        """Set the finished share of a case's rows."""
        self._left.at((self._out, "rows", number), share)

    def report(self, share: float) -> None:
        """Set the finished share of the report."""
        self._left.at((self._out, "report"), share)


def _beside_gloss(model: str) -> float:
    if model in MEASURED:
        return _MEASURED
    return _MATT if model in _MATT_MODELS else _METAL if model in _METAL_MODELS else 1.0
