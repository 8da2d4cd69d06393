"""What every renderer does alike: keep geometry between calls, fold materials with light and observer."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ..lighting.camera import Camera
from ..lighting.lights import Light
from ..lighting.scene import Scene
from ..materials.factors import FactorPack
from ..spectral.errors import UnknownNameError
from ..spectral.spectrum import Spectrum
from .geometry import SceneGeometry, geometry_key, scene_geometry

Picture = tuple[Float[np.ndarray, "H W 3"], Float[np.ndarray, "H W"]]
# Folded bases that are kept: each costs an integral over the observer's wavelengths.
_KEPT_FOLDS = 256


@dataclass(frozen=True, eq=False)
class Layer:
    """One pack of one part's material under one light: `weights` (R, 3 M) are its terms' XYZ under M spectra."""

    part: int
    light: int
    pack: FactorPack
    weights: Float[np.ndarray, "R M3"]


class Renderer(ABC):
    """Makes pictures of a scene whose materials are factor packs.

    A picture is (xyz, coverage): float32 XYZ (H, W, 3), row 0 on top, Y = 1 for a perfect diffuser that receives the
    scene's reference illuminance, premultiplied by coverage; coverage float32 (H, W) is the share of a pixel's sample
    points that meet a surface. Nothing is clipped: a fit that is negative somewhere shows as negative XYZ.

    What depends on meshes, camera and the places of lights alone is worked out once and kept for the next call. Use
    it as a context manager, or call `release`.
    """

    name: str

    def __init__(self) -> None:
        self._key: tuple | None = None
        self._scene: Scene | None = None
        self._prepared: Any = None
        self._folds: dict[tuple[int, int, int], tuple[object, np.ndarray]] = {}

    def render(
        self,
        scene: Scene,
        camera: Camera | None,
        packs: Mapping[str, tuple[FactorPack, ...]],
        lights: Sequence[Light] | None = None,
    ) -> Picture:
        """One picture; `camera` None takes the scene's first, `lights` replace those of the scene.

        Raises
        ------
        UnknownNameError : a material of the scene is not in `packs`.
        """
        if lights is not None:
            scene = replace(scene, lights=tuple(lights))
        return self.render_many(scene, camera, packs)[0]

    def render_many(
        self,
        scene: Scene,
        camera: Camera | None,
        packs: Mapping[str, tuple[FactorPack, ...]],
        illuminants: Sequence[Spectrum | None] = (None,),
    ) -> list[Picture]:
        """One picture for each illuminant, for little more than the cost of one.

        A spectrum replaces that of every light of the scene, at the same strength; None keeps the lights' own.
        """
        for part in scene.parts:
            if part.material_id not in packs:
                raise UnknownNameError("material", part.material_id, packs, file=scene.path, field=f"part {part.name}")
        prepared = self._geometry(scene, scene.camera() if camera is None else camera)
        layers = [
            Layer(number, index, pack, self._weights(scene, light, pack, illuminants))
            for number, part in enumerate(scene.parts)
            for index, light in enumerate(scene.lights)
            for pack in packs[part.material_id]
        ]
        xyz = self._shade(prepared, layers, len(illuminants))
        return [(picture, prepared.coverage) for picture in xyz]

    def release(self) -> None:
        """Forget the kept geometry and free what it holds on a GPU."""
        if self._prepared is not None:
            self._discard(self._prepared)
        self._key = self._scene = self._prepared = None

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_reason: object) -> None:
        self.release()

    @abstractmethod
    def _prepare(self, geometry: SceneGeometry) -> Any:
        """Everything that does not depend on materials and spectra; has `coverage` (H, W) float32."""

    @abstractmethod
    def _shade(self, prepared: Any, layers: Sequence[Layer], count: int) -> Float[np.ndarray, "M H W 3"]:
        """The sum of all layers, float32, for each of `count` spectra."""

    def _discard(self, prepared: Any) -> None:  # noqa: B027, for most renderers there is nothing to do
        """Free what `_prepare` took and the garbage collector does not."""

    def _geometry(self, scene: Scene, camera: Camera) -> Any:
        key = geometry_key(scene, camera)
        if key != self._key:
            self.release()
            self._prepared = self._prepare(scene_geometry(scene, camera))
            # Meshes are told apart by identity, which is theirs only while they live.
            self._key, self._scene = key, scene
        return self._prepared

    def _weights(
        self, scene: Scene, light: Light, pack: FactorPack, illuminants: Sequence[Spectrum | None]
    ) -> Float[np.ndarray, "R M3"]:
        folds = [self._fold(scene, pack, light.spectrum if other is None else other) for other in illuminants]
        return pack.spectral @ np.concatenate(folds, axis=1)

    def _fold(self, scene: Scene, pack: FactorPack, spectrum: Spectrum) -> Float[np.ndarray, "J 3"]:
        """XYZ of each coefficient under a light; kept, because one basis serves every material of a review."""
        key = (id(pack.basis), id(spectrum), id(scene.observer))
        if key not in self._folds:
            if len(self._folds) >= _KEPT_FOLDS:
                self._folds.clear()
            held = (pack.basis, spectrum, scene.observer)
            self._folds[key] = (held, pack.basis.fold(spectrum, scene.observer).T)
        return self._folds[key][1]
