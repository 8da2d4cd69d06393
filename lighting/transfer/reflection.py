"""Materials for interreflection: a diffuse reflectance, and glossy terms as scalars times spectra.

They are independent of particular BRDFs. A surface that separates scalars of directions from spectra (`Separable`, or
the terms and palettes of a fast form) keeps its terms; any other has one term per wavelength, which is exact but slow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from ...materials.core.fast import Fast
from ...materials.core.points import Points
from ...materials.core.surface import Surface
from ...runtime.errors import InputError
from ...spectral.bispectral import Bispectral
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import interpolation_matrix
from ..vectors import LEAST_COSINE
from .cells import HemisphereCells
from .hits import shifted_pattern
from .radiant import donaldson

Scalars = Callable[[Points], Float[np.ndarray, "N R"]]
# Relative variation over directions below which a term is diffuse; and the same for a whole surface.
_EVEN_TERM, _EVEN = 1e-6, 0.02
# Number of pairs of directions for that test; least cosine of both to the normal.
_PAIRS, _HEIGHT = 512, 0.1
# Number of spectra of a material for fitting a basis.
_SHOWN = 8
# Pairs of directions in each pair of cells; cells per block.
_TIMES, _AT_ONCE = 4, 8
# Number of views, and of rays per view, of the albedo by view; and the largest correction factor.
_VIEWS, _RAYS, _MOST_CORRECTED = 33, 2048, 2.0
# Steps of a low-discrepancy sequence of places in pairs of cells: powers of the inverse of the real root of x^5 = x + 1
# (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
_PLACES = 1.16730397826141868426 ** -np.arange(1.0, 5.0)


@runtime_checkable
class Separable(Protocol):
    """Surface with f_r = `scalars(points)` (N,R) times `spectra` (R,L)."""

    @property
    def spectra(self) -> Float[np.ndarray, "R L"]:
        """Spectra of each term."""
        ...

    def scalars(self, points: Points) -> Float[np.ndarray, "N R"]:
        """Evaluate f_r of each term without its spectrum, 1/sr."""
        ...


@dataclass(frozen=True, eq=False)
class Reflection:
    """Reflection of a uniform surface: f_r = matt / pi + scalars times spectra.

    wavelengths_nm (L,). matt (L,) : diffuse reflectance. spectra (R,L) : of all other terms; none for a diffuse
    surface. table (R,O,I) : mean of each term for incident directions in one cell of the hemisphere and outgoing ones
    in another. albedo (L,) : bihemispherical reflectance for uniform light.
    shown (n,L) : the albedo, and spectra seen for some directions, scaled to the albedo's maximum.
    by_view (V,R) : reflectance of each term for uniform light towards viewers at evenly spaced cosines from 0 to 1;
    None for an anisotropic surface.
    glow : bispectral reflectance of a fluorescent diffuse surface, including the part without change of wavelength, to
    which all other fields refer; None for any other surface.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    matt: Float[np.ndarray, " L"]
    spectra: Float[np.ndarray, "R L"]
    table: Float[np.ndarray, "R O I"]
    albedo: Float[np.ndarray, " L"]
    shown: Float[np.ndarray, "n L"]
    by_view: Float[np.ndarray, "V R"] | None
    _scalars: Scalars
    _kept: slice | np.ndarray
    glow: Bispectral | None = None

    @classmethod
    def of(cls, surface: Surface, cells: HemisphereCells, name: str = "") -> Reflection:
        """Return the reflection of any surface; a texture is replaced by its mean (`Surface.from_afar`).

        Raises
        ------
        InputError : a fluorescent surface that is not diffuse.
        """
        known = surface.from_afar() if surface.uses_uv else surface
        scalars, spectra = _separated(known)
        points = _pairs()
        values = scalars(points)
        even = np.ptp(values, axis=0) <= _EVEN_TERM * np.abs(values).max(axis=0)
        matt = np.pi * values[:, even].mean(axis=0) @ spectra[even]
        kept = np.flatnonzero(~even)
        seen = values[:, kept] @ spectra[kept] + matt / np.pi
        mean = seen.mean(axis=0)
        if len(kept) and (np.ptp(seen, axis=0) <= _EVEN * mean + 1e-9).all():
            matt, kept = np.pi * mean, kept[:0]
        table = _table(scalars, kept, known.isotropic, cells)
        albedo = matt + np.pi * table.mean(axis=(1, 2), dtype=np.float64) @ spectra[kept]
        shown = _shown(albedo, matt, seen)
        by_view = _by_view(scalars, kept) if known.isotropic else None
        glow = donaldson(known)
        if glow is not None and len(kept):
            words = "one that sends out the same in all directions"
            raise InputError("a glossy surface that fluoresces", field="interreflection", found=name, expected=words)
        return cls(known.wavelengths_nm, matt, spectra[kept], table, albedo, shown, by_view, scalars, kept, glow)

    @property
    def is_matt(self) -> bool:
        """True if there is only the diffuse term."""
        return not len(self.spectra)

    def on(self, wavelengths_nm: Float[np.ndarray, " M"]) -> Reflection:
        """Interpolate to other wavelengths; returns itself if they are its own."""
        if np.array_equal(self.wavelengths_nm, wavelengths_nm):
            return self
        to = interpolation_matrix(self.wavelengths_nm, wavelengths_nm).T
        spectra = {name: getattr(self, name) @ to for name in ("matt", "spectra", "albedo", "shown")}
        return replace(self, wavelengths_nm=wavelengths_nm, **spectra)

    @cached_property
    def bispectral(self) -> Bispectral:
        """Diffuse bispectral surface with the same albedo for uniform light."""
        if self.glow is not None:
            return self.glow
        return Bispectral.diagonal(Spectrum.sampled(self.wavelengths_nm, self.albedo, "reflectance"))

    @cached_property
    def shown_as_matrices(self) -> list[Bispectral]:
        """`bispectral`, and the spectra of `shown` as diagonal matrices."""
        # A diffuse surface has only one spectrum.
        more = [] if self.is_matt else np.unique(np.maximum(self.shown, 0.0), axis=0)
        samples = (Spectrum.sampled(self.wavelengths_nm, each, "reflectance") for each in more)
        return [self.bispectral, *map(Bispectral.diagonal, samples)]

    def scalars(self, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N R"]:
        """Evaluate f_r of each term, 1/sr; 0 for directions on or below the horizon."""
        return self._scalars(Points(wi, wo))[:, self._kept]

    def correction(self, f_r: Float[np.ndarray, "n N R"], cosine: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n R"]:
        """Compute factors for the mean of f_r over rays that make it exact for uniform light.

        f_r : of N cosine-distributed rays. cosine : to the viewer. Few rays hit a narrow highlight, by chance too many
        or too few; the error for uniform light is known, and is removed within limits (a ratio estimator).
        """
        if self.by_view is None:
            return np.ones((len(f_r), f_r.shape[2]), dtype=f_r.dtype)
        place = np.clip(cosine, 0.0, 1.0) * (len(self.by_view) - 1)
        left = np.minimum(place.astype(np.int64), len(self.by_view) - 2)
        share = (place - left)[:, None]
        want = (1.0 - share) * self.by_view[left] + share * self.by_view[left + 1]
        met = np.pi * f_r.mean(axis=1)
        ratio = np.divide(want, met, out=np.ones_like(want), where=met * want > 0.0)
        return np.clip(ratio, 1.0 / _MOST_CORRECTED, _MOST_CORRECTED).astype(f_r.dtype)


def _separated(surface: Surface) -> tuple[Scalars, Float[np.ndarray, "R L"]]:
    if isinstance(surface, Separable):
        return surface.scalars, np.asarray(surface.spectra)
    if isinstance(surface, Fast) and all(one.palette.entries == 1 for one in surface.summands):
        summands = surface.summands

        def scalars(points: Points) -> Float[np.ndarray, "N R"]:
            found = np.concatenate([one.terms(points).value for one in summands], axis=1)
            up = (points.wi[:, 2] > 0.0) & (points.wo[:, 2] > 0.0)
            return found * np.divide(1.0, points.wi[:, 2], out=np.zeros(len(points)), where=up)[:, None]

        if all(one.terms(_pairs()).place is None for one in summands):
            return scalars, np.concatenate([one.palette.samples[0] for one in summands])
    return surface.at, np.eye(len(surface.wavelengths_nm))


def _pairs() -> Points:
    generator = np.random.default_rng(5)
    height = generator.uniform(_HEIGHT, 1.0, (2, _PAIRS))
    turn = generator.uniform(0.0, 2.0 * np.pi, (2, _PAIRS))
    across = np.sqrt(1.0 - height**2)
    wi, wo = np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=2)
    # Mirror directions, where a highlight is.
    wo[: _PAIRS // 2] = wi[: _PAIRS // 2] * (-1.0, -1.0, 1.0)
    return Points(wi, wo)


def _by_view(scalars: Scalars, kept: np.ndarray) -> Float[np.ndarray, "V R"]:
    wi = _even_rays()
    found = np.zeros((_VIEWS, len(kept)))
    for number, cosine in enumerate(np.linspace(0.0, 1.0, _VIEWS) if len(kept) else ()):
        cosine = max(float(cosine), LEAST_COSINE)
        wo = np.broadcast_to([np.sqrt(1.0 - cosine * cosine), 0.0, cosine], wi.shape)
        found[number] = np.pi * scalars(Points(wi, wo))[:, kept].mean(axis=0)
    return found


@cache
def _even_rays() -> Float[np.ndarray, "n 3"]:
    square = shifted_pattern(np.zeros(1, dtype=np.int64), _RAYS)[0]
    radius, turn = np.sqrt(square[:, 0]), 2.0 * np.pi * square[:, 1]
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - square[:, 0])], axis=1)


def _shown(albedo: np.ndarray, matt: np.ndarray, seen: np.ndarray) -> Float[np.ndarray, "n L"]:
    """Return spectra for fitting a basis: the albedo, and scaled spectra of the diffuse term and of highlights."""
    some = np.concatenate([matt[None], seen[:: max(1, len(seen) // _SHOWN)]])
    highest, bright = some.max(axis=1, keepdims=True), albedo.max()
    scaled = some * np.divide(bright, highest, out=np.zeros_like(highest), where=highest > 0.0)
    return np.concatenate([albedo[None], scaled])


def _table(scalars: Scalars, kept: np.ndarray, isotropic: bool, cells: HemisphereCells) -> Float[np.ndarray, "R O I"]:
    found = np.zeros((len(kept), len(cells), len(cells)), dtype=np.float32)
    if not len(kept):
        return found
    for some, wi, wo in _pairs_of_cells(cells, isotropic):
        values = scalars(Points(wi, wo))[:, kept].reshape(len(some), len(cells), _TIMES, len(kept))
        found[:, some] = np.moveaxis(values.mean(axis=2), 2, 0)
    if isotropic:
        to, source, turn = cells.quarter, cells.quarter, np.arange(len(cells))
        for _ in range(3):
            to, turn = cells.turned(to), cells.turned(turn)
            found[:, to[:, None], turn] = found[:, source]
    return found


@lru_cache(maxsize=2)
def _pairs_of_cells(cells: HemisphereCells, isotropic: bool) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return blocks of outgoing cells, with `_TIMES` directions wi in all cells and wo in these for each pair."""
    found, first = [], 0
    seen = cells.quarter if isotropic else np.arange(len(cells))
    for some in np.array_split(seen, -(-len(seen) // _AT_ONCE)):
        pairs = (len(some), len(cells), _TIMES)
        both = np.broadcast_to(some[:, None, None], pairs), np.broadcast_to(np.arange(len(cells))[:, None], pairs)
        # Random places in cells, since the centres of the outermost ones are too far from grazing angles.
        places = _PLACES * np.arange(first, first + np.prod(pairs))[:, None] % 1.0
        first += len(places)
        wo, wi = (
            cells.within(each.ravel(), place).astype(np.float32)
            for each, place in zip(both, (places[:, :2], places[:, 2:]), strict=True)
        )
        found.append((some, wi, wo))
    return found
