"""Grids for tabulating a lobe: positions of the nodes, and weights by their visibility in pictures."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ...spectral.difference import lightness_slope
from ..core.axes import Axis, Frame
from ..core.brdf import Brdf
from ..core.directions import io_from_half_difference
from .brdf_table import BrdfTable, node_directions

# A lobe is followed in theta_h until Y of a facing surface stays below this (0.01 in L*).
_LEAST_SEEN = 1e-5
# Largest error in L* that the nodes of theta_h may cause by themselves.
_NODE_ERROR = 0.1
# Nodes that are hardly seen count by their relative error, this much of the average node: it keeps factors defined.
_UNSEEN = 1e-6
# Nodes that theta_h of an anisotropic surface has at most.
_MOST_ANISOTROPIC = 64
# Separable weights are no less than this share of their largest, as square roots.
_LEAST_ROOT = 1e-3


def lobe_axes(brdf: Brdf, frame: Frame, luminous: Float[np.ndarray, " L"]) -> tuple[Axis, ...]:
    """Choose axes fine enough for a lobe.

    luminous : (L,) weights from f_r to Y of a surface facing the light, pi times y-bar.

    In frame hd theta_h ends where the lobe becomes invisible, and its number of nodes follows the lobe's sharpness.
    Azimuth axes have a node at pi/2, where models that use max(cos theta_i, cos theta_o) have a crease.
    """
    right, turn = 0.5 * np.pi, 2.0 * np.pi
    fine = brdf.isotropic
    if frame == "io":
        polar = 64 if fine else 32
        axes = (Axis("theta_i", polar, right), Axis("theta_o", polar, right))
        if fine:
            return (*axes, Axis("phi", 33, np.pi))
        return (*axes, Axis("phi", 33, turn, periodic=True), Axis("phi_i", 25, turn, periodic=True))
    theta_h = _half_axis(brdf, luminous)
    theta_d = Axis("theta_d", 48 if fine else 24, right)
    if fine:
        return (theta_h, theta_d, Axis("phi_d", 33, np.pi))
    theta_h = Axis("theta_h", min(theta_h.size, _MOST_ANISOTROPIC), theta_h.maximum, "sqrt")
    azimuths = Axis("phi_d", 25, turn, periodic=True), Axis("phi_h", 33, turn, periodic=True)
    return (theta_h, theta_d, *azimuths)


def _half_axis(brdf: Brdf, luminous: np.ndarray) -> Axis:
    """Choose the axis of theta_h, as far as the lobe is visible, with nodes as its sharpness needs."""

    def profile(theta_h: np.ndarray) -> np.ndarray:
        theta_d, phi_h = np.radians([0.0, 25.0, 50.0]), np.array([0.0]) if brdf.isotropic else np.radians([0.0, 45, 90])
        grid = np.meshgrid(theta_h, theta_d, [0.5 * np.pi], phi_h, indexing="ij")
        wi, wo = io_from_half_difference(*(angle.reshape(len(theta_h), -1) for angle in grid))
        return np.maximum(brdf.eval(wi, wo) @ luminous * wi[..., 2], 0.0)

    # Geometric, so that a highlight of a thousandth of a degree is met as well as a broad one.
    candidates = np.geomspace(1e-5, 0.5 * np.pi - 1e-3, 400)
    seen = np.flatnonzero((profile(candidates) > _LEAST_SEEN).any(axis=1))
    last = min(seen[-1] + 4, len(candidates) - 1) if len(seen) else len(candidates) - 1
    # As many nodes as are fine enough, else the most.
    for size in (48, 64, 96, 128, 192, 256):
        axis = Axis("theta_h", size, float(candidates[last]), "sqrt")
        nodes = axis.nodes
        values = profile(nodes)
        middle = profile(0.5 * (nodes[1:] + nodes[:-1]))
        # Linear in the warped coordinate: its middle is not the middle angle.
        share = (axis.position(0.5 * (nodes[1:] + nodes[:-1])) % 1.0)[:, None]
        error = np.abs(values[:-1] + share * np.diff(values, axis=0) - middle) * lightness_slope(middle)
        if error.max() <= _NODE_ERROR:
            break
    return axis


def filled(table: BrdfTable) -> Float[np.ndarray, "*grid S"]:
    """Fill nodes that no real pair reaches from the nearest reached theta_d, then theta_h."""
    values, known = table.values.copy(), table.reached.copy()
    for mode in (1, 0):
        along, flags = np.moveaxis(values, mode, 0), np.moveaxis(known, mode, 0)
        for index in range(1, len(along)):
            take = ~flags[index] & flags[index - 1]
            along[index][take] = along[index - 1][take]
            flags[index] |= take
    return values


def node_weights(table: BrdfTable, luminance: Float[np.ndarray, "*grid"]) -> Float[np.ndarray, "*grid"]:
    """Compute the squared L* of a unit error at each node, times the node's frequency in pictures.

    The frequency is by projected area, over surfaces of every orientation under lights at every angle from the view; it
    is 0 at nodes that no real pair reaches. luminance : Y of f_r cos(theta_i) at the nodes.
    """
    wi, wo = node_directions(table.frame, table.axes)
    cosine, towards = np.maximum(wi[..., 2], 0.0), np.maximum(wo[..., 2], 0.0)
    nodes = [axis.nodes for axis in table.axes]
    if table.frame == "hd":
        # Lights at the angle 2 theta_d from the view; the far ones, which need two grazing angles, are rarer.
        often = [_solid(nodes[0]), _cells(nodes[1]) * np.cos(nodes[1])]
        seen, scale = towards, cosine
    else:
        often = [_solid(nodes[0]), _solid(nodes[1])]
        apart = np.linalg.norm(np.cross(wi, wo), axis=-1)
        seen, scale = towards / np.maximum(apart, 0.05), 1.0
    often += [_cells(n) for n in nodes[2:]]
    for mode, share in enumerate(often):
        seen = seen * share.reshape([-1 if k == mode else 1 for k in range(len(often))])
    return seen * (np.pi * scale * lightness_slope(luminance)) ** 2 * table.reached


def floored(weights: Float[np.ndarray, "*grid"], values: Float[np.ndarray, "*grid S"]) -> Float[np.ndarray, "*grid"]:
    """Raise (nearly) vanishing weights a little: every node is determined, without tall spikes dominating."""
    power = np.sum(values**2, axis=-1)
    total = float(np.sum(weights * power))
    if total == 0.0:
        return np.ones_like(weights)
    typical = total / weights.size
    return np.maximum(weights, _UNSEEN * typical / (power + typical / weights.mean()))


def separable_roots(weights: Float[np.ndarray, "*grid"]) -> tuple[Float[np.ndarray, " _"], ...]:
    """Compute square roots of vectors whose outer product approximates the weights, at least `_LEAST_ROOT`."""
    roots = []
    for mode in range(weights.ndim):
        root = np.sqrt(weights.mean(axis=tuple(k for k in range(weights.ndim) if k != mode)))
        roots.append(np.maximum(root / root.max(), _LEAST_ROOT))
    return tuple(roots)


def _edges(nodes: np.ndarray) -> np.ndarray:
    """Compute the edges of the cells about the nodes: half-way between neighbours."""
    return np.concatenate([nodes[:1], 0.5 * (nodes[1:] + nodes[:-1]), nodes[-1:]])


def _cells(nodes: np.ndarray) -> np.ndarray:
    """Compute the lengths of the cells about the nodes, radians."""
    return np.diff(_edges(nodes))


def _solid(nodes: np.ndarray) -> np.ndarray:
    """Compute the solid angles of the cells about nodes of a polar angle, over 2 pi."""
    return -np.diff(np.cos(_edges(nodes)))
