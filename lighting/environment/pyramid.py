"""Environment prefiltered with spherical Gaussians of any sharpness.

Wang et al. 2009, eq. 35, with normalised Gaussians: Gamma_L(p, lambda) here is the mean luminance under
exp(lambda (v . p - 1)), not the integral, so that it stays finite and tends to the environment itself. The paper's
value is 2 pi (1 - exp(-2 lambda)) / lambda times this.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from . import convolution, latlong, octahedral
from .environment import EnvironmentLight

#: Default sharpness of the finest level: a Gaussian about as wide as a texel of a map 512 wide.
SHARPEST = 4096.0
#: The coarsest level that is not the mean over the sphere.
BLUNTEST = 0.5
#: A level's side is `TEXELS` times the root of its sharpness, at least `LEAST_SIDE`: a Gaussian's standard deviation is
#: about 3 texels.
TEXELS = 10.0
LEAST_SIDE = 32
#: Exponent at which a Gaussian is cut, exp(-20) = 2e-9 of its peak: a sun in a dark sky shows no edge.
CUT = 20.0
#: Levels are linear in 1 / (lambda + this): as in 1 / lambda where lobes are sharp, and finite down to lambda = 0.
SOFTENING = 2.0


@dataclass(frozen=True, eq=False)
class Pyramid:
    """Levels of an environment, each under Gaussians of one sharpness, in octahedral maps (`octahedral`).

    sharpness (L,) : ascending; the first is 0, the mean over the sphere. levels : L arrays (side, side, K), cd/m^2,
    float32, in the environment's own frame. fields (K, H, W) : the map itself, beyond the finest level.
    world_from_map (3, 3) : rotation of that frame.
    """

    sharpness: Float[np.ndarray, " L"]
    levels: tuple[Float[np.ndarray, "_ _ K"], ...]
    fields: Float[np.ndarray, "K H W"]
    world_from_map: Float[np.ndarray, "3 3"]

    @classmethod
    def of(cls, environment: EnvironmentLight, sharpest: float = SHARPEST) -> Pyramid:
        """Return the levels BLUNTEST, twice that, ... up to `sharpest` and the first beyond it.

        Raises
        ------
        InputError : a sharpness that is not positive and finite.
        """
        if not 0.0 < sharpest < np.inf:
            raise InputError("not a sharpness", field="sharpest", found=sharpest, expected="more than 0, finite")
        doublings = max(0, int(np.ceil(np.log2(sharpest / BLUNTEST) - 1e-9)))
        sharpness = BLUNTEST * 2.0 ** np.arange(doublings + 1)
        resolutions = convolution.Resolutions(environment.fields)
        weights = latlong.solid_angles(*environment.fields.shape[1:])
        mean = environment.fields.sum(axis=2) @ weights / (4.0 * np.pi)
        levels = [mean[None, None].astype(np.float32)] + [_level(resolutions, one) for one in sharpness]
        return cls(np.append(0.0, sharpness), tuple(levels), environment.fields, environment.world_from_map)

    def __call__(
        self, directions: Float[np.ndarray, "n 3"], sharpness: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n K"]:
        """Return the mean luminance (n, K) weighted by the normalised Gaussian about each unit world direction, cd/m^2.

        sharpness : not negative; 0 is the mean over the sphere, infinity the map itself.

        Raises
        ------
        InputError : a sharpness that is negative or no number.
        """
        sharpness = np.asarray(sharpness, dtype=np.float64)
        if not (sharpness >= 0.0).all():
            wrong = int(np.argmin(sharpness >= 0.0))
            raise InputError(
                "not a sharpness", field=f"sharpness[{wrong}]", found=float(sharpness[wrong]), expected="0 or more"
            )
        to = directions @ self.world_from_map
        low = np.searchsorted(self.sharpness, sharpness, side="right") - 1
        last = len(self.levels) - 1
        places = octahedral.places(to)
        found = self._at(places, low)
        softened = 1.0 / (self.sharpness + SOFTENING)
        wanted = 1.0 / (sharpness + SOFTENING)
        between = np.flatnonzero(low < last)
        if len(between):
            below, above = softened[low[between]], softened[low[between] + 1]
            share = ((below - wanted[between]) / (below - above))[:, None]
            upper = self._at((places[0][between], places[1][between]), low[between] + 1)
            found[between] += share * (upper - found[between])
        beyond = np.flatnonzero((low == last) & (sharpness > self.sharpness[last]))
        if len(beyond):
            share = (1.0 - wanted[beyond] / softened[last])[:, None]
            found[beyond] += share * (latlong.between_texels(self.fields, to[beyond]) - found[beyond])
        return found

    @cached_property
    def _texels(self) -> tuple[Float[np.ndarray, "t K"], np.ndarray, np.ndarray]:
        """Texels of all levels, each with a border of one texel; the offset of each level; the length of its rows."""
        padded = [octahedral.bordered(level) for level in self.levels]
        sides = np.array([len(level) for level in padded])
        starts = np.append(0, np.cumsum(sides**2))[:-1]
        return np.concatenate([level.reshape(-1, level.shape[2]) for level in padded]), starts, sides

    def _at(self, places: tuple[np.ndarray, np.ndarray], level: np.ndarray) -> Float[np.ndarray, "n K"]:
        """Sample each place from its own level, linear between texels."""
        texels, starts, sides = self._texels
        start, side = starts[level], sides[level]
        column, row = (0.5 * (place + 1.0) * (side - 2) + 0.5 for place in places)
        left = np.clip(np.floor(column), 0, side - 2).astype(np.int64)
        top = np.clip(np.floor(row), 0, side - 2).astype(np.int64)
        right, down = (column - left)[:, None], (row - top)[:, None]
        at = start + top * side + left
        above = texels[at] * (1.0 - right) + texels[at + 1] * right
        below = texels[at + side] * (1.0 - right) + texels[at + side + 1] * right
        return above * (1.0 - down) + below * down


def _level(resolutions: convolution.Resolutions, sharpness: float) -> Float[np.ndarray, "side side K"]:
    """Compute one octahedral level: the map at 0.4 standard deviations a row is blurred, and interpolated by splines
    from half a standard deviation a row.
    """
    width = 1.0 / np.sqrt(sharpness)
    fields = resolutions.at_least(max(32.0, np.pi / (0.4 * width)))
    reach = float(np.arccos(max(-1.0, 1.0 - CUT / sharpness)))
    rows = max(32, int(np.ceil(2.0 * np.pi / width)))
    blurred = convolution.convolved(fields, lambda cosine: np.exp(sharpness * (cosine - 1.0)), reach, rows)
    to = octahedral.texel_directions(max(LEAST_SIDE, int(np.ceil(TEXELS * np.sqrt(sharpness)))))
    return convolution.smooth_between_texels(blurred, to).astype(np.float32)
