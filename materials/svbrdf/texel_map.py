"""One property of a surface, texel by texel, in few bytes: codes of a picture, and their decoding."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError
from ...spectral.srgb import srgb_to_linear


@dataclass(frozen=True, eq=False)
class TexelMap:
    """scale x decoded + offset at every texel; a map of one texel is the same everywhere.

    Parameters
    ----------
    values : (H,W,C) uint8 or uint16, which are fractions of their largest code, or floats, as they stand.
    srgb : True where integers are encoded as sRGB (IEC 61966-2-1).
    scale, offset : one number, or C.

    Raises
    ------
    InputError : no picture, no texels, or numbers that are not finite.
    """

    values: np.ndarray
    srgb: bool = False
    scale: tuple[float, ...] = (1.0,)
    offset: tuple[float, ...] = (0.0,)

    def __post_init__(self) -> None:
        if self.values.ndim != 3 or not self.values.size:
            raise InputError("not a map", field="values", found=self.values.shape, expected="(H, W, C)")
        if self.values.dtype.kind not in "uf" or (self.values.dtype.kind == "u" and self.values.dtype.itemsize > 2):
            raise InputError("not a map", field="values", found=self.values.dtype, expected="8 or 16 bits, or floats")
        if self.values.dtype.kind == "f" and not np.isfinite(self.values).all():
            raise InputError("not a finite number", field="values", expected="finite values")

    @classmethod
    def constant(cls, *numbers: float) -> TexelMap:
        """Make a map of one texel, the same C numbers everywhere."""
        return cls(np.array(numbers, dtype=np.float64).reshape(1, 1, -1))

    @property
    def size(self) -> tuple[int, int]:
        """(H, W)."""
        return self.values.shape[0], self.values.shape[1]

    @cached_property
    def _decoded(self) -> Float[np.ndarray, " codes"]:
        """Value of each code."""
        most = np.iinfo(self.values.dtype).max
        part = np.arange(most + 1) / most
        return srgb_to_linear(part) if self.srgb else part

    def decoded(self, codes: np.ndarray) -> Float[np.ndarray, "*texels C"]:
        """Decode some of `values`."""
        found = self._decoded[codes] if codes.dtype.kind == "u" else codes.astype(np.float64)
        return found * np.asarray(self.scale) + np.asarray(self.offset)

    def at(
        self, rows: Int[np.ndarray, "*texels"], columns: Int[np.ndarray, "*texels"]
    ) -> Float[np.ndarray, "*texels C"]:
        """Return the numbers of texels."""
        if self.size == (1, 1):
            return np.broadcast_to(self.decoded(self.values[0, 0]), (*rows.shape, self.values.shape[2]))
        return self.decoded(self.values[rows, columns])

    def parameters(self, name: str) -> dict[str, Any]:
        """Return the stored parameters, with names prefixed by `name`."""
        kept: dict[str, Any] = {f"{name}.values": self.values}
        for key, number, usual in (("scale", self.scale, (1.0,)), ("offset", self.offset, (0.0,))):
            kept |= {f"{name}.{key}": np.array(number)} if number != usual else {}
        return kept | ({f"{name}.encoding": "sRGB"} if self.srgb else {})

    @classmethod
    def from_parameters(cls, kept: Mapping[str, Any], name: str) -> TexelMap:
        """Return the map whose `parameters(name)` these are; KeyError if there is none."""

        def numbers(key: str, usual: float) -> tuple[float, ...]:
            return tuple(np.atleast_1d(kept.get(f"{name}.{key}", usual)).astype(float).tolist())

        srgb = str(kept.get(f"{name}.encoding", "")) == "sRGB"
        return cls(np.asarray(kept[f"{name}.values"]), srgb, numbers("scale", 1.0), numbers("offset", 0.0))
