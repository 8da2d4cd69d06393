"""Direction in which a sample differs, in words: "lighter, yellower"."""

from __future__ import annotations

import numpy as np

from ...spectral.axis_letters import Lab
from ...spectral.difference import Differences

#: Chroma below which a colour counts as grey: its hue is no direction, a* and b* are.
GREY = 5.0
#: Degrees of hue: what is as near to red, yellow, green or blue turns beyond it.
NEAR = 10.0
#: Degrees that a hue may turn by and still be on its way to a neighbour.
FAR = 60.0
#: Degrees beyond the next of red, yellow, green and blue at which a hue is no longer called by it.
PAST = 15.0
# A component below this share of the largest is not spoken of.
_WORTH = 0.3
_TOWARDS = ("redder", "yellower", "greener", "bluer")


def direction(standard: Lab, off: Differences, least: float = 0.0) -> str:
    """Describe a difference, the largest part first; "alike" if no part exceeds `least`.

    For colours, hue is named by the neighbour it moves to, from red over yellow, green and blue to red again; more
    chroma is "stronger", less "greyer". For greys, and for hue differences above `FAR` or by `PAST` beyond the
    neighbour, a* and b* are named.

    least : smallest difference in CIELAB that is named.
    """
    lightness = (float(off.lightness), "lighter", "darker")
    sample = standard[1:] + np.array([float(off.a), float(off.b)])
    turned = np.degrees(np.arctan2(standard[1] * sample[1] - standard[2] * sample[0], standard[1:] @ sample))
    if np.hypot(standard[1], standard[2]) < GREY or abs(turned) > FAR or _past(standard, float(turned)):
        parts = [lightness, (float(off.a), "redder", "greener"), (float(off.b), "yellower", "bluer")]
    else:
        hue = float(np.degrees(np.arctan2(standard[2], standard[1])) % 360.0)
        forth, back = (int((hue + NEAR) // 90.0) + 1) % 4, (int(np.ceil((hue - NEAR) / 90.0)) - 1) % 4
        parts = [lightness, (float(off.chroma), "stronger", "greyer")]
        parts.append((float(off.hue), _TOWARDS[forth], _TOWARDS[back]))
    named = sorted(((abs(value), more if value > 0 else less) for value, more, less in parts), reverse=True)
    worth = max(_WORTH * named[0][0], least)
    return ", ".join(word for size, word in named if size >= worth and size > 0.0) or "alike"


def _past(standard: Lab, turned: float) -> bool:
    """Return True if a hue rotated by that many degrees is beyond the neighbour it moved to."""
    hue = float(np.degrees(np.arctan2(standard[2], standard[1])) % 360.0)
    if turned >= 0.0:
        neighbour = 90.0 * (int((hue + NEAR) // 90.0) + 1)
        return hue + turned > neighbour + PAST
    neighbour = 90.0 * (int(np.ceil((hue - NEAR) / 90.0)) - 1)
    return hue + turned < neighbour - PAST
