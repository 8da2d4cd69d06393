"""Materials of a catalogue on a sphere in the open: their stored environment forms, beside the originals.

A unit sphere is seen from afar along -z, in rings of points that stand for equal areas of the picture. Points of a ring
see one slice of an isotropic material, which is asked for once, at every wavelength, and summed with the light that
arrives at each of them: no drawing of directions, so that the noise is what a grid of half the nodes differs by.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...lighting.environment.booth import light_booth
from ...lighting.environment.environment import EnvironmentLight
from ...materials.catalogue.catalogue import Catalogue
from ...materials.core.environment_form import EnvironmentForm
from ...materials.core.points import Points
from ...materials.core.surface import Surface
from ...materials.slices.quadrature import BLOCK, Grids, slice_directions
from ...spectral.difference import delta_e_xyz
from ...spectral.folding import Folding
from ...spectral.observers import observer
from .light import PreparedLight
from .ours import gathered_by
from .rows import svbrdf_row
from .surface import ShadedPoints

#: The light that catalogues are always seen in; skies are of the data.
BOOTH = "booth-D65"
#: Names of what else they are seen in.
SKY = "kiara-dawn"
# Rings, and points a ring: of isotropic materials, and of others, whose points all see slices of their own.
RINGS, TURNED = (12, 24), (6, 16)
# Grids of the reference, and of the coarser one that its noise is estimated by.
FINE, COARSE = Grids((0.12, 0.24), 48, (90, 180)), Grids((0.12, 0.24), 24, (45, 90))


@dataclass(frozen=True, eq=False)
class _Sphere:
    """viewers (S, 3), local : of each ring. frames (S, n, 3, 3) : its points', rows are their axes in the world."""

    viewers: Float[np.ndarray, "S 3"]
    frames: Float[np.ndarray, "S n 3 3"]

    @property
    def points(self) -> ShadedPoints:
        """All of them, ring by ring."""
        frames = self.frames.reshape(-1, 3, 3)
        return ShadedPoints(np.swapaxes(frames, 1, 2), np.repeat(self.viewers, self.frames.shape[1], axis=0))


def catalogued(
    folder: Path,
    wanted: Callable[[str], bool],
    skies: Mapping[str, Callable[[], EnvironmentLight]],
    progress: Callable[[str], None],
) -> Iterator[dict]:
    """Yield a row for each material that is a surface without texture, in the booth and under each of `skies`."""
    catalogue = Catalogue.open(folder)
    names = [name for name in catalogue.match_surfaces("*") if wanted(name)]
    lights = {BOOTH: PreparedLight(light_booth("D65"))} if names else {}
    lights |= {name: PreparedLight(made()) for name, made in skies.items() if names}
    compared = {isotropic: _Compared(lights, isotropic) for isotropic in (True, False)}
    for name in names:
        material = catalogue.load(name)
        surface = material.surface()
        if surface.uses_uv:
            continue
        progress(name)
        yield from compared[surface.isotropic].rows(name, surface, material.drawn().environment_form())


class _Compared:
    """A sphere under some lights: what arrives at its points is worked out once for all materials."""

    def __init__(self, lights: Mapping[str, PreparedLight], isotropic: bool) -> None:
        self._lights, self._isotropic = lights, isotropic
        spectra = [spectrum for light in lights.values() for spectrum in light.spectra]
        self._folding = Folding(observer("1931_2"), spectra)
        self._sphere = _sphere(isotropic)
        self._grids: list[list[tuple[np.ndarray, np.ndarray]]] | None = None

    def rows(self, name: str, surface: Surface, form: EnvironmentForm) -> Iterator[dict]:
        """One a light."""
        if self._grids is None:
            # Not before it is needed: most catalogues have no anisotropic material.
            self._grids = [self._arriving(grids) for grids in (FINE, COARSE)]
        fine, coarse = (self._seen(surface, grid) for grid in self._grids)
        points, first = self._sphere.points, 0
        for light_name, light in self._lights.items():
            fields = slice(first, first + len(light.spectra))
            first = fields.stop
            begun = time.process_time()
            terms = gathered_by(form, points, light.environment)
            milliseconds = 1e9 / len(points) * (time.process_time() - begun)
            folded = form.palette.folded(Folding(observer("1931_2"), light.spectra))[0].reshape(
                form.palette.rank, -1, 3
            )
            found = np.einsum("nkr,rkc->nc", terms, folded)
            truth, rough = (each[:, fields].sum(axis=1) for each in (fine, coarse))
            white = light.white(points)
            noise = float(delta_e_xyz(truth, rough, white).mean()) / 3.0
            apart = delta_e_xyz(truth, found, white)
            yield svbrdf_row(name, "ours", light_name, apart, noise, lobes=form.count, ms_per_megapixel=milliseconds)

    def _arriving(self, grids: Grids) -> list[tuple[np.ndarray, np.ndarray]]:
        """Compute by ring directions (D, 3), local, and what arrives from them at its points, cd/m^2 sr (n, D, F)."""
        found = []
        for viewer, frames in zip(self._sphere.viewers, self._sphere.frames, strict=True):
            to, angles = slice_directions(viewer, grids)
            world = np.einsum("di,nij->ndj", to, frames).reshape(-1, 3)
            each = [light.environment.luminance(world, world) for light in self._lights.values()]
            arrives = np.concatenate(each, axis=1).reshape(len(frames), len(to), -1)
            found.append((to, (arrives * (angles * to[:, 2])[:, None]).astype(np.float32)))
        return found

    def _seen(self, surface: Surface, grid: Sequence[tuple[np.ndarray, np.ndarray]]) -> Float[np.ndarray, "N F 3"]:
        """XYZ of what each field makes of the surface at every point."""
        found = []
        for viewer, (to, arrives) in zip(self._sphere.viewers, grid, strict=True):
            each = (to[start : start + BLOCK] for start in range(0, len(to), BLOCK))
            xyz = [surface.xyz(Points(some, np.broadcast_to(viewer, some.shape)), self._folding) for some in each]
            values = np.concatenate(xyz).reshape(len(to), -1, 3)
            found.append(np.einsum("ndf,dfc->nfc", arrives, values, optimize=True))
        return np.concatenate(found)


def _sphere(isotropic: bool) -> _Sphere:
    """Rings of equal areas, each turned against the next by the golden section of a step."""
    rings, around = RINGS if isotropic else TURNED
    sine = np.sqrt((np.arange(rings) + 0.5) / rings)[:, None]
    turn = 2.0 * np.pi / around * (np.arange(rings)[:, None] * 0.6180339887498949 + np.arange(around))
    up = np.broadcast_to(np.sqrt(1.0 - sine**2), turn.shape)
    normal = np.stack([sine * np.cos(turn), sine * np.sin(turn), up], axis=-1)
    if isotropic:
        # Any tangent will do: with that towards the viewer a ring sees one slice.
        tangent = (np.array([0.0, 0.0, 1.0]) - up[..., None] * normal) / sine[..., None]
    else:
        tangent = np.stack([normal[..., 2], np.zeros_like(turn), -normal[..., 0]], axis=-1)
        tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    frames = np.stack([tangent, np.cross(normal, tangent), normal], axis=-2)
    if isotropic:
        return _Sphere(np.concatenate([sine, 0.0 * sine, np.sqrt(1.0 - sine**2)], axis=1), frames)
    frames = frames.reshape(-1, 1, 3, 3)
    return _Sphere(frames[:, 0, :, 2], frames)
