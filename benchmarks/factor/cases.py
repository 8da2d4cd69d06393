"""Cases of the benchmark of factorisation without any data: the analytic surfaces of Schwenk 2010, and dyes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ...materials.analytic import AshikhminShirley, OrenNayar
from ...materials.analytic.fluorescent import FluorescentLambert
from ...materials.core.brdf import Brdf
from ...runtime.errors import InputError, UnknownNameError
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..basis import colour_checker
from ..fluorescence import made_up
from .case import Case
from .measured import PLACES, measured_cases

#: R_s of the glossy case: a dielectric coat.
GLOSS = 0.05


def analytic_cases() -> tuple[Case, ...]:
    """Return the three rows of figure 3."""
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


def fluorescent_cases() -> tuple[Case, ...]:
    """Two dyes on grey, made up here: with them every machine has fluorescent rows."""
    colours = ("blue to green", "green to orange")
    return tuple(
        Case(f"dye-{words.replace(' ', '-')}", f"Dye made up here, {words}", 1.0, None, _dye(number))
        for number, words in enumerate(colours)
    )


def chosen_cases(names: Sequence[str] | None, data: Path | None = None) -> tuple[Case, ...]:
    """Return the cases of these names; None takes all, those of the folder `data` included.

    Raises
    ------
    UnknownNameError : there is no case of a name. InputError : `data` is no folder, or has none of the materials.
    """
    there = (*analytic_cases(), *fluorescent_cases())
    if data is not None:
        expected = f"a folder with any of {', '.join(PLACES)}"
        if not data.is_dir():
            raise InputError("no such folder", file=data, expected=expected)
        measured = measured_cases(data)
        if not measured:
            raise InputError("no measured materials", file=data, expected=expected)
        there += measured
    if names is None:
        return there
    known = {case.name: case for case in there}
    for name in names:
        if name not in known:
            raise UnknownNameError("case", name, known, field="--cases")
    return tuple(known[name] for name in names)


def _dye(number: int) -> Callable[[], Brdf]:
    return lambda: FluorescentLambert(made_up()[number])


def _patch(number: int) -> Spectrum:
    """Return a patch of the ColorChecker, counted from 1 as on the chart."""
    values = colour_checker().resampled(WORKING_WAVELENGTHS_NM).samples
    return Spectrum.sampled(WORKING_WAVELENGTHS_NM, values[number - 1], "reflectance")


def _grey(value: float) -> Spectrum:
    return Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(WORKING_WAVELENGTHS_NM.size, value), "reflectance")
