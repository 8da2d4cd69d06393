"""Readings of one coating at several angles in a file of spectra: the readings, and a BRDF through them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.angles import FEWEST, Thing, flop_weights
from ...spectral.difference import delta_e_xyz
from ...spectral.formats.registry import SpectralEntry
from ...spectral.formats.shared.text import shortened
from ...spectral.measurement import Geometry
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import material_wavelengths
from ..effect_coating.coat_gloss import gloss_units, needle_for
from ..effect_coating.coated_pair import aspecular
from ..effect_coating.fit import AngleReadings, reconstructed
from ..effect_coating.flake_tilt import FlakeTilt
from ..effect_coating.off_specular import light_and_detector
from ..effect_coating.reading_order import doubtful_order
from ..effect_coating.stated_error import FLARE, stated_error

# "87.5", "87.5 (60°)", as `cxf_metadata` has it.
_GLOSS = re.compile(r"(?<![\d.])(\d+(?:\.\d+)?)(?: \(([^)]*)\))?(?:;|$)")
_SIXTY = re.compile(r"(?<!\d)60(?!\d)")


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """Material reconstructed from readings at several angles, as stored in a record."""

    brdf: FlakeTilt
    kind: str
    geometry: str
    notes: tuple[str, ...]
    original: dict[str, Any]


def refusal_at_angles(thing: Thing[SpectralEntry], path: Path) -> InputError | None:
    """Return the error for readings at angles that determine no BRDF; None if they do."""
    kinds = {one.item.spectrum.quantity for one in thing.readings}
    usable = [one for one in thing.angles if abs(one.second or 0.0) > FLARE]
    if len(usable) >= FEWEST and kinds <= {"reflectance", "radiance factor"}:
        return None
    several = f"read at {len(thing.angles)} angles" if len(thing.angles) > 1 else "read at an aspecular angle"
    return InputError(
        f"one paint, {several}, is no matt surface, and they tell no other",
        file=path,
        field=thing.name or path.stem,
        found=", ".join(one.notation for one in thing.angles),
        expected=f"reflectances at {FEWEST} angles or more, beyond {FLARE:g} degrees from the mirror direction",
        hint="metamer match judges them angle by angle; --as radiance-factor keeps each reading as it is, without a "
        "surface; --angles matt makes a matt material of each, and the record says so",
    )


def refusal_without_light(words: Iterable[str], path: Path) -> InputError:
    """Return the error for readings at apparently aspecular angles without the angle of the light."""
    return InputError(
        "readings at several aspecular angles are no matt surfaces, and the angle of the light is not stated",
        file=path,
        field="names",
        found=shortened(", ".join(words), 200),
        expected="the angles of the light and of the detector in each name, such as 45as15",
        hint="write as15 as 45as15 where the light is at 45 degrees (of rows, in a column Geometry); or --angles matt "
        "takes each reading as a matt surface of its own",
    )


def reconstruction(thing: Thing[SpectralEntry]) -> Reconstruction:
    """Fit a BRDF to the readings of a thing, averaged over those of one angle.

    Raises
    ------
    InputError : an angle without light or detector above the surface; spectra that cannot be used.
    """
    angles = thing.angles
    spectra = [[one.item.spectrum for one in thing.readings if _at(one.angle, angle)] for angle in angles]
    nm = material_wavelengths([one.wavelengths_nm for some in spectra for one in some])
    each = [np.stack([_factor(one, nm) for one in some]) for some in spectra]
    means = np.stack([some.mean(axis=0) for some in each])
    wi, wo = light_and_detector(angles)
    far = aspecular(wi, wo) > np.radians(FLARE)
    readings = AngleReadings(nm, wi[far], wo[far], means[far] / np.pi)
    gloss = next((text for one in thing.readings if (text := one.item.details.get("gloss"))), "")
    brdf, coat_note = _with_gloss(readings, gloss)
    error = stated_error(readings, brdf)
    reread = _differences(nm, means[far], np.pi * brdf.eval(readings.wi, readings.wo))
    names = tuple(one.notation for one in angles)
    notes = [
        f"reconstructed from {len(readings.values)} angles; between them about ΔE94 {max(error.mean):.1f}, within a "
        f"factor of 2, by how far other models of the readings are apart; within {FLARE:g} degrees of the mirror "
        "direction nothing is stated",
        coat_note,
        _interference_note(readings, brdf),
        *_notes(thing, each, [one for one, used in zip(angles, far, strict=True) if used], readings, brdf),
        "a BRDF has no texture: sparkle and graininess are not drawn",
    ]
    return Reconstruction(
        brdf,
        f"reconstructed({len(readings.values)} angles, about ΔE94 {max(error.mean):.1f})",
        ", ".join(names),
        tuple(notes),
        _original(thing) | {"reread_delta_e94": reread} | error.stored(),
    )


def _at(one: Geometry | None, angle: Geometry) -> bool:
    return one is not None and one.matches(angle)


def _factor(spectrum: Spectrum, nm: Float[np.ndarray, " L"]) -> Float[np.ndarray, " L"]:
    # At an angle a reflectance is a radiance factor, which may exceed 1 between samples, too.
    return Spectrum.sampled(spectrum.wavelengths_nm, spectrum.samples, "radiance factor").resampled(nm).samples


def _with_gloss(readings: AngleReadings, gloss: str) -> tuple[FlakeTilt, str]:
    """Return the fit with the coat implied by a glossmeter, or by the readings, and a sentence on it."""
    brdf = reconstructed(readings)
    told = [(float(units), method or "") for units, method in _GLOSS.findall(gloss)]
    units = next((units for units, method in told if not method or _SIXTY.search(method)), None)
    if units is not None:
        needle = needle_for(brdf, units)
        if needle is not None:
            return reconstructed(readings, needle=needle), f"the coat's width is that of its gloss, {units:g} at 60°"
    other = f", and its gloss, {gloss}, was not used" if gloss else ""
    if brdf.needle:
        return brdf, f"the coat is assumed to be glossy: no reading is near enough to the mirror direction{other}"
    coat = f"a coat of roughness {brdf.coat_roughness:.2f}, {gloss_units(brdf):.1f} gloss units at 60°"
    return brdf, f"{coat}, as the readings tell{other}"


def _interference_note(readings: AngleReadings, brdf: FlakeTilt) -> str:
    if brdf.interference > 0.0:
        return f"flakes change colour with the angle of light on them: q = {brdf.interference:.2f}"
    if readings.tell_interference:
        return "no interference shows in the readings: q = 0"
    return (
        "whether flakes change colour by interference cannot be told without readings at one tilt under two "
        "incidences, such as 45as15 and 45as-15: if they do, colours are off by far more than stated"
    )


def _notes(
    thing: Thing[SpectralEntry],
    each: list[Float[np.ndarray, "r L"]],
    used: list[Geometry],
    readings: AngleReadings,
    brdf: FlakeTilt,
) -> list[str]:
    """Describe unusual properties of the readings and the fit."""
    notes, nm = [], readings.wavelengths_nm
    if len(used) < len(each):
        notes.append(f"readings within {FLARE:g} degrees of the mirror direction are kept, and not fitted")
    if thing.by_name:
        notes.append("taken for readings of one thing since their names differ by the angle alone")
    if max(map(len, each)) > 1:
        scatter = [
            float(_differences(nm, np.broadcast_to(some.mean(axis=0), some.shape), some).mean()) for some in each
        ]
        said = ", ".join(f"{one.notation} {off:.2f}" for one, off in zip(thing.angles, scatter, strict=True))
        notes.append(f"several readings of an angle count by their mean; from it they are ΔE94 {said}")
    if doubt := doubtful_order(readings, used, brdf.interference):
        notes.append(doubt)
    if brdf.scale < 1.0:
        notes.append(f"made darker, by {brdf.scale:.3f}, so as not to reflect more light than it receives")
    conditions = {one.measurement.parts.get("measurement condition") for one in thing.readings}
    if any(one is not None and one.value in ("M0", "M1") for one in conditions):
        notes.append("read with ultraviolet in the light: what fluoresces is taken for reflected")
    return notes


def _original(thing: Thing[SpectralEntry]) -> dict[str, Any]:
    """Return the readings as imported, in order: as rows if they share one grid."""
    entries = [one.item for one in thing.readings]
    grids = [one.spectrum.wavelengths_nm for one in entries]
    angles = [one.angle for one in thing.readings if one.angle is not None]
    found: dict[str, Any] = {
        "light_deg": np.array([one.first or 0.0 for one in angles]),
        "aspecular_deg": np.array([one.second or 0.0 for one in angles]),
        "azimuth_deg": np.array([one.azimuth for one in angles]),
        "names": ", ".join(one.name for one in entries),
    }
    if all(np.array_equal(one, grids[0]) for one in grids):
        rows = np.stack([one.spectrum.samples for one in entries])
        return found | {"readings_nm": grids[0], "readings": rows}
    for number, one in enumerate(entries, 1):
        found |= {f"reading.{number}.nm": one.spectrum.wavelengths_nm, f"reading.{number}": one.spectrum.samples}
    return found


def _differences(
    nm: Float[np.ndarray, " L"], one: Float[np.ndarray, "n L"], other: Float[np.ndarray, "n L"]
) -> Float[np.ndarray, " n"]:
    """ΔE94 of radiance factors under D65 for 10 degrees."""
    weights = flop_weights(nm)
    return delta_e_xyz(one @ weights.T, other @ weights.T, weights.sum(axis=1))
