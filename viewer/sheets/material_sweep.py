"""Images along a slider: one scene with a sequence of materials on a part, and a strip of them.

Meshes, shadows and rays between surfaces depend on geometry only and are computed once.
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
    """Yield images of the scene with each of the materials on a part, rendered on demand.

    Parameters
    ----------
    materials : for instance from `varied_along` or `like`; they need not be in the catalogue, which has those of all
        other parts.

    Raises
    ------
    UnknownNameError : an unknown part or camera. InputError : see `RenderSession.render`.
    """
    scene.part(part)
    for material in materials:
        more = VariedCatalogue.of(catalogue, [material])
        yield material, picture(scene.with_material(part, material.id), more, camera, renderer, warn)


def row_of(pictures: Sequence[UInt8[np.ndarray, "H W 3"]], captions: Sequence[str]) -> UInt8[np.ndarray, "H2 W2 3"]:
    """Join display-encoded images of one size side by side, each with a caption below."""
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
