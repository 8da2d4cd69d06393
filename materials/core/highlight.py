"""Pixels of a highlight: too few for a percentile over a picture, and the first thing a viewer notices.

A highlight is where the half direction is close enough to the normal that the surface is at least half as bright as at
its brightest. Its pixels are sampled evenly over that patch of the sphere, however small: a picture of any size may
show it large.
"""

from __future__ import annotations

import numpy as np

from .brdf import Brdf
from .directions import io_from_half_difference
from .protocol import LIGHT_ANGLES_DEG, SphereProtocol

# The tilt of the half direction is searched from the first to the second of these, radians.
_NEAREST, _FARTHEST = 1e-4, 0.25 * np.pi
_TILTS, _TURNS = 64, 8
# A patch wider than this is the shape of the surface and no highlight, radians; and so is one that is not this many
# times as bright as the surface around it.
_WIDEST, _BRIGHTER = np.radians(20.0), 2.0
# Pixels drawn for each light.
_PIXELS = 400


def highlight_protocol(brdf: Brdf) -> SphereProtocol | None:
    """Return the pixels of the highlight under each light of the sphere protocol; None if the surface has none."""
    pairs = [pair for angle in LIGHT_ANGLES_DEG if (pair := _pixels(brdf, 0.5 * np.radians(angle))) is not None]
    if not pairs:
        return None
    wi, wo = (np.concatenate(side) for side in zip(*pairs, strict=True))
    return SphereProtocol(0, LIGHT_ANGLES_DEG, wi, wo)


def highlight_width(brdf: Brdf, theta_d: float) -> tuple[float, float]:
    """Find the largest tilt of the half direction in a highlight under light at 2 theta_d from the view, radians.

    The second result is Y of its brightest pixel; both are 0 if the surface has no highlight.
    """
    turns = np.arange(_TURNS) * 2.0 * np.pi / _TURNS
    around = [0.0] if brdf.isotropic else turns
    tilts = np.concatenate([[0.0], np.geomspace(_NEAREST, _FARTHEST, _TILTS)])
    angles = np.meshgrid(tilts, [theta_d], turns, around, indexing="ij")
    profile = _luminance(brdf, *_rows(*io_from_half_difference(*angles))).reshape(len(tilts), -1)
    brightest = float(profile.max())
    if not np.isfinite(brightest):
        return 0.0, 0.0
    bright = (profile >= 0.5 * brightest).any(axis=1)
    width = float(tilts[min(int(np.flatnonzero(bright)[-1]) + 1, len(tilts) - 1)])
    if width <= _WIDEST and brightest >= _BRIGHTER * float(np.median(profile[-4:])):
        return width, brightest
    return 0.0, 0.0


def _pixels(brdf: Brdf, theta_d: float) -> tuple[np.ndarray, np.ndarray] | None:
    width, brightest = highlight_width(brdf, theta_d)
    if width == 0.0:
        return None
    # Even over a disc by the golden ratio and its like; a seed would be one more thing to state.
    steps = np.outer(np.arange(_PIXELS) + 0.5, 1.0 / 1.32471795724 ** np.arange(1, 4)) % 1.0
    turned = 0.0 if brdf.isotropic else 2.0 * np.pi * steps[:, 2]
    wi, wo = io_from_half_difference(
        width * np.sqrt(steps[:, 0]), np.full(_PIXELS, theta_d), 2.0 * np.pi * steps[:, 1], turned
    )
    wi, wo = _rows(wi, wo)
    kept = _luminance(brdf, wi, wo) >= 0.5 * brightest
    return wi[kept], wo[kept]


def _rows(wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return wi.reshape(-1, 3), wo.reshape(-1, 3)


def _luminance(brdf: Brdf, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    weights = SphereProtocol(0, (), wi, wo).weights(brdf.wavelengths_nm)[:, 1]
    return np.pi * (brdf.eval(wi, wo) @ weights) * np.maximum(wi[:, 2], 0.0)
