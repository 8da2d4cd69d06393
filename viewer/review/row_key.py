"""Key of a review's rows, a hash of all their inputs, for reusing rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from ...calibration.report.plots import embedded_side
from ...lighting.camera import Camera
from ...lighting.plan import ScenePlan
from ...lighting.scene import Scene
from ...materials.catalogue.catalogue import Catalogue
from ...materials.records.record_head import read_head
from ...runtime.code_hash import product_hash
from ...runtime.fingerprint import fingerprint, kept_fingerprint
from ...spectral.spectrum import Spectrum
from ..display.transform import DisplayTransform
from .cases import ReviewCase, Setting

# Folders of code that affects rows, unlike pages and commands.
_CODE = ("runtime", "spectral", "materials", "lighting", "calibration", "viewer")
_KINDS = (".py", ".glsl", ".vert", ".frag")
# Fields of a scene that do not affect images: its file and other views; its name is part of image headers.
_UNSEEN = ("cameras", "path", "review", "notes")


def row_key(
    scene: Scene,
    view: Camera,
    catalogue: Catalogue,
    names: Sequence[str],
    spectra: Sequence[Spectrum | None],
    plan: ScenePlan,
    display: DisplayTransform,
    budget: float,
    total: int,
    more: Sequence[str | bool],
) -> str:
    """Hash the inputs of one scene's rows under all lights; `total` is the review's number of rows, `more` is hashed
    unchanged.
    """
    shown = _told(scene, *_UNSEEN, "parts", "lights")
    # Cases of a review share meshes and lights, whose large hashes are cached.
    parts = [(_told(part, "mesh"), kept_fingerprint(part.mesh)) for part in scene.parts]
    lit = [kept_fingerprint(light) for light in scene.lights]
    checksums = [read_head(catalogue.path(material_id))["checksum"] for material_id in scene.material_ids]
    lights = [tuple(names), tuple(spectra), plan.basis, plan.precision]
    shows = (display.processor.getCacheID(), display.display, display.adaptation)
    rest = (float(budget), embedded_side(total), tuple(more), _code_hash())
    return fingerprint(shown, parts, lit, view, checksums, lights, shows, *rest)


def case_key(setting: Setting, catalogue: Catalogue, case: ReviewCase, checked: bool) -> str:
    """Hash the inputs of a case's rows; `checked`: including the report's self-checks."""
    it = setting
    lit, more = (it.names, it.spectra), (it.renderer.made_by, it.version, *case.judged, checked)
    if it.shown_view is not None:
        more = (*more, f"shown in {it.shown_view.width} x {it.shown_view.height_px}")
    return row_key(case.scene, it.view, catalogue, *lit, case.plan, it.display, it.budget, it.total, more)


def _told(value: Any, *but: str) -> dict[str, Any]:
    """Return the fields of a dataclass by name, except some."""
    return {each.name: getattr(value, each.name) for each in fields(value) if each.name not in but}


def _code_hash() -> str:
    """Hash the code for rendering and comparison, and the versions of libraries."""
    return product_hash(_CODE, _KINDS)
