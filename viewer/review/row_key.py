"""Key of a review's rows, a hash of all that they depend on: rows that were drawn from the very same things are not
drawn again.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import requires
from pathlib import Path

from ...calibration.report.plots import embedded_side
from ...lighting.camera import Camera
from ...lighting.plan import ScenePlan
from ...lighting.scene import Scene
from ...materials.catalogue.catalogue import Catalogue
from ...materials.records.record_head import read_head
from ...runtime.code_hash import files_hash
from ...runtime.distribution import DISTRIBUTION
from ...runtime.fingerprint import fingerprint
from ...spectral.spectrum import Spectrum
from ..display.transform import DisplayTransform

# Folders of code that draws or compares; pages and commands change no row.
_CODE = ("runtime", "spectral", "materials", "lighting", "calibration", "viewer")
_KINDS = (".py", ".glsl", ".vert", ".frag")


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
    """Return the hash of one scene's rows under all lights: `total` rows has the review, and `more` counts as it is."""
    # Where the scene came from and what else could be seen of it changes no picture; its name stands in their headers.
    shown = replace(scene, cameras=(view,), path=None, review=None, notes=())
    checksums = [read_head(catalogue.path(material_id))["checksum"] for material_id in scene.material_ids]
    lights = [tuple(names), tuple(spectra), plan.basis, plan.precision]
    shows = (display.processor.getCacheID(), display.display, display.adaptation)
    return fingerprint(shown, checksums, lights, shows, float(budget), embedded_side(total), tuple(more), _code_hash())


@cache
def _code_hash() -> str:
    """Hash the code that draws and compares, and the versions of what it calls."""
    root = Path(__file__).parents[2]
    files = [path for name in _CODE for path in (root / name).rglob("*") if path.suffix in _KINDS]
    lines = (line for line in requires(DISTRIBUTION) or () if "extra ==" not in line)
    return files_hash(root, files, sorted(re.split(r"[^\w.-]", line)[0] for line in lines))
