"""Rendering of one image of a scene, from catalogue to file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float, UInt8

from ..calibration.display.icc_profile import PREFIX
from ..calibration.report.statistics import DeltaEStatistics, delta_e_map, delta_e_statistics
from ..lighting.camera import Camera
from ..lighting.reference.noise import NOISE_SHARE
from ..lighting.reference.placement import looks_past, placement_warnings, why_black
from ..lighting.reference.reference import reference_images
from ..lighting.scene import Scene
from ..lighting.scene_file.lamps import lamp_of_file
from ..materials.catalogue.catalogue import Catalogue
from ..materials.records.material import MaterialRecord
from ..runtime.distribution import installed_version
from ..runtime.errors import ComparisonError, UsageError
from ..runtime.notebook import new_axes
from ..runtime.wording import counted
from ..spectral.difference import FormulaName, delta_e_xyz, lab_from_xyz
from ..spectral.formats.png_writer import png_bytes
from ..spectral.formats.spectral_exr import RELATIVE_UNITS, write_spectral_exr
from ..spectral.formats.xyz_exr import SpaceName, write_rgb_exr, write_xyz_exr
from ..spectral.illuminants import as_light
from ..spectral.image import ColourImage
from ..spectral.observers import observer_name
from ..spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from .display.gl_pass import DisplayPass
from .display.png import colour_chunks, quantise, write_png
from .display.transform import DisplayTransform, composite
from .gl.backend import GLBackend
from .render.indirect_cache import with_counted_bounces
from .render.session import RenderSession, radiance_weights

#: Average ΔE94 of noise allowed in a reference picture by default.
REFERENCE_NOISE = 0.1
REFERENCE = "reference: rays, every wavelength, the original data"
#: ΔE94 of the diffuser above which a note says that a light is undersampled in a spectral image.
SAID_FROM = 0.05
#: Callback for a message on why an image shows nothing.
Warn = Callable[[str], None]
# Number of non-black pixels below which an image is diagnosed.
_FEW = 0.01


def unheard(_line: str) -> None:
    """Discard warnings."""


@dataclass(frozen=True, eq=False, repr=False)
class Picture:
    """Image of a scene from one camera.

    Parameters
    ----------
    scene, view : the scene with the lights of the rendering, and the camera.
    xyz : (H,W,3) linear XYZ, row 0 at the top; Y = 1 is a perfect diffuser under the reference illuminance.
    coverage : (H,W) share of each pixel covered by surfaces, 0 to 1.
    made_by : description of the renderer.
    """

    scene: Scene
    view: Camera
    xyz: Float[np.ndarray, "H W 3"]
    coverage: Float[np.ndarray, "H W"]
    made_by: str

    def __repr__(self) -> str:
        return f"<Picture of {self.scene.name}, {self.view.name}: {self.view.width} x {self.view.height_px}>"

    @cached_property
    def white(self) -> Float[np.ndarray, "3"]:
        """XYZ of the perfect diffuser under the mixture of the scene's lights, Y = 1, the white for Lab and
        displays.
        """
        return self.scene.adopted_white()

    def lab(self) -> Float[np.ndarray, "H W 3"]:
        """CIELAB relative to `white`."""
        return lab_from_xyz(self.xyz, self.white)

    def display_xyz(self) -> Float[np.ndarray, "H W 3"]:
        """Return the image over its background as XYZ under the display's white (D65)."""
        display = display_for(self.scene)
        whole = composite(self.xyz, self.coverage, _background(self.scene))
        return whole @ display.adaptation_from(self.white).T

    def difference(self, reference: Picture, method: FormulaName = "CIE 1994") -> DeltaEStatistics:
        """Compute the statistics of ΔE from a reference of the same view, over the pixels that are fully covered in
        both.

        Raises
        ------
        ComparisonError : identical images, different sizes, or lights with different whites.
        InputError : no pixel is left to compare.
        """
        if not np.array_equal(self.white, reference.white):
            raise ComparisonError("two pictures under unlike lights: their whites differ")
        seen = np.minimum(self.coverage, reference.coverage)
        return delta_e_statistics(delta_e_map(reference.xyz, self.xyz, self.white, seen, method))

    def rgb(self) -> UInt8[np.ndarray, "H W 3"]:
        """Return the image over its background as codes of the scene's display."""
        return quantise(_encoded(self.scene, self.xyz, self.coverage, display_for(self.scene), None)[0])

    def _repr_png_(self) -> bytes:
        """Encode the image as PNG for a notebook."""
        return png_bytes(self.rgb(), colour_chunks(display_for(self.scene))[0])

    def plot(self, axes: Any = None) -> Any:
        """Show the image with matplotlib; returns the axes.

        Raises
        ------
        InputError : matplotlib is not installed.
        """
        axes = new_axes() if axes is None else axes
        axes.imshow(self.rgb())
        axes.set_axis_off()
        return axes

    def write(
        self,
        output: str | Path,
        warn: Warn = unheard,
        renderer: RenderSession | None = None,
        bits: int = 8,
        space: Literal["xyz"] | SpaceName = "xyz",
    ) -> tuple[str, ...]:
        """Write .exr (linear, with coverage) or .png (display-encoded); returns notes.

        warn : called if the display clips the whole image.
        renderer : encodes for the display if it has a GPU; otherwise OpenColorIO does so on the CPU.
        bits : of a PNG's channels, 8 or 16. space : of an OpenEXR's: XYZ as computed, or adapted and linear RGB.

        Raises
        ------
        UsageError : `output` with another suffix.
        """
        output = Path(output)
        check_output(output)
        words = picture_words(self.scene, self.view, self.made_by, installed_version())
        image = ColourImage(self.xyz, "xyz", self.white)
        if output.suffix.lower() == ".exr":
            viewing, coverage = self.scene.viewing, np.asarray(self.coverage)
            lux = float(viewing.reference_illuminance_lux)
            if space == "xyz":
                write_xyz_exr(output, image, coverage, words, lux)
                return ()
            return write_rgb_exr(output, image, space, coverage, words, lux, viewing.adaptation)
        display = display_for(self.scene)
        on = None if renderer is None else display_pass(renderer, display)
        rgb, notes = _encoded(self.scene, self.xyz, self.coverage, display, on)
        if notes:
            say_if_clipped(self.scene, "the picture", image, np.asarray(self.coverage), display, warn)
        lines = [f"{name}: {value}" for name, value in words.items()]
        return (*notes, *write_png(output, rgb, bits=bits, display=display, words=lines))


def lit_by(scene: Scene, light: object) -> Scene:
    """Return the scene under a light, with a note on it; None: unchanged.

    light : see `illuminants.as_light`, or a file of a measured lamp, see `lamps.lamp_of_file`.
    """
    if light is None:
        return scene
    lamp = lamp_of_file(light) if isinstance(light, str | Path) else None
    if lamp is None:
        name = light if isinstance(light, str) else str(getattr(light, "name", "") or "a given spectrum")
        lamp = as_light(light), name, ()
    spectrum, name, notes = lamp
    # Notes on the lights' own spectra no longer apply.
    replaced = f"lit by {name} in place of the spectra that the scene gives its lights"
    lit = scene.with_illuminant(spectrum, name)
    return replace(lit, notes=(*lit.notes, *notes, replaced))


def shown_on(scene: Scene, display: str | None) -> Scene:
    """Return the scene for another display of its configuration in the colorimetric view, or for an ICC profile
    (`icc:FILE`); None: unchanged.
    """
    if display is None:
        return scene
    config = None if display.startswith(PREFIX) else scene.viewing.ocio_config
    return replace(scene, viewing=replace(scene.viewing, display=display, view=None, ocio_config=config))


def picture_words(scene: Scene, view: Camera, made_by: str, metamer: str) -> dict[str, str]:
    """Return the header fields of an image: renderer, scene and light."""
    lights = dict.fromkeys(light.spectrum_name or light.name for light in scene.lights)
    return {
        "scene": scene.name,
        "camera": view.name,
        "material": ", ".join(scene.material_ids),
        "illuminant": ", ".join(lights),
        "observer": scene.observer.name,
        "renderer": made_by,
        "software": f"Metamer {metamer}",
    }


def check_output(output: Path, spectral: bool = False) -> None:
    """Raise `UsageError` for a file name that cannot be written."""
    kinds = (".exr",) if spectral else (".exr", ".png")
    if output.suffix.lower() not in kinds:
        what = "spectra are" if spectral else "pictures are"
        raise UsageError(f"{output}: {what} written as {' or '.join(kinds)}")


def display_for(scene: Scene) -> DisplayTransform:
    """Return the display transform of a scene, aimed for its observer, with defaults for open settings."""
    viewing = scene.viewing
    chosen: dict[str, Any] = {
        "observer": observer_name(scene.observer.name),
        "display": viewing.display,
        "view": viewing.view,
        "config": viewing.ocio_config,
        "adaptation": viewing.adaptation,
    }
    return DisplayTransform(**{name: value for name, value in chosen.items() if value is not None})


def display_pass(renderer: RenderSession, display: DisplayTransform) -> DisplayPass | None:
    """Return OCIO's GLSL pass on the renderer's GPU; None (OCIO on the CPU) for a renderer without GL."""
    backend = renderer.backend
    return DisplayPass(backend.context, display) if isinstance(backend, GLBackend) else None


def cut_out(
    image: ColourImage, coverage: Float[np.ndarray, "H W"], display: DisplayTransform, on: DisplayPass | None
) -> UInt8[np.ndarray, "H W 4"]:
    """Return the image without background: colours of surfaces, and coverage as alpha.

    image : premultiplied by `coverage`. on : see `DisplayTransform.encode`.
    """
    share = np.asarray(coverage, dtype=np.float64)[..., None]
    bare = np.divide(image.values, share, out=np.zeros(image.values.shape), where=share > 0.0)
    rgb, _ = display.encode(ColourImage(bare, image.space, image.white_xyz), on=on)
    alpha = np.clip(share, 0.0, 1.0)
    return np.concatenate([quantise(np.where(alpha > 0.0, rgb, 0.0)), quantise(alpha)], axis=-1)


def material_cut_out(
    record: MaterialRecord, scene: Scene, renderer: RenderSession, display: DisplayTransform, on: DisplayPass | None
) -> UInt8[np.ndarray, "H W 4"]:
    """Render `material_picture` without background, see `cut_out`."""
    dressed = scene.with_material(scene.reviewed_part, record.id)
    xyz, coverage = renderer.render(dressed, dressed.camera(), {record.id: record.drawn()})
    return cut_out(ColourImage(xyz, "xyz", dressed.adopted_white()), coverage, display, on)


def material_picture(
    record: MaterialRecord, scene: Scene, renderer: RenderSession, display: DisplayTransform, on: DisplayPass | None
) -> tuple[UInt8[np.ndarray, "H W 3"], tuple[str, ...]]:
    """Render the scene from its first camera, with the fast form of `record` on its reviewed part; returns image and
    notes.

    The image is in 8-bit codes of `display`; `on`: see `DisplayTransform.encode`.
    """
    dressed = scene.with_material(scene.reviewed_part, record.id)
    xyz, coverage = renderer.render(dressed, dressed.camera(), {record.id: record.drawn()})
    rgb, notes = _encoded(dressed, xyz, coverage, display, on)
    return quantise(rgb), notes


def picture(
    scene: Scene, catalogue: Catalogue, camera: str | None, renderer: RenderSession, warn: Warn = unheard
) -> Picture:
    """Render fast forms.

    warn : called with a message for each reason why the image may show nothing.
    """
    view = _placed(scene, camera, warn)
    xyz, coverage = renderer.render(scene, view, renderer.forms(catalogue, scene))
    say_if_blank(scene, view, xyz, coverage, warn)
    light = renderer.bounced
    return Picture(scene, view, xyz, coverage, renderer.made_by + bounced_words(0 if light is None else light.bounces))


def bounced_words(bounces: int) -> str:
    """Describe bounces for the header of an image."""
    return f", {counted(bounces, 'bounce')}" if bounces else ""


def bounces_notes(scene: Scene, renderer: RenderSession) -> tuple[str, ...]:
    """Return notes on indirect light in the renderer's last image, which must be of this scene."""
    if scene.bounces == 0:
        return ()
    if renderer.bounced is None:
        return ("no bounces of light between surfaces: none would change any of them by ΔE94 0.1",)
    return (renderer.bounced.words,)


def reference_picture(
    scene: Scene,
    catalogue: Catalogue,
    camera: str | None,
    warn: Warn = unheard,
    progress: Callable[[int, int, str], None] | None = None,
    noise: float = REFERENCE_NOISE,
) -> Picture:
    """Render an image by the reference renderer: ray tracing, every wavelength, the original data.

    noise : mean sampling noise, ΔE94, of area and environment lights and bounces.
    """
    view = _placed(scene, camera, warn)
    if scene.bounces == "auto":
        scene = with_counted_bounces(scene, {name: catalogue.surface(name).drawn() for name in scene.material_ids})
    bounces = int(scene.bounces)
    surfaces = {name: catalogue.surface(name).surface() for name in scene.material_ids}
    found = reference_images(scene, view, surfaces, budget=noise / NOISE_SHARE, bounces=bounces, progress=progress)
    xyz = found.xyz[0]
    if found.noise is not None and found.noise.limited:
        warn(f"the reference is not as exact as asked for: {found.noise.words}")
    say_if_blank(scene, view, xyz, found.coverage, warn)
    return Picture(scene, view, xyz, found.coverage, REFERENCE + bounced_words(bounces))


def render_spectral(
    scene: Scene, catalogue: Catalogue, output: Path, camera: str | None, renderer: RenderSession, warn: Warn = unheard
) -> tuple[str, ...]:
    """Render spectra at the working wavelengths to a spectral EXR.

    Values are relative spectral radiance: 1 is a perfect diffuser under the reference illuminance from an equal-energy
    light, and under any other light that diffuser has Y = 1 (`RenderSession.render_spectra`).
    """
    check_output(output, spectral=True)
    view = _placed(scene, camera, warn)
    surfaces = renderer.forms(catalogue, scene)
    values = renderer.render_spectra(scene, view, surfaces, WORKING_WAVELENGTHS_NM)
    notes = _thinned(scene, WORKING_WAVELENGTHS_NM)
    if np.count_nonzero(values.any(axis=-1)) < _FEW * values[..., 0].size:
        say_if_blank(scene, view, values, renderer.coverage(scene.cut(surfaces), view), warn)
    below = values < 0
    if below.any():
        notes.append(f"{below.mean():.2%} of the samples are below zero (lowest {values.min():.2g}), written as zero.")
    image = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.where(below, 0.0, values), "emission")
    words = picture_words(scene, view, renderer.made_by, installed_version())
    write_spectral_exr(output, image, RELATIVE_UNITS, words)
    return tuple(notes)


def say_if_blank(
    scene: Scene, view: Camera, values: Float[np.ndarray, "H W c"], coverage: Float[np.ndarray, "H W"], warn: Warn
) -> None:
    """Warn of an image without a lit surface, with the reason."""
    covered = int(np.count_nonzero(coverage))
    if not covered:
        warn(looks_past(scene, view))
    elif np.count_nonzero(values.any(axis=-1)) < _FEW * covered:
        for line in why_black(scene, view):
            warn(line)


def say_if_clipped(
    scene: Scene,
    view: str,
    image: ColourImage,
    coverage: Float[np.ndarray, "H W"],
    display: DisplayTransform,
    warn: Warn,
) -> None:
    """Warn of an image, by the name of its `view`, in which every pixel exceeds the display's range."""
    if display.clips_all(image, coverage):
        warn(
            f"{view} is clipped as a whole: all that it shows is brighter than “{display.name}” can be; raise "
            f"viewing.reference_illuminance_lux, now {scene.viewing.reference_illuminance_lux:g}"
        )


def _placed(scene: Scene, camera: str | None, warn: Warn) -> Camera:
    """Return the camera of a name, after warnings on the placement of it and the lights."""
    view = scene.camera(camera)
    for line in placement_warnings(scene, view):
        warn(line)
    return view


def _thinned(scene: Scene, wavelengths_nm: Float[np.ndarray, "L"]) -> list[str]:
    """Return notes on visible changes of the perfect diffuser's colour by sampling the scene's lights."""
    notes = []
    to_xyz = radiance_weights(scene.observer, wavelengths_nm)
    for light in scene.lights:
        white = scene.observer.white(light.spectrum)
        sampled = to_xyz @ light.spectrum.averaged(wavelengths_nm).samples
        difference = float(delta_e_xyz(white, sampled / sampled[1], white))
        if difference > SAID_FROM:
            notes.append(
                f"{light.spectrum_name or light.name} is finer than the {len(wavelengths_nm)} wavelengths of the "
                f"picture: folding them shifts the perfect diffuser by ΔE94 {difference:.2f}."
            )
    return notes


def _encoded(
    scene: Scene,
    xyz: Float[np.ndarray, "H W 3"],
    coverage: Float[np.ndarray, "H W"],
    display: DisplayTransform,
    on: DisplayPass | None,
) -> tuple[Float[np.ndarray, "H W 3"], tuple[str, ...]]:
    """Encode an image over the scene's background for its display; returns it and notes on clipping."""
    image = ColourImage(xyz, "xyz", scene.adopted_white())
    return display.encode(image, coverage, _background(scene), on)


def _background(scene: Scene) -> Float[np.ndarray, "3"]:
    return scene.adopted_white() * scene.viewing.background_reflectance
