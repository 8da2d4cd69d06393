"""Error of a display against its claim: sRGB, Display P3, Adobe RGB, or its ICC profile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.difference import delta_e_xyz
from ...spectral.observers import observer, observer_name
from ...spectral.srgb import srgb_to_linear
from .icc_profile import PREFIX, DisplayProfile, read_display_profile
from .readings import Readings


@dataclass(frozen=True, eq=False)
class Claim:
    """Colour space that a display may claim. primaries : (3,2) chromaticities x, y; white: D65."""

    name: str
    primaries: Float[np.ndarray, "3 2"]
    curve: Callable[[np.ndarray], np.ndarray]

    def xyz(self, codes: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Compute XYZ of codes, Y of white 1."""
        parts = _xyz(self.primaries)
        white = _xyz(np.array([[0.3127, 0.3290]]))[0]
        return self.curve(codes) @ (np.linalg.solve(parts.T, white)[:, None] * parts)


def _xyz(xy: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 3"]:
    """XYZ of Y = 1."""
    return np.stack([xy[:, 0] / xy[:, 1], np.ones(len(xy)), (1.0 - xy.sum(axis=1)) / xy[:, 1]], axis=1)


#: By the words of `--against`: IEC 61966-2-1, SMPTE EG 432-1 with the curve of sRGB, Adobe RGB (1998).
CLAIMS = {
    "sRGB": Claim("sRGB", np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]]), srgb_to_linear),
    "P3": Claim("Display P3", np.array([[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]]), srgb_to_linear),
    "AdobeRGB": Claim(
        "Adobe RGB (1998)",
        np.array([[0.64, 0.33], [0.21, 0.71], [0.15, 0.06]]),
        lambda codes: codes ** (563.0 / 256.0),
    ),
}


@dataclass(frozen=True, eq=False)
class ProfileClaim:
    """Claim of an ICC profile: the colours that it assigns to its display."""

    profile: DisplayProfile

    @property
    def name(self) -> str:
        """The profile's description and file."""
        return f"“{self.profile.name}” ({self.profile.path})"

    def xyz(self, codes: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Compute XYZ of codes, Y of white 1, under the display's own white."""
        return self.profile.xyz(codes)


def claim_named(name: str) -> Claim | ProfileClaim:
    """Return the claim of a word of `--against`, or of the file of a profile.

    Raises
    ------
    UnknownNameError : no such claim. InputError : an unusable profile, or one without a stated white.
    """
    if name in CLAIMS:
        return CLAIMS[name]
    if name.startswith(PREFIX) or Path(name).suffix.lower() in (".icc", ".icm"):
        profile = read_display_profile(name.removeprefix(PREFIX))
        if profile.white_xyz is None:
            raise InputError(
                "the profile does not say which white its display has",
                file=profile.path,
                field="tags wtpt and chad",
                found="a white of D50",
                expected="the display's own white",
                hint="compare with sRGB, P3 or AdobeRGB, or make the profile with a program that writes it",
            )
        return ProfileClaim(profile)
    raise UnknownNameError("claim", name, [*CLAIMS, "PROFILE.icc"], field="--against")


# By red, green and blue.
_CORNERS = {
    "100": "red",
    "010": "green",
    "001": "blue",
    "011": "cyan",
    "101": "magenta",
    "110": "yellow",
    "000": "black",
}


@dataclass(frozen=True, eq=False)
class Held:
    """Comparison of a display with its claim: ΔE94 with the claim as the reference, relative to the claim's white.

    white : of white at its own luminance. delta_e : (N,) by patch. corners : by name, of full codes.
    """

    claim: Claim | ProfileClaim
    readings: Readings
    white: float
    delta_e: Float[np.ndarray, " N"]
    corners: dict[str, float]


def held_to(readings: Readings, name: str) -> Held:
    """Compare readings of any luminance with a claim.

    Raises
    ------
    UnknownNameError, InputError : as of `claim_named`; white was not measured; readings of another observer than that
        of 1931, for whom standards and profiles are.
    """
    if observer_name(readings.observer) != "1931_2":
        raise InputError(
            "readings of another observer than the claim's",
            file=readings.source or None,
            field="observer",
            found=f"XYZ of {observer(readings.observer).name}",
            expected=f"XYZ of {observer('1931_2').name}, for whom {name} is",
            hint="--observer 1931_2 has them made of the spectra, where the file has spectra",
        )
    claim, averaged = claim_named(name), readings.averaged()
    luminance = averaged.white_xyz[1]
    wanted = claim.xyz(averaged.codes) * luminance
    white = claim.xyz(np.ones((1, 3)))[0] * luminance
    apart = delta_e_xyz(wanted, averaged.xyz, white)
    corners = {}
    for codes, value in zip(averaged.codes, apart, strict=True):
        name = _CORNERS.get("".join(f"{code:g}" for code in codes), "")
        if name:
            corners[name] = float(value)
    return Held(claim, averaged, float(delta_e_xyz(white, averaged.white_xyz, white)), apart, corners)
