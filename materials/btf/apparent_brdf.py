"""Apparent BRDF of one texel of a BTF, for every view and light: of the fast form and as measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.difference import delta_e_xyz
from ...spectral.folding import Folding
from .files import size_words
from .form import BtfForm, FieldForm
from .hemisphere import Hemisphere
from .images import BtfImages, displacement


@dataclass(frozen=True, eq=False)
class ApparentBrdf:
    """f_r cos(theta_i) of a texel as XYZ under M illuminants, in M times three columns.

    x, y : column and row of the texel, row 0 on top.
    fast : values of the fast form. original : values of the registered images; None if these are not available.
    whites : XYZ of the perfect diffuser, lit along its normal, under each illuminant.
    """

    x: int
    y: int
    views: Hemisphere
    lights: Hemisphere
    fast: Float[np.ndarray, "V Lt M3"]
    original: Float[np.ndarray, "V Lt M3"] | None
    whites: Float[np.ndarray, " M3"]

    def differences(self) -> Float[np.ndarray, "M V Lt"] | None:
        """Compute ΔE94 of the form against each image, the reference; None if the images are not available."""
        if self.original is None:
            return None
        each = (slice(start, start + 3) for start in range(0, len(self.whites), 3))
        return np.stack([delta_e_xyz(self.original[..., at], self.fast[..., at], self.whites[at]) for at in each])


def apparent_brdf(
    fast: BtfForm | FieldForm, images: BtfImages | None, x: int, y: int, folding: Folding
) -> ApparentBrdf:
    """Compute the apparent BRDF of the texel in column x and row y.

    images : images that the form was fitted to; each is read once. folding : sets the scale of the XYZ; with scale pi
    the perfect diffuser, lit along its normal, has Y = 1.

    Raises
    ------
    InputError : x or y outside the BTF; an image that is missing, has changed or is not finite.
    """
    form = fast.texels.form
    height, width = (form.height, form.width) if isinstance(fast, FieldForm) else fast.texels.form.number.shape
    for name, at, size in (("x", x, width), ("y", y, height)):
        if not 0 <= at < size:
            words = f"0 to {size - 1}, of {size_words(height, width)}"
            raise InputError("a texel outside of the BTF", field=name, found=at, expected=words)
    (made,) = form.decoded(np.array([y * width + x]))
    original = None
    if images is not None:
        original = _measured(images, x, y) @ folding.coefficients(images.basis)
    nm = form.basis.wavelengths_nm
    whites = folding.weights(nm).sum(axis=0) * (1.0 / np.pi)
    return ApparentBrdf(x, y, form.views, form.lights, made @ folding.coefficients(form.basis), original, whites)


def _measured(images: BtfImages, x: int, y: int) -> Float[np.ndarray, "V Lt J"]:
    """Interpolate the registered texel (`BtfImages.registered`), reading only the four texels around it."""
    found = np.empty((len(images.views), len(images.lights), images.basis.size))
    lights = np.arange(len(images.lights))
    for view in range(len(images.views)):
        across, down = displacement(images.views.directions[view], images.offset) + np.array([x, y])
        column, row = int(np.floor(across)), int(np.floor(down))
        rows, columns = np.meshgrid([row, row + 1], [column, column + 1], indexing="ij")
        rows, columns = rows % images.height, columns % images.width
        right, below = across - column, down - row
        share = np.outer([1.0 - below, below], [1.0 - right, right]).ravel()
        four = np.tile((rows * images.width + columns).ravel(), (len(images.lights), 1))
        found[view] = np.einsum("k,lkj->lj", share, images.texels(view * len(images.lights) + lights, four))
    bad = np.argwhere(~np.isfinite(found).all(axis=2))
    if len(bad):
        where = f"image of view {bad[0][0]}, light {bad[0][1]}"
        raise InputError("a BTF that is not finite", field=where, found="NaN or infinity", expected="numbers")
    return found


def in_plane(
    values: Float[np.ndarray, " Lt"], lights: Hemisphere, view: Float[np.ndarray, "3"], angles: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Interpolate the values of one view in its plane of incidence, among the three lights around each direction.

    angles : theta_i, radians, negative on the viewer's side of the normal. For a view along the normal the plane is
    that of u (phi = 0). Below the lowest light, values fall with the cosine (`Hemisphere.shares`).
    """
    flat = np.hypot(view[0], view[1])
    along = view[:2] / flat if flat > 1e-6 else np.array([1.0, 0.0])
    sine = -np.sin(angles)
    index, share = lights.shares(np.stack([sine * along[0], sine * along[1], np.cos(angles)], axis=-1), falling=True)
    return (values[index] * share).sum(axis=1)
