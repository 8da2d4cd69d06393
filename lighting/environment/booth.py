"""Light booths as environment lights, and their lamps by trade name."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.illuminants import BOOTH_NAMES, HORIZON, HORIZON_K, illuminant
from ...spectral.spectrum import Spectrum
from ..vectors import Number
from . import latlong
from .box import PATCHES, RIM, Box
from .environment import EnvironmentLight

#: Keys of a booth in scene files, beside those of every light.
KEYS = {
    "booth": "text",
    "width": "number",
    "height": "number",
    "depth": "number",
    "wall_reflectance": "number",
    "illuminance_lux": "number",
    "rotation_deg": "number",
}
#: Munsell N7, the grey that interiors are painted in: Y of value 7 by ASTM D1535, as a share of the perfect diffuser.
MUNSELL_N7 = 0.42
#: The near-ultraviolet tube: middle and full width at half maximum of its band, nm; ends of the ultraviolet of D65.
UV_TUBE_NM, UV_WIDTH_NM, UV_NM = 365.0, 20.0, (300.0, 400.0)
#: Texels of the map, high and wide: 1.4 degrees each; and rays along each side of a texel.
TEXELS, RAYS = (128, 256), 3
#: Height of the sample over the middle of the floor, as a share of the booth's.
SAMPLE_HEIGHT = 0.25


def light_booth(
    booth: str | None = None,
    spectrum: Spectrum | None = None,
    *,
    width: Number = 0.7,
    height: Number = 0.6,
    depth: Number = 0.5,
    wall_reflectance: Number = MUNSELL_N7,
    illuminance_lux: Number = 1000.0,
    rotation_deg: Number = 0.0,
    name: str = "light",
    spectrum_name: str = "",
) -> EnvironmentLight:
    """Return a light booth as an environment of one spectrum: a diffuse panel overhead, grey walls, an open front (+z).

    Interreflection between the walls is solved by radiosity (`box.Box`); their grey is spectrally neutral, so that all
    light has the lamp's spectrum. The map is rendered from the sample's place over the middle of the floor and treated
    as infinitely distant: parallax across the sample is neglected, and so are the sample's shadow on the walls and the
    light that it reflects onto them. Outside is darkness.

    Parameters
    ----------
    booth : a lamp, one of `LAMPS`; alternatively `spectrum`, the lamp's emission.
    width, height, depth : of the interior, metres, > 0; only their ratios matter.
    wall_reflectance : of the interior, 0 to 1; Munsell N7.
    illuminance_lux : on a horizontal plane at the sample, > 0. ASTM D1729 asks for 1080 to 1340 lx for critical colour
        judgement.
    rotation_deg : of the booth about the vertical; at 0 its front faces +z, towards a camera that frames the scene.

    Raises
    ------
    InputError, UnknownNameError
        Unknown booth; neither booth nor spectrum, or both; a size or reflectance out of range.
    """
    if (booth is None) == (spectrum is None):
        raise InputError(
            "a booth is lit by one lamp",
            field="booth",
            found="neither booth nor spectrum" if booth is None else "booth and spectrum",
            expected=f"booth, one of {', '.join(LAMPS)}; or spectrum, the lamp of your own booth",
        )
    for field, side in (("width", width), ("height", height), ("depth", depth)):
        if not 0.0 < side < np.inf:
            raise InputError("a booth of no size", field=field, found=side, expected="more than 0, finite")
    if not 0.0 <= wall_reflectance <= 1.0:
        raise InputError(
            "not a reflectance",
            field="wall_reflectance",
            found=wall_reflectance,
            expected="0 to 1",
            hint="give a fraction, not per cent" if wall_reflectance > 1.0 else None,
        )
    notes: tuple[str, ...] = ()
    if booth is not None:
        spectrum, said = lamp_of(booth)
        notes, spectrum_name = ((f"booth {booth}: {said}",), spectrum_name or f"booth {booth}")
    assert spectrum is not None
    panel = f"{1.0 - 2.0 * RIM / PATCHES:.0%}"
    notes += (
        f"a booth of {width:g} x {height:g} x {depth:g} m, {panel} of its ceiling's width and depth a bright panel, "
        f"walls of reflectance {wall_reflectance:g}; seen from one place, as if infinitely far off: parallax over the "
        "sample is left out",
    )
    field = booth_map((width, height, depth), wall_reflectance)
    return EnvironmentLight(
        field[None], (spectrum,), illuminance_lux, rotation_deg, name, spectrum_name, notes=notes
    )  # fmt: skip


def booth_map(size: tuple[Number, Number, Number], wall_reflectance: Number) -> Float[np.ndarray, "H W"]:
    """Render the luminance around the sample's place, latitude-longitude, the panel's being 1; a texel is the mean of
    its rays.
    """
    box = Box(size, wall_reflectance)
    origin = np.array([0.0, (SAMPLE_HEIGHT - 0.5) * size[1], 0.0])
    fine = latlong.texel_directions(TEXELS[0] * RAYS, TEXELS[1] * RAYS)
    seen = box.luminance(origin, fine.reshape(-1, 3))
    return seen.reshape(TEXELS[0], RAYS, TEXELS[1], RAYS).mean(axis=(1, 3))


def lamp_of(booth: str) -> tuple[Spectrum, str]:
    """Return the emission of the lamp with a trade name, and its description; raises `UnknownNameError`.

    >>> lamp_of("TL84")[1]
    'CIE FL11'
    """
    by_folded = {name.casefold(): name for name in LAMPS}
    if booth.casefold() not in by_folded:
        raise UnknownNameError("booth", booth, LAMPS, field="booth")
    return LAMPS[by_folded[booth.casefold()]]()


def _horizon() -> tuple[Spectrum, str]:
    return illuminant(HORIZON), f"a Planckian radiator of {HORIZON_K:g} K"


@cache
def _daylight_and_uv() -> tuple[Spectrum, str]:
    daylight = illuminant("D65")
    nm = np.arange(UV_NM[0], daylight.wavelengths_nm[-1] + 1.0)
    power = np.interp(nm, daylight.wavelengths_nm, daylight.samples)
    tube = np.exp(-4.0 * np.log(2.0) * ((nm - UV_TUBE_NM) / UV_WIDTH_NM) ** 2)
    tube *= np.trapezoid(power[nm <= UV_NM[1]], nm[nm <= UV_NM[1]]) / np.trapezoid(tube, nm)
    words = (
        f"CIE D65 and beside it a near-ultraviolet tube, a Gaussian about {UV_TUBE_NM:g} nm of {UV_WIDTH_NM:g} nm full "
        f"width at half maximum, with as much power as D65 has from {UV_NM[0]:g} to {UV_NM[1]:g} nm: assumed, since "
        "tubes differ; name a measured lamp where it matters"
    )
    return Spectrum.sampled(nm, power + tube, "emission"), words


def _cie(name: str) -> Callable[[], tuple[Spectrum, str]]:
    return lambda: (illuminant(name), f"CIE {name}")


#: The lamps of booths by the names that stand on them. Ultraviolet alone is not among them: under it there is no white
#: that a colour could be judged by, so it comes with the daylight to which it is added.
LAMPS: dict[str, Callable[[], tuple[Spectrum, str]]] = {
    "D65": _cie("D65"),
    "A": _cie("A"),
    **{name: _cie(light) for name, light in BOOTH_NAMES.items()},
    "UV": _daylight_and_uv,
    HORIZON: _horizon,
}
