"""Time of folding one light with a form, and of shading pixels with it, in milliseconds of numpy.

The light is one field over the measured lights, of one spectrum, as an environment in one turn gives it: every form is
asked for the same. Pixels look up the nearest texel from the three views around theirs.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.lobe_amplitudes import summed
from ...materials.btf.lobe_field import LobeField
from ...materials.btf.quantisation import LEAST, MOST, decoded_amplitudes, decoded_axes, decoded_exponents
from ...materials.btf.texels import BtfTexels
from ...spectral.basis import SpectralBasis
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ..papers.btf_fields import Field, LafortuneField, PolynomialField

# Pixels across the sphere that is drawn, and turns; the fastest counts.
PIXELS, TURNS = 256, 5
# A block of pixels whose numbers stay in the cache.
_BLOCK = 1 << 12
# A light's sharpness, and where it comes from.
_SHARPNESS, _FROM = 8.0, np.array([0.48, 0.36, 0.8])
# Texels along each side of a map of directions that light is prefiltered in: a divisor of 256.
_MAP = 64

_Shade = Callable[[Int[np.ndarray, " n"], Int[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]], Float[np.ndarray, "n 3"]]


def form_times(
    form: Field | BtfTexels, texels: int, views: Hemisphere, lights: Hemisphere, basis: SpectralBasis
) -> tuple[float | None, float | None]:
    """Milliseconds of a fold, and of a million pixels on one core, of a form that there is a way to draw of.

    texels : how many there are. basis : of the images that a `Field` was fitted to.
    """
    fold = fold_of(form, lights, basis)
    if fold is None:
        return None, None
    place, view, share = _pixels(texels, views)
    folding, shading = [], []
    for _ in range(TURNS):
        begun = time.process_time()
        shade = fold()
        folding.append(time.process_time() - begun)
        begun = time.process_time()
        for start in range(0, len(place), _BLOCK):
            rows = slice(start, start + _BLOCK)
            shade(place[rows], view[rows], share[rows])
        shading.append(time.process_time() - begun)
    return 1e3 * min(folding), 1e9 * min(shading) / len(place)


def fold_of(form: Field | BtfTexels, lights: Hemisphere, basis: SpectralBasis) -> Callable[[], _Shade] | None:
    """Folds one light with a form; what that gives shades pixels. None of what there is no way to draw."""
    light = np.exp(_SHARPNESS * (lights.directions @ _FROM - 1.0)) * lights.solid_angles
    if isinstance(form, BtfTexels):
        table = form.table.transpose(0, 1, 3, 2, 4)
        rows = np.ascontiguousarray(table).reshape(-1, table.shape[3] * table.shape[4])
        weights, number = form.weights, form.form.number.ravel().astype(np.int64)
        own, shape = form.form.basis, table.shape[:3]
        return lambda: _clusters(rows, shape, weights, number, light, own)
    if isinstance(form, PolynomialField):
        each = form.coefficients.reshape(len(form.coefficients), -1, *form.coefficients.shape[3:])
        return lambda: _polynomials(each, form, light, basis)
    if isinstance(form, LafortuneField):
        lobe = form.lobe.reshape(-1, form.lobe.shape[2])
        rho = form.rho.reshape(len(lobe), *form.rho.shape[2:])
        scale = None if form.scale is None else form.scale.reshape(len(form.scale), -1)
        return lambda: _lobes(form.table, lobe, rho, scale, light, basis)
    if isinstance(form, LobeField):
        return lambda: _prefiltered(form, lights, light, basis)
    return None


def _to_xyz(basis: SpectralBasis) -> Float[np.ndarray, "J 3"]:
    return basis.fold(illuminant("D65"), observer("1931_2")).T.astype(np.float32)


def _clusters(rows, shape, weights, number, light, basis) -> _Shade:
    """Fold the light into every cluster's mean and components, by view, in XYZ; return the shading of pixels."""
    taken = (light[:, None, None] * _to_xyz(basis)).reshape(-1, 3).astype(np.float32)
    clusters, views, components = shape
    # X, Y and Z one behind the other, each of all components: what is summed up lies together.
    table = np.ascontiguousarray((rows @ taken).reshape(*shape, 3).swapaxes(2, 3))
    table = table.reshape(clusters * views, 3 * components)

    def shade(place, view, share):
        row = number.take(place)[:, None] * views + view
        seen = table.take(row.ravel(), axis=0).reshape(len(place), 9, components)
        found = (seen @ weights.take(place, axis=0)[:, :, None]).reshape(len(place), 3, 3)
        return np.einsum("ns,nsk->nk", share, found)

    return shade


def _polynomials(each, form: PolynomialField, light, basis) -> _Shade:
    """Fold the light into its six moments; return the shading of pixels."""
    moments, to_xyz = (light @ form.terms).astype(np.float32), _to_xyz(basis)

    def shade(place, view, share):
        found = np.zeros((len(place), each.shape[2]), dtype=np.float32)
        for side in range(3):
            found += share[:, side, None] * (each[view[:, side] % len(each), place] @ moments)
        return found @ to_xyz

    return shade


def _lobes(table, lobe, rho, scale, light, basis) -> _Shade:
    """Fold the light into every lobe, by view; return the shading of pixels."""
    gathered, to_xyz = np.einsum("vlm,l->vm", table, light).astype(np.float32), _to_xyz(basis)

    def shade(place, view, share):
        found = np.zeros((len(place), rho.shape[2]), dtype=np.float32)
        for side in range(3):
            lit = gathered[view[:, side, None], lobe[place]]
            counts = share[:, side] if scale is None else share[:, side] * scale[view[:, side], place]
            found += counts[:, None] * np.einsum("nk,nkj->nj", lit, rho[place])
        return found @ to_xyz

    return shade


def _prefiltered(form: LobeField, lights, light, basis) -> _Shade:
    """Prefilter the light by lobes of every exponent about axes all around; return the shading of pixels.

    Meseth et al. 2003, section 5.2.
    """
    across = np.minimum(np.arange(_MAP) * (256 // _MAP) + 128 // _MAP, 254).astype(np.uint8)
    codes = np.stack(np.meshgrid(across, across, indexing="ij"), axis=-1)
    towards = np.maximum(decoded_axes(codes).reshape(-1, 3) @ lights.directions.T, 1e-9)
    exponents = LEAST * np.sqrt(2.0) ** np.arange(round(2.0 * np.log2(MOST / LEAST)) + 1)
    logarithm, given = np.log(towards).astype(np.float32), light.astype(np.float32)
    maps = np.stack([np.exp(np.float32(n) * logarithm) @ given for n in exponents])
    to_xyz, whole = _to_xyz(basis), np.float32(light.sum())
    axes, kept, amplitudes = (
        part.reshape(len(part), -1, *part.shape[3:]) for part in (form.axes, form.exponents, form.amplitudes)
    )

    def shade(place, view, share):
        found = np.zeros((len(place), amplitudes.shape[-1]), dtype=np.float32)
        for side in range(3):
            seen = view[:, side]
            code = axes[seen, place] // (256 // _MAP)
            exponent = decoded_exponents(kept[seen, place], form.lobes)
            number = np.rint(2.0 * np.log2(exponent / np.float32(LEAST))).astype(np.int64)
            lit = maps[number, code[..., 0].astype(np.int64) * _MAP + code[..., 1]]
            parts = decoded_amplitudes(amplitudes[seen, place], form.largest[seen])
            found += share[:, side, None] * (parts[:, 0] * whole + summed(lit, parts[:, 1:]))
        return found @ to_xyz

    return shade


def _pixels(
    texels: int, views: Hemisphere
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Texels, views and their shares where a ball is seen that is covered twice, as a picture's rows have them."""
    y, x = (np.mgrid[:PIXELS, :PIXELS] + 0.5) * (2.0 / PIXELS) - 1.0
    inside = x * x + y * y < 0.97
    x, y = x[inside], y[inside]
    view, share = views.shares(np.stack([x, y, np.sqrt(1.0 - x * x - y * y)], axis=1))
    side = max(1, int(np.sqrt(texels)))
    column, row = (((at + 1.0) * side).astype(np.int64) % side for at in (x, y))
    return row * side + column, view, share.astype(np.float32)
