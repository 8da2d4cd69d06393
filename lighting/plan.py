"""Plan of a scene: the smallest spectral basis that keeps its colours within a ΔE94 budget."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..materials.core.fast import Fast
from ..materials.core.points import Points
from ..runtime.errors import InputError
from ..spectral.basis import SpectralBasis
from ..spectral.difference import delta_e_xyz
from ..spectral.minimax_basis import minimax_basis
from ..spectral.observers import Observer
from ..spectral.spectrum import Spectrum
from ..spectral.wavelengths import common_wavelengths, interpolation_matrix

#: Share of the budget that the spectral basis may spend; the rest is for the factors over directions.
SPECTRAL_SHARE = 0.1
# Largest number of evaluated products of reflectances with the same number of factors; of more, a random subset is
# used.
_MOST_PRODUCTS = 1024
# Pairs of directions at which the spectra of a material are sampled.
_PAIRS = 48


@dataclass(frozen=True, eq=False)
class ScenePlan:
    """Spectral basis and precision for rendering a scene.

    Parameters
    ----------
    basis : spectral basis of palettes.
    budget_delta_e94 : error budget of the whole image.
    spectral_delta_e94 : largest ΔE94 that the basis causes over the scene's own spectra and lights.
    precision : of factors and of the framebuffer.
    reasons : explanation of these choices.
    """

    basis: SpectralBasis
    budget_delta_e94: float
    spectral_delta_e94: float
    precision: str
    reasons: tuple[str, ...]

    @property
    def basis_size(self) -> int:
        """Number of coefficients per spectrum, J."""
        return self.basis.size


def plan_scene(
    surfaces: Sequence[Fast],
    lights: Sequence[Spectrum],
    observer: Observer,
    budget_delta_e94: float = 1.0,
    bounces: int = 0,
) -> ScenePlan:
    """Choose the basis and its size for the materials and lights of a scene.

    Every material is sampled at a fixed set of direction pairs, on common wavelengths (`common_wavelengths`); with
    `bounces`, products of those spectra are added. The balanced basis (rank-J truncation of reflectance x light) grows
    until its largest ΔE94 over all spectra and lights is within `SPECTRAL_SHARE` of the budget; the minimax basis
    replaces it if fewer coefficients suffice. One light without bounces is exact at J = 3.
    """
    if not surfaces or not lights:
        raise InputError(
            "nothing to plan for", found=f"{len(surfaces)} materials, {len(lights)} lights", expected="one of each"
        )
    if not budget_delta_e94 > 0:
        raise InputError(
            "the budget must be positive", field="budget", found=budget_delta_e94, expected="a ΔE94 above 0"
        )
    wavelengths_nm = common_wavelengths([one.wavelengths_nm for one in surfaces])
    once = np.concatenate([_seen_spectra(one, wavelengths_nm) for one in surfaces])
    seen = once
    for _ in range(bounces):
        seen = np.concatenate([seen, _products(once, seen)])
    weights = [observer.weights(light, wavelengths_nm) for light in lights]
    columns = np.concatenate(weights).T
    allowed = SPECTRAL_SHARE * budget_delta_e94

    full = SpectralBasis.balanced(seen, columns, wavelengths_nm=wavelengths_nm)
    errors: dict[int, float] = {}
    for size in range(min(3, full.size), full.size + 1):
        errors[size] = _worst_delta_e94(full.truncated(size), seen, weights)
        if errors[size] <= allowed:
            break
    basis, error = full.truncated(max(errors)), errors[max(errors)]
    fewer: dict[int, float] = {}
    while error <= allowed and basis.size > 3:
        smaller = minimax_basis(seen, columns, basis.size - 1, wavelengths_nm, enough=allowed)
        fewer[smaller.size] = _worst_delta_e94(smaller, seen, weights)
        if fewer[smaller.size] > allowed:
            break
        basis, error = smaller, fewer[smaller.size]
    size = basis.size
    peercy = _worst_delta_e94(SpectralBasis.peercy(seen, columns, size, wavelengths_nm), seen, weights)
    reasons = [
        f"The scene holds {len(surfaces)} materials, {len(lights)} lights and {bounces or 'no'} "
        f"{'bounce' if bounces == 1 else 'bounces'}, seen by the {observer.name}.",
        f"Of the budget of ΔE94 {budget_delta_e94:g} the spectral basis may spend {allowed:.2g}; "
        f"{len(seen)} spectra under each light were tried.",
        *(f"Balanced basis, J = {j}: max ΔE94 {worst:.2g}." for j, worst in errors.items()),
        *(f"Minimax basis, J = {j}: max ΔE94 {worst:.2g}." for j, worst in fewer.items()),
        f"J = {size} is kept in place of {wavelengths_nm.size} samples; "
        f"the Peercy basis of that size would cost max ΔE94 {peercy:.2g}.",
    ]
    if len(lights) == 1 and bounces == 0:
        reasons.append("One light and no bounce: three numbers a spectrum (X, Y, Z of that light) are exact.")
    return ScenePlan(basis, budget_delta_e94, error, "float32", tuple(reasons))


def bounce_basis(
    reflectances: Float[np.ndarray, "R L"],
    lights: Sequence[Spectrum],
    observer: Observer,
    wavelengths_nm: Float[np.ndarray, "L"],
) -> SpectralBasis:
    """Return the smallest balanced basis for interreflected light.

    Incident light is a product of up to three reflectances, and is seen over one more: the basis preserves the colours
    of such products under all lights within ΔE94 `SPECTRAL_SHARE`, for each of the reflectances and for white.
    """
    distinct = np.unique(reflectances, axis=0)
    seen, last = [distinct], distinct
    for _ in range(2):
        all_of_them = (distinct[:, None] * last).reshape(-1, distinct.shape[1])
        last = all_of_them if len(all_of_them) <= _MOST_PRODUCTS else _products(distinct, last, _MOST_PRODUCTS)
        seen.append(last)
    products, receivers = np.concatenate(seen), np.concatenate([np.ones_like(distinct[:1]), distinct])
    weights = [observer.weights(light, wavelengths_nm) for light in lights]
    columns = np.concatenate([one * receiver for one in weights for receiver in receivers]).T
    full = SpectralBasis.balanced(products, columns, wavelengths_nm=wavelengths_nm)
    for size in range(1, full.size):
        basis = full.truncated(size)
        shown = basis.reconstruct(basis.project(products))
        worst = max(
            float(delta_e_xyz((products * one) @ w.T, (shown * one) @ w.T, w.sum(axis=1)).max())
            for w in weights
            for one in receivers
        )
        if worst <= SPECTRAL_SHARE:
            return basis
    return full


def _seen_spectra(surface: Fast, wavelengths_nm: Float[np.ndarray, "L"]) -> Float[np.ndarray, "N L"]:
    """Sample pi f_r cos(theta_i) of a material (1 for the perfect diffuser facing the light) at fixed pairs of
    directions, each at a different place on a texture.
    """
    generator = np.random.default_rng(1)
    wi, wo = _upper_directions(generator, _PAIRS), _upper_directions(generator, _PAIRS)
    wo[: _PAIRS // 4] = wi[: _PAIRS // 4] * (-1, -1, 1)  # mirror directions, where lobes show their colour
    own = np.pi * surface.shaded(Points(wi, wo, generator.random((_PAIRS, 2))))
    grid = surface.wavelengths_nm
    return own if np.array_equal(grid, wavelengths_nm) else own @ interpolation_matrix(grid, wavelengths_nm).T


def _upper_directions(generator: np.random.Generator, count: int) -> Float[np.ndarray, "N 3"]:
    """Sample directions above the surface, uniform in cos(theta) from 0.05 to 1."""
    height, turn = generator.uniform(0.05, 1.0, count), generator.uniform(0.0, 2 * np.pi, count)
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=-1)


def _products(first: np.ndarray, second: np.ndarray, count: int = 4096) -> np.ndarray:
    """Return up to `count` products of two spectra: light after one more bounce."""
    generator = np.random.default_rng(2)
    return first[generator.integers(len(first), size=count)] * second[generator.integers(len(second), size=count)]


def _worst_delta_e94(basis: SpectralBasis, surfaces: np.ndarray, weights: Sequence[np.ndarray]) -> float:
    shown = basis.reconstruct(basis.project(surfaces))
    return max(float(delta_e_xyz(surfaces @ w.T, shown @ w.T, w.sum(axis=1)).max()) for w in weights)
