"""What the benchmark of factorisation is run on: the surfaces of Schwenk 2010, figures 3 and 5, as BRDFs."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from ..calibration.basis_benchmark import colour_checker
from ..materials.analytic import AshikhminShirley, OrenNayar
from ..materials.brdf import Brdf
from ..materials.formats.merl import read_merl
from ..materials.merl import MerlBrdf
from ..spectral.errors import InputError, UnknownNameError
from ..spectral.spectrum import Spectrum
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM

# Name, title, budget at p99, packs of the paper.
_MERL = (
    ("red-fabric", "Red fabric, MERL", 1.0, 8),
    ("blue-metallic-paint", "Blue metallic paint, MERL", 1.0, 24),
    ("yellow-matte-plastic", "Yellow matte plastic, MERL", 1.0, 22),
    ("specular-blue-phenolic", "Specular blue phenolic, MERL", 1.5, None),
    ("chrome-steel", "Chrome steel, MERL", 1.5, None),
)
#: R_s of the glossy case: a dielectric coat.
GLOSS = 0.05


@dataclass(frozen=True, eq=False)
class Case:
    """One surface.

    name : for the command line and JSON. title : for people. budget : ΔE94 that the fit is asked for, at p99.
    packs_2010 : packs of four terms that the paper used, or None. make : the BRDF; reading a file may take a while.
    """

    name: str
    title: str
    budget: float
    packs_2010: int | None
    make: Callable[[], Brdf]


def analytic_cases() -> tuple[Case, ...]:
    """The three rows of figure 3."""
    return (
        Case(
            "oren-nayar-0.52",
            "Oren-Nayar, σ = 0.52, ColorChecker patch 9",
            0.5,
            4,
            lambda: OrenNayar(_patch(9), 0.52),
        ),
        Case(
            "ashikhmin-shirley-32",
            f"Ashikhmin-Shirley, exponents 32, ColorChecker patch 12 under a coat of R_s = {GLOSS}",
            1.0,
            22,
            lambda: AshikhminShirley(_patch(12), _grey(GLOSS), 32.0, 32.0),
        ),
        Case(
            "ashikhmin-shirley-1-8",
            "Ashikhmin-Shirley, exponents 1 and 8, ColorChecker patch 6 as R_s, no diffuse part",
            1.5,
            48,
            lambda: AshikhminShirley(_grey(0.0), _patch(6), 1.0, 8.0),
        ),
    )


def measured_cases(data: Path) -> tuple[Case, ...]:
    """Materials of the MERL collection, figure 5 of the paper and two sharper ones: those that `data` has.

    A material is a file `brdf/merl/<name>.binary`, or one that `brdf/merl-fits/write_binary.py NAME OUT` writes.
    """
    found = []
    for name, title, budget, packs in _MERL:
        file, script = data / "brdf" / "merl" / f"{name}.binary", data / "brdf" / "merl-fits" / "write_binary.py"
        if file.exists() or script.exists():
            made_by = partial(_read, file) if file.exists() else partial(_written, script, name)
            found.append(Case(name, title, budget, packs, made_by))
    return tuple(found)


def chosen_cases(names: Sequence[str] | None, data: Path | None = None) -> tuple[Case, ...]:
    """The cases of these names; None takes all, those of the folder `data` included.

    Raises
    ------
    UnknownNameError : there is no case of a name. InputError : `data` is no folder, or has none of the materials.
    """
    there = analytic_cases()
    if data is not None:
        if not data.is_dir():
            raise InputError("no such folder", file=data, field="--data")
        measured = measured_cases(data)
        if not measured:
            raise InputError(
                "no measured materials", file=data, field="--data", expected=f"brdf/merl/{_MERL[0][0]}.binary or others"
            )
        there += measured
    if names is None:
        return there
    known = {case.name: case for case in there}
    for name in names:
        if name not in known:
            raise UnknownNameError("case", name, known, field="--cases")
    return tuple(known[name] for name in names)


def _read(file: Path) -> Brdf:
    return MerlBrdf.from_measurement(read_merl(file))


def _written(script: Path, name: str) -> Brdf:
    """The table that a script beside the data writes: 33 MB, read and let go."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / f"{name}.binary"
        done = subprocess.run([sys.executable, script, name, out], capture_output=True, text=True)
        if done.returncode != 0:
            raise InputError("the table was not written", file=script, field=name, found=done.stderr.strip()[-200:])
        return _read(out)


def _patch(number: int) -> Spectrum:
    """A patch of the ColorChecker, counted from 1 as on the chart."""
    values = colour_checker().resampled(WORKING_WAVELENGTHS_NM).samples
    return Spectrum.sampled(WORKING_WAVELENGTHS_NM, values[number - 1], "reflectance")


def _grey(value: float) -> Spectrum:
    return Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(WORKING_WAVELENGTHS_NM.size, value), "reflectance")
