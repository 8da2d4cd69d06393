"""Sliders of a material: the parameters of its formula, with their ranges, and edited copies.

Parameters and domains are read from the formula's own class (`AnalyticBrdf.domains`); a reflectance spectrum has a
slider for its scale. This module handles no files and no pictures: it serves the window's controls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.spectrum import Spectrum
from ..analytic.model import AnalyticBrdf, Domain
from ..core.surface import Surface

_SCALE = "_scale"


@dataclass(frozen=True, eq=False)
class Slider:
    """One parameter of a material.

    name : the field of the model, or that of a spectrum and "_scale": a factor, 1 as it is now.
    value : current value. domain : allowed numbers. shown : ends of the slider: the domain's if it has some, else those
    of the model's examples, extended to the value. logarithmic : its steps are ratios.
    """

    name: str
    value: float
    domain: Domain
    shown: tuple[float, float]
    made: Callable[[float], AnalyticBrdf]

    @property
    def logarithmic(self) -> bool:
        """True if its domain begins above 0 without an end there."""
        return self.domain.open_low and self.domain.low == 0.0

    def at(self, value: float | int) -> AnalyticBrdf:
        """Return the material with this value in place of its own.

        Raises
        ------
        InputError : the value is out of the domain; it is never clamped.
        """
        if not self.domain.holds(float(value)):
            found, expected = f"{value:g}", self.domain.words
            raise InputError("out of its domain", field=self.name, found=found, expected=expected)
        return self.made(float(value))

    def steps(self, start: float | int, end: float | int, count: int) -> tuple[float, ...]:
        """`count` values from start to end, evenly or by equal ratios; InputError for ends out of the domain."""
        for value in (start, end):
            if not self.domain.holds(float(value)):
                found, expected = f"{value:g}", self.domain.words
                raise InputError("out of its domain", field=self.name, found=found, expected=expected)
        spaced = np.geomspace if self.logarithmic else np.linspace
        return tuple(map(float, spaced(start, end, count)))


def sliders(surface: Surface, name: str | None = None) -> tuple[Slider, ...]:
    """Return the sliders of a surface, in the order of its model's fields.

    Parameters
    ----------
    name : of the material, for messages.

    Raises
    ------
    InputError : it is no formula: a table, a texture, maps or a BTF has no parameters, but it may have neighbours.
    """
    if not isinstance(surface, AnalyticBrdf):
        kind = getattr(type(surface), "NAME", type(surface).__name__)
        raise InputError(
            "no parameters to change",
            field=name,
            found=f"{kind}: measured, or made of texels",
            expected="a material with a formula",
            hint=f"look for neighbours instead: metamer catalogue like {name or 'ID'} --but glossier=1",
        )
    found: list[Slider] = []
    domains = surface.domains()
    concrete: Any = surface
    for field in fields(concrete):
        if field.name in domains:
            found.append(_of_number(surface, field.name, domains[field.name]))
        elif field.init and isinstance(getattr(surface, field.name), Spectrum):
            found += _of_scale(surface, field.name)
    return tuple(found)


def changed(surface: Surface, values: Mapping[str, float | int], name: str | None = None) -> AnalyticBrdf:
    """Return the surface with several values changed, by names of sliders.

    Raises
    ------
    UnknownNameError : no such slider. InputError : what `sliders` and `Slider.at` raise.
    """
    for parameter, value in values.items():
        surface = slider(surface, parameter, name).at(value)
    assert isinstance(surface, AnalyticBrdf) or not values
    return surface  # pyright: ignore[reportReturnType]


def slider(surface: Surface, parameter: str, name: str | None = None) -> Slider:
    """Return one of `sliders`; raises `UnknownNameError` with the existing ones."""
    there = {one.name: one for one in sliders(surface, name)}
    if parameter not in there:
        raise UnknownNameError(f"parameter of {name or 'the material'}", parameter, there, field=parameter)
    return there[parameter]


def _of_number(surface: AnalyticBrdf, name: str, domain: Domain) -> Slider:
    value = float(getattr(surface, name))
    there = [float(getattr(one, name)) for one in type(surface).examples(surface.wavelengths_nm)]
    low = min(*there, value) if domain.open_low else domain.low
    high = domain.high if np.isfinite(domain.high) else max(*there, value)
    return Slider(name, value, domain, (low, high), partial(_with_number, surface, name))


def _of_scale(surface: AnalyticBrdf, name: str) -> list[Slider]:
    """Return the slider of the scale; None for black, which cannot be scaled."""
    top = float(getattr(surface, name).samples.max())
    if not top > 0.0:
        return []
    most = 1.0 / top
    while most * top > 1.0:
        # Rounding may exceed 1.
        most = float(np.nextafter(most, 0.0))
    return [Slider(name + _SCALE, 1.0, Domain(0.0, most), (0.0, most), partial(_with_scale, surface, name))]


def _with_number(surface: AnalyticBrdf, name: str, value: float) -> AnalyticBrdf:
    changes: Any = {name: value}
    concrete: Any = surface
    return replace(concrete, **changes)


def _with_scale(surface: AnalyticBrdf, name: str, factor: float) -> AnalyticBrdf:
    spectrum: Spectrum = getattr(surface, name)
    scaled = Spectrum.sampled(spectrum.wavelengths_nm, factor * spectrum.samples, spectrum.quantity)
    changes: Any = {name: scaled}
    concrete: Any = surface
    return replace(concrete, **changes)
