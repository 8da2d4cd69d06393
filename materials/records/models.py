"""Models that a record may name, one row each, and rebuilding a BRDF from its parameters.

Formulas are listed in `analytic.MODELS`; here are the measured ones, and the spectra without a surface.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...runtime.errors import InputError, UnknownNameError
from ..core.surface import Surface
from .stored_array import StoredArray

if TYPE_CHECKING:
    from ..analytic.model import AnalyticBrdf


@dataclass(frozen=True)
class Measured:
    """Model without a formula: the class `name` in `module` of materials, with `from_parameters(parameters)`.

    reads_files : it accepts a `StoredArray`; others receive the whole array in its place.
    """

    module: str
    name: str
    quantity: str = "reflectance"
    reads_files: bool = False


@dataclass(frozen=True)
class SpectrumOnly:
    """Spectrum without a surface: its description for a sentence, and an alternative to shading."""

    quantity: str
    words: str
    use: str


MEASURED = {
    "scattered": Measured("measured.scattered", "ScatteredBrdf"),
    "merl": Measured("measured.merl", "MerlBrdf"),
    "rgl": Measured("measured.rgl", "RglBrdf"),
    "flake_tilt": Measured("effect_coating.flake_tilt", "FlakeTilt"),
    "spectral_texture": Measured("svbrdf.texture", "SpectralTexture"),
    "maps": Measured("svbrdf.maps", "MappedSurface"),
    "btf": Measured("btf.surface", "MeasuredBtf", reads_files=True),
    "fluorescent_lambert": Measured("analytic.fluorescent", "FluorescentLambert", "bispectral"),
}

SPECTRA = {
    "emission": SpectrumOnly(
        "emission",
        "an emission spectrum",
        'use it as a light: metamer catalogue export ID --format csv -o F.csv, and spectrum = "F.csv" in a [[light]]',
    ),
    "transmittance": SpectrumOnly(
        "transmittance", "a transmittance spectrum", "measure what the sample reflects, and import that"
    ),
    "radiance_factor": SpectrumOnly(
        "radiance factor",
        "a radiance factor in one geometry",
        "measure the sample in several geometries, or import a reflectance, to have a surface",
    ),
}


def quantity_of(model: str) -> str:
    """Return the quantity that a record of a model holds: "reflectance", "bispectral", "emission", "transmittance",
    "radiance factor".

    >>> quantity_of("radiance_factor"), quantity_of("lambert")
    ('radiance factor', 'reflectance')
    """
    row = SPECTRA.get(model) or MEASURED.get(model)
    return row.quantity if row else "reflectance"


def no_surface(model: str, material_id: str | None = None) -> InputError:
    """Return the error for a spectrum where a surface is needed."""
    row = SPECTRA[model]
    return InputError(
        f"{row.words}, not a surface that can be shaded",
        field=material_id or "model",
        found=model,
        expected="a material with a BRDF",
        hint=row.use,
    )


def model_named(name: str, file: Path | None = None, field: str | None = "model") -> type[AnalyticBrdf]:
    """Return the analytic model of that NAME; raises `UnknownNameError` if this version has none."""
    from ..analytic import MODELS

    models = {model.NAME: model for model in MODELS}
    if name not in models:
        raise UnknownNameError("model", name, models, file=file, field=field)
    return models[name]


def rebuild(model: str, parameters: Mapping[str, Any]) -> Surface:
    """Rebuild the original from a record's `model` and `parameters`; InputError for a spectrum without a surface."""
    if model in SPECTRA:
        raise no_surface(model)
    row = MEASURED.get(model)
    if not (row and row.reads_files):
        read = {name: np.asarray(value) for name, value in parameters.items() if isinstance(value, StoredArray)}
        parameters = {**parameters, **read}
    if row:
        module = importlib.import_module(f"..{row.module}", __package__)
        return getattr(module, row.name).from_parameters(parameters)
    rest = dict(parameters)
    return model_named(model).from_parameters(rest.pop("wavelengths_nm"), rest)
