"""Families of BRDFs: one formula, many members, and the way from parameters to a mixture of members.

Sun et al. 2007 (section 4.2) take two: Blinn-Phong, whose exponent is a whole number from 1 to 200 and is interpolated
between, and Cook-Torrance, whose members lie in a plane of Fresnel reflectance and roughness that is triangulated.
Members have no colour: a material gives its diffuse part and its highlight a spectrum each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ....materials.analytic.cook_torrance import beckmann, v_cavity
from ....runtime.errors import InputError

#: Widest and narrowest of Cook-Torrance's members, root mean square slopes, and reflectances at normal incidence.
ROUGHNESS, F0 = (0.08, 0.5), (0.04, 0.2, 0.6, 0.95)
# Roughnesses of the default Cook-Torrance family: evenly in the logarithm.
_ROUGHNESSES = 12
#: Blinn-Phong's largest exponent.
EXPONENTS = 200

Values = Callable[
    [Float[np.ndarray, " d"], Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]], Float[np.ndarray, " n"]
]
Mixed = Callable[
    [Float[np.ndarray, "m d"], Float[np.ndarray, " m"], Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]],
    Float[np.ndarray, " n"],
]


@dataclass(frozen=True, eq=False)
class Family:
    """N isotropic highlights of one formula.

    name, words : its own, and its parameters'. members (N,d) : parameters, d of 1 or 2; of one parameter in rising
    order. one : (parameters, wi, wo) -> f_r (n,), 1/sr, for unit directions above the horizon. half_only : whether f_r
    depends on the half vector's angle alone.
    """

    name: str
    words: tuple[str, ...]
    members: Float[np.ndarray, "N d"]
    one: Values
    half_only: bool = False
    _mixed: Mixed | None = None

    def __len__(self) -> int:
        return len(self.members)

    def values(self, wi: Float[np.ndarray, "n 3"], wo: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "N n"]:
        """f_r of each member, 1/sr; float64."""
        return np.stack([self.one(member, wi, wo) for member in self.members])

    def mixture(
        self, weights: Float[np.ndarray, " N"], wi: Float[np.ndarray, "n 3"], wo: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, " n"]:
        """f_r of members, weighted: what they have in common is worked out once."""
        some = np.flatnonzero(weights)
        if self._mixed is not None:
            return self._mixed(self.members[some], weights[some], wi, wo)
        found = np.zeros(len(wi))
        for member in some:
            found += float(weights[member]) * self.one(self.members[member], wi, wo)
        return found

    def weights(self, *parameters: float) -> Float[np.ndarray, " N"]:
        """Return the mixture of members at a point between them: at most d + 1 are not 0, and all sum to 1.

        Raises
        ------
        InputError : a parameter too many or too few, or a point that lies outside of all members.
        """
        if len(parameters) != len(self.words):
            field = f"parameters of {self.name}"
            raise InputError("not as many as there are", field=field, found=len(parameters), expected=str(self.words))
        found = np.zeros(len(self))
        if len(self.words) == 1:
            places = self.members[:, 0]
            if not places[0] <= parameters[0] <= places[-1]:
                raise self._outside(parameters)
            right = int(np.clip(np.searchsorted(places, parameters[0]), 1, len(places) - 1))
            share = (parameters[0] - places[right - 1]) / (places[right] - places[right - 1])
            found[[right - 1, right]] = 1.0 - share, share
            return found
        point = self._flat(np.array([parameters]))[0]
        simplex = int(self._triangles.find_simplex(point[None])[0])
        if simplex < 0:
            raise self._outside(parameters)
        turn = self._triangles.transform[simplex]
        shares = turn[:2] @ (point - turn[2])
        found[self._triangles.simplices[simplex]] = np.maximum([*shares, 1.0 - shares.sum()], 0.0)
        return found / found.sum()

    @cached_property
    def _triangles(self):
        from scipy.spatial import Delaunay

        return Delaunay(self._flat(self.members))

    def _flat(self, points: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d"]:
        """Members span a square here; without it, triangles would be long ones along the wider parameter."""
        low, high = self.members.min(axis=0), self.members.max(axis=0)
        return (points - low) / (high - low)

    def _outside(self, parameters: tuple[float, ...]) -> InputError:
        low, high = self.members.min(axis=0), self.members.max(axis=0)
        expected = ", ".join(f"{word} {a:g} to {b:g}" for word, a, b in zip(self.words, low, high, strict=True))
        found = ", ".join(f"{each:g}" for each in parameters)
        return InputError("outside of the family", field=self.name, found=found, expected=expected)


def blinn_phong(largest: int = EXPONENTS) -> Family:
    """(n + 8) / (8 pi) cos^n(theta_h) of all whole exponents from 1 to `largest` (Blinn 1977).

    The factor keeps the energy of all exponents about alike (Akenine-Moeller, Haines and Hoffman 2008, eq. 7.48).
    """

    def one(member: np.ndarray, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        exponent = float(member[0])
        return (exponent + 8.0) / (8.0 * np.pi) * half_cosine(wi, wo) ** exponent

    return Family("Blinn-Phong", ("exponent",), np.arange(1.0, largest + 1.0)[:, None], one, half_only=True)


def cook_torrance(members: Float[np.ndarray, "N 2"] | None = None) -> Family:
    """F D G / (4 cos cos): Beckmann's facets in V-shaped grooves, Schlick's Fresnel term (Cook and Torrance 1982).

    members : F_0 in [0, 1] and the root mean square slope in (0, 1] of each; None spreads 48 over `F0` and `ROUGHNESS`.

    Raises
    ------
    InputError : values outside of these bounds; members on one line, which span no plane to navigate in.
    """
    if members is None:
        slopes = np.geomspace(*ROUGHNESS, _ROUGHNESSES)
        members = np.array([(f0, slope) for f0 in F0 for slope in slopes])
    low, high = members.min(axis=0), members.max(axis=0)
    if not (low[0] >= 0.0 and high[0] <= 1.0 and low[1] > 0.0 and high[1] <= 1.0):
        found = f"F_0 {low[0]:g} to {high[0]:g}, slope {low[1]:g} to {high[1]:g}"
        raise InputError("not a surface", field="members", found=found, expected="F_0 in [0, 1], slope in (0, 1]")
    if np.linalg.matrix_rank(members - members[0]) < 2:
        raise InputError("members on one line", field="members", found=f"{len(members)}", expected="a plane of them")

    def mixed(some: np.ndarray, weights: np.ndarray, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        half = wi + wo
        length = np.sqrt(np.einsum("...i,...i->...", half, half))
        # cos(theta_d) of two unit vectors, without an acos: half the length of their sum.
        cosine, difference = half[..., 2] / length, 0.5 * length
        away = 1.0 - np.minimum(difference, 1.0)
        fifth = away * away
        fifth *= fifth * away
        squared = cosine * cosine
        tangent = np.maximum(1.0 - squared, 0.0)
        grazing = straight = 0.0
        # The Fresnel term is linear in F_0, so that each roughness is looked at once.
        for slope in np.unique(some[:, 1]).tolist():
            mine = some[:, 1] == slope
            facets = beckmann(squared, tangent, slope)
            grazing = grazing + facets * float(weights[mine].sum())
            straight = straight + facets * float(weights[mine] @ some[mine, 0])
        fresnel = straight + (grazing - straight) * fifth
        return fresnel * v_cavity(wi[..., 2], wo[..., 2], cosine / difference)

    def one(member: np.ndarray, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return mixed(member[None], np.ones(1), wi, wo)

    return Family("Cook-Torrance", ("F_0", "roughness"), np.asarray(members, dtype=float), one, _mixed=mixed)


def half_cosine(wi: Float[np.ndarray, "*n 3"], wo: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n"]:
    """cos(theta_h). Above the horizon the sum of two directions is never 0."""
    half = wi + wo
    return half[..., 2] / np.linalg.norm(half, axis=-1)
