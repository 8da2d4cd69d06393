"""Environment light at infinity: a few spectra, each times a luminance over directions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, get_args

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.observers import Observer, observer
from ...spectral.spectrum import Spectrum
from ..lights import SpreadLight, check_spectrum, strength
from ..vectors import Number
from . import latlong
from .direction_sampling import MapDrawing

#: Origin of an environment's spectra: stated by the scene's author, made from a colour, or measured.
Origin = Literal["stated", "made", "measured"]


def _photometric() -> Observer:
    """Return the observer that defines luminance."""
    return observer("1931_2")


@dataclass(frozen=True, eq=False)
class WeightedMaps:
    """Maps over directions and a weight for each; their product is a light's luminance.

    Everything that depends on directions is linear in the maps, so it is computed once for all observers, spectra and
    strengths.

    maps (K, H, W), weights (K,). product (K, H, W) : `maps` itself where all weights are 1.
    """

    maps: Float[np.ndarray, "K H W"]
    weights: Float[np.ndarray, " K"]
    product: Float[np.ndarray, "K H W"]

    @classmethod
    def of(cls, maps: Float[np.ndarray, "K H W"]) -> WeightedMaps:
        """Return maps with weights 1."""
        return cls(maps, np.ones(len(maps)), maps)

    def scaled(self, factors: Float[np.ndarray, " K"]) -> WeightedMaps:
        """Return the same maps with other weights."""
        return WeightedMaps(self.maps, self.weights * factors, self.product * factors[:, None, None])


@dataclass(frozen=True, eq=False, repr=False)
class EnvironmentLight(SpreadLight):
    """An environment: K fields of luminance over directions, each of one spectrum.

    Parameters
    ----------
    fields : (K, H, W) luminance, relative, finite, not negative, latitude-longitude (`latlong`), linear between texel
        centres; field k belongs to spectrum k.
    spectra : K emissions; their scale does not matter.
    illuminance_lux : on a horizontal plane, from above, all fields together, lx, > 0; it scales the fields. None leaves
        them unscaled, in cd/m^2, even without light from above.
    rotation_deg : turns the map about the vertical (+y), right-handed.
    origin : of the spectra, for reports.
    spectrum_name : name of the spectra, for reports.
    observer : of the fields' luminance, by which renderers weight the spectra; a `Scene` replaces it by its own.
    notes : assumptions and omissions made while constructing the light.
    weighted : maps whose weighted product is `fields`; default: `fields` themselves. Lights that differ only in
        spectra, observer and strength share them, and renderers cache results by them.

    Raises
    ------
    InputError : mismatched shapes, values that are no luminance, no light from above, or a spectrum that is not an
        emission.
    """

    KIND: ClassVar = "environment"

    fields: Float[np.ndarray, "K H W"]
    spectra: tuple[Spectrum, ...]
    illuminance_lux: Any = 1000.0
    rotation_deg: Number = 0.0
    name: str = "light"
    spectrum_name: str = ""
    origin: Origin = "stated"
    observer: Observer = field(default_factory=_photometric)
    notes: tuple[str, ...] = ()
    weighted: WeightedMaps | None = None

    def __post_init__(self) -> None:
        fields = np.asarray(self.fields, dtype=np.float64)
        if fields.ndim != 3 or len(fields) != len(self.spectra) or not fields.size:
            raise InputError(
                "fields and spectra of an environment do not fit",
                field="fields",
                found=f"{fields.shape} and {len(self.spectra)} spectra",
                expected="(K, H, W) and K",
            )
        if not np.isfinite(fields).all() or (fields < 0.0).any():
            wrong = np.argwhere(~(np.isfinite(fields) & (fields >= 0.0)))[0].tolist()
            raise InputError(
                "not a luminance",
                field=f"fields{wrong}",
                found=float(fields[tuple(wrong)]),
                expected="finite, not negative",
            )
        for spectrum in self.spectra:
            check_spectrum(spectrum)
        if self.origin not in get_args(Origin):
            raise InputError(
                "unknown origin", field="origin", found=repr(self.origin), expected=", ".join(get_args(Origin))
            )
        arrives = self._relative_illuminances(fields)
        if self.illuminance_lux is None:
            object.__setattr__(self, "illuminance_lux", float(arrives.sum()))
            self._set_fields(fields, 1.0)
            return
        object.__setattr__(self, "illuminance_lux", strength(self.illuminance_lux, "illuminance_lux", "lx"))
        if not arrives.sum() > 0.0:
            raise InputError(
                "an environment that sends nothing from above",
                field="fields",
                found="an illuminance of 0 on a horizontal plane",
                expected="some light in the upper half of the map",
                hint="look whether the map is upside down, or black",
            )
        scale = self.illuminance_lux / arrives.sum()
        # The array itself if its scale fits: results derived from it are cached by it, also when the light is turned.
        self._set_fields(fields, 1.0 if abs(scale - 1.0) < 1e-12 else scale)

    def _set_fields(self, fields: Float[np.ndarray, "K H W"], scale: float) -> None:
        """Set the luminance in cd/m^2; the first scale multiplies the maps, later ones their weights."""
        weighted = self.weighted
        if weighted is None or weighted.product is not fields:
            weighted = WeightedMaps.of(fields if scale == 1.0 else fields * scale)
        elif scale != 1.0:
            weighted = weighted.scaled(np.full(len(fields), scale))
        object.__setattr__(self, "weighted", weighted)
        object.__setattr__(self, "fields", weighted.product)

    def __repr__(self) -> str:
        _, height, width = self.fields.shape
        count = len({spectrum.key for spectrum in self.spectra})
        spectra = "1 spectrum" if count == 1 else f"{count} spectra"
        return f"<Environment {self.name}: {width} x {height}, {spectra} {self.origin}, {self.illuminance_lux:g} lx>"

    @staticmethod
    def _relative_illuminances(fields: Float[np.ndarray, "K H W"]) -> Float[np.ndarray, " K"]:
        """Compute the relative illuminance of each field on a horizontal plane, lit from above."""
        height, width = fields.shape[1:]
        # The sine of the elevation, which is exactly 0 on the horizon: light from below must not come to 1e-33 lx.
        edges = np.clip(np.sin(np.pi * (0.5 - np.arange(height + 1) / height)), 0.0, None)
        # The cosine over a texel, exact: half the difference of its squares at the texel's edges.
        return fields.sum(axis=2) @ ((edges[:-1] ** 2 - edges[1:] ** 2) * np.pi / width)

    @cached_property
    def spectrum(self) -> Spectrum:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Mixture of the spectra incident on a horizontal plane."""
        return mixture(self.spectra, self._relative_illuminances(self.fields), self.observer)

    def with_spectrum(self, spectrum: Spectrum, name: str = "") -> EnvironmentLight:
        """Return the same fields, all of one spectrum."""
        changes: dict[str, Any] = {"spectra": (spectrum,) * len(self.spectra), "spectrum_name": name}
        return replace(self, illuminance_lux=self.illuminance_lux or None, origin="stated", **changes)

    def for_observer(self, seen_by: Observer) -> EnvironmentLight:
        """Return the same light with fields in another observer's luminance, which reweights the spectra."""
        if seen_by.name == self.observer.name:
            return self
        changes: dict[str, Any] = {"illuminance_lux": self.illuminance_lux or None, "observer": seen_by}
        if not _all_equal(self.spectra):
            seen = np.array([[one.luminous(spectrum) for spectrum in self.spectra] for one in (self.observer, seen_by)])
            ratio = np.divide(seen[1], seen[0], out=np.ones(len(self.spectra)), where=seen[0] > 0.0)
            weighted = self.maps.scaled(ratio)
            changes |= {"fields": weighted.product, "weighted": weighted}
        return replace(self, **changes)

    @property
    def maps(self) -> WeightedMaps:
        """`weighted`, never None after construction."""
        assert self.weighted is not None
        return self.weighted

    @property
    def unweighted(self) -> EnvironmentLight:
        """The same light with all weights 1: its fields are the maps."""
        maps = self.maps.maps
        return self if maps is self.fields else replace(self, fields=maps, weighted=None, illuminance_lux=None)

    def counted_from(self, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
        """Return the illuminance on a horizontal plane, lx, and infinite distances."""
        return float(self.illuminance_lux), np.inf, np.inf

    @property
    def world_from_map(self) -> Float[np.ndarray, "3 3"]:
        """Rotation from map to world directions."""
        angle = np.deg2rad(self.rotation_deg)
        cosine, sine = np.cos(angle), np.sin(angle)
        return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])

    def luminance(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> np.ndarray:
        """Return the luminance (n, K), cd/m^2; the same at every point."""
        return latlong.between_texels(self.fields, directions @ self.world_from_map)

    @cached_property
    def _drawing(self) -> MapDrawing:
        return MapDrawing(self.fields.sum(axis=0))

    def drawn(self, points: Float[np.ndarray, "n 3"], uniform: Float[np.ndarray, "n 2"]):
        """Sample directions in proportion to the total luminance of all fields."""
        to = self._drawing.drawn(uniform)
        return to @ self.world_from_map.T, self._drawing.density(to)

    def density(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> np.ndarray:
        """Return the probability density of `drawn` for these directions, 1/sr."""
        return self._drawing.density(directions @ self.world_from_map)

    def luminance_and_density(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]):
        """Return `luminance` and `density` with one look-up of places in the map."""
        to = directions @ self.world_from_map
        places = latlong.TexelWeights(to, *self.fields.shape[1:])
        return places.of(self.fields), self._drawing.density_at(places, to)

    def distance(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> np.ndarray:
        """Return infinity."""
        return np.full(len(directions), np.inf)


def mixture(spectra: Sequence[Spectrum], shares: Float[np.ndarray, " K"], seen_by: Observer) -> Spectrum:
    """Mix K emissions in shares of an observer's luminance, of any scale, on the union of their wavelengths.

    A spectrum without luminance is weighted by its power.
    """
    if _all_equal(spectra):
        return spectra[0]
    wavelengths_nm = np.unique(np.concatenate([one.wavelengths_nm for one in spectra]))
    total = np.zeros(len(wavelengths_nm))
    for spectrum, share in zip(spectra, shares, strict=True):
        samples = np.interp(wavelengths_nm, spectrum.wavelengths_nm, spectrum.samples)
        luminous = seen_by.luminous(spectrum)
        scale = luminous if luminous > 0.0 else float(np.trapezoid(samples, wavelengths_nm))
        total += samples * (share / scale if scale > 0.0 else 0.0)
    return Spectrum(total, wavelengths_nm, "emission")


def _all_equal(spectra: Sequence[Spectrum]) -> bool:
    """Tell whether all spectra are equal."""
    return len({spectrum.key for spectrum in spectra}) == 1
