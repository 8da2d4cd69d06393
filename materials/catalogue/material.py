"""Material of a catalogue for scripts: its stored data, and its colour in any light."""

from __future__ import annotations

import html
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.difference import lab_from_xyz
from ...spectral.illuminants import as_light
from ...spectral.observers import Observer, observer
from ...spectral.sample import check_covers
from ...spectral.spectrum import Quantity, Spectrum
from ...spectral.spectrum_colour import as_html, plot, swatch
from ...spectral.wavelengths import material_wavelengths
from ..analytic.lambert import Lambert
from ..analytic.model import AnalyticBrdf
from ..factored.pack import FactoredBrdf
from ..records.material import MaterialRecord, Provenance
from ..records.record import check_id
from .instrument_reading import InstrumentReading

__all__ = ["Material"]


def _fitted(brdf: AnalyticBrdf, budget: float) -> tuple[str, dict[str, Any], FactoredBrdf]:
    """Return the model and the parameters of a record, and its fast form."""
    from ..fitting.fit import fit

    parameters = {"wavelengths_nm": brdf.wavelengths_nm, **brdf.parameters()}
    return brdf.NAME, parameters, fit(brdf, budget=budget).fast.with_slices_of(brdf, budget)


@dataclass(frozen=True, repr=False)
class Material(MaterialRecord):
    """Material, as `Catalogue["family/name"]` returns it: a `MaterialRecord` that tells its colour.

    Colours are of the original data, not of the packs that approximate them in pictures (`error` states the
    difference): as an annular 45:0 instrument reads them (45a:0 of CIE 015: lit at 45 degrees all around, viewed along
    the normal), fluorescence included. A spectrum without a surface has no geometry and is used as measured.
    """

    @classmethod
    def from_spectrum(
        cls, value: object, name: str = "script/material", quantity: Quantity = "reflectance", budget: float = 0.5
    ) -> Material:
        """Make a material of one spectrum, for `Catalogue.add`.

        Parameters
        ----------
        value : as of `Spectrum.of`. A reflectance becomes a perfectly diffuse surface; other quantities have none.
        name : its id, "family/name". budget : ΔE94 of the fast form, as of `metamer.fit`.

        Raises
        ------
        InputError : as of `Spectrum.of`; not an id; several; a light or too little of the visible for a surface.
        """
        check_id(name)
        spectrum = Spectrum.of(value, quantity)
        if spectrum.samples.ndim != 1:
            found = f"shape {spectrum.samples.shape}"
            raise InputError("more than one spectrum", field="value", found=found, expected="one")
        model, parameters, fast, notes = spectrum.quantity.replace(" ", "_"), {}, None, ""
        if spectrum.quantity == "reflectance":
            check_covers(spectrum, None, name)
            surface = Lambert(spectrum.resampled(material_wavelengths([spectrum.wavelengths_nm])))
            model, parameters, fast = _fitted(surface, budget)
            notes = "taken to be perfectly diffuse"
        provenance = Provenance("a script", "not stated", "measured", notes=notes)
        original = {
            "wavelengths_nm": spectrum.wavelengths_nm,
            "values": spectrum.samples,
            "quantity": spectrum.quantity,
        }
        return cls(name, name.partition("/")[0], model, parameters, provenance, fast, original=original)

    @classmethod
    def from_brdf(cls, brdf: AnalyticBrdf, name: str = "script/material", budget: float = 1.0) -> Material:
        """Make a material of an analytic BRDF, which `Catalogue.add` puts into a catalogue.

        Parameters
        ----------
        brdf : a model with its parameters. name, budget : as of `from_spectrum`.

        Raises
        ------
        InputError : not an id; as of `metamer.fit`.
        """
        check_id(name)
        model, parameters, fast = _fitted(brdf, budget)
        provenance = Provenance("a script", "not stated", "analytic")
        return cls(name, name.partition("/")[0], model, parameters, provenance, fast)

    def spectrum(self) -> Spectrum:
        """Return the measured spectrum; of a surface without one, its radiance factor at 45a:0.

        Raises
        ------
        InputError : it fluoresces, so that no spectrum determines its colour; else as of `reading`.
        """
        if (measured := self.measured_spectrum()) is not None:
            return measured
        reading = self.reading()
        if reading.brdf is not None:
            hint = "its xyz(light) and lab(light) tell it"
            raise InputError("no spectrum tells the colour of what fluoresces", field=self.id, hint=hint)
        # A fitted BRDF may be a little below zero: it is then black there.
        return Spectrum.sampled(reading.wavelengths_nm, np.maximum(reading.factor, 0.0), "radiance factor")

    def reading(self) -> InstrumentReading:
        """Return the curve from which colours are computed.

        Raises
        ------
        InputError : a light, or a record without a single spectrum: neither has a colour under another light.
        """
        if self.is_surface:
            return InstrumentReading.of(self.brdf())
        spectrum = self.measured_spectrum()
        if spectrum is None or spectrum.samples.ndim != 1 or spectrum.quantity == "emission":
            light = self.quantity == "emission"
            raise InputError(
                "a light has no colour under a light" if light else "no single spectrum to see",
                field=self.id,
                expected="a surface, or one measured spectrum of reflectance or transmittance",
                hint="use its spectrum() as the light of others" if light else None,
            )
        return InstrumentReading(spectrum.wavelengths_nm, spectrum.samples)

    def xyz(self, light: object = "D65", observer: str | Observer = "1931_2") -> Float[np.ndarray, "3"]:
        """Compute XYZ (3,) at 45a:0; the perfect diffuser has Y = 1.

        Parameters
        ----------
        light : the name of an illuminant, or an emission as of `Spectrum.of`.
        observer : its name as of `metamer.observer`, or the observer itself.

        Raises
        ------
        InputError, UnknownNameError : as of `reading`; a light or an observer that is not known, or not a light.
        """
        return self._seen(light, observer)[0]

    def lab(self, light: object = "D65", observer: str | Observer = "1931_2") -> Float[np.ndarray, "3"]:
        """Compute CIELAB (3,) at 45a:0, relative to the white of the light; parameters and errors as of `xyz`."""
        return lab_from_xyz(*self._seen(light, observer))

    def plot(self, axes: Any = None, **style: Any) -> Any:
        """Draw its spectrum with matplotlib, as of `Spectrum.plot`; raises what `spectrum` does."""
        return plot(self.spectrum(), axes, **({"label": self.id} | style))

    def _seen(self, light: object, seen_by: str | Observer) -> tuple[np.ndarray, np.ndarray]:
        """Compute XYZ of the material and of white."""
        spectrum = as_light(light)
        eye = seen_by if isinstance(seen_by, Observer) else observer(seen_by)
        return self.reading().xyz(spectrum, eye), eye.white(spectrum)

    def _repr_html_(self) -> str:
        """Show the colour under D65, the curve, and their provenance."""
        standing = f"{html.escape(self.id)}: {html.escape(self.model)}, {html.escape(self.provenance.kind)}"
        try:
            drawn = as_html(self.spectrum())
        except InputError:
            try:
                drawn = swatch(self.xyz())
            except InputError:
                drawn = ""
        return f"<div>{drawn}<div>{standing}</div></div>"

    def __repr__(self) -> str:
        return f"<Material {self.id}: {self.model}, {self.provenance.kind}>"
