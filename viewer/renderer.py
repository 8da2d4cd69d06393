"""What every renderer does alike: keep geometry between calls, fold materials with light and observer."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
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
from .raster import Window, WindowTriangles

Picture = tuple[Float[np.ndarray, "H W 3"], Float[np.ndarray, "H W"]]
# Samples times lights of which angles are kept between calls; larger pictures work them out again, tile by tile.
KEPT_SAMPLES = 8_000_000
# Folded bases that are kept: each costs an integral over the observer's wavelengths.
_KEPT_FOLDS = 256


@dataclass(frozen=True, eq=False)
class Layer:
    """One pack of one part's material under one light: `weights` (R, 3 M) are its terms' XYZ under M spectra."""

    part: int
    light: int
    pack: FactorPack
    weights: Float[np.ndarray, "R M3"]


@dataclass(eq=False)
class Tile:
    """What is worked out once for a window of the picture: renderers add to it.

    left, top : its first pixel. coverage (h, w) : float32, of its pixels.
    """

    left: int
    top: int
    coverage: Float[np.ndarray, "h w"]


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
        self._geometry: SceneGeometry | None = None
        self._tiles: list[Any] = []
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
        camera = scene.camera() if camera is None else camera
        layers = [
            Layer(number, index, pack, self._weights(scene, light, pack, illuminants))
            for number, part in enumerate(scene.parts)
            for index, light in enumerate(scene.lights)
            for pack in packs[part.material_id]
        ]
        xyz = np.zeros((len(illuminants), camera.height_px, camera.width, 3), dtype=np.float32)
        coverage = np.zeros((camera.height_px, camera.width), dtype=np.float32)
        for tile in self.tiles(scene, camera):
            height, width = tile.coverage.shape
            place = slice(tile.top, tile.top + height), slice(tile.left, tile.left + width)
            xyz[:, *place] = self._shade(tile, layers, len(illuminants))
            coverage[place] = tile.coverage
        return [(picture, coverage) for picture in xyz]

    def tiles(self, scene: Scene, camera: Camera) -> Iterator[Any]:
        """The picture's tiles, kept from the last call where that had the same geometry; each is good for one turn."""
        key = geometry_key(scene, camera)
        if key != self._key:
            self.release()
            self._geometry = scene_geometry(scene, camera)
            # Meshes are told apart by identity, which is theirs only while they live.
            self._key, self._scene = key, scene
        if self._tiles:
            yield from self._tiles
            return
        geometry = self._geometry
        assert geometry is not None
        keep = geometry.size[0] * geometry.size[1] * len(geometry.lights) <= KEPT_SAMPLES
        made, whole = [], False
        try:
            for window, triangles in geometry.windows():
                tile = self._tile(geometry, window, triangles)
                made.append(tile)
                yield tile
                if not keep:
                    self._discard(made.pop())
            whole = True
        finally:
            # A caller that stops half way leaves nothing behind, and no half a picture to be taken for a whole one.
            if not whole:
                for tile in made:
                    self._discard(tile)
        self._tiles = made

    def release(self) -> None:
        """Forget the kept geometry and free what it holds on a GPU."""
        for tile in self._tiles:
            self._discard(tile)
        self._tiles = []
        self._key = self._scene = self._geometry = None

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_reason: object) -> None:
        self.release()

    @abstractmethod
    def _tile(self, geometry: SceneGeometry, window: Window, triangles: WindowTriangles) -> Any:
        """Everything in a window that does not depend on materials and spectra, as a kind of `Tile`."""

    @abstractmethod
    def _shade(self, tile: Any, layers: Sequence[Layer], count: int) -> Float[np.ndarray, "M h w 3"]:
        """The sum of all layers for each of `count` spectra."""

    def _discard(self, tile: Any) -> None:  # noqa: B027, for most renderers there is nothing to do
        """Free what `_tile` took and the garbage collector does not."""

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
