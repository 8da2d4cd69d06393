"""Lights and an observer, prepared for folding with surfaces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from .basis import SpectralBasis
from .bispectral import Bispectral
from .observers import Observer
from .spectrum import Spectrum


class Folding:
    """M lights, each folded with one observer; cached per grid and per Donaldson matrix.

    XYZ are in columns of three per light. Y of `scale` times the perfect diffuser is `scale` under each.
    """

    def __init__(self, observer: Observer, lights: Sequence[Spectrum], scale: float = 1.0) -> None:
        self.observer, self.lights, self.scale = observer, tuple(lights), scale
        self._weights: dict[bytes, np.ndarray] = {}
        self._coefficients: dict[int, tuple[SpectralBasis, np.ndarray]] = {}
        self._emitted: dict[int, tuple[Bispectral, np.ndarray]] = {}

    def weights(self, wavelengths_nm: Float[np.ndarray, " L"]) -> Float[np.ndarray, "L M3"]:
        """Return weights: XYZ = spectrum (..., L) @ weights, without fluorescence."""
        key = wavelengths_nm.tobytes()
        if key not in self._weights:
            each = [self.scale * self.observer.weights(light, wavelengths_nm).T for light in self.lights]
            self._weights[key] = np.hstack(each)
        return self._weights[key]

    def coefficients(self, basis: SpectralBasis) -> Float[np.ndarray, "J M3"]:
        """Return weights: XYZ = coefficients (..., J) @ weights, without fluorescence."""
        if basis.is_sampled:
            # A fit makes a basis of samples with each of its packs: they are all one.
            return self.weights(basis.wavelengths_nm)
        if id(basis) not in self._coefficients:
            each = [self.scale * basis.fold(light, self.observer).T for light in self.lights]
            self._coefficients[id(basis)] = basis, np.hstack(each)
        return self._coefficients[id(basis)][1]

    def emitted(self, surface: Bispectral) -> Float[np.ndarray, " M3"]:
        """Compute XYZ of a surface's fluorescence, over all wavelengths that the observer sees."""
        if id(surface) not in self._emitted:
            nm, cmfs = self.observer.wavelengths_nm, self.observer.cmfs
            each = [
                np.trapezoid(surface.emission(light, nm)[:, None] * cmfs, nm, axis=0) / self.observer.luminous(light)
                for light in self.lights
            ]
            self._emitted[id(surface)] = surface, self.scale * np.concatenate(each)
        return self._emitted[id(surface)][1]
