"""Pictures along a slider: one scene with one material after the other on a part of it, and all of them in a row.

Meshes, shadows and rays between surfaces hang on the geometry: the renderer has them from the first picture on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from jaxtyping import UInt8

from ...lighting.scene import Scene
from ...materials.catalogue.catalogue import Catalogue
from ...materials.catalogue.material import Material
from ...materials.search.edited_material import VariedCatalogue
from ...runtime.errors import InputError
from ..picture import Picture, Warn, picture, unheard
from ..render.session import RenderSession
from .sheet_text import fitted_line, sheet_font, write_line

_POINTS = 11
_GAP = 4
_PAGE, _INK = (241, 241, 241), (26, 26, 26)


def along(
    scene: Scene,
    part: str,
    materials: Iterable[Material],
    catalogue: Catalogue,
    renderer: RenderSession,
    camera: str | None = None,
    warn: Warn = unheard,
) -> Iterator[tuple[Material, Picture]]:
    """Yield the scene with each of the materials on a part, one after the other; each is drawn when it is asked for.

    Parameters
    ----------
    materials : such as `varied_along` makes, or the neighbours that `like` finds; they need not be in the catalogue,
        which has those of all other parts.

    Raises
    ------
    UnknownNameError : no such part, no such camera. InputError : what `RenderSession.render` raises.
    """
    scene.part(part)
    for material in materials:
        more = VariedCatalogue.of(catalogue, [material])
        yield material, picture(scene.with_material(part, material.id), more, camera, renderer, warn)


def row_of(pictures: Sequence[UInt8[np.ndarray, "H W 3"]], captions: Sequence[str]) -> UInt8[np.ndarray, "H2 W2 3"]:
    """Pictures of one size side by side, display-encoded, each with its caption under it."""
    from PIL import Image

    if not pictures:
        raise InputError("no pictures for a row", field="pictures", found=0, expected="one at least")
    height, width, _ = pictures[0].shape
    font, line = sheet_font(_POINTS), _POINTS + 4
    sheet = Image.new("RGB", (len(pictures) * (width + _GAP) - _GAP, height + line), _PAGE)
    for number, (shown, caption) in enumerate(zip(pictures, captions, strict=True)):
        left = number * (width + _GAP)
        sheet.paste(Image.fromarray(shown), (left, 0))
        write_line(sheet, (left + 2, height + 1), fitted_line(caption, font, width - 4), _INK, font)
    return np.asarray(sheet)
