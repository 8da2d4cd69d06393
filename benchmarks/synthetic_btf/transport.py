"""Light transport on a relief, traced once for any dyes: numbers without colour, folded with spectra afterwards.

Each facet has one irradiance under each light. Of what leaves it, a view shows sums over facets; of what it gets from
others, rays say from which. So a texel is linear in the spectra of its dyes (direct light) and in products of two
(light that came by another facet), exactly at every wavelength, and other dyes cost no rays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from scipy import sparse

from ...lighting.vectors import orthonormal_frame
from ...materials.btf.hemisphere import Hemisphere
from .rays import PeriodicRays, check_above_horizon, off_surface
from .relief import Relief

# Texels by which a ray is moved that met nothing.
_NUDGE = np.array([1.1e-4, 0.7e-4, 0.0])
# Numbers that keep the random draws of gathering and of views apart.
_GATHERING, _VIEWS = 1, 2


@dataclass(frozen=True)
class CoatGloss:
    """A white lobe on top of the dyes.

    f_r = strength x c^exponent; on yarns c is the cosine between the view and the nearest of the cone of directions
    that a fibre mirrors the light into (Kajiya and Kay 1989), elsewhere between normal and half vector.
    strength : f_r at its highest, 1/sr. 0: none.
    """

    strength: float = 0.0
    exponent: float = 30.0


#: No white lobe.
MATT = CoatGloss()


@dataclass(frozen=True, eq=False)
class ReliefTransport:
    """Traced light on a relief: F facets, Lt lights, V views.

    direct : (F,Lt) irradiance from a light whose irradiance on a plane that faces it is 1; 0 in shadow.
    met : (F,G) the facet that each of G rays drawn by the cosine law meets, -1 where it leaves the sample.
    seen : (V,T,n) the facet that each of n rays of a texel's view meets, T = H x W; -1 where none (float32 slips).
    """

    relief: Relief
    views: Hemisphere
    lights: Hemisphere
    direct: Float[np.ndarray, "F Lt"]
    met: Int[np.ndarray, "F G"]
    seen: Int[np.ndarray, "V T n"]

    @cached_property
    def shown(self) -> sparse.csr_matrix:
        """(V T,F) the share of each facet in each texel of each view; rows add to 1."""
        seen = self.seen.reshape(-1, self.seen.shape[2])
        row, _ = np.nonzero(seen >= 0)
        count = np.bincount(row, minlength=len(seen))
        entries = (1.0 / count[row]).astype(np.float32)
        # Not summed where a facet is seen twice: the order of seen rays is kept for lobes.
        ends = np.concatenate([[0], np.cumsum(count)])
        return sparse.csr_matrix((entries, seen[seen >= 0], ends), shape=(len(seen), len(self.direct)))

    def gathered(self, light: int, dyes: int) -> Float[np.ndarray, "F P"]:
        """(F,P) irradiance of each facet by way of facets of each dye, were they white."""
        facet, source, dye = self._sources
        total = np.bincount(facet * dyes + dye, self.direct[source, light], len(self.direct) * dyes)
        return total.reshape(-1, dyes) / max(self.met.shape[1], 1)

    @cached_property
    def _sources(self) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Sources of gathering rays that meet something: whose a ray is, which facet it meets, and that one's dye."""
        facet, ray = np.nonzero(self.met >= 0)
        source = self.met[facet, ray]
        return facet, source, self.relief.facet_dyes[source]

    def coefficients(
        self, light: int, dyes: int
    ) -> tuple[Float[np.ndarray, "V H W P"], Float[np.ndarray, "V H W P P"]]:
        """Compute the coefficients of all texels: what stands before each dye's spectrum, and before each product of
        two, 1/sr.

        The first of two is the dye that is seen, the second that which light came by before.
        """
        own = np.zeros((len(self.direct), dyes))
        own[np.arange(len(own)), self.relief.facet_dyes] = 1.0 / np.pi
        shape = (len(self.views), *self.relief.texels)
        once = self.shown @ (own * self.direct[:, light, None])
        twice = self.shown @ (own[:, :, None] * self.gathered(light, dyes)[:, None, :]).reshape(len(own), -1)
        return once.reshape(*shape, dyes), twice.reshape(*shape, dyes, dyes)

    def lobe(self, light: int, gloss: CoatGloss) -> Float[np.ndarray, "V H W"]:
        """f_r cos(theta_i) of the white lobe in all texels, 1/sr."""
        shape = (len(self.views), *self.relief.texels)
        if gloss.strength == 0.0:
            return np.zeros(shape, dtype=np.float32)
        shown, to_light = self.shown, self.lights.directions[light]
        facet, lit = shown.indices, self.direct[:, light] > 0.0
        rays = np.diff(shown.indptr).reshape(len(self.views), -1).sum(axis=1)
        axis = self.relief.normals if self.relief.tangents is None else self.relief.tangents
        cosine = np.empty(len(facet))
        for view, part in enumerate(_parts(rays)):
            to_view = self.views.directions[view]
            if self.relief.tangents is None:
                half = to_view + to_light
                of_facets = axis @ (half / np.linalg.norm(half))
            else:
                a, b = axis @ to_view, axis @ to_light
                of_facets = np.sqrt(np.maximum((1.0 - a * a) * (1.0 - b * b), 0.0)) - a * b
            cosine[part] = of_facets[facet[part]]
        lobes = np.zeros(len(facet))
        on = np.flatnonzero(lit[facet] & (cosine > 0.0))
        lobes[on] = gloss.strength * cosine[on] ** gloss.exponent * self.direct[facet[on], light]
        # As `shown`, of the same rays, but each has its own value.
        summed = sparse.csr_matrix((shown.data * lobes, facet, shown.indptr), shape=shown.shape)
        return np.asarray(summed.sum(axis=1)).reshape(shape).astype(np.float32)


def _parts(counts: Int[np.ndarray, " n"]) -> list[slice]:
    ends = np.concatenate([[0], np.cumsum(counts)])
    return [slice(int(a), int(b)) for a, b in pairwise(ends)]


def traced(
    relief: Relief,
    views: Hemisphere,
    lights: Hemisphere,
    *,
    plane: float,
    seed: int,
    gathering: int = 8,
    samples: int = 4,
    progress: Callable[[int, int, str], None] | None = None,
) -> ReliefTransport:
    """Trace light onto a relief, from facet to facet, and what each view shows.

    plane : height of the measured plane, texels, as the relief's heights are.
    seed : equal seeds give equal bits.
    gathering : `gathering`^2 stratified rays leave each facet. 0: no light comes by another facet.
    samples : `samples`^2 stratified rays go into a texel from each view, at the same places of all texels: what is
        drawn is no noise from texel to texel, which no form of a BTF could keep.
    progress : called with (steps done, steps in all, what is done).

    Raises
    ------
    InputError : a direction too near to the horizon (`rays.LEAST_HEIGHT`).
    """
    check_above_horizon(views.directions, "views")
    check_above_horizon(lights.directions, "lights")
    say, steps = progress or (lambda *_: None), len(lights) + gathering**2 + len(views)
    rays, normals = PeriodicRays(relief), relief.normals
    starts = off_surface(relief.corners.mean(axis=1), normals)
    direct = np.zeros((len(normals), len(lights)), dtype=np.float32)
    for light, to in enumerate(lights.directions):
        cosine = normals @ to
        above = np.flatnonzero(cosine > 0.0)
        free = rays.free(starts[above], np.broadcast_to(to, (len(above), 3)))
        direct[above[free], light] = cosine[above[free]]
        say(light + 1, steps, "shadows")
    met = _met(relief, rays, seed, gathering, lambda done: say(len(lights) + done, steps, "light between facets"))
    done = len(lights) + gathering**2
    seen = np.empty((len(views), relief.texels[0] * relief.texels[1], samples**2), dtype=np.int32)
    for view, to in enumerate(views.directions):
        seen[view] = _seen(relief, rays, to, plane, samples, np.random.default_rng([seed, _VIEWS, view]))
        say(done + view + 1, steps, "views")
    return ReliefTransport(relief, views, lights, direct, met, seen)


def _met(
    relief: Relief, rays: PeriodicRays, seed: int, side: int, say: Callable[[int], None]
) -> Int[np.ndarray, "F G"]:
    """Facets met by rays that leave each facet by the cosine law, stratified in both numbers they are drawn from."""
    random = np.random.default_rng([seed, _GATHERING])
    normals, corners = relief.normals, relief.corners
    frame = orthonormal_frame(normals, np.broadcast_to(np.array([1.0, 0.0, 0.0]), normals.shape))
    met = np.empty((len(normals), side**2), dtype=np.int32)
    for stratum in range(side**2):
        a, b, c, d = random.random((4, len(normals)))
        sine2 = (stratum // side + a) / side
        angle = (stratum % side + b) * (2.0 * np.pi / side)
        local = np.stack([np.sqrt(sine2) * np.cos(angle), np.sqrt(sine2) * np.sin(angle), np.sqrt(1.0 - sine2)], axis=1)
        to = np.einsum("fij,fi->fj", frame, local)
        # Even over the triangle: Turk 1990, in "Graphics Gems".
        root = np.sqrt(c)
        share = np.stack([1.0 - root, root * (1.0 - d), root * d], axis=1)
        points = np.einsum("fk,fki->fi", share, corners)
        met[:, stratum] = rays.first(off_surface(points, normals), to)
        say(stratum + 1)
    return met


def _seen(
    relief: Relief, rays: PeriodicRays, to: np.ndarray, plane: float, samples: int, random: np.random.Generator
) -> Int[np.ndarray, "T n"]:
    """Facets met by rays through each texel of the measured plane, against the direction of a view."""
    height, width = relief.texels
    strata = np.stack(np.divmod(np.arange(samples**2), samples), axis=1)
    within = (strata + random.random((samples**2, 2))) / samples
    row, column = np.divmod(np.arange(height * width), width)
    x, y = column[:, None] + within[:, 1], -(row[:, None] + within[:, 0])
    at = np.stack([x, y, np.full_like(x, plane)], axis=2).reshape(-1, 3)
    # Back up the ray to above all heights, wherever the plane is.
    top = float(relief.heights.max()) + 0.5
    starts = at + ((top - plane) / to[2]) * to
    away = np.broadcast_to(-to, starts.shape)
    found = rays.first(starts, away)
    # In float32 a ray that aims at an edge may slip through.
    slipped = np.flatnonzero(found < 0)
    found[slipped] = rays.first(starts[slipped] + _NUDGE, away[slipped])
    found = found.reshape(height * width, samples**2).astype(np.int32)
    if (found < 0).all(axis=1).any():
        raise RuntimeError("a view meets nothing of a surface without holes")
    return found
