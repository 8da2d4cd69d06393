"""Minimax basis: balanced (`SpectralBasis.balanced`), with spectra and lights reweighted.

The balanced basis minimises the squared error of all products of reflectance and light, and so neglects the few with
the most visible errors. Weights on spectra and on lights, raised in turn where the ΔE94 is largest (Lawson 1961, as for
minimax approximation by polynomials), move it towards the smallest maximum of ΔE94. The best of all rounds is kept.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from .axis_letters import Wavelengths
from .basis import SpectralBasis, finite_table
from .difference import KNEE, delta_e_xyz
from .wavelengths import WORKING_WAVELENGTHS_NM

# Rounds at most.
_MOST_ROUNDS = 400
# It ends where so many rounds in a row brought less than this share of the least largest error so far.
_PATIENCE = 100
_LEAST_GAIN = 0.01
# Power of the error, relative to the largest, that weights are multiplied by; and the round after which it has halved.
_POWER = 0.3
_HALVED = 15
# Weight of an error of zero beside the largest, so that no weight becomes zero.
_FLOOR = 1e-3


def minimax_basis(
    reflectances: Float[np.ndarray, "n L"],
    weights: Float[np.ndarray, "L m"],
    size: int,
    wavelengths_nm: Wavelengths = WORKING_WAVELENGTHS_NM,
    enough: float = 0.0,
) -> SpectralBasis:
    """Search for the basis of `size` coefficients with the smallest maximum of ΔE94 over all spectra and lights.

    Never worse than the balanced one of that size. Bit-equal for spectra and lights in any order.

    Parameters
    ----------
    reflectances : (n,L) spectra that the scene can show, with products of two where light bounces.
    weights : (L,m) light x CMF, each light at Y = 1 (`Observer.weights(...).T`), three columns a light.
    size : J, the number of coefficients; the numerical rank is the upper bound.
    enough : the search ends once the largest ΔE94 is at most this.

    Raises
    ------
    InputError : spectra or lights are no finite tables, or there are none; `size` is less than 1.
    """
    surfaces, columns = finite_table("reflectances", reflectances), finite_table("weights", weights)
    if columns.shape[1] % 3 or not columns.size or not surfaces.size:
        raise InputError(
            "no spectra and lights to make a basis for",
            field="reflectances, weights",
            found=f"{surfaces.shape}, {columns.shape}",
            expected="(n, L) and (L, m), three columns a light",
        )
    # One order, whatever the caller's: sums come out the same to the bit. A spectrum twice counts once.
    surfaces = np.unique(surfaces, axis=0)
    folded = np.unique(columns.T.reshape(-1, 3, len(columns)), axis=0)
    colours, whites = np.einsum("nl,kcl->knc", surfaces, folded), folded.sum(axis=2)
    columns = folded.reshape(-1, folded.shape[2]).T

    def made(rows: Float[np.ndarray, " n"], lights: Float[np.ndarray, " k"]) -> SpectralBasis:
        scaled = SpectralBasis.balanced(rows[:, None] * surfaces, columns * np.repeat(lights, 3), size, wavelengths_nm)
        return SpectralBasis("minimax", scaled.wavelengths_nm, scaled.analysis, scaled.synthesis)

    def errors(basis: SpectralBasis) -> Float[np.ndarray, "k n"]:
        shown = np.einsum("nj,kcj->knc", surfaces @ basis.analysis, folded @ basis.synthesis)
        return np.stack(
            [delta_e_xyz(truth, ours, white) for truth, ours, white in zip(colours, shown, whites, strict=True)]
        )

    lights = np.ones(len(folded))
    best = made(np.ones(len(surfaces)), lights)
    least = float(errors(best).max())
    # As steep as L* is at each spectrum, in the mean of all lights; below the knee it is no steeper.
    rows = np.maximum((colours[..., 1] / whites[:, None, 1]).mean(axis=0), KNEE) ** (-2.0 / 3.0)
    since = 0
    for number in range(_MOST_ROUNDS):
        if least <= enough or since >= _PATIENCE:
            break
        rows /= rows.mean()
        lights /= lights.mean()
        found = made(rows, lights)
        seen = errors(found)
        largest = float(seen.max())
        since = 0 if largest < (1.0 - _LEAST_GAIN) * least else since + 1
        if largest < least:
            best, least = found, largest
        if largest == 0.0:
            break
        power = _POWER / (1.0 + number / _HALVED)
        rows = rows * (seen.max(axis=0) / largest + _FLOOR) ** power
        lights = lights * (seen.max(axis=1) / largest + _FLOOR) ** power
    return best
