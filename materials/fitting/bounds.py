"""Bounds that packs keep everywhere above the horizon: hardly below black, and not far above the original.

A sum of products follows the original at pairs that pictures show; elsewhere its terms are unconstrained, may cancel,
and leave light of any colour, or negative light. Violations of the bounds are searched for over both hemispheres at
every wavelength, and become guards of the fit (`SeenSamples.with_guards`). A pack is linear along every axis between
the nodes of its grid, so that its extremes are at nodes: the search evaluates the nodes of every pack and pairs spread
over the hemispheres, and then refines the worst by coordinate search.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int

from ..core.axes import Axis, Frame, FrameAngles, frame_angles
from ..core.brdf import Brdf
from ..core.directions import angles, azimuth_difference, io_angles, io_from_half_difference, spherical
from ..factored.pack import FactorPack
from .visible_pairs import everywhere_angles
from .visible_samples import working_spectra

#: Packs shade to no less than this, where a white diffuser facing the light is 1.
LOWEST = -0.02
#: Packs shade to no more than this many times the original's largest value anywhere at the same wavelength.
LARGEST = 2.0
# A fit keeps within this share of the lower bound: the rest is for rounding and half precision, which counts most near
# black.
_KEPT_OF_LOWEST = 0.8
# A fit keeps within this share of the upper bound.
_KEPT_OF_LARGEST = 0.97
# Guards stand at this share of the lower end that a fit keeps: a little inside, so that a place which is mended is not
# found again.
_GUARD_OF_LOWEST = 0.8
# Guards stand at this share of the upper end that a fit keeps.
_GUARD_OF_LARGEST = 0.9
# Floor of the original's largest value at a wavelength.
_DARKEST = 0.02
# Pairs sampled, of an isotropic surface.
_PAIRS = 40_000
# Pairs sampled, of an anisotropic surface.
_PAIRS_ANISOTROPIC = 100_000
# Places from which the search goes downhill, for each of the two bounds.
_DOWNHILL = 400
# Most nodes sampled on one grid; of a larger grid every second, third and so on.
_NODES = 1_000_000
# Pairs per block in the evaluation of packs.
_BLOCK = 8192
# First step downhill, radians.
_STEP = 0.04
# Number of halvings of that step.
_HALVINGS = 6
# Pairs closer than this in all angles are one place, radians.
_PLACE = 0.05
# Places that a search gives, at most.
_PLACES = 300
# The lower bound and the upper one, as rows of `Bounds._ends`.
_SIDES = (0, 1)
# Largest polar angle sampled, radians: just above the horizon.
_EDGE = 0.5 * np.pi - 1e-4
# The least cosine of a direction that counts as above the horizon.
_LEAST_COSINE = 1e-4
# Places by their angles, where packs come nearest to the lower and to the upper bound.
WorstPlaces = tuple[Float[np.ndarray, "_ A"], Float[np.ndarray, "_ A"]]


@dataclass(frozen=True)
class Extremes:
    """Extremes of packs: pi f_r cos(theta_i), at any wavelength, over both hemispheres.

    lowest : the lowest value, 0 if none is negative. ratio : the largest over the original's largest anywhere at the
    same wavelength.
    """

    lowest: float
    ratio: float

    @property
    def within(self) -> bool:
        """True if both bounds are kept."""
        return self.lowest >= LOWEST and self.ratio <= LARGEST


@dataclass(frozen=True, eq=False)
class Violations:
    """N pairs where packs exceed their share of the bounds.

    wavelength : index of the working wavelength of the largest excess. low : True for the lower bound.
    worst_excess : largest shaded value anywhere over the value that a fit allows: above 1 if there is a pair.
    """

    wi: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]
    wavelength: Int[np.ndarray, " N"]
    low: Bool[np.ndarray, " N"]
    worst_excess: float

    def __len__(self) -> int:
        return len(self.wi)


@dataclass(eq=False)
class Bounds:
    """Bounds of one original, and the search for violations by packs.

    largest : largest value of the original found at each working wavelength. It only grows: wherever packs come near
    the upper bound, the original is evaluated too.
    """

    brdf: Brdf
    largest: Float[np.ndarray, " L"]
    # The packs that were searched last, and their worst places.
    _last: tuple[tuple[FactorPack, ...], WorstPlaces] | None = None

    @classmethod
    def of(cls, brdf: Brdf) -> Bounds:
        """Find the original's largest values."""
        wi, wo = _pairs(_angles(_PAIRS // 8, brdf.isotropic))
        values = np.pi * working_spectra(brdf, wi, wo)
        return cls(brdf, np.maximum(values.max(axis=0), _DARKEST))

    @property
    def isotropic(self) -> bool:
        """True if the original is isotropic."""
        return self.brdf.isotropic

    def extremes(self, packs: tuple[FactorPack, ...], rounded: tuple[FactorPack, ...] | None = None) -> Extremes:
        """Return the extremes of the packs: the lowest value and the largest ratio to the original.

        rounded : the same packs in half precision, evaluated in their place: at the worst places of the packs
        themselves and by coordinate search from there, since rounding moves no place far.
        """
        worst = self._worst(packs)
        if rounded is not None:
            packs, worst = rounded, self._searched_downhill(rounded, worst)
        low, high = (_shaded(packs, *_pairs(found)) for found in worst)
        return Extremes(float(min(low.min(), 0.0)), float(np.max(high / self.largest)))

    def violations(self, packs: tuple[FactorPack, ...]) -> Violations:
        """Find pairs where packs exceed the share of the bounds that a fit keeps, the worst pair of each place."""
        found = np.concatenate(self._worst(packs))
        wi, wo = _pairs(found)
        shaded = _shaded(packs, wi, wo)
        excess = self._excess(shaded, _SIDES)
        most = excess.max(axis=1)
        order = np.argsort(-most, kind="stable")
        order = order[most[order] > 1.0]
        _, first = np.unique(np.round(found[order] / _PLACE), axis=0, return_index=True)
        kept = order[np.sort(first)[:_PLACES]]
        at = np.argmax(excess[kept], axis=1)
        return Violations(wi[kept], wo[kept], at, shaded[kept, at] < 0.0, float(most.max(initial=0.0)))

    def everywhere(self, count: int) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """Return wi and wo of about `count` of the searched pairs, all over both hemispheres."""
        found = _angles(_PAIRS if self.isotropic else _PAIRS_ANISOTROPIC, self.isotropic)
        return _pairs(found[:: max(1, len(found) // count)])

    @property
    def limits(self) -> Float[np.ndarray, "2 L"]:
        """Limits of the guards: least and largest pi f_r cos(theta_i) at each working wavelength."""
        low, high = self._ends
        return np.stack([_GUARD_OF_LOWEST * low, _GUARD_OF_LARGEST * high])

    @property
    def _ends(self) -> Float[np.ndarray, "2 L"]:
        """Lowest and largest pi f_r cos(theta_i) that a fit allows."""
        lowest = np.full_like(self.largest, _KEPT_OF_LOWEST * LOWEST)
        return np.stack([lowest, _KEPT_OF_LARGEST * LARGEST * self.largest])

    def _worst(self, packs: tuple[FactorPack, ...]) -> WorstPlaces:
        """Find the places of the packs nearest to the lower and to the upper bound; cached for the last packs."""
        if self._last is None or self._last[0] is not packs:
            self._last = packs, self._searched_downhill(packs, self._starts(packs))
        return self._last[1]

    def _starts(self, packs: tuple[FactorPack, ...]) -> WorstPlaces:
        """Return the worst of all searched places, before refinement."""
        low, high = [], []
        against = (1.0 / self._ends).astype(np.float32)
        for places in self._places(packs):
            for rows, shaded in places.shaded(packs):
                # The lower bound is the same at every wavelength.
                beyond_low, beyond_high = shaded.min(axis=0) * against[0, 0], (shaded * against[1][:, None]).max(axis=0)
                for found, excess in ((low, beyond_low), (high, beyond_high)):
                    some = np.argpartition(-excess, min(_DOWNHILL, len(excess) - 1))[:_DOWNHILL]
                    found.append((excess[some], places.angles[rows][some]))
        return _strongest(low), _strongest(high)

    def _searched_downhill(self, packs: tuple[FactorPack, ...], starts: WorstPlaces) -> WorstPlaces:
        """Refine these places by coordinate search; evaluate the original too where packs are bright."""
        darkest, brightest = (self._downhill(packs, found, (side,)) for found, side in zip(starts, _SIDES, strict=True))
        near = self._worst_excess(packs, brightest, _SIDES[1:]) > 0.5
        if near.any():
            there = np.pi * working_spectra(self.brdf, *_pairs(brightest[near]))
            self.largest = np.maximum(self.largest, there.max(axis=0))
        return darkest, brightest

    def _places(self, packs: tuple[FactorPack, ...]) -> Iterator[Places]:
        """Yield pairs spread over the hemispheres, then the nodes of every pack."""
        yield _spread(self.isotropic)
        for frame, axes in dict.fromkeys((pack.frame, pack.axes) for pack in packs):
            yield _nodes(frame, axes, self.isotropic)

    def _downhill(
        self, packs: tuple[FactorPack, ...], starts: Float[np.ndarray, "N A"], sides: tuple[int, ...]
    ) -> Float[np.ndarray, "N A"]:
        """Search for larger excesses over the bounds of these sides, along one angle at a time, in halved steps."""
        angles = starts.copy()
        excess = self._worst_excess(packs, angles, sides)
        step = _STEP
        for _ in range(_HALVINGS):
            for axis in range(angles.shape[1]):
                for sign in (step, -step):
                    moved = angles.copy()
                    moved[:, axis] += sign
                    moved[:, :2] = np.clip(moved[:, :2], 0.0, _EDGE)
                    found = self._worst_excess(packs, moved, sides)
                    better = found > excess
                    angles[better], excess[better] = moved[better], found[better]
            step *= 0.5
        return angles

    def _worst_excess(self, packs: tuple[FactorPack, ...], angles: np.ndarray, sides: tuple[int, ...]) -> np.ndarray:
        """Compute the largest `_excess` over the wavelengths."""
        return self._excess(_shaded(packs, *_pairs(angles)), sides).max(axis=1)

    def _excess(self, shaded: Float[np.ndarray, "N L"], sides: tuple[int, ...]) -> Float[np.ndarray, "N L"]:
        """Divide shaded values by those that a fit allows on these sides: above 1 beyond them."""
        return np.max([shaded / self._ends[side] for side in sides], axis=0)


@dataclass(frozen=True, eq=False)
class Places:
    """Pairs to evaluate, with cached frame angles.

    angles : theta_i, theta_o, phi_o - phi_i and, unless isotropic, phi_i.
    """

    angles: Float[np.ndarray, "N A"]
    _frames: dict[tuple[Frame, bool], FrameAngles] = field(default_factory=dict)

    def shaded(self, packs: tuple[FactorPack, ...]) -> Iterator[tuple[slice, Float[np.ndarray, "L n"]]]:
        """Yield blocks of pi f_r cos(theta_i) at the working wavelengths, in float32, which suffices for a search."""
        spectra = [np.pi * pack.spectra.T.astype(np.float32) for pack in packs]
        for start in range(0, len(self.angles), _BLOCK):
            rows = slice(start, start + _BLOCK)
            parts = [
                spectrum @ pack.values_at(self._at(pack, rows), np.float32).T
                for pack, spectrum in zip(packs, spectra, strict=True)
            ]
            yield rows, sum(parts[1:], parts[0])

    def _at(self, pack: FactorPack, rows: slice) -> FrameAngles:
        """Return the angles of some of the places in a pack's frame."""
        key = (pack.frame, pack.anisotropic)
        if key not in self._frames:
            self._frames[key] = frame_angles(pack.frame, *_pairs(self.angles), pack.anisotropic)
        known = self._frames[key]
        some = {name: values[rows] for name, values in known.angles.items()}
        return FrameAngles(pack.frame, some, known.scale[rows], (len(known.scale[rows]),))


def _strongest(found: list[tuple[np.ndarray, np.ndarray]]) -> Float[np.ndarray, "N A"]:
    """Return the worst places as starts of the search, distinct as long as there are enough."""
    excess, angles = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.argsort(-excess, kind="stable")
    looked_at = 2 * _DOWNHILL
    while True:
        # The worst are among the first; most of the others need not be told apart.
        some = order[:looked_at]
        _, first = np.unique(np.round(angles[some] / _PLACE), axis=0, return_index=True)
        if len(first) >= _DOWNHILL or looked_at >= len(order):
            return angles[some[np.sort(first)[:_DOWNHILL]]]
        looked_at *= 2


@lru_cache(maxsize=3)
def _nodes(frame: Frame, axes: tuple[Axis, ...], isotropic: bool) -> Places:
    """Return the nodes of a grid above the horizon, thinned to a maximum number."""
    turned = () if isotropic or len(axes) == 4 else (np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False),)
    shape = (*(axis.size for axis in axes), *(len(one) for one in turned))
    some = np.arange(0, int(np.prod(shape)), max(1, -(-int(np.prod(shape)) // _NODES)))
    index = np.unravel_index(some, shape)
    values = [nodes[i] for nodes, i in zip((*(axis.nodes for axis in axes), *turned), index, strict=True)]
    last = values[3] if len(values) == 4 else 0.0 * values[0]
    if frame == "io":
        theta_i, theta_o = (np.minimum(theta, _EDGE) for theta in values[:2])
        found = np.stack([theta_i, theta_o, values[2], last], axis=-1)
    else:
        wi, wo = io_from_half_difference(values[0], values[1], values[2], last)
        lit = (wi[:, 2] > _LEAST_COSINE) & (wo[:, 2] > _LEAST_COSINE)
        theta_i, theta_o, _ = io_angles(wi[lit], wo[lit])
        found = np.stack([theta_i, theta_o, azimuth_difference(wi[lit], wo[lit]), angles(wi[lit])[1]], axis=-1)
    return Places(found[:, : 3 if isotropic else 4])


def _shaded(packs: tuple[FactorPack, ...], wi: np.ndarray, wo: np.ndarray) -> Float[np.ndarray, "N L"]:
    """Compute pi f_r cos(theta_i) at the working wavelengths."""
    spectra = [np.pi * pack.spectra for pack in packs]
    return sum((pack.values(wi, wo) @ spectrum for pack, spectrum in zip(packs, spectra, strict=True)), np.zeros(1))


@lru_cache(maxsize=2)
def _spread(isotropic: bool) -> Places:
    """Return pairs all over the hemispheres, the same for every original."""
    return Places(_angles(_PAIRS if isotropic else _PAIRS_ANISOTROPIC, isotropic))


@lru_cache(maxsize=4)
def _angles(count: int, isotropic: bool) -> Float[np.ndarray, "N A"]:
    """Generate theta_i, theta_o, phi_o - phi_i and, unless isotropic, phi_i: evenly, and about the mirror direction."""
    everywhere = np.stack(everywhere_angles(count, 1, isotropic)[: 3 if isotropic else 4], axis=-1)
    # A highlight's own cells are far smaller than what lies between these: about the mirror direction at every scale.
    tilts, turns = np.concatenate([[0.0], np.geomspace(1e-5, 0.2, 40)]), np.linspace(0.0, np.pi, 5)
    around = [0.0] if isotropic else np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    grid = np.meshgrid(tilts, np.linspace(0.0, _EDGE, 64), turns, around, indexing="ij")
    wi, wo = (side.reshape(-1, 3) for side in io_from_half_difference(*grid))
    lit = (wi[:, 2] > _LEAST_COSINE) & (wo[:, 2] > _LEAST_COSINE)
    theta_i, theta_o, phi = io_angles(wi[lit], wo[lit])
    ridge = np.stack([theta_i, theta_o, phi, *(() if isotropic else (angles(wi[lit])[1],))], axis=-1)
    return np.concatenate([everywhere, ridge])


def _pairs(angles: Float[np.ndarray, "N A"]) -> tuple[np.ndarray, np.ndarray]:
    """Convert places to wi and wo."""
    phi_i = angles[:, 3] if angles.shape[1] == 4 else np.zeros(len(angles))
    return spherical(angles[:, 0], phi_i), spherical(angles[:, 1], phi_i + angles[:, 2])
