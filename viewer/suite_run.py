"""Rendering of a suite: a review for each scene, observer and camera, with all rows as one side of a comparison."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..calibration.regression.review_folder import review_side
from ..calibration.regression.row import ComparedSide, Row
from ..calibration.regression.suite import Suite
from ..lighting.scene import Scene
from ..lighting.scene_file.files import load_scene
from ..materials.catalogue.catalogue import Catalogue
from ..runtime.blas import blas
from ..runtime.distribution import installed_version
from ..runtime.progress import TimeLeft
from ..spectral.observers import observer
from .picture import Warn, unheard
from .render.session import RenderSession
from .review.expected_work import ReviewWork
from .review.files import picture_name
from .review.review import review

REVIEWS = "reviews"
Progress = Callable[[int, int, str], None]


def run_suite(
    suite: Suite,
    catalogue: Catalogue,
    out: Path,
    renderer: RenderSession,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    again: bool = False,
    progress: Progress | None = None,
    left: TimeLeft | None = None,
    warn: Warn = unheard,
    resumed: Callable[[int, int], None] = lambda found, total: None,
) -> ComparedSide:
    """Render missing reviews into `out/reviews`; `again` renders all.

    left : estimator of the remaining time, updated with expected and finished work of all reviews.

    Raises
    ------
    InputError : see `review`; a camera missing in a scene.
    """
    rows: list[Row] = []
    facts: dict[str, str] = {}
    chain: dict[str, None] = {}
    left, views = TimeLeft() if left is None else left, list(_views(suite, catalogue))
    for name, scene, camera in views:
        asked = suite.materials or None, suite.illuminants or None
        ReviewWork(out / REVIEWS / name, left).expect_scene(scene, catalogue, camera, *asked, jobs)
    for name, scene, camera in views:
        folder = out / REVIEWS / name
        review(
            scene,
            catalogue,
            folder,
            illuminants=suite.illuminants or None,
            materials=suite.materials or None,
            budget=suite.budget,
            renderer=renderer,
            camera=camera,
            jobs=jobs,
            scheduler=scheduler,
            version=installed_version(),
            progress=progress,
            left=left,
            warn=warn,
            again=again,
            resumed=resumed,
        )
        side = review_side(folder)
        rows += side.rows
        facts |= {f"plan of {name}" if label == "plan" else label: text for label, text in side.facts.items()}
        chain |= dict.fromkeys(side.chain)
    return ComparedSide(out, "suite", tuple(rows), facts, tuple(chain))


def environment() -> dict[str, str]:
    """Describe properties of this machine that may affect the last digits of colours."""
    return {
        "python": platform.python_version(),
        "numpy": np.__version__,
        "system": f"{platform.system()} {platform.machine()}",
        **blas().facts,
    }


def _views(suite: Suite, catalogue: Catalogue) -> Iterator[tuple[str, Scene, str | None]]:
    """Yield each scene with each observer and camera, and the folder's name."""
    for path in suite.scenes:
        scene = load_scene(path, catalogue)
        for eye in suite.observers:
            seen = scene if eye is None else replace(scene, observer=observer(eye))
            for camera in suite.cameras:
                view = scene.camera(camera).name
                yield picture_name(f"{path.stem}/{seen.observer.name}", view), seen, camera
