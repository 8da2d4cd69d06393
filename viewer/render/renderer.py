"""What every renderer does alike: keep geometry between calls, fold materials with light and observer."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, cast, get_args

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.lights import Light
from ...lighting.scene import Scene
from ...lighting.transfer.hits import RAYS
from ...lighting.transfer.indirect import IndirectLight
from ...lighting.transfer.radiant import fluoresces
from ...lighting.visibility.keeping import transfer_folder
from ...materials.catalogue import Catalogue
from ...materials.fast import Fast
from ...spectral.errors import InputError, UnknownNameError
from ...spectral.folding import Folding
from ...spectral.observers import Observer
from ...spectral.palette import Palette
from ...spectral.processes import usable_cores
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import interpolation_matrix
from .indirect_cache import Bouncing, indirect_layers
from .keeping import Keeping, Layer, Piece, SpreadLayer
from .view import window_count

#: How factors are looked up between samples: as they are, or averaged over what a sample spans.
Filtering = Literal["linear", "mipmapped"]
Picture = tuple[Float[np.ndarray, "H W 3"], Float[np.ndarray, "H W"]]
# Lights with their observer whose folded bases are kept: each costs an integral over the observer's wavelengths.
_KEPT_FOLDINGS = 64
# Wavelengths that are drawn at once, a multiple of three: bounds the memory of spectral pictures.
_SPECTRAL_CHUNK = 24
# Fields of a light that are looked up at once: a texel holds four.
MOST_FIELDS = 4


class Renderer(Keeping):
    """Makes pictures of a scene whose materials are fast forms.

    A picture is (xyz, coverage): float32 XYZ (H, W, 3), row 0 on top, Y = 1 for a perfect diffuser that receives the
    scene's reference illuminance, premultiplied by coverage; coverage float32 (H, W) is the share of a pixel's sample
    points that meet a surface. Nothing is clipped: a fit that is negative somewhere shows as negative XYZ.

    What does not change from call to call is kept for the next: what depends on meshes and places of lights (another
    camera is cheap), and on the camera too (other materials are cheap). Use it as a context manager, or call `release`.

    Parameters
    ----------
    filtering : "linear" reads factors off at each sample. "mipmapped" takes each factor's mean over what the sample
        spans (`pyramids`): a highlight that is smaller than a sample neither sparkles nor is missed, at the price of a
        product of means in place of a mean of products.
    keeps_terms : the materials' terms at every pixel are kept, too: the same scene in other spectra
        (`render_many`, `Scene.with_illuminant`, lights of other spectra, another observer, an environment's strength)
        costs a fold. For windows and many illuminants; a single picture is some tenths slower.
    """

    name: str

    def __init__(self, filtering: Filtering = "linear", keeps_terms: bool = False) -> None:
        self.keeps_terms = keeps_terms
        super().__init__()
        self._foldings: dict[tuple[int, ...], Folding] = {}
        self._groups: list[tuple[int, ...]] = []
        self._forms: dict[str, tuple[tuple, Fast]] = {}
        self._bouncing = Bouncing()
        self._filtering: Filtering = _known(filtering)
        #: Called with (tiles done, tiles in all, what is done) where somebody sets it: large pictures take minutes.
        self.progress: Callable[[int, int, str], None] | None = None
        #: Where rays between surfaces are kept, as by `metamer transfer build`; None: in the user's cache.
        self.rays_folder: Path | None = None
        #: How many of each vertex.
        self.rays = RAYS
        #: Light by way of other surfaces in the last picture; None where there was none.
        self.bounced: IndirectLight | None = None

    @property
    def made_by(self) -> str:
        """Which renderer, and how it filters where that is not as usual: what a picture's file says of it."""
        return self.name if self._filtering == "linear" else f"{self.name}, {self._filtering} factors"

    @property
    def filtering(self) -> Filtering:
        """How factors are looked up; to change it is to forget the kept geometry, which holds what samples span."""
        return self._filtering

    @filtering.setter
    def filtering(self, value: str) -> None:
        if _known(value) != self._filtering:
            self.release()
        self._filtering = _known(value)

    def render(
        self,
        scene: Scene,
        camera: Camera | None,
        surfaces: Mapping[str, Fast],
        lights: Sequence[Light] | None = None,
    ) -> Picture:
        """One picture; `camera` None takes the scene's first, `lights` replace those of the scene.

        Raises
        ------
        UnknownNameError : a material of the scene is not in `surfaces`.
        """
        if lights is not None:
            scene = replace(scene, lights=tuple(lights))
        return self.render_many(scene, camera, surfaces)[0]

    def render_many(
        self,
        scene: Scene,
        camera: Camera | None,
        surfaces: Mapping[str, Fast],
        illuminants: Sequence[Spectrum | None] = (None,),
    ) -> list[Picture]:
        """One picture for each illuminant, for little more than the cost of one.

        A spectrum replaces that of every light of the scene, at the same strength; None keeps the lights' own. Where
        fluorescent surfaces pass light on, each illuminant costs a picture.
        """
        scene.check_surfaces(surfaces)
        camera = scene.camera() if camera is None else camera
        shown_in = [one for one in illuminants if one is not None]
        if shown_in and scene.bounces != 0 and fluoresces(surfaces[name] for name in scene.material_ids):
            lit = [scene if one is None else scene.with_illuminant(one) for one in illuminants]
            return [self.render_many(one, camera, surfaces)[0] for one in lit]
        xyz, coverage = self._drawn(
            scene,
            camera,
            surfaces,
            len(illuminants),
            lambda light, one: self._colours(scene, light, one, illuminants),
            shown_in=shown_in,
        )
        return [(picture, coverage) for picture in xyz]

    def render_spectra(
        self,
        scene: Scene,
        camera: Camera | None,
        surfaces: Mapping[str, Fast],
        wavelengths_nm: Float[np.ndarray, "L"],
    ) -> Float[np.ndarray, "H W L"]:
        """Relative spectral radiance at `wavelengths_nm`, float32, premultiplied by coverage.

        1 is the perfect diffuser that receives the reference illuminance from a light of equal energy. Under every
        light that diffuser has Y = 1, where XYZ is the integral of v times the colour-matching functions over that of
        y-bar, v linear between `wavelengths_nm` (`radiance_weights`). Lights that are finer are averaged there
        (`Spectrum.averaged`), so that no line is missed.

        Raises
        ------
        UnknownNameError : a material of the scene is not in `surfaces`.
        InputError : a light has no power at `wavelengths_nm`.
        """
        camera = scene.camera() if camera is None else camera
        luminous = radiance_weights(scene.observer, wavelengths_nm)[1]

        def power_of(spectrum: Spectrum) -> float:
            return float(luminous @ spectrum.averaged(wavelengths_nm).samples)

        for light in scene.lights:
            if not all(power_of(spectrum) > 0 for spectrum in light.spectra):
                raise InputError(
                    "the light sends nothing at these wavelengths",
                    field=f"light {light.name}",
                    found=light.spectrum_name or None,
                    expected=f"some power at {wavelengths_nm[0]:g}, {wavelengths_nm[1]:g}, ... nm",
                )
        values = np.empty((camera.height_px, camera.width, len(wavelengths_nm)), dtype=np.float32)
        for start in range(0, len(wavelengths_nm), _SPECTRAL_CHUNK):
            chosen = slice(start, min(start + _SPECTRAL_CHUNK, len(wavelengths_nm)))
            count = -(-(chosen.stop - start) // 3)

            def sent(spectrum: Spectrum, palette: Palette, chosen: slice = chosen, count: int = count) -> np.ndarray:
                radiance = palette.radiance(spectrum, wavelengths_nm)[..., chosen] / power_of(spectrum)
                return np.pad(radiance, ((0, 0), (0, 0), (0, 3 * count - radiance.shape[2])))

            # Three wavelengths take the places of X, Y and Z.
            step = start // _SPECTRAL_CHUNK, -(-len(wavelengths_nm) // _SPECTRAL_CHUNK)
            triples, _ = self._drawn(scene, camera, surfaces, count, sent, step)
            flat = triples.transpose(1, 2, 0, 3).reshape(*values.shape[:2], 3 * count)
            values[..., chosen] = flat[..., : chosen.stop - start]
        return values

    def _drawn(
        self,
        scene: Scene,
        camera: Camera,
        surfaces: Mapping[str, Fast],
        count: int,
        colours: Callable[[Spectrum, Palette], Float[np.ndarray, "P R M3"]],
        step: tuple[int, int] = (0, 1),
        shown_in: Sequence[Spectrum] = (),
    ) -> tuple[Float[np.ndarray, "M H W 3"], Float[np.ndarray, "H W"]]:
        """`count` pictures, and the coverage; `colours` (P, R, 3 count) are those of a palette under a spectrum.

        step : which of how many such rounds this is, for `progress`. shown_in : spectra in place of the lights' own.
        """
        scene, layers = self._layers(scene, camera, surfaces, colours, shown_in)
        xyz = np.zeros((count, camera.height_px, camera.width, 3), dtype=np.float32)
        coverage = np.zeros((camera.height_px, camera.width), dtype=np.float32)
        tiles = window_count(camera, self.tile_samples)
        self._say(
            step[0] * tiles, step[1] * tiles, f"sorting {sum(len(p.mesh.faces) for p in scene.parts):,} triangles"
        )
        for number, piece in enumerate(self._pieces(scene, camera), 1):
            shaded, covered = self._shade(piece, layers, count), self._coverage_of(piece)
            height, width = covered.shape
            place = slice(piece.top, piece.top + height), slice(piece.left, piece.left + width)
            xyz[:, *place] = shaded
            coverage[place] = covered
            self._say(step[0] * tiles + number, step[1] * tiles, "drawing")
        return xyz, coverage

    def _layers(
        self,
        scene: Scene,
        camera: Camera,
        surfaces: Mapping[str, Fast],
        colours: Callable[[Spectrum, Palette], Float[np.ndarray, "P R M3"]],
        shown_in: Sequence[Spectrum] = (),
    ) -> tuple[Scene, list[Layer | SpreadLayer]]:
        """The scene with its materials' holes, and all layers of a picture of it; see `_drawn`."""
        scene.check_surfaces(surfaces)
        scene = scene.cut(surfaces)
        indirect = self.bounced = self._indirect(scene, surfaces, shown_in)
        surfaces = {name: surfaces[name].without_holes() for name in scene.material_ids}
        self._with_uv = scene.needs_uv(surfaces)
        self._with_frames = bool(scene.spread_lights) or indirect is not None
        layers: list[Layer | SpreadLayer] = [
            Layer(number, lights, one, colours(scene.delta_lights[lights[0]].spectrum, one.palette))
            for number, part in enumerate(scene.parts)
            for lights in self._light_groups(scene.delta_lights)
            for one in surfaces[part.material].summands
        ]
        layers += self._spread_layers(scene, camera, surfaces, colours)
        if indirect is not None:
            layers += indirect_layers(indirect, scene, camera, surfaces, colours)
        return scene, layers

    def _light_groups(self, lights: Sequence[Light]) -> list[tuple[int, ...]]:
        """Numbers of the lights that are folded together: those of one spectrum.

        Lights that had two are told apart from then on: terms that are kept stay good when their spectra change again.
        """
        groups = _by_spectrum(lights)
        if self.keeps_terms and sum(map(len, self._groups)) == len(lights):
            both = [tuple(one for one in group if one in kept) for kept in self._groups for group in groups]
            groups = [group for group in both if group]
        self._groups = groups
        return groups

    def _indirect(
        self, scene: Scene, surfaces: Mapping[str, Fast], shown_in: Sequence[Spectrum] = ()
    ) -> IndirectLight | None:
        """Light by way of other surfaces."""
        folder, jobs = self.rays_folder or transfer_folder(), self.jobs or usable_cores()
        return self._bouncing.light(scene, surfaces, shown_in, self._say, folder, jobs, self.say, self.rays)

    def _spread_layers(
        self,
        scene: Scene,
        camera: Camera,
        surfaces: Mapping[str, Fast],
        colours: Callable[[Spectrum, Palette], Float[np.ndarray, "P R M3"]],
    ) -> Iterator[SpreadLayer]:
        """The layers of all lights that spread, four of a light's fields each."""
        scale = np.pi / scene.viewing.reference_illuminance_lux / camera.samples**2
        for light in scene.spread_lights:
            gathered, world_from_map = self._kept_light.gathered(light, scene)
            shadows = self._shadows(light, scene)
            weights = light.maps.weights if isinstance(light, EnvironmentLight) else np.ones(1)
            for number, part in enumerate(scene.parts):
                form = surfaces[part.material].environment_form()
                for start in range(0, len(light.spectra), MOST_FIELDS):
                    fields = slice(start, min(start + MOST_FIELDS, len(light.spectra)))
                    each = [
                        weight * colours(one, form.palette)[0]
                        for weight, one in zip(weights[fields], light.spectra[fields], strict=True)
                    ]
                    rounded = np.concatenate([np.pad(one, ((0, -len(one) % 4), (0, 0))) for one in each])[None]
                    yield SpreadLayer(number, fields, form, gathered, world_from_map, scale, rounded, shadows)

    def _say(self, done: int, total: int, what: str) -> None:
        if self.progress is not None:
            self.progress(done, total, what)

    def coverage(self, scene: Scene, camera: Camera) -> Float[np.ndarray, "H W"]:
        """The share of each pixel's sample points that meet a surface, float32."""
        found = np.zeros((camera.height_px, camera.width), dtype=np.float32)
        for piece in self._pieces(scene, camera):
            known = self._coverage_of(piece)
            height, width = known.shape
            found[piece.top : piece.top + height, piece.left : piece.left + width] = known
        return found

    def forms(self, catalogue: Catalogue, scene: Scene) -> dict[str, Fast]:
        """Fast forms of a scene's materials; each file is read once, and again when it has changed.

        Raises
        ------
        UnknownNameError : a material that the catalogue does not have.
        InputError : a file that is damaged; a material without a surface or without a fast form.
        """
        kept = {}
        for name in scene.material_ids:
            state, known = catalogue.state(name), self._forms.get(name)
            kept[name] = known if known and known[0] == state else (state, catalogue.surface(name).drawn())
        self._forms = kept
        return {name: form for name, (_, form) in kept.items()}

    def close(self) -> None:
        """Release everything; the renderer is used up."""
        self.release()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_reason: object) -> None:
        self.close()

    def release(self) -> None:
        """Forget everything that is kept and free what it holds on a GPU."""
        super().release()
        self._bouncing.release()
        self._groups, self._forms = [], {}

    @abstractmethod
    def _shade(self, piece: Piece, layers: Sequence[Layer | SpreadLayer], count: int) -> Float[np.ndarray, "M h w 3"]:
        """The sum of all layers for each of `count` spectra: terms times colours."""

    def _colours(
        self, scene: Scene, spectrum: Spectrum, palette: Palette, illuminants: Sequence[Spectrum | None]
    ) -> Float[np.ndarray, "P R M3"]:
        """A palette in XYZ under each illuminant; foldings are kept, because one basis serves every material of a
        review."""
        spectra = tuple(spectrum if other is None else other for other in illuminants)
        key = (id(scene.observer), *(id(spectrum) for spectrum in spectra))
        if key not in self._foldings:
            if len(self._foldings) >= _KEPT_FOLDINGS:
                self._foldings.clear()
            self._foldings[key] = Folding(scene.observer, spectra)
        return palette.folded(self._foldings[key])


def _known(filtering: str) -> Filtering:
    if filtering not in get_args(Filtering):
        raise UnknownNameError("filtering", filtering, get_args(Filtering))
    return cast(Filtering, filtering)


def _by_spectrum(lights: Sequence[Light]) -> list[tuple[int, ...]]:
    """The numbers of the lights of each spectrum: what is folded together."""
    groups: dict[tuple[bytes, bytes], list[int]] = {}
    for number, light in enumerate(lights):
        groups.setdefault(light.spectrum.key, []).append(number)
    return [tuple(numbers) for numbers in groups.values()]


def radiance_weights(observer: Observer, wavelengths_nm: Float[np.ndarray, "L"]) -> Float[np.ndarray, "3 L"]:
    """XYZ = weights @ relative radiance as `Renderer.render_spectra` makes it; equal energy of 1 has Y = 1."""
    linear = interpolation_matrix(wavelengths_nm, observer.wavelengths_nm, "hold", "linear")
    weights = np.trapezoid(observer.cmfs[:, :, None] * linear[:, None], observer.wavelengths_nm, axis=0)
    return weights / weights[1].sum()
