"""The distribution-based BRDF: one distribution of half vectors for matt and glossy together, fitted to any BRDF.

It is the simplest model that measured data have been fitted with, and what factor packs are compared with: two
look-ups a pixel, and an error that no larger table makes smaller.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...materials.core.axes import Axis
from ...materials.core.brdf import Brdf, Lobe, eval_lit
from ...materials.core.directions import angles, spherical
from ...materials.core.protocol import sphere_protocol
from ...runtime.errors import InputError, UnknownNameError
from ...spectral.difference import lightness_slope

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

METHODS = ("least_squares", "backscatter")

# Weight of a departure from backscatter beside an average node's data, by its second differences and by itself: nodes
# that the pairs hardly see stay near it.
_SMOOTHING, _ANCHOR = 1e-1, 1e-7
# Reflectances at normal incidence that are tried at every wavelength.
_NORMAL = np.geomspace(0.004, 1.0, 32)
# f_r sin(theta) at the horizon itself is 0 by definition; backscatter is read off just above.
_MARGIN = 1e-3


@dataclass(frozen=True, eq=False)
class DistributionBrdf(Brdf):
    """Ashikhmin and Premoze, "Distribution-based BRDFs", University of Utah, 2007.

    With h the half vector, k either direction, n the normal, c = h.k:

        f_r = p(h) F(c) / (k1.n + k2.n - (k1.n)(k2.n))
        F(c) = R_0 + (1 - R_0)(1 - c)^5

    p is tabulated over theta_h, and phi_h where the material is anisotropic, and linear between its nodes. Spectral
    here means that every wavelength has a p and an R_0 of its own, which is more freedom than the model was given.

    Parameters
    ----------
    wavelengths_nm : (L,).
    axes : theta_h, or theta_h and a periodic phi_h.
    distribution : p at the nodes, (nodes of theta_h, L) or (nodes of theta_h, nodes of phi_h, L), >= 0; its scale is
        free, no normalisation is asked for.
    normal_reflectance : R_0 (L,), in (0, 1].
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    axes: tuple[Axis, ...]
    distribution: Float[np.ndarray, "*grid L"]
    normal_reflectance: Float[np.ndarray, " L"]

    def __post_init__(self) -> None:
        names = tuple(axis.name for axis in self.axes)
        if names not in (("theta_h",), ("theta_h", "phi_h")):
            raise InputError("axes of another model", field="axes", found=names, expected="theta_h [, phi_h]")
        expected = (*(axis.size for axis in self.axes), len(self.wavelengths_nm))
        if self.distribution.shape != expected:
            raise InputError(
                "a distribution that does not fit its axes",
                field="distribution",
                found=self.distribution.shape,
                expected=str(expected),
            )
        if not (np.all(np.isfinite(self.distribution)) and np.all(self.distribution >= 0)):
            raise InputError("not a distribution", field="distribution", expected="finite numbers >= 0")
        if not np.all((self.normal_reflectance > 0) & (self.normal_reflectance <= 1)):
            raise InputError("not a reflectance", field="normal_reflectance", expected="numbers in (0, 1]")

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """True if its table has no azimuth."""
        return len(self.axes) == 1

    def lobes(self) -> tuple[Lobe, ...]:
        """One, which lives in half/difference angles."""
        return (Lobe("hd", self),)

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """f_r (...,L) in 1/sr; see `Brdf.eval`."""
        return eval_lit(self._eval_lit, len(self.wavelengths_nm), wi, wo)

    def _eval_lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        out = np.zeros((len(wi), len(self.wavelengths_nm)))
        for nodes, share in _corners(self.axes, wi + wo):
            out += share[:, None] * self._rows[nodes]
        grazing, shared = _fresnel_rise(wi, wo), _denominator(wi, wo)
        fresnel = self.normal_reflectance + np.multiply.outer(grazing, 1.0 - self.normal_reflectance)
        out *= fresnel
        out /= shared[:, None]
        return out

    @cached_property
    def _rows(self) -> np.ndarray:
        return self.distribution.reshape(-1, len(self.wavelengths_nm))


def fit_distribution(
    brdf: Brdf, *, method: str = "least_squares", nodes: int = 90, azimuths: int = 32, pixels: int = 96
) -> DistributionBrdf:
    """Return the distribution-based BRDF that comes nearest to `brdf`.

    "backscatter" is the original's way: p is read off where both directions are h, so that one slice of the data
    decides. "least_squares", the fairer baseline and the default, lets all data decide: p and R_0 of every wavelength
    minimise the squared error over the direction pairs of a sphere under the protocol's lights, weighted by what it
    costs in L*. Both find R_0 by that error.

    Parameters
    ----------
    nodes, azimuths : of theta_h (square-root scale) and, for anisotropic materials, of phi_h.
    pixels : of the sphere whose pairs are fitted to.

    Raises
    ------
    InputError : the BRDF is not finite on the sphere. UnknownNameError : no such method.
    """
    if method not in METHODS:
        raise UnknownNameError("method", method, METHODS, field="method")
    axes = (Axis("theta_h", nodes, 0.5 * np.pi, "sqrt"),)
    if not brdf.isotropic:
        axes = (*axes, Axis("phi_h", azimuths + 1, 2.0 * np.pi, periodic=True))
    protocol = sphere_protocol(pixels, brdf.isotropic)
    wi, wo = protocol.wi, protocol.wo
    values = brdf.eval(wi, wo)
    if not np.all(np.isfinite(values)):
        raise InputError("the BRDF is not finite", field="brdf", found="NaN or infinity on the sphere")
    luminance = np.pi * values @ protocol.weights(brdf.wavelengths_nm)[:, 1] * wi[:, 2]
    problem = _Problem.of(axes, wi, wo, values, np.pi * wi[:, 2] * lightness_slope(luminance))
    start = _backscattered(brdf, axes)
    best = np.full(values.shape[1], np.inf)
    p, normal = np.zeros((problem.count, values.shape[1])), np.ones(values.shape[1])
    for r0 in _NORMAL[::-1]:
        # p is worked out for F / R_0 = 1 + rise (1 - c)^5, whose value in backscatter is 1.
        rise = 1.0 / r0 - 1.0
        found = start if method == "backscatter" else np.maximum(problem.solved(rise, start), 0.0)
        left = problem.left(rise, found)
        better = left < best
        best[better], normal[better] = left[better], r0
        p[:, better] = found[:, better] / r0
    grid = tuple(axis.size - axis.periodic for axis in axes)
    p = p.reshape(*grid, -1)
    if len(axes) == 2:
        p = np.concatenate([p, p[:, :1]], axis=1)
        # The pole has one value, whatever the azimuth.
        p[0] = p[0].mean(axis=0)
    return DistributionBrdf(brdf.wavelengths_nm, axes, p, normal)


@dataclass(frozen=True, eq=False)
class _Problem:
    """Normal equations of p for any Fresnel rise: a polynomial in it, whose moments are summed once.

    matrices : of rise^0, rise^1, rise^2, (P,P) each. rights : of rise^0 and rise^1, (P,L). energy : (L,).
    """

    matrices: tuple[csr_matrix, csr_matrix, csr_matrix]
    smoothing: csr_matrix
    rights: tuple[Float[np.ndarray, "P L"], Float[np.ndarray, "P L"]]
    energy: Float[np.ndarray, " L"]

    @property
    def count(self) -> int:
        return self.rights[0].shape[0]

    @classmethod
    def of(cls, axes: tuple[Axis, ...], wi: np.ndarray, wo: np.ndarray, values: np.ndarray, weights: np.ndarray):
        from scipy.sparse import csr_matrix

        rows = np.arange(len(wi))
        corners = list(_corners(axes, wi + wo, open_ended=True))
        count = int(np.prod([axis.size - axis.periodic for axis in axes]))
        look = sum(csr_matrix((share, (rows, nodes)), shape=(len(wi), count)) for nodes, share in corners)
        scale, grazing = weights / _denominator(wi, wo), _fresnel_rise(wi, wo)

        def moment(power: int, data: np.ndarray | None = None):
            factor = scale * grazing**power
            if data is None:
                return (look.T @ look.multiply((scale * factor)[:, None])).tocsr()
            return look.T @ (factor[:, None] * data)

        weighted = weights[:, None] * values
        return cls(
            (moment(0), moment(1), moment(2)),
            _second_differences(axes),
            (moment(0, weighted), moment(1, weighted)),
            np.sum(weighted**2, axis=0),
        )

    def matrix(self, rise: float) -> csr_matrix:
        flat, first, second = self.matrices
        return flat + 2.0 * rise * first + rise**2 * second

    def right(self, rise: float) -> Float[np.ndarray, "P L"]:
        return self.rights[0] + rise * self.rights[1]

    def solved(self, rise: float, start: Float[np.ndarray, "P L"]) -> Float[np.ndarray, "P L"]:
        """Return the p of least error, held to `start` where the data say little."""
        from scipy.sparse import identity
        from scipy.sparse.linalg import splu

        matrix = self.matrix(rise)
        typical = max(matrix.diagonal().mean(), np.finfo(float).tiny)
        system = matrix + typical * (_SMOOTHING * self.smoothing + _ANCHOR * identity(self.count))
        return start + splu(system.tocsc()).solve(self.right(rise) - matrix @ start)

    def left(self, rise: float, p: Float[np.ndarray, "P L"]) -> Float[np.ndarray, " L"]:
        """Weighted sum of squares that p leaves at each wavelength."""
        return self.energy + np.sum(p * (self.matrix(rise) @ p - 2.0 * self.right(rise)), axis=0)


def _backscattered(brdf: Brdf, axes: tuple[Axis, ...]) -> Float[np.ndarray, "P L"]:
    """p R_0 at the nodes, from f_r with both directions along h."""
    nodes = [axis.nodes[: axis.size - axis.periodic] for axis in axes]
    theta, *phi = np.meshgrid(*nodes, indexing="ij")
    h = spherical(np.minimum(theta, 0.5 * np.pi - _MARGIN), phi[0] if phi else 0.0).reshape(-1, 3)
    return np.maximum(brdf.eval(h, h) * _denominator(h, h)[:, None], 0.0)


def _corners(
    axes: tuple[Axis, ...], h: np.ndarray, open_ended: bool = False
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Nodes around each half vector and their shares; `open_ended` numbers them without the repeated azimuth."""
    theta_h, phi_h = angles(h)
    at = axes[0].position(theta_h)
    low = np.minimum(at.astype(np.intp), axes[0].size - 2)
    polar = ((low, 1.0 - (at - low)), (low + 1, at - low))
    if len(axes) == 1:
        yield from polar
        return
    turns = axes[1].size - 1
    around = axes[1].position(phi_h)
    first = np.minimum(around.astype(np.intp), turns - 1)
    width = turns if open_ended else turns + 1
    for node, share in polar:
        for azimuth, part in ((first, 1.0 - (around - first)), (first + 1, around - first)):
            yield node * width + (azimuth % turns if open_ended else azimuth), share * part


def _second_differences(axes: tuple[Axis, ...]) -> csr_matrix:
    """P x P: sum over the nodes of the squared second difference along every axis."""
    from scipy.sparse import csr_matrix, identity, kron

    size = axes[0].size
    across = csr_matrix(np.diff(np.eye(size), 2, axis=0))
    along = across.T @ across
    if len(axes) == 1:
        return along.tocsr()
    turns = axes[1].size - 1
    around = np.eye(turns)
    ring = csr_matrix(np.roll(around, 1, axis=0) + np.roll(around, -1, axis=0) - 2.0 * around)
    return csr_matrix(kron(along, identity(turns)) + kron(identity(size), ring.T @ ring))


def _fresnel_rise(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """(1 - c)^5; |wi + wo| = 2 c."""
    cosine = 0.5 * np.sqrt(np.sum((wi + wo) ** 2, axis=-1))
    return (1.0 - np.minimum(cosine, 1.0)) ** 5


def _denominator(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    return wi[:, 2] + wo[:, 2] - wi[:, 2] * wo[:, 2]
