"""Facts of a report on the materials and lights of a review."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
from ...spectral.axis_letters import Lab, White
from ...spectral.difference import delta_e_lab, differences, lab_from_xyz
from ...spectral.illuminants import illuminant
from ...spectral.image import ColourImage
from ...spectral.observers import Observer, observer
from ...spectral.spectrum import Spectrum
from ..display.png import quantise
from ..display.transform import DisplayTransform
from .cases import Setting

# Observers for small and for large fields: figures are given for both, whichever the pictures are for.
_OBSERVERS = ("1931_2", "1964_10")
_VISIBLE_NM = (360.0, 830.0)
# A name and its spectrum; None of the scene's own mixture.
_NamedLight = tuple[str, Spectrum | None]


def reviewed_lights(setting: Setting) -> tuple[ReviewedLight, ...]:
    """Lights of the pictures, and those that figures alone are given for."""
    found = []
    for name, spectrum in _lights(setting):
        title, kind = ("As lit in the scene", "scene") if spectrum is None else light_title(name)
        table = (None, None) if spectrum is None else _table(spectrum)
        found.append(ReviewedLight(name, title, kind, name in setting.names, *table))
    return told_apart(found)


def reviewed_materials(
    setting: Setting, names: tuple[str, ...], reading_of: Callable[[str], InstrumentReading]
) -> tuple[ReviewedMaterial, ...]:
    """Materials by id, with their colours under every light for every observer."""
    eyes = {eye.name: eye for eye in (setting.scene.observer, *(observer(name) for name in _OBSERVERS))}
    lights, found = _lights(setting), []
    for name in names:
        record, reading = setting.records[name], reading_of(name)
        colours = tuple(one for eye in eyes.values() for one in _colours(setting, lights, reading, eye))
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
                colours,
            )
        )
    return told_apart(found)


def _lights(setting: Setting) -> list[_NamedLight]:
    pictured = list(zip(setting.names, setting.spectra, strict=True))
    # A light may be asked for by another name that it has.
    keys = {spectrum.key for spectrum in setting.spectra if spectrum is not None}
    return pictured + [(name, one) for name in FIGURE_LIGHTS if (one := illuminant(name)).key not in keys]


def _colours(
    setting: Setting, lights: Sequence[_NamedLight], reading: InstrumentReading, eye: Observer
) -> list[LitColour]:
    daylight = eye.white(illuminant(SHIFT_FROM))
    start = corresponding_lab(reading.xyz(illuminant(SHIFT_FROM), eye), daylight, daylight)
    found = []
    for name, spectrum in lights:
        xyz, white = _seen(setting.scene, reading, spectrum, eye)
        lab, adapted = lab_from_xyz(xyz, white), corresponding_lab(xyz, white, daylight)
        shift = None if adapted is None or start is None else shift_between(start, adapted)
        shown = None if adapted is None else display_swatch(setting.display, xyz, white)
        found.append(LitColour(name, eye.name, xyz, lab, adapted, shift, shown))
    return found


def _seen(
    scene: Scene, reading: InstrumentReading, spectrum: Spectrum | None, eye: Observer
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """XYZ of a reading and of the white under a light, or in the mixture of the scene's own."""
    if spectrum is not None:
        return reading.xyz(spectrum, eye), eye.white(spectrum)
    own = replace(scene, observer=eye)
    return xyz_in(own, reading), own.adopted_white()


def _table(spectrum: Spectrum) -> tuple[Float[np.ndarray, "L"], Float[np.ndarray, "L"]]:
    """Return a light's spectral power as far as observers see, 1 at its highest."""
    inside = (spectrum.wavelengths_nm >= _VISIBLE_NM[0]) & (spectrum.wavelengths_nm <= _VISIBLE_NM[1])
    power = spectrum.samples[inside]
    return spectrum.wavelengths_nm[inside], power / power.max()


# Differences in CIELAB that no word is spent on.
_SPOKEN_FROM = 0.5


def corresponding_lab(xyz: Float[np.ndarray, "3"], white: White, daylight: White) -> Lab | None:
    """CIELAB under `SHIFT_FROM` of the colour that looks alike there, by complete adaptation; None where none is
    possible.

    daylight : white of `SHIFT_FROM` for the same observer.
    """
    try:
        adapted = adaptation_matrix(white, daylight, SHIFT_ADAPTATION) @ xyz
    except InputError:
        return None
    return lab_from_xyz(adapted, daylight)


def shift_between(first: Lab, second: Lab) -> Shift:
    """Change from one adapted colour to another: CIE 2000, and the direction in the words of a match."""
    return Shift(
        float(delta_e_lab(first, second, SHIFT_FORMULA)), direction(first, differences(first, second), _SPOKEN_FROM)
    )


def xyz_in(scene: Scene, reading: InstrumentReading) -> Float[np.ndarray, "3"]:
    """XYZ in the mixture of the scene's lights that its `adopted_white` is the white of; the diffuser has Y = 1."""
    return scene.mixed(np.stack([reading.xyz(light.spectrum, scene.observer) for light in scene.lights]))


def colours_around(scene: Scene, reading: InstrumentReading) -> tuple[tuple[float, Float[np.ndarray, "3"]], ...]:
    """Compute `xyz_in` by degrees from the mirror direction, of metals and effect coatings; none of others."""
    mixed = scene.mixed(np.stack([reading.xyz_around(light.spectrum, scene.observer) for light in scene.lights]))
    return tuple(zip(ANGLES, mixed, strict=False))


def display_swatch(
    display: DisplayTransform, xyz: Float[np.ndarray, "3"], white: Float[np.ndarray, "3"]
) -> tuple[int, int, int]:
    """XYZ as a colour of the display, 8 bits a channel."""
    rgb, _ = display.encode(ColourImage(xyz[None, None], "xyz", white))
    red, green, blue = (int(code) for code in quantise(rgb)[0, 0])
    return red, green, blue
