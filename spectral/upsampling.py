"""Upsampling of linear RGB to reflectance spectra, for data measured in three channels only.

Three published methods, all in one form: spectra at the corners of a mesh over the triangle of chromaticities, and in
between, barycentric sums of the corners. So every method is homogeneous (twice the RGB is twice the spectrum, for
highlights of any brightness) and fast on whole tables; a property that is exact at the corners is exact everywhere. RGB
means sRGB primaries (ITU-R BT.709), linear, with the white of D65 as the perfect diffuser.

- "mallett-yuksel": three basis spectra that sum to 1 (Mallett and Yuksel 2019); linear, so three coefficients suffice.
- "smits": seven spectra, combined by which channel is largest (Smits 1999, the choice of the 2010 paper).
- "jakob-hanika": a sigmoid of a parabola in wavelength (Jakob and Hanika 2019, equation 2), solved at a half of the
  largest channel and scaled: their curves are bounded by 1, and f_r of a highlight is not.

Such spectra are one guess out of many with this colour under D65: under another light they are not evidence.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float, Int

from ..runtime.errors import InputError, UnknownNameError
from .colour_library import colour_science, colour_tables
from .illuminants import illuminant
from .observers import observer
from .wavelengths import WORKING_WAVELENGTHS_NM

METHODS = ("mallett-yuksel", "jakob-hanika", "smits")
DEFAULT_METHOD = "mallett-yuksel"
#: Meaning assumed for the numbers R, G, B; MERL's own files do not say.
PRIMARIES = "linear sRGB (ITU-R BT.709 primaries, white D65)"

_PRIMARIES_XY = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])
# Subdivisions of the chromaticity triangle: between the corners, which are exact, the spectrum is all that is blended.
_MESH = 24
# The largest channel at which the bounded curves are solved.
_LEVEL = 0.5
_NEWTON_STEPS = 60
#: Largest error of colour of a `solved` curve, of Y.
MISSED = 1e-9
_SMITS = ("red", "green", "blue", "cyan", "magenta", "yellow", "white")


@cache
def xyz_from_rgb() -> Float[np.ndarray, "3 3"]:
    """Compute M with XYZ = M @ rgb for linear sRGB; (1, 1, 1) is exactly the perfect diffuser under D65, Y = 1."""
    xyz = np.concatenate([_PRIMARIES_XY, 1.0 - _PRIMARIES_XY.sum(axis=1, keepdims=True)], axis=1).T
    white = _weights().sum(axis=1)
    return xyz * np.linalg.solve(xyz, white)


@cache
def _weights() -> Float[np.ndarray, "3 L"]:
    return observer("1931_2").weights(illuminant("D65"), WORKING_WAVELENGTHS_NM)


@dataclass(frozen=True, eq=False)
class Upsampling:
    """One method, ready for any number of colours.

    Attributes
    ----------
    method : one of `METHODS`.
    corners : (V, L) spectra on the working wavelengths, each of a colour whose largest channel is 1.
    """

    method: str
    corners: Float[np.ndarray, "V L"]

    @property
    def provenance(self) -> str:
        """Kind of provenance for records of such spectra."""
        return f"uplifted({self.method})"

    def spectra(self, rgb: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch L"]:
        """Upsample to reflectances (or f_r: the scale is free) on the working wavelengths.

        Raises
        ------
        InputError
            A channel is negative, NaN or infinite: no reflectance has that colour.
        """
        return self._mixed(rgb, self.corners)

    def folded(
        self, rgb: Float[np.ndarray, "*batch 3"], weights: Float[np.ndarray, "L C"]
    ) -> Float[np.ndarray, "*batch C"]:
        """Compute `spectra(rgb) @ weights` without making spectra; same errors."""
        return self._mixed(rgb, self.corners @ weights)

    def _mixed(
        self, rgb: Float[np.ndarray, "*batch 3"], corners: Float[np.ndarray, "V C"]
    ) -> Float[np.ndarray, "*batch C"]:
        """Mix values at the corners with the weights of their spectra."""
        rgb = np.asarray(rgb, dtype=np.float64)
        bad = ~(np.isfinite(rgb) & (rgb >= 0)).all(axis=-1)
        if bad.any():
            at = tuple(int(index) for index in np.argwhere(bad)[0])
            raise InputError(
                "no reflectance has this colour", field=f"rgb{list(at)}", found=rgb[at], expected="R, G, B >= 0"
            )
        flat = rgb.reshape(-1, 3)
        if len(self.corners) == 3:
            out = flat @ corners
        else:
            index, share = (_smits_shares if self.method == "smits" else _mesh_shares)(flat)
            out = np.zeros((len(flat), corners.shape[1]))
            for corner in range(3):
                out += share[:, corner, None] * corners[index[:, corner]]
        return out.reshape(*rgb.shape[:-1], out.shape[1])


@cache
def upsampling(method: str = DEFAULT_METHOD) -> Upsampling:
    """Return the method of that name; raises `UnknownNameError`."""
    makers = {"mallett-yuksel": _mallett_yuksel, "jakob-hanika": _jakob_hanika, "smits": _smits}
    if method not in makers:
        raise UnknownNameError("upsampling method", method, METHODS)
    corners = makers[method]()
    corners.setflags(write=False)
    return Upsampling(method, corners)


def _mallett_yuksel() -> Float[np.ndarray, "3 L"]:
    ((nm, values),) = colour_tables("recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019").values()
    return np.stack([np.interp(WORKING_WAVELENGTHS_NM, nm, column) for column in values.T])


def _smits() -> Float[np.ndarray, "7 L"]:
    tables = colour_science().recovery.SDS_SMITS1999
    # Ten samples of piecewise-constant spectra: linear between them, the ends held, as colour-science has it.
    return np.stack(
        [np.interp(WORKING_WAVELENGTHS_NM, tables[name].wavelengths, tables[name].values) for name in _SMITS]
    )


def _smits_shares(rgb: Float[np.ndarray, "N 3"]) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
    """Compute Smits's weights: white up to the smallest channel, two mixed up to the middle one, then the largest."""
    order = np.argsort(rgb, axis=1, kind="stable")
    low, middle, high = np.take_along_axis(rgb, order, axis=1).T
    # cyan, magenta and yellow follow red, green and blue in the order of the channel that each of them lacks.
    index = np.stack([np.full(len(rgb), 6), 3 + order[:, 0], order[:, 2]], axis=1)
    return index, np.stack([low, middle - low, high - middle], axis=1)


def _mesh_shares(rgb: Float[np.ndarray, "N 3"]) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
    """Find the corners of the mesh triangle around each chromaticity, and their weights."""
    total = rgb.sum(axis=1, keepdims=True)
    place = np.divide(rgb, total, out=np.full_like(rgb, 1.0 / 3.0), where=total > 0) * _MESH
    red, green = np.minimum(place[:, 0].astype(np.intp), _MESH - 1), np.minimum(place[:, 1].astype(np.intp), _MESH - 1)
    green = np.minimum(green, _MESH - 1 - red)
    x, y = place[:, 0] - red, place[:, 1] - green
    upper = (x + y > 1.0) & (red + green < _MESH - 1)
    corners = [np.where(upper, (red + 1, green + 1), (red, green)), (red + 1, green), (red, green + 1)]
    weights = [np.where(upper, x + y - 1.0, 1.0 - x - y), np.where(upper, 1.0 - y, x), np.where(upper, 1.0 - x, y)]
    index = np.stack([_mesh_index(np.asarray(r), np.asarray(g)) for r, g in corners], axis=1)
    # Corner spectra are those of colours scaled to a largest channel of 1: undo it.
    largest = _mesh_corners().max(axis=1)[index]
    return index, total * np.stack(weights, axis=1) * largest


def _mesh_index(red: np.ndarray, green: np.ndarray) -> np.ndarray:
    return red * (_MESH + 1) - red * (red - 1) // 2 + green


@cache
def _mesh_corners() -> Float[np.ndarray, "V 3"]:
    """Return chromaticities (r, g, b) with r + g + b = 1 in the order of `_mesh_index`."""
    pairs = [(red, green) for red in range(_MESH + 1) for green in range(_MESH + 1 - red)]
    return np.array([(red, green, _MESH - red - green) for red, green in pairs]) / _MESH


def _jakob_hanika() -> Float[np.ndarray, "V L"]:
    corners = _mesh_corners()
    rgb = _LEVEL * corners / corners.max(axis=1, keepdims=True)
    found, missed = sigmoid_coefficients(rgb)
    if missed.max() > MISSED:
        worst = int(missed.argmax())
        raise InputError("no bounded curve has this colour", field="rgb", found=rgb[worst], expected="a colour of sRGB")
    return sigmoid(found) / _LEVEL


def sigmoid(coefficients: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch L"]:
    """Evaluate Jakob and Hanika 2019, equations 2 and 3, on the working wavelengths mapped to [-1, 1].

    >>> sigmoid(np.zeros(3))[0]
    np.float64(0.5)
    """
    parabola = coefficients @ _powers().T
    return 0.5 + 0.5 * parabola / np.sqrt(1.0 + parabola**2)


def _powers() -> Float[np.ndarray, "L 3"]:
    low, high = WORKING_WAVELENGTHS_NM[[0, -1]]
    x = (2.0 * WORKING_WAVELENGTHS_NM - low - high) / (high - low)
    return np.stack([x * x, x, np.ones_like(x)], axis=-1)


def sigmoid_coefficients(rgb: Float[np.ndarray, "V 3"]) -> tuple[Float[np.ndarray, "V 3"], Float[np.ndarray, " V"]]:
    """Solve for coefficients whose `sigmoid` has these colours in linear sRGB; return them and the residuals in Y.

    Damped Newton steps from grey, for all colours at once. There is no residual in sRGB at the level used here; curves
    of saturated colours are narrow, and exist for colours that are dark enough.
    """
    to_rgb = np.linalg.solve(xyz_from_rgb(), _weights())
    powers = _powers()
    found = np.zeros_like(rgb)
    damping = np.full(len(rgb), 1e-2)
    wrong = sigmoid(found) @ to_rgb.T - rgb
    for _ in range(_NEWTON_STEPS):
        parabola = found @ powers.T
        slope = 0.5 * (1.0 + parabola**2) ** -1.5
        jacobian = np.einsum("cl,vl,lk->vck", to_rgb, slope, powers, optimize=True)
        normal = np.einsum("vck,vcj->vkj", jacobian, jacobian)
        scale = damping[:, None, None] * (np.eye(3) * np.einsum("vkk->vk", normal)[:, None, :] + 1e-12 * np.eye(3))
        step = np.linalg.solve(normal + scale, np.einsum("vck,vc->vk", jacobian, wrong)[..., None])[..., 0]
        trial = found - step
        left = sigmoid(trial) @ to_rgb.T - rgb
        better = np.sum(left**2, axis=1) < np.sum(wrong**2, axis=1)
        found[better], wrong[better] = trial[better], left[better]
        # For a curve that is 0 or 1 everywhere, nothing but the damping keeps its equations solvable.
        damping = np.where(better, np.maximum(0.2 * damping, 1e-12), np.minimum(8.0 * damping, 1e8))
    return found, np.abs(wrong).max(axis=1)
