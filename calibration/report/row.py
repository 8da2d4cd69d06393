"""Row of the review: one material under one light, with its pictures, figures and notes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from ...runtime.errors import ComparisonError
from . import coded_map, plots
from .histogram import histogram
from .statistics import DeltaEStatistics


@dataclass(frozen=True, eq=False)
class RowColour:
    """The colour of a material's original data under the light of a row, for the row's observer.

    Parameters
    ----------
    xyz : Y = 1 for the perfect diffuser.
    lab : CIELAB relative to the row's white.
    geometry : of light and view, such as "45a:0".
    around : of metals and effect coatings, as read by multi-angle instruments: degrees from the mirror direction
        towards the light, lit at 45 degrees, and XYZ and CIELAB there.
    """

    xyz: Float[np.ndarray, "3"]
    lab: Float[np.ndarray, "3"]
    geometry: str
    around: tuple[tuple[float, Float[np.ndarray, "3"], Float[np.ndarray, "3"]], ...] = ()


@dataclass(frozen=True)
class ReferenceNoise:
    """Sampling noise of a row's reference, in ΔE94 over its wholly covered and lit pixels.

    mean, p99 : of the pixels; `aimed` : limit of the mean.
    directions : largest number drawn for a pixel. limited : True if the maximum was reached before the aim.
    """

    mean: float
    p99: float
    aimed: float
    directions: int
    limited: bool


@dataclass(frozen=True)
class Limits:
    """Parts of a row's picture that its display cannot show.

    below_gamut, above_white : shares (0 to 1) of the surface, of the pixels that it covers wholly, with a channel below
    or above the display's range. mean_delta_e2000 : between the colours and those shown in their place, over those
    below alone; None without any, or if the displayed colours are unknown. below_black : the part of `below_gamut` that
    is darker than the display's black; the rest is outside its gamut.
    """

    below_gamut: float
    above_white: float
    mean_delta_e2000: float | None
    below_black: float = 0.0

    @property
    def too_strong(self) -> float:
        """Fraction of the surface outside the display's gamut."""
        return self.below_gamut - self.below_black


@dataclass(frozen=True, eq=False)
class WorstPixel:
    """The pixel of a row with the largest ΔE94: its row and column, and CIELAB (3,) of reference and picture there.

    wavelengths_nm, reference_factor, picture_factor : (L,) radiance factors of the pixel, relative to the perfect
    diffuser that receives the reference illuminance: by the original data, and by the fast form that the picture is
    made of. None if a material fluoresces.
    """

    place: tuple[int, int]
    delta_e94: float
    reference_lab: Float[np.ndarray, "3"]
    picture_lab: Float[np.ndarray, "3"]
    wavelengths_nm: Float[np.ndarray, "L"] | None = None
    reference_factor: Float[np.ndarray, "L"] | None = None
    picture_factor: Float[np.ndarray, "L"] | None = None


@dataclass(frozen=True, eq=False)
class ReviewRow:
    """One material under one light; make it with `review_row`, which encodes the pictures and releases the arrays.

    Parameters
    ----------
    material, illuminant, observer : names.
    statistics : ΔE94 over the compared pixels.
    image : picture file, relative to the report's folder.
    picture, reference : lossless WebP files, as shown on the page, of `width` x `height` pixels, transparent where no
        surface is.
    delta_e_map : PNG of the same size, as of `coded_map`.
    full_size : height and width of the pictures before they were reduced to be shown.
    seconds : how long each step took, by its name.
    files : further files beside the page by their label, relative to its folder.
    wavelengths_nm, reflectance : (L,) curve of the material, or None.
    colour : of the original data under this light, or None; `swatch` is the same, display-encoded.
    white_xyz : white of this light for this observer.
    histogram : pixels by their ΔE94, as of `histogram`. shift : mean ΔL*, Δa*, Δb* of picture less reference.
    worst : the pixel with the largest ΔE94; None where no pixel holds a number.
    noise : of the reference; None if it is deterministic.
    limits : parts of the picture that the display cannot show; None if its view does not tell. mask : a PNG of the
        picture's size, opaque only there, empty if there are none.
    notes : on this row: clipped pixels, extrapolated wavelengths, missing numbers.
    provenance : of the material, as label and text.
    """

    material: str
    illuminant: str
    observer: str
    statistics: DeltaEStatistics
    image: str
    picture: bytes
    reference: bytes
    delta_e_map: bytes
    width: int
    height: int
    full_size: tuple[int, int]
    seconds: Mapping[str, float] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)
    wavelengths_nm: Float[np.ndarray, "L"] | None = None
    reflectance: Float[np.ndarray, "L"] | None = None
    swatch: tuple[int, int, int] | None = None
    colour: RowColour | None = None
    white_xyz: Float[np.ndarray, "3"] | None = None
    histogram: tuple[int, ...] = ()
    shift: tuple[float, float, float] | None = None
    worst: WorstPixel | None = None
    noise: ReferenceNoise | None = None
    limits: Limits | None = None
    mask: bytes = b""
    notes: tuple[str, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name on the page, in the history and in links: material and light."""
        return f"{self.material}@{self.illuminant}"


def review_row(
    material: str,
    illuminant: str,
    observer: str,
    *,
    statistics: DeltaEStatistics,
    picture: UInt8[np.ndarray, "h w c"],
    reference: UInt8[np.ndarray, "H W c"],
    delta_e: Float[np.ndarray, "H W"],
    budget: float,
    rows: int,
    image: str,
    limits_mask: UInt8[np.ndarray, "H W"] | None = None,
    **more: Any,
) -> ReviewRow:
    """Make a row from display-encoded pictures (RGB or RGBA) and a ΔE map (NaN: not compared, infinite: no number).

    `rows` is how many rows the report will have: with many, the embedded pictures are reduced to keep the page quick to
    open (the mean in linear light for pictures, the largest value for maps), with a note. `limits_mask` is not 0 where
    the display cannot show the picture, which may be larger than reference and map. `more` is passed to `ReviewRow`.

    Raises
    ------
    ComparisonError : picture and reference are the same array.
    """
    if np.may_share_memory(picture, reference):
        raise ComparisonError(f"{material} under {illuminant}: picture and reference are the same array")
    full = (delta_e.shape[0], delta_e.shape[1])
    side = plots.embedded_side(rows)
    size, pictured = plots.fitted_size(full, side), plots.fitted_size((picture.shape[0], picture.shape[1]), side)
    notes = [*more.pop("notes", ())]
    noise = more.get("noise")
    if noise is not None and noise.limited:
        notes.append(
            f"The reference is uncertain by ΔE94 {noise.mean:.2g} (mean), with as many directions as are allowed; "
            f"{noise.aimed:.2g} was aimed at."
        )
    if picture.shape[:2] != full:
        notes.append(
            f"The picture has {picture.shape[1]} x {picture.shape[0]} pixels; reference, map and figures are of "
            f"{full[1]} x {full[0]}."
        )
    if size != full:
        notes.append(f"Shown in {size[1]} x {size[0]} pixels; the figures are those of all {full[1]} x {full[0]}.")
    if statistics.max == 0.0:
        notes.append("Every compared pixel is exactly equal: make sure that the reference is computed independently.")
    if statistics.undefined:
        notes.append(f"{statistics.undefined} compared pixels hold no number; they are in none of the figures.")
    reduced = plots.reduce_map(delta_e, size)
    return ReviewRow(
        material=material,
        illuminant=illuminant,
        observer=observer,
        statistics=statistics,
        image=image,
        picture=plots.lossless(plots.reduce_picture(picture, pictured)),
        reference=plots.lossless(plots.reduce_picture(reference, size)),
        delta_e_map=coded_map.map_png(reduced, budget),
        width=reduced.shape[1],
        height=reduced.shape[0],
        full_size=full,
        histogram=histogram(delta_e, budget),
        mask=b"" if limits_mask is None or not limits_mask.any() else plots.mask_png(limits_mask, size),
        notes=tuple(notes),
        **more,
    )
