"""Small linear spectral bases, the only owners of a wavelength axis.

A basis is a pair of maps. `analysis` A (L,J) maps a reflectance r (L,) to J coefficients, and `synthesis` B (L,J) back
to a spectrum; a light folded with an observer becomes 3 x J numbers through B, so that a colour is their product.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ..runtime.errors import InputError
from .axis_letters import Wavelengths
from .observers import Observer
from .spectrum import Spectrum
from .wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix, validated_wavelengths


@dataclass(frozen=True, eq=False)
class SpectralBasis:
    """Analysis A and synthesis B of a J-dimensional linear model of spectra.

    Parameters
    ----------
    name : how it was made: "sampled", "peercy", "balanced", "minimax" (`minimax_basis`).
    wavelengths_nm : (L,) nm, ascending.
    analysis, synthesis : (L,J) float64; coefficients of r are A^T r, a spectrum is B c.
    """

    name: str
    wavelengths_nm: Float[np.ndarray, "L"]
    analysis: Float[np.ndarray, "L J"]
    synthesis: Float[np.ndarray, "L J"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "wavelengths_nm", validated_wavelengths(self.wavelengths_nm))
        length = self.wavelengths_nm.size
        for field in ("analysis", "synthesis"):
            matrix = np.asarray(getattr(self, field), dtype=np.float64)
            if matrix.ndim != 2 or matrix.shape[0] != length or not np.isfinite(matrix).all():
                raise InputError(
                    "a basis matrix does not fit its wavelengths",
                    field=field,
                    found=f"shape {matrix.shape}",
                    expected=f"finite, ({length}, J)",
                )
            object.__setattr__(self, field, matrix)
        if self.analysis.shape != self.synthesis.shape:
            raise InputError(
                "analysis and synthesis differ in size",
                found=f"{self.analysis.shape}, {self.synthesis.shape}",
            )

    @property
    def size(self) -> int:
        """Number J of coefficients."""
        return self.analysis.shape[1]

    @cached_property
    def is_sampled(self) -> bool:
        """True if coefficients are the samples themselves (A = B = I)."""
        return (
            self.size == self.wavelengths_nm.size
            and np.array_equal(self.analysis, np.eye(self.size))
            and (np.array_equal(self.synthesis, self.analysis))
        )

    def truncated(self, size: int) -> SpectralBasis:
        """Return the basis of the first `size` coefficients: optimal at that size for "peercy" and "balanced"."""
        return SpectralBasis(self.name, self.wavelengths_nm, self.analysis[:, :size], self.synthesis[:, :size])

    def project(self, values: Float[np.ndarray, "*batch L"]) -> Float[np.ndarray, "*batch J"]:
        """Compute coefficients A^T r of reflectances sampled on `wavelengths_nm`."""
        return values if self.is_sampled else values @ self.analysis

    def reconstruct(self, coefficients: Float[np.ndarray, "*batch J"]) -> Float[np.ndarray, "*batch L"]:
        """Compute spectra B c on `wavelengths_nm`."""
        return coefficients if self.is_sampled else coefficients @ self.synthesis.T

    def operator(self, reflectance: Float[np.ndarray, "*batch L"]) -> Float[np.ndarray, "*batch J J"]:
        """Compute A^T diag(r) B, the effect of one more bounce off reflectance r on coefficients."""
        return np.einsum("lj,...l,lk->...jk", self.analysis, reflectance, self.synthesis, optimize=True)

    def bispectral_operator(self, donaldson: Float[np.ndarray, "L L"]) -> Float[np.ndarray, "J J"]:
        """Compute A^T D B for a fluorescent surface; D[out, in] is its Donaldson matrix on `wavelengths_nm`.

        It acts on coefficients of *radiance*, in a basis made for radiances (`radiance_basis`), not on coefficients of
        reflectance relative to a light, the input of `fold`. Direct light needs neither: `Bispectral.fold`.
        """
        return self.analysis.T @ donaldson @ self.synthesis

    def fold(self, light: Spectrum, observer: Observer) -> Float[np.ndarray, "3 J"]:
        """Compute M with XYZ = M c for a surface of coefficients c under `light`; Y of the perfect diffuser is 1.

        The light is multiplied with the observer at its own resolution, before the basis.
        """
        weights = observer.weights(light, self.wavelengths_nm)
        return weights if self.is_sampled else weights @ self.synthesis

    def radiance(self, light: Spectrum, wavelengths_nm: Wavelengths) -> Float[np.ndarray, "J L"]:
        """Compute the radiance of each coefficient at `wavelengths_nm` under `light`, times pi, for a diffuse surface.

        In the light's own unit. The light is linear between its samples; a finer one is averaged.
        """
        resample = interpolation_matrix(self.wavelengths_nm, wavelengths_nm)
        spectra = resample if self.is_sampled else resample @ self.synthesis
        return spectra.T * light.averaged(wavelengths_nm).samples

    @classmethod
    def sampled(cls, wavelengths_nm: Wavelengths = WORKING_WAVELENGTHS_NM) -> SpectralBasis:
        """Return the trivial basis: coefficients are samples, A = B = I (L,L), materialised only on demand."""
        return _SampledBasis(wavelengths_nm)

    @classmethod
    def peercy(
        cls,
        reflectances: Float[np.ndarray, "n L"],
        weights: Float[np.ndarray, "L m"],
        size: int | None = None,
        wavelengths_nm: Wavelengths = WORKING_WAVELENGTHS_NM,
        light_scale: float = 0.1,
    ) -> SpectralBasis:
        """Compute the orthonormal linear model of Peercy 1993 (sec. 3), as in Schwenk 2010 (sec. 3.5): A = B.

        Left singular vectors of the columns [reflectances, light_scale x light x CMF]. Reflectances and lights have no
        scale in common and the result depends on the one chosen; with lights at Y = 1, 0.1 was the best of those tried
        on the ColorChecker (max ΔE94 at J = 8 ran from 1.6 to 5.1 over four decades of it).

        Parameters
        ----------
        reflectances : (n,L) spectra that the scene can show.
        weights : (L,m) light x CMF, each light at Y = 1, three columns a light.
        size : J; default and upper bound is the numerical rank.
        light_scale : length given to the lights beside the reflectances, > 0.
        """
        columns = np.concatenate(
            [finite_table("reflectances", reflectances).T, light_scale * finite_table("weights", weights)], axis=1
        )
        if not columns.any():
            raise InputError("nothing to build a basis from", field="reflectances, weights", found="zeros only")
        left, singular, _ = np.linalg.svd(columns, full_matrices=False)
        kept = _stop_at_rank(singular, columns.shape, size)
        return cls("peercy", np.asarray(wavelengths_nm, dtype=np.float64), left[:, :kept], left[:, :kept])

    @classmethod
    def balanced(
        cls,
        reflectances: Float[np.ndarray, "n L"],
        weights: Float[np.ndarray, "L m"],
        size: int | None = None,
        wavelengths_nm: Wavelengths = WORKING_WAVELENGTHS_NM,
    ) -> SpectralBasis:
        """Compute the basis of J numbers that best preserves the *product* of reflectance and light.

        With the SVD R W = P S Q^T of reflectances (n,L) times light x CMF (L,m), A = W Q_J S_J^(-1/2) and B = R^T P_J
        S_J^(-1/2), so that (A^T r) . (B^T w) is the rank-J truncation of R W: the best for all pairs at once
        (Eckart-Young), and exact at J = m. Only singular values above the numerical rank are ever inverted, so black,
        grey and repeated spectra do no harm; a set that is black throughout gets one empty coefficient.

        Parameters
        ----------
        reflectances : (n,L) spectra that the scene can show, with products of two where light bounces.
        weights : (L,m) light x CMF, each light at Y = 1 (`Observer.weights(...).T`), three columns a light.
        size : J; default and upper bound is the numerical rank of R W.
        """
        surfaces, lights = finite_table("reflectances", reflectances), finite_table("weights", weights)
        left, singular, right = np.linalg.svd(surfaces @ lights, full_matrices=False)
        kept = _stop_at_rank(singular, (max(surfaces.shape), max(lights.shape)), size)
        if kept == 0:
            empty = np.zeros((lights.shape[0], 1))
            return cls("balanced", np.asarray(wavelengths_nm, dtype=np.float64), empty, empty)
        scale = singular[:kept] ** -0.5
        return cls(
            "balanced",
            np.asarray(wavelengths_nm, dtype=np.float64),
            lights @ right[:kept].T * scale,
            surfaces.T @ left[:, :kept] * scale,
        )


class _SampledBasis(SpectralBasis):
    """A = B = I without the matrices: a thousand files of thousands of wavelengths would fill the memory with zeros."""

    def __init__(self, wavelengths_nm: Wavelengths) -> None:
        object.__setattr__(self, "name", "sampled")
        object.__setattr__(self, "wavelengths_nm", validated_wavelengths(wavelengths_nm))

    @property
    def size(self) -> int:
        return self.wavelengths_nm.size

    @property
    def is_sampled(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        return True

    @cached_property
    def analysis(self) -> Float[np.ndarray, "L J"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return np.eye(self.size)

    @property
    def synthesis(self) -> Float[np.ndarray, "L J"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.analysis


def finite_table(field: str, values: np.ndarray) -> np.ndarray:
    """Return `values` in float64; raises `InputError` naming `field` if they are no table, or not finite."""
    values = np.asarray(values, dtype=np.float64)
    if values.ndim != 2 or not np.isfinite(values).all():
        raise InputError(
            "spectra are not a finite table",
            field=field,
            found=f"shape {values.shape}",
            expected="two axes, no NaN",
        )
    return values


def _stop_at_rank(singular: np.ndarray, shape: tuple[int, ...], size: int | None) -> int:
    """Return the number of singular vectors to keep: as requested, but at most the numerical rank."""
    if size is not None and size < 1:
        raise InputError("a basis needs at least one coefficient", field="size", found=size, expected=">= 1")
    rank = int(np.sum(singular > singular[0] * max(shape) * np.finfo(np.float64).eps)) if singular.size else 0
    return rank if size is None else min(size, rank)
