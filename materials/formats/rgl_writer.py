"""Writes a BRDF as a measured material of the RGL data base, which Mitsuba 3 renders as its plugin `measured`.

The layout leaves free how the unit square is warped and what is divided out of the values before they are interpolated.
Here the square is not warped (the density of visible normals is constant), so that a node is a half vector of polar
angle pi/2 x^2; and what is divided out is the material's own peak about the normal, tabulated ten times finer. What is
left is smooth, and continued with its sign below the horizon, so that linear interpolation crosses zero there.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...spectral.errors import InputError
from ...spectral.files import written_whole
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.upsampling import xyz_from_rgb
from ..brdf import Brdf
from ..directions import TAU, io_from_half_difference, spherical
from ..fluorescent import FluorescentBrdf
from .rgl import MAGIC

# Nodes: polar angle of the light; azimuth and polar angle of the half vector (Mitsuba wants as many of one as of the
# other); and of the peak that is divided out.
_LIGHTS, _AZIMUTHS, _POLAR, _PEAK = 32, 69, 69, 1024
# Beyond, f_r over the light's cosine says nothing any more.
_LAST_LIGHT = np.radians(89.9)
# What continues a value below the horizon is taken this far above it.
_ABOVE = 1e-3
_TYPES = {
    "|u1": 1,
    "|i1": 2,
    "<u2": 3,
    "<i2": 4,
    "<u4": 5,
    "<i4": 6,
    "<u8": 7,
    "<i8": 8,
    "<f2": 9,
    "<f4": 10,
    "<f8": 11,
}


def check_tabulated(brdf: Brdf) -> None:
    """Raise an `InputError` for what is not tabulated here: anisotropic and fluorescent surfaces."""
    if isinstance(brdf, FluorescentBrdf) or not brdf.isotropic:
        kind = "an anisotropic" if not brdf.isotropic else "a fluorescent"
        raise InputError(
            f"{kind} model is not tabulated for other renderers",
            field="brdf",
            found=type(brdf).__name__,
            expected="an isotropic reflectance",
            hint="export its spectrum: --format exr, cxf or csv",
        )


def rgl_fields(brdf: Brdf, description: str = "") -> dict[str, np.ndarray]:
    """The fields of a spectral file, with RGB beside them for renderers without spectra.

    Raises
    ------
    InputError
        As `check_tabulated` does.
    """
    check_tabulated(brdf)
    folded = np.linalg.solve(xyz_from_rgb(), observer("1931_2").weights(illuminant("D65"), brdf.wavelengths_nm)).T
    # Finer towards grazing, where a Fresnel term climbs.
    theta_i = _LAST_LIGHT * (1.0 - (1.0 - np.linspace(0.0, 1.0, _LIGHTS)) ** 1.5)
    x, y = np.linspace(0.0, 1.0, _POLAR), np.linspace(0.0, 1.0, _AZIMUTHS)
    half = spherical(0.5 * np.pi * x[None, :] ** 2, TAU * (y[:, None] - 0.5))
    peak = _peak(brdf, np.linspace(0.0, 1.0, _PEAK) ** 2 * 0.5 * np.pi)
    divided = np.interp(x, np.linspace(0.0, 1.0, _PEAK), peak)
    spectra = np.empty((1, _LIGHTS, len(brdf.wavelengths_nm), _AZIMUTHS, _POLAR), dtype=np.float32)
    rgb = np.empty((1, _LIGHTS, 3, _AZIMUTHS, _POLAR), dtype=np.float32)
    luminance = np.empty((1, _LIGHTS, _AZIMUTHS, _POLAR), dtype=np.float32)
    # Area of the square over solid angle of the half vector, times that of the mirrored direction.
    stretched = np.sin(0.5 * np.pi * x**2) * 2.0 * np.pi**2 * x
    for place, theta in enumerate(theta_i):
        wi = spherical(theta, 0.0)
        cosine = half @ wi
        wo = 2.0 * cosine[..., None] * half - wi
        seen = wo.copy()
        seen[..., 2] = np.maximum(seen[..., 2], _ABOVE)
        seen /= np.linalg.norm(seen, axis=-1, keepdims=True)
        values = brdf.eval(wi, seen) * np.maximum(wo[..., 2], -0.5)[..., None] / divided[:, None]
        coloured = values @ folded
        spectra[0, place] = np.moveaxis(values, -1, 0)
        rgb[0, place] = np.moveaxis(coloured, -1, 0)
        light = np.maximum(coloured @ xyz_from_rgb()[1], 0.0) * divided * np.maximum(cosine, 0.0) * stretched
        # Nowhere zero: every direction can be drawn, whatever is interpolated between nodes.
        luminance[0, place] = light + 1e-3 * light.mean() + 1e-12
    single = np.float32
    return {
        "phi_i": np.zeros(1, single),
        "theta_i": theta_i.astype(single),
        "ndf": np.broadcast_to(peak, (2, _PEAK)).astype(single),
        "sigma": np.full((2, 2), 0.25, single),
        "vndf": np.ones((1, _LIGHTS, 2, 2), single),
        "luminance": luminance,
        "rgb": rgb,
        "spectra": spectra,
        "wavelengths": brdf.wavelengths_nm.astype(single),
        "jacobian": np.ones(1, np.uint8),
        "description": np.frombuffer(description.encode() or b" ", dtype=np.uint8),
    }


def _peak(brdf: Brdf, theta_h: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """What f_r does over the half angle, averaged over wavelengths and over small difference angles; never near 0."""
    out = np.zeros_like(theta_h)
    for theta_d in np.radians([2.0, 20.0, 40.0]):
        wi, wo = io_from_half_difference(theta_h, np.full_like(theta_h, theta_d), np.full_like(theta_h, 0.5 * np.pi))
        known = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
        line = np.maximum(brdf.eval(wi, wo).mean(axis=1), 0.0)
        last = int(np.flatnonzero(known)[-1])
        out += np.where(known, line, line[last])
    return out + 0.02 * out.mean() + 1e-6


def write_tensors(path: str | Path, fields: Mapping[str, np.ndarray]) -> None:
    """Write arrays of numbers as a `tensor_file` container, as `read_tensors` reads it."""
    arrays = {name: np.ascontiguousarray(field) for name, field in fields.items()}
    for name, array in arrays.items():
        if array.dtype.newbyteorder("<").str not in _TYPES:
            raise InputError("cannot be stored", file=path, field=name, found=array.dtype, expected="numbers")
    names = {name: name.encode() for name in arrays}
    offset = len(MAGIC) + 6 + sum(13 + len(names[name]) + 8 * array.ndim for name, array in arrays.items())
    header = MAGIC + struct.pack("<BBI", 1, 0, len(arrays))
    body = []
    for name, array in arrays.items():
        gap = -offset % 8
        body.append(b"\0" * gap)
        offset += gap
        kind = _TYPES[array.dtype.newbyteorder("<").str]
        header += struct.pack("<H", len(names[name])) + names[name] + struct.pack("<HBQ", array.ndim, kind, offset)
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        body.append(array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes())
        offset += array.nbytes
    with written_whole(path) as beside, beside.open("wb") as file:
        file.write(header)
        file.writelines(body)
