"""Environment form of uniform materials: slices over a grid of viewers, each of Gaussians and a cosine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.palette import Palette
from ..core.environment_form import BENDS, EnvironmentForm, Lobes
from ..core.fit_error import FitError, LightError
from ..core.points import Points
from ..core.terms import TermShader

# The last viewer of a grid, radians short of grazing: there cos(theta_o) is 0 and slices have no limit that is seen.
LAST = 0.004
_ARRAYS = ("directions", "sharpness", "value")
# Columns of an error in a file.
_FIGURES = ("mean", "p95", "p99", "maximum")


def polar_angles(count: int) -> Float[np.ndarray, " count"]:
    """Compute theta_o of a grid's viewers, denser towards grazing, where slices change most, up to `LAST` before."""
    return (0.5 * np.pi - LAST) * (1.0 - (1.0 - np.linspace(0.0, 1.0, count)) ** 1.5)


def places_of(theta_o: Float[np.ndarray, " N"], count: int) -> Float[np.ndarray, " N"]:
    """Locate theta_o on `polar_angles(count)`, in nodes; clamped to the last."""
    share = np.clip(theta_o / (0.5 * np.pi - LAST), 0.0, 1.0)
    return (1.0 - (1.0 - share) ** (2.0 / 3.0)) * (count - 1)


@dataclass(frozen=True, eq=False)
class ViewSlices(EnvironmentForm):
    """Slices of T polar angles and A azimuths of the viewer; interpolation is linear in all numbers and in 1/sharpness.

    Parameters
    ----------
    directions (T,A,Q,3), sharpness (T,A,Q) : of the Gaussians; of isotropic materials (A = 1) with the viewer above +x,
        else at azimuths 2 pi a / A.
    value (T,A,Q+9,R) : the integral of each term over each Gaussian; last, for the cosine, pi times the coefficients of
        `bends`.
    palette : one entry of R spectra, 1/sr.
    error : measured against the original (`error`); None if it was not measured.

    Raises
    ------
    InputError : shapes that do not fit, or numbers that are not finite.
    """

    directions: Float[np.ndarray, "T A Q 3"]
    sharpness: Float[np.ndarray, "T A Q"]
    value: Float[np.ndarray, "T A QB R"]
    palette: Palette
    error: FitError | None = None
    bent = BENDS

    def __post_init__(self) -> None:
        shape = self.sharpness.shape
        whole = (*shape[:2], shape[2] + BENDS, self.palette.rank)
        if self.directions.shape != (*shape, 3) or self.value.shape != whole or shape[0] < 2:
            found = f"{self.directions.shape}, {shape}, {self.value.shape}"
            raise InputError(
                "slices do not fit", field="slices", found=found, expected=f"(T, A, Q, 3), (T, A, Q), {whole}"
            )
        if not all(np.isfinite(one).all() for one in (self.directions, self.sharpness, self.value)):
            raise InputError("slices are not finite", field="slices", found="NaN or infinity", expected="numbers")

    @property
    def count(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Number Q of Gaussians."""
        return self.sharpness.shape[2]

    @property
    def isotropic(self) -> bool:
        """True if the viewer's azimuth only rotates the slices."""
        return self.sharpness.shape[1] == 1

    def lobes(self, points: Points) -> Lobes:
        """Implement `EnvironmentForm.lobes`."""
        wo = points.wo
        flat = np.hypot(wo[:, 0], wo[:, 1])
        place = places_of(np.arctan2(flat, wo[:, 2]), len(self.value))
        below = np.minimum(place.astype(np.int64), len(self.value) - 2)
        weights = [(below, 1.0 - (place - below)), (below + 1, place - below)]
        azimuths = self.sharpness.shape[1]
        corners = [(t, np.zeros_like(t), w) for t, w in weights]
        if azimuths > 1:
            around = np.arctan2(wo[:, 1], wo[:, 0]) / (2.0 * np.pi) % 1.0 * azimuths
            first = np.floor(around).astype(np.int64)
            share = around - first
            sides = ((first % azimuths, 1.0 - share), ((first + 1) % azimuths, share))
            corners = [(t, a, w * v) for t, w in weights for a, v in sides]
        directions = _mixed(w[:, None, None] * self.directions[t, a] for t, a, w in corners)
        width = _mixed(w[:, None] / self.sharpness[t, a] for t, a, w in corners)
        value = _mixed(w[:, None, None] * self.value[t, a] for t, a, w in corners)
        directions = directions / np.linalg.norm(directions, axis=2, keepdims=True)
        frame = _in_plane(wo, flat) if self.isotropic else None
        return Lobes(directions, 1.0 / width, value[:, : self.count], value[:, self.count :], frame)

    def shader(self, filtered: bool = False) -> TermShader:
        """Make two textures: axes with 1/sharpness, a row per slice; and values, four terms per texel."""
        polar, azimuths, count, _ = self.directions.shape
        rows = polar * azimuths
        axes = np.zeros((rows, max(count, 1), 4), dtype=np.float32)
        axes[:, :count, :3] = self.directions.reshape(rows, count, 3)
        axes[:, :count, 3] = 1.0 / self.sharpness.reshape(rows, count)
        quads = -(-self.palette.rank // 4)
        values = np.zeros((rows, count + BENDS, quads * 4), dtype=np.float32)
        values[..., : self.palette.rank] = self.value.reshape(rows, count + BENDS, -1)
        return TermShader(
            Path(__file__).with_name("view_slices.glsl"),
            {"LOBES": count, "POLAR": polar, "AZIMUTHS": azimuths},
            {"axes": axes, "values": values.reshape(rows, (count + BENDS) * quads, 4)},
            {"quads": quads, "last": 0.5 * np.pi - LAST},
        )

    @property
    def key(self) -> tuple:
        """Identity of the array of values."""
        return "slices", id(self.value)

    @property
    def nbytes(self) -> int:
        """Bytes of its arrays, spectra included."""
        return sum(one.nbytes for one in (self.directions, self.sharpness, self.value, self.palette.values))

    def in_single_precision(self) -> ViewSlices:
        """Return the form with its numbers rounded as in a file."""
        arrays = {name: getattr(self, name).astype(np.float32).astype(np.float64) for name in _ARRAYS}
        return replace(self, **arrays)

    def stored(self) -> dict[str, Any]:
        """Return the stored fields, in single precision except the palette; with the error if it was measured."""
        kept: dict[str, Any] = {name: getattr(self, name).astype(np.float32) for name in _ARRAYS}
        kept["palette"] = self.palette.stored()
        return kept if self.error is None else {**kept, "error": _kept_error(self.error)}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any]) -> ViewSlices:
        """Return the form whose `stored()` this is; KeyError if a field is missing."""
        directions, sharpness, value = (np.asarray(kept[name], dtype=np.float64) for name in _ARRAYS)
        error = _error_from(kept["error"]) if "error" in kept else None
        return cls(directions, sharpness, value, Palette.from_stored(kept["palette"]), error)


def _kept_error(error: FitError) -> dict[str, Any]:
    """Encode the error: how it was measured, and a row of `_FIGURES` per light."""
    figures = [[getattr(one, name) for name in _FIGURES] for one in error.lights]
    words = {"light": error.light, "observer": error.observer, "protocol": error.protocol}
    return {**words, "lights": " ".join(one.light for one in error.lights), "figures": np.array(figures)}


def _error_from(kept: Mapping[str, Any]) -> FitError:
    names = kept["lights"].split()
    lights = {name: LightError(name, *map(float, row)) for name, row in zip(names, kept["figures"], strict=True)}
    worst = lights[kept["light"]]
    return FitError(
        *(worst.mean, worst.p95, worst.p99, worst.maximum),
        *(worst.light, kept["observer"], kept["protocol"]),
        relative_error=0.0,
        lights=tuple(lights.values()),
    )


def _in_plane(wo: Float[np.ndarray, "N 3"], flat: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N 3 3"]:
    """Compute axes, in rows, with x at the viewer's azimuth; arbitrary straight above, where `flat` is 0."""
    level = np.where(flat > 0.0, flat, 1.0)
    cosine, sine, zero = np.where(flat > 0.0, wo[:, 0] / level, 1.0), wo[:, 1] / level, np.zeros_like(flat)
    rows = [cosine, sine, zero], [-sine, cosine, zero], [zero, zero, np.ones_like(flat)]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


def _mixed(parts: Iterable[np.ndarray]) -> np.ndarray:
    return reduce(np.add, parts)
