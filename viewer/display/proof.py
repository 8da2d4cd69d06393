"""Soft proof: simulation of another display on this one."""

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
    """Simulated display of a soft proof.

    The image is encoded for it, clipped to [0, 1] as it clips, decoded, and then sent to the actual display, which may
    clip again.
    """

    of: DisplayTransform

    def apply(self, xyz_d65: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Return XYZ under the display's white as shown by the simulated display; float32.

        Raises
        ------
        InputError : its transform cannot be turned round.
        """
        return self.of.decode(np.clip(self.of.apply(xyz_d65), 0.0, 1.0))

    def statistics(self, xyz_d65: Float[np.ndarray, "H W 3"]) -> ProofStatistics:
        """Compare an image under the display's white, Y of white 1, with its simulation.

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
    """Return the proof of another display of the same configuration, with the view of the same name, or of an ICC
    profile (`icc:FILE`); None without a name.

    Raises
    ------
    UnknownNameError : an unknown display, or one without a view of that name.
    InputError : an unusable profile.
    """
    if named is None:
        return None
    if named.startswith(PREFIX):
        return Proof(DisplayTransform(named, adaptation=display.adaptation, observer=display.observer))
    return _of_configuration(display, named)


@lru_cache(maxsize=8)
def _of_configuration(display: DisplayTransform, named: str) -> Proof:
    return Proof(DisplayTransform(named, display.view, display.config, display.adaptation, display.observer))
