"""Environment forms: the response of a surface to environment light, as a few lobes and a cosine.

For one viewer, a surface weights the light over the hemisphere by f_r(wi, wo) cos(theta_i), the BRDF slice of Wang et
al. 2009 (section 4.3). Here a slice is a sum of spherical Gaussians (their eq. 2) and of the cosine of matt surfaces,
multiplied by polynomials up to the second degree: a Gaussian is a look-up in a prefiltered environment, the cosine one
in a map of irradiances and of their moments, which are exact and end at the horizon.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from ...spectral.palette import Palette
from .points import Points
from .terms import TermShader

#: Number of polynomials of a direction (x, y, z) that a cosine is multiplied with: 1, x, y, z, xy, yz, xz, xx - yy and
#: 3 zz - 1.
BENDS = 9


def bends(directions: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 9"]:
    """Evaluate the polynomials at unit directions."""
    x, y, z = np.moveaxis(directions, -1, 0)
    return np.stack([np.ones_like(x), x, y, z, x * y, y * z, x * z, x * x - y * y, 3.0 * z * z - 1.0], axis=-1)


@dataclass(frozen=True, eq=False)
class Lobes:
    """Slices at N points: Q normalised spherical Gaussians and a bent cosine each, R terms of a palette.

    directions (N,Q,3) : unit, towards the light. sharpness (N,Q) : lambda of the Gaussians, > 0.
    value (N,Q,R) : the integral of each term over a lobe, f_r cos(theta_i) dwi, without its spectrum, which is 1/sr.
    matt (N,B,R) : of the cosine, pi times the coefficient of each polynomial; B is 1 (a plain cosine) or `BENDS`.
    frame (N,3,3) : frame of directions, cosine and polynomials: its axes in the local frame, in rows, the normal last;
    None is the local frame itself.
    """

    directions: Float[np.ndarray, "N Q 3"]
    sharpness: Float[np.ndarray, "N Q"]
    value: Float[np.ndarray, "N Q R"]
    matt: Float[np.ndarray, "N B R"]
    frame: Float[np.ndarray, "N 3 3"] | None = None


class EnvironmentForm(abc.ABC):
    """Environment light on a fast form; subclasses are frozen dataclasses.

    Attributes
    ----------
    palette : one entry of R spectra, 1/sr.
    count : Q, Gaussians per slice; 0 is matt. bent : B, polynomials of its cosine.
    uses_uv : True if it needs the texture coordinates of points.
    """

    palette: Palette
    count: int
    bent: int = 1
    uses_uv: ClassVar[bool] = False

    @abc.abstractmethod
    def lobes(self, points: Points) -> Lobes:
        """Compute the slices for viewers at `points.wo`; directions of light are ignored."""

    @abc.abstractmethod
    def shader(self, filtered: bool = False) -> TermShader:
        """Return the GLSL twin of `lobes`, as described in `docs/adding_a_surface.md`."""

    @property
    @abc.abstractmethod
    def key(self) -> tuple:
        """Equal for forms of equal lobes, whatever their spectra; valid while both exist."""
