"""Fluorescent surfaces as rows of the benchmark: drawn by the renderer, against every wavelength of the full matrix.

Beside them, what the same surface looks like to tools without fluorescence. Each is given the best case that it has:

- "reflectance": the radiance factor under D65 (what a spectrophotometer's lamp of daylight reports), taken for a
  reflectance. Right under D65 and wrong under every other light.
- "diagonal": the part that keeps its wavelength, which is the true reflectance.
- "RGB": the true colour under D65 in linear sRGB, times the RGB of the light.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...materials.analytic.fluorescent import FluorescentLambert
from ...materials.factored.pack import FactorPack
from ...spectral.basis import SpectralBasis
from ...spectral.bispectral import Bispectral
from ...spectral.observers import observer
from ...spectral.palette import Palette
from ...spectral.spectrum import Spectrum
from ...spectral.upsampling import xyz_from_rgb
from ...viewer.render.session import RenderSession
from ..fluorescence import UV_FREE, UV_FREE_WORDS, direct, two_surfaces
from ..fluorescence import fluorescence_lights as benchmark_lights
from ..timing import peak_bytes, timed
from .case import Case
from .scenes import picture_statistics, reference_xyz, rendered_xyz
from .timing import Stopwatch

#: Illuminants of the rows.
LIGHTS = ("D65", "A", UV_FREE)
#: Ways to leave fluorescence out, for people.
WITHOUT = {
    "reflectance": "its radiance factor under D65 as a reflectance",
    "diagonal": "what keeps its wavelength alone",
    "rgb": "RGB",
}
CONSTRUCTION = f"{UV_FREE}: {UV_FREE_WORDS}"

Pictures = Float[np.ndarray, "M A P P 3"]


@dataclass(frozen=True, eq=False)
class Drawn:
    """Pictures of one surface under M lights at A angles: the reference, the renderer's, and those `WITHOUT`."""

    reference: Pictures
    packs: Pictures
    without: Mapping[str, Pictures]


def row_lights() -> dict[str, Spectrum]:
    """Return the lights of the rows by name."""
    return {name: light for name, light in benchmark_lights().items() if name in LIGHTS}


def fluorescent_rows(
    case: Case, brdf: FluorescentLambert, drawn: Drawn, stopwatch: Stopwatch
) -> tuple[list[dict], list[dict]]:
    """One row a light, shaped as those of fitted surfaces, and one more of what tools without fluorescence show.

    The baselines are null: neither can send light out at another wavelength than it came in.
    """
    # There is nothing to fit.
    fast, seconds = timed(brdf.own_form)
    packs, peak = fast.packs, peak_bytes(brdf.own_form)
    milliseconds = stopwatch.milliseconds(packs)
    rows, without = [], []
    for index, (name, light) in enumerate(row_lights().items()):
        found = {
            key: picture_statistics(drawn.reference[index], pictures[index], light)
            for key, pictures in {"packs": drawn.packs, **drawn.without}.items()
        }
        rows.append(
            {
                "case": case.name,
                "light": name,
                "frames": [pack.frame for pack in packs],
                "packs": 1,
                "rank": sum(pack.rank for pack in packs),
                "fit_seconds": seconds,
                "table_bytes": brdf.bispectral.matrix.nbytes,
                "peak_bytes": peak,
                "relative_error": 0.0,
                "delta_e94": found["packs"],
                "ms_per_megapixel": milliseconds,
                "baseline": {"tensorly_seconds": None, "tensorly_relative_error": None, "dbrdf_delta_e94": None},
            }
        )
        without.append({"case": case.name, "light": name, "delta_e94": found})
    return rows, without


def draw(renderer: RenderSession, brdf: FluorescentLambert, pixels: int, angles_deg: tuple[float, ...]) -> Drawn:
    """Return every picture that the rows and the page need."""
    lights = row_lights()

    def rendered(packs: tuple[FactorPack, ...]) -> Pictures:
        return rendered_xyz(renderer, packs, lights, pixels, angles_deg)

    own = rendered(brdf.own_form().packs)
    diagonal = FluorescentLambert(brdf.bispectral.without_emission())
    daylight = own[list(lights).index("D65")]
    return Drawn(
        reference_xyz(brdf, lights, pixels, angles_deg),
        own,
        {
            "reflectance": rendered((reflectance_pack(brdf, lights["D65"]),)),
            "diagonal": rendered(diagonal.own_form().packs),
            "rgb": np.stack([daylight @ _rgb_multiply(lights["D65"], light).T for light in lights.values()]),
        },
    )


def reflectance_pack(brdf: FluorescentLambert, light: Spectrum) -> FactorPack:
    """Return the radiance factor under one light, as if it were the surface's reflectance; it may exceed 1."""
    (pack,) = brdf.own_form().packs
    grid = brdf.wavelengths_nm
    factor = brdf.bispectral.radiance(light, grid) / light.averaged(grid).samples
    return FactorPack(pack.frame, pack.axes, pack.factors, Palette.of(factor[None], SpectralBasis.sampled(grid)))


def fluorescence_figures(surfaces: Sequence[Bispectral], progress: Callable[[str], None]) -> dict:
    """Figures without a picture: direct light, and few coefficients of radiance carried over two surfaces."""
    progress(f"fluorescence: {len(surfaces)} surfaces and the ColorChecker, in pairs, in J coefficients")
    return {"lights": CONSTRUCTION, "direct": direct(surfaces), "two_surfaces": two_surfaces(surfaces)}


def _rgb_multiply(known: Spectrum, light: Spectrum) -> Float[np.ndarray, "3 3"]:
    """XYZ under `light` from XYZ under `known`, as a product of RGB values."""
    eye, to_xyz = observer("1931_2"), xyz_from_rgb()
    ratio = np.linalg.solve(to_xyz, eye.white(light)) / np.linalg.solve(to_xyz, eye.white(known))
    return to_xyz @ (ratio[:, None] * np.linalg.inv(to_xyz))
