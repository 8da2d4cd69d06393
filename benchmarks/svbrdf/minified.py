"""Maps of bumps from afar: what a filtered look-up shows of eight by eight texels, beside the mean of all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...materials.core.directions import spherical
from ...materials.core.points import Points
from ...materials.svbrdf.maps import MappedSurface
from ...materials.svbrdf.texel_map import TexelMap
from ...spectral.difference import delta_e_xyz
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from .rows import svbrdf_row

#: Texels along a side of what a sample spans; blocks, with a direction of light and of view each.
WIDE, BLOCKS = 8, 1500
#: Widths alpha of the highlight.
ALPHAS = (0.2, 0.4)
#: Cases by those.
NAMES = {f"normal map 8 x 8, {alpha:g}": alpha for alpha in ALPHAS}
# A blue body, as RGB.
_BODY = (0.05, 0.1, 0.3)
_LIGHT = "D65"


def minified(data: Path | None, wanted: Callable[[str], bool], progress: Callable[[str], None]) -> Iterator[dict]:
    """Yield a row for each width of the highlight, by `ours` and by `one-texel`, which looks up the middle alone.

    The reference is the sum over all texels: it has no noise.
    """
    file = None if data is None else data / "maps" / "brick" / "brick_normal.png"
    if file is None or not file.is_file():
        return
    for name, alpha in NAMES.items():
        if wanted(name):
            progress(name)
            yield from _rows(name, _bumps(file, alpha))


def _bumps(file: Path, alpha: float) -> MappedSurface:
    """Return a plastic with the picture's normals, green upwards."""
    from PIL import Image

    with Image.open(file) as picture:
        codes = np.asarray(picture.convert("RGB"))
    normal = TexelMap(np.ascontiguousarray(codes), False, (2.0,), (-1.0,))
    base, rough = TexelMap.constant(*_BODY), TexelMap.constant(float(np.sqrt(alpha)))
    return MappedSurface(WORKING_WAVELENGTHS_NM, base, rough, "mallett-yuksel", normal=normal)


def _rows(name: str, surface: MappedSurface) -> Iterator[dict]:
    form = surface.own_form()
    folding = Folding(observer("1931_2"), [illuminant(_LIGHT)], np.pi)
    white = folding.observer.white(folding.lights[0])
    height, width = surface.size
    wi, wo, corner = _looks(width, height)
    span = np.array([width, height])
    middle = (corner + 0.5 * WIDE) / span
    inside = (np.stack(np.meshgrid(np.arange(WIDE), np.arange(WIDE)), axis=-1).reshape(-1, 2) + 0.5)[:, None]
    truth = np.mean([form.shaded_xyz(Points(wi, wo, uv), folding) for uv in (corner + inside) / span], axis=0)
    footprint = np.tile(np.diag(WIDE / span * (1.0, -1.0)), (len(wi), 1, 1))
    for method, points in (
        ("ours", Points(wi, wo, middle, footprint, spans={})),
        ("one-texel", Points(wi, wo, middle)),
    ):
        # Levels are made when they are first asked for.
        form.shaded_xyz(points.chosen(slice(1)), folding)
        begun = time.process_time()
        found = form.shaded_xyz(points, folding)
        milliseconds = 1e9 / len(wi) * (time.process_time() - begun)
        yield svbrdf_row(name, method, _LIGHT, delta_e_xyz(truth, found, white), 0.0, ms_per_megapixel=milliseconds)


def _looks(width: int, height: int) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"], np.ndarray]:
    """Draw directions to light and viewer, and a block's first texel: at random, blocks where levels have theirs."""
    rng = np.random.default_rng(0)
    theta = np.arcsin(0.98 * np.sqrt(rng.uniform(size=(2, BLOCKS))))
    phi = rng.uniform(0.0, 2.0 * np.pi, (2, BLOCKS))
    corner = WIDE * rng.integers(0, (width // WIDE, height // WIDE), (BLOCKS, 2))
    return spherical(theta[0], phi[0]), spherical(theta[1], phi[1]), corner
