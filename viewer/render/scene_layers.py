"""Construction of an image's layers from a scene, its materials and colours, with cached light."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.lights import Light, SpreadLight
from ...lighting.scene import Scene
from ...lighting.transfer.hits import RAYS
from ...lighting.transfer.indirect import IndirectLight
from ...lighting.visibility.cache_limits import transfer_folder
from ...materials.core.fast import Fast
from ...runtime.errors import UnknownNameError
from ...runtime.worker_pool import usable_cores
from ...spectral.folding import Folding
from ...spectral.palette import Palette
from ...spectral.spectrum import Spectrum
from .cache import Needs
from .indirect_cache import IndirectCache, indirect_layers
from .layers import AnyLayer, Layer, SpreadLayer, layers_of_fields
from .light_cache import LightCache, Shadows

#: Filtering of factors: point sampled, or averaged over a sample's footprint.
Filtering = Literal["linear", "mipmapped"]
# Number of cached foldings by light and observer; each costs an integral over the observer's wavelengths.
_KEPT_FOLDINGS = 64
#: Names of work in progress reports: rays between parts, light along them, shadows of area and environment lights, and
#: the image itself.
INTERREFLECTION, BOUNCES, VISIBILITY, DRAWING = "interreflection", "bounces", "visibility", "drawing"
Colours = Callable[[Spectrum, Palette], Float[np.ndarray, "P R M3"]]


@dataclass(frozen=True)
class RenderSettings:
    """Settings of a session.

    Parameters
    ----------
    filtering : "linear" samples factors at each sample. "mipmapped" averages each factor over the sample's footprint
        (`pyramids`): highlights smaller than a sample neither alias nor are missed, but a mean of products is replaced
        by a product of means.
    keeps_terms : cache materials' terms at every pixel, so that other spectra in the same scene (`render_many`,
        `Scene.with_illuminant`, lights of other spectra, another observer, an environment's strength) cost only a fold.
        For windows and many illuminants; a single image is some tenths slower.
    jobs : processes for the visibility of large scenes; None: one per core.
    tile_samples : samples along a side of the windows drawn at once; None: as memory allows.
    rays : rays per vertex for indirect light. rays_folder : their cache, as by `metamer transfer build`; None: the
        user's cache.
    on_progress : called with (steps done, number of steps, name of the work); large images take minutes.
    on_message : called with a message when a long step begins, or a cache entry is recomputed.
    """

    filtering: Filtering = "linear"
    keeps_terms: bool = False
    jobs: int | None = None
    tile_samples: int | None = None
    rays: int = RAYS
    rays_folder: Path | None = None
    on_progress: Callable[[int, int, str], object] | None = None
    on_message: Callable[[str], object] = lambda words: None

    def __post_init__(self) -> None:
        """Check the name of the filtering; raises `UnknownNameError`."""
        if self.filtering not in get_args(Filtering):
            raise UnknownNameError("filtering", self.filtering, get_args(Filtering))

    def report(self, done: int, total: int, work: str) -> None:
        """Report progress."""
        if self.on_progress is not None:
            self.on_progress(done, total, work)


@dataclass(frozen=True, eq=False)
class SceneLayers:
    """Layers of an image, `scene` with its materials' holes cut, and the contents of tiles that the layers need.

    bounced : their indirect light, or None.
    """

    scene: Scene
    layers: list[AnyLayer]
    needs: Needs
    bounced: IndirectLight | None


class LayerBuilder:
    """Builder of layers, with caches of foldings, area and environment light, its shadows, and indirect light.

    lights, bounces : caches of light, shared by builders and threads.
    """

    def __init__(self, lights: LightCache | None = None, bounces: IndirectCache | None = None) -> None:
        self.lights = LightCache() if lights is None else lights
        self.bounces = IndirectCache() if bounces is None else bounces
        self._foldings: dict[tuple[int, ...], Folding] = {}
        self._groups: list[tuple[int, ...]] = []

    def release(self) -> None:
        """Forget everything."""
        self.lights.clear()
        self.bounces.release()
        self._groups = []
        self._foldings.clear()

    def build(
        self,
        settings: RenderSettings,
        scene: Scene,
        camera: Camera,
        surfaces: Mapping[str, Fast],
        colours: Colours,
        shown_in: Sequence[Spectrum] = (),
        whole: bool = True,
    ) -> SceneLayers:
        """Build all layers of an image; `colours` returns (P, R, 3 M) for a palette under a light's spectrum.

        shown_in : spectra that replace the lights' own. whole : False omits shadows of area and environment lights and
        indirect light that are not cached, instead of computing them.

        Raises
        ------
        UnknownNameError : a material of the scene is not in `surfaces`.
        """
        scene.check_surfaces(surfaces)
        scene = scene.cut(surfaces)
        indirect = self.indirect(settings, scene, surfaces, shown_in, whole)
        surfaces = {name: surfaces[name].without_holes() for name in scene.material_ids}
        frames = bool(scene.spread_lights) or indirect is not None
        needs = Needs(scene.needs_uv(surfaces), frames, settings.filtering == "mipmapped")
        lights = scene.delta_lights
        groups = self._light_groups(lights, settings.keeps_terms)
        layers: list[AnyLayer] = [
            Layer(number, group, one, colours(lights[group[0]].spectrum, one.palette))
            for number, part in enumerate(scene.parts)
            for group in groups
            for one in surfaces[part.material].summands
        ]
        layers += self._spread_layers(settings, scene, camera, surfaces, colours, whole)
        if indirect is not None:
            layers += indirect_layers(indirect, scene, camera, surfaces, colours)
        return SceneLayers(scene, layers, needs, indirect)

    def indirect(
        self,
        settings: RenderSettings,
        scene: Scene,
        surfaces: Mapping[str, Fast],
        shown_in: Sequence[Spectrum] = (),
        whole: bool = True,
    ) -> IndirectLight | None:
        """Return the scene's indirect light; None if there is none, or (not `whole`) none is cached."""
        if not whole and not self.bounces.knows(scene, surfaces, shown_in):
            return None
        folder, jobs = settings.rays_folder or transfer_folder(), settings.jobs or usable_cores()
        return self.bounces.light(
            scene, surfaces, shown_in, settings.report, folder, jobs, settings.on_message, settings.rays
        )

    def shadows(self, settings: RenderSettings, light: SpreadLight, scene: Scene, whole: bool = True) -> Shadows | None:
        """Return shadows of an area or environment light; None if nothing casts any, or (not `whole`) none is
        cached.
        """
        if not whole and not self.lights.knows(light, scene):
            return self.lights.seen_shadows(light, scene)
        jobs = settings.jobs or usable_cores()
        return self.lights.shadows(light, scene, jobs, settings.report, settings.on_message)

    def folded(
        self, scene: Scene, illuminants: Sequence[Spectrum | None], spectrum: Spectrum, palette: Palette
    ) -> Float[np.ndarray, "P R M3"]:
        """Fold a palette to XYZ under each illuminant, None being the light's own spectrum; foldings are cached, since
        all materials of a review share a basis.
        """
        spectra = tuple(spectrum if other is None else other for other in illuminants)
        key = (id(scene.observer), *(id(spectrum) for spectrum in spectra))
        if key not in self._foldings:
            if len(self._foldings) >= _KEPT_FOLDINGS:
                self._foldings.clear()
            self._foldings[key] = Folding(scene.observer, spectra)
        return palette.folded(self._foldings[key])

    def colours(self, scene: Scene, illuminants: Sequence[Spectrum | None]) -> Colours:
        """Return `folded` bound to a scene and illuminants, for `build`."""
        return partial(self.folded, scene, illuminants)

    def _light_groups(self, lights: Sequence[Light], keeps_terms: bool) -> list[tuple[int, ...]]:
        """Group lights of the same spectrum, which are folded together.

        Lights that once had different spectra stay separate, so that cached terms remain valid when their spectra
        change again.
        """
        groups = _by_spectrum(lights)
        if keeps_terms and sum(map(len, self._groups)) == len(lights):
            both = [tuple(one for one in group if one in kept) for kept in self._groups for group in groups]
            groups = [group for group in both if group]
        self._groups = groups
        return groups

    def _spread_layers(
        self,
        settings: RenderSettings,
        scene: Scene,
        camera: Camera,
        surfaces: Mapping[str, Fast],
        colours: Colours,
        whole: bool,
    ) -> Iterator[SpreadLayer]:
        """Yield the layers of area and environment lights, four fields of a light each."""
        scale = np.pi / scene.viewing.reference_illuminance_lux / camera.samples**2
        for light in scene.spread_lights:
            gathered, world_from_map = self.lights.gathered(light, scene)
            shadows = self.shadows(settings, light, scene, whole)
            weights = light.maps.weights if isinstance(light, EnvironmentLight) else np.ones(1)
            for number, part in enumerate(scene.parts):
                form = surfaces[part.material].environment_form()
                each = [
                    weight * colours(one, form.palette)[0] for weight, one in zip(weights, light.spectra, strict=True)
                ]
                yield from layers_of_fields(number, form, gathered, world_from_map, scale, each, shadows)


def _by_spectrum(lights: Sequence[Light]) -> list[tuple[int, ...]]:
    """Group the indices of lights by spectrum."""
    groups: dict[tuple[bytes, bytes], list[int]] = {}
    for number, light in enumerate(lights):
        groups.setdefault(light.spectrum.key, []).append(number)
    return [tuple(numbers) for numbers in groups.values()]
