"""A material of a catalogue as a script has it: what is stored, and its colour in any light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral import illuminants, observers
from ...spectral.difference import lab_from_xyz
from ...spectral.observers import Observer
from ...spectral.spectrum import Spectrum
from ..records.material import MaterialRecord
from .instrument_reading import InstrumentReading

__all__ = ["Material"]


@dataclass(frozen=True, repr=False)
class Material(MaterialRecord):
    """Material, as `Catalogue["family/name"]` returns it: a `MaterialRecord` that tells its colour.

    Colours are of the original data, not of the packs that stand for them in pictures (`error` says how far those are
    off): as an annular 45:0 instrument reads them (45a:0 of CIE 015: lit at 45 degrees all around, seen along the
    normal), fluorescence included. A spectrum without a surface has no geometry: it counts as it was measured.
    """

    def reading(self) -> InstrumentReading:
        """The curve that the colours are made of.

        Raises
        ------
        InputError : a light, or a record that keeps no single spectrum: neither has a colour under another light.
        """
        if self.is_surface:
            return InstrumentReading.of(self.brdf())
        spectrum = self.spectrum()
        if spectrum is None or spectrum.samples.ndim != 1 or spectrum.quantity == "emission":
            light = self.quantity == "emission"
            raise InputError(
                "a light has no colour under a light" if light else "no single spectrum to see",
                field=self.id,
                expected="a surface, or one measured spectrum of reflectance or transmittance",
                hint="use its spectrum() as the light of others" if light else None,
            )
        return InstrumentReading(spectrum.wavelengths_nm, spectrum.samples)

    def xyz(self, light: str | Spectrum = "D65", observer: str | Observer = "1931_2") -> Float[np.ndarray, "3"]:
        """XYZ (3,) at 45a:0; the perfect diffuser has Y = 1.

        Parameters
        ----------
        light : the name of an illuminant, or an emission.
        observer : its name as of `metamer.observer`, or the observer itself.

        Raises
        ------
        InputError, UnknownNameError : as of `reading`; a light or an observer that is not known, or not a light.
        """
        return self._seen(light, observer)[0]

    def lab(self, light: str | Spectrum = "D65", observer: str | Observer = "1931_2") -> Float[np.ndarray, "3"]:
        """CIELAB (3,) at 45a:0, relative to the white of the light; parameters and errors as of `xyz`."""
        return lab_from_xyz(*self._seen(light, observer))

    def _seen(self, light: str | Spectrum, observer: str | Observer) -> tuple[np.ndarray, np.ndarray]:
        """XYZ of the material and of white."""
        spectrum = light if isinstance(light, Spectrum) else illuminants.illuminant(light)
        eye = observer if isinstance(observer, Observer) else observers.observer(observer)
        return self.reading().xyz(spectrum, eye), eye.white(spectrum)

    def __repr__(self) -> str:
        return f"<Material {self.id}: {self.model}, {self.provenance.kind}>"
