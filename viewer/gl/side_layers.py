"""Sides of a comparison as layers: materials and lights of each, found before anything is drawn.

The light of a side that shows an influence is that which a part gives all others: with the part, less with it black.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.lights import SpreadLight
from ...lighting.scene import Scene
from ...lighting.transfer.indirect import IndirectLight
from ...materials.factored.pack import matt_brdf
from ...materials.fast import Fast
from ...spectral.errors import InputError
from ...spectral.palette import Palette
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from ..render.geometry import knows_geometry, same_geometry, scene_geometry
from ..render.indirect_cache import Bouncing, indirect_layers
from ..render.keeping import Layer, SpreadLayer
from ..render.light_cache import Shadows
from .renderer import GLRenderer, with_and_without_terms
from .side import Side

if TYPE_CHECKING:
    import moderngl

# What a part wears to show what it gives others: no id of a catalogue has capitals.
_BLACK = "the part without its light/BLACK"


@cache
def _black() -> Fast:
    return matt_brdf(np.zeros(1), Palette.of(np.ones((1, len(WORKING_WAVELENGTHS_NM)))))


def _blackened(side: Side, scene: Scene) -> Scene:
    assert side.influence is not None
    return scene.with_material(side.influence, _BLACK)


# Layers that are drawn from terms, and others.
Split = tuple[list[Layer | SpreadLayer], list[Layer | SpreadLayer]]


@dataclass(frozen=True, eq=False)
class Prepared:
    """All sides of a comparison as they are drawn: the layers of each; `scene` has the geometry of all."""

    scene: Scene
    camera: Camera
    layers: tuple[Split, ...]
    with_uv: bool
    with_frames: bool

    @cached_property
    def keys(self) -> set[tuple]:
        """Of all terms that may be kept."""
        return {layer.terms_key for kept, _ in self.layers for layer in kept}


class SideRenderer(GLRenderer):
    """A `GLRenderer` of sides: what they are drawn of."""

    def __init__(self, context: moderngl.Context | None = None, keeps_terms: bool = False) -> None:
        super().__init__(context, keeps_terms=keeps_terms)
        #: Whether what takes long is worked out when it is missing, as shadows of light that spreads, and bounces; else
        #: pictures are without it.
        self.whole = True
        self._bouncing = Bouncing(keeps=4)

    def share_light(self, other: SideRenderer) -> None:
        """Keep what is found of lights together with another one."""
        self._kept_light, self._bouncing = other._kept_light, other._bouncing

    def prepared(self, sides: Sequence[Side], camera: Camera) -> Prepared:
        """What is to be drawn of each side; what is kept serves all: their scenes differ in materials, spectra and
        observers alone.

        Raises
        ------
        InputError : the sides' meshes or the places of their lights differ; whatever `render` raises.
        """
        scenes: list[Scene] = []
        layers: list[Split] = []
        needs = np.zeros(2, dtype=bool)
        for side in sides:
            scene, found = self._layers_of(side, camera)
            needs |= self._with_uv, self._with_frames
            scenes.append(scene)
            layers.append(with_and_without_terms(found, self.keeps_terms))
        if not all(same_geometry(scenes[0], other) for other in scenes[1:]):
            expected = "the same meshes and places of lights"
            raise InputError("sides of different geometry", field="sides", expected=expected)
        return Prepared(scenes[0], camera, tuple(layers), bool(needs[0]), bool(needs[1]))

    def work_out(self, sides: Sequence[Side]) -> None:
        """All that takes long before anything is drawn, without the GPU: another thread may do it."""
        self._geometry = scene_geometry(sides[0].scene.cut(sides[0].surfaces), self._geometry)
        for side in sides:
            scene, shown_in = side.drawn
            scene = scene.cut(side.surfaces)
            for light in scene.spread_lights:
                self._kept_light.gathered(light, scene)
                shadows = self._shadows(light, scene)
                if shadows is not None and shadows.bright is not None:
                    _ = shadows.hidden
            for one in self._states(side, scene):
                self._indirect(*one, shown_in)

    def has_worked_out(self, sides: Sequence[Side]) -> bool:
        """Whether `work_out` has nothing to do."""
        first = sides[0].scene.cut(sides[0].surfaces)
        if not knows_geometry(first, self._geometry):
            return False
        for side in sides:
            scene, shown_in = side.drawn
            scene = scene.cut(side.surfaces)
            if not all(self._kept_light.knows(light, scene) for light in scene.spread_lights):
                return False
            if not all(self._bouncing.knows(*one, shown_in) for one in self._states(side, scene)):
                return False
        return True

    def bounces_of(self, side: Side) -> int:
        """Of what has been drawn of a side: surfaces that its light may have come by."""
        scene, shown_in = side.drawn
        light = self._indirect(scene.cut(side.surfaces), side.surfaces, shown_in)
        return 0 if light is None else light.bounces

    def share_geometry(self, other: SideRenderer) -> None:
        """Take over what another one has of the scene's meshes and lights."""
        if other._geometry is not None:
            self._geometry = other._geometry

    def _states(self, side: Side, scene: Scene) -> list[tuple[Scene, Mapping[str, Fast]]]:
        """The scenes whose indirect light a side shows: of an influence two, with the part as it is and black."""
        if side.influence is None:
            return [(scene, side.surfaces)]
        return [(scene, side.surfaces), (_blackened(side, scene), {**side.surfaces, _BLACK: _black()})]

    def _layers_of(self, side: Side, camera: Camera) -> tuple[Scene, list[Layer | SpreadLayer]]:
        scene, shown_in = side.drawn
        colours = partial(self._one_colour, side)
        scene, found = self._layers(scene, camera, side.surfaces, colours, shown_in)
        if side.influence is None:
            return scene, found
        number = [part.name for part in scene.parts].index(side.influence)
        found, self._with_frames = [], True
        for sign, (state, surfaces) in zip((1.0, -1.0), self._states(side, scene), strict=True):
            light = self._indirect(state, surfaces, shown_in)
            bare = {name: surfaces[name].without_holes() for name in state.material_ids}
            for layer in [] if light is None else indirect_layers(light, state, camera, bare, colours):
                if layer.part != number:
                    found.append(replace(layer, colours=sign * layer.colours))
        return scene, found

    def _indirect(
        self, scene: Scene, surfaces: Mapping[str, Fast], shown_in: Sequence[Spectrum] = ()
    ) -> IndirectLight | None:
        if not self.whole and not self._bouncing.knows(scene, surfaces, shown_in):
            return None
        return super()._indirect(scene, surfaces, shown_in)

    def _shadows(self, light: SpreadLight, scene: Scene) -> Shadows | None:
        return super()._shadows(light, scene) if self.whole or self._kept_light.knows(light, scene) else None

    def _one_colour(self, side: Side, spectrum: Spectrum, palette: Palette) -> Float[np.ndarray, "P R 3"]:
        return side.dimming * self._colours(side.scene, spectrum, palette, (side.illuminant,))
