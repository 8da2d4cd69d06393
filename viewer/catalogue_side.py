"""Catalogue as one side of a comparison: original data and fast form of each material on a sphere."""

from __future__ import annotations

from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..calibration.regression.picture_files import SeenSpectra
from ..calibration.regression.readings import pixel
from ..calibration.regression.row import FLOAT32_ROUNDOFF, ComparedSide, LayerKind, PixelLayer, Pixels, Row, RowName
from ..materials.catalogue.catalogue import Catalogue
from ..materials.catalogue.samples import measurement_of
from ..materials.core.protocol import sphere_protocol
from ..materials.records.record import MARKER, read_record
from ..runtime.errors import InputError
from ..spectral.folding import Folding
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer

_PIXELS = 96


class _Shown(NamedTuple):
    """XYZ of the sphere by light: original data and fast form."""

    reference: Float[np.ndarray, "M N 3"]
    picture: Float[np.ndarray, "M N 3"]


def is_catalogue(path: Path) -> bool:
    """Return whether a path is a folder of materials."""
    return (path / MARKER).is_file()


def catalogue_side(folder: Path, seen: SeenSpectra) -> ComparedSide:
    """Collect every surface and reflectance of a catalogue under each light.

    Raises
    ------
    InputError : a damaged file.
    """
    catalogue = Catalogue.open(folder)
    eye = observer(seen.observer).name
    rows, lights = [], []
    for material in catalogue.ids():
        record = catalogue.load(material)
        if not record.is_surface and record.quantity == "emission":
            lights.append(material)
            continue
        path, measured = catalogue.path(material), measurement_of(record)
        for index, light in enumerate(seen.lights):
            layers: dict[LayerKind, PixelLayer] = {
                "reading": PixelLayer(partial(_reading, path, light, seen.observer), path)
            }
            if record.is_surface:
                kinds: tuple[LayerKind, ...] = ("picture", "reference")
                layers = {kind: PixelLayer(partial(_sphere, path, seen, index, kind), path) for kind in kinds}
            rows.append(Row(RowName(material, light, eye), layers, measurement=measured))
    chain = [seen.words, f"Materials: {sphere_protocol(_PIXELS, False).text}; references are their original data."]
    if lights:
        chain.append(f"Lights have no white to be compared under, and are left out: {', '.join(lights)}.")
    return ComparedSide(folder, "catalogue", tuple(rows), {}, tuple(chain))


def _sphere(path: Path, seen: SeenSpectra, index: int, kind: LayerKind) -> Pixels:
    xyz = getattr(_shown(path, path.stat().st_mtime_ns, seen), kind)[index]
    white = observer(seen.observer).white(illuminant(seen.lights[index]))
    return Pixels(xyz[None].copy(), np.ones((1, len(xyz))), white, FLOAT32_ROUNDOFF)


# Both sides of the current material, and the next one.
@lru_cache(maxsize=3)
def _shown(path: Path, changed: int, seen: SeenSpectra) -> _Shown:
    """Compute both images of a material. `changed` : modification time of the file, as part of the cache key."""
    del changed
    record = read_record(path)
    sphere = sphere_protocol(_PIXELS, False)
    folding = Folding(observer(seen.observer), [illuminant(light) for light in seen.lights], np.pi)
    return _Shown(sphere.original_xyz(record.surface(), folding), sphere.fast_xyz(record.drawn(), folding))


def _reading(path: Path, light: str, eye: str) -> Pixels:
    record = read_record(path)
    spectrum = record.measured_spectrum()
    if spectrum is None or spectrum.samples.ndim != 1:
        raise InputError("no spectrum to compare", file=path, field=record.id, expected="one reflectance")
    weights = observer(eye).weights(illuminant(light), spectrum.wavelengths_nm)
    return pixel(weights @ spectrum.samples, weights.sum(axis=1))
