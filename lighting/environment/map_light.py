"""Environment lights from map files, with spectra stated, uplifted from RGB, or measured."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.spectrum import Spectrum
from ...spectral.upsampling import METHODS, upsampling, xyz_from_rgb
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..vectors import Number
from . import latlong
from .environment import EnvironmentLight, Origin
from .light_map import LightMap
from .map_file import read_map
from .reduction import BUDGET_DELTA_E94, MOST_SPECTRA, Reduction, fewest_spectra

#: Keys of such a light in scene files, beside those of every light.
KEYS = {
    "map": "file",
    "rotation_deg": "number",
    "illuminance_lux": "number",
    "uplift": "text",
    "bad_texels": "text",
}
#: Illuminant of uplifted reflectances: RGB (1, 1, 1) is this light.
MADE_OF = "D65"
# Fields that the estimate of memory assumes until their number is known.
_FIELDS = 4
# Texels sampled by their light to choose spectra, and as many by their solid angles.
_LOOKED_AT = 750
# Channels below 0 after a change of primaries by less than this share of the largest are rounding of the stored file:
# half floats have 11 bits.
_STORED = 2.0**-10


def load_environment(
    map: str | Path,
    spectrum: Spectrum | None = None,
    uplift: str | None = None,
    *,
    rotation_deg: Number = 0.0,
    illuminance_lux: Number = 1000.0,
    bad_texels: str | None = None,
    name: str = "light",
    spectrum_name: str = "",
    say: Callable[[str], None] | None = None,
) -> EnvironmentLight:
    """Return an environment from a latitude-longitude map in OpenEXR (RGB, XYZ, luminance, spectral) or Radiance's
    .hdr.

    Parameters
    ----------
    map : the file.
    spectrum : stated spectrum of the whole map, which then gives luminance only.
    uplift : method of `spectral.upsampling` that turns each texel's RGB into a reflectance, multiplied by D65; all of
        them are reduced to a few spectra (`reduction`).
    rotation_deg, illuminance_lux, name, spectrum_name : see `EnvironmentLight`.
    bad_texels : None refuses texels that are NaN, infinite or negative; "black" replaces them by black, with a note.
    say : called with a message before a long step.

    A spectral map needs neither `spectrum` nor `uplift`: its measured spectra are reduced to a few. An RGB or XYZ map
    needs exactly one of the two, and a luminance map `spectrum`, since their values do not determine spectra. The
    light's `notes` list the assumptions.

    Raises
    ------
    InputError, UnknownNameError
        Any error of `read_map`; neither `spectrum` nor `uplift`, or both; a map without light.
    """
    path = Path(map)
    # By its first author, as people write it.
    uplift = next((one for one in METHODS if uplift == one.split("-")[0]), uplift)
    if uplift is not None and uplift not in METHODS:
        raise UnknownNameError("upsampling method", uplift, METHODS, field="uplift")
    if spectrum is not None and uplift is not None:
        raise InputError(
            "one spectrum for a map, and spectra made from its RGB",
            field="uplift",
            found="spectrum and uplift",
            expected="one of the two",
        )
    found = read_map(path, bad_texels, 1 if spectrum is not None else _FIELDS, say)
    luminance = found.luminance()
    _check_luminance(found, luminance)
    origin: Origin = "stated"
    if spectrum is not None:
        fields, spectra, notes = luminance[None], (spectrum,), ()
        if found.kind != "luminance":
            notes = (f"{path.name}: only each texel's luminance is used",)
    elif found.kind == "spectra":
        if uplift is not None:
            raise InputError("a map of spectra needs no uplift", field="uplift", found=uplift, expected="no uplift")
        fields, spectra, notes = _measured(found, luminance)
        origin, spectrum_name = "measured", spectrum_name or path.name
    elif uplift is not None and found.kind != "luminance":
        fields, spectra, notes = _made(found, luminance, uplift)
        origin, spectrum_name = "made", spectrum_name or f"{path.name}, uplifted({uplift}) x {MADE_OF}"
    else:
        raise _unstated(found)
    return EnvironmentLight(
        fields,
        spectra,
        illuminance_lux,
        rotation_deg,
        name,
        spectrum_name,
        origin,
        notes=(*(f"{path.name}: {note}" for note in found.notes), *notes),
    )


def _unstated(found: LightMap) -> InputError:
    """Return the error for a map of colours without `spectrum` or `uplift`: colours do not determine spectra."""
    made = f'uplift = "{METHODS[1]}", which makes spectra up from its colours times {MADE_OF}'
    colours = found.kind != "luminance"
    return InputError(
        "a map that does not say of what spectrum its light is",
        file=found.path,
        field="spectrum",
        found=f"{found.kind} in the file, and {'no spectrum and no uplift' if colours else 'no spectrum'} stated",
        expected='spectrum = "D65" or another lamp' + (f", or {made}" if colours else ""),
        hint="state the spectrum where the lamp is known: no uplift recovers one",
    )


def _check_luminance(found: LightMap, luminance: Float[np.ndarray, "H W"]) -> None:
    """Raise `InputError` for a map without light and for colours that no light has."""
    if not luminance.any():
        raise InputError(
            "a map without light",
            file=found.path,
            field="pixels",
            found="black everywhere",
            expected="some light in the upper half",
            hint="look whether it was exported with its values, or name another map",
        )
    if (luminance < 0.0).any():
        row, column = (int(index) for index in np.argwhere(luminance < 0.0)[0])
        raise InputError(
            "a texel of negative luminance",
            file=found.path,
            field=f"row {row}, column {column}",
            found=float(luminance[row, column]),
            expected="a colour that light can have",
            hint="look whether the primaries that the file states are right",
        )


def _looked_at(luminance: Float[np.ndarray, "H W"]) -> tuple[tuple[np.ndarray, np.ndarray], Float[np.ndarray, " n"]]:
    """Sample the texels from which spectra are chosen: their rows and columns, and the level at which each is seen.

    Half are sampled in proportion to their light, at level 1, as on surfaces that they illuminate. The others are
    sampled by solid angle, at the level of their mirror image beside a white diffuser lit from above.
    """
    height, width = luminance.shape
    solid = latlong.solid_angles(height, width)[:, None]
    found = []
    for weights in (luminance * solid, np.broadcast_to(solid, luminance.shape)):
        total = np.cumsum(weights.ravel())
        places = (np.arange(_LOOKED_AT) + 0.5) / _LOOKED_AT * total[-1]
        found.append(np.minimum(np.searchsorted(total, places, side="right"), total.size - 1))
    cosines = np.clip(np.sin(np.pi * (0.5 - (np.arange(height) + 0.5) / height)), 0.0, None)
    white = float((luminance * solid).sum(axis=1) @ cosines) / np.pi
    seen = luminance.ravel()[found[1]]
    levels = np.minimum(seen / white, 1.0) if white > 0.0 else np.ones(_LOOKED_AT)
    return np.divmod(np.concatenate(found), width), np.concatenate([np.ones(_LOOKED_AT), levels])


def _fields(
    found: LightMap, spectra: tuple[Spectrum, ...], shares: Callable[[np.ndarray], np.ndarray]
) -> Float[np.ndarray, "K H W"]:
    """Compute the luminance of each spectrum from the shares of texels, in blocks of rows."""
    scale = np.array([observer("1931_2").luminous(one) for one in spectra])
    fields = np.empty((len(spectra), *found.size))
    for rows, values in found.blocks():
        fields[:, rows] = (shares(values) * scale).T.reshape(len(spectra), -1, found.size[1])
    return fields


def _measured(found: LightMap, luminance: np.ndarray) -> tuple[np.ndarray, tuple[Spectrum, ...], tuple[str, ...]]:
    """Reduce measured spectra to the fewest within the error budget."""
    grid = found.wavelengths_nm
    assert grid is not None
    where, levels = _looked_at(luminance)
    few = fewest_spectra(found.at(where), grid, levels).at_peak_one()
    spectra = _spectra(few)
    for one in spectra:
        try:
            observer("1931_2").white(one)
        except InputError as error:
            raise error.at(file=found.path, field="S0 channels") from error
    notes = [f"{found.path.name}: {grid.size} wavelengths at each texel, kept as {_said_of(few)}"]
    if held := spectra[0].range_note(WORKING_WAVELENGTHS_NM):
        notes.append(f"{found.path.name} is {held}")
    return _fields(found, spectra, few.shares), spectra, tuple(notes)


def _made(
    found: LightMap, luminance: np.ndarray, method: str
) -> tuple[np.ndarray, tuple[Spectrum, ...], tuple[str, ...]]:
    """Uplift colours to reflectances times D65, and reduce these to the fewest spectra within the error budget."""
    lamp, uplifting = illuminant(MADE_OF), upsampling(method)
    grid = lamp.wavelengths_nm
    rgb_from_channels = np.linalg.solve(xyz_from_rgb(), found.xyz_from_channels)

    def rgb(values: np.ndarray) -> np.ndarray:
        return _in_gamut(found, values @ rgb_from_channels.T)

    def lit(reflectances: np.ndarray) -> np.ndarray:
        # Beyond the working wavelengths a reflectance is held: white stays D65 itself, ultraviolet included.
        index = np.interp(grid, WORKING_WAVELENGTHS_NM, np.arange(WORKING_WAVELENGTHS_NM.size))
        low = np.floor(index).astype(int)
        high = np.minimum(low + 1, WORKING_WAVELENGTHS_NM.size - 1)
        between = reflectances[..., low] * (1.0 - (index - low)) + reflectances[..., high] * (index - low)
        return between * lamp.samples

    corners = len(uplifting.corners)
    most = min(corners - 1, MOST_SPECTRA)
    where, levels = _looked_at(luminance)
    few = fewest_spectra(lit(uplifting.spectra(rgb(found.at(where)))), grid, levels, most=most)
    if corners <= MOST_SPECTRA and few.delta_e94[0] > BUDGET_DELTA_E94:
        # A method of so few corners is exact in them.
        few = Reduction(lit(uplifting.corners), grid)
    few = few.at_peak_one()
    spectra = _spectra(few)
    note = (
        f"{found.path.name}: its spectra are made up from its colours, uplifted({method}) x {MADE_OF}, kept as "
        f"{_said_of(few)}; under any other lamp they are no evidence of what it would show"
    )
    return _fields(found, spectra, lambda values: few.shares(lit(uplifting.spectra(rgb(values))))), spectra, (note,)


def _in_gamut(found: LightMap, rgb: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Return linear sRGB with negative rounding errors clamped to 0; InputError for a colour outside sRGB."""
    if found.kind == "RGB" and rgb.min(initial=0.0) >= 0.0:
        return rgb
    allowed = -_STORED * np.maximum(rgb.max(axis=-1, keepdims=True), 0.0)
    outside = (rgb < allowed).any(axis=-1)
    if outside.any():
        raise InputError(
            "colours that sRGB does not hold have no uplift",
            file=found.path,
            field="uplift",
            found=f"linear sRGB {np.round(rgb[np.argmax(outside)], 4).tolist()}",
            expected="colours of sRGB, or a spectral map",
            hint='state the spectrum instead, spectrum = "D65", or convert the map to linear sRGB',
        )
    return np.maximum(rgb, 0.0)


def _spectra(few: Reduction) -> tuple[Spectrum, ...]:
    return tuple(Spectrum.sampled(few.wavelengths_nm, one, "emission") for one in few.spectra)


def _said_of(few: Reduction) -> str:
    count = len(few.spectra)
    p99, largest = few.delta_e94
    cost = (
        "exact"
        if largest == 0.0
        else f"ΔE94 p99 {p99:.2g}, max {largest:.2g} of 24 patches over its light and its directions"
    )
    most = f" (at most {MOST_SPECTRA} are kept)" if count == MOST_SPECTRA else ""
    return f"{count} {'spectrum' if count == 1 else 'spectra'}{most}: {cost}"
