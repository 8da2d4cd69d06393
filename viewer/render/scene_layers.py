"""Layers of a picture from a scene, its materials and colours; light that takes long is kept."""

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

#: Look-up of factors between samples: as they are, or averaged over what a sample spans.
Filtering = Literal["linear", "mipmapped"]
# Lights with their observer whose folded bases are kept: each costs an integral over the observer's wavelengths.
_KEPT_FOLDINGS = 64
#: Names of work as progress has it: on rays from one part to another and the light along them, on shadows of area and
#: environment lights, and on the picture itself.
INTERREFLECTION, BOUNCES, VISIBILITY, DRAWING = "interreflection", "bounces", "visibility", "drawing"
Colours = Callable[[Spectrum, Palette], Float[np.ndarray, "P R M3"]]


@dataclass(frozen=True)
class RenderSettings:
    """Settings of a session.

    Parameters
    ----------
    filtering : "linear" reads factors off at each sample. "mipmapped" takes each factor's mean over what the sample
        spans (`pyramids`): a highlight that is smaller than a sample neither sparkles nor is missed, at the price of a
        product of means in place of a mean of products.
    keeps_terms : materials' terms at every pixel are kept, too: the same scene in other spectra (`render_many`,
        `Scene.with_illuminant`, lights of other spectra, another observer, an environment's strength) costs a fold.
        For windows and many illuminants; a single picture is some tenths slower.
    jobs : processes for the visibility of large scenes; None: one a core.
    tile_samples : samples along a side of the windows that are drawn at once; None: as memory allows.
    rays : rays from each vertex, for indirect light. rays_folder : where they are kept, as by `metamer transfer build`;
        None: in the user's cache.
    on_progress : called with (steps done, steps in all, name of the work); large pictures take minutes.
    on_message : called with a line when a long step begins, and why something kept is worked out again.
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
        """Refuse filtering of another name: `UnknownNameError`."""
        if self.filtering not in get_args(Filtering):
            raise UnknownNameError("filtering", self.filtering, get_args(Filtering))

    def report(self, done: int, total: int, work: str) -> None:
        """Pass progress on."""
        if self.on_progress is not None:
            self.on_progress(done, total, work)


@dataclass(frozen=True, eq=False)
class SceneLayers:
    """Layers of a picture: `scene` with its materials' holes cut, and the contents of tiles that the layers need.

    bounced : indirect light among them; None without.
    """

    scene: Scene
    layers: list[AnyLayer]
    needs: Needs
    bounced: IndirectLight | None


class LayerBuilder:
    """Builds layers, and keeps foldings, area and environment light, its shadows, and indirect light.

    lights, bounces : caches of light, good for several builders and threads.
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
        """Build all layers of a picture; `colours` gives (P, R, 3 M) of a palette under a light's spectrum.

        shown_in : spectra in place of the lights' own. whole : False leaves out shadows of area and environment lights
        and indirect light that are not kept, instead of working them out.

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
        """Return the scene's indirect light; None if there is none, or (not `whole`) none is kept."""
        if not whole and not self.bounces.knows(scene, surfaces, shown_in):
            return None
        folder, jobs = settings.rays_folder or transfer_folder(), settings.jobs or usable_cores()
        return self.bounces.light(
            scene, surfaces, shown_in, settings.report, folder, jobs, settings.on_message, settings.rays
        )

    def shadows(self, settings: RenderSettings, light: SpreadLight, scene: Scene, whole: bool = True) -> Shadows | None:
        """Return shadows of an area or environment light; None if nothing casts any, or (not `whole`) none is kept."""
        if not whole and not self.lights.knows(light, scene):
            return self.lights.seen_shadows(light, scene)
        jobs = settings.jobs or usable_cores()
        return self.lights.shadows(light, scene, jobs, settings.report, settings.on_message)

    def folded(
        self, scene: Scene, illuminants: Sequence[Spectrum | None], spectrum: Spectrum, palette: Palette
    ) -> Float[np.ndarray, "P R M3"]:
        """Fold a palette to XYZ under each illuminant, None being the light's own spectrum; foldings are kept, because
        one basis serves every material of a review.
        """
        spectra = tuple(spectrum if other is None else other for other in illuminants)
        key = (id(scene.observer), *(id(spectrum) for spectrum in spectra))
        if key not in self._foldings:
            if len(self._foldings) >= _KEPT_FOLDINGS:
                self._foldings.clear()
            self._foldings[key] = Folding(scene.observer, spectra)
        return palette.folded(self._foldings[key])

    def colours(self, scene: Scene, illuminants: Sequence[Spectrum | None]) -> Colours:
        """Return `folded` of a scene and illuminants, as `build` takes it."""
        return partial(self.folded, scene, illuminants)

    def _light_groups(self, lights: Sequence[Light], keeps_terms: bool) -> list[tuple[int, ...]]:
        """Group lights that are folded together: those of one spectrum.

        Lights that had two are told apart from then on: terms that are kept stay good when their spectra change again.
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
        """Iterate over the layers of area and environment lights, four of a light's fields each."""
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
    """Group the numbers of lights by spectrum."""
    groups: dict[tuple[bytes, bytes], list[int]] = {}
    for number, light in enumerate(lights):
        groups.setdefault(light.spectrum.key, []).append(number)
    return [tuple(numbers) for numbers in groups.values()]
