"""Regular tables of a BRDF over the angles of a frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float

from ...runtime.errors import InputError
from ..core.axes import AXIS_NAMES, Axis, Frame
from ..core.brdf import Brdf
from ..core.directions import io_from_half_difference, spherical

# The horizon itself has no f_r (it is zero there by definition), so that a node on it is evaluated just above.
HORIZON_MARGIN = 1e-4
# Nodes per block in the evaluation of a BRDF.
_BLOCK = 16384


@dataclass(frozen=True, eq=False)
class BrdfTable:
    """A BRDF on the grid of `axes`.

    values : f_r cos(theta_i) in frame io, f_r in frame hd, 1/sr; or their coefficients (`tabulate`).
    reached : False if no pair of directions above the horizon has these angles: values there are 0, without meaning.

    Raises
    ------
    InputError : the axes are not those of the frame, or the arrays do not fit them.
    """

    frame: Frame
    axes: tuple[Axis, ...]
    wavelengths_nm: Float[np.ndarray, " L"]
    values: Float[np.ndarray, "*grid L"]
    reached: Bool[np.ndarray, "*grid"]

    def __post_init__(self) -> None:
        names = AXIS_NAMES[self.frame]
        found = tuple(axis.name for axis in self.axes)
        if found not in (names[:3], names):
            raise InputError("axes do not belong to the frame", field="axes", found=found, expected=str(names))
        shape = tuple(axis.size for axis in self.axes)
        if self.values.shape != (*shape, len(self.wavelengths_nm)) or self.reached.shape != shape:
            raise InputError(
                "table does not fit its axes",
                field="values",
                found=self.values.shape,
                expected=f"{shape} and wavelengths",
            )


@lru_cache(maxsize=2)
def node_directions(
    frame: Frame, axes: tuple[Axis, ...]
) -> tuple[Float[np.ndarray, "*grid 3"], Float[np.ndarray, "*grid 3"]]:
    """Compute wi and wo of every node; in frame hd either may be below the horizon, nodes on it are raised."""
    nodes = [axis.nodes for axis in axes]
    if frame == "io":
        nodes = [
            np.minimum(n, 0.5 * np.pi - HORIZON_MARGIN) if axis.name.startswith("theta") else n
            for n, axis in zip(nodes, axes, strict=True)
        ]
        theta_i, theta_o, phi, *rest = np.meshgrid(*nodes, indexing="ij")
        phi_i = rest[0] if rest else np.zeros_like(phi)
        return _frozen(spherical(theta_i, phi_i), spherical(theta_o, phi_i + phi))
    theta_h, theta_d, phi_d, *rest = np.meshgrid(*nodes, indexing="ij")
    return _frozen(*io_from_half_difference(theta_h, theta_d, phi_d, rest[0] if rest else 0.0))


def _frozen(wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Make the arrays read-only, since they are cached."""
    wi.setflags(write=False)
    wo.setflags(write=False)
    return wi, wo


def tabulate(
    brdf: Brdf, frame: Frame, axes: tuple[Axis, ...], spectra: Float[np.ndarray, "L S"] | None = None
) -> BrdfTable:
    """Evaluate `brdf` at every node, in blocks so that memory beyond the table itself stays bounded.

    `spectra`: columns to project every spectrum on as it is evaluated; the table then has S values a node in place of
    L, and `wavelengths_nm` counts 0 .. S-1.
    """
    wi, wo = (w.reshape(-1, 3) for w in node_directions(frame, axes))
    shape = tuple(axis.size for axis in axes)
    least = HORIZON_MARGIN if frame == "hd" else 0.0
    reached = (wi[:, 2] > least) & (wo[:, 2] > least)
    depth = len(brdf.wavelengths_nm) if spectra is None else spectra.shape[1]
    values = np.zeros((len(wi), depth))
    rows = np.flatnonzero(reached)
    for start in range(0, len(rows), _BLOCK):
        block = rows[start : start + _BLOCK]
        found = brdf.eval(wi[block], wo[block])
        values[block] = found if spectra is None else found @ spectra
    if frame == "io":
        values *= wi[:, 2:]
    labels = brdf.wavelengths_nm if spectra is None else np.arange(float(depth))
    return BrdfTable(frame, axes, labels, values.reshape(*shape, depth), reached.reshape(shape))
