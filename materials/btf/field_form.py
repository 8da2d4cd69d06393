"""Reflectance fields as the fast form of a BTF: of each texel and view a function of the direction of light."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ...spectral.palette import Palette
from ..core.environment_form import EnvironmentForm
from ..core.fast import Fast, Summand
from ..core.fit_error import FitError
from .field_gathering import FieldGathering
from .field_texels import FieldTexels
from .lobe_field import LobeField
from .lobe_gathering import LobeGathering
from .mean import MeanBtf, basis_of
from .polynomials import Polynomials
from .reflectance_field import ReflectanceField
from .texel_error import error_stored, stored_error

#: The kinds of fields that a file may hold.
KINDS: dict[str, type[ReflectanceField]] = {kind.KIND: kind for kind in (Polynomials, LobeField)}


@dataclass(frozen=True, eq=False)
class FieldForm(Fast):
    """Meseth, Mueller and Klein 2003: larger than local PCA, and each view free of what others show."""

    NAME: ClassVar[str] = "btf-field"
    WORDS: ClassVar[str] = "reflectance fields"
    isotropic = False

    texels: FieldTexels
    error: FitError | None = None
    note: str = ""
    texel_error: FitError | None = None  # pyright: ignore[reportIncompatibleMethodOverride]

    @property
    def summands(self) -> tuple[Summand, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The texels alone."""
        return (self.texels,)

    @property
    def measured_to(self) -> tuple[float, float]:
        """Implement `Surface.measured_to`; of each side the lowest is said by a note of the record."""
        return self.texels.form.views.reach[0], self.texels.form.lights.reach[0]

    def in_basis(self, basis: SpectralBasis) -> FieldForm:
        """Implement `Fast.in_basis`; texels are shared."""
        return replace(self, texels=self.texels.in_basis(basis))

    def from_afar(self) -> MeanBtf:
        """Return the mean of all texels, under the lights that were measured: the one that is left at the coarsest
        level.
        """
        field = self.texels.form
        level = field.levels(filtered=True)[-1]
        lights, first = field.lights.directions, np.zeros(len(field.lights), np.int64)
        means = np.stack([level.at(first + view, first, first, lights) for view in range(len(field.views))])
        return MeanBtf(field.views, field.lights, means, basis_of(self.texels.palette))

    def environment_form(self) -> EnvironmentForm:
        """Implement `Fast.environment_form`; worked out when first asked for."""
        gathering = LobeGathering if isinstance(self.texels.form, LobeField) else FieldGathering
        return gathering(texels=self.texels)

    def stored(self) -> dict[str, Any]:
        """Return the kind of field, the field (`ReflectanceField.stored`) and the palette."""
        field = self.texels.form
        kept = {"kind": field.KIND, "field": field.stored(), "palette": self.texels.palette.stored()}
        return kept | stored_error(self.texel_error)

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> FieldForm:
        """Implement `Fast.from_stored`."""
        kind = str(kept["kind"])
        if kind not in KINDS:
            raise InputError("an unknown kind of field", field="kind", found=kind, expected=", ".join(KINDS))
        palette = Palette.from_stored(kept["palette"])
        texels = FieldTexels(KINDS[kind].from_stored(kept["field"], basis_of(palette)), palette)
        return cls(texels, error, texel_error=error_stored(kept))
