"""A soft proof: what another display makes of a picture, shown on this one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from ...calibration.display.icc_profile import PREFIX
from ...calibration.display.proof import VISIBLE_DELTA_E, ProofStatistics
from ...spectral.difference import delta_e_xyz
from .transform import DISPLAY_WHITE_XYZ, DisplayTransform


@dataclass(frozen=True)
class Proof:
    """A display whose range of colours is shown on another one.

    The picture is encoded for it, clipped to [0, 1] as it clips, decoded again, and then sent to the display that there
    is: what lies outside of both is clipped twice.
    """

    of: DisplayTransform

    def apply(self, xyz_d65: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """XYZ under the display's white as the other display would show it; float32.

        Raises
        ------
        InputError : its transform cannot be turned round.
        """
        return self.of.decode(np.clip(self.of.apply(xyz_d65), 0.0, 1.0))

    def statistics(self, xyz_d65: Float[np.ndarray, "H W 3"]) -> ProofStatistics:
        """Compare a picture under the display's white, Y of white 1, with what the other display shows of it.

        Raises
        ------
        InputError : its transform cannot be turned round.
        """
        codes = self.of.apply(xyz_d65)
        below, above = self.of.out_of_range(xyz_d65, codes)
        shown = self.of.decode(np.clip(codes, 0.0, 1.0)).astype(np.float64)
        apart = delta_e_xyz(np.asarray(xyz_d65, dtype=np.float64), shown, DISPLAY_WHITE_XYZ)
        return ProofStatistics((below | above) & (apart > VISIBLE_DELTA_E), apart, self.of.darker_than_black(xyz_d65))


def proof_of(display: DisplayTransform, named: str | None) -> Proof | None:
    """Return the proof of another display of the same configuration, by the view that is called alike, or of the
    display of an ICC profile (`icc:FILE`); None for no name.

    Raises
    ------
    UnknownNameError : no such display, or none of its views is called so.
    InputError : the profile cannot be used.
    """
    if named is None:
        return None
    if named.startswith(PREFIX):
        return Proof(DisplayTransform(named, adaptation=display.adaptation, observer=display.observer))
    return _of_configuration(display, named)


@lru_cache(maxsize=8)
def _of_configuration(display: DisplayTransform, named: str) -> Proof:
    return Proof(DisplayTransform(named, display.view, display.config, display.adaptation, display.observer))
