"""From any uniform surface to its slices: every viewer's mixture starts as its neighbour's ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from ...spectral.basis import SpectralBasis
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.palette import Palette
from ..environment_form import BENDS, bends
from ..points import Points
from ..protocol import LIGHTS
from ..surface import Surface
from .mixture import Mixture
from .quadrature import slice_directions
from .smooth import smooth_part
from .view_slices import ViewSlices, polar_angles

#: Gaussians a slice: more are slower and hardly better (docs/environment.md has the table).
LOBES = 12
# Viewers of isotropic materials, and of others by polar angle and azimuth.
_POLAR, _TURNED = 32, (16, 16)
# Rounds of the first slice, and of each that starts as its neighbour.
_FIRST_ROUNDS, _ROUNDS = 150, 30
# Gaussians are placed by this power of what comes from a direction, since tails show beside a sun: 1 has a third more
# of error.
_TEMPER = 0.8
_SHARING_ROUNDS = 15
# Share of a slice's luminance that its terms may be off in all, under any of the five lights.
_OFF = 1.0e-3


def view_slices(surface: Surface, lobes: int = LOBES) -> ViewSlices:
    """The environment form of a surface that is alike everywhere, its spectra in as few terms as keep each slice within
    a thousandth of its luminance under `protocol.LIGHTS`.
    """

    def sampled(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return surface.at(Points(wi, wo)) * wi[:, 2:]

    directions, sharpness, spectra = mixtures(sampled, surface.wavelengths_nm.size, surface.isotropic, lobes)
    return ViewSlices(directions, sharpness, *_in_few(spectra, surface.wavelengths_nm))


def mixtures(
    terms: Callable[[np.ndarray, np.ndarray], Float[np.ndarray, "S C"]], size: int, isotropic: bool, lobes: int = LOBES
) -> tuple[Float[np.ndarray, "T A Q 3"], Float[np.ndarray, "T A Q"], Float[np.ndarray, "T A Q1 C"]]:
    """Directions, sharpness and values of slices (`ViewSlices`) of whatever `terms` (wi (S,3), wo (S,3)) gives: f_r
    cos(theta_i) in `size` numbers.

    Each slice is integrated over `slice_directions`. What comes from each direction, the mean of its numbers'
    magnitudes, is shared between Gaussians and cosine by expectation and maximisation, and the numbers with it: so the
    integral of a slice is exact, whatever the Gaussians do.
    """
    polar = polar_angles(_POLAR if isotropic else _TURNED[0])
    azimuths = 2.0 * np.pi * np.arange(1 if isotropic else _TURNED[1]) / _TURNED[1]
    shape = (len(polar), len(azimuths))
    directions, sharpness = np.empty((*shape, lobes, 3)), np.empty((*shape, lobes))
    spectra = np.empty((*shape, lobes + BENDS, size))
    for a, azimuth in enumerate(azimuths):
        mixture: Mixture | None = None
        for t, theta in enumerate(polar):
            wo = np.array([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)])
            to, angles = slice_directions(wo)
            density = terms(to, np.broadcast_to(wo, to.shape))
            smooth = smooth_part(to, angles, density / to[:, 2:])
            density = density - (bends(to) @ smooth) * to[:, 2:]
            sent = density * angles[:, None]
            density = np.abs(density).mean(axis=1)
            power = density * angles
            if mixture is None:
                mixture = _first(to, power, lobes)
            else:
                mixture = mixture.turned(_turn(theta - polar[t - 1], azimuth))
            if power.sum() > 0.0:
                mixture = mixture.refined(to, density**_TEMPER * angles, _ROUNDS if t else _FIRST_ROUNDS)
                mixture = mixture.shared(to, power, _SHARING_ROUNDS)
            directions[t, a], sharpness[t, a] = mixture.axes, mixture.sharpness
            found = mixture.responsibilities(to).T @ sent
            spectra[t, a, :lobes], spectra[t, a, lobes:] = found[:-1], np.pi * smooth
            spectra[t, a, lobes] += found[-1]
    return directions, sharpness, spectra


def _in_few(
    spectra: Float[np.ndarray, "T A Q1 L"], wavelengths_nm: Float[np.ndarray, " L"]
) -> tuple[Float[np.ndarray, "T A Q1 R"], Palette]:
    """Spectra in as few terms as do, and their palette."""
    rows = spectra.reshape(-1, len(wavelengths_nm))
    weights = Folding(observer("1931_2"), [illuminant(name) for name in LIGHTS]).weights(wavelengths_nm)
    full = SpectralBasis.balanced(rows, weights, wavelengths_nm=wavelengths_nm)
    truth = spectra @ weights
    whole = np.abs(truth.sum(axis=2, keepdims=True))
    allowed = _OFF * np.maximum(whole, _OFF * whole.max())

    def within(size: int) -> bool:
        basis = full.truncated(size)
        off = np.abs((rows @ basis.analysis) @ (basis.synthesis.T @ weights) - rows @ weights).reshape(truth.shape)
        return bool((off.sum(axis=2, keepdims=True) <= allowed).all())

    basis = full.truncated(next((size for size in range(1, full.size) if within(size)), full.size))
    value = (rows @ basis.analysis).reshape(*spectra.shape[:3], -1)
    return value, Palette.of(basis.synthesis.T, SpectralBasis.sampled(wavelengths_nm))


def _first(to: Float[np.ndarray, "S 3"], power: Float[np.ndarray, " S"], lobes: int) -> Mixture:
    """Where the first viewer, straight above, has to begin: on a spiral about the normal by what lies within, the
    sharper the closer.
    """
    order = np.argsort(-to[:, 2], kind="stable")
    within = np.cumsum(power[order])
    total = within[-1]
    shares = (np.arange(lobes) + 0.5) / lobes
    # A black slice is as wide as a white one.
    within = within / total if total > 0.0 else np.linspace(0.0, 1.0, len(order))
    tilt = np.arccos(np.clip(to[order, 2], -1.0, 1.0))
    at = np.maximum(np.interp(shares, within, tilt), 1e-5)
    turn = np.arange(lobes) * np.pi * (3.0 - np.sqrt(5.0))
    near = 0.5 * at
    axes = np.stack([np.sin(near) * np.cos(turn), np.sin(near) * np.sin(turn), np.cos(near)], axis=1)
    return Mixture(axes, 2.0 / at**2, np.full(lobes + 1, max(total, 1e-300) / (lobes + 1)))


def _turn(angle: float, azimuth: float) -> Float[np.ndarray, "3 3"]:
    """Turns the mirror direction of a viewer towards that of the next, in the viewer's plane."""
    axis = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * cross.T + (1.0 - np.cos(angle)) * (cross.T @ cross.T)
