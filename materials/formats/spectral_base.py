"""The base colour of a set of maps as a spectral OpenEXR picture: measured reflectances in place of RGB."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.formats.exr import read_picture
from ...spectral.formats.import_options import ImportOptions
from ..svbrdf.maps import MappedSurface
from .naming import printable
from .texture_exr import MOST_SAMPLES, header_of, spectral_textures, surface_of


@dataclass(frozen=True, eq=False)
class SpectralBase:
    """Reflectances (H,W,L) as stored, at `wavelengths_nm`; notes on assumptions; the header, for the record."""

    wavelengths_nm: Float[np.ndarray, " L"]
    values: np.ndarray
    notes: tuple[str, ...]
    original: dict[str, Any]

    @property
    def size(self) -> tuple[int, int]:
        """(H, W)."""
        return self.values.shape[0], self.values.shape[1]


def read_spectral_base(path: Path, answer: ImportOptions) -> SpectralBase:
    """Return the reflectances of a picture.

    Raises
    ------
    InputError : see `texture_exr.read_sources`; more than one layer or quantity, an emission, a mean above 1.
    """
    picture = read_picture(path, MOST_SAMPLES)
    textures = spectral_textures(picture, path)
    texture = textures[0]
    if len(textures) > 1 or texture.kind != "T":
        raise InputError(
            "not one base colour",
            file=path,
            field="channels",
            found=", ".join(f"{one.layer}{'.' if one.layer else ''}{one.kind}" for one in textures),
            expected="reflectances alone: channels such as T.550,0nm, in one layer",
            hint="save the reflectance as a picture of its own, or move it to another folder to import it alone",
        )
    mean = texture.values.mean(axis=(0, 1), dtype=np.float64)
    model, _, notes = surface_of(texture, mean, path, answer)
    if model != "spectral_texture":
        raise InputError(
            "no base colour",
            file=path,
            field="mean",
            found=f"{mean.max():.3g} on average",
            expected="reflectances, at most 1",
            hint="scale the picture, or move it to another folder to import it alone",
        )
    count = len(texture.wavelengths_nm)
    said = [f"the base colour is measured: {count} wavelengths at every texel"]
    notes = said + [note for note in notes if "diffuse" not in note]
    if any(name.rpartition(".")[2] in ("R", "G", "B") for name in picture.channels):
        notes.append(f"the RGB preview in {printable(path.name)} is not kept")
    return SpectralBase(texture.wavelengths_nm, texture.values, tuple(notes), header_of(picture.attributes))


def mean_of(surface: MappedSurface | None, matt: bool) -> tuple[str, dict[str, Any]]:
    """Return model and parameters of the mean surface for maps with measured colours."""
    assert surface is not None
    mean = surface.average()
    if matt:
        return "lambert", {"wavelengths_nm": mean.wavelengths_nm, "reflectance": mean.diffuse.samples}
    return mean.NAME, {"wavelengths_nm": mean.wavelengths_nm, **mean.parameters()}
