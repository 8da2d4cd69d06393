"""Any BRDF as a table in the layout of the RGL data base (`formats.rgl`), for renderers that read it.

The layout permits any warp of the unit square and any divisor of the values before they are interpolated. Here the
square is not warped (the density of visible normals is constant), so that a node is a half vector of polar angle pi/2
x^2; and the divisor is the material's own peak about the normal, tabulated far finer. The quotient is smooth, and
continued with its sign below the horizon, so that linear interpolation crosses zero there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ..core.brdf import Brdf
from ..core.directions import TAU, io_from_half_difference, spherical

# Last polar angle of the light: beyond, f_r over its cosine is meaningless.
_LAST_LIGHT = np.radians(89.9)
# Height above the horizon of the values that continue below it.
_ABOVE = 1e-3
# Pairs of directions at which the surface's two mirror planes are tested.
_ASKED = 256


@dataclass(frozen=True)
class _Grid:
    """Azimuths and number of polar angles of the light; nodes of the square, as many either way (Mitsuba wants that);
    azimuths and polar angles of the peak.
    """

    azimuths: tuple[float, ...]
    lights: int
    square: int
    peak: tuple[int, int]


_ISOTROPIC = _Grid((0.0,), 32, 69, (2, 1024))
# A quarter turn, where Mitsuba looks for it; mirrors make up the rest.
_MIRRORED = _Grid(tuple(np.linspace(-np.pi, -0.5 * np.pi, 9).tolist()), 16, 45, (181, 384))


def rgl_fields(brdf: Brdf, description: str = "") -> dict[str, np.ndarray]:
    """Return the fields of a spectral file.

    Raises
    ------
    InputError
        A fluorescent surface, or an anisotropic one without mirror planes through x and y.
    """
    grid = _grid(brdf)
    luminous = observer("1931_2").weights(illuminant("D65"), brdf.wavelengths_nm)[1]
    # Finer towards grazing, where a Fresnel term climbs.
    theta_i = _LAST_LIGHT * (1.0 - (1.0 - np.linspace(0.0, 1.0, grid.lights)) ** 1.5)
    x = y = np.linspace(0.0, 1.0, grid.square)
    half = spherical(0.5 * np.pi * x[None, :] ** 2, TAU * (y[:, None] - 0.5))
    peak = _peak(brdf, grid)
    divided = _between(peak, grid.square)
    shape = (len(grid.azimuths), grid.lights)
    spectra = np.empty((*shape, len(brdf.wavelengths_nm), *divided.shape), dtype=np.float32)
    luminance = np.empty((*shape, *divided.shape), dtype=np.float32)
    # Area of the square over solid angle of the half vector, times that of the mirrored direction.
    stretched = np.sin(0.5 * np.pi * x**2) * 2.0 * np.pi**2 * x
    for place in np.ndindex(shape):
        wi = spherical(theta_i[place[1]], grid.azimuths[place[0]])
        cosine = half @ wi
        wo = 2.0 * cosine[..., None] * half - wi
        seen = wo.copy()
        seen[..., 2] = np.maximum(seen[..., 2], _ABOVE)
        seen /= np.linalg.norm(seen, axis=-1, keepdims=True)
        values = brdf.eval(wi, seen) * np.maximum(wo[..., 2], -0.5)[..., None] / divided[..., None]
        spectra[place] = np.moveaxis(values, -1, 0)
        light = np.maximum(values @ luminous, 0.0) * divided * np.maximum(cosine, 0.0) * stretched
        # Nowhere zero: every direction can be drawn, whatever is interpolated between nodes.
        luminance[place] = light + 1e-3 * light.mean() + 1e-12
    single = np.float32
    return {
        "phi_i": np.array(grid.azimuths, single),
        "theta_i": theta_i.astype(single),
        "ndf": peak.astype(single),
        "sigma": np.full((2, 2), 0.25, single),
        "vndf": np.ones((*shape, 2, 2), single),
        "luminance": luminance,
        "spectra": spectra,
        "wavelengths": brdf.wavelengths_nm.astype(single),
        "jacobian": np.ones(1, np.uint8),
        "description": np.frombuffer(description.encode() or b" ", dtype=np.uint8),
    }


def _grid(brdf: Brdf) -> _Grid:
    fluorescent = brdf.bispectral is not None
    if fluorescent or not (brdf.isotropic or _mirrored(brdf)):
        raise InputError(
            f"{'a fluorescent surface' if fluorescent else 'a surface without mirror planes'} has no table",
            field="brdf",
            found=type(brdf).__name__,
            expected="a reflectance that is isotropic, or the same mirrored in x and in y",
            hint="export its spectrum: --format exr, cxf or csv",
        )
    return _ISOTROPIC if brdf.isotropic else _MIRRORED


def _mirrored(brdf: Brdf) -> bool:
    """Return whether mirroring both directions in x, or in y, changes nothing on a sample of pairs."""
    rng = np.random.default_rng(0)
    wi, wo = (spherical(np.arccos(rng.uniform(0.1, 1.0, _ASKED)), rng.uniform(0.0, TAU, _ASKED)) for _ in "io")
    unturned = brdf.eval(wi, wo)
    turns = (np.array([-1.0, 1.0, 1.0]), np.array([1.0, -1.0, 1.0]))
    return all(np.allclose(brdf.eval(wi * turn, wo * turn), unturned, rtol=1e-6, atol=1e-9) for turn in turns)


def _peak(brdf: Brdf, grid: _Grid) -> Float[np.ndarray, "A B"]:
    """Tabulate f_r over the half vector, averaged over wavelengths and over small difference angles; never near 0."""
    count, polar = grid.peak
    theta_h, phi_h = np.broadcast_arrays(
        0.5 * np.pi * np.linspace(0.0, 1.0, polar) ** 2, TAU * (np.linspace(0.0, 1.0, count)[:, None] - 0.5)
    )
    out = np.zeros(grid.peak)
    for theta_d in np.radians([2.0, 20.0, 40.0]):
        wi, wo = io_from_half_difference(theta_h, theta_d, 0.5 * np.pi, phi_h)
        known = (wi[..., 2] > 0.02) & (wo[..., 2] > 0.02)
        lines = np.maximum(brdf.eval(wi, wo).mean(axis=-1), 0.0)
        last = polar - 1 - np.argmax(known[:, ::-1], axis=1)
        out += np.where(known, lines, np.take_along_axis(lines, last[:, None], axis=1))
    return out + 0.02 * out.mean() + 1e-6


def _between(peak: Float[np.ndarray, "A B"], size: int) -> Float[np.ndarray, "N N"]:
    """Interpolate the peak at the nodes of the square, linear between its own, as a renderer does."""
    at = np.linspace(0.0, 1.0, size)
    along = np.stack([np.interp(at, np.linspace(0.0, 1.0, peak.shape[1]), line) for line in peak])
    return np.stack([np.interp(at, np.linspace(0.0, 1.0, peak.shape[0]), column) for column in along.T], axis=1)
