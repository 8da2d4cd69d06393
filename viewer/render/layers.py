"""Layers: summands of an image, each terms at every pixel times colours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...lighting.environment.panel import GatheredPanel
from ...lighting.environment.prefiltering import GatheredLight
from ...lighting.transfer.indirect import IndirectLight
from ...materials.core.environment_form import EnvironmentForm
from ...materials.core.fast import Summand
from .light_cache import Shadows


@dataclass(frozen=True, eq=False)
class Layer:
    """One summand of one part's material under all lights of one spectrum: `colours` (P, R, 3 M) are its palette's XYZ
    under M spectra that replace it.
    """

    part: int
    lights: tuple[int, ...]
    summand: Summand
    colours: Float[np.ndarray, "P R M3"]

    @property
    def terms_key(self) -> tuple:
        """Key of its terms, independent of spectra; valid while the summand is alive."""
        return self.part, self.lights, self.summand.key

    @property
    def rank(self) -> int:
        """Number of terms per pixel."""
        return self.summand.rank

    @property
    def foldable(self) -> bool:
        """True if its terms can be cached per pixel, which is impossible if the summand mixes palette entries."""
        return self.summand.palette.entries == self.summand.mixed == 1


@dataclass(frozen=True, eq=False)
class SpreadLayer:
    """One part's material under at most four fields of an area, environment or indirect light.

    fields : slice of its fields. gathered : their light. world_from_map (3, 3) : its rotation.
    scale : pi / E_ref over the samples of a pixel. colours (1, F R, 3 M) : for each field, the form's palette in XYZ
    under M spectra that replace the field's, R rounded up to a multiple of four.
    """

    part: int
    fields: slice
    form: EnvironmentForm
    gathered: GatheredLight | GatheredPanel | IndirectLight
    world_from_map: Float[np.ndarray, "3 3"]
    scale: float
    colours: Float[np.ndarray, "1 FR M3"]
    shadows: Shadows | None = None

    @property
    def terms_key(self) -> tuple:
        """Key of its terms, as in `Layer`: maps, positions and occlusion, never a spectrum."""
        gathered, shadows = self.gathered, self.shadows
        near = isinstance(gathered, GatheredPanel)
        sent = (gathered.corners.tobytes(), gathered.luminance) if near else (id(gathered),)
        hidden = None if shadows is None else (id(shadows.visibility), id(shadows.bright))
        place = self.part, self.world_from_map.tobytes(), self.fields.start, self.fields.stop, self.scale
        return "spread", *place, sent, hidden, self.form.key

    @property
    def rank(self) -> int:
        """Number of terms per pixel, F R."""
        return self.colours.shape[1]

    @property
    def foldable(self) -> bool:
        """True; see `Layer.foldable`."""
        return True


AnyLayer = Layer | SpreadLayer

# Fields of a light looked up at once, the channels of a texel.
_MOST_FIELDS = 4


def layers_of_fields(
    part: int,
    form: EnvironmentForm,
    gathered: GatheredLight | GatheredPanel | IndirectLight,
    world_from_map: Float[np.ndarray, "3 3"],
    scale: float,
    colours: Sequence[Float[np.ndarray, "R M3"]],
    shadows: Shadows | None = None,
) -> Iterator[SpreadLayer]:
    """Iterate over a part's layers under a light, four fields each; `colours` are those of its form for each field."""
    for start in range(0, len(colours), _MOST_FIELDS):
        fields = slice(start, min(start + _MOST_FIELDS, len(colours)))
        rounded = np.concatenate([np.pad(one, ((0, -len(one) % 4), (0, 0))) for one in colours[fields]])[None]
        yield SpreadLayer(part, fields, form, gathered, world_from_map, scale, rounded, shadows)


def split_by_terms(layers: Sequence[AnyLayer], keep: bool) -> tuple[list[AnyLayer], list[AnyLayer]]:
    """Split layers into those drawn from cached terms and those drawn directly; without `keep` all are the latter."""
    kept = [one for one in layers if keep and one.foldable]
    return kept, [one for one in layers if one not in kept]
