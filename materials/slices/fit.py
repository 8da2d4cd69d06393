"""Fit of slices to any uniform surface: the mixture of each viewer is initialised by its neighbour's."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np
from jaxtyping import Float

from ...spectral.basis import SpectralBasis
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.palette import Palette
from ...spectral.projection import projection_matrix
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM, is_finer
from ..core.brdf import Brdf
from ..core.environment_form import BENDS, bends
from ..core.points import Points
from ..core.protocol import LIGHTS
from ..core.surface import Surface
from .error import references, with_error
from .mixture import Mixture
from .nearest import Wanted
from .quadrature import BLOCK, PLAIN, STRETCHED, Grids, slice_directions
from .view_slices import ViewSlices, polar_angles

#: Gaussians a slice, at most: more are slower and hardly better.
LOBES = 12
#: Numbers of Gaussians that are tried; 0 is for matt surfaces.
COUNTS = (4, 8, LOBES)
# Allowed 99th percentile over the mean, as for the highlights of a fit; and the error that more Gaussians have to come
# below, relative to that of fewer.
_HIGHLIGHTS, _WORTH = 4.0, 0.9
# Viewers of isotropic materials, and of others, by polar angle and azimuth.
_POLAR, _TURNED = 24, (16, 16)
# Rounds of the first slice, and of each that starts as its neighbour; and steps, at most, that bring both nearer.
_FIRST_ROUNDS, _ROUNDS = 60, 3
_FIRST_STEPS, _STEPS = 60, 6
# Power of the slice by which Gaussians are placed, since tails show beside a sun.
_TEMPER = 0.9
# Share of the whole below which a direction does not move a Gaussian.
_COUNTS = 1.0e-6
# Difference of mean logarithms of densities, that rounding does not decide.
_CLEARLY = 0.01
# Share of a slice's luminance that its terms may be off in all, under any of the five lights.
_OFF = 1.0e-3
# Numbers that differ by less, of the largest, are equal but for rounding.
_ROUNDING = 1.0e-9
# theta_o and azimuth of those who look whether a surface is matt, radians.
_LOOKS = ((0.0, 0.0), (0.7, 1.0), (1.1, 2.9), (1.5, 4.4))

#: f_r in C numbers: of wi (S,3), wo (S,3).
Sampled = Callable[[np.ndarray, np.ndarray], Float[np.ndarray, "S C"]]
#: A slice, as `_slice` gives it, by theta_o and azimuth of its viewer.
SliceAt = Callable[[float, float], tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]]

# Rounds of reweighting of a slice's smooth part, and the share of its median that counts as far above.
_SMOOTH_ROUNDS, _FAR = 8, 0.02
# Share of a polynomial's mean square that holds those that the directions do not tell apart.
_RIDGE = 1.0e-9


def view_slices(surface: Surface, lobes: int = LOBES) -> ViewSlices:
    """Fit the environment form of a uniform surface.

    It has as few spectral terms as keep each slice within a thousandth of its luminance under `protocol.LIGHTS`, at the
    working wavelengths if the surface's are finer. A matt surface has no Gaussians, whatever `lobes` is.
    """
    return _formed(surface, lobes, _slices(surface))


def fewest_slices(surface: Surface, budget: float) -> ViewSlices:
    """Fit `view_slices` with as few Gaussians, of `COUNTS`, as keep its error within the budget, and attach the error.

    The mean of ΔE94 must be within the budget, and its 99th percentile within four times as much. The search ends early
    if the next number improves the error by less than a tenth. Anisotropic surfaces get the largest number untried,
    since trying would take too long.
    """
    slice_at = _slices(surface)
    reference = references(surface)
    if surface.isotropic:
        slice_at = cache(slice_at)
    best: tuple[float, ViewSlices] | None = None
    for lobes in COUNTS if surface.isotropic else COUNTS[-1:]:
        form = with_error(_formed(surface, lobes, slice_at), reference, surface.isotropic)
        assert form.error is not None
        score = max(form.error.mean, form.error.p99 / _HIGHLIGHTS)
        if best is not None and score > _WORTH * best[0]:
            break
        best = score, form
        if form.count == 0 or score <= budget:
            break
    assert best is not None
    return best[1]


def mixtures(
    sampled: Sampled, size: int, isotropic: bool, lobes: int = LOBES
) -> tuple[Float[np.ndarray, "T A Q 3"], Float[np.ndarray, "T A Q"], Float[np.ndarray, "T A QB C"]]:
    """Fit directions, sharpness and values of slices (`ViewSlices`) to f_r in `size` numbers, evaluated by `sampled`.

    Each slice is integrated over `slice_directions`. The bent cosine takes its `smooth_part`, polynomials of the second
    degree. For the remainder, by the mean magnitude of its numbers, Gaussians are placed by expectation-maximisation,
    and refined by least squares of the visible difference (`nearest`), in which the numbers' magnitude is their
    brightness: they should be scaled accordingly. The integral of a slice is exact, whatever the Gaussians.
    """
    return _mixtures(partial(_slice, sampled, None, _grids(isotropic)), size, isotropic, lobes)


def _grids(isotropic: bool) -> Grids:
    return PLAIN if isotropic else STRETCHED


def _slices(surface: Surface) -> SliceAt:
    """Make the slices of a surface, with its body apart if it has lobes in both kinds of angles.

    On a body in incident and outgoing angles Gaussians would follow the residual of the polynomials, and be missing at
    the highlight.
    """
    lobes = surface.lobes() if isinstance(surface, Brdf) else ()
    bodies = [lobe.brdf for lobe in lobes if lobe.frame == "io"]
    body = _sampled(bodies[0]) if len(bodies) == 1 < len(lobes) else None
    return partial(_slice, _sampled(surface), body, _grids(surface.isotropic))


def _sampled(surface: Surface) -> Sampled:
    def sampled(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        rows = (slice(start, start + BLOCK) for start in range(0, len(wi), BLOCK))
        return np.concatenate([surface.at(Points(wi[some], wo[some])) for some in rows])

    return sampled


def _formed(surface: Surface, lobes: int, slice_at: SliceAt) -> ViewSlices:
    nm = surface.wavelengths_nm
    directions, sharpness, spectra = _mixtures(slice_at, nm.size, surface.isotropic, lobes)
    if is_finer(nm, WORKING_WAVELENGTHS_NM):
        spectra, nm = spectra @ projection_matrix(nm, WORKING_WAVELENGTHS_NM).T, WORKING_WAVELENGTHS_NM
    return ViewSlices(directions, sharpness, *_in_few(spectra, nm)).in_single_precision()


def _mixtures(
    slice_at: SliceAt, size: int, isotropic: bool, lobes: int
) -> tuple[Float[np.ndarray, "T A Q 3"], Float[np.ndarray, "T A Q"], Float[np.ndarray, "T A QB C"]]:
    matt = _matt(slice_at)
    if matt is not None:
        even = np.zeros((2, 1, BENDS, size))
        even[:, :, 0] = np.pi * matt
        return np.empty((2, 1, 0, 3)), np.empty((2, 1, 0)), even
    polar = polar_angles(_POLAR if isotropic else _TURNED[0])
    azimuths = 2.0 * np.pi * np.arange(1 if isotropic else _TURNED[1]) / _TURNED[1]
    shape = (len(polar), len(azimuths))
    directions, sharpness = np.empty((*shape, lobes, 3)), np.empty((*shape, lobes))
    spectra = np.empty((*shape, lobes + BENDS, size))
    for a, azimuth in enumerate(azimuths):
        mixture: Mixture | None = None
        for t, theta in enumerate(polar):
            to, angles, values, body = slice_at(float(theta), float(azimuth))
            there = _magnitude(values) * to[:, 2]
            if body is not None:
                values = values - body
            smooth = smooth_part(to, angles, values)
            values = (values - bends(to) @ smooth) * to[:, 2:]
            if body is not None:
                smooth = smooth + body_part(to, angles, body)
            density = _magnitude(values)
            power = density * angles
            drawn = density**_TEMPER * angles
            counts = drawn > _COUNTS * drawn.sum()
            if mixture is None:
                mixture = _first(to, power, lobes)
            else:
                mixture = _begun(mixture, theta - polar[t - 1], azimuth, to[counts], drawn[counts])
            found = np.zeros((lobes + 1, size))
            if counts.any():
                mixture = mixture.refined(to[counts], drawn[counts], _ROUNDS if t else _FIRST_ROUNDS)
                wanted = Wanted.of(to, angles, _mean(values), there)
                mixture = wanted.nearest(mixture, _STEPS if t else _FIRST_STEPS)
                found = wanted.spectra(mixture, values)
            directions[t, a], sharpness[t, a] = mixture.axes, mixture.sharpness
            spectra[t, a, :lobes], spectra[t, a, lobes:] = found[:-1], np.pi * smooth
            spectra[t, a, lobes] += found[-1]
    return directions, sharpness, spectra


def _slice(
    sampled: Sampled, body: Sampled | None, grids: Grids, theta: float, azimuth: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]:
    """Evaluate a viewer's slice: directions (S,3), their solid angles (S,), f_r (S,C), and the body's part of it."""
    wo = np.array([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)])
    to, angles = slice_directions(wo, grids)
    seen = np.broadcast_to(wo, to.shape)
    return to, angles, sampled(to, seen), None if body is None else body(to, seen)


def _matt(slice_at: SliceAt) -> Float[np.ndarray, " C"] | None:
    """Return f_r if it is constant over all directions of four slices; else None."""
    least = most = slice_at(*_LOOKS[0])[2][0]
    for look in _LOOKS:
        values = slice_at(*look)[2]
        least, most = np.minimum(least, values.min(axis=0)), np.maximum(most, values.max(axis=0))
        if np.any(most - least > _ROUNDING * np.maximum(np.abs(most), np.abs(least)).max()):
            return None
    return 0.5 * (least + most)


def _magnitude(values: Float[np.ndarray, "S C"]) -> Float[np.ndarray, " S"]:
    """Average the magnitudes in each row; without a copy if none is negative."""
    return _mean(np.abs(values) if values.min() < 0.0 else values)


def _mean(values: Float[np.ndarray, "S C"]) -> Float[np.ndarray, " S"]:
    """Average each row; faster than numpy's."""
    return values @ np.full(values.shape[1], 1.0 / values.shape[1])


def _in_few(
    spectra: Float[np.ndarray, "T A QB L"], wavelengths_nm: Float[np.ndarray, " L"]
) -> tuple[Float[np.ndarray, "T A QB R"], Palette]:
    """Project spectra onto the fewest terms within tolerance; return values and palette."""
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
    """Initialise the mixture of the first viewer, straight above.

    Axes lie on a spiral about the normal at quantiles of the power, sharper towards the normal.
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


def _begun(
    before: Mixture,
    angle: float,
    azimuth: float,
    to: Float[np.ndarray, "S 3"],
    power: Float[np.ndarray, " S"],
) -> Mixture:
    """Initialise a slice's mixture from that of the previous viewer, rotated with the mirror direction.

    It is rotated with the viewer instead if that is clearly more likely, as for retroreflection.
    """
    mirrored, back = (before.turned(_turn(one, azimuth)) for one in (angle, -angle))
    if len(power) and back.likelihood(to, power) > mirrored.likelihood(to, power) + _CLEARLY:
        return back
    return mirrored


def _turn(angle: float, azimuth: float) -> Float[np.ndarray, "3 3"]:
    """Rotate the mirror direction of a viewer towards that of the next, in the viewer's plane."""
    axis = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * cross.T + (1.0 - np.cos(angle)) * (cross.T @ cross.T)


def smooth_part(
    directions: Float[np.ndarray, "S 3"], angles: Float[np.ndarray, " S"], f_r: Float[np.ndarray, "S C"]
) -> Float[np.ndarray, "9 C"]:
    """Fit coefficients of `bends` to f_r robustly: highlights, which rise above the fit, have little weight.

    Weighted by solid angle and cosine; by iteratively reweighted least squares on the mean over C, whose last weights
    serve each of the C numbers. A slice that is a polynomial is reproduced exactly. If half of all directions reflect
    nothing the result is 0.
    """
    basis = bends(directions)
    seen = angles * directions[:, 2]
    mean = f_r.mean(axis=1)
    order = np.argsort(mean, kind="stable")
    within = np.cumsum(seen[order])
    median = mean[order[np.searchsorted(within, 0.5 * within[-1])]]
    scale = _FAR * abs(median)
    if scale == 0.0:
        return np.zeros((basis.shape[1], f_r.shape[1]))
    off = mean - median
    weight = seen
    for _ in range(_SMOOTH_ROUNDS):
        # A highlight that is too far above for its square to be a number counts for nothing, as it should.
        with np.errstate(over="ignore"):
            weight = seen / (1.0 + (np.maximum(off, 0.0) / scale) ** 2) ** 2
        off = mean - basis @ _solved(basis, weight, mean[:, None])[:, 0]
    return _solved(basis, weight, f_r)


def body_part(
    directions: Float[np.ndarray, "S 3"], angles: Float[np.ndarray, " S"], f_r: Float[np.ndarray, "S C"]
) -> Float[np.ndarray, "9 C"]:
    """Fit coefficients of `bends` to f_r without a highlight."""
    return _solved(bends(directions), angles * directions[:, 2], f_r)


def _solved(
    basis: Float[np.ndarray, "S 9"], weight: Float[np.ndarray, " S"], values: Float[np.ndarray, "S C"]
) -> Float[np.ndarray, "9 C"]:
    """Solve weighted least squares."""
    weighted = basis * weight[:, None]
    normal = weighted.T @ basis
    return np.linalg.solve(normal + _RIDGE * np.diag(np.diag(normal)), weighted.T @ values)
