"""CP-factored BRDFs: sums of products of one-dimensional functions of the angles and of the wavelength.

A material is a sum of packs, each in the frame that suits it (Schwenk 2010, equations 5 and 8, with two frames in
place of one). What a pack tabulates: frame "io" holds f_r cos(theta_i); frame "hd" holds f_r, and the cosine is
applied when shading. Both shade to f_r cos(theta_i), in 1/sr.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from ..spectral.basis import SpectralBasis
from ..spectral.errors import InputError
from ..spectral.folding import Folding
from ..spectral.observers import Observer
from ..spectral.spectrum import Spectrum
from ..spectral.wavelengths import interpolation_matrix
from .axes import AXIS_NAMES, Axis, Frame
from .brdf import Brdf
from .directions import angles, azimuth_difference, folded, half_difference, io_angles

Direction = Float[np.ndarray, "*#batch 3"]

# Samples multiplied at once: their rows of factors stay in the second-level cache.
_BLOCK = 4096


@dataclass(frozen=True)
class FrameAngles:
    """Direction pairs as the angles of a frame, worked out once for any number of packs over the same geometry.

    `angles` maps an axis name to (N,) radians: "phi" and "phi_d" are folded into [0, pi] unless the azimuth axis is
    there too. `scale` (N,): what a tabulated value is multiplied by to give f_r cos(theta_i), 0 below the horizon.
    """

    frame: Frame
    angles: dict[str, Float[np.ndarray, " N"]]
    scale: Float[np.ndarray, " N"]
    batch: tuple[int, ...]


def frame_angles(frame: Frame, wi: Direction, wo: Direction, anisotropic: bool = False) -> FrameAngles:
    """The angles of `frame` for unit vectors in the surface frame; batch shapes broadcast."""
    wi, wo = np.broadcast_arrays(np.asarray(wi, dtype=float), np.asarray(wo, dtype=float))
    batch = wi.shape[:-1]
    wi, wo = wi.reshape(-1, 3), wo.reshape(-1, 3)
    lit = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    if frame == "io":
        theta_i, theta_o, phi = io_angles(wi, wo)
        values = {"theta_i": theta_i, "theta_o": theta_o, "phi": phi}
        if anisotropic:
            values |= {"phi": azimuth_difference(wi, wo), "phi_i": angles(wi)[1]}
        return FrameAngles(frame, values, lit.astype(float), batch)
    theta_h, theta_d, phi_d, phi_h = half_difference(wi, wo)
    values = {"theta_h": theta_h, "theta_d": theta_d}
    values |= {"phi_d": phi_d, "phi_h": phi_h} if anisotropic else {"phi_d": folded(phi_d)}
    return FrameAngles(frame, values, np.where(lit, wi[:, 2], 0.0), batch)


@dataclass(frozen=True)
class LightError:
    """ΔE94 over the samples of a protocol under one light; `highlight`: p99 of the highlight's own pixels, if any."""

    light: str
    mean: float
    p95: float
    p99: float
    maximum: float
    highlight: float | None = None


@dataclass(frozen=True)
class FitError:
    """Measured error of packs against the BRDF that they stand for.

    mean, p95, p99, maximum : ΔE94 over the samples of `protocol`, under `light`, the worst of those judged, for
    `observer`; reference = the original at every wavelength. relative_error : root of the sum of squares of the tables'
    residuals over that of the tables, weighted by what is seen. most_negative : lowest f_r cos(theta_i) pi that the
    packs shade to at any wavelength, all over the hemispheres (0 where none is negative; a white diffuser facing the
    light is 1). largest : their largest, over the original's largest anywhere at the same wavelength; None where nobody
    looked. Nothing is clipped. lights : the figures of every light judged, the worst included; empty where there was
    one.
    """

    mean: float
    p95: float
    p99: float
    maximum: float
    light: str
    observer: str
    protocol: str
    relative_error: float
    most_negative: float = 0.0
    largest: float | None = None
    lights: tuple[LightError, ...] = ()

    @property
    def highlight(self) -> float | None:
        """The worst p99 of the highlight's own pixels under any light; None where the surface has no highlight."""
        return max((one.highlight for one in self.lights if one.highlight is not None), default=None)


@dataclass(frozen=True)
class FactorPack:
    """One CP tensor: sum over r of the product over the axes of factors[axis][:, r], times spectral[r].

    Attributes
    ----------
    frame : "io" or "hd"; says what is tabulated (see the module's text).
    axes : three axes in the order of `AXIS_NAMES`, or four where the material is anisotropic.
    factors : one (n, R) array an axis.
    spectral : (R, J) coefficients in `basis`.
    error : measured error of the material that this pack is part of, None where it has not been measured.
    precision : "half" where 16 bits hold every factor exactly, as `half.rounded_to_half` leaves them, else "single".

    Between nodes factors are interpolated linearly, past the ends they are constant.
    """

    frame: Frame
    axes: tuple[Axis, ...]
    factors: tuple[Float[np.ndarray, "_ R"], ...]
    spectral: Float[np.ndarray, "R J"]
    basis: SpectralBasis
    error: FitError | None = None
    precision: Literal["single", "half"] = "single"

    def __post_init__(self) -> None:
        if self.frame not in AXIS_NAMES:
            raise InputError("unknown frame", field="frame", found=self.frame, expected="io or hd")
        names = AXIS_NAMES[self.frame]
        found = tuple(axis.name for axis in self.axes)
        if found not in (names[:3], names):
            raise InputError(
                f"axes do not belong to frame {self.frame}",
                field="axes",
                found=found,
                expected=f"{names[:3]} or {names}",
            )
        rank = self.spectral.shape[0]
        expected = [(axis.size, rank) for axis in self.axes]
        if [factor.shape for factor in self.factors] != expected:
            shapes = [factor.shape for factor in self.factors]
            raise InputError("factors do not fit the axes", field="factors", found=shapes, expected=str(expected))
        if self.spectral.shape[1] != self.basis.size:
            raise InputError(
                "spectral factor does not fit the basis",
                field="spectral",
                found=self.spectral.shape,
                expected=f"({rank}, {self.basis.size})",
            )
        if not all(np.all(np.isfinite(values)) for values in (*self.factors, self.spectral)):
            raise InputError(
                "factors are not finite", field="factors", found="NaN or infinity", expected="finite numbers"
            )

    @property
    def rank(self) -> int:
        """Number of terms R."""
        return self.spectral.shape[0]

    @property
    def anisotropic(self) -> bool:
        """True where an azimuth axis is present."""
        return len(self.axes) == 4

    def geometry(self, wi: Direction, wo: Direction) -> Float[np.ndarray, "... R"]:
        """Each term without its spectral factor, times cos(theta_i) in frame hd; zero below the horizon.

        XYZ of one directional light is `pi * geometry @ fold(light, observer)` per unit of illuminance.
        """
        return self.geometry_at(frame_angles(self.frame, wi, wo, self.anisotropic))

    def geometry_at(self, at: FrameAngles, dtype: type = np.float64) -> Float[np.ndarray, "... R"]:
        """`geometry` of angles that are already worked out, in float64 or (faster) float32."""
        if at.frame != self.frame or any(axis.name not in at.angles for axis in self.axes):
            raise InputError("angles of another frame", field="at", found=at.frame, expected=self.frame)
        values = [np.ascontiguousarray(factor, dtype=dtype) for factor in self.factors]
        steps = [np.diff(factor, axis=0, append=factor[-1:]) for factor in values]
        positions = [axis.position(at.angles[axis.name]) for axis in self.axes]
        below = [position.astype(np.intp) for position in positions]
        beyond = [(position - index).astype(dtype)[:, None] for position, index in zip(positions, below, strict=True)]
        out = np.empty((len(at.scale), self.rank), dtype=dtype)
        for start in range(0, len(out), _BLOCK):
            rows = slice(start, start + _BLOCK)
            product = out[rows]
            product[:] = at.scale[rows, None]
            for value, step, index, fraction in zip(values, steps, below, beyond, strict=True):
                between = step.take(index[rows], axis=0)
                between *= fraction[rows]
                between += value.take(index[rows], axis=0)
                product *= between
        return out.reshape(*at.batch, self.rank)

    def shade(self, wi: Direction, wo: Direction) -> Float[np.ndarray, "... J"]:
        """f_r cos(theta_i) as coefficients in `basis`, 1/sr."""
        return self.geometry(wi, wo) @ self.spectral

    def fold(self, light: Spectrum, observer: Observer) -> Float[np.ndarray, "R 3"]:
        """XYZ of each term under one light: the spectral dimension is gone from here on."""
        return self.spectral @ self.basis.fold(light, observer).T

    def folded(self, folding: Folding) -> Float[np.ndarray, "R M3"]:
        """XYZ of each term under each of several lights, from the spectra at every wavelength of their basis."""
        return self.basis.reconstruct(self.spectral) @ folding.weights(self.basis.wavelengths_nm)

    def in_basis(self, basis: SpectralBasis) -> FactorPack:
        """The same pack with its spectra projected into another basis, through the wavelengths of that basis."""
        samples = self.basis.reconstruct(self.spectral)
        if not np.array_equal(self.basis.wavelengths_nm, basis.wavelengths_nm):
            samples = samples @ interpolation_matrix(self.basis.wavelengths_nm, basis.wavelengths_nm).T
        return replace(self, spectral=basis.project(samples), basis=basis)


@dataclass(frozen=True)
class FactoredBrdf(Brdf):
    """The sum of packs as a BRDF, at the wavelengths of their common basis."""

    packs: tuple[FactorPack, ...]

    def __post_init__(self) -> None:
        if not self.packs:
            raise InputError("no packs", field="packs", found=0, expected="at least one")
        grids = [pack.basis.wavelengths_nm for pack in self.packs]
        if any(not np.array_equal(grid, grids[0]) for grid in grids):
            raise InputError("packs sampled at different wavelengths", field="packs", expected="one wavelength grid")

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """(L,) of the packs' basis."""
        return self.packs[0].basis.wavelengths_nm

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Whether no pack turns with the azimuth."""
        return not any(pack.anisotropic for pack in self.packs)

    def eval(self, wi: Direction, wo: Direction) -> Float[np.ndarray, "... L"]:
        """f_r in 1/sr; what the factors reconstruct, negative values included."""
        wi, wo = np.broadcast_arrays(np.asarray(wi, dtype=float), np.asarray(wo, dtype=float))
        shaded = sum(pack.basis.reconstruct(pack.shade(wi, wo)) for pack in self.packs)
        cosine = wi[..., 2:]
        return np.asarray(np.divide(shaded, cosine, out=np.zeros_like(shaded), where=cosine > 0))
