"""The one spectrum of a material for files of spectra: as measured, else as an instrument would read it."""

from __future__ import annotations

import numpy as np

from ...runtime.errors import InputError
from ...spectral.difference import lab_from_xyz
from ...spectral.formats.registry import SpectralEntry, StatedColour
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.spectrum import Quantity, Spectrum
from ..records.description import stated_colours
from ..records.material import MaterialRecord
from ..records.record_colour import radiance_factor_45_0

#: The tristimulus values that are written beside a spectrum.
LIGHT, OBSERVER = "D50", "1931_2"
#: The detail that says how a spectrum came about that was not measured.
COMPUTED = "computed"
# A reading may be this far below zero and pass for black, as it may in a file (`formats.shared.gathering`).
_DARK = 0.01


def exported_spectrum(record: MaterialRecord) -> SpectralEntry:
    """Return the spectrum of a record at its own wavelengths, with Lab under D50 and the record's details.

    If the record has no single spectrum, the reading of an annular 45:0 instrument is computed from the BRDF: pi f_r
    averaged over eight sides; the details say so.

    Raises
    ------
    InputError
        A fluorescent surface, whose reading depends on the instrument's lamp, or more than one spectrum.
    """
    if record.quantity == "bispectral":
        raise InputError(
            "a fluorescent surface is no single spectrum",
            field=record.id,
            found=record.model,
            expected="a material whose colour is one reflectance",
            hint="export it as spectral OpenEXR: --format exr",
        )
    details = {
        name.removeprefix("details."): str(value)
        for name, value in record.original.items()
        if name.startswith("details.")
    }
    spectrum = record.measured_spectrum()
    if spectrum is None:
        spectrum, how = _computed(record)
        details |= {"geometry": how[0], COMPUTED: how[1]}
    elif spectrum.samples.ndim != 1:
        raise InputError("more than one spectrum", field=record.id, found=f"shape {spectrum.samples.shape}")
    elif record.provenance.geometry:
        details.setdefault("geometry", record.provenance.geometry)
    colours = stated_colours(record.original)
    if spectrum.quantity != "emission" and not any((c.illuminant, c.observer) == (LIGHT, OBSERVER) for c in colours):
        colours = (*colours, _lab(spectrum))
        details.setdefault("method", "E308_1nm")
        details.setdefault("Lab D50", "computed by Metamer from the spectrum, at every nm, its ends held")
    return SpectralEntry(record.id, spectrum, colours, details)


def provenance_tags(record: MaterialRecord) -> dict[str, str]:
    """Return a record's provenance as names and text."""
    said = record.provenance
    tags = {"source": said.source, "licence": said.licence, "kind": said.kind, "geometry": said.geometry}
    tags |= {"notes": said.notes, "model": record.model, "source hash": record.source_hash}
    return {name: text for name, text in tags.items() if text}


def _computed(record: MaterialRecord) -> tuple[Spectrum, tuple[str, str]]:
    """pi f_r at 45:0, and in words its geometry and how it came about."""
    brdf = record.brdf()
    if record.model == "lambert":
        values = np.asarray(record.parameters["reflectance"], dtype=np.float64)
        measured = record.provenance.geometry or "every geometry"
        return Spectrum.sampled(brdf.wavelengths_nm, values), (measured, "reflectance of the Lambert model")
    values = radiance_factor_45_0(brdf)
    lowest = float(values.min())
    if lowest < -_DARK:
        raise InputError(
            "the reading at 45:0 is negative at some wavelength",
            field=record.id,
            found=f"{lowest:.3g}",
            expected="a measurement whose colour lies inside sRGB",
            hint="export the BRDF: --format merl or mitsuba",
        )
    values, dark = np.maximum(values, 0.0), f"; negative down to {lowest:.2g}, taken as zero" if lowest < 0 else ""
    quantity: Quantity = "radiance factor" if values.max() > 1.0 else "reflectance"
    return Spectrum.sampled(brdf.wavelengths_nm, values, quantity), (
        "45a:0",
        f"computed at 45:0 from the BRDF ({record.model}), no measured spectrum{dark}",
    )


def _lab(spectrum: Spectrum) -> StatedColour:
    eye, light = observer(OBSERVER), illuminant(LIGHT)
    xyz = eye.weights(light, spectrum.wavelengths_nm) @ spectrum.samples
    return StatedColour("Lab", np.asarray(lab_from_xyz(xyz, eye.white(light)), dtype=np.float64), LIGHT, OBSERVER)
