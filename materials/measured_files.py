"""Measured files as catalogue sources: which reader a file is for, and what its record says of where it comes from."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Protocol, runtime_checkable

from .record import Provenance

#: How measured files are usually named; MERL and RGL files are known by their content under any name.
SUFFIXES = (".brdf", ".binary", ".bsdf")


@runtime_checkable
class MeasuredBrdf(Protocol):
    """What an importer needs of a measured BRDF: the name of its model, and what it is rebuilt from."""

    NAME: ClassVar[str]

    @property
    def notes(self) -> tuple[str, ...]: ...

    def parameters(self) -> dict[str, Any]: ...


def is_measured(path: Path) -> bool:
    """True for a file that `read_measured` has a reader for."""
    from .formats.merl import is_merl
    from .formats.rgl import is_rgl

    return path.suffix in SUFFIXES or is_merl(path) or is_rgl(path)


def read_measured(path: Path, uplift: str) -> tuple[MeasuredBrdf, Provenance]:
    """The BRDF in a measured file, and its provenance.

    `uplift`: how spectra are made for what was measured in RGB; one of `spectral.upsampling.METHODS`.

    Raises
    ------
    InputError : the file cannot be used; UnknownNameError : there is no such method.
    """
    from .formats.merl import is_merl
    from .formats.rgl import is_rgl

    reader: Callable[[Path, str], tuple[MeasuredBrdf, dict[str, str]]]
    if path.suffix == ".bsdf" or is_rgl(path):
        reader = _rgl
    else:
        reader = _merl if path.suffix == ".binary" or is_merl(path) else _cornell
    brdf, told = reader(path, uplift)
    notes = (*brdf.notes, f"{path.name}: SHA-256 {hashlib.sha256(path.read_bytes()).hexdigest()}")
    return brdf, Provenance(licence="not stated in the file", notes=" + ".join(notes), **told)


def _cornell(path: Path, uplift: str) -> tuple[MeasuredBrdf, dict[str, str]]:
    from .formats.cornell import read_cornell
    from .scattered import ScatteredBrdf

    brdf = ScatteredBrdf.from_measurement(read_cornell(path))
    told = brdf.measurement
    return brdf, {
        "source": ". ".join(text for text in (told.name or path.name, told.description) if text),
        "kind": "measured",
        "geometry": f"{len(told)} scattered direction pairs",
    }


def _merl(path: Path, uplift: str) -> tuple[MeasuredBrdf, dict[str, str]]:
    from ..spectral.upsampling import upsampling
    from .formats.merl import read_merl
    from .merl import MerlBrdf

    kind = upsampling(uplift).provenance
    return MerlBrdf.from_measurement(read_merl(path), uplift), {
        "source": f"{path.name}, a table in the layout of the MERL data base",
        "kind": kind,
        "geometry": "90 x 90 x 180 nodes of theta_h, theta_d and phi_d, in red, green and blue",
    }


def _rgl(path: Path, uplift: str) -> tuple[MeasuredBrdf, dict[str, str]]:
    from ..spectral.upsampling import upsampling
    from .formats.rgl import read_rgl
    from .rgl import RglBrdf

    kind = upsampling(uplift).provenance
    brdf = RglBrdf.from_measurement(read_rgl(path), uplift)
    told, count = brdf.measurement, len(brdf.measurement.fields["theta_i"]) * len(brdf.measurement.fields["phi_i"])
    channels = f"at {brdf.channels} wavelengths" if brdf.spectral else "in red, green and blue"
    return brdf, {
        "source": ". ".join(text for text in (told.description, path.name) if text),
        "kind": "measured" if brdf.spectral else kind,
        "geometry": f"{'isotropic' if brdf.isotropic else 'anisotropic'}, {count} directions of the light, {channels}",
    }
