"""Light that comes by way of other surfaces, for renderers: found once for a scene, kept, and drawn in layers."""

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
    """Keeps the rays of the last scene while its meshes are the same, and its last few states' indirect light.

    keeps : states. Good for several renderers and threads: who works something out holds `lock`.
    """

    def __init__(self, keeps: int = 1) -> None:
        self.keeps, self.lock = keeps, threading.RLock()
        self._transport: tuple[tuple[object, ...], Transport] | None = None
        # Newest last.
        self._lights: list[tuple[tuple[object, ...], IndirectLight]] = []

    def release(self) -> None:
        """Forget both."""
        with self.lock:
            self._transport = None
            self._lights.clear()

    def knows(self, scene: Scene, surfaces: Mapping[str, Fast], shown_in: Sequence[Spectrum] = ()) -> bool:
        """Return whether `light` has nothing to work out."""
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
        """Return the scene's indirect light; None where it is not asked for, or where nothing of it could be seen.

        folder : rays of the geometry are taken from there, or traced and kept there; None keeps them in memory alone.
        jobs, say : see `kept_hits`. rays : of each site.

        Raises
        ------
        InputError : what `indirect_light` and `kept_hits` raise.
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
    """Return the scene with a number of bounces in place of "auto": as many as its picture has."""
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
    """Four fields a layer. A field's light is a spectrum times a function of the basis: its palette is the part's own
    times that function, under that spectrum, whatever it is folded with (`IndirectLight.coloured`).
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
    """Objects, not their numbers: what is kept keeps them alive."""
    meshes, worn = (part.mesh for part in scene.parts), (surfaces[part.material] for part in scene.parts)
    return (*meshes, *worn, *scene.lights, scene.observer, scene.viewing, *shown_in)


def _same(one: tuple[object, ...], other: tuple[object, ...]) -> bool:
    return len(one) == len(other) and all(a is b for a, b in zip(one, other, strict=True))
