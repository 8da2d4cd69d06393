"""The fast form of a surface of maps: planes of coefficients, normals and roughness, times a few spectra."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...spectral.basis import SpectralBasis
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.palette import Palette
from ..core.fast import Fast, Summand
from ..core.fit_error import FitError
from ..core.protocol import LIGHTS, sphere_protocol
from ..core.surface import Cutout
from .map_planes import MapPlanes, PlaneLayout
from .map_set import ROUNDING, MapSet, Mask
from .mapped_slices import MappedSlices
from .texture_form import differences

# Texels that the number of coefficients is judged on.
_JUDGED = 4096
# Share of the budget that a texel's colour may be off at the 99th percentile.
_SHARE = 0.2
# Fewest coefficients: with the last term, which is grey, they fill the four numbers of a texel; fewer save nothing.
_AT_LEAST = 3
# Pixels of the sphere on which half precision is judged.
_SPHERE = 48


@dataclass(frozen=True, eq=False)
class MapsForm(Fast):
    """Fast form of a surface of maps: exact in every direction, with the colours of texels within a budget."""

    NAME: ClassVar[str] = "maps"
    WORDS: ClassVar[str] = "maps"

    maps: MapPlanes
    error: FitError | None = None

    @property
    def summands(self) -> tuple[Summand, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The maps, as the only summand."""
        return (self.maps,)

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """True without bumps and with one roughness for all directions."""
        layout = self.maps.layout
        spread = layout.starts["spread"]
        alike = layout.columns[spread] == layout.columns[spread + 2]
        alike &= layout.columns[spread] >= 0 or layout.constants[spread] == layout.constants[spread + 2]
        normals = [layout.starts[name] for name in ("normal", "coat_normal")[: 1 + layout.coated]]
        level = not layout.bumps and not any(any(layout.constants[start : start + 2]) for start in normals)
        return bool(alike and level and layout.columns[spread + 1] < 0 and layout.constants[spread + 1] == 0.0)

    @cached_property
    def cutout(self) -> Cutout | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Opacity mask of its coverage; see `Surface.cutout`."""
        maps, layout = self.maps, self.maps.layout
        start = layout.starts["covers"]
        column = layout.columns[start]
        found = np.array([[[layout.constants[start]]]]) if column < 0 else maps.planes[..., column : column + 1]
        opacity = found.astype(np.float64)
        return Mask(opacity, maps.cutoff, maps.placement) if (opacity < maps.cutoff - ROUNDING).any() else None

    @cached_property
    def _whole(self) -> MapsForm:
        return replace(self, maps=replace(self.maps, cut=True))

    def without_holes(self) -> MapsForm:
        """Implement `Fast.without_holes`."""
        return self if self.cutout is None else self._whole

    def average(self) -> MapsForm:
        """Average the whole texture, as seen from afar: the mean outside holes."""
        if not self.maps.uses_uv:
            return self
        levels, layout = self.maps.levels
        last = levels[-1].reshape(1, -1)
        numbers = [
            float(last[0, column]) if column >= 0 else constant
            for column, constant in zip(layout.columns, layout.constants, strict=True)
        ]
        starts, kept = layout.starts, self.maps.layout
        found = dict(zip(starts, np.split(np.array(numbers), list(starts.values())[1:]), strict=True))
        for name in ("body", "rest"):
            # The body keeps the cosine of the mean normal.
            found[name] *= found["up"][0]
        # Facets lie level.
        found |= {"spread": found["spread"] + found["differ"], "normal": np.zeros(2), "covers": np.ones(1)}
        if layout.coated:
            wider = found["coat_differ"]
            found |= {"coat_spread": found["coat_spread"] + 0.5 * (wider[0] + wider[2]), "coat_normal": np.zeros(2)}
        alike = np.concatenate([found[name] for name in kept.starts if kept.starts[name] < len(kept.columns)])
        flat = replace(kept, columns=(-1,) * len(alike), constants=tuple(alike.tolist()))
        planes = replace(self.maps, planes=np.zeros((1, 1, 0), np.float32), layout=flat, cutoff=0.0, precision="single")
        return replace(self, maps=planes)

    def in_basis(self, basis: SpectralBasis) -> MapsForm:
        """Implement `Fast.in_basis`; the planes are shared."""
        return replace(self, maps=self.maps.in_basis(basis))

    def environment_form(self) -> MappedSlices:
        """Implement `Fast.environment_form`; its slices are computed on first use."""
        return MappedSlices(self.maps)

    def stored(self) -> dict[str, Any]:
        """Implement `MapPlanes.stored`."""
        return self.maps.stored()

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> MapsForm:
        """Implement `Fast.from_stored`."""
        return cls(MapPlanes.from_stored(kept), error)


def maps_form(surface: MapSet, budget: float = 0.5) -> MapsForm:
    """Fit the fast form of a surface of maps.

    The number of coefficients, three or more if colours have as many, is the smallest that keeps the colours of bodies
    and facets within a fifth of `budget` (ΔE94, 99th percentile) and within `budget` at all texels judged, under each
    of `protocol.LIGHTS`. Planes are in half precision if a sphere then stays within a fifth (99th percentile) and two
    fifths (at most) of `budget` from single precision.
    """
    basis = _basis(surface, budget)
    rank, height, width = basis.size, *surface.size
    numbers = np.empty((height * width, 3 * rank + (11 if surface.coated else 7)), dtype=np.float32)
    linear = surface.uplift == "mallett-yuksel"
    analysis = surface.spectra(np.eye(3)) @ basis.analysis if linear else basis.analysis

    def coefficients(colours: np.ndarray) -> np.ndarray:
        return (colours if linear else surface.spectra(colours)) @ analysis

    for rows, found in surface.blocks():
        body = coefficients(found.body)
        numbers[rows, :rank] = body * found.through[:, None]
        numbers[rows, rank : 2 * rank] = body * found.rest[:, None]
        numbers[rows, 2 * rank : 3 * rank] = coefficients(found.facets)
        rest = [found.edge[:, None], found.normal, found.spread, found.covers[:, None]]
        if found.coat is not None and found.coat_spread is not None and found.coat_normal is not None:
            rest += [found.coat[:, None], found.coat_spread[:, None], found.coat_normal]
        numbers[rows, 3 * rank :] = np.concatenate(rest, axis=1)
    # Each coefficient's largest magnitude is 1: what was divided out goes into its spectrum.
    for r in range(rank):
        tallest = np.abs(numbers[:, r : 3 * rank : rank]).max()
        scale = float(tallest) if tallest > 0 else 1.0
        numbers[:, r : 3 * rank : rank] /= np.float32(scale)
        basis = replace(basis, synthesis=basis.synthesis * np.where(np.arange(rank) == r, np.float32(scale), 1.0))
    palette = Palette.of(
        np.concatenate([basis.synthesis.T, np.ones((1, len(surface.wavelengths_nm)))]),
        SpectralBasis.sampled(surface.wavelengths_nm),
    )
    planes, layout = _layout(numbers.reshape(height, width, -1), rank, surface.coated)
    form = MapsForm(MapPlanes(planes, layout, palette, surface.cutoff, surface.placement))
    return _halved(form, surface.isotropic, budget)


def _basis(surface: MapSet, budget: float) -> SpectralBasis:
    """Choose the basis of the coefficients of body and facets."""
    height, width = surface.size
    numbers = np.arange(0, height * width, max(1, height * width // _JUDGED))
    found = surface.texels(*np.divmod(numbers, width))
    body, shine = surface.spectra(found.body), surface.spectra(found.facets)
    # Highlights are as bright as you like: their colour is judged as that of bodies.
    tallest = np.abs(shine).max(axis=1, keepdims=True)
    judged = np.concatenate([body, np.divide(shine, tallest, out=np.zeros_like(shine), where=tallest > 0)])
    folding = Folding(observer("1931_2"), [illuminant(name) for name in LIGHTS])
    weights = folding.weights(surface.wavelengths_nm)
    full = SpectralBasis.balanced(judged, weights, wavelengths_nm=surface.wavelengths_nm)
    truth, whites = judged @ weights, weights.sum(axis=0)

    def within(size: int) -> bool:
        basis = full.truncated(size)
        off = differences(truth, judged @ basis.analysis @ (basis.synthesis.T @ weights), whites)
        return bool(np.percentile(off, 99, axis=1).max() <= _SHARE * budget and off.max() <= budget)

    least = min(_AT_LEAST, full.size)
    return full.truncated(next((size for size in range(least, full.size) if within(size)), full.size))


def _layout(numbers: Float[np.ndarray, "H W T"], rank: int, coated: bool) -> tuple[np.ndarray, PlaneLayout]:
    """Select the planes that vary over texels; constants and repeated widths take none of their own."""
    columns, kept = [], []
    starts = PlaneLayout(rank, (), (), coated).starts
    varied = (numbers != numbers[:1, :1]).any(axis=(0, 1))
    groups = [(0, rank), (rank, rank), (2 * rank, rank), (starts["edge"], 1), (starts["normal"], 2)]
    groups += [(starts["coat_normal"], 2)] if coated else []
    for first, count in groups:
        # Numbers of a group lie side by side, or nowhere.
        varied[first : first + count] = varied[first : first + count].any()
    for number in range(numbers.shape[2]):
        if not varied[number]:
            columns.append(-1)
        elif number == starts["spread"] + 2 and np.array_equal(numbers[..., number], numbers[..., number - 2]):
            columns.append(columns[number - 2])
        else:
            columns.append(len(kept))
            kept.append(number)
    constants = tuple(float(value) for value in numbers[0, 0])
    return np.ascontiguousarray(numbers[..., kept]), PlaneLayout(rank, tuple(columns), constants, coated)


def _halved(form: MapsForm, isotropic: bool, budget: float) -> MapsForm:
    """Convert the form to half precision if that keeps its appearance within the budget."""
    layout = form.maps.layout
    if layout.columns[layout.starts["spread"] + 1] >= 0:
        # The determinant of a narrow, turned highlight would be what rounding leaves of it.
        return form
    with np.errstate(over="ignore"):
        planes = form.maps.planes.astype(np.float16)
    if not np.isfinite(planes).all() or not form.maps.uses_uv:
        return form
    half = replace(form, maps=replace(form.maps, planes=planes, precision="half"))
    sphere = sphere_protocol(_SPHERE, isotropic)
    for truth, sample in zip(sphere.samples(form, LIGHTS), sphere.samples(half, LIGHTS), strict=True):
        off = sphere.differences(truth, sample)
        if not (np.percentile(off, 99) <= _SHARE * budget and off.max() <= 2.0 * _SHARE * budget):
            return form
    return half
