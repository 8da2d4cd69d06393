"""Difference of two fast forms of BTFs: the same texels, under the same lights, from the same views."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...spectral.difference import delta_e_xyz
from ...spectral.folding import Folding
from .form import BtfForm, FieldForm
from .hemisphere import Hemisphere
from .local_pca import JUDGED

# Directions of two files that are this near are one, degrees: names of images have whole degrees or thousandths.
_SAME_DEGREES = 0.01
_SEED = 1


@dataclass(frozen=True)
class TexelDifference:
    """ΔE94 over texels, views and lights, under each of M illuminants.

    each : (M,N) of every compared texel in every image present in both. compared : description of what was compared and
    what was not. where : (M,) place of the largest difference: texel, light and view. Empty if nothing was compared.
    """

    each: Float[np.ndarray, "M N"]
    compared: str
    where: tuple[str, ...] = ()


def texel_difference(a: BtfForm | FieldForm, b: BtfForm | FieldForm, folding: Folding) -> TexelDifference:
    """Compute ΔE94 of f_r cos(theta_i) of `b` against the reference `a`, at shared directions and without resampling.

    Texels correspond by row and column: forms of different sizes are not compared, and directions only if both have
    them. Beyond `JUDGED` texels that many are drawn, always the same ones. White is the perfect diffuser, lit along its
    normal.

    folding : M lights and the observer; of scale 1.
    """
    one, other, count = a.texels.form, b.texels.form, len(folding.lights)
    sizes = [form.texels.size for form in (a, b)]
    if sizes[0] != sizes[1]:
        words = " and ".join(f"{width} x {height}" for height, width in sizes)
        return TexelDifference(np.zeros((count, 0)), f"texels not compared: {words} of them")
    views, lights = _shared(one.views, other.views), _shared(one.lights, other.lights)
    said = [_words("views", views, one.views, other.views), _words("lights", lights, one.lights, other.lights)]
    if not len(views) or not len(lights):
        return TexelDifference(np.zeros((count, 0)), f"texels not compared: {', '.join(said)}")
    height, width = sizes[0]
    texels = np.sort(np.random.default_rng(_SEED).permutation(height * width)[:JUDGED])
    to_xyz = [np.pi * folding.coefficients(form.basis) for form in (one, other)]
    white = folding.weights(one.basis.wavelengths_nm).sum(axis=0)
    each = np.zeros((count, len(texels), len(views), len(lights)), dtype=np.float32)
    for place, pair in enumerate(zip(one.decoded(texels), other.decoded(texels), strict=True)):
        seen = [
            values[views[:, None, side], lights[None, :, side]].astype(np.float64) @ to_xyz[side]
            for side, values in enumerate(pair)
        ]
        for light in range(count):
            at = slice(3 * light, 3 * light + 3)
            each[light, place] = delta_e_xyz(seen[0][..., at], seen[1][..., at], white[at])
    where = []
    for some in each:
        place, view, light = np.unravel_index(int(some.argmax()), some.shape)
        row, column = divmod(int(texels[place]), width)
        directions = one.lights.directions[lights[light, 0]], one.views.directions[views[view, 0]]
        lit, looked = (_angles(direction) for direction in directions)
        where.append(f"texel {column},{row}, light {lit}, view {looked}")
    share = f"{len(texels)} of {height * width} texels, {', '.join(said)}"
    return TexelDifference(each.reshape(count, -1).astype(np.float64), share, tuple(where))


def _shared(a: Hemisphere, b: Hemisphere) -> Int[np.ndarray, "n 2"]:
    """Match directions that both hemispheres have: indices into the first and into the second."""
    apart = np.linalg.norm(a.directions[:, None] - b.directions[None], axis=2)
    nearest = apart.argmin(axis=1)
    same = np.flatnonzero(apart[np.arange(len(a)), nearest] <= np.radians(_SAME_DEGREES))
    return np.stack([same, nearest[same]], axis=1)


def _words(kind: str, shared: Int[np.ndarray, "n 2"], a: Hemisphere, b: Hemisphere) -> str:
    if len(shared) == len(a) == len(b):
        return f"all {len(a)} {kind}"
    return f"{len(shared)} {kind} that both have, of {len(a)} and {len(b)}"


def _angles(direction: Float[np.ndarray, "3"]) -> str:
    theta = np.degrees(np.arctan2(np.hypot(direction[0], direction[1]), direction[2]))
    phi = np.degrees(np.arctan2(direction[1], direction[0])) % 360.0 if theta > 1e-6 else 0.0
    return f"{theta:.3g}/{phi:.3g}°"
