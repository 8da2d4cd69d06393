"""Export of probe readings: text for pasting, tables of colours and of spectra, and CxF3."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...runtime.errors import InputError
from ...runtime.files import written_whole
from ...spectral.formats.cxf_writer import write_cxf
from ...spectral.formats.registry import SpectralEntry
from ...spectral.spectrum import Spectrum
from .displayed_value import Displayed
from .probe import ProbeReading

#: Named probe: name, reading and display value.
Named = tuple[str, ProbeReading, Displayed | None]
_COLOURS = ("X", "Y", "Z", "x", "y", "L*", "a*", "b*", "C*ab", "h_ab")
_SPECTRA = ("incident", "reflectance", "reflected")


def copied(name: str, reading: ProbeReading, shown: Displayed | None = None) -> str:
    """Format a probe as lines of tab-separated names and numbers, for spreadsheets and messages."""
    lines = [
        ("probe", name),
        ("pixel", f"{reading.pixel[0]}, {reading.pixel[1]}"),
        ("part", ", ".join(reading.parts) or "none"),
        ("material", ", ".join(reading.materials) or "none"),
        ("light", reading.light),
        ("observer", reading.observer),
    ]
    lines += [(key, "" if value is None else f"{value:.4f}") for key, value in colours(reading).items()]
    if shown is not None:
        lines.append(("displayed", ", ".join(map(str, shown.codes))))
        lines.append(("clipped", shown.clipped or "no"))
    return "".join(f"{key}\t{value}\n" for key, value in lines)


def colours(reading: ProbeReading) -> dict[str, float | None]:
    """Return XYZ (Y = 1 for the perfect diffuser), xy (None for black), CIELAB, C*ab and h_ab, by name."""
    x, y = reading.xy or (None, None)
    values = (*map(float, reading.xyz), x, y, *map(float, reading.lab), *map(float, reading.lch[1:]))
    return dict(zip(_COLOURS, values, strict=True))


def write_colours(path: str | Path, probes: Sequence[Named]) -> None:
    """Write a CSV table with a row per probe; numbers are exact.

    Raises
    ------
    InputError, NoRoomError : no probe, or a folder that cannot be written to.
    """
    head = ("probe", "column", "row", "part", "material", "coverage", "light", "observer", *_COLOURS)
    _write(path, (*head, "R", "G", "B", "clipped"), _colour_rows(_some(path, probes)))


def write_spectra(path: str | Path, probes: Sequence[Named]) -> None:
    """Write a row per probe and wavelength: incident, reflectance and reflected (`ProbeSpectra`); errors as in
    `write_colours`, and if no probe sees a surface.
    """
    rows = list(_spectral_rows(_some(path, probes)))
    if not rows:
        raise InputError("no spectra to write", file=path, found="probes that see no surface", expected="one that does")
    _write(path, ("probe", "made_of", "wavelength_nm", *_SPECTRA), rows)


def write_probes_cxf(path: str | Path, probes: Sequence[Named]) -> None:
    """Write reflectances as CxF3.

    The geometry is the scene's, not an instrument's, which the file states. Colours of the image are stored as tags,
    since they depend on illuminance and not only on reflectance.

    Raises
    ------
    InputError, NoRoomError : no probe with a reflectance, or a folder that cannot be written to.
    """
    entries = [_entry(*one) for one in _some(path, probes) if _has_reflectance(one[1])]
    if not entries:
        found, expected = "probes on which no light falls", "one that sees a lit surface"
        raise InputError("no reflectance to write", file=path, found=found, expected=expected)
    write_cxf(path, entries, {"description": "Probes of a picture; reflectances are radiance factors of the scene."})


def _has_reflectance(reading: ProbeReading) -> bool:
    return reading.spectra is not None and bool(np.isfinite(reading.spectra.reflectance).any())


def _entry(name: str, reading: ProbeReading, _shown: Displayed | None) -> SpectralEntry:
    spectra = reading.spectra
    assert spectra is not None
    # The ratio is undefined at wavelengths without light.
    known = np.isfinite(spectra.reflectance)
    factor = Spectrum.sampled(spectra.wavelengths_nm[known], spectra.reflectance[known], "radiance factor")
    details = {
        "kind": "Sample",
        "geometry": "that of the scene",
        "part": ", ".join(reading.parts),
        "material": ", ".join(reading.materials),
        "light": reading.light,
        "observer": reading.observer,
        "pixel": f"{reading.pixel[0]}, {reading.pixel[1]}",
        "spectra of": spectra.made_of,
        "XYZ in the picture": " ".join(f"{value:.6g}" for value in reading.xyz),
        "CIELAB in the picture": " ".join(f"{value:.6g}" for value in reading.lab),
    }
    return SpectralEntry(name, factor, details=details)


def _some(path: str | Path, probes: Sequence[Named]) -> Sequence[Named]:
    if not probes:
        raise InputError("nothing to write", file=path, found="no probes", expected="one pinned at least")
    return probes


def _colour_rows(probes: Sequence[Named]) -> Iterator[list[object]]:
    for name, reading, shown in probes:
        where = [*reading.pixel, ", ".join(reading.parts), ", ".join(reading.materials), reading.coverage]
        values = ["" if value is None else value for value in colours(reading).values()]
        sent = [*shown.codes, shown.clipped] if shown is not None else [""] * 4
        yield [name, *where, reading.light, reading.observer, *values, *sent]


def _spectral_rows(probes: Sequence[Named]) -> Iterator[list[object]]:
    for name, reading, _ in probes:
        if (spectra := reading.spectra) is not None:
            columns = [spectra.wavelengths_nm.tolist(), *(getattr(spectra, kind).tolist() for kind in _SPECTRA)]
            for row in zip(*columns, strict=True):
                yield [name, spectra.made_of, *("" if np.isnan(value) else value for value in row)]


def _write(path: str | Path, head: Sequence[str], rows: Iterator[list[object]] | list[list[object]]) -> None:
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(head)
    table.writerows([repr(cell) if isinstance(cell, float) else cell for cell in row] for row in rows)
    with written_whole(path) as beside:
        beside.write_text(text.getvalue(), encoding="utf-8", newline="\n")
