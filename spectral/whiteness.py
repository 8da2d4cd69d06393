"""Whiteness, tint and yellowness of near-white samples: indices, each for certain lights and observers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from ..runtime.errors import ComparisonError, UnknownNameError
from .illuminants import illuminant
from .metamerism import Conditions
from .observers import observer
from .sample import Sample, same_conditions

WhitenessMethod = Literal["CIE 2004", "ASTM E313", "ASTM E313-73"]

_DAYLIGHT = Conditions("D65", "1964_10")
# Weight of x in the tint for an observer (CIE 15:2004); that of y is 650 for both.
_TINT = {"1931_2": 1000.0, "1964_10": 900.0}
# x and y of the perfect diffuser as ASTM E313 prints them, to four digits.
_DIFFUSER = {
    ("C", "1931_2"): (0.3101, 0.3161),
    ("D50", "1931_2"): (0.3457, 0.3585),
    ("D65", "1931_2"): (0.3127, 0.3290),
    ("C", "1964_10"): (0.3104, 0.3191),
    ("D50", "1964_10"): (0.3477, 0.3595),
    ("D65", "1964_10"): (0.3138, 0.3310),
}
# C_X and C_Z of yellowness, ASTM E313.
_YELLOW = {
    ("C", "1931_2"): (1.2769, 1.0592),
    ("D65", "1931_2"): (1.2985, 1.1335),
    ("C", "1964_10"): (1.2871, 1.0781),
    ("D65", "1964_10"): (1.3013, 1.1498),
}
_DEFINED = {
    "CIE 2004": (("D65", "1931_2"), ("D65", "1964_10")),
    "ASTM E313": tuple(_DIFFUSER),
    "ASTM E313-73": (("C", "1931_2"),),
}
# Beyond these a number is no whiteness: of CIE 15:2004; the last, Y, of ASTM E313, 5.2.
_LEAST_WHITENESS, _LEAST_TINT, _MOST_TINT, _LEAST_Y = 40.0, -4.0, 2.0, 65.0


@dataclass(frozen=True)
class Whiteness:
    """Whiteness, tint and yellowness of one sample.

    index : 100 for the perfect diffuser, more for bluer and brighter samples. tint : positive is greenish, negative
    reddish; None if the method has none.
    """

    index: float
    tint: float | None = None


def whiteness(sample: Sample, conditions: Conditions = _DAYLIGHT, method: WhitenessMethod = "CIE 2004") -> Whiteness:
    """Compute whiteness, and tint, of a commercial white.

    method : "CIE 2004" (CIE 15:2004, W and T_w, W_10 and T_w,10; D65), "ASTM E313" (since 1998 the same equations, for
        C, D50 and D65, with x and y of the diffuser to four digits) or "ASTM E313-73" (3.388 Z - 3 Y, for C and 2
        degrees; it has no tint).

    Raises
    ------
    UnknownNameError : an unknown illuminant, observer or method.
    ComparisonError : the method is not for this illuminant and observer; the sample is outside its range of whites; or
        its colour under them is not known.

    >>> whiteness(Sample("diffuser", "", seen=lambda light, eye: eye.white(light)))
    Whiteness(index=100.0, tint=0.0)
    """
    if method not in get_args(WhitenessMethod):
        raise UnknownNameError("whiteness", method, get_args(WhitenessMethod))
    key = _key(f"whiteness {method}", conditions, _DEFINED[method])
    xyz = _seen(sample, conditions)
    index, tint = _equations(xyz, key, method)
    found = Whiteness(float(index), None if tint is None else float(tint))
    if method == "CIE 2004":
        _check_limits(sample, found, float(xyz[1]))
    else:
        _check_bright(sample, xyz, method)
    return found


def yellowness(sample: Sample, conditions: Conditions = _DAYLIGHT) -> float:
    """Compute yellowness of ASTM E313, for C and D65: 0 for the perfect diffuser, negative for bluish samples.

    It measures yellow or blue relative to white; for reddish or greenish samples it is meaningless.

    Raises
    ------
    ComparisonError : another illuminant or observer; a black sample; or its colour under them is not known.
    """
    key = _key("yellowness ASTM E313", conditions, _YELLOW)
    return float(_yellowness(_seen(sample, conditions), key))


def index_of_xyz(
    xyz: Float[np.ndarray, "*batch 3"], conditions: Conditions, method: WhitenessMethod | None
) -> Float[np.ndarray, "*batch"]:
    """Compute whiteness by a method, or yellowness if it is None, of XYZ with Y = 1 for the perfect diffuser.

    The equations alone, without their limits, for the scatter of an index with XYZ.

    Raises
    ------
    ComparisonError : another illuminant or observer.
    """
    if method is None:
        return _yellowness(100.0 * xyz, _key("yellowness ASTM E313", conditions, _YELLOW))
    return _equations(100.0 * xyz, _key(f"whiteness {method}", conditions, _DEFINED[method]), method)[0]


def defined_for(conditions: Conditions, method: WhitenessMethod | None) -> bool:
    """Return whether a whiteness, or yellowness if the method is None, is defined for an illuminant and observer."""
    defined = _YELLOW if method is None else _DEFINED[method]
    return any(same_conditions(key, (conditions.illuminant, conditions.observer)) for key in defined)


def _equations(
    xyz: Float[np.ndarray, "*batch 3"], key: tuple[str, str], method: WhitenessMethod
) -> tuple[Float[np.ndarray, "*batch"], Float[np.ndarray, "*batch"] | None]:
    """Compute index and tint; Y of the perfect diffuser is 100."""
    if method == "ASTM E313-73":
        return np.asarray(3.388 * xyz[..., 2] - 3.0 * xyz[..., 1]), None
    light, eye = key
    white = _DIFFUSER[key] if method == "ASTM E313" else _chromaticity(observer(eye).white(illuminant(light)))
    off = np.subtract(white, _chromaticity(xyz))
    return np.asarray(xyz[..., 1] + off @ [800.0, 1700.0]), np.asarray(off @ [_TINT[eye], -650.0])


def _yellowness(xyz: Float[np.ndarray, "*batch 3"], key: tuple[str, str]) -> Float[np.ndarray, "*batch"]:
    along_x, along_z = _YELLOW[key]
    return np.asarray(100.0 * (along_x * xyz[..., 0] - along_z * xyz[..., 2]) / xyz[..., 1])


def _key(what: str, conditions: Conditions, defined: Iterable[tuple[str, str]]) -> tuple[str, str]:
    """Return the names of the conditions in the tables, from any of their names."""
    # A name that nobody knows is told as one.
    _ = illuminant(conditions.illuminant), observer(conditions.observer)
    for key in defined:
        if same_conditions(key, (conditions.illuminant, conditions.observer)):
            return key
    known = "; ".join(Conditions(*key).words for key in defined)
    raise ComparisonError(f"{what} is not defined for {conditions.words}; it is for {known}")


def _seen(sample: Sample, conditions: Conditions) -> Float[np.ndarray, "3"]:
    """Compute XYZ, Y of the perfect diffuser being 100."""
    xyz = 100.0 * sample.xyz(conditions.illuminant, conditions.observer)
    if not (np.isfinite(xyz).all() and xyz[1] > 0.0 and xyz.sum() > 0.0):
        raise ComparisonError(f"{sample.name}: black under {conditions.words}, so that it has no whiteness")
    return xyz


def _chromaticity(xyz: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 2"]:
    return xyz[..., :2] / xyz.sum(axis=-1, keepdims=True)


def _check_bright(sample: Sample, xyz: Float[np.ndarray, "3"], method: str) -> None:
    if not xyz[1] > _LEAST_Y:
        raise ComparisonError(
            f"{sample.name}: too dark for a whiteness: {method} tells of samples with Y above {_LEAST_Y:g}, and its is "
            f"{xyz[1]:.1f}"
        )


def _check_limits(sample: Sample, found: Whiteness, luminance: float) -> None:
    most = 5.0 * luminance - 280.0
    if not _LEAST_WHITENESS < found.index < most:
        raise ComparisonError(
            f"{sample.name}: no commercial white, for CIE 2004 tells of a whiteness above {_LEAST_WHITENESS:g} and "
            f"below 5 Y - 280 = {most:.1f}, and it would be {found.index:.1f}"
        )
    if found.tint is None or not _LEAST_TINT < found.tint < _MOST_TINT:
        raise ComparisonError(
            f"{sample.name}: too coloured for a whiteness: CIE 2004 tells of a tint above {_LEAST_TINT:g} and below "
            f"{_MOST_TINT:g}, and it would be {found.tint:.1f}"
        )
