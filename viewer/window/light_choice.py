"""Choice of light in the window: lamps, a booth or a map instead of the scene's lights, rotated and dimmed."""

from __future__ import annotations

from dataclasses import dataclass

from ...lighting.environment.booth import LAMPS
from ...runtime.errors import InputError
from ...spectral.upsampling import METHODS
from .checks import check_known, check_positive, check_text, check_within

#: Least dimming factor, since a light without power has no white.
LEAST_DIMMING = 1e-3


@dataclass(frozen=True)
class Lamp:
    """Lamp by name, with its share in a blend.

    name : an illuminant, a file of spectra, or an emission of the catalogue (`lighting.scene_file.lamps`).
    entry : spectrum of a file with several, by name or number. share : of the luminance, on any scale.
    """

    name: str
    share: float = 1.0
    entry: str | None = None

    def __post_init__(self) -> None:
        check_text(self.name, "name")
        check_positive(self.share, "share")
        if self.entry is not None:
            check_text(self.entry, "entry")


@dataclass(frozen=True)
class LightChoice:
    """Choice of lights, or of their spectra, instead of the scene's; by default the scene's own.

    Parameters
    ----------
    lamps : replace each light's spectrum at the same strength: one, or several blended by luminance.
    booth : light booth instead of all lights, by the name of its lamp.
    map : environment map instead of all lights. uplift : method for spectra from its colours, if neither it nor `lamps`
        state them.
    rotation_deg : of all lights about the vertical through the scene's centre, anticlockwise seen from above.
    dimming : factor on their strength; the reference illuminance stays, so that the image gets darker.

    Raises
    ------
    InputError, UnknownNameError : both booth and map, an unknown booth, numbers out of range.
    """

    lamps: tuple[Lamp, ...] = ()
    booth: str | None = None
    map: str | None = None
    uplift: str | None = None
    rotation_deg: float = 0.0
    dimming: float = 1.0

    def __post_init__(self) -> None:
        if self.booth is not None:
            check_known(self.booth, LAMPS, "booth", "booth")
        if self.map is not None:
            check_text(self.map, "map")
            if self.booth is not None:
                found = f"booth {self.booth} and map {self.map}"
                raise InputError("two lights from all around", field="map", found=found, expected="one of the two")
        if self.uplift is not None:
            check_known(self.uplift, METHODS, "uplift", "uplift")
        check_within(self.rotation_deg, -360.0, 360.0, "rotation_deg", "degrees")
        check_within(self.dimming, LEAST_DIMMING, 1.0, "dimming")

    @classmethod
    def named(cls, name: str) -> LightChoice:
        """Return the choice of one lamp for all lights."""
        return cls(lamps=(Lamp(name),))

    @property
    def words(self) -> str:
        """Description of the light with all its settings."""
        total = sum(one.share for one in self.lamps)
        named = [f"{one.name}{f' [{one.entry}]' if one.entry else ''}" for one in self.lamps]
        if len(named) > 1:
            named = [f"{name} {one.share / total:.0%}" for name, one in zip(named, self.lamps, strict=True)]
        around = f"booth {self.booth}" if self.booth else f"map {self.map}" if self.map else ""
        said = [around, " + ".join(named) or ("" if around else "the scene's lights")]
        if self.rotation_deg:
            said.append(f"turned by {self.rotation_deg:g}°")
        if self.dimming != 1.0:
            said.append(f"dimmed to {self.dimming:.3g}")
        return ", ".join(filter(None, said))
