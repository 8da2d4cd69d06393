"""Throughput of paths to their pixels: every wavelength, also where surfaces fluoresce.

Traced from the camera, a path carries its throughput at each wavelength. A fluorescent surface shifts wavelengths, so
that three numbers per incident wavelength are carried instead, cmf^T D D' ..., with D the Donaldson matrices along the
path. Light that keeps its wavelength is weighted by the observer at its own resolution; shifted light is sampled like
the surfaces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...materials.analytic.fluorescent import FluorescentBrdf
from ...materials.core.points import Points
from ...materials.core.scattering import Scattering
from ...materials.core.surface import Surface
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import common_wavelengths, interpolation_matrix
from ..scene import Scene
from .geometry import Met


@dataclass(frozen=True, eq=False)
class Carried:
    """Throughput of n paths for each of L incident wavelengths.

    through (n, L) : throughput without change of wavelength. shifted (n, 3, L) : XYZ of shifted light per unit of
    incident spectral power; None if no surface of the scene fluoresces.
    """

    through: Float[np.ndarray, "n L"]
    shifted: Float[np.ndarray, "n 3 L"] | None

    def chosen(self, which: Int[np.ndarray, " k"]) -> Carried:
        """Select some paths."""
        return Carried(self.through[which], None if self.shifted is None else self.shifted[which])

    def times(self, factor: Float[np.ndarray, " n"]) -> Carried:
        """Scale the throughput of each path."""
        shifted = None if self.shifted is None else self.shifted * factor[:, None, None]
        return Carried(self.through * factor[:, None], shifted)


class PathColours:
    """Scattering along paths through a scene, and colours of the lights at their ends.

    surfaces : by material id. illuminants : M, each replacing every light's spectra; None keeps them.
    """

    def __init__(
        self, scene: Scene, surfaces: Mapping[str, Scattering], illuminants: Sequence[Spectrum | None]
    ) -> None:
        self._wearing: list[Surface] = [surfaces[part.material].surface for part in scene.parts]
        glowing = {name: one.surface for name, one in surfaces.items() if isinstance(one.surface, FluorescentBrdf)}
        excited = [surface.bispectral.wavelengths_in_nm for surface in glowing.values()]
        grids = [surface.wavelengths_nm for surface in self._wearing]
        self._nm = nm = common_wavelengths([*grids, *excited])
        self._to_common = [None if np.array_equal(g, nm) else interpolation_matrix(g, nm).T for g in grids]
        emissions = {name: _Emission.of(surface, nm) for name, surface in glowing.items()}
        self._emissions = [emissions.get(part.material) for part in scene.parts]
        self._seen_by = scene.observer
        self._sensitivity = scene.observer.sensitivity(nm) if glowing else None
        lit = [[[own if each is None else each for each in illuminants] for own in x.spectra] for x in scene.lights]
        self._folds = [np.stack([self._fold(spectra) for spectra in light]) for light in lit]
        self._powers = [np.stack([self._power(spectra) for spectra in light]) for light in lit] if glowing else []
        self._bright = np.sum([fold.sum(axis=0) for fold in self._folds], axis=0)

    def _fold(self, spectra: Sequence[Spectrum]) -> Float[np.ndarray, "L M3"]:
        """Return the weights from reflectances to XYZ for each image."""
        return np.concatenate([self._seen_by.weights(spectrum, self._nm).T for spectrum in spectra], axis=1)

    def _power(self, spectra: Sequence[Spectrum]) -> Float[np.ndarray, "L M"]:
        """Return the spectral power of each image's light, Y = 1."""
        seen_by = self._seen_by
        return np.stack([one.averaged(self._nm).samples / seen_by.luminous(one) for one in spectra], axis=1)

    @property
    def numbers(self) -> int:
        """Number of values per path."""
        return len(self._nm) * (1 if self._sensitivity is None else 4)

    def begun(self, count: int) -> Carried:
        """Return the throughput of new paths."""
        wavelengths = len(self._nm)
        shifted = None if self._sensitivity is None else np.zeros((count, 3, wavelengths))
        return Carried(np.ones((count, wavelengths)), shifted)

    def scattered(
        self, carried: Carried, met: Met, uv: Float[np.ndarray, "n 2"] | None, wi: Float[np.ndarray, "n 3"]
    ) -> Carried:
        """Multiply the throughput by f_r (1/sr) for light incident along `wi`, or by D."""
        through = np.zeros_like(carried.through)
        shifted = None if carried.shifted is None else np.zeros_like(carried.shifted)
        for number, surface in enumerate(self._wearing):
            mine = np.flatnonzero(met.part == number)
            if not len(mine):
                continue
            own = surface.at(Points(wi[mine], met.wo[mine], None if uv is None else uv[mine]))
            to_common = self._to_common[number]
            f_r = own if to_common is None else own @ to_common
            through[mine] = carried.through[mine] * f_r
            if shifted is None or carried.shifted is None:
                continue
            shifted[mine] = carried.shifted[mine] * f_r[:, None]
            emission = self._emissions[number]
            if emission is not None:
                assert isinstance(surface, FluorescentBrdf)
                assert self._sensitivity is not None
                out = emission.leaving
                leaves = (
                    carried.shifted[mine][:, :, out] + carried.through[mine][:, None, out] * self._sensitivity[:, out]
                )
                spread = surface.emission_factor(wi[mine], met.wo[mine])
                shifted[mine[:, None], :, emission.exciting] += np.swapaxes(
                    spread[:, None, None] * (leaves @ emission.matrix), 1, 2
                )
        return Carried(through, shifted)

    def seen(self, carried: Carried, light: int, strength: Float[np.ndarray, "n K"]) -> Float[np.ndarray, "n M3"]:
        """Compute XYZ of a light of K spectra at the ends of paths."""
        found = np.zeros((len(strength), self._bright.shape[1]))
        for field in range(strength.shape[1]):
            found += (carried.through * strength[:, field : field + 1]) @ self._folds[light][field]
            if carried.shifted is not None:
                found += _by_picture(carried.shifted @ self._powers[light][field]) * strength[:, field : field + 1]
        return found

    def brightness(self, carried: Carried) -> Float[np.ndarray, " n"]:
        """Return the largest of X, Y and Z in all images under all lights together, relative to white."""
        found = carried.through @ self._bright
        for powers in self._powers if carried.shifted is not None else ():
            assert carried.shifted is not None
            found = found + _by_picture(carried.shifted @ powers.sum(axis=0))
        return found.max(axis=1) / self._bright.sum(axis=0).max()


def _by_picture(xyz: Float[np.ndarray, "n 3 M"]) -> Float[np.ndarray, "n M3"]:
    return np.swapaxes(xyz, 1, 2).reshape(len(xyz), 3 * xyz.shape[2])


@dataclass(frozen=True, eq=False)
class _Emission:
    """Fluorescent part of a Donaldson matrix, on a common grid, without rows and columns of zeros.

    matrix (O, I) : emission by excitation. leaving (O,), exciting (I,) : their wavelength indices in the grid.
    """

    matrix: Float[np.ndarray, "O I"]
    leaving: Int[np.ndarray, " O"]
    exciting: Int[np.ndarray, " I"]

    @classmethod
    def of(cls, surface: FluorescentBrdf, nm: Float[np.ndarray, " L"]) -> _Emission:
        kept = surface.bispectral.reflectance
        whole = surface.bispectral.on(nm) - np.diag(interpolation_matrix(kept.wavelengths_nm, nm) @ kept.samples)
        leaving, exciting = (np.flatnonzero(whole.any(axis=axis)) for axis in (1, 0))
        return cls(whole[np.ix_(leaving, exciting)], leaving, exciting)
