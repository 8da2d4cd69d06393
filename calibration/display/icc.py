"""Display as an ICC profile of version 2 with a matrix and tone curves, for programs that support nothing else."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.files import written_whole
from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import delta_e_xyz
from .model import DisplayModel
from .model_fit import fit, why_not
from .readings import Readings

#: White of the profile connection space (ICC.1:2001-04, 6.4.3), and entries of a curve.
D50_XYZ = np.array([0.9642, 1.0, 0.8249])
ENTRIES = 1024


@dataclass(frozen=True, eq=False)
class MatrixProfile:
    """Matrix profile of a display.

    name : of the display. model : a matrix after tone curves, in the unit of its readings.
    """

    name: str
    model: DisplayModel

    @property
    def white(self) -> Float[np.ndarray, "3"]:
        """XYZ of white less black, Y = 1, written as the media white."""
        white = self.model.mixture[1:4].sum(axis=0)
        return white / white[1]

    @property
    def columns(self) -> Float[np.ndarray, "3 3"]:
        """XYZ of red, green and blue (rows) adapted to D50 by Bradford; they add up to D50."""
        primaries = self.model.mixture[1:4]
        return primaries / primaries.sum(axis=0)[1] @ adaptation_matrix(self.white, D50_XYZ).T

    @property
    def curves(self) -> Float[np.ndarray, "3 n"]:
        """Light of each channel by code."""
        codes = np.linspace(0.0, 1.0, ENTRIES)
        return np.clip(np.stack([curve.at(codes) for curve in self.model.curves]), 0.0, 1.0)

    def encoded(self) -> bytes:
        """Return the file, as of `encoded_profile`."""
        return encoded_profile(self.name, self.white, self.columns, self.curves)


def encoded_profile(
    name: str, white_xyz: Float[np.ndarray, "3"], columns: Float[np.ndarray, "3 3"], curves: Float[np.ndarray, "3 n"]
) -> bytes:
    """Return the bytes of a profile (ICC.1:2001-04, 6.1 to 6.5), without a time: equal displays are equal bytes.

    Parameters
    ----------
    name : in its description, ASCII only in version 2.
    white_xyz : the media white, Y = 1. columns : XYZ of red, green and blue (rows), relative to D50.
    curves : light of each channel by code, 0 to 1.
    """
    text = name.encode("ascii", "replace") + b"\0"
    described = b"desc" + bytes(4) + struct.pack(">I", len(text)) + text + bytes(8 + 2 + 1 + 67)
    tags: list[tuple[bytes, bytes]] = [
        (b"desc", described),
        (b"cprt", b"text" + bytes(4) + b"No copyright; use freely\0"),
        (b"wtpt", _xyz(white_xyz)),
    ]
    for channel, column, curve in zip(b"rgb", columns, curves, strict=True):
        tags.append((bytes([channel]) + b"XYZ", _xyz(column)))
        values = np.round(curve * 65535.0).astype(">u2").tobytes()
        tags.append((bytes([channel]) + b"TRC", b"curv" + bytes(4) + struct.pack(">I", len(curve)) + values))
    at = 128 + 4 + 12 * len(tags)
    table, body = struct.pack(">I", len(tags)), b""
    for signature, content in tags:
        content += bytes(-len(content) % 4)
        table += signature + struct.pack(">II", at + len(body), len(content))
        body += content
    size = at + len(body)
    head = struct.pack(">I", size) + bytes(4) + b"\x02\x40\0\0" + b"mntrRGB XYZ "
    head += struct.pack(">6H", 2000, 1, 1, 0, 0, 0) + b"acsp" + bytes(24) + struct.pack(">I", 0)
    head += struct.pack(">3i", *(round(value * 65536.0) for value in D50_XYZ))
    return head + bytes(128 - len(head)) + table + body


def _xyz(value: np.ndarray) -> bytes:
    return b"XYZ " + bytes(4) + struct.pack(">3i", *(round(float(one) * 65536.0) for one in value))


def matrix_profile(readings: Readings, name: str) -> MatrixProfile:
    """Make a matrix profile from averaged readings without drift.

    Curves are measured if there are ramps, else gains and gammas.

    Raises
    ------
    InputError : too few patches, no white or black.
    """
    kind = "gog" if why_not("matrix-trc", readings) else "matrix-trc"
    return MatrixProfile(name, fit(kind, readings))


def profile_error(profile: MatrixProfile, readings: Readings) -> tuple[float, float]:
    """Compute ΔE94 of the readings from the profile's own numbers: mean and largest. Black is that of the readings."""
    white = readings.white_xyz
    apart = delta_e_xyz(readings.xyz, profile.model.xyz(readings.codes), white)
    return float(apart.mean()), float(apart.max())


def write_profile(path: str | Path, profile: MatrixProfile) -> None:
    """Write the file, whole or not at all; errors as of `written_whole`."""
    with written_whole(path) as beside:
        beside.write_bytes(profile.encoded())
