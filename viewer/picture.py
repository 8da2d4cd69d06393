"""One picture of a scene, from catalogue to file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..lighting.reference import reference_image
from ..lighting.scene import Scene, Viewing
from ..materials.catalogue import Catalogue
from ..spectral.errors import UsageError
from ..spectral.formats.spectral_exr import write_spectral_exr
from ..spectral.formats.xyz_exr import write_xyz_exr
from ..spectral.illuminants import illuminant
from ..spectral.image import ColourImage
from ..spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from .display import DisplayTransform
from .display_gl import DisplayPass
from .headless import GLRenderer
from .png import write_png
from .renderer import Renderer

SPECTRAL_UNITS = "relative, Y = 1 for the perfect diffuser"


def lit_by(scene: Scene, name: str | None) -> Scene:
    """The scene under a named illuminant, or as it is."""
    return scene if name is None else scene.with_illuminant(illuminant(name), name)


def display_for(viewing: Viewing) -> DisplayTransform:
    """The display transform that a scene asks for; what it leaves open keeps its default."""
    chosen = {"display": viewing.display, "view": viewing.view, "config": viewing.ocio_config}
    return DisplayTransform(
        adaptation=viewing.adaptation, **{name: value for name, value in chosen.items() if value is not None}
    )


def display_pass(renderer: Renderer, display: DisplayTransform) -> DisplayPass | None:
    """OCIO's own GLSL on the renderer's GPU; None (OCIO on the CPU) where the renderer has no GL."""
    return DisplayPass(renderer.context, display) if isinstance(renderer, GLRenderer) else None


def render_picture(
    scene: Scene, catalogue: Catalogue, output: Path, camera: str | None, renderer: Renderer
) -> tuple[str, ...]:
    """Render factor packs to `output` (.exr: XYZ, .png: display-encoded); returns what has to be said of it."""
    packs = {name: catalogue.load(name).packs for name in scene.material_ids}
    xyz, coverage = renderer.render(scene, scene.camera(camera), packs)
    return _write(scene, output, xyz, coverage, renderer.name, renderer)


def render_reference(scene: Scene, catalogue: Catalogue, output: Path, camera: str | None) -> tuple[str, ...]:
    """The same picture by the slow truth: rays, every wavelength, the original data."""
    brdfs = {name: catalogue.load(name).brdf() for name in scene.material_ids}
    xyz, coverage = reference_image(scene, scene.camera(camera), brdfs)
    return _write(scene, output, xyz, coverage, "reference")


def render_spectral(
    scene: Scene, catalogue: Catalogue, output: Path, camera: str | None, renderer: Renderer
) -> tuple[str, ...]:
    """Render spectra at the working wavelengths to a spectral EXR.

    Values are relative spectral radiance: integrated with the observer at 1 nm, the perfect diffuser that receives the
    reference illuminance has Y = 1.
    """
    if output.suffix.lower() != ".exr":
        raise UsageError(f"{output}: spectra are written as .exr")
    packs = {name: catalogue.load(name).packs for name in scene.material_ids}
    values = renderer.render_spectra(scene, scene.camera(camera), packs, WORKING_WAVELENGTHS_NM)
    below = values < 0
    notes = ()
    if below.any():
        notes = (f"{below.mean():.2%} of the samples are below zero (lowest {values.min():.2g}), written as zero.",)
    image = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.where(below, 0.0, values), "emission")
    write_spectral_exr(output, image, SPECTRAL_UNITS)
    return notes


def _write(
    scene: Scene,
    output: Path,
    xyz: Float[np.ndarray, "H W 3"],
    coverage: Float[np.ndarray, "H W"],
    made_by: str,
    renderer: Renderer | None = None,
) -> tuple[str, ...]:
    white = scene.adopted_white()
    image = ColourImage(xyz, "xyz", white)
    words = {"renderer": made_by, "observer": scene.observer.name}
    if output.suffix.lower() == ".exr":
        write_xyz_exr(output, image, np.asarray(coverage), words)
        return ()
    if output.suffix.lower() != ".png":
        raise UsageError(f"{output}: pictures are written as .exr or .png")
    display = display_for(scene.viewing)
    on = None if renderer is None else display_pass(renderer, display)
    rgb, notes = display.encode(image, coverage, white * scene.viewing.background_reflectance, on)
    write_png(output, rgb, display=display.display, words=[f"{name}: {value}" for name, value in words.items()])
    return notes
