"""Layers of the sides of a comparison, prepared before drawing.

The influence of a part on all others is the light with the part minus the light with the part black.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.scene import Scene
from ...materials.core.fast import Fast
from ...materials.factored.pack import matt_brdf
from ...runtime.errors import InputError
from ...spectral.palette import Palette
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from ..render.cache import Needs
from ..render.geometry import knows_geometry, same_geometry, scene_geometry
from ..render.indirect_cache import indirect_layers
from ..render.layers import AnyLayer, split_by_terms
from ..render.scene_layers import Colours
from ..render.session import RenderSession
from .side import CanvasSide

# Id of the black material for influences; ids in catalogues have no capitals.
_BLACK = "the part without its light/BLACK"


@cache
def _black() -> Fast:
    return matt_brdf(np.zeros(1), Palette.of(np.ones((1, len(WORKING_WAVELENGTHS_NM)))))


def _blackened(side: CanvasSide, scene: Scene) -> Scene:
    assert side.influence is not None
    return scene.with_material(side.influence, _BLACK)


# Layers drawn from terms, and others.
Split = tuple[list[AnyLayer], list[AnyLayer]]


@dataclass(frozen=True, eq=False)
class PreparedSide:
    """Sides of a comparison prepared for drawing: the layers of each; `scene` has their common geometry."""

    scene: Scene
    camera: Camera
    layers: tuple[Split, ...]
    needs: Needs

    @cached_property
    def keys(self) -> set[tuple]:
        """Return the keys of all terms that can be cached."""
        return {layer.terms_key for kept, _ in self.layers for layer in kept}


class SideLayers:
    """Preparation of the sides of a comparison: their layers, and expensive light.

    whole : whether missing shadows of area and environment lights and indirect light, which take long, are computed;
    else images lack them.
    """

    def __init__(self, session: RenderSession) -> None:
        self.session, self.whole = session, True

    def prepared(self, sides: Sequence[CanvasSide], camera: Camera) -> PreparedSide:
        """Build each side's layers with shared caches: scenes may differ only in materials, spectra and observers.

        Raises
        ------
        InputError : the sides' meshes or the positions of their lights differ; errors of `LayerBuilder.build`.
        """
        scenes: list[Scene] = []
        layers: list[Split] = []
        needs = Needs()
        settings = self.session.settings
        for side in sides:
            scene, found, needs_of_side = self._layers_of(side, camera)
            needs = needs.joined(needs_of_side)
            scenes.append(scene)
            layers.append(split_by_terms(found, settings.keeps_terms))
        if not all(same_geometry(scenes[0], other) for other in scenes[1:]):
            expected = "the same meshes and places of lights"
            raise InputError("sides of different geometry", field="sides", expected=expected)
        return PreparedSide(scenes[0], camera, tuple(layers), needs)

    def work_out(self, sides: Sequence[CanvasSide]) -> None:
        """Compute everything expensive before drawing, without the GPU, possibly on another thread."""
        layers, settings, cache = self.session.layers, self.session.settings, self.session.cache
        cache.geometry = scene_geometry(sides[0].scene.cut(sides[0].surfaces), cache.geometry)
        for side in sides:
            scene, shown_in = side.drawn
            scene = scene.cut(side.surfaces)
            for light in scene.spread_lights:
                layers.lights.gathered(light, scene)
                shadows = layers.shadows(settings, light, scene, self.whole)
                if shadows is not None and shadows.bright is not None:
                    _ = shadows.hidden
            for one in self._states(side, scene):
                layers.indirect(settings, *one, shown_in, self.whole)

    def has_worked_out(self, sides: Sequence[CanvasSide]) -> bool:
        """Return whether `work_out` has nothing to do."""
        layers = self.session.layers
        if not knows_geometry(sides[0].scene.cut(sides[0].surfaces), self.session.cache.geometry):
            return False
        for side in sides:
            scene, shown_in = side.drawn
            scene = scene.cut(side.surfaces)
            if not all(layers.lights.knows(light, scene) for light in scene.spread_lights):
                return False
            if not all(layers.bounces.knows(*one, shown_in) for one in self._states(side, scene)):
                return False
        return True

    def bounces_of(self, side: CanvasSide) -> int:
        """Return the number of bounces in a side's rendering."""
        scene, shown_in = side.drawn
        layers, settings = self.session.layers, self.session.settings
        light = layers.indirect(settings, scene.cut(side.surfaces), side.surfaces, shown_in, self.whole)
        return 0 if light is None else light.bounces

    def _states(self, side: CanvasSide, scene: Scene) -> list[tuple[Scene, Mapping[str, Fast]]]:
        """Return the states whose indirect light a side shows: two for an influence, with the part as is and black."""
        if side.influence is None:
            return [(scene, side.surfaces)]
        return [(scene, side.surfaces), (_blackened(side, scene), {**side.surfaces, _BLACK: _black()})]

    def _layers_of(self, side: CanvasSide, camera: Camera) -> tuple[Scene, list[AnyLayer], Needs]:
        scene, shown_in = side.drawn
        colours, layers, settings = self._colours_of(side), self.session.layers, self.session.settings
        built = layers.build(settings, scene, camera, side.surfaces, colours, shown_in, self.whole)
        if side.influence is None:
            return built.scene, built.layers, built.needs
        number = [part.name for part in built.scene.parts].index(side.influence)
        found: list[AnyLayer] = []
        for sign, (state, surfaces) in zip((1.0, -1.0), self._states(side, built.scene), strict=True):
            light = layers.indirect(settings, state, surfaces, shown_in, self.whole)
            bare = {name: surfaces[name].without_holes() for name in state.material_ids}
            for layer in [] if light is None else indirect_layers(light, state, camera, bare, colours):
                if layer.part != number:
                    found.append(replace(layer, colours=sign * layer.colours))
        return built.scene, found, replace(built.needs, frames=True)

    def _colours_of(self, side: CanvasSide) -> Colours:
        folded = self.session.layers.colours(side.scene, (side.illuminant,))

        def dimmed(spectrum: Spectrum, palette: Palette) -> Float[np.ndarray, "P R 3"]:
            return side.dimming * folded(spectrum, palette)

        return dimmed
