"""A material on the sphere of `protocol` under several lights, from its packs or from its original data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ...spectral.observers import Observer
from ...spectral.spectrum import Spectrum
from ..fluorescent import FluorescentBrdf
from ..protocol import SphereProtocol
from .material import MaterialRecord

_BLOCK = 8192


def packs_xyz(
    record: MaterialRecord, sphere: SphereProtocol, lights: Sequence[Spectrum], eye: Observer
) -> Float[np.ndarray, "lights N 3"]:
    """XYZ of every sample under each light, from the packs; Y of the perfect diffuser facing the light is 1."""
    xyz = np.zeros((len(lights), len(sphere.wi), 3))
    for pack in record.packs:
        geometry = pack.geometry_at(sphere.angles[pack.frame, pack.anisotropic])
        for seen, light in zip(xyz, lights, strict=True):
            seen += np.pi * geometry @ pack.fold(light, eye)
    return xyz


def original_xyz(
    record: MaterialRecord, sphere: SphereProtocol, lights: Sequence[Spectrum], eye: Observer
) -> Float[np.ndarray, "lights N 3"]:
    """The same from the original BRDF, at every wavelength of its own."""
    brdf = record.brdf()
    weights = np.stack([np.pi * eye.weights(light, brdf.wavelengths_nm).T for light in lights])
    xyz = np.empty((len(lights), len(sphere.wi), 3))
    for start in range(0, len(sphere.wi), _BLOCK):
        rows = slice(start, start + _BLOCK)
        values = brdf.eval(sphere.wi[rows], sphere.wo[rows]) * sphere.wi[rows, 2:]
        xyz[:, rows] = values @ weights
    if isinstance(brdf, FluorescentBrdf):
        nm, cosine = eye.wavelengths_nm, sphere.wi[:, 2]
        spread = np.pi * cosine * brdf.emission_factor(sphere.wi, sphere.wo)
        for seen, light in zip(xyz, lights, strict=True):
            emitted = brdf.bispectral.emission(light, nm)[:, None] * eye.cmfs
            seen += spread[:, None] * np.trapezoid(emitted, nm, axis=0) / eye.luminous(light)
    return xyz
