"""What a renderer keeps from one picture for the next: geometry, what each sample sees, and materials' terms.

Each outlives what it does not depend on: geometry another camera, tiles other materials, terms other spectra.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.environment.gathering import GatheredLight
from ...lighting.environment.panel import GatheredPanel
from ...lighting.lights import SpreadLight
from ...lighting.scene import Scene
from ...lighting.transfer.indirect import IndirectLight
from ...materials.environment_form import EnvironmentForm
from ...materials.fast import Summand
from ...spectral.processes import usable_cores
from .geometry import LightGeometry, SceneGeometry, scene_geometry
from .light_cache import KeptLight, Shadows
from .raster import Window, WindowTriangles
from .view import View, view_key, view_of

# Samples times lights of which angles are kept between calls; larger pictures work them out again, tile by tile.
KEPT_SAMPLES = 8_000_000
# Bytes of terms that are kept between calls: beyond, they are worked out for each picture.
KEPT_TERMS = 1 << 28
#: What progress calls the work on what hides light that spreads.
VISIBILITY = "visibility"


@dataclass(frozen=True, eq=False)
class Layer:
    """One summand of one part's material under all lights of one spectrum: `colours` (P, R, 3 M) are its palette's XYZ
    under M spectra in its place.
    """

    part: int
    lights: tuple[int, ...]
    summand: Summand
    colours: Float[np.ndarray, "P R M3"]

    @property
    def terms_key(self) -> tuple:
        """Equal for layers whose terms are the same, whatever the spectra; good while the summand lives."""
        return self.part, self.lights, self.summand.key


@dataclass(frozen=True, eq=False)
class SpreadLayer:
    """One part's material under some of the fields of a light that spreads, at most four.

    fields : which of its fields. gathered : what they send. world_from_map (3, 3) : turns that.
    scale : pi / E_ref, of a sample's share. colours (1, F R, 3 M) : for each field, the form's palette in XYZ under M
    spectra in place of the field's, R rounded up to fours.
    """

    part: int
    fields: slice
    form: EnvironmentForm
    gathered: GatheredLight | GatheredPanel | IndirectLight
    world_from_map: Float[np.ndarray, "3 3"]
    scale: float
    colours: Float[np.ndarray, "1 FR M3"]
    shadows: Shadows | None = None

    @property
    def terms_key(self) -> tuple:
        """Key of terms as of `Layer`: maps, places and occlusion, never a spectrum."""
        gathered, shadows = self.gathered, self.shadows
        near = isinstance(gathered, GatheredPanel)
        sent = (gathered.corners.tobytes(), gathered.luminance) if near else (id(gathered),)
        hidden = None if shadows is None else (id(shadows.visibility), id(shadows.bright))
        place = self.part, self.world_from_map.tobytes(), self.fields.start, self.fields.stop, self.scale
        return "spread", *place, sent, hidden, self.form.key

    @property
    def rank(self) -> int:
        """F R."""
        return self.colours.shape[1]


@dataclass(eq=False)
class KeptTerms:
    """The terms of a layer at every pixel, light and visibility included: all of a picture but its spectra.

    of : whose they are, kept alive with them. nbytes : what they take.
    """

    of: Layer | SpreadLayer
    nbytes: int


@dataclass(eq=False)
class Tile:
    """What is worked out at every sample of a window of the picture: renderers add to it.

    coverage (h, w) : float32, of its pixels. with_uv : whether it knows texture coordinates; with_frames : and the
    frames of what is seen, which lights that spread ask for.
    """

    coverage: Float[np.ndarray, "h w"]
    with_uv: bool
    with_frames: bool


@dataclass(eq=False)
class Piece:
    """A window of the picture and what is kept of it.

    left, top : its first pixel. coverage (h, w) : None until it is known. tile : kept where there is room. terms : of
    the layers drawn last; None for those that do not show here.
    """

    window: Window
    left: int
    top: int
    coverage: Float[np.ndarray, "h w"] | None = None
    tile: Any = None
    terms: dict[tuple, Any] = field(default_factory=dict)


class Keeping(ABC):
    """Works geometry, tiles and terms out when they are asked for, and keeps them where there is room."""

    def __init__(self) -> None:
        #: Processes for the visibility of large scenes; None: one a core.
        self.jobs: int | None = None
        #: Samples along a side of what is drawn at once; None is as usual.
        self.tile_samples: int | None = None
        #: Hears which long step begins, and why something that was kept is worked out again.
        self.say: Callable[[str], object] = lambda words: None
        self._geometry: SceneGeometry | None = None
        self._view: View | None = None
        self._kept: list[Piece] = []
        self._terms_bytes = 0
        # Whether what is drawn needs texture coordinates: nobody pays for them otherwise.
        self._with_uv = False
        self._with_frames = False
        self._kept_light = KeptLight()

    def tiles(self, scene: Scene, camera: Camera) -> Iterator[Any]:
        """The picture's tiles, kept from the last call where that had the same geometry; each is good for one turn."""
        for piece in self._pieces(scene, camera):
            yield self._tile_of(piece)

    def _pieces(self, scene: Scene, camera: Camera) -> Iterator[Piece]:
        """The picture's windows, with what is kept of them; their tiles are good for one turn."""
        view = self._turned_to(scene, camera)
        samples = view.size[0] * view.size[1] * (len(view.scene.lights) + len(scene.spread_lights))
        for piece in self._kept:
            whole = False
            try:
                yield piece
                whole = True
            finally:
                # A caller that stops half way may have stopped in the middle of anything.
                if not (whole and samples <= KEPT_SAMPLES):
                    self._forget_tile(piece)

    def _viewed(self, geometry: SceneGeometry, camera: Camera) -> View:
        return view_of(geometry, camera)

    def _turned_to(self, scene: Scene, camera: Camera) -> View:
        """The camera's view of a scene, whose windows are kept with it; what was kept of another one is forgotten."""
        geometry = scene_geometry(scene, self._geometry)
        if self._view is None or geometry is not self._view.scene or view_key(camera) != view_key(self._view.camera):
            self._forget_view()
            self._keep_lights(geometry.lights)
            self._geometry, self._view = geometry, self._viewed(geometry, camera)
            side = camera.samples
            self._kept = [
                Piece(one, one.left // side, one.top // side) for one in self._view.windows(self.tile_samples)
            ]
        return self._view

    def _tile_of(self, piece: Piece) -> Any:
        """The tile of a piece, worked out anew where it is not kept."""
        if (tile := piece.tile) and (self._with_uv > tile.with_uv or self._with_frames > tile.with_frames):
            self._forget_tile(piece)
        if piece.tile is None:
            assert self._view is not None
            piece.tile = self._tile(self._view, piece.window, self._view.triangles(piece.window))
            piece.coverage = piece.tile.coverage
        return piece.tile

    def _coverage_of(self, piece: Piece) -> Float[np.ndarray, "h w"]:
        """The coverage of a piece, which is known without its tile once that was worked out."""
        return piece.coverage if piece.coverage is not None else self._tile_of(piece).coverage

    def release(self) -> None:
        """Forget everything that is kept and free what it holds on a GPU."""
        self._forget_view()
        self._keep_lights(())
        self._kept_light.clear()
        self._geometry = None

    def _forget_view(self) -> None:
        """Forget what is kept of the last camera's view."""
        for piece in self._kept:
            self._keep_terms(piece, ())
            self._forget_tile(piece)
        self._kept = []
        self._view = None

    def _forget_tile(self, piece: Piece) -> None:
        if piece.tile is not None:
            self._discard(piece.tile)
            piece.tile = None

    def _shadows(self, light: SpreadLight, scene: Scene) -> Shadows | None:
        """What hides a light; None where nothing hides anything."""
        return self._kept_light.shadows(light, scene, self.jobs or usable_cores(), self._say, self.say)

    def _say(self, done: int, total: int, what: str) -> None:  # noqa: B027
        """Progress of what takes long."""

    def _with_terms(
        self, piece: Piece, layers: Sequence[Layer | SpreadLayer], keep: bool
    ) -> Iterator[tuple[Layer | SpreadLayer, Any]]:
        """Each layer that shows in a piece, and its terms, which with `keep` are kept where there is room."""
        for layer in layers:
            key = layer.terms_key
            terms = piece.terms[key] if key in piece.terms else self._terms(self._tile_of(piece), layer)
            size = terms.nbytes if terms else 0
            if key not in piece.terms and keep and self._terms_bytes + size <= KEPT_TERMS:
                piece.terms[key] = terms
                self._terms_bytes += size
            if terms is None:
                continue
            try:
                yield layer, terms
            finally:
                if key not in piece.terms:
                    self._discard_terms(terms)

    def _keep_terms(self, piece: Piece, keys: Collection[tuple]) -> None:
        """Forget all kept terms of a piece but these."""
        for key in [key for key in piece.terms if key not in keys]:
            if (terms := piece.terms.pop(key)) is not None:
                self._terms_bytes -= terms.nbytes
                self._discard_terms(terms)

    @abstractmethod
    def _tile(self, view: View, window: Window, triangles: WindowTriangles) -> Any:
        """Everything in a window that does not depend on materials and spectra, as a kind of `Tile`."""

    @abstractmethod
    def _terms(self, tile: Any, layer: Layer | SpreadLayer) -> Any:
        """The terms of a layer at every pixel, as a kind of `KeptTerms`; None where the tile does not show them."""

    def _discard_terms(self, terms: Any) -> None:  # noqa: B027
        """Free what `_terms` took and the garbage collector does not."""

    def _keep_lights(self, lights: Sequence[LightGeometry]) -> None:  # noqa: B027
        """Free what is kept of all lights but these."""

    def _discard(self, tile: Any) -> None:  # noqa: B027
        """Free what `_tile` took."""
