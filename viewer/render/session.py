"""Render sessions: a scene, a camera and materials that change one at a time, drawn by a back end."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.scene import Scene
from ...lighting.transfer.indirect import IndirectLight
from ...lighting.transfer.radiant import fluoresces
from ...materials.catalogue.catalogue import Catalogue
from ...materials.core.fast import Fast
from ...runtime.errors import InputError
from ...spectral.observers import Observer
from ...spectral.palette import Palette
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import interpolation_matrix
from .cache import Backend, Needs, Piece, RenderCache
from .layers import AnyLayer, SpreadLayer
from .matt_forms import MattForm
from .scene_layers import DRAWING, Colours, LayerBuilder, RenderSettings
from .view import window_count

#: XYZ (H, W, 3) and coverage (H, W), float32, row 0 on top.
XyzPicture = tuple[Float[np.ndarray, "H W 3"], Float[np.ndarray, "H W"]]
# Wavelengths drawn at once, a multiple of three, which bounds the memory of spectral images.
_SPECTRAL_CHUNK = 24


class Target(ABC):
    """Images of one size that are drawn window by window, one for each of `count` spectra."""

    count: int

    @abstractmethod
    def put(self, backend: Backend, piece: Piece, first: int, images: Sequence[Any]) -> None:
        """Store a window's images of the spectra from `first` on, as returned by `Backend.added_up`."""


class ReadPictures(Target):
    """Images read back into memory: xyz (M, H, W, 3) and coverage (H, W), float32."""

    def __init__(self, camera: Camera, count: int = 1) -> None:
        self.count = count
        self.xyz = np.zeros((count, camera.height_px, camera.width, 3), dtype=np.float32)
        self.coverage = np.zeros((camera.height_px, camera.width), dtype=np.float32)

    def put(self, backend: Backend, piece: Piece, first: int, images: Sequence[Any]) -> None:
        """Read a window's images back."""
        for number, image in enumerate(images, first):
            self.xyz[number, *piece.place] = backend.pixels(image)
        self.coverage[piece.place] = piece.coverage

    def read(self, number: int = 0) -> XyzPicture:
        """Return one image and the coverage."""
        return self.xyz[number], self.coverage


SomeTarget = TypeVar("SomeTarget", bound=Target)


class RenderSession:
    """Session that renders a scene with fast forms: settings, a cache and a back end.

    It begins with `set_scene` and `set_camera`; each further `set_...` changes one thing, and `draw` recomputes only
    what that invalidates: another camera keeps the geometry, another material the view; another illuminant or observer
    costs only a fold if terms are cached (`RenderSettings.keeps_terms`). `render` does all in one call.

    An image is (xyz, coverage): float32 XYZ (H, W, 3), row 0 on top, Y = 1 for a perfect diffuser under the scene's
    reference illuminance, premultiplied by coverage; coverage float32 (H, W) is the share of a pixel's sample points
    that see a surface. Nothing is clipped: negative values of a fit give negative XYZ.

    Use it as a context manager, or call `close`.

    Parameters
    ----------
    backend : `GLBackend` or `NumpyBackend`; closed with the session.
    layers : builder that shares light caches with another session.

    Attributes
    ----------
    bounced : indirect light of the last image, or None.
    """

    def __init__(
        self, backend: Backend, settings: RenderSettings | None = None, layers: LayerBuilder | None = None
    ) -> None:
        self.backend, self.settings = backend, RenderSettings() if settings is None else settings
        self.cache = RenderCache(backend)
        self.layers = LayerBuilder() if layers is None else layers
        self.bounced: IndirectLight | None = None
        self._scene: Scene | None = None
        self._camera: Camera | None = None
        self._surfaces: dict[str, Fast] = {}
        self._illuminant: Spectrum | None = None
        # Forms of a catalogue's materials with the state of their files.
        self._forms: dict[str, tuple[tuple, Fast]] = {}

    @property
    def name(self) -> str:
        """Description of back end and device."""
        return self.backend.name

    @property
    def made_by(self) -> str:
        """Back end and, unless it is the default, filtering, for image headers."""
        filtering = self.settings.filtering
        return self.name if filtering == "linear" else f"{self.name}, {filtering} factors"

    def configure(self, **changes: Any) -> None:
        """Change settings, by the names of `RenderSettings`; other filtering discards the view with its footprints.

        Raises
        ------
        UnknownNameError : unknown filtering.
        """
        settings = replace(self.settings, **changes)
        if settings.filtering != self.settings.filtering:
            self.backend.make_current()
            self.cache.forget_view()
        self.settings = settings

    @property
    def scene(self) -> Scene:
        """Scene to be rendered.

        Raises
        ------
        InputError : none was set.
        """
        if self._scene is None:
            raise InputError("a session has no scene yet", field="scene", hint="call set_scene first")
        return self._scene

    @property
    def camera(self) -> Camera:
        """Camera of the rendering: the one that was set, or the scene's first."""
        return self.scene.camera() if self._camera is None else self._camera

    def set_scene(self, scene: Scene, surfaces: Mapping[str, Fast]) -> None:
        """Set the scene and the fast forms of its materials by id; the camera becomes the scene's first.

        Raises
        ------
        UnknownNameError : a material of the scene is not in `surfaces`.
        """
        scene.check_surfaces(surfaces)
        self._scene, self._surfaces, self._camera = scene, dict(surfaces), None

    def set_camera(self, camera: Camera | None) -> None:
        """Set the camera; None is the scene's first."""
        self._camera = camera

    def set_illuminant(self, spectrum: Spectrum | None) -> None:
        """Replace the spectrum of every light at the same strength; None restores the lights' own."""
        self._illuminant = spectrum

    def set_observer(self, observer: Observer) -> None:
        """Set the observer for XYZ."""
        self._scene = replace(self.scene, observer=observer)

    def set_material(self, part: str, material_id: str, form: Fast) -> None:
        """Put another material on a part.

        Raises
        ------
        UnknownNameError : the scene has no part of that name.
        """
        scene = self.scene.with_material(part, material_id)
        self._scene, self._surfaces = scene, {**self._surfaces, material_id: form}

    def draw(self, target: SomeTarget) -> SomeTarget:
        """Render onto a target of the camera's size, and return it."""
        self._draw(target, [self._illuminant])
        return target

    def picture(self) -> XyzPicture:
        """Render and read the image back."""
        return self.draw(ReadPictures(self.camera)).read()

    def render(self, scene: Scene, camera: Camera | None, surfaces: Mapping[str, Fast]) -> XyzPicture:
        """Set a scene and a camera (None: the scene's first) with the lights' own spectra, render, and read back.

        Raises
        ------
        UnknownNameError : a material of the scene is not in `surfaces`.
        """
        return self.render_many(scene, camera, surfaces)[0]

    def render_many(
        self,
        scene: Scene,
        camera: Camera | None,
        surfaces: Mapping[str, Fast],
        illuminants: Sequence[Spectrum | None] = (None,),
    ) -> list[XyzPicture]:
        """Render one image for each illuminant, at little more than the cost of one; None: the lights' own spectra.

        With fluorescent interreflection, each illuminant costs a full image.
        """
        self.set_scene(scene, surfaces)
        self.set_camera(camera)
        self.set_illuminant(None)
        target = ReadPictures(self.camera, len(illuminants))
        self._draw(target, illuminants)
        return [target.read(number) for number in range(target.count)]

    def render_matt(self, scene: Scene, part: str, forms: Sequence[MattForm]) -> list[XyzPicture]:
        """Render one image for each form on a part, all of one shape, at little more than the cost of one.

        Raises
        ------
        UnknownNameError : the scene has no part of that name.
        InputError : a scene with interreflection, which depends on the colour of each form.
        """
        if scene.bounces != 0:
            raise InputError("light between surfaces", field="bounces", found=str(scene.bounces), expected="none")
        built = []
        for one in forms:
            self.set_scene(scene.with_material(part, part), {part: one.form})
            colours = self.layers.colours(self.scene, (None,))
            built.append(self.layers.build(self.settings, self.scene, self.camera, self._surfaces, colours))
        layers = [
            # The shape excludes a factor of the environment form.
            replace(
                same[0],
                colours=np.concatenate(
                    [
                        layer.colours * (one.scale / forms[0].scale if isinstance(layer, SpreadLayer) else 1.0)
                        for one, layer in zip(forms, same, strict=True)
                    ],
                    axis=-1,
                ),
            )
            for same in zip(*(one.layers for one in built), strict=True)
        ]
        target = ReadPictures(self.camera, len(forms))
        draw = partial(self._draw_piece, target, layers)
        for _ in self.in_windows(built[0].scene, self.camera, built[0].needs, draw):
            pass
        return [target.read(number) for number in range(target.count)]

    def render_spectra(
        self,
        scene: Scene,
        camera: Camera | None,
        surfaces: Mapping[str, Fast],
        wavelengths_nm: Float[np.ndarray, "L"],
    ) -> Float[np.ndarray, "H W L"]:
        """Render relative spectral radiance at `wavelengths_nm`, float32, premultiplied by coverage.

        1 is a perfect diffuser under the reference illuminance from an equal-energy light. Under every light that
        diffuser has Y = 1, where XYZ is the integral of v times the colour-matching functions over that of y-bar, v
        linear between `wavelengths_nm` (`radiance_weights`). Finer lights are averaged (`Spectrum.averaged`), so that
        no line is missed.

        Raises
        ------
        UnknownNameError : a material of the scene is not in `surfaces`.
        InputError : a light has no power at `wavelengths_nm`.
        """
        self.set_scene(scene, surfaces)
        self.set_camera(camera)
        self.set_illuminant(None)
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
        camera = self.camera
        values = np.empty((camera.height_px, camera.width, len(wavelengths_nm)), dtype=np.float32)
        for start in range(0, len(wavelengths_nm), _SPECTRAL_CHUNK):
            chosen = slice(start, min(start + _SPECTRAL_CHUNK, len(wavelengths_nm)))
            count = -(-(chosen.stop - start) // 3)

            def sent(spectrum: Spectrum, palette: Palette, chosen: slice = chosen, count: int = count) -> np.ndarray:
                radiance = palette.radiance(spectrum, wavelengths_nm)[..., chosen] / power_of(spectrum)
                return np.pad(radiance, ((0, 0), (0, 0), (0, 3 * count - radiance.shape[2])))

            # Three wavelengths are rendered as X, Y and Z.
            step = start // _SPECTRAL_CHUNK, -(-len(wavelengths_nm) // _SPECTRAL_CHUNK)
            target = ReadPictures(camera, count)
            self._draw_layers(target, scene, sent, step)
            flat = target.xyz.transpose(1, 2, 0, 3).reshape(*values.shape[:2], 3 * count)
            values[..., chosen] = flat[..., : chosen.stop - start]
        return values

    def coverage(self, scene: Scene, camera: Camera) -> Float[np.ndarray, "H W"]:
        """Return the share of each pixel's sample points that see a surface, float32."""
        target = ReadPictures(camera, 0)
        for piece in self.windows(scene, camera):
            target.put(self.backend, piece, 0, ())
        return target.coverage

    def windows(self, scene: Scene, camera: Camera) -> Iterator[Piece]:
        """Iterate over the windows of a camera's image (`RenderCache.windows`)."""
        return self.cache.windows(scene, camera, self.settings.tile_samples)

    def in_windows(
        self, scene: Scene, camera: Camera, needs: Needs, draw: Callable[[Piece], object]
    ) -> Iterator[tuple[int, int]]:
        """Draw a camera's image window by window; yields the numbers of finished windows and of all after each.

        needs : contents of the windows' tiles.
        """
        self.cache.needs = needs
        total = window_count(camera, self.settings.tile_samples)
        for number, piece in enumerate(self.windows(scene, camera), 1):
            draw(piece)
            yield number, total

    def forms(self, catalogue: Catalogue, scene: Scene) -> dict[str, Fast]:
        """Return fast forms of a scene's materials; files are read once, and again after changes.

        Raises
        ------
        UnknownNameError : a material that is not in the catalogue.
        InputError : a damaged file; a material without a surface or without a fast form.
        """
        kept = {}
        for name in scene.material_ids:
            state, known = catalogue.state(name), self._forms.get(name)
            kept[name] = known if known and known[0] == state else (state, catalogue.surface(name).drawn())
        self._forms = kept
        return {name: form for name, (_, form) in kept.items()}

    def close(self) -> None:
        """Release all resources, the back end included; do not use it afterwards."""
        self.release()
        self.backend.close()

    def __enter__(self) -> RenderSession:
        return self

    def __exit__(self, *_reason: object) -> None:
        self.close()

    def release(self) -> None:
        """Discard all caches and free GPU memory."""
        self.cache.release()
        self.layers.release()
        self._forms = {}

    def _draw(self, target: Target, illuminants: Sequence[Spectrum | None]) -> None:
        """Draw the scene under each illuminant."""
        scene, shown_in = self.scene, [one for one in illuminants if one is not None]
        if shown_in and scene.bounces != 0 and fluoresces(self._surfaces[name] for name in scene.material_ids):
            for number, one in enumerate(illuminants):
                lit = scene if one is None else scene.with_illuminant(one)
                self._draw_layers(_Part(target, number), lit, self.layers.colours(lit, (None,)))
            return
        self._draw_layers(target, scene, self.layers.colours(scene, illuminants), shown_in=shown_in)

    def _draw_layers(
        self,
        target: Target,
        scene: Scene,
        colours: Colours,
        step: tuple[int, int] = (0, 1),
        shown_in: Sequence[Spectrum] = (),
    ) -> None:
        """Draw a scene; `colours` returns (P, R, 3 count) for a palette under a spectrum.

        step : index of this round and number of rounds, for progress. shown_in : spectra that replace the lights' own.
        """
        settings, camera = self.settings, self.camera
        built = self.layers.build(settings, scene, camera, self._surfaces, colours, shown_in)
        self.bounced = built.bounced
        tiles = window_count(camera, settings.tile_samples)
        settings.report(step[0] * tiles, step[1] * tiles, DRAWING)
        draw = partial(self._draw_piece, target, built.layers)
        for number, _ in self.in_windows(built.scene, camera, built.needs, draw):
            settings.report(step[0] * tiles + number, step[1] * tiles, DRAWING)

    def _draw_piece(self, target: Target, layers: Sequence[AnyLayer], piece: Piece) -> None:
        chunk = self.backend.chunk
        for start in range(0, target.count, chunk):
            columns = slice(3 * start, 3 * min(start + chunk, target.count))
            keep = self.settings.keeps_terms
            with self.backend.added_up(piece, layers, columns, keep, target.count) as images:
                target.put(self.backend, piece, start, images)
        if not self.settings.keeps_terms:
            piece.keep_terms(())


class _Part(Target):
    """One image of a target."""

    def __init__(self, whole: Target, number: int) -> None:
        self.count, self._whole, self._number = 1, whole, number

    def put(self, backend: Backend, piece: Piece, first: int, images: Sequence[Any]) -> None:
        """Store an image under the target's index."""
        self._whole.put(backend, piece, first + self._number, images)


def radiance_weights(observer: Observer, wavelengths_nm: Float[np.ndarray, "L"]) -> Float[np.ndarray, "3 L"]:
    """Return the weights in XYZ = weights @ radiance of `render_spectra`; equal energy of 1 has Y = 1."""
    linear = interpolation_matrix(wavelengths_nm, observer.wavelengths_nm, "hold", "linear")
    weights = np.trapezoid(observer.cmfs[:, :, None] * linear[:, None], observer.wavelengths_nm, axis=0)
    return weights / weights[1].sum()
