"""Measured or stated colour of one thing: its readings, or a stated colour."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..runtime.errors import ComparisonError, InputError
from .axis_letters import Lab
from .difference import lab_from_xyz, xyz_from_lab
from .foreign_spectra import KINDS, foreign_curves
from .formats.registry import SpectralEntry, StatedColour
from .illuminants import illuminant
from .measurement import Geometry, Measurement, Side, geometry_in
from .observers import Observer, observer
from .spectrum import Spectrum

#: Part of X, Y or Z of a white under D65 that may come from beyond a measured range, where its end values are repeated.
MOST_MISSED = 0.15


def title_from_id(name: str) -> str:
    """Spell the last word of an id out, for people.

    >>> title_from_id("paint/signal-red")
    'Signal red'
    """
    words = name.rpartition("/")[2].replace("-", " ")
    return words[:1].upper() + words[1:]


def distinct_titles(titles: Sequence[str], full_titles: Sequence[str]) -> list[str]:
    """Return distinct titles: full ones for all that share theirs.

    >>> distinct_titles(["Red", "Red", "Blue"], ["Red (a/red)", "Red (b/red)", "Blue (a/blue)"])
    ['Red (a/red)', 'Red (b/red)', 'Blue']
    """
    counts = Counter(titles)
    return [full if counts[title] > 1 else title for title, full in zip(titles, full_titles, strict=True)]


@dataclass(frozen=True, eq=False)
class Sample:
    """Standard or sample of a comparison.

    Parameters
    ----------
    name, source : its name, and its origin.
    readings : spectra of one thing, any number; none if only a colour is known.
    stated : colours stated by a file or a user; used without readings.
    seen : XYZ under a light for an observer, for fluorescent samples, which no reflectance describes.
    effect : why its colour depends on the angles beyond its gloss, "" if it does not or is not known to.
    details : instrument, geometry, ..., from the file. measurement : the conditions that they state.
    angles : a sample per angle, if it was read at several. angled : its sample at any multi-angle geometry, if its BRDF
        is known. With a BRDF reconstructed from such readings there are both.
    finish : model of its surface and that model's numbers besides spectra, such as "coated_diffuse, index 1.5,
        roughness 0.06"; "" if no surface is known.
    made_up : kind of provenance of a colour that was not measured and does not justify a verdict, such as
        "uplifted(mallett-yuksel)"; "" for others. notes : assumptions, a sentence each.
    """

    name: str
    source: str
    readings: tuple[Spectrum, ...] = ()
    stated: tuple[StatedColour, ...] = ()
    seen: Callable[[Spectrum, Observer], Float[np.ndarray, "3"]] | None = None
    effect: str = ""
    details: Mapping[str, str] = field(default_factory=dict)
    measurement: Measurement = field(default_factory=Measurement)
    angles: tuple[Sample, ...] = ()
    angled: Callable[[Geometry], Sample] | None = None
    finish: str = ""
    made_up: str = ""
    notes: tuple[str, ...] = ()

    @classmethod
    def of_entry(cls, entry: SpectralEntry, source: str, beside: Mapping[str, str] | None = None) -> Sample:
        """Make a sample of one reading of a file; `beside` : details common to all its readings.

        Raises
        ------
        InputError : a light; or too little of the visible.
        """
        spectrum = entry.spectrum
        if spectrum.quantity == "emission" or spectrum.samples.ndim != 1:
            raise InputError(
                "a light source is not a sample" if spectrum.quantity == "emission" else "more than one spectrum",
                file=source,
                field=entry.name,
                expected="one reading of reflectance, radiance factor or transmittance",
            )
        check_covers(spectrum, source, entry.name)
        details = {**(beside or {}), **entry.details}
        measured = Measurement.of(spectrum.quantity, details, entry.name)
        return cls(entry.name, source, (spectrum,), entry.stated, details=entry.details, measurement=measured)

    @classmethod
    def of_spectra(cls, value: object, unnamed: str) -> tuple[Sample, ...]:
        """Make samples from objects of another library, or of plain Python: one per spectrum.

        Parameters
        ----------
        value : a `Spectrum`, or one of `foreign_spectra.KINDS`, of reflectance as a fraction.
        unnamed : name of those without one.

        Raises
        ------
        InputError : nothing of the kind; a light; too little of the visible.
        """
        if isinstance(value, Spectrum):
            found = [("", value)]
        elif (curves := foreign_curves(value)) is not None:
            found = [(name, Spectrum.sampled(nm, samples)) for name, nm, samples in curves]
        else:
            raise InputError(
                "no sample",
                field=unnamed,
                found=repr(value)[:80],
                expected=f"a path, an id, a Sample, a Material, a Spectrum, {KINDS}",
                hint='a colour without a spectrum is a text with its light and observer: "lab:50,20,10@D65/1964_10"',
            )
        return tuple(
            cls.of_entry(SpectralEntry(name or unnamed, spectrum), f"a script ({unnamed})") for name, spectrum in found
        )

    @property
    def side(self) -> Side:
        """Name, source and measurement, as compared by `measurement`."""
        return Side(self.name, self.source, self.measurement)

    @property
    def spectral(self) -> bool:
        """True if its colour is known under every light."""
        if self.angles:
            return all(one.spectral for one in self.angles)
        return bool(self.readings) or self.seen is not None

    @property
    def stated_for(self) -> tuple[tuple[str, str], ...]:
        """Illuminant and observer of each of its stated colours that has both."""
        return tuple((one.illuminant, one.observer) for one in self.stated if one.illuminant and one.observer)

    @property
    def count(self) -> int:
        """Number of its readings, at all angles."""
        return sum(len(one.readings) for one in self.angles or (self,))

    @property
    def geometries(self) -> tuple[Geometry, ...]:
        """The angles at which it was read, of one thing that was read at several."""
        return tuple(geometry for one in self.angles if (geometry := one.measurement.geometry) is not None)

    @property
    def angle_by_angle(self) -> Sample:
        """Sample for comparison at several angles, without the geometry of the whole, which each angle has."""
        parts = {k: v for k, v in self.measurement.parts.items() if k not in ("geometry", "configuration")}
        return replace(self, measurement=Measurement(parts))

    def at(self, notation: str) -> Sample:
        """Return the sample at one angle, such as "45as15"; itself for "".

        Raises
        ------
        ComparisonError : it was not read at that angle.
        """
        if not notation:
            return self
        wanted = geometry_in(notation)
        for one in self.angles:
            geometry = one.measurement.geometry
            if geometry is not None and wanted is not None and geometry.matches(wanted):
                return one
        if self.angled is not None and wanted is not None:
            return self.angled(wanted)
        raise ComparisonError(f"{self.name} of {self.source} was not read at {notation}")

    @property
    def held(self) -> str:
        """Description of the part of the observer's range that no reading covers; "" if all of it is covered."""
        if self.angles:
            return self.angles[0].held
        if not self.readings:
            return ""
        low = max(one.wavelengths_nm[0] for one in self.readings)
        high = min(one.wavelengths_nm[-1] for one in self.readings)
        return f"beyond {low:g} to {high:g} nm the end values are held" if low > 380.0 or high < 730.0 else ""

    def factor(self, wavelengths_nm: Float[np.ndarray, " L"]) -> Float[np.ndarray, " L"]:
        """Average its readings, linear between their samples, clamped at the ends.

        Raises
        ------
        ComparisonError : there is no spectrum.
        """
        if not self.readings:
            raise ComparisonError(f"{self.name}: no spectrum, so nothing that depends on one can be told")
        return np.mean([np.interp(wavelengths_nm, one.wavelengths_nm, one.samples) for one in self.readings], axis=0)

    def lab(self, light: str, eye: str) -> Lab:
        """Compute CIELAB (3,) under an illuminant for an observer, relative to its white.

        Several readings are averaged in XYZ.

        Raises
        ------
        ComparisonError : only a colour is known, and for another illuminant or observer, or for unstated ones.
        """
        white = observer(eye).white(illuminant(light))
        return lab_from_xyz(self.xyz(light, eye), white)

    def xyz(self, light: str, eye: str) -> Float[np.ndarray, "3"]:
        """Compute XYZ (3,), Y of the perfect diffuser being 1; errors as of `lab`."""
        power, seer = illuminant(light), observer(eye)
        if self.seen is not None:
            return self.seen(power, seer)
        if self.readings:
            return np.mean([seer.weights(power, one.wavelengths_nm) @ one.samples for one in self.readings], axis=0)
        # At several angles it has a colour at each, and none of its own.
        for colour in () if self.angles else self.stated:
            known = colour.illuminant and colour.observer and (colour.illuminant, colour.observer)
            if known and same_conditions(known, (light, eye)):
                if colour.space == "XYZ":
                    return colour.values / 100.0
                return xyz_from_lab(colour.values, seer.white(power))
        raise ComparisonError(self._not_known(light, eye))

    def _not_known(self, light: str, eye: str) -> str:
        """Return why there is no colour under a light for an observer, and a remedy."""
        if self.angles:
            return f"{self.name} of {self.source} was read at {len(self.angles)} angles, and has no colour but at one"
        head = f"{self.name} of {self.source} has no spectrum: "
        pairs = dict.fromkeys((one.illuminant, one.observer) for one in self.stated)
        if pairs and not all(pair[0] and pair[1] for pair in pairs):
            return (
                f"{head}its colour is stated without its illuminant or its observer\n"
                "  try: look up which they are, and say it, such as --colours-for D50/1931_2"
            )
        known = ", ".join(f"{one} and {other}" for one, other in pairs) or "nothing"
        said = next(iter(pairs), None)
        ask = "" if said is None else f"\n  try: --illuminants {said[0]} --observers {said[1]}"
        return (
            f"{head}its colour is stated for {known}, not for {light} and {eye}; another light or observer cannot be "
            f"had from it{ask}"
        )

    def labs(self, light: str, eye: str) -> Float[np.ndarray, "n 3"]:
        """Compute CIELAB of every single reading."""
        power, seer = illuminant(light), observer(eye)
        xyz = [seer.weights(power, one.wavelengths_nm) @ one.samples for one in self.readings]
        return lab_from_xyz(np.reshape(xyz, (-1, 3)), seer.white(power))


def same_conditions(one: tuple[str, str], other: tuple[str, str]) -> bool:
    """Return whether illuminant and observer are the same, under any of their names."""
    try:
        lights, eyes = [illuminant(name) for name, _ in (one, other)], [observer(name) for _, name in (one, other)]
    except InputError:
        return False
    return eyes[0].name == eyes[1].name and lights[0].key == lights[1].key


def check_covers(spectrum: Spectrum, file: str | None, name: str) -> None:
    """Raise `InputError` if a spectrum is too short for a colour."""
    low, high = (float(end) for end in spectrum.wavelengths_nm[[0, -1]])
    check_range(low, high, file, name)


def check_range(low: float, high: float, file: str | Path | None, name: str) -> None:
    """Raise `InputError` if a range in nm misses more of a colour than `MOST_MISSED`."""
    if (missed := missed_share(low, high)) > MOST_MISSED:
        raise InputError(
            "too little of the visible light was measured for a colour",
            file=file,
            field=name,
            found=f"{low:g} to {high:g} nm; beyond lies {100 * missed:.0f} % of X, Y or Z under D65",
            expected=f"at most {100 * MOST_MISSED:.0f} %, as with 430 to 650 nm",
            hint="export the whole visible range; what was not measured is not made up",
        )


@cache
def missed_share(low: float, high: float) -> float:
    """Compute the largest fraction of X, Y or Z of a white surface under D65 from outside a range in nm."""
    grid = np.arange(360.0, 831.0)
    weights = observer("1931_2").weights(illuminant("D65"), grid)
    beyond = (grid < low) | (grid > high)
    return float((weights[:, beyond].sum(axis=1) / weights.sum(axis=1)).max())
