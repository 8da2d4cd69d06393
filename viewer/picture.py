"""One picture of a scene, from catalogue to file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from ..lighting.reference import reference_image
from ..lighting.scene import Scene, Viewing
from ..materials.catalogue import Catalogue
from ..materials.records.material import MaterialRecord
from ..spectral.difference import delta_e_xyz
from ..spectral.errors import UsageError
from ..spectral.formats.spectral_exr import write_spectral_exr
from ..spectral.formats.xyz_exr import write_xyz_exr
from ..spectral.illuminants import illuminant
from ..spectral.image import ColourImage
from ..spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from .display import DisplayTransform
from .display_gl import DisplayPass
from .headless import GLRenderer
from .png import quantise, write_png
from .renderer import Renderer, radiance_weights

SPECTRAL_UNITS = "relative, 1 for the perfect diffuser under equal energy"
#: ΔE94 of the diffuser from which on it is said that a light is coarser in a spectral picture than it was measured.
SAID_FROM = 0.05


def lit_by(scene: Scene, name: str | None) -> Scene:
    """The scene under a named illuminant, or as it is."""
    return scene if name is None else scene.with_illuminant(illuminant(name), name)


def check_output(output: Path, spectral: bool = False) -> None:
    """Raise `UsageError` where a picture cannot be written under that name."""
    kinds = (".exr",) if spectral else (".exr", ".png")
    if output.suffix.lower() not in kinds:
        what = "spectra are" if spectral else "pictures are"
        raise UsageError(f"{output}: {what} written as {' or '.join(kinds)}")


def display_for(viewing: Viewing) -> DisplayTransform:
    """The display transform that a scene asks for; what it leaves open keeps its default."""
    chosen: dict[str, Any] = {
        "display": viewing.display,
        "view": viewing.view,
        "config": viewing.ocio_config,
        "adaptation": viewing.adaptation,
    }
    return DisplayTransform(**{name: value for name, value in chosen.items() if value is not None})


def display_pass(renderer: Renderer, display: DisplayTransform) -> DisplayPass | None:
    """OCIO's own GLSL on the renderer's GPU; None (OCIO on the CPU) where the renderer has no GL."""
    return DisplayPass(renderer.context, display) if isinstance(renderer, GLRenderer) else None


def material_picture(
    record: MaterialRecord, scene: Scene, renderer: Renderer, display: DisplayTransform, on: DisplayPass | None
) -> tuple[UInt8[np.ndarray, "H W 3"], tuple[str, ...]]:
    """The scene from its first camera, its reviewed part in the packs of `record`, and what has to be said of it.

    The picture is in 8-bit codes of `display`; `on` as of `DisplayTransform.encode`.
    """
    dressed = scene.with_material(scene.reviewed_part, record.id)
    xyz, coverage = renderer.render(dressed, dressed.camera(), {record.id: record.packs})
    rgb, notes = _encoded(dressed, xyz, coverage, display, on)
    return quantise(rgb), notes


def render_picture(
    scene: Scene, catalogue: Catalogue, output: Path, camera: str | None, renderer: Renderer
) -> tuple[str, ...]:
    """Render factor packs to `output` (.exr: XYZ, .png: display-encoded); returns what has to be said of it."""
    check_output(output)
    packs = {name: catalogue.surface(name).packs for name in scene.material_ids}
    xyz, coverage = renderer.render(scene, scene.camera(camera), packs)
    return _write(scene, output, xyz, coverage, renderer.made_by, renderer)


def render_reference(scene: Scene, catalogue: Catalogue, output: Path, camera: str | None) -> tuple[str, ...]:
    """The same picture by the slow truth: rays, every wavelength, the original data."""
    check_output(output)
    brdfs = {name: catalogue.surface(name).brdf() for name in scene.material_ids}
    xyz, coverage = reference_image(scene, scene.camera(camera), brdfs)
    return _write(scene, output, xyz, coverage, "reference")


def render_spectral(
    scene: Scene, catalogue: Catalogue, output: Path, camera: str | None, renderer: Renderer
) -> tuple[str, ...]:
    """Render spectra at the working wavelengths to a spectral EXR.

    Values are relative spectral radiance: 1 is the perfect diffuser that receives the reference illuminance from a
    light of equal energy, and under any other light that diffuser has Y = 1 (`Renderer.render_spectra`).
    """
    check_output(output, spectral=True)
    packs = {name: catalogue.surface(name).packs for name in scene.material_ids}
    values = renderer.render_spectra(scene, scene.camera(camera), packs, WORKING_WAVELENGTHS_NM)
    notes = _thinned(scene, WORKING_WAVELENGTHS_NM)
    below = values < 0
    if below.any():
        notes.append(f"{below.mean():.2%} of the samples are below zero (lowest {values.min():.2g}), written as zero.")
    image = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.where(below, 0.0, values), "emission")
    write_spectral_exr(output, image, SPECTRAL_UNITS)
    return tuple(notes)


def _thinned(scene: Scene, wavelengths_nm: Float[np.ndarray, "L"]) -> list[str]:
    """What sampling the lights of a scene does to the colour of the perfect diffuser, where it can be seen."""
    notes = []
    to_xyz = radiance_weights(scene.observer, wavelengths_nm)
    for light in scene.lights:
        white = scene.observer.white(light.spectrum)
        sampled = to_xyz @ light.spectrum.resampled(wavelengths_nm).samples
        difference = float(delta_e_xyz(white, sampled / sampled[1], white))
        if difference > SAID_FROM:
            notes.append(
                f"{light.spectrum_name or light.name} is finer than the {len(wavelengths_nm)} wavelengths of the "
                f"picture: folding them shifts the perfect diffuser by ΔE94 {difference:.2f}."
            )
    return notes


def _write(
    scene: Scene,
    output: Path,
    xyz: Float[np.ndarray, "H W 3"],
    coverage: Float[np.ndarray, "H W"],
    made_by: str,
    renderer: Renderer | None = None,
) -> tuple[str, ...]:
    words = {"renderer": made_by, "observer": scene.observer.name}
    if output.suffix.lower() == ".exr":
        image = ColourImage(xyz, "xyz", scene.adopted_white())
        write_xyz_exr(output, image, np.asarray(coverage), words)
        return ()
    display = display_for(scene.viewing)
    on = None if renderer is None else display_pass(renderer, display)
    rgb, notes = _encoded(scene, xyz, coverage, display, on)
    write_png(output, rgb, display=display.display, words=[f"{name}: {value}" for name, value in words.items()])
    return notes


def _encoded(
    scene: Scene,
    xyz: Float[np.ndarray, "H W 3"],
    coverage: Float[np.ndarray, "H W"],
    display: DisplayTransform,
    on: DisplayPass | None,
) -> tuple[Float[np.ndarray, "H W 3"], tuple[str, ...]]:
    """A picture of the scene over its background, display-encoded, and what was done to fit it in."""
    white = scene.adopted_white()
    background = white * scene.viewing.background_reflectance
    return display.encode(ColourImage(xyz, "xyz", white), coverage, background, on)
