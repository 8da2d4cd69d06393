"""The fast form of a BTF as lobes of each texel and view."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ...spectral.basis import SpectralBasis
from ...spectral.palette import Palette
from ..fast import Fast, Summand
from ..fit_error import FitError
from .lobe_field import LobeField
from .lobe_gathering import LobeGathering
from .lobe_texels import LobeTexels


@dataclass(frozen=True, eq=False)
class LobeForm(Fast):
    """Lobes of each texel and view, three views mixed (Meseth, Mueller and Klein 2003; `lobe_field`)."""

    NAME: ClassVar[str] = "btf_lobes"
    WORDS: ClassVar[str] = "lobes of each view"
    isotropic = False

    texels: LobeTexels
    error: FitError | None = None

    @property
    def summands(self) -> tuple[Summand, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The texels alone."""
        return (self.texels,)

    def in_basis(self, basis: SpectralBasis) -> LobeForm:
        """See `Fast.in_basis`; texels are shared."""
        return replace(self, texels=self.texels.in_basis(basis))

    def environment_form(self) -> LobeGathering:
        """See `Fast.environment_form`."""
        return LobeGathering(texels=self.texels)

    def stored(self) -> dict[str, Any]:
        """The lobes (`LobeField.stored`) and the palette."""
        return {"lobes": self.texels.form.stored(), "palette": self.texels.palette.stored()}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> LobeForm:
        """See `Fast.from_stored`."""
        palette = Palette.from_stored(kept["palette"])
        spectra = palette.samples[0].T
        basis = SpectralBasis("btf", palette.wavelengths_nm, np.linalg.pinv(spectra).T, spectra)
        return cls(LobeTexels(LobeField.from_stored(kept["lobes"], basis), palette), error)
