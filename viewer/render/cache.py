"""Interface of back ends, and the cache of geometry, tiles and terms of the last image.

Each is reused as long as its inputs are unchanged: geometry for other cameras, tiles for other materials, terms for
other spectra.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.scene import Scene
from .geometry import LightGeometry, SceneGeometry, scene_geometry
from .layers import AnyLayer
from .raster import TileWindow, WindowTriangles
from .view import View, view_key, view_of

# Limit of samples times lights with cached angles; larger images recompute them tile by tile.
KEPT_SAMPLES = 8_000_000
# Limit of cached terms, bytes; beyond, they are recomputed for each image.
KEPT_TERMS = 1 << 28


@dataclass(frozen=True)
class Needs:
    """Optional contents of tiles, computed only if a layer reads them.

    uv : texture coordinates. frames : shading frames, for area, environment and indirect light. mipmapped : spans of
    samples on factors and textures (`RenderSettings.filtering`).
    """

    uv: bool = False
    frames: bool = False
    mipmapped: bool = False

    def joined(self, other: Needs) -> Needs:
        """Return the contents that either needs."""
        return Needs(self.uv or other.uv, self.frames or other.frames, self.mipmapped or other.mipmapped)

    def met_by(self, there: Needs) -> bool:
        """Return whether a tile with the contents `there` suffices."""
        return self.uv <= there.uv and self.frames <= there.frames and self.mipmapped == there.mipmapped


@dataclass(eq=False)
class Tile:
    """Samples of a window of the image, in a back end's form; all have `coverage` (h, w) float32, by pixel."""

    needs: Needs


@dataclass(eq=False)
class KeptTerms:
    """Terms of a layer at every pixel, including light and visibility: everything but spectra.

    of : their layer, kept alive by the reference. nbytes : memory in bytes.
    """

    of: AnyLayer
    nbytes: int


class Backend(ABC):
    """Base class of back ends, which compute tiles, terms and sums; of a scene they cache only uploaded light tables.

    name : of the device, for images' headers. chunk : number of images added up at once.
    """

    name: str
    chunk: int

    @abstractmethod
    def tile(self, view: View, window: TileWindow, triangles: WindowTriangles, needs: Needs) -> Any:
        """Compute the `Tile` of a window, which is independent of materials and spectra."""

    @abstractmethod
    def terms(self, tile: Any, layer: AnyLayer) -> Any:
        """Compute a layer's terms at every pixel, as `KeptTerms`; None if the tile does not show it."""

    @abstractmethod
    def added_up(
        self, piece: Piece, layers: Sequence[AnyLayer], columns: slice, keep: bool, count: int
    ) -> AbstractContextManager[Sequence[Any]]:
        """Add up layers in a window under the spectra of `columns` of their colours, of `count` in total.

        Returns images that are valid within the context: numpy arrays (h, w, 3), or GPU textures.
        keep : whether layers' terms are cached for the next call.
        """

    def pixels(self, image: Any) -> Float[np.ndarray, "h w 3"]:
        """Read an image back."""
        return image

    def make_current(self) -> None:  # noqa: B027
        """Select the back end's device for subsequent calls on this thread."""

    def discard(self, kept: Any) -> None:  # noqa: B027
        """Free device memory of a tile or of terms."""

    def keep_lights(self, lights: Collection[LightGeometry]) -> None:  # noqa: B027
        """Free the uploaded tables of all lights but these."""

    def close(self) -> None:  # noqa: B027
        """Release the device; the back end cannot be used afterwards."""


class Piece:
    """Window of an image with its tile and terms, computed on demand.

    left, top : first pixel. size : width and height in pixels. tile : None if there was no room for it.
    terms : of the last drawn layers; None for those not visible here.
    """

    def __init__(self, cache: RenderCache, window: TileWindow, samples: int) -> None:
        self._cache = cache
        self.window, self.left, self.top = window, window.left // samples, window.top // samples
        self.size = window.width // samples, window.height // samples
        self.tile: Any = None
        self.terms: dict[tuple, Any] = {}
        self._coverage: Float[np.ndarray, "h w"] | None = None

    @property
    def coverage(self) -> Float[np.ndarray, "h w"]:
        """Coverage of its pixels, float32; kept when the tile is freed."""
        found = self.worked_out().coverage if self._coverage is None else self._coverage
        self._coverage = found
        return found

    @property
    def place(self) -> tuple[slice, slice]:
        """Rows and columns of the image that it fills."""
        width, height = self.size
        return slice(self.top, self.top + height), slice(self.left, self.left + width)

    def worked_out(self) -> Any:
        """Return the tile, with all contents that the cache needs."""
        cache = self._cache
        if self.tile is not None and not cache.needs.met_by(self.tile.needs):
            self.forget_tile()
        if self.tile is None:
            assert cache.view is not None
            triangles = cache.view.triangles(self.window)
            self.tile = cache.backend.tile(cache.view, self.window, triangles, cache.needs)
        return self.tile

    def with_terms(self, layers: Sequence[AnyLayer], keep: bool) -> Iterator[tuple[AnyLayer, Any]]:
        """Yield the layers visible here with their terms, which `keep` caches if there is room."""
        cache = self._cache
        for layer in layers:
            key = layer.terms_key
            terms = self.terms[key] if key in self.terms else cache.backend.terms(self.worked_out(), layer)
            size = terms.nbytes if terms else 0
            if key not in self.terms and keep and cache.terms_bytes + size <= KEPT_TERMS:
                self.terms[key] = terms
                cache.terms_bytes += size
            if terms is None:
                continue
            try:
                yield layer, terms
            finally:
                if key not in self.terms:
                    cache.backend.discard(terms)

    def keep_terms(self, keys: Collection[tuple]) -> None:
        """Free all cached terms but these."""
        for key in [key for key in self.terms if key not in keys]:
            if (terms := self.terms.pop(key)) is not None:
                self._cache.terms_bytes -= terms.nbytes
                self._cache.backend.discard(terms)

    def forget_tile(self) -> None:
        """Free the tile; coverage that was read is kept."""
        if self.tile is not None:
            self._cache.backend.discard(self.tile)
            self.tile = None


class RenderCache:
    """Cache of a scene's geometry, one camera's view of it and the windows of its image.

    needs : contents of tiles computed from now on. one_sided : meshes, by identity, with backface culling. terms_bytes
    : memory of all cached terms.
    """

    def __init__(self, backend: Backend) -> None:
        self.backend, self.needs = backend, Needs()
        self.one_sided: frozenset[int] = frozenset()
        #: Callback when a view is discarded, for owners of more data of it.
        self.on_forget_view: Callable[[], object] = lambda: None
        self.geometry: SceneGeometry | None = None
        self.view: View | None = None
        self.pieces: list[Piece] = []
        self._tile_samples: int | None = None
        self.terms_bytes = 0

    def turned_to(self, scene: Scene, camera: Camera, tile_samples: int | None = None) -> View:
        """Set the view to a camera's, and discard that of another one.

        tile_samples : samples along a window's side; None for the default.
        """
        geometry = scene_geometry(scene, self.geometry)
        if self.view is None or geometry is not self.view.scene or view_key(camera) != view_key(self.view.camera):
            self.forget_view()
            self.backend.keep_lights(geometry.lights)
            self.geometry, self.view = geometry, self.seen(geometry, camera)
        if not self.pieces or tile_samples != self._tile_samples:
            self._forget_pieces()
            self._tile_samples = tile_samples
            self.pieces = [Piece(self, one, camera.samples) for one in self.view.windows(tile_samples)]
        return self.view

    def seen(self, geometry: SceneGeometry, camera: Camera) -> View:
        """Return a camera's view of the geometry, with backface culling of one-sided meshes."""
        view = view_of(geometry, camera)
        solid = [id(mesh) in self.one_sided for mesh in geometry.meshes]
        if not any(solid):
            return view
        return replace(view, left_out=np.repeat(solid, np.diff(geometry.first_face)) & (view.side < 0.0))

    def windows(self, scene: Scene, camera: Camera, tile_samples: int | None = None) -> Iterator[Piece]:
        """Iterate over the image's windows; a tile is valid for one iteration, and cached if there is room."""
        self.backend.make_current()
        view = self.turned_to(scene, camera, tile_samples)
        samples = view.size[0] * view.size[1] * (len(view.scene.lights) + len(scene.spread_lights))
        for piece in self.pieces:
            whole = False
            try:
                yield piece
                whole = True
            finally:
                # An interrupted caller may leave a tile incomplete.
                if not (whole and samples <= KEPT_SAMPLES):
                    piece.forget_tile()

    def forget_view(self) -> None:
        """Discard the last camera's view and its data."""
        self.on_forget_view()
        self._forget_pieces()
        self.view = None

    def _forget_pieces(self) -> None:
        for piece in self.pieces:
            piece.keep_terms(())
            piece.forget_tile()
        self.pieces = []

    def release(self) -> None:
        """Discard everything and free device memory."""
        self.backend.make_current()
        self.forget_view()
        self.backend.keep_lights(())
        self.geometry = None
