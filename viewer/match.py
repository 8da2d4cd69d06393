"""Comparison of samples with their standard, for scripts and commands."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, cast, get_args

from ..calibration.match.angles import shared_angles
from ..calibration.match.batch import batch
from ..calibration.match.page import MatchReport
from ..calibration.match.pairs import MatchOptions, matched
from ..calibration.match.tolerance import Tolerance
from ..calibration.match.uncertainty import Repeatability
from ..calibration.match.whites import WhiteScale
from ..lighting.scene_file.lamps import lamp_of_file
from ..materials.catalogue.catalogue import Catalogue
from ..materials.catalogue.material import Material
from ..materials.catalogue.samples import repeated_readings, sample_of, samples_of
from ..runtime.distribution import installed_version
from ..runtime.errors import InputError, UnknownNameError, UsageError
from ..spectral.foreign_spectra import KINDS, foreign_curves
from ..spectral.formats.import_options import NO_ANSWER, ImportOptions
from ..spectral.formula import formula
from ..spectral.illuminants import illuminant, measured_lamp
from ..spectral.measurement import ALLOWED_DIFFERENCES, AllowedDifference
from ..spectral.metamerism import Conditions
from ..spectral.observers import observer, observer_name
from ..spectral.sample import Sample
from ..spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from ..spectral.whiteness import WhitenessMethod

#: Formulas reported by default.
FORMULAS = ("CIE 2000", "CMC 2:1", "CIE 1994", "CIE 1976")
AT_ANGLES = ("DIN 6175-2",)
ILLUMINANTS, OBSERVERS = ("D65", "A", "TL84"), ("1964_10",)


def match(
    standard: Any,
    samples: Any,
    tolerance: str | None = None,
    *,
    formulas: str | Sequence[str] | None = None,
    illuminants: Any = None,
    observers: str | Sequence[str] | None = None,
    repeatability: float | None = None,
    repeated: str | Path | None = None,
    whites: str | Sequence[str] = (),
    catalogue: Catalogue | Path | None = None,
    answer: ImportOptions = NO_ANSWER,
    across: AllowedDifference | Collection[AllowedDifference] = (),
    angles: str | Sequence[str] = (),
    signed: Mapping[str, str] | None = None,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> MatchReport:
    """Compare samples with their standard under every illuminant and for every observer.

    Parameters
    ----------
    standard, samples : a name for `samples_of`, a `Sample`, a `Material`, a `Spectrum` of reflectance or another
        library's (`foreign_spectra.KINDS`); for samples one, a list, or {name: spectrum}.
    tolerance : such as "CMC 2:1 1.0"; None for no judgement.
    formulas : of reported ΔE, besides that of the tolerance; None: `FORMULAS`, and at angles `AT_ANGLES`, too.
    illuminants, observers : one or several. None: D65, A and TL84, 10 degrees; for colours without spectra, their own
        conditions. Observers are names. An illuminant is a name, a file of a measured lamp (with "#ENTRY" if it has
        several), a `Spectrum` of emission or another library's; {name: lamp} sets names for pages.
    repeatability : ΔE*ab of the instrument. repeated : a file of repeated readings to derive it from.
    whites : whiteness and yellowness of each, by name: "CIE 2004", "ASTM E313", "ASTM E313-73", "yellowness".
    catalogue : for ids; None: the default one.
    answer : information missing in files. across : "geometry", "condition": differences of measurement that are
        allowed, with a note on the page. angles : to judge among several, as aspecular angles such as "15" or
        notations; default: all common ones. signed : page fields filled in beforehand, by `page.SIGNED`.

    Raises
    ------
    ComparisonError : nothing to compare. InputError : an unusable file. UsageError : several standards.
    """

    @cache
    def opened() -> Catalogue:
        return catalogue if isinstance(catalogue, Catalogue) else Catalogue.open(catalogue)

    formulas, scales, crossings = _names(formulas, "formulas"), _names(whites, "whites"), _names(across, "across")
    (illuminants, assumed), observers = _lights(illuminants), _names(observers, "observers")
    observers = observers and tuple(dict.fromkeys(map(observer_name, observers)))
    angles = _names(angles, "angles") or ()

    def named(one: Any, unnamed: str) -> tuple[Sample, ...]:
        if isinstance(one, str | Path):
            return samples_of(str(one), opened, answer)
        if isinstance(one, Material):
            return (sample_of(one),)
        return (one,) if isinstance(one, Sample) else Sample.of_spectra(one, unnamed)

    first, *more = named(standard, "standard")
    if more:
        names = ", ".join(f"{one.name!r}" for one in (first, *more[:5]))
        if not isinstance(standard, str | Path):
            raise UsageError(f"the standard holds {len(more) + 1} samples: give one, of {names}")
        raise UsageError(
            f"{standard} holds {len(more) + 1} samples: name one, as in {f'{standard}#{first.name}'!r}, of {names}"
        )
    found: list[Sample] = []
    taken_out: list[str] = []
    by_name = _is_named(samples)
    asked_for = [(str(name), one) for name, one in samples.items()] if by_name else _numbered(samples)
    for done, (name, one) in enumerate(asked_for):
        told = str(one) if isinstance(one, str | Path) else getattr(one, "name", "")
        progress(done, len(asked_for), told or name)
        held = named(one, name)
        others = [sample for sample in held if not _is_same(sample, first)]
        # A single sample equal to the standard is refused.
        where = told or (name if by_name else "The table of samples")
        taken_out += [where] if 0 < len(others) < len(held) else []
        kept = others or held
        if by_name:
            kept = [replace(each, name=name if len(kept) == 1 else f"{name}: {each.name}") for each in kept]
        found += kept
    names = Counter(one.name for one in found)
    found = [replace(one, name=f"{one.name} ({one.source})") if names[one.name] > 1 else one for one in found]
    known = _known(repeatability, repeated, answer)
    conditions = _conditions((first, *found), illuminants, observers)
    shared, notes = shared_angles(first, found, angles)
    notes += assumed
    notes += tuple(
        f"{where} holds the standard, {first.name}, too: it is not among the samples." for where in taken_out
    )
    if shared:
        first, found = first.angle_by_angle, [one.angle_by_angle for one in found]
        conditions = tuple(replace(where, geometry=angle.notation) for angle in shared for where in conditions)
    if formulas is None:
        formulas = (*FORMULAS, *AT_ANGLES) if shared else FORMULAS
    asked = replace(
        _asked(tolerance, formulas, conditions, known, _scales(scales or ())),
        across=_crossings(crossings or ()),
        notes=notes,
    )
    pairs = matched(first, found, asked)
    batches = [batch([one.differences[at] for one in pairs], asked.judging) for at in range(len(asked.conditions))]
    filled = {name: text for name, text in (signed or {}).items() if text}
    if instrument := first.details.get("instrument", ""):
        filled.setdefault("instrument", instrument)
    return MatchReport(first, pairs, asked, batches, filled, installed_version())


def _numbered(samples: Any) -> list[tuple[str, Any]]:
    """Return samples as a list, each with a name for unnamed ones."""
    several = [samples] if _is_sample(samples) else samples
    return [(f"sample {number}", one) for number, one in enumerate(several, 1)]


def _is_named(samples: Any) -> bool:
    """Return whether a mapping has samples by name, not values by wavelength."""
    if not isinstance(samples, Mapping):
        return False
    return any(map(_is_sample, samples.values())) or foreign_curves(samples) is None


def _is_sample(value: Any) -> bool:
    return isinstance(value, str | Path | Sample | Material | Spectrum) or foreign_curves(value) is not None


def _names(value: Any, field: str) -> tuple[str, ...] | None:
    """Return the one or several names of an argument; None if not given."""
    if value is None:
        return None
    names = (value,) if isinstance(value, str) or not isinstance(value, Iterable) else tuple(value)
    for name in names:
        if not isinstance(name, str):
            raise InputError("not a name", field=field, found=repr(name)[:80], expected="one name, or several")
    return names


def _lights(value: Any) -> tuple[tuple[str, ...] | None, tuple[str, ...]]:
    """Return the names of lights, including measured lamps, and notes on assumptions about these."""
    if value is None:
        return None, ()
    if isinstance(value, str | Path | Spectrum) or foreign_curves(value) is not None:
        value = (value,)
    elif not isinstance(value, Iterable):
        raise _no_light(value)
    given = value.items() if isinstance(value, Mapping) else (("", one) for one in value)
    names, notes = [], []
    for label, light in given:
        name, said = _light(light, str(label))
        names.append(name)
        notes += said
    return tuple(names), tuple(notes)


def _light(light: Any, label: str) -> tuple[str, tuple[str, ...]]:
    if isinstance(light, str | Path):
        lamp = lamp_of_file(light)
        if lamp is None:
            return (str(light), ()) if not label else (measured_lamp(label, illuminant(str(light))), ())
        spectrum, called, notes = lamp
        return measured_lamp(label or called, spectrum), tuple(f"{note}." for note in notes)
    curves = foreign_curves(light)
    if not isinstance(light, Spectrum) and (curves is None or len(curves) != 1):
        raise _no_light(light)
    found = Spectrum.of(light, "emission")
    name = measured_lamp(label or (curves[0][0] if curves else "") or "measured lamp", found)
    note = found.range_note(WORKING_WAVELENGTHS_NM)
    return name, ((f"{name} is {note}.",) if note else ())


def _no_light(value: Any) -> InputError:
    expected = f"a name, a file of a lamp, a Spectrum of emission, {KINDS}, or several of them"
    return InputError("not a light", field="illuminants", found=repr(value)[:80], expected=expected)


def _is_same(one: Sample, other: Sample) -> bool:
    """Return whether two samples are the same entry of a file, for any spelling of its path, or the same spectrum
    object.
    """
    if one.name != other.name:
        return False
    if any(Path(each.source).exists() for each in (one, other)):
        return Path(one.source).resolve() == Path(other.source).resolve()
    held = [[(each.wavelengths_nm.tolist(), each.samples.tolist()) for each in side.readings] for side in (one, other)]
    return bool(held[0]) and held[0] == held[1]


def _asked(
    tolerance: str | None,
    formulas: Sequence[str],
    conditions: tuple[Conditions, ...],
    known: Repeatability | None,
    whites: tuple[WhiteScale, ...],
) -> MatchOptions:
    judged = None if tolerance is None else Tolerance.of(tolerance)
    told = [formula(text) for text in formulas]
    if judged is not None:
        told = [judged.formula, *told]
    if not told:
        raise InputError("no formula", field="formulas", expected='one or more, such as "CIE 2000"')
    return MatchOptions(conditions, tuple(dict.fromkeys(told)), judged, known, whites)


def _conditions(
    sides: Sequence[Sample], illuminants: Sequence[str] | None, observers: Sequence[str] | None
) -> tuple[Conditions, ...]:
    flat = next((one for one in sides if not one.spectral), None)
    if flat is not None:
        # A colour without spectrum is judged under its stated conditions, unless others are given.
        said = [one for one in flat.stated if one.illuminant and one.observer]
        illuminants = illuminants or list(dict.fromkeys(one.illuminant for one in said if one.illuminant))
        observers = observers or list(dict.fromkeys(one.observer for one in said if one.observer))
    lights, eyes = illuminants or ILLUMINANTS, observers or OBSERVERS
    for light in lights:
        illuminant(light)
    for eye in eyes:
        observer(eye)
    return tuple(Conditions(light, eye) for eye in eyes for light in lights)


def _scales(names: Sequence[str]) -> tuple[WhiteScale, ...]:
    known = (*get_args(WhitenessMethod), "yellowness")
    for name in names:
        if name not in known:
            raise UnknownNameError("whiteness", name, known)
    return cast(tuple[WhiteScale, ...], tuple(dict.fromkeys(names)))


def _crossings(names: Collection[str]) -> tuple[AllowedDifference, ...]:
    for name in names:
        if name not in ALLOWED_DIFFERENCES:
            raise UnknownNameError("difference of measurements", name, ALLOWED_DIFFERENCES)
    return tuple(one for one in ALLOWED_DIFFERENCES if one in names)


def _known(repeatability: float | None, repeated: str | Path | None, answer: ImportOptions) -> Repeatability | None:
    if repeatability is not None and repeated is not None:
        raise UsageError("a stated repeatability and readings that tell it say the same thing: give one of them")
    if repeated is not None:
        return Repeatability(repeated=repeated_readings(Path(repeated), answer))
    return None if repeatability is None else Repeatability(repeatability)
