"""Record of a catalogue's material: the measurement, its fast form, their difference, and its provenance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from ...runtime.errors import InputError
from ...spectral.spectrum import Quantity, Spectrum
from ..core.brdf import Brdf
from ..core.fast import Fast, Summand
from ..core.fit_error import FitError
from ..core.surface import Surface
from .models import SPECTRA, no_surface, quantity_of, rebuild
from .standing import standing_of

if TYPE_CHECKING:
    from ..fitting.fit import Trial


@dataclass(frozen=True)
class Provenance:
    """Provenance of a material's numbers.

    kind : "measured" (the directional data were), "analytic" (a model with published spectra or optical constants),
    "uplifted(METHOD)" (spectra were synthesised from tristimulus values: never colour-critical), or
    "reconstructed(METHOD)" (directions were interpolated from readings at some).
    geometry : of the measurement, such as "45:0"; "" where it does not apply or is not stated.
    """

    source: str
    licence: str
    kind: str
    geometry: str = ""
    notes: str = ""

    def __post_init__(self) -> None:
        known = self.kind in ("measured", "analytic") or (
            self.kind.startswith(("uplifted(", "reconstructed(")) and self.kind.endswith(")")
        )
        if not known:
            expected = "measured, analytic, uplifted(METHOD) or reconstructed(METHOD)"
            raise InputError("unknown kind of provenance", field="kind", found=repr(self.kind), expected=expected)
        for name in ("source", "licence"):
            if not getattr(self, name).strip():
                raise InputError("provenance is incomplete", field=name, found="nothing", expected="a sentence")

    @property
    def standing(self) -> str:
        """Kind in one word, as shown beside every picture of the material."""
        return standing_of(self.kind)


@dataclass(frozen=True)
class MaterialRecord:
    """Record of a material in a catalogue.

    Attributes
    ----------
    id : "family/name" in lower case, the file's path in its catalogue.
    model : NAME of the original BRDF's class, rebuilt from `parameters` (arrays, numbers, text), `wavelengths_nm` among
        them. Or "emission", "transmittance", "radiance_factor": a spectrum without a surface, whose samples are
        `wavelengths_nm` (L,) and `values` (L,) of `original`.
    fast : the form that renderers draw, in the basis "sampled" on the working wavelengths (nothing spectral is lost),
        with the measured difference between the two; None for a spectrum without a surface.
    source_hash : SHA-256 of the source data and of the settings of the fit; a re-import compares it.
    original : the imported measurement, so that it can be fitted again: arrays of any shape (float, int, bool), numbers
        and text. "wavelengths_nm", "values", "quantity", "stated.N.space", "details.*"...
    trials : attempts of the fit, in order: speed against error.
    """

    id: str
    family: str
    model: str
    parameters: Mapping[str, Any]
    provenance: Provenance
    fast: Fast | None
    source_hash: str = ""
    original: Mapping[str, Any] = field(default_factory=dict)
    trials: tuple[Trial, ...] = ()

    @property
    def error(self) -> FitError | None:
        """Error of the fast form against the original; None if there is none, or if it was not measured."""
        return None if self.fast is None else self.fast.error

    @property
    def environment_error(self) -> FitError | None:
        """Error of the stored environment form against the original (`slices.error`); None if none is stored."""
        return self.fast.environment_error if self.fast is not None else None

    def drawn(self) -> Fast:
        """Form that renderers draw.

        Raises
        ------
        InputError : the record is a spectrum without a surface, or of a surface without a fast form.
        """
        if self.fast is not None:
            return self.fast
        if not self.is_surface:
            raise no_surface(self.model, self.id)
        expected = "a record that was imported with a fit"
        raise InputError("a surface without a fast form", field=self.id, found="the original alone", expected=expected)

    @property
    def summands(self) -> tuple[Summand, ...]:
        """Summands of the fast form; none without one."""
        return () if self.fast is None else self.fast.summands

    @property
    def quantity(self) -> str:
        """Quantity of the data: "reflectance", "bispectral", "emission", "transmittance" or "radiance factor"."""
        return quantity_of(self.model)

    @property
    def is_surface(self) -> bool:
        """False for a spectrum that cannot be part of a scene."""
        return self.model not in SPECTRA

    def surface(self) -> Surface:
        """Rebuild the original, at every wavelength: the reference of `fast`.

        Raises
        ------
        InputError : the record is a spectrum without a surface. UnknownNameError : there is no such model.
        """
        if not self.is_surface:
            raise no_surface(self.model, self.id)
        return rebuild(self.model, self.parameters)

    def brdf(self) -> Brdf:
        """Rebuild the original as one BRDF: for a texture, its average.

        Raises
        ------
        InputError : as `surface`, and if there is no such average.
        """
        average = self.surface().average()
        if isinstance(average, Brdf):
            return average
        raise InputError("not one BRDF", field=self.id, found=self.model, expected="a material with an average")

    def measured_spectrum(self) -> Spectrum | None:
        """Return the one measured spectrum, at its own wavelengths; None if there is none, or several."""
        for kept in (self.original, self.parameters):
            nm, values = kept.get("wavelengths_nm"), kept.get("values")
            if nm is not None and values is not None and np.shape(nm) == np.shape(values):
                quantity = kept.get("quantity", self.quantity)
                # A Donaldson matrix, an index of refraction are no such spectrum.
                return Spectrum.sampled(nm, values, quantity) if quantity in get_args(Quantity) else None
        return None
