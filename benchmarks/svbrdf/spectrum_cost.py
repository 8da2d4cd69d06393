"""Cost of spectra in a picture under environment light, beside RGB: a metal on a floor, shadows and all, by GL.

`ours` is nine coefficients of a basis under a sky of three spectra: each field's terms are gathered, then folded. `rgb`
is three numbers under one field, whose look-ups fetch as many numbers at once as those of an RGB sky do: what a
renderer without spectra draws. The two take turns; the picture's geometry and visibility are kept.

Errors are of the same lobes with other numbers in them, so that they are those of colour alone: `rgb` multiplies each
channel of the sky by that of gold under D65.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.mesh import shapes
from ...lighting.scene import Part, Scene
from ...materials.factored.pack import FactoredBrdf, matt_brdf
from ...materials.slices.view_slices import ViewSlices
from ...spectral.basis import SpectralBasis
from ...spectral.difference import delta_e_xyz
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.palette import Palette
from ...spectral.upsampling import xyz_from_rgb
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ...viewer.gl.backend import gl_session
from ...viewer.gl.context import NoGL
from . import meshes
from .cases import gold, window_sky
from .gold import reflectance
from .light import PreparedLight
from .ours import gathered_by, slices_of
from .rows import svbrdf_row
from .surface import ShadedPoints

NAME = "spectrum beside RGB"
#: Coefficients; pixels across; turns; roughness of the metal; and points across the sphere that errors are taken on.
SIZE, PIXELS, TURNS, ALPHA, ACROSS = 9, 512, 7, 0.2, 26


def spectrum_cost(wanted: Callable[[str], bool], progress: Callable[[str], None]) -> Iterator[dict]:
    """Yield a row for each of the two; nothing where there is no GL."""
    if not wanted(NAME):
        return
    progress(NAME)
    light = window_sky()
    slices, metal = _whole_slices(), reflectance(np.ones(1))[0]
    basis = _basis(light)
    forms = {
        "ours": _with(slices, metal @ basis.analysis, Palette.of(basis.synthesis.T)),
        "rgb": _with(slices, np.ones(3), Palette.of(np.eye(3, len(metal)))),
    }
    try:
        milliseconds = _milliseconds(forms, {"ours": light, "rgb": light.with_spectrum(illuminant("D65"))})
    except NoGL as missing:
        progress(f"without {NAME}: {missing}")
        return
    found, truth, white = _seen(forms["ours"], basis, metal, light)
    for name, xyz in found.items():
        apart = delta_e_xyz(truth, xyz, white)
        yield svbrdf_row(NAME, name, "made-sky", apart, 0.0, lobes=slices.count, ms_per_megapixel=milliseconds[name])


def _whole_slices() -> ViewSlices:
    """Compute the slices of facets that reflect everything: one term."""
    found, white = slices_of(gold(ALPHA)), Palette.of(np.ones((1, len(WORKING_WAVELENGTHS_NM))))
    return replace(found, value=found.value[..., 1:].sum(axis=-1, keepdims=True), palette=white)


def _with(slices: ViewSlices, numbers: Float[np.ndarray, " R"], palette: Palette) -> ViewSlices:
    return replace(slices, value=slices.value * numbers, palette=palette)


def _basis(light: EnvironmentLight) -> SpectralBasis:
    """Nine coefficients: under three spectra as many as make three XYZ exact."""
    nm = WORKING_WAVELENGTHS_NM
    weights = np.hstack([observer("1931_2").weights(spectrum, nm).T for spectrum in light.spectra])
    return SpectralBasis.balanced(np.exp(-(((nm[:, None] - nm) / 40.0) ** 2)), weights, SIZE)


def _seen(
    form: ViewSlices, basis: SpectralBasis, metal: Float[np.ndarray, " L"], light: EnvironmentLight
) -> tuple[dict[str, np.ndarray], Float[np.ndarray, "N 3"], Float[np.ndarray, "3"]]:
    """XYZ of both at points of a sphere, of gold itself by the same lobes, and white."""
    points, prepared = ShadedPoints.of_sphere(ACROSS), PreparedLight(light)
    seen_by, nm = observer("1931_2"), WORKING_WAVELENGTHS_NM
    numbers = metal @ basis.analysis
    terms = gathered_by(form, points, light)
    # The same number times each coefficient: what a white metal's lobes gather of each field.
    gathered = terms @ numbers / (numbers @ numbers)
    weights = np.stack([seen_by.weights(spectrum, nm) for spectrum in light.spectra])
    under_d65 = np.linalg.solve(xyz_from_rgb(), seen_by.weights(illuminant("D65"), nm) @ metal)
    found = {
        "ours": prepared.folded(terms, basis.synthesis.T),
        "rgb": gathered * under_d65 @ weights.sum(axis=2),
    }
    return found, gathered @ (weights @ metal), prepared.white(points)


def _milliseconds(forms: dict[str, ViewSlices], lights: dict[str, EnvironmentLight]) -> dict[str, float]:
    """Return a megapixel each, the median of the turns."""
    body, floor = shapes.speed_shape(meshes.SUBDIVISIONS), shapes.plane(4.0, 4.0)
    parts = (Part("shape", body, "metal"), Part("floor", floor, "metal"))
    camera = Camera("view", (2.5, 2.0, 3.0), (0, 0, 0), width=PIXELS, height_px=PIXELS, samples=1)
    scenes = {name: Scene(parts, (light,), (camera,), observer("1931_2")) for name, light in lights.items()}
    drawn = {name: {"metal": _drawn(form)} for name, form in forms.items()}
    seconds: dict[str, list[float]] = {name: [] for name in forms}
    with gl_session() as renderer:
        for name in forms:
            renderer.render(scenes[name], None, drawn[name])
        for _ in range(TURNS):
            for name in forms:
                begun = time.perf_counter()
                renderer.render(scenes[name], None, drawn[name])
                seconds[name].append(time.perf_counter() - begun)
    return {name: 1e9 * float(np.median(each)) / PIXELS**2 for name, each in seconds.items()}


def _drawn(form: ViewSlices) -> FactoredBrdf:
    """Return a surface that gathers so; its packs are for other lights."""
    return replace(matt_brdf(np.ones(form.palette.rank), form.palette), slices=form)
