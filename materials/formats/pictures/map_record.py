"""Maps of a material in its record: the files as they came, and what makes spectra of their texels.

maps.SLOT                 the picture's bytes (uint8), as they came
maps.SLOT.type            "image/png", ...
maps.SLOT.encoding        of its colours: "sRGB" or "linear"
maps.SLOT.size            (H, W)
maps.SLOT.same_as         another slot, whose bytes these are
uplift.method             how spectra are made of linear colours
uplift.wavelengths_nm     (L,)
uplift.spectra            (V,L) that the method combines; for "mallett-yuksel" (3,L), and
                          reflectance (H,W,L) = linear colour (H,W,3) @ uplift.spectra
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float

from ....runtime.errors import InputError, UnknownNameError
from ....spectral.upsampling import PRIMARIES, upsampling
from ....spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ...svbrdf.textures import Encoding, Texture

_PREFIX = "maps."


def kept_maps(textures: Iterable[Texture], uplift: str) -> dict[str, Any]:
    """Collect the pictures of these textures for `original`, each once."""
    kept: dict[str, Any] = {}
    slots: dict[str, str] = {}
    for texture in textures:
        name = _PREFIX + texture.slot
        kept[f"{name}.encoding"] = texture.encoding
        if texture.digest in slots:
            kept[f"{name}.same_as"] = slots[texture.digest]
            continue
        slots[texture.digest] = texture.slot
        kept[name] = np.frombuffer(texture.data, np.uint8)
        try:
            kept |= {f"{name}.type": texture.mime, f"{name}.size": np.array(texture.size)}
        except InputError:
            # Whatever it is, it is kept; who reads the material says that it was not understood.
            kept[f"{name}.type"] = "application/octet-stream"
    method = upsampling(uplift)
    return kept | {
        "uplift.method": uplift,
        "uplift.primaries": PRIMARIES,
        "uplift.wavelengths_nm": WORKING_WAVELENGTHS_NM,
        "uplift.spectra": method.corners,
    }


def kept_texture(original: Mapping[str, Any], slot: str) -> Texture:
    """Return the map of that name out of a record's `original`; raises `UnknownNameError`."""
    slots = sorted(
        name.removeprefix(_PREFIX).removesuffix(".encoding")
        for name in original
        if name.startswith(_PREFIX) and name.endswith(".encoding")
    )
    if slot not in slots:
        raise UnknownNameError("map", slot, slots)
    holder = str(original.get(f"{_PREFIX}{slot}.same_as", slot))
    encoding = cast(Encoding, original[f"{_PREFIX}{slot}.encoding"])
    data = np.asarray(original[_PREFIX + holder], np.uint8).tobytes()
    return Texture(slot, data, encoding, Path(holder), f"{_PREFIX}{slot}")


def texel_reflectances(
    original: Mapping[str, Any], slot: str, rows: slice, columns: slice
) -> Float[np.ndarray, "h w L"]:
    """Spectra of a colour map's texels, made up by the record's own method.

    Raises
    ------
    InputError
        No such map; rows that are none of it.
    """
    texture = kept_texture(original, slot)
    height, width = texture.size
    start, stop, _ = rows.indices(height)
    if stop <= start or len(range(*columns.indices(width))) == 0:
        raise InputError("no texels", field=slot, found=f"{rows}, {columns}", expected=f"within {height} x {width}")
    colours = texture.linear(slice(start, stop))[:, columns]
    return upsampling(str(original["uplift.method"])).spectra(colours)
