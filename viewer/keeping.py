"""What a renderer keeps from one picture for the next: geometry, what each sample sees, and materials' terms.

Each outlives what it does not depend on: geometry another camera, tiles other materials, terms other spectra.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from ..lighting.camera import Camera
from ..lighting.environment.bright_light import BrightLight
from ..lighting.environment.environment import EnvironmentLight
from ..lighting.environment.gathering import GatheredLight
from ..lighting.environment.panel import GatheredPanel
from ..lighting.environment.softbox import SoftboxLight
from ..lighting.lights import SpreadLight
from ..lighting.mesh import Mesh
from ..lighting.scene import Scene
from ..lighting.transfer.indirect import IndirectLight
from ..lighting.visibility.before import Before
from ..lighting.visibility.cache import scene_visibility
from ..lighting.visibility.hidden_light import HiddenLight
from ..lighting.visibility.keeping import visibility_folder
from ..lighting.visibility.visibility import SceneVisibility
from ..materials.environment_form import EnvironmentForm
from ..materials.fast import Summand
from ..spectral.processes import usable_cores
from .geometry import LightGeometry, SceneGeometry, scene_geometry
from .raster import Window, WindowTriangles
from .view import View, view_key, view_of

# Samples times lights of which angles are kept between calls; larger pictures work them out again, tile by tile.
KEPT_SAMPLES = 8_000_000
# Bytes of terms that are kept between calls: beyond, they are worked out for each picture.
KEPT_TERMS = 1 << 28
# Prefiltered environments, some 20 MB each.
KEPT_ENVIRONMENTS = 4
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
class Shadows:
    """What hides a light that spreads: the visibility of the scene, and an environment's bright parts."""

    visibility: SceneVisibility
    bright: BrightLight | None = None

    @cached_property
    def hidden(self) -> HiddenLight:
        """What the scene's vertices lose of the light."""
        assert self.bright is not None
        return HiddenLight.of(self.visibility, self.bright)


@dataclass(frozen=True, eq=False)
class SpreadLayer:
    """One part's material under some of the fields of a light that spreads, at most four.

    light, fields : which of its fields. gathered : what it sends. world_from_map (3, 3) : turns that.
    scale : pi / E_ref, of a sample's share. colours (1, F R, 3 M) : for each field, the form's palette in XYZ under M
    spectra in place of the field's, R rounded up to fours.
    """

    part: int
    light: SpreadLight | IndirectLight
    fields: slice
    form: EnvironmentForm
    gathered: GatheredLight | GatheredPanel | IndirectLight
    world_from_map: Float[np.ndarray, "3 3"]
    scale: float
    colours: Float[np.ndarray, "1 FR M3"]
    shadows: Shadows | None = None

    @property
    def terms_key(self) -> tuple:
        """As of `Layer`."""
        return "spread", self.part, id(self.light), self.fields.start, self.scale, self.form.key

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
    the layers that were drawn last; None for those that do not show here.
    """

    window: Window
    left: int
    top: int
    coverage: Float[np.ndarray, "h w"] | None = None
    tile: Any = None
    terms: dict[tuple, Any] = field(default_factory=dict)


def _before(light: SpreadLight, scene: Scene) -> Before | None:
    """What of a scene may hide a light; None where all of it may."""
    if not isinstance(light, SoftboxLight):
        return None
    found = Before(light.position, light.axes[2])
    return None if all(found.holds(part.mesh.vertices) for part in scene.parts) else found


class Keeping(ABC):
    """Works geometry, tiles and terms out when they are asked for, and keeps them where there is room."""

    def __init__(self) -> None:
        #: Processes for the visibility of large scenes; None: one a core.
        self.jobs: int | None = None
        #: Hears which long step begins, and why something that was kept is worked out again.
        self.say: Callable[[str], object] = lambda words: None
        self._geometry: SceneGeometry | None = None
        self._view: View | None = None
        self._kept: list[Piece] = []
        self._terms_bytes = 0
        # Whether what is drawn needs texture coordinates: nobody pays for them otherwise.
        self._with_uv = False
        self._with_frames = False
        self._gathered: dict[int, tuple[np.ndarray, GatheredLight]] = {}
        self._shaded: tuple[Mesh, ...] | None = None
        self._visibility: dict[int | None, tuple[SpreadLight, SceneVisibility | None]] = {}
        self._bright: dict[int, tuple[np.ndarray, BrightLight]] = {}
        # As they are turned, by the same key and the rotation.
        self._turned: dict[tuple[int, bytes], BrightLight] = {}
        self._hiding: dict[tuple[int, int], Shadows] = {}

    def tiles(self, scene: Scene, camera: Camera) -> Iterator[Any]:
        """The picture's tiles, kept from the last call where that had the same geometry; each is good for one turn."""
        for piece in self._pieces(scene, camera):
            yield self._tile_of(piece)

    def _pieces(self, scene: Scene, camera: Camera) -> Iterator[Piece]:
        """The picture's windows, with what is kept of them; their tiles are good for one turn."""
        geometry = scene_geometry(scene, self._geometry)
        if self._view is None or geometry is not self._geometry or view_key(camera) != view_key(self._view.camera):
            self._forget_view()
            self._keep_lights(geometry.lights)
            self._geometry, self._view = geometry, view_of(geometry, camera)
            side = camera.samples
            self._kept = [Piece(one, one.left // side, one.top // side) for one in self._view.windows()]
        layers = len(geometry.lights) + len(scene.spread_lights)
        keep = self._view.size[0] * self._view.size[1] * layers <= KEPT_SAMPLES
        for piece in self._kept:
            whole = False
            try:
                yield piece
                whole = True
            finally:
                # A caller that stops half way may have stopped in the middle of anything.
                if not (keep and whole):
                    self._forget_tile(piece)

    def _tile_of(self, piece: Piece) -> Any:
        """The tile of a piece, worked out anew where it is not kept."""
        tile = piece.tile
        if tile is not None and (self._with_uv > tile.with_uv or self._with_frames > tile.with_frames):
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
        self._gathered.clear()
        self._bright.clear()
        self._turned.clear()
        self._visibility.clear()
        self._shaded = None
        self._hiding.clear()
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
        """What hides a light; None where nothing hides anything. Visibility is kept while the meshes are the same, the
        light's parts while its map is, however it is turned.
        """
        meshes = tuple(part.mesh for part in scene.parts)
        if self._shaded is None or [*map(id, self._shaded)] != [*map(id, meshes)]:
            self._shaded, self._visibility, self._hiding = meshes, {}, {}
        before = _before(light, scene)
        key = None if before is None else id(light)
        if key not in self._visibility:
            if len(self._visibility) >= KEPT_ENVIRONMENTS:
                self._visibility.clear()
            found = scene_visibility(
                scene, visibility_folder(), self.jobs or usable_cores(), self._say, self.say, before
            )
            self._visibility[key] = light, found
        visibility = self._visibility[key][1]
        if visibility is None or not isinstance(light, EnvironmentLight):
            return None if visibility is None else Shadows(visibility)
        bright = self._bright_light(light)
        pair = id(visibility), id(bright)
        if pair not in self._hiding:
            if len(self._hiding) >= KEPT_ENVIRONMENTS:
                self._hiding.pop(next(iter(self._hiding)))
            self._hiding[pair] = Shadows(visibility, bright)
        return self._hiding[pair]

    def _bright_light(self, environment: EnvironmentLight) -> BrightLight:
        """The bright parts of a light as it is turned; found once for its map, and the same object while it stays."""
        key, rotation = id(environment.fields), environment.world_from_map
        if key not in self._bright:
            if len(self._bright) >= KEPT_ENVIRONMENTS:
                self._bright.clear()
                self._turned.clear()
            self._bright[key] = environment.fields, BrightLight.of(replace(environment, rotation_deg=0.0))
        turned = key, rotation.tobytes()
        if turned not in self._turned:
            if len(self._turned) >= KEPT_ENVIRONMENTS:
                self._turned.pop(next(iter(self._turned)))
            self._turned[turned] = self._bright[key][1].turned(rotation)
        return self._turned[turned]

    def _say(self, done: int, total: int, what: str) -> None:  # noqa: B027
        """Progress of what takes long."""

    def _light_gathered(self, light: SpreadLight, scene: Scene) -> tuple[GatheredLight | GatheredPanel, np.ndarray]:
        """What a light that spreads sends, and how it is turned; kept for other rotations and spectra."""
        if isinstance(light, SoftboxLight):
            low, high = scene.bounds
            # As geometry is scaled, see `SceneGeometry`.
            return GatheredPanel.of(light, 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))), np.eye(3)
        if not isinstance(light, EnvironmentLight):
            raise TypeError(f"no renderer knows how to gather a {type(light).__name__}")
        key = id(light.fields)
        if key not in self._gathered:
            if len(self._gathered) >= KEPT_ENVIRONMENTS:
                self._gathered.clear()
            self._gathered[key] = light.fields, GatheredLight.of(light)
        return self._gathered[key][1], light.world_from_map

    def _with_terms(
        self, piece: Piece, layers: Sequence[Layer | SpreadLayer], keep: bool
    ) -> Iterator[tuple[Layer | SpreadLayer, Any]]:
        """Each layer that shows in a piece, and its terms, which with `keep` are kept where there is room."""
        self._keep_terms(piece, {layer.terms_key for layer in layers})
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
            terms = piece.terms.pop(key)
            if terms is not None:
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
        """Free what is kept of all lights but these and the garbage collector does not free."""

    def _discard(self, tile: Any) -> None:  # noqa: B027, for most renderers there is nothing to do
        """Free what `_tile` took and the garbage collector does not."""
