"""Published BTF models, as baselines: a few numbers for each texel that are functions of directions.

Coefficients of the basis are fitted one by one, as the papers do with red, green and blue. Fits are plain least squares
of f_r cos(theta_i) as measured: what a view displaces (`BtfImages.offset`) is not moved back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from jaxtyping import Float, Int

from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.images import BtfImages
from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ...spectral.difference import delta_e_xyz
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer

# Values of images in memory at once, while lobes are looked for; as float32, 256 MB.
_AT_ONCE = 64_000_000
# Values that percentiles are taken of: where there are more, some images are left out evenly.
_JUDGED = 20_000_000
# Share of a lobe's square, at least, that those chosen before do not hold: below it is rounding.
_FRESH = 1e-8
# Exponents of lobes to choose from.
_EXPONENTS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)


class Field(Protocol):
    """f_r cos(theta_i) of each texel as a function of measured views and of lights."""

    @property
    def bytes_per_texel(self) -> int:
        """Bytes of a texel: one for each number, as they would be kept."""
        ...

    def reconstruct(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """Reconstruct `BtfImages.image`, 1/sr."""
        ...


@dataclass(frozen=True, eq=False)
class PolynomialField:
    """Biquadratic polynomials in the light's x and y (Malzbender, Gelb and Wolters 2001).

    lights : that they were fitted at. coefficients : (m,H,W,J,6) of x^2, y^2, xy, x, y, 1; m is the number of views, or
    1 where one polynomial does for all.
    """

    lights: Hemisphere
    coefficients: Float[np.ndarray, "m H W J 6"]

    @property
    def bytes_per_texel(self) -> int:
        """Six for each coefficient of the basis and each polynomial."""
        return self.coefficients.shape[0] * self.coefficients.shape[3] * 6

    @property
    def terms(self) -> Float[np.ndarray, "Lt 6"]:
        """Compute the factors of coefficients under each light."""
        return _terms(self.lights)

    def reconstruct(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """Implement `Field.reconstruct`."""
        return self.coefficients[view % len(self.coefficients)] @ self.terms[light]


@dataclass(frozen=True, eq=False)
class LafortuneField:
    """rho_d + s_v sum of k lobes rho_k max(C_x l_x v_x + C_y l_y v_y + C_z l_z v_z, 0)^n, times cos(theta_i).

    Lafortune et al. 1997, with a scale of each view as Daubert et al. 2001 have it. Lobes are taken from a table
    (`lobe_table`), one after the other, always the one that leaves least, and not refined. rho may be below 0.

    table : (V,Lt,m) all lobes at measured directions, times cos(theta_i); the first is the diffuse one.
    lobe : (H,W,k+1) which of them each texel has; rho : (H,W,k+1,J). scale : (V,H,W), None where views have none.
    """

    table: Float[np.ndarray, "V Lt m"]
    lobe: Int[np.ndarray, "H W K"]
    rho: Float[np.ndarray, "H W K J"]
    scale: Float[np.ndarray, "V H W"] | None = None

    @property
    def bytes_per_texel(self) -> int:
        """Weights, C and n of each lobe, and the scales."""
        count, size = self.rho.shape[2:]
        return count * size + 4 * (count - 1) + (0 if self.scale is None else len(self.scale))

    def reconstruct(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """Implement `Field.reconstruct`."""
        found = np.einsum("hwk,hwkj->hwj", self.table[view, light][self.lobe], self.rho)
        return found if self.scale is None else found * self.scale[view][..., None]


def rfp(images: BtfImages) -> PolynomialField:
    """Return a polynomial for each view: the reflectance fields of Meseth, Mueller and Klein 2003 (section 4.1)."""
    inverse = np.linalg.pinv(_terms(images.lights))
    shape = (len(images.views), images.height, images.width, images.basis.size, 6)
    coefficients = np.empty(shape, dtype=np.float32)
    for view in range(len(images.views)):
        found = np.zeros(shape[1:])
        for light in range(len(images.lights)):
            found += images.image(view, light)[..., None] * inverse[:, light]
        coefficients[view] = found
    return PolynomialField(images.lights, coefficients)


def ptm(images: BtfImages) -> PolynomialField:
    """One polynomial for all views: a polynomial texture map."""
    inverse = np.linalg.pinv(_terms(images.lights)) / len(images.views)
    found = np.zeros((images.height, images.width, images.basis.size, 6))
    for light in range(len(images.lights)):
        total = np.zeros(found.shape[:3])
        for view in range(len(images.views)):
            total += images.image(view, light)
        found += total[..., None] * inverse[:, light]
    return PolynomialField(images.lights, found[None].astype(np.float32))


def lafortune(images: BtfImages, lobes: int = 2, scaled: bool = True) -> LafortuneField:
    """Fit a number of lobes for each texel, and, `scaled`, a factor of each of its views.

    Raises
    ------
    InputError : fewer lobes than none, or more than the table has.
    """
    table = lobe_table(images.views, images.lights)
    if not 0 <= lobes < table.shape[2]:
        expected = f"0 to {table.shape[2] - 1}"
        raise InputError("a number of lobes that there is not", field="lobes", found=lobes, expected=expected)
    flat = table.reshape(-1, table.shape[2])
    size, views = (images.height, images.width), len(images.views)
    lobe = np.zeros((*size, lobes + 1), dtype=np.int64)
    rho = np.zeros((*size, lobes + 1, images.basis.size), dtype=np.float32)
    scale = np.ones((views, *size), dtype=np.float32) if scaled else None
    for rows, values in _bands(images):
        chosen, weights = _pursued(values, flat, lobes)
        lobe[rows] = chosen.reshape(-1, size[1], lobes + 1)
        rho[rows] = weights.reshape(-1, size[1], lobes + 1, images.basis.size)
        if scale is not None:
            scale[:, rows] = _scales(values, flat, chosen, weights, views).reshape(views, -1, size[1])
    return LafortuneField(table, lobe, rho, scale)


def lobe_table(views: Hemisphere, lights: Hemisphere) -> Float[np.ndarray, "V Lt m"]:
    """Return the diffuse lobe, and those of 17 directions of (C_x, C_y, C_z), C_z >= 0, and six exponents; times
    cos."""
    axes = np.array(np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [0.0, 1.0])).reshape(3, -1).T
    axes = axes[np.abs(axes).sum(axis=1) > 0.0]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    product = views.directions[:, None, :] * lights.directions[None]
    # The largest that the sum can get to, for unit vectors, is the largest of |C|.
    base = np.maximum(product @ (axes / np.abs(axes).max(axis=1, keepdims=True)).T, 0.0)
    lobes = np.stack([base**n for n in _EXPONENTS], axis=-1).reshape(*base.shape[:2], -1)
    lobes = np.concatenate([np.ones((*base.shape[:2], 1)), lobes], axis=2)
    return lobes * lights.directions[None, :, 2, None]


class Judged(NamedTuple):
    """ΔE94 of all texels, views and lights: mean, and what 95 and 99 of 100 are below."""

    mean: float
    p95: float
    p99: float


def judged(
    images: BtfImages, reconstruct: Callable[[int, int], Float[np.ndarray, "H W J"]], light: str = "D65"
) -> Judged:
    """ΔE94 of images made again, for the 1931 observer; white is the perfect diffuser, lit along its normal."""
    to_xyz, white = _folded(images.basis, light)
    lights = len(images.lights)
    pairs = len(images.views) * lights
    every = max(1, -(-pairs * images.height * images.width // _JUDGED))
    found = []
    for pair in range(0, pairs, every):
        view, lit = divmod(pair, lights)
        truth, made = images.image(view, lit) @ to_xyz, reconstruct(view, lit) @ to_xyz
        found.append(delta_e_xyz(truth, made, white).astype(np.float32).ravel())
    values = np.concatenate(found)
    p95, p99 = np.percentile(values, [95.0, 99.0])
    return Judged(float(values.mean(dtype=np.float64)), float(p95), float(p99))


def _folded(basis: SpectralBasis, light: str) -> tuple[Float[np.ndarray, "J 3"], Float[np.ndarray, "3"]]:
    """Return the matrix from coefficients of f_r cos(theta_i) to XYZ, and the white."""
    seen, lamp = observer("1931_2"), illuminant(light)
    return np.pi * basis.fold(lamp, seen).T, seen.weights(lamp, basis.wavelengths_nm).sum(axis=1)


def _terms(lights: Hemisphere) -> Float[np.ndarray, "Lt 6"]:
    x, y = lights.directions[:, 0], lights.directions[:, 1]
    return np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)


def _bands(images: BtfImages) -> Iterator[tuple[slice, Float[np.ndarray, "T VL J"]]]:
    """Rows of texels, as many as memory is meant for, and all that was measured of them."""
    views, lights = len(images.views), len(images.lights)
    row = views * lights * images.width * images.basis.size
    step = max(1, _AT_ONCE // row)
    for start in range(0, images.height, step):
        rows = slice(start, min(start + step, images.height))
        count = (rows.stop - rows.start) * images.width
        values = np.empty((count, views * lights, images.basis.size), dtype=np.float32)
        for pair in range(views * lights):
            values[:, pair] = images.image(*divmod(pair, lights))[rows].reshape(count, -1)
        yield rows, values


def _pursued(
    values: Float[np.ndarray, "T VL J"], table: Float[np.ndarray, "VL m"], lobes: int
) -> tuple[Int[np.ndarray, "T K"], Float[np.ndarray, "T K J"]]:
    """Orthogonal matching pursuit over the table, the diffuse lobe first: all from products, worked out once."""
    products = np.einsum("tpj,pm->tmj", values, table, optimize=True)
    gram = table.T @ table
    norm = np.diag(gram)
    count, texel = len(values), np.arange(len(values))[:, None]
    chosen = np.zeros((count, 1), dtype=np.int64)
    while True:
        inverse = np.linalg.pinv(gram[chosen[:, :, None], chosen[:, None, :]], hermitian=True)
        weights = inverse @ products[texel, chosen]
        if chosen.shape[1] > lobes:
            return chosen, weights
        others = gram[chosen]
        left = products - np.einsum("tkm,tkj->tmj", others, weights)
        # Norm of each lobe orthogonal to the chosen ones; one in their span, or one that is 0, adds nothing.
        own = norm - ((inverse @ others) * others).sum(axis=1)
        fresh = own > _FRESH * norm
        gain = np.divide((left**2).sum(axis=2), own, out=np.zeros(own.shape), where=fresh)
        np.put_along_axis(gain, chosen, -1.0, axis=1)
        chosen = np.concatenate([chosen, gain.argmax(axis=1)[:, None]], axis=1)


def _scales(
    values: Float[np.ndarray, "T VL J"],
    table: Float[np.ndarray, "VL m"],
    chosen: Int[np.ndarray, "T K"],
    weights: Float[np.ndarray, "T K J"],
    views: int,
) -> Float[np.ndarray, "V T"]:
    """Factor of each view that is right by least squares; 1 where there is nothing to scale."""
    per_view = table.reshape(views, -1, table.shape[1])
    of_view = values.reshape(len(values), views, -1, values.shape[2])
    scale = np.ones((views, len(values)))
    for view in range(views):
        made = np.einsum("tlk,tkj->tlj", per_view[view][:, chosen].transpose(1, 0, 2), weights)
        total, own = (made * of_view[:, view]).sum(axis=(1, 2)), (made * made).sum(axis=(1, 2))
        np.divide(total, own, out=scale[view], where=own > 0.0)
    return scale
