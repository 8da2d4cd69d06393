"""Facts of a report on the materials and lights of a review."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ...calibration.report.direction import direction
from ...calibration.report.review_facts import (
    FIGURE_LIGHTS,
    SHIFT_ADAPTATION,
    SHIFT_FORMULA,
    SHIFT_FROM,
    LitColour,
    ReviewedLight,
    ReviewedMaterial,
    Shift,
    light_title,
    told_apart,
)
from ...lighting.scene import Scene
from ...materials.catalogue.instrument_reading import GEOMETRY, InstrumentReading
from ...materials.effect_coating.off_specular import ANGLES
from ...materials.records.colour_standing import (
    colour_standing,
    gloss_standing,
    measured_range,
    standing_sentences,
    title_of,
)
from ...runtime.errors import InputError
from ...spectral.adaptation import adaptation_matrix
from ...spectral.axis_letters import XYZ, Lab, White
from ...spectral.difference import Differences, delta_e_lab, differences, lab_from_xyz
from ...spectral.illuminants import illuminant
from ...spectral.image import ColourImage
from ...spectral.observers import Observer, observer
from ...spectral.spectrum import Spectrum
from ..display.png import quantise
from ..display.transform import DisplayTransform
from .cases import Setting

# Observers for small and large fields; figures are given for both.
_OBSERVERS = ("1931_2", "1964_10")
_VISIBLE_NM = (360.0, 830.0)
# Name and spectrum of a light; None for the scene's own mixture.
_NamedLight = tuple[str, Spectrum | None]


def reviewed_lights(setting: Setting) -> tuple[ReviewedLight, ...]:
    """Return the lights of the images, and those for figures only."""
    found = []
    for name, spectrum in _lights(setting):
        title, kind = ("As lit in the scene", "scene") if spectrum is None else light_title(name)
        table = (None, None) if spectrum is None else _table(spectrum)
        found.append(ReviewedLight(name, title, kind, name in setting.names, *table))
    return told_apart(found)


def reviewed_materials(
    setting: Setting, names: tuple[str, ...], reading_of: Callable[[str], InstrumentReading]
) -> tuple[ReviewedMaterial, ...]:
    """Return materials by id, with their colours under every light for every observer."""
    eyes = {eye.name: eye for eye in (setting.scene.observer, *(observer(name) for name in _OBSERVERS))}
    lights, readings, found = _lights(setting), [reading_of(name) for name in names], []
    # All materials at once under each light, since call overhead dominates.
    columns = [column for eye in eyes.values() for column in _colours(setting, lights, readings, eye)]
    for name, reading, *colours in zip(names, readings, *columns, strict=True):
        record = setting.records[name]
        found.append(
            ReviewedMaterial(
                name,
                title_of(record),
                record.family,
                colour_standing(record),
                gloss_standing(record),
                standing_sentences(record),
                reading.wavelengths_nm,
                reading.factor,
                f"radiance factor at {GEOMETRY}",
                measured_range(record),
                record.provenance.source,
                record.provenance.licence,
                tuple(colours),
            )
        )
    return told_apart(found)


def _lights(setting: Setting) -> list[_NamedLight]:
    pictured = list(zip(setting.names, setting.spectra, strict=True))
    # A light may be requested by another of its names.
    keys = {spectrum.key for spectrum in setting.spectra if spectrum is not None}
    return pictured + [(name, one) for name in FIGURE_LIGHTS if (one := illuminant(name)).key not in keys]


def _colours(
    setting: Setting, lights: Sequence[_NamedLight], readings: Sequence[InstrumentReading], eye: Observer
) -> Iterator[list[LitColour]]:
    """Yield the colours of all readings under each light."""
    daylight = eye.white(illuminant(SHIFT_FROM))
    at_first = np.stack([reading.xyz(illuminant(SHIFT_FROM), eye) for reading in readings])
    start = corresponding_lab(at_first, daylight, daylight)
    for name, spectrum in lights:
        xyz, white = _seen(setting.scene, readings, spectrum, eye)
        lab, adapted = lab_from_xyz(xyz, white), corresponding_lab(xyz, white, daylight)
        if adapted is None or start is None:
            yield [LitColour(name, eye.name, *each, None, None) for each in zip(xyz, lab, strict=True)]
            continue
        shifts, shown = shifts_between(start, adapted), display_swatches(setting.display, xyz, white)
        rows = zip(xyz, lab, adapted, shifts, shown, strict=True)
        yield [LitColour(name, eye.name, *each) for each in rows]


def _seen(
    scene: Scene, readings: Sequence[InstrumentReading], spectrum: Spectrum | None, eye: Observer
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "3"]]:
    """Return XYZ of readings and of the white under a light, or under the mixture of the scene's own."""
    if spectrum is not None:
        return np.stack([reading.xyz(spectrum, eye) for reading in readings]), eye.white(spectrum)
    own = replace(scene, observer=eye)
    return np.stack([xyz_in(own, reading) for reading in readings]), own.adopted_white()


def _table(spectrum: Spectrum) -> tuple[Float[np.ndarray, "L"], Float[np.ndarray, "L"]]:
    """Return a light's spectral power over the observers' range, with a maximum of 1."""
    inside = (spectrum.wavelengths_nm >= _VISIBLE_NM[0]) & (spectrum.wavelengths_nm <= _VISIBLE_NM[1])
    power = spectrum.samples[inside]
    return spectrum.wavelengths_nm[inside], power / power.max()


# Differences in CIELAB that are too small to mention.
_SPOKEN_FROM = 0.5


def corresponding_lab(xyz: XYZ, white: White, daylight: White) -> Lab | None:
    """Return CIELAB of the corresponding colours (...,3) under `SHIFT_FROM`, by complete adaptation; None if
    impossible.

    daylight : white of `SHIFT_FROM` for the same observer.
    """
    try:
        adapted = adaptation_matrix(white, daylight, SHIFT_ADAPTATION) @ xyz[..., None]
    except InputError:
        return None
    return lab_from_xyz(adapted[..., 0], daylight)


def shifts_between(first: Float[np.ndarray, "N 3"], second: Float[np.ndarray, "N 3"]) -> list[Shift]:
    """Describe the shift between adapted colours: CIE 2000, and the direction in the words of a match."""
    off = differences(first, second)
    each = zip(first, off.lightness, off.a, off.b, off.chroma, off.hue, strict=True)
    words = [direction(lab, Differences(*map(np.asarray, parts)), _SPOKEN_FROM) for lab, *parts in each]
    delta_e = delta_e_lab(first, second, SHIFT_FORMULA)
    return [Shift(float(size), said) for size, said in zip(delta_e, words, strict=True)]


def xyz_in(scene: Scene, reading: InstrumentReading) -> Float[np.ndarray, "3"]:
    """Return XYZ under the mixture of the scene's lights, as for its `adopted_white`; the diffuser has Y = 1."""
    return scene.mixed(np.stack([reading.xyz(light.spectrum, scene.observer) for light in scene.lights]))


def colours_around(scene: Scene, reading: InstrumentReading) -> tuple[tuple[float, Float[np.ndarray, "3"]], ...]:
    """Return `xyz_in` by degrees from the mirror direction, for metals and effect coatings; () for others."""
    mixed = scene.mixed(np.stack([reading.xyz_around(light.spectrum, scene.observer) for light in scene.lights]))
    return tuple(zip(ANGLES, mixed, strict=False))


def display_swatches(
    display: DisplayTransform, xyz: Float[np.ndarray, "N 3"], white: Float[np.ndarray, "3"]
) -> list[tuple[int, int, int]]:
    """Convert XYZ to display colours, 8 bits per channel."""
    rgb, _ = display.encode(ColourImage(xyz[:, None], "xyz", white))
    return [(int(red), int(green), int(blue)) for red, green, blue in quantise(rgb)[:, 0]]
