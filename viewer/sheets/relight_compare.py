"""Comparison of a scene before and after a change of materials or light, part by part.

Light is additive, so that the change of an image is the sum of changes of direct and indirect light. Each is judged
alone, with the other one unchanged. Rays between surfaces depend on geometry only and are shared by both images
(`RenderSettings.rays_folder`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from time import perf_counter

import numpy as np
from jaxtyping import Float

from ...calibration.report.statistics import DeltaEStatistics, delta_e_map, delta_e_statistics
from ...lighting.reference.geometry import visible_geometry
from ...lighting.scene import Scene
from ...materials.catalogue.catalogue import Catalogue
from ...spectral.adaptation import adaptation_matrix
from ..picture import Picture, Warn, picture, unheard
from ..render.session import RenderSession


@dataclass(frozen=True, eq=False)
class PartChange:
    """Effect of a change on the pixels of one part, in ΔE94 from before to after.

    before, after : its material. all : with all light. directly : with only direct light changed.
    by_others : with only indirect light changed. None for a part without pixels of its own.
    """

    part: str
    before: str
    after: str
    all: DeltaEStatistics | None
    directly: DeltaEStatistics | None
    by_others: DeltaEStatistics | None


@dataclass(frozen=True, eq=False)
class Relit:
    """Two states of a scene from one camera.

    seconds_before, seconds_after : total time of the image with bounces.
    """

    before: Picture
    after: Picture
    parts: tuple[PartChange, ...]
    bounces_before: int
    bounces_after: int
    seconds_before: float
    seconds_after: float


def dressed(scene: Scene, materials: Mapping[str, str]) -> Scene:
    """Return the scene with other materials (ids) on some parts.

    Raises
    ------
    UnknownNameError : unknown part.
    """
    for part, material in materials.items():
        scene = scene.with_material(part, material)
    return scene


def relit(
    before: Scene,
    after: Scene,
    catalogue: Catalogue,
    renderer: RenderSession,
    camera: str | None = None,
    warn: Warn = unheard,
) -> Relit:
    """Render both states and compare them part by part.

    If the white changes, the image after is adapted to the white before (Bradford).

    Parameters
    ----------
    before, after : with identical geometry (`dressed`, `Scene.with_illuminant`), each with its `bounces`.

    Raises
    ------
    UnknownNameError : a material that is not in the catalogue, an unknown camera.
    InputError : see `RenderSession.render`.
    """
    # The image after is rendered last, so that the renderer's `bounced` refers to it.
    straight = [picture(replace(one, bounces=0), catalogue, camera, renderer).xyz for one in (before, after)]
    drawn, seconds, bounces = [], [], []
    for one in (before, after):
        begun = perf_counter()
        drawn.append(picture(one, catalogue, camera, renderer, warn))
        seconds.append(perf_counter() - begun)
        bounces.append(0 if renderer.bounced is None else renderer.bounced.bounces)
    white = drawn[0].white
    adapted = adaptation_matrix(drawn[1].white, white).T
    first, last = drawn[0].xyz.astype(float), drawn[1].xyz @ adapted
    first_straight, last_straight = straight[0].astype(float), straight[1] @ adapted
    changed = (last, last_straight + (first - first_straight), first_straight + (last - last_straight))
    whole = _whole_pixels((before, after), drawn[0], catalogue)
    maps = [delta_e_map(first, one, white, drawn[0].coverage) for one in changed]
    parts = []
    for number, (old, new) in enumerate(zip(before.parts, after.parts, strict=True)):
        mine = whole == number
        found = [delta_e_statistics(one, mine) if (mine & ~np.isnan(one)).any() else None for one in maps]
        parts.append(PartChange(old.name, old.material, new.material, *found))
    return Relit(drawn[0], drawn[1], tuple(parts), *bounces, *seconds)


def _whole_pixels(states: Sequence[Scene], drawn: Picture, catalogue: Catalogue) -> Float[np.ndarray, "H W"]:
    """Return the index of the only part visible in a pixel in all states; NaN for several parts or none."""
    cut = [one.cut({name: catalogue.surface(name).drawn() for name in one.material_ids}) for one in states]
    # Without holes all states have the same visible geometry.
    holed = [one for one in cut if any(hole is not None for hole in one.cutouts)]
    return reduce(_agreed, [_shown_alone(one, drawn) for one in (cut if holed else cut[:1])])


def _shown_alone(scene: Scene, drawn: Picture) -> Float[np.ndarray, "H W"]:
    seen = visible_geometry(scene, drawn.view)
    found = np.full(seen.rows * seen.width, np.nan)
    for number in range(len(scene.parts)):
        share = np.bincount(seen.pixel[seen.part == number], minlength=len(found))
        found[share == seen.samples] = number
    return found.reshape(seen.rows, seen.width)


def _agreed(one: Float[np.ndarray, "H W"], other: Float[np.ndarray, "H W"]) -> Float[np.ndarray, "H W"]:
    return np.where(one == other, one, np.nan)
