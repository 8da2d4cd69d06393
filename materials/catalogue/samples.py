"""Samples by name: an id of a catalogue, a file of readings, a folder, or a colour in words."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from ...runtime.errors import ComparisonError, InputError, UnknownNameError
from ...spectral.angles import FEWEST, AngleReading, Thing, things, without_light
from ...spectral.formats.colours_only import UnclearColoursError, colour_in, read_colours
from ...spectral.formats.import_options import NO_ANSWER, ImportOptions
from ...spectral.formats.registry import StatedColour, details_of_readings, read_filling_gaps
from ...spectral.measurement import (
    FILE_NAME,
    MUST_AGREE,
    Geometry,
    Measurement,
    StatedPart,
    geometry_in,
    why_not_comparable,
)
from ...spectral.sample import Sample, check_covers
from ...spectral.spectrum import WORKING_WAVELENGTHS_NM, Quantity, Spectrum
from ..effect_coating.off_specular import effect_of, light_and_detector
from ..records.material import MaterialRecord
from ..records.record import read_record
from .catalogue import Catalogue
from .material import Material

_CONDITION = re.compile(r"(?:sample |surface )?(?:conditions?|state)|zustand|bedingung|[ée]tat", re.I)


def samples_of(text: str, catalogue: Callable[[], Catalogue], answer: ImportOptions = NO_ANSWER) -> tuple[Sample, ...]:
    """Return all samples that `text` names; readings of one name in one file belong to one sample.

    Parameters
    ----------
    text : "family/name" of a catalogue; a file of readings or a material's own; FILE#NAME, one reading of it; a folder
        of such files; or a colour such as "lab:52.1,10.3,-5.6@D65/1964_10".
    catalogue : asked where `text` is no file.

    Raises
    ------
    InputError : an unknown name, or nothing with a colour under it.
    """
    if (colour := colour_in(text)) is not None:
        return (Sample(text.partition("@")[0], "stated", stated=(colour,)),)
    path, before, hash_, name = Path(text), "", "", ""
    if not path.exists():
        before, hash_, name = text.rpartition("#")
        path = Path(before) if hash_ and Path(before).is_file() else path
    if path.is_dir():
        return _of_folder(path, answer)
    if path.is_file():
        found = _of_file(path, answer, name)
        return found if not hash_ else (_named(found, name, path),)
    # FILE#NAME of a file that is not there; an id may have dots and slashes, but begins with neither.
    named = Path(before or text)
    ends_as_file = bool(named.suffix) and len(named.suffix) <= 6 and not named.suffix[1:].isdigit()
    hint = "check the path; relative paths start at the current folder"
    if named.is_absolute() or text.startswith(".") or (ends_as_file and len(named.parts) == 1):
        raise InputError("no such file or folder", file=named, hint=hint)
    try:
        return (sample_of(catalogue().load(text)),)
    except InputError as reason:
        if not ends_as_file:
            raise
        problem, other = f"no such file, and as a material: {reason.problem}", reason.hint
        raise InputError(problem, file=named, hint=f"{hint}; {other}" if other else hint) from None


def repeated_readings(path: Path, answer: ImportOptions = NO_ANSWER) -> Sample:
    """Return all readings of a file, whatever their names, as repeated readings of one sample.

    Raises
    ------
    InputError : a file without spectra.
    """
    found = _of_file(path, answer)
    for other in found[1:]:
        if reason := why_not_comparable(found[0].side, other.side, ()):
            raise ComparisonError(reason)
    readings = tuple(reading for one in found for reading in one.readings)
    if not readings:
        raise InputError("no readings with spectra", file=path, expected="spectra of one thing, measured repeatedly")
    return Sample(path.name, str(path), readings)


def sample_of(material: Material) -> Sample:
    """Return the reading of a material by an annular 45:0 instrument.

    Raises
    ------
    InputError : a light; a spectrum of too little of the visible.
    """
    reading = material.reading()
    details = {"instrument": "", "geometry": _geometry_of(material), "standing": material.provenance.kind}
    measured = measurement_of(material)
    angles = _readings_of(material, measured)
    made_up = material.provenance.kind if material.provenance.standing in ("uplifted", "reconstructed") else ""
    notes = ()
    if made_up:
        where = f", but at the angles that it was read at ({', '.join(a.name for a in angles)})" if angles else ""
        notes = (f"{material.id} of the catalogue is {made_up}, not measured: it judges no colour{where}.",)
    effect = effect_of(material.brdf()) if material.is_surface and material.model != "lambert" else ""
    if reading.brdf is not None:
        return Sample(
            material.id,
            "catalogue",
            seen=reading.xyz,
            effect=effect,
            details=details,
            measurement=measured,
            finish=_finish_of(material),
            made_up=made_up,
            notes=notes,
        )
    values = reading.factor
    quantity: Quantity = "radiance factor" if values.max() > 1.0 or values.min() < 0.0 else "reflectance"
    # A fitted BRDF may be a little below zero: what it is there is the colour that pictures show.
    spectrum = Spectrum.sampled(reading.wavelengths_nm, np.maximum(values, 0.0), quantity)
    check_covers(spectrum, "catalogue", material.id)
    angled = partial(_read_at, material) if material.is_surface and material.model != "lambert" else None
    return Sample(
        material.id,
        "catalogue",
        (spectrum,),
        effect=effect,
        details=details,
        measurement=measured,
        angles=angles,
        angled=angled,
        finish=_finish_of(material),
        made_up=made_up,
        notes=notes,
    )


def _readings_of(material: MaterialRecord, measured: Measurement) -> tuple[Sample, ...]:
    """Return the readings that a BRDF was reconstructed from, one sample per angle; none for other materials."""
    kept, found = material.original, dict[str, list[Spectrum]]()
    if material.provenance.standing != "reconstructed" or "aspecular_deg" not in kept:
        return ()
    for place, angles in enumerate(zip(kept["light_deg"], kept["aspecular_deg"], kept["azimuth_deg"], strict=True)):
        geometry = Geometry("multi-angle", *(float(one) for one in angles))
        if "readings" in kept:
            nm, values = kept["readings_nm"], kept["readings"][place]
        else:
            nm, values = kept[f"reading.{place + 1}.nm"], kept[f"reading.{place + 1}"]
        known = next((name for name in found if geometry.matches(geometry_in(name) or geometry)), geometry.notation)
        found.setdefault(known, []).append(Spectrum.sampled(nm, values, "radiance factor"))
    return tuple(
        Sample(
            name,
            "catalogue",
            tuple(some),
            measurement=Measurement({**measured.parts, "geometry": StatedPart(at, name, "geometry")}),
        )
        for name, some in found.items()
        if (at := geometry_in(name)) is not None
    )


def _finish_of(material: MaterialRecord) -> str:
    if not material.is_surface:
        return ""
    numbers = (f"{name} {value!r}" for name, value in material.parameters.items() if np.isscalar(value))
    return ", ".join([material.model, *numbers])


def _read_at(material: Material, geometry: Geometry) -> Sample:
    """Return the reading of a material at one angle, by its BRDF."""
    brdf = material.brdf()
    try:
        wi, wo = light_and_detector((geometry,))
    except InputError:
        raise ComparisonError(f"{material.id}: no detector above the surface at {geometry.notation}") from None
    values = np.pi * np.asarray(brdf.eval(wi, wo), dtype=np.float64)[0]
    spectrum = Spectrum.sampled(brdf.wavelengths_nm, np.maximum(values, 0.0), "radiance factor")
    measured = Measurement.of("radiance factor", {"geometry": geometry.notation})
    made_up = material.provenance.kind if material.provenance.standing in ("uplifted", "reconstructed") else ""
    name = f"{material.id}, {geometry.notation}"
    return Sample(name, "catalogue", (spectrum,), measurement=measured, made_up=made_up)


def measurement_of(material: MaterialRecord) -> Measurement:
    """Return the conditions of a material's colour: those of its file, and 45a:0 for a surface with a BRDF."""
    kept = {key.partition(".")[2]: str(value) for key, value in material.original.items() if key.startswith("details.")}
    form = str(material.original.get("format", ""))
    if form and form not in ("CxF3", "CGATS"):
        kept = {k.partition(".")[2]: str(v) for k, v in material.original.items() if k.startswith("file.")} | kept
    geometry = {"geometry": stated} if (stated := _geometry_of(material)) else {}
    quantity: Quantity = "reflectance"
    if material.quantity in ("transmittance", "radiance factor"):
        quantity = "transmittance" if material.quantity == "transmittance" else "radiance factor"
    file = Path(str(material.original.get("file", ""))).stem
    said = kept | geometry | {"format": form, FILE_NAME: file}
    return Measurement.of(quantity, said, str(material.original.get("name", "")))


def _geometry_of(material: MaterialRecord) -> str:
    """Return the geometry of a reading: 45a:0 of a surface with a BRDF; as measured of spectra and matt surfaces."""
    return "45a:0" if material.is_surface and material.model != "lambert" else material.provenance.geometry


def _of_file(path: Path, answer: ImportOptions, name: str = "") -> tuple[Sample, ...]:
    """Return the samples of a file; raises the error of a named reading that cannot be used."""
    if path.suffix == ".h5":
        return (sample_of(Material(**vars(read_record(path)))),)
    try:
        file, left_out = read_filling_gaps(path, answer)
    except InputError as refusal:
        # A file of colours alone is refused by readers of spectra, who say why.
        try:
            colours = read_colours(path, answer)
        except UnclearColoursError as reason:
            raise reason.at(file=path) from None
        except InputError:
            raise refusal from None
        return _gathered(
            [
                Sample(
                    one.name,
                    str(path),
                    stated=one.stated,
                    details=one.details,
                    measurement=Measurement.of(None, {**one.details, FILE_NAME: path.stem}, one.name),
                    notes=(f"{path.name}: {one.details['converted']}",) if "converted" in one.details else (),
                )
                for one in colours
            ],
            path,
            {},
            {},
        )
    for called, reason in file.rejected:
        if called == name and all(entry.name != name for entry in file.entries):
            raise reason
    if not file.entries:
        raise file.rejected[0][1] if file.rejected else InputError("no readings", file=path, expected="at least one")
    beside = details_of_readings(file, path)
    found = [Sample.of_entry(entry, str(path), beside) for entry in file.entries]
    details = {key: value for key, value in file.details.items() if isinstance(value, str)}
    told = [left_out] if left_out else []
    told += (f"{called} of {path.name} is left out: {reason.problem}" for called, reason in file.rejected)
    # A comparison says what was converted and assumed, as an import does.
    told += (f"{path.name}: {note}" for note in file.notes)
    return tuple(replace(one, notes=(*one.notes, *told)) for one in _gathered(found, path, beside, details))


def _gathered(
    found: list[Sample], path: Path, beside: Mapping[str, str], details: dict[str, str]
) -> tuple[Sample, ...]:
    """Group the readings of a file into samples: those at several angles, and those of one name."""
    unlit = without_light([one.name for one in found], [{**beside, **one.details} for one in found])
    for at, one in unlit.items():
        # Angles are paired by their numbers, wherever the light was.
        stated = found[at].measurement.geometry
        if one.noted and (stated is None or not stated.is_known):
            geometry = Geometry("multi-angle", None, one.aspecular)
            said = {"geometry": StatedPart(geometry, geometry.notation, "the name")}
            found[at] = replace(found[at], measurement=Measurement({**found[at].measurement.parts, **said}))
    by_name: dict[str, list[Sample]] = {}
    at_angles: list[Sample] = []
    paired: set[int] = set()
    for thing in things(AngleReading(one, one.name, one.details.get("object", ""), one.measurement) for one in found):
        if thing.angles:
            at_angles.append(_at_angles(thing, path, details))
            paired |= {id(one.item) for one in thing.readings}
        else:
            by_name.setdefault(thing.name, []).append(thing.readings[0].item)
    single = [
        _together(called, alike, details) for name, some in by_name.items() for called, alike in _alike(name, some)
    ]
    unpaired = [one.words for at, one in unlit.items() if not one.noted and id(found[at]) not in paired]
    told = ()
    if unpaired:
        told = (
            f"{', '.join(unpaired)} of {path.name} may be readings of one thing at several angles and are judged each "
            "by itself: write their angles as 45as15 to have them paired.",
        )
    return tuple(replace(one, notes=(*one.notes, *told)) for one in (*single, *at_angles))


def _at_angles(thing: Thing[Sample], path: Path, details: dict[str, str]) -> Sample:
    """One sample of readings at several angles; those at one angle count by their mean."""
    parts = []
    for angle in thing.angles:
        some = [one.item for one in thing.readings if one.angle is not None and one.angle.matches(angle)]
        parts.append(replace(_together(some[0].name, some, details), details=some[0].details))
    first = parts[0]
    common = {part: said for part, said in first.measurement.parts.items() if part not in ("geometry", "configuration")}
    notes = ()
    if thing.by_name:
        names = ", ".join(one.name for one in thing.readings)
        called = thing.name or path.stem
        notes = (f"Taken as readings of one thing, {called}, for their names differ by their angle alone: {names}.",)
    if doubt := _doubtful(parts):
        notes = (*notes, f"{thing.name or path.stem} of {path}: {doubt}.")
    return Sample(
        thing.name or path.stem,
        first.source,
        stated=() if first.readings else first.stated,
        effect=first.effect,
        details={**details, **first.details, "geometry": ", ".join(one.notation for one in thing.angles)},
        measurement=Measurement(common),
        angles=tuple(parts),
        notes=notes,
    )


def _doubtful(parts: list[Sample]) -> str:
    """Describe why readings hardly belong to their angles; "" for too few, or without evidence of that."""
    from ..effect_coating.fit import AngleReadings, reconstructed
    from ..effect_coating.reading_order import doubtful_order

    read = [(angle, one) for one in parts if (angle := one.measurement.geometry) is not None and one.readings]
    if len(read) < FEWEST:
        return ""
    try:
        wi, wo = light_and_detector([angle for angle, _ in read])
    except InputError:
        # An angle that no light or detector can have is refused where a BRDF is made of it.
        return ""
    values = np.stack([one.factor(WORKING_WAVELENGTHS_NM) for _, one in read]) / np.pi
    readings = AngleReadings(WORKING_WAVELENGTHS_NM, wi, wo, values)
    return doubtful_order(readings, [angle for angle, _ in read], reconstructed(readings).interference)


def _alike(name: str, some: list[Sample]) -> list[tuple[str, list[Sample]]]:
    """Group readings of one name by their measurement conditions; several groups get names of their own."""
    groups: list[list[Sample]] = []
    for one in some:
        group = next((group for group in groups if not any(_apart(one, two) for two in group)), None)
        if group is None:
            groups.append([one])
        else:
            group.append(one)
    if len(groups) == 1:
        return [(name, some)]
    firsts = [group[0].measurement for group in groups]
    parts = [part for part in MUST_AGREE if any(part in one.differing(two) for one in firsts for two in firsts)]
    labels = [", ".join(one.parts[part].words for part in parts if part in one.parts) for one in firsts]
    if len(set(labels)) < len(labels):
        told = [", ".join(_conditions_of(group[0]).values()) for group in groups]
        labels = [", ".join(filter(None, (label, more))) for label, more in zip(labels, told, strict=True)]
    return [(f"{name}, {label}", group) for label, group in zip(labels, groups, strict=True)]


def _apart(one: Sample, two: Sample) -> bool:
    """Return whether two readings of one name differ in measurement or condition, and so are of two samples."""
    first, second = _conditions_of(one), _conditions_of(two)
    return bool(one.measurement.differing(two.measurement)) or any(
        first[label] != second[label] for label in first.keys() & second.keys()
    )


def _conditions_of(one: Sample) -> dict[str, str]:
    """Find the cells below headings such as "Condition", which may describe the sample's condition."""
    return {label: words for label, words in one.details.items() if _CONDITION.fullmatch(label.strip())}


def _together(name: str, some: list[Sample], of_file: dict[str, str]) -> Sample:
    first = some[0]
    readings = tuple(reading for one in some for reading in one.readings)
    details = of_file | dict(first.details)
    stated = first.stated if readings else _mean_colours(some)
    return Sample(name, first.source, readings, stated, details=details, measurement=first.measurement)


def _mean_colours(some: list[Sample]) -> tuple[StatedColour, ...]:
    """Average the stated colours of one sample, for each light and observer."""
    by_kind: dict[tuple[str, str | None, str | None], list[StatedColour]] = {}
    for colour in (one for sample in some for one in sample.stated):
        by_kind.setdefault((colour.space, colour.illuminant, colour.observer), []).append(colour)
    return tuple(replace(like[0], values=np.mean([one.values for one in like], axis=0)) for like in by_kind.values())


def _of_folder(path: Path, answer: ImportOptions) -> tuple[Sample, ...]:
    files = sorted(file for file in path.iterdir() if file.is_file() and not file.name.startswith("."))
    found, refused = [], []
    for file in files:
        try:
            found += _of_file(file, answer)
        except InputError as reason:
            refused.append(reason)
    if refused:
        # None is left out of a batch unseen.
        raise refused[0]
    if not found:
        raise InputError("no readings in this folder", file=path, expected="files of readings, such as CxF or CGATS")
    return tuple(found)


def _named(found: tuple[Sample, ...], name: str, path: Path) -> Sample:
    chosen = [one for one in found if one.name == name]
    # One angle of several is a sample that was read at that angle alone.
    chosen = chosen or [replace(one, angles=(at,)) for one in found for at in one.angles if at.name == name]
    # Words that all names have, as "R%" in "Master R%" and "Lot 1 R%", need not be written.
    short = _without_common_words([one.name for one in found])
    chosen = chosen or ([found[short.index(name)]] if short.count(name) == 1 else [])
    if not chosen:
        raise UnknownNameError("reading", name, [one.name for one in found]).at(file=path)
    return chosen[0]


def _without_common_words(names: Sequence[str]) -> list[str]:
    """Strip the words that all names begin or end with, as long as something of each remains."""
    words = [name.split() for name in names]
    if len(words) < 2:
        return list(names)
    first = last = 0
    most = min(map(len, words)) - 1
    while first < most and len({one[first] for one in words}) == 1:
        first += 1
    while first + last < most and len({one[-1 - last] for one in words}) == 1:
        last += 1
    return [" ".join(one[first : len(one) - last]) for one in words]
