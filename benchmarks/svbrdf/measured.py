"""Measured materials as a few lobes: the fit's error on a sphere under one light, and its time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from ...materials.core.brdf import Brdf
from ...materials.core.protocol import sphere_protocol
from ..factor.measured import material_of_file, written_surface
from ..papers.gaussian_lobes.fit import fit_gaussians
from .rows import svbrdf_row

#: Lobes allowed to a fit, and pixels across the sphere on which it is judged, in the protocol's light.
LOBES, PIXELS = 3, 96
LIGHT = "D65"


def materials(data: Path | None) -> dict[str, Callable[[], Brdf]]:
    """MERL's materials that there are, by case: files of `brdf/merl`, and those that `brdf/merl-fits` can write."""
    if data is None:
        return {}
    found = {}
    script = data / "brdf" / "merl-fits" / "write_binary.py"
    if script.is_file():
        with np.load(script.with_name("fits.npz")) as fits:
            names = sorted({key.split("/")[0] for key in fits.files})
        found = {f"MERL {name}": partial(written_surface, script, name) for name in names}
    return found | {
        f"MERL {file.stem}": partial(material_of_file, file) for file in sorted((data / "brdf/merl").glob("*.binary"))
    }


def measured_rows(
    data: Path | None, wanted: Callable[[str], bool], progress: Callable[[str], None]
) -> Iterator[tuple[dict, float]]:
    """Yield each material's row and the fit's CPU seconds. The reference is the table, pixel by pixel: no noise."""
    sphere = sphere_protocol(PIXELS, True, light=LIGHT)
    for name, made in materials(data).items():
        if not wanted(name):
            continue
        progress(name)
        surface = made()
        begun = time.process_time()
        found = fit_gaussians(surface, LOBES)
        seconds = time.process_time() - begun
        reference = sphere.reference(surface)
        begun = time.process_time()
        sample = sphere.reference(found)
        milliseconds = 1e9 / len(sample) * (time.process_time() - begun)
        apart = sphere.differences(reference, sample)
        yield svbrdf_row(name, "ours", LIGHT, apart, 0.0, lobes=LOBES, ms_per_megapixel=milliseconds), seconds
