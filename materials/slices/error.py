"""Error of environment forms: the difference of a sphere's appearance in an environment, in ΔE94.

A unit sphere is seen from afar, in the environment of `sky`. Its points cover equal areas of the picture: for isotropic
materials 12 rings of 24 points, for others 8 rings of 16, each ring in the middle of its share of the disc; the tangent
x of the surface points along the parallels of an upright sphere. The white is the perfect diffuser that faces straight
up, unshadowed; nothing is clipped.

The reference is the original at every wavelength, f_r cos(theta_i) times luminance summed over some 3000 directions per
point: half vectors in octaves about the normal and an even grid beyond (`quadrature`). Sunlight beyond `_SUN_FADE` of
the half vector's angle is summed over directions about the sun instead. Nothing occludes the environment; points see it
down to their own horizon.

The sample is the form: every lobe's value times the mean luminance under its Gaussian, not cut off by any horizon, and
the cosine's times the illuminance over pi.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ...spectral.difference import delta_e_xyz
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ..core.environment_form import BENDS, bends
from ..core.fit_error import FitError, LightError
from ..core.points import Points
from ..core.protocol import LIGHTS
from ..core.surface import Surface
from . import sky
from .quadrature import BLOCK, Grids, fading, half_angles, slice_directions
from .view_slices import ViewSlices

_OBSERVER = "1931_2"
# Rings, and points a ring.
_ISOTROPIC, _TURNED = (12, 24), (8, 16)
# Fine enough for the horizon's haze everywhere, and for the sun as far as it is summed here.
_GRIDS = Grids(fade=(0.12, 0.24), azimuths=32, even=(30, 60))
_SUN_FADE = (0.03, 0.08)
# Grid about the sun: radius in its standard deviations; numbers of distances and azimuths.
_SUN_ENDS, _SUN_GRID = 3.7, (6, 12)


def text_of(isotropic: bool) -> str:
    """Describe the measurement for a record or a report."""
    rings, around = _ISOTROPIC if isotropic else _TURNED
    return (
        f"sphere of {rings} x {around} points, orthographic, under a sky with haze over a ground of {sky.GROUND:g}, a "
        f"soft panel and a small sun; Y of a perfect diffuser facing up = 1, unclipped; reference = original BRDF at "
        f"every wavelength, observer {_OBSERVER}"
    )


def references(surface: Surface) -> Float[np.ndarray, "M N 3"]:
    """Compute XYZ of every point of the sphere from the surface at its own wavelengths, under each of `LIGHTS`."""
    found = []
    folding = _folding()
    for seen in _lit_slices(surface.isotropic, _GRIDS):
        sent = _sent(surface, seen.to, seen.wo, folding)
        beside = np.zeros((*seen.lit.shape, sent.shape[1]))
        beside[seen.lit] = _sent(surface, seen.beside, seen.wo, folding)
        found.append(seen.arriving @ sent + np.einsum("ns,nsm->nm", seen.rest, beside))
    return _by_light(np.concatenate(found))


def samples(form: ViewSlices, isotropic: bool) -> Float[np.ndarray, "M N 3"]:
    """Compute XYZ of every point of the sphere from the form, under each of `LIGHTS`."""
    wo, frames = _points(isotropic)
    # Viewers of isotropic forms stand above +x here, where the frame of slices is the point's.
    lobes = form.lobes(Points(wo, wo))
    world = np.einsum("nqj,njk->nqk", lobes.directions, frames)
    mean = sky.under_lobes(world.reshape(-1, 3), lobes.sharpness.reshape(-1)).reshape(lobes.sharpness.shape)
    terms = np.einsum("nq,nqr->nr", mean, lobes.value)
    terms += np.einsum("nb,nbr->nr", _moments(isotropic) / np.pi, lobes.matt)
    return _by_light(terms @ form.palette.folded(_folding())[0])


def error_between(
    references_xyz: Float[np.ndarray, "M N 3"], samples_xyz: Float[np.ndarray, "M N 3"], isotropic: bool
) -> FitError:
    """Compute statistics under each of `LIGHTS`; the overall figures are those of the light with the largest p99."""
    by_light = []
    for name, reference, sample in zip(LIGHTS, references_xyz, samples_xyz, strict=True):
        difference = delta_e_xyz(reference, sample, observer(_OBSERVER).white(illuminant(name)))
        p95, p99 = np.percentile(difference, [95, 99])
        by_light.append(LightError(name, float(difference.mean()), float(p95), float(p99), float(difference.max())))
    worst = max(by_light, key=lambda one: one.p99)
    figures = (worst.mean, worst.p95, worst.p99, worst.maximum, worst.light)
    return FitError(*figures, _OBSERVER, text_of(isotropic), 0.0, lights=tuple(by_light))


def with_error(form: ViewSlices, reference_xyz: Float[np.ndarray, "M N 3"], isotropic: bool) -> ViewSlices:
    """Return the form with its error against a surface's `references`."""
    return replace(form, error=error_between(reference_xyz, samples(form, isotropic), isotropic))


def measured_form(form: ViewSlices, surface: Surface) -> ViewSlices:
    """Return the form with its error against the surface that it approximates."""
    return with_error(form, references(surface), surface.isotropic)


class _LitSlice(NamedTuple):
    """Light on the points that share one slice, for any surface.

    wo (3,) : to the viewer. to (S,3) : directions of light; arriving (n,S) : luminance at n points times the solid
    angle. Of sunlight farther off the mirror direction: rest (n,R), the illuminance of each ray; lit (n,R), True for
    rays above the horizon; beside (K,3) : their directions.
    """

    wo: Float[np.ndarray, "3"]
    to: Float[np.ndarray, "S 3"]
    arriving: Float[np.ndarray, "n S"]
    rest: Float[np.ndarray, "n R"]
    lit: Bool[np.ndarray, "n R"]
    beside: Float[np.ndarray, "K 3"]


@lru_cache(maxsize=2)
def _lit_slices(isotropic: bool, grids: Grids) -> tuple[_LitSlice, ...]:
    return tuple(_lit_slice(wo, frames, grids) for wo, frames in _slices(isotropic))


def _lit_slice(wo: Float[np.ndarray, "3"], frames: Float[np.ndarray, "n 3 3"], grids: Grids) -> _LitSlice:
    to, angles = slice_directions(wo, grids)
    sun_share = fading(half_angles(to, wo), _SUN_FADE)
    rays, illuminance = _rays()
    local = np.einsum("sj,nkj->nsk", rays, frames)
    rest = illuminance * (1.0 - fading(half_angles(local.reshape(-1, 3), wo), _SUN_FADE).reshape(local.shape[:2]))
    lit = (local[..., 2] > 0.0) & (rest > 0.0)
    near = np.flatnonzero(sun_share)
    arriving = np.empty((len(frames), len(to)))
    for one, frame in zip(arriving, frames, strict=True):
        one[:] = sky.without_sun(to @ frame)
        one[near] += sun_share[near] * sky.sun().value(to[near] @ frame)
    return _LitSlice(wo, to, arriving * angles, rest, lit, local[lit])


@cache
def _moments(isotropic: bool) -> Float[np.ndarray, "N 9"]:
    """Compute the illuminance of each point by the environment, and its moments in the point's own axes."""
    _, frames = _points(isotropic)
    to, angles = slice_directions(np.array([0.0, 0.0, 1.0]), _GRIDS)
    rays, illuminance = _rays()
    found = np.empty((len(frames), BENDS))
    for one, frame in zip(found, frames, strict=True):
        local = rays @ frame.T
        sun = np.maximum(local[:, 2], 0.0) * illuminance
        one[:] = (sky.without_sun(to @ frame) * to[:, 2] * angles) @ bends(to) + sun @ bends(local)
    return found


def _sent(
    surface: Surface, to: Float[np.ndarray, "S 3"], wo: Float[np.ndarray, "3"], folding: Folding
) -> Float[np.ndarray, "S M3"]:
    each = (to[start : start + BLOCK] for start in range(0, max(len(to), 1), BLOCK))
    xyz = [surface.xyz(Points(some, np.broadcast_to(wo, some.shape)), folding) for some in each]
    return np.concatenate(xyz) * to[:, 2:]


def _by_light(xyz: Float[np.ndarray, "N M3"]) -> Float[np.ndarray, "M N 3"]:
    return np.ascontiguousarray(xyz.reshape(len(xyz), -1, 3).transpose(1, 0, 2))


@cache
def _folding() -> Folding:
    """Make the folding with the exposure: a diffuser facing up has Y = 1."""
    up = float(sky.on_normals(np.array([[0.0, 1.0, 0.0]]))[0])
    return Folding(observer(_OBSERVER), [illuminant(name) for name in LIGHTS], np.pi / up)


@cache
def _rays() -> tuple[np.ndarray, np.ndarray]:
    """Compute directions (S,3) within the sun, and the illuminance by each."""
    sun = sky.sun()
    distances, azimuths = _SUN_GRID
    nodes, weights = np.polynomial.legendre.leggauss(distances)
    width, (centre,) = float(_SUN_ENDS / np.sqrt(sun.sharpness[0])), sun.axis
    tilt = np.repeat(0.5 * width * (nodes + 1.0), azimuths)
    turn = np.tile(2.0 * np.pi * (np.arange(azimuths) + 0.5) / azimuths, distances)
    side = np.cross(centre, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    across = np.sin(tilt)[:, None] * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(centre, side))
    to = np.cos(tilt)[:, None] * centre + across
    angle = np.repeat(0.5 * width * weights, azimuths) * np.sin(tilt) * (2.0 * np.pi / azimuths)
    return to, angle * sun.value(to)


def _slices(isotropic: bool) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return each required slice: its viewer, and the frames (n,3,3) of the points that share it."""
    wo, frames = _points(isotropic)
    if not isotropic:
        return [(one, frame[None]) for one, frame in zip(wo, frames, strict=True)]
    rings, around = _ISOTROPIC
    return [(wo[ring * around], frames[ring * around : (ring + 1) * around]) for ring in range(rings)]


@cache
def _points(isotropic: bool) -> tuple[np.ndarray, np.ndarray]:
    """Compute viewers (N,3) in frames (N,3,3), whose rows are tangent, bitangent and normal in the world."""
    rings, around = _ISOTROPIC if isotropic else _TURNED
    sine = np.repeat(np.sqrt((np.arange(rings) + 0.5) / rings), around)
    cosine = np.sqrt(1.0 - sine**2)
    # Rings are turned against each other, by the golden section of a step.
    step = np.arange(rings)[:, None] * 0.6180339887498949 + np.arange(around)
    turn = (2.0 * np.pi / around * step).ravel()
    normal = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=1)
    viewer = np.array([0.0, 0.0, 1.0])
    if isotropic:
        # Any tangent will do: with that towards the viewer, a ring sees one slice.
        tangent = (viewer - cosine[:, None] * normal) / sine[:, None]
    else:
        tangent = np.stack([normal[:, 2], np.zeros_like(sine), -normal[:, 0]], axis=1)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frames = np.stack([tangent, np.cross(normal, tangent), normal], axis=1)
    local = np.stack([sine, np.zeros_like(sine), cosine], axis=1) if isotropic else frames @ viewer
    return local, frames
