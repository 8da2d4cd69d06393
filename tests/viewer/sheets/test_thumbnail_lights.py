"""The light of thumbnails: metals mirror something, and little but the ceiling's image is brighter than the display."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from metamer.lighting.reference.reference import reference_image
from metamer.lighting.scene_file.files import load_scene
from metamer.materials.intake.sources import read_sources
from metamer.materials.records.models import rebuild
from metamer.viewer.display.transform import CLIP_TOLERANCE
from metamer.viewer.picture import display_for

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def metals():
    return {
        source.id: rebuild(source.model, source.parameters)
        for source in read_sources(ROOT / "catalogs" / "shipped")
        if source.family == "metal"
    }


def shares(name, brdf):
    """Shares of the sphere that are clipped, and that are as good as black."""
    scene = load_scene(ROOT / "examples" / f"{name}.toml")
    scene = scene.with_material(scene.reviewed_part, "metal")
    camera = replace(scene.camera(), width=28, height_px=28, samples=1)
    xyz, coverage = reference_image(scene, camera, {"metal": brdf})
    seen, display = xyz[coverage == 1], display_for(scene)
    rgb = display.apply(seen @ display.adaptation_from(scene.adopted_white()).T)
    return np.mean((rgb > 1 + CLIP_TOLERANCE).any(axis=-1)), np.mean(seen[:, 1] < 0.02)


@pytest.mark.slow
def test_metals_mirror_the_booth_and_are_nowhere_black(metals):
    assert len(metals) >= 3
    for name, brdf in metals.items():
        clipped, dark = shares("thumbnail", brdf)
        # The bright ceiling's image in polished metal, which a booth shows too.
        assert clipped < 0.1 and dark < 0.02, (name, clipped, dark)
        assert dark < 0.2 * shares("sphere", brdf)[1]
