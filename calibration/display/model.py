"""Display models from codes to XYZ: tone curves, a mixture of channels, and a residual of the readings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from .curves import Curve, curve_of

#: Share of white that is added before the cube root: its slope at black is that of CIELAB (CIE 015:2018, eq. 8.5).
FLOOR = (3.0 * 841.0 / 108.0) ** -1.5
# Mixtures: black and three channels; and what two or all three channels give together beside their sum.
_SUMS, _MINIMA = 4, 8


@dataclass(frozen=True, eq=False)
class Residual:
    """Smoothing spline over codes of a mixture's residuals, in cube roots.

    Sums of cubed distances, with a plane (Duchon 1977; Wahba 1990, 2.4): in three dimensions as smooth as cubic splines
    are in one.

    Parameters
    ----------
    codes : (N,3) of the readings. weights : (N,3) of the cubed distances from them. plane : (4,3), of 1 and the codes.
    """

    codes: Float[np.ndarray, "N 3"]
    weights: Float[np.ndarray, "N 3"]
    plane: Float[np.ndarray, "4 3"]

    @classmethod
    def through(
        cls,
        codes: Float[np.ndarray, "N 3"],
        left: Float[np.ndarray, "N 3"],
        smoothing: float | Float[np.ndarray, " N"],
    ) -> Residual:
        """Fit residuals (N,3) at codes; `smoothing` 0 interpolates, larger values are smoother."""
        count = len(codes)
        system = np.zeros((count + 4, count + 4))
        system[:count, :count] = _cubed_distances(codes, codes) + np.diag(np.broadcast_to(smoothing, count))
        system[:count, count:] = _plane(codes)
        system[count:, :count] = system[:count, count:].T
        # By least squares where all codes lie in a plane, and the spline is not told beyond it.
        found = np.linalg.lstsq(system, np.concatenate([left, np.zeros((4, 3))]), rcond=None)[0]
        return cls(codes, found[:count], found[count:])

    def at(self, codes: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Evaluate the correction of the cube roots; clamped to the display's codes."""
        held = np.clip(codes, 0.0, 1.0)
        return _cubed_distances(held, self.codes) @ self.weights + _plane(held) @ self.plane


def _cubed_distances(codes: np.ndarray, others: np.ndarray) -> np.ndarray:
    squares = np.sum(codes**2, axis=1)[:, None] - 2.0 * codes @ others.T + np.sum(others**2, axis=1)
    np.maximum(squares, 0.0, out=squares)
    return squares * np.sqrt(squares)


def _plane(codes: np.ndarray) -> np.ndarray:
    return np.concatenate([np.ones((len(codes), 1)), codes], axis=1)


@dataclass(frozen=True, eq=False)
class DisplayModel:
    """Model of a display, from codes to XYZ.

    Parameters
    ----------
    name : as `model_fit.MODELS` has it.
    curves : tone curves of red, green and blue.
    mixture : (4,3) XYZ of black and of each channel alone at full code, less black; or (8,3), then also of the minimum
        of red and green, green and blue, red and blue, and of all three: the addition of a white sub-pixel.
    white_xyz : (3,) of the readings, the reference of cube roots.
    residual : correction of these, or None.
    power : exponent of the minima, which need not rise as the channels do.
    seen : (3,4) matrix and offset from XYZ of the readings to those of another observer, of `xyz`; files have none.
    """

    name: str
    curves: tuple[Curve, Curve, Curve]
    mixture: Float[np.ndarray, "F 3"]
    white_xyz: Float[np.ndarray, "3"]
    residual: Residual | None = None
    power: float = 1.0
    seen: Float[np.ndarray, "3 4"] | None = None

    def xyz(self, codes: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Compute XYZ in the unit of the readings, for codes within 0 and 1 and slightly beyond."""
        flat = np.asarray(codes, dtype=np.float64).reshape(-1, 3)
        found = self.mixed(flat)
        if self.residual is not None:
            found = from_roots(roots(found, self.white_xyz) + self.residual.at(flat), self.white_xyz)
        if self.seen is not None:
            found = found @ self.seen[:, :3].T + self.seen[:, 3]
        return found.reshape(np.shape(codes))

    def mixed(self, codes: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Compute XYZ without the residual."""
        return features(light_of(self.curves, codes), len(self.mixture), self.power) @ self.mixture

    @property
    def is_additive(self) -> bool:
        """True for a matrix after tone curves, which cannot model a display with non-additive channels."""
        return len(self.mixture) == _SUMS and self.residual is None

    @property
    def document(self) -> dict[str, Any]:
        """Stored fields, as JSON."""
        kept: dict[str, Any] = {
            "name": self.name,
            "curves": [curve.document for curve in self.curves],
            "mixture": self.mixture.tolist(),
            "white_xyz": self.white_xyz.tolist(),
            "power": self.power,
        }
        if self.residual is not None:
            kept["residual"] = {
                "codes": self.residual.codes.tolist(),
                "weights": self.residual.weights.tolist(),
                "plane": self.residual.plane.tolist(),
            }
        return kept

    @classmethod
    def of_document(cls, document: dict[str, Any]) -> DisplayModel:
        """Return the model that a file stores.

        Raises
        ------
        KeyError, TypeError, ValueError : an invalid one.
        """
        red, green, blue = (curve_of(one) for one in document["curves"])
        mixture, white = (np.array(document[key], dtype=np.float64) for key in ("mixture", "white_xyz"))
        if mixture.shape not in ((_SUMS, 3), (_MINIMA, 3)) or white.shape != (3,):
            raise ValueError(f"a mixture of shape {mixture.shape}")
        residual = None
        if kept := document.get("residual"):
            residual = Residual(*(np.array(kept[key], dtype=np.float64) for key in ("codes", "weights", "plane")))
        return cls(str(document["name"]), (red, green, blue), mixture, white, residual, float(document["power"]))


def light_of(curves: tuple[Curve, Curve, Curve], codes: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    """Compute the light of each channel by its own curve."""
    return np.stack([curve.at(codes[:, at]) for at, curve in enumerate(curves)], axis=1)


def features(light: Float[np.ndarray, "N 3"], count: int, power: float = 1.0) -> Float[np.ndarray, "N F"]:
    """Compute terms of a mixture: 1, the channels, and for eight of them the minima of pairs and of all, to a power.

    Channels below 0 have minima of 0, so that codes beyond the display's own continue as its channels do.
    """
    columns = [np.ones(len(light)), *light.T]
    if count == _MINIMA:
        red, green, blue = light.T
        smaller = np.stack([np.minimum(red, green), np.minimum(green, blue), np.minimum(red, blue), light.min(axis=1)])
        columns += [*(np.maximum(smaller, 0.0) ** power)]
    return np.stack(columns, axis=1)


def roots(xyz: Float[np.ndarray, "*batch 3"], white_xyz: Float[np.ndarray, "3"]) -> Float[np.ndarray, "*batch 3"]:
    """Compute cube roots of XYZ relative to white, in which equal steps are about equally visible, near black too."""
    return np.cbrt(xyz / white_xyz + FLOOR)


def from_roots(
    roots: Float[np.ndarray, "*batch 3"], white_xyz: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "*batch 3"]:
    """Return the XYZ that `roots` made these of."""
    return white_xyz * (roots**3 - FLOOR)
