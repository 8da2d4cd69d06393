"""Six displays with invented spectra and invented defects, and an instrument with stated noise in front of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...calibration.display.readings import Readings, ReadingSpectra
from ...spectral.observers import EFFICACY, observer

#: Noise of the instrument: standard deviation of X, Y and Z each, a share of the reading, and cd/m2 besides.
NOISE_SHARE, NOISE_CD_M2 = 0.0015, 0.003
NM = np.arange(380.0, 781.0, 2.0)


def _peaks(*peaks: tuple[float, float, float]) -> np.ndarray:
    """Return a sum of Gaussians: nm, standard deviation in nm, height."""
    return np.sum([h * np.exp(-0.5 * ((NM - at) / width) ** 2) for at, width, h in peaks], axis=0)


@dataclass(frozen=True, eq=False)
class SimulatedDisplay:
    """A display whose every defect is known.

    Parameters
    ----------
    name : of the kind of display.
    emitters : (K,L) spectra of what can send light, in any unit; the last is what leaks at code 0.
    drive : from codes (N,3) to how much each emitter sends (N,K).
    white_cd_m2 : luminance of white for the 1931 observer.
    """

    name: str
    emitters: Float[np.ndarray, "K L"]
    drive: Callable[[Float[np.ndarray, "N 3"]], Float[np.ndarray, "N K"]]
    white_cd_m2: float

    @cached_property
    def _radiance(self) -> Float[np.ndarray, "K L"]:
        """W/(sr m2 nm) of each emitter driven fully."""
        white = self.drive(np.ones((1, 3))) @ self.emitters
        y = EFFICACY * float((observer("1931_2").sensitivity(NM) @ white[0])[1])
        return self.emitters * (self.white_cd_m2 / y)

    def xyz(self, codes: Float[np.ndarray, "N 3"], eye: str = "1931_2") -> Float[np.ndarray, "N 3"]:
        """Compute what it shows, in cd/m2, without noise."""
        weights = EFFICACY * self._radiance @ observer(eye).sensitivity(NM).T
        return self.drive(np.asarray(codes, dtype=np.float64)) @ weights

    def spectra(self, codes: Float[np.ndarray, "N 3"]) -> ReadingSpectra:
        """Compute what it sends, without noise."""
        return ReadingSpectra(NM, self.drive(np.asarray(codes, dtype=np.float64)) @ self._radiance)

    def measured(
        self,
        codes: Float[np.ndarray, "N 3"],
        seed: int,
        drift: Callable[[np.ndarray], np.ndarray] | None = None,
        noise: float = 1.0,
    ) -> Readings:
        """Simulate what the instrument says of these codes in this order.

        drift : by what XYZ are multiplied, of the number of each reading over that of all, (N,) to (N,3).
        noise : of the stated noise, so many times.
        """
        xyz = self.xyz(codes)
        if drift is not None:
            xyz = xyz * drift(np.arange(len(codes)) / max(len(codes) - 1, 1))
        spread = np.random.default_rng(seed).standard_normal((2, *xyz.shape))
        xyz = xyz * (1.0 + noise * NOISE_SHARE * spread[0]) + noise * NOISE_CD_M2 * spread[1]
        return Readings(np.array(codes, dtype=np.float64), xyz, self.name, self.name, "simulated")


def _blue_led() -> np.ndarray:
    return _peaks((448.0, 9.0, 1.0))


def _power(codes: np.ndarray, gamma: float) -> np.ndarray:
    return np.clip(codes, 0.0, 1.0) ** gamma


def _srgb(codes: np.ndarray) -> np.ndarray:
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def _leaking(light: np.ndarray, leak: float) -> np.ndarray:
    return np.concatenate([light, np.full((len(light), 1), leak)], axis=1)


def _lcd_drive(codes: np.ndarray) -> np.ndarray:
    """S-shaped curves, a leak of a thousandth, and blue that half-open cells of any colour let through."""
    bent = codes + np.array([0.018, 0.022, 0.030]) * np.sin(2.0 * np.pi * codes) * (1.0 - codes)
    light = _power(bent, 2.25)
    light[:, 2] += 0.004 * np.sum(light * (1.0 - light), axis=1)
    return _leaking(light, 1e-3)


def _cross_talk_drive(codes: np.ndarray) -> np.ndarray:
    """Drive as an LCD, and each channel is pulled down by what its right-hand neighbour is driven with."""
    pulled = codes - 0.020 * codes * (1.0 - codes) * 4.0 * np.roll(codes, -1, axis=1)
    return _lcd_drive(pulled)


def _wrgb_drive(codes: np.ndarray) -> np.ndarray:
    """White sub-pixels take over what the three have in common, and add to it."""
    light = _power(codes, 2.2)
    common = light.min(axis=1, keepdims=True)
    white = 1.3 * common**1.08
    own = light - 0.35 * common
    return _leaking(np.concatenate([own, white], axis=1), 1e-5)


def _crt_drive(codes: np.ndarray) -> np.ndarray:
    """Drive a tube: a gun's cut-off, a supply that gives way by 2 % under full load, and a tube that is never quite
    dark."""
    light = np.maximum((codes + 0.03) / 1.03, 0.0) ** 2.4 - (0.03 / 1.03) ** 2.4
    return _leaking(light * (1.0 - 0.02 * light.mean(axis=1, keepdims=True)), 2e-3)


def _oled_drive(codes: np.ndarray) -> np.ndarray:
    """Drive an OLED: the first codes stay dark, and a common supply costs each channel 1 % of what the others take."""
    light = _power(np.maximum(codes - 0.008, 0.0) / 0.992, 2.2)
    others = light.sum(axis=1, keepdims=True) - light
    return _leaking(light * (1.0 - 0.01 * others), 1e-6)


def _led_drive(codes: np.ndarray) -> np.ndarray:
    """Return the curve of sRGB in steps of ten bits, and a leak."""
    return _leaking(_srgb(np.round(codes * 1023.0) / 1023.0), 1.2e-3)


def _balanced(red: np.ndarray, green: np.ndarray, blue: np.ndarray, x: float, y: float) -> np.ndarray:
    """Return the three scaled so that together they are white of this chromaticity, and a leak of that white."""
    spectra = np.stack([red, green, blue])
    xyz = spectra @ observer("1931_2").sensitivity(NM).T
    amounts = np.linalg.solve(xyz.T, [x / y, 1.0, (1.0 - x - y) / y])
    scaled = spectra * amounts[:, None]
    return np.concatenate([scaled, scaled.sum(axis=0, keepdims=True)])


def displays() -> tuple[SimulatedDisplay, ...]:
    """Return the six, the simplest defects first."""
    phosphor = _peaks((530.0, 30.0, 0.35))
    lcd = _balanced(
        _peaks((632.0, 5.0, 1.0), (613.0, 6.0, 0.5)) + 0.02 * phosphor,
        _peaks((535.0, 24.0, 1.0), (600.0, 12.0, 0.05)),
        _blue_led() + 0.05 * phosphor,
        0.3090,
        0.3230,
    )
    crt = _balanced(
        _peaks((626.0, 4.0, 1.0), (705.0, 5.0, 0.25), (596.0, 5.0, 0.15)),
        _peaks((525.0, 30.0, 1.0)),
        _peaks((450.0, 25.0, 1.0)),
        0.2990,
        0.3150,
    )
    oled = _balanced(_peaks((620.0, 16.0, 1.0)), _peaks((527.0, 14.0, 1.0)), _peaks((460.0, 11.0, 1.0)), 0.3130, 0.3310)
    led = _balanced(
        _peaks((625.0, 12.0, 1.0), (575.0, 30.0, 0.12)),
        _peaks((530.0, 22.0, 1.0), (580.0, 30.0, 0.15)),
        _peaks((455.0, 12.0, 1.0), (500.0, 20.0, 0.12)),
        0.3150,
        0.3300,
    )
    wide = _balanced(_peaks((628.0, 18.0, 1.0)), _peaks((532.0, 18.0, 1.0)), _peaks((457.0, 12.0, 1.0)), 0.3130, 0.3290)
    white = _peaks((457.0, 12.0, 0.75), (545.0, 32.0, 0.85), (620.0, 25.0, 0.55))
    weights = observer("1931_2").sensitivity(NM)[1]
    white *= float(weights @ wide[3]) / float(weights @ white)
    wrgb = np.concatenate([wide[:3], white[None], wide[3:]])
    return (
        SimulatedDisplay("sRGB LED", led, _led_drive, 160.0),
        SimulatedDisplay("RGB OLED", oled, _oled_drive, 140.0),
        SimulatedDisplay("CRT", crt, _crt_drive, 95.0),
        SimulatedDisplay("LCD", lcd, _lcd_drive, 120.0),
        SimulatedDisplay("LCD with cross-talk", lcd, _cross_talk_drive, 120.0),
        SimulatedDisplay("WRGB OLED", wrgb, _wrgb_drive, 150.0),
    )
