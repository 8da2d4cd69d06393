"""Cache of area and environment lights: prefiltered light, occlusion and bright parts."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from ...lighting.environment.bright_light import BrightLight
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.environment.panel import GatheredPanel
from ...lighting.environment.prefiltering import GatheredLight
from ...lighting.environment.softbox import SoftboxLight
from ...lighting.lights import SpreadLight
from ...lighting.mesh.mesh import Mesh
from ...lighting.scene import Scene
from ...lighting.visibility.cache import is_kept, scene_visibility
from ...lighting.visibility.cache_limits import visibility_folder
from ...lighting.visibility.half_space import Before
from ...lighting.visibility.hidden_light import HiddenLight
from ...lighting.visibility.precompute import SECONDS_A_VERTEX, SeenPoints, visibility_cost
from ...lighting.visibility.sites import nothing_hides, pieces_of
from ...lighting.visibility.visibility import SceneVisibility

# Number of cached prefiltered environments, some 20 MB each.
KEPT_ENVIRONMENTS = 4
#: Largest CPU seconds of visibility for which no preliminary image is needed.
SOON_SECONDS = 4.0
Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class Shadows:
    """Occlusion of an area or environment light: the visibility of the scene, and an environment's bright parts."""

    visibility: SceneVisibility
    bright: BrightLight | None = None

    @cached_property
    def hidden(self) -> HiddenLight:
        """Occluded light at the scene's vertices."""
        assert self.bright is not None
        return HiddenLight.of(self.visibility, self.bright)


class LightCache:
    """Cache that can be shared by renderers and threads; computations hold `lock`.

    Visibility is valid while meshes are unchanged, a light's bright parts while its map is, for any rotation.
    """

    def __init__(self) -> None:
        # Two locks, so that lights can be prefiltered while another thread computes shadows for tens of seconds.
        self.lock, self._gathering = threading.RLock(), threading.RLock()
        # Points whose shadows are computed first, and these shadows, by light.
        self._seen: SeenPoints | None = None
        self._seen_shadows: dict[tuple, Shadows] = {}
        self._gathered: dict[int, tuple[np.ndarray, GatheredLight]] = {}
        self._shaded: tuple[Mesh, ...] | None = None
        self._visibility: dict[tuple | None, SceneVisibility | None] = {}
        self._bright: dict[int, tuple[np.ndarray, BrightLight]] = {}
        # Rotated bright parts, by the same key and the rotation.
        self._turned: dict[tuple[int, bytes], BrightLight] = {}
        self._hiding: dict[tuple[int, int], Shadows] = {}

    def clear(self) -> None:
        """Forget everything."""
        with self.lock, self._gathering:
            for kept in (self._gathered, self._bright, self._turned, self._visibility, self._hiding):
                kept.clear()
            self._shaded, self._seen, self._seen_shadows = None, None, {}

    def knows(self, light: SpreadLight, scene: Scene) -> bool:
        """Return whether `gathered` and `shadows` take negligible time."""
        if not self.lock.acquire(blocking=False):
            return False
        try:
            if isinstance(light, EnvironmentLight) and id(light.maps.maps) not in self._gathered:
                return False
            if not self._same_meshes(scene) or _key(light, scene) not in self._visibility:
                return False
            visibility = self._visibility[_key(light, scene)]
            if visibility is None or not isinstance(light, EnvironmentLight):
                return True
            turned = self._turned.get((id(light.maps.maps), light.world_from_map.tobytes()))
            return turned is not None and (id(visibility), id(turned)) in self._hiding
        finally:
            self.lock.release()

    def find_first(self, points: SeenPoints | None) -> None:
        """Set points whose shadows future calls of `shadows` compute first.

        None removes them and the preliminary shadows. Call it when the camera moves.
        """
        with self._gathering:
            self._seen, self._seen_shadows = points, {}

    def seen_shadows(self, light: SpreadLight, scene: Scene) -> Shadows | None:
        """Return shadows around the points of `find_first`, dark elsewhere; None before they are computed."""
        return self._seen_shadows.get(self._light_key(light, scene))

    def _keep_seen(
        self, light: SpreadLight, scene: Scene, seen: SeenPoints | None, visibility: SceneVisibility
    ) -> None:
        shadows = Shadows(visibility)
        if isinstance(light, EnvironmentLight):
            shadows = Shadows(visibility, self._bright_light(light))
            _ = shadows.hidden
        with self._gathering:
            if seen is self._seen:
                self._seen_shadows = {**self._seen_shadows, self._light_key(light, scene): shadows}

    def _light_key(self, light: SpreadLight, scene: Scene) -> tuple:
        """Return the key of a light's shadows: occluders, and the rotated light."""
        turned = (id(light.maps.maps), light.world_from_map.tobytes()) if isinstance(light, EnvironmentLight) else ()
        return _key(light, scene), turned, *(id(part.mesh) for part in scene.parts)

    def soon_has(self, light: SpreadLight, scene: Scene) -> bool:
        """Return whether `shadows` takes little time: cached here or on disk, no occluders, or a small scene."""
        if self.knows(light, scene):
            return True
        if is_kept(scene, visibility_folder(), _before(light, scene)):
            return True
        if len(scene.parts) == 1 and nothing_hides(pieces_of(scene)):
            return True
        # Refinement adds vertices; it is skipped if there are many anyhow.
        least = SECONDS_A_VERTEX * sum(len(part.mesh.vertices) for part in scene.parts)
        return least < SOON_SECONDS and visibility_cost(scene).cpu_seconds < SOON_SECONDS

    def gathered(self, light: SpreadLight, scene: Scene) -> tuple[GatheredLight | GatheredPanel, np.ndarray]:
        """Return the prefiltered light of an area light or environment, the latter with unweighted maps, and its
        rotation.

        Cached for other rotations, spectra, observers and strengths.
        """
        if isinstance(light, SoftboxLight):
            low, high = scene.bounds
            # Scaled like `SceneGeometry`.
            return GatheredPanel.of(light, 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))), np.eye(3)
        if not isinstance(light, EnvironmentLight):
            raise TypeError(f"no renderer knows how to gather a {type(light).__name__}")
        key = id(light.maps.maps)
        with self._gathering:
            if key not in self._gathered:
                if len(self._gathered) >= KEPT_ENVIRONMENTS:
                    self._gathered.clear()
                self._gathered[key] = light.maps.maps, GatheredLight.of(light.unweighted)
            return self._gathered[key][1], light.world_from_map

    def shadows(
        self, light: SpreadLight, scene: Scene, jobs: int, progress: Progress, say: Callable[[str], object]
    ) -> Shadows | None:
        """Return the occlusion of a light; None if nothing occludes anything."""
        with self.lock:
            if not self._same_meshes(scene):
                self._shaded, self._visibility, self._hiding = tuple(part.mesh for part in scene.parts), {}, {}
            key = _key(light, scene)
            if key not in self._visibility:
                if len(self._visibility) >= KEPT_ENVIRONMENTS:
                    self._visibility.clear()
                before, seen = _before(light, scene), self._seen
                seen_only = partial(self._keep_seen, light, scene, seen)
                found = scene_visibility(scene, visibility_folder(), jobs, progress, say, before, seen, seen_only)
                self._visibility[key] = found
            visibility = self._visibility[key]
            if visibility is None or not isinstance(light, EnvironmentLight):
                return None if visibility is None else Shadows(visibility)
            bright = self._bright_light(light)
            pair = id(visibility), id(bright)
            if pair not in self._hiding:
                if len(self._hiding) >= KEPT_ENVIRONMENTS:
                    self._hiding.pop(next(iter(self._hiding)))
                self._hiding[pair] = Shadows(visibility, bright)
            return self._hiding[pair]

    def _same_meshes(self, scene: Scene) -> bool:
        return self._shaded is not None and [*map(id, self._shaded)] == [id(part.mesh) for part in scene.parts]

    def _bright_light(self, environment: EnvironmentLight) -> BrightLight:
        """Return the bright parts of a rotated light; cached for its map, and the same object while the rotation
        stays.
        """
        key, rotation = id(environment.maps.maps), environment.world_from_map
        if key not in self._bright:
            if len(self._bright) >= KEPT_ENVIRONMENTS:
                self._bright.clear()
                self._turned.clear()
            of_maps = replace(environment.unweighted, rotation_deg=0.0)
            self._bright[key] = environment.maps.maps, BrightLight.of(of_maps)
        turned = key, rotation.tobytes()
        if turned not in self._turned:
            if len(self._turned) >= KEPT_ENVIRONMENTS:
                self._turned.pop(next(iter(self._turned)))
            self._turned[turned] = self._bright[key][1].turned(rotation)
        return self._turned[turned]


def visibilities(scene: Scene) -> int:
    """Count the visibilities that a scene's area and environment lights need."""
    return len({_key(light, scene) for light in scene.spread_lights})


def _key(light: SpreadLight, scene: Scene) -> tuple | None:
    """Return a key by the position of a light that only part of the scene can occlude; None for others."""
    before = _before(light, scene)
    return None if before is None else (before.point.tobytes(), before.facing.tobytes())


def _before(light: SpreadLight, scene: Scene) -> Before | None:
    """Return the half space of occluders of a light; None if the whole scene may occlude it.

    A softbox entirely outside of the scene's bounding box has nothing behind it that matters, since rays through it
    leave the box. It then shares the visibility of environment lights.
    """
    if not isinstance(light, SoftboxLight):
        return None
    low, high = scene.bounds
    if ((light.corners >= high).all(axis=0) | (light.corners <= low).all(axis=0)).any():
        return None
    found = Before(light.position, light.axes[2])
    return None if all(found.holds(part.mesh.vertices) for part in scene.parts) else found
