"""Cache of indirect light, and its layers."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.scene import Scene
from ...lighting.transfer.hits import RAYS
from ...lighting.transfer.indirect import IndirectLight, indirect_light, needs_none
from ...lighting.transfer.transport import Transport
from ...lighting.visibility.cache_limits import transfer_folder
from ...materials.core.fast import Fast
from ...spectral.palette import Palette
from ...spectral.spectrum import Spectrum
from .layers import SpreadLayer, layers_of_fields

Progress = Callable[[int, int, str], None]


class IndirectCache:
    """Cache of the last scene's rays while its meshes are the same, and of the indirect light of its last states.

    keeps : number of states. It can be shared by renderers and threads; computations hold `lock`.
    """

    def __init__(self, keeps: int = 1) -> None:
        self.keeps, self.lock = keeps, threading.RLock()
        self._transport: tuple[tuple[object, ...], Transport] | None = None
        # Newest last.
        self._lights: list[tuple[tuple[object, ...], IndirectLight]] = []

    def release(self) -> None:
        """Discard rays and states."""
        with self.lock:
            self._transport = None
            self._lights.clear()

    def knows(self, scene: Scene, surfaces: Mapping[str, Fast], shown_in: Sequence[Spectrum] = ()) -> bool:
        """Return whether `light` has nothing to compute."""
        if scene.bounces == 0:
            return True
        if not self.lock.acquire(blocking=False):
            return False
        try:
            return self._kept(_key(scene, surfaces, shown_in), scene) is not None or needs_none(scene)
        finally:
            self.lock.release()

    def light(
        self,
        scene: Scene,
        surfaces: Mapping[str, Fast],
        shown_in: Sequence[Spectrum],
        progress: Progress,
        folder: Path | None = None,
        jobs: int = 1,
        say: Callable[[str], object] = lambda words: None,
        rays: int = RAYS,
    ) -> IndirectLight | None:
        """Return the scene's indirect light; None if it is disabled or there can be none.

        folder : cache of rays on disk; None caches them in memory only.
        jobs, say : see `kept_hits`. rays : per site.

        Raises
        ------
        InputError : see `indirect_light` and `kept_hits`.
        """
        if scene.bounces == 0 or needs_none(scene):
            return None
        meshes, key = tuple(part.mesh for part in scene.parts), _key(scene, surfaces, shown_in)
        with self.lock:
            if self._transport is not None and self._transport[1].hits.rays != rays:
                self.release()
            known = self._kept(key, scene)
            if known is None:
                if self._transport is None or not _same(self._transport[0], meshes):
                    traced = Transport.of(scene, rays, progress=progress, folder=folder, jobs=jobs, say=say)
                    self._transport = meshes, traced
                known = indirect_light(scene, surfaces, self._transport[1], shown_in, progress=progress)
                self._lights = [*self._lights, (key, known)][-self.keeps :]
        return known if known.bounces else None

    def _kept(self, key: tuple[object, ...], scene: Scene) -> IndirectLight | None:
        for of, light in self._lights:
            if _same(of, key) and light.asked == scene.bounces:
                return light
        return None


def with_counted_bounces(scene: Scene, surfaces: Mapping[str, Fast], shown_in: Sequence[Spectrum] = ()) -> Scene:
    """Replace "auto" by the number of bounces in the scene's image."""
    if scene.bounces != "auto":
        return scene
    light = IndirectCache().light(scene, surfaces, shown_in, lambda done, total, what: None, transfer_folder())
    return replace(scene, bounces=0 if light is None else light.bounces)


def indirect_layers(
    light: IndirectLight,
    scene: Scene,
    camera: Camera,
    surfaces: Mapping[str, Fast],
    colours: Callable[[Spectrum, Palette], Float[np.ndarray, "P R M3"]],
) -> Iterator[SpreadLayer]:
    """Yield layers of four fields each. A field's light is a spectrum times a function of the basis, so that its
    palette is the part's own times that function, under that spectrum (`IndirectLight.coloured`).
    """
    scale = np.pi / scene.viewing.reference_illuminance_lux / camera.samples**2
    for number, part in enumerate(scene.parts):
        form = surfaces[part.material].environment_form()
        each = []
        for field in range(light.fields):
            spectrum, coloured = light.coloured(form.palette, field)
            each.append(colours(spectrum, coloured)[0])
        yield from layers_of_fields(number, form, light, np.eye(3), scale, each)


def _key(scene: Scene, surfaces: Mapping[str, Fast], shown_in: Sequence[Spectrum]) -> tuple[object, ...]:
    """Return a key of objects, not of their ids, so that the cache keeps them alive."""
    meshes, worn = (part.mesh for part in scene.parts), (surfaces[part.material] for part in scene.parts)
    return (*meshes, *worn, *scene.lights, scene.observer, scene.viewing, *shown_in)


def _same(one: tuple[object, ...], other: tuple[object, ...]) -> bool:
    return len(one) == len(other) and all(a is b for a, b in zip(one, other, strict=True))
