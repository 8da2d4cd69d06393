"""CP-factored BRDFs: sums of products of one-dimensional functions of the angles and of the wavelength.

A material is a sum of packs, each in the frame that suits it (Schwenk 2010, equations 5 and 8, with two frames in place
of one). A pack tabulates f_r cos(theta_i) in frame "io" and f_r in frame "hd", where the cosine is applied when
shading. Both shade to f_r cos(theta_i), in 1/sr.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ...spectral.palette import Palette
from ..core.axes import AXIS_NAMES, Axis, Direction, Frame, FrameAngles, frame_angles
from ..core.brdf import Brdf
from ..core.fast import Fast, Summand, TermShader, check_summands
from ..core.fit_error import FitError
from ..core.points import Points
from ..core.surface import Surface
from ..core.terms import Terms
from ..slices.error import measured_form
from ..slices.fit import fewest_slices, mixtures, view_slices
from ..slices.view_slices import ViewSlices
from .pyramids import MOST_LEVELS, axis_levels, filtered_values, pyramid

# Samples per block: their rows of factors stay in the second-level cache.
_BLOCK = 4096
# Share of a fit's budget for the mean error of the environment form: more lobes cost little.
_SHARE = 0.5
# Name of the slices beside the packs in a file.
_SLICES = "slices"
_FILE = Path(__file__).with_name("factors.glsl")


@dataclass(frozen=True, eq=False)
class FactorPack(Summand):
    """One CP tensor: sum over r of the product over the axes of factors[axis][:, r], times spectrum r.

    Attributes
    ----------
    frame : "io" or "hd"; determines what is tabulated (see the module's text).
    axes : three axes in the order of `AXIS_NAMES`, or four if the material is anisotropic.
    factors : one (n, R) array per axis.
    palette : one entry of R spectra.
    precision : "half" if 16 bits represent every factor exactly, as after `half_precision.rounded_to_half`, else
        "single".

    Factors are interpolated linearly between nodes and clamped beyond the ends.
    """

    frame: Frame
    axes: tuple[Axis, ...]
    factors: tuple[Float[np.ndarray, "_ R"], ...]
    palette: Palette
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
        if self.palette.entries != 1:
            found, expected = self.palette.entries, "one entry: the terms of a pack are of one colour each"
            raise InputError("a palette of several entries", field="palette", found=found, expected=expected)
        expected_shapes = [(axis.size, self.rank) for axis in self.axes]
        shapes = [factor.shape for factor in self.factors]
        if shapes != expected_shapes:
            expected = str(expected_shapes)
            raise InputError("factors do not fit the axes", field="factors", found=shapes, expected=expected)
        if not all(np.all(np.isfinite(values)) for values in self.factors):
            raise InputError(
                "factors are not finite", field="factors", found="NaN or infinity", expected="finite numbers"
            )

    @property
    def anisotropic(self) -> bool:
        """True where an azimuth axis is present."""
        return len(self.axes) == 4

    @property
    def spectra(self) -> Float[np.ndarray, "R L"]:
        """The terms' spectra at every wavelength of their basis."""
        return self.palette.samples[0]

    def recoloured(self, spectra: Float[np.ndarray, "R J"]) -> FactorPack:
        """Return the same factors with other coefficients in the same basis."""
        return replace(self, palette=replace(self.palette, values=spectra[None]))

    def terms(self, points: Points) -> Terms:
        """Implement `Summand.terms`; each factor is averaged over the points' spans (`pyramids`)."""
        at = points.angles(self.frame, self.anisotropic)
        if points.spans is None:
            return Terms(self.values_at(at))
        widths = points.spans[self.frame][:, : len(self.axes)]
        return Terms(filtered_values(self.axes, self.factors, self.precision == "half", at, widths))

    def values(self, wi: Direction, wo: Direction) -> Float[np.ndarray, "... R"]:
        """Return each term without its spectrum, times cos(theta_i) in frame hd; zero below the horizon."""
        return self.values_at(frame_angles(self.frame, wi, wo, self.anisotropic))

    def values_at(self, at: FrameAngles, dtype: type = np.float64) -> Float[np.ndarray, "... R"]:
        """Compute `values` from known angles, in float64 or (faster) float32."""
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
        """Evaluate f_r cos(theta_i) as coefficients in the palette's basis, 1/sr."""
        return self.values(wi, wo) @ self.palette.values[0]

    def shader(self, filtered: bool = False) -> TermShader:
        """Implement `Summand.shader`."""
        return factor_shader(self.frame, self.axes, self.factors, self.precision == "half", filtered)

    @property
    def key(self) -> tuple:
        """Frame, axes, and identity of the factors."""
        return self.frame, self.axes, tuple(id(factor) for factor in self.factors)

    @property
    def nbytes(self) -> int:
        """Bytes of factors and spectra in memory."""
        return sum(array.nbytes for array in (*self.factors, self.palette.values))

    @property
    def grid(self) -> str:
        """The axes with their sizes."""
        return " x ".join(f"{axis.name} {axis.size}" for axis in self.axes)

    def stored(self) -> dict[str, Any]:
        """Return the stored fields; factors of half precision as float16."""
        half = self.precision == "half"
        axes = {
            axis.name: {
                "position": position,
                "maximum": axis.maximum,
                "warp": axis.warp,
                "periodic": axis.periodic,
                "factor": halved(factor) if half else factor,
                "nodes": axis.nodes,
            }
            for position, (axis, factor) in enumerate(zip(self.axes, self.factors, strict=True))
        }
        kept = self.palette.stored()
        # In this order: equal packs are equal bytes, whoever wrote them.
        named = {"frame": self.frame, "basis": kept.pop("basis"), "precision": self.precision}
        return {**named, **kept, "axes": axes}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any]) -> FactorPack:
        """Return the pack whose `stored()` this is."""
        places = sorted(kept["axes"].items(), key=lambda place: place[1]["position"])
        factors = tuple(place["factor"] for _, place in places)
        if kept["precision"] == "half":
            factors = tuple(factor.astype(np.float64) for factor in factors)
        axes = tuple(
            Axis(name, len(factor), float(at["maximum"]), at["warp"], at["periodic"])
            for (name, at), factor in zip(places, factors, strict=True)
        )
        return cls(kept["frame"], axes, factors, Palette.from_stored(kept), kept["precision"])


@dataclass(frozen=True, eq=False)
class FactoredBrdf(Brdf, Fast):
    """Sum of packs as a BRDF, at the wavelengths of their common basis: the fast form of uniform materials.

    slices : its environment form, if known; else that of the packs is computed on request.
    """

    NAME: ClassVar[str] = "packs"
    WORDS: ClassVar[str] = "factor packs"

    packs: tuple[FactorPack, ...]
    error: FitError | None = None
    slices: ViewSlices | None = None
    # Form that this is a projection of: its slices are as good, and a few terms cost nothing at any wavelengths.
    _whole: FactoredBrdf | None = None

    def __post_init__(self) -> None:
        check_summands(self.packs)

    @property
    def summands(self) -> tuple[Summand, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The packs."""
        return self.packs

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """True if no pack depends on the azimuth."""
        return not any(pack.anisotropic for pack in self.packs)

    def eval(self, wi: Direction, wo: Direction) -> Float[np.ndarray, "... L"]:
        """Evaluate f_r in 1/sr as the factors reconstruct it, negative values included."""
        wi, wo = np.broadcast_arrays(np.asarray(wi, dtype=float), np.asarray(wo, dtype=float))
        found = Fast.at(self, Points(wi.reshape(-1, 3), wo.reshape(-1, 3)))
        return found.reshape(*wi.shape[:-1], -1)

    def in_basis(self, basis: SpectralBasis) -> FactoredBrdf:
        """Return the same packs with their spectra projected into another basis."""
        return replace(self, packs=tuple(pack.in_basis(basis) for pack in self.packs), _whole=self._whole or self)

    def environment_form(self) -> ViewSlices:
        """Implement `Fast.environment_form`; that of the packs' sum is computed on first use."""
        return self._slices

    @property
    def environment_error(self) -> FitError | None:
        """Implement `Fast.environment_error`."""
        return None if self.slices is None else self.slices.error

    @cached_property
    def _slices(self) -> ViewSlices:
        if self.slices is not None:
            return self.slices
        if self._whole is not None:
            return self._whole.environment_form()
        if self.rank > 1:
            return view_slices(self)
        # One spectrum, which may be a fluorescent surface's: then no samples stand for it.
        (pack,) = self.packs

        def terms(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
            return pack.values(wi, wo) / wi[:, 2:]

        return ViewSlices(*mixtures(terms, 1, self.isotropic), pack.palette).in_single_precision()

    def with_slices_of(self, original: Surface, budget: float) -> FactoredBrdf:
        """Attach the environment form of the original, with its error (`slices.fit.fewest_slices`).

        A fluorescent original has no suitable samples: there the form is that of the packs.
        """
        if original.bispectral is None:
            return replace(self, slices=fewest_slices(original, _SHARE * budget))
        return replace(self, slices=measured_form(self.environment_form(), original))

    def stored(self) -> dict[str, Any]:
        """Return the packs by number, and the environment form if it is known."""
        packs = {str(number): pack.stored() for number, pack in enumerate(self.packs)}
        return packs if self.slices is None else {**packs, _SLICES: self.slices.stored()}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> FactoredBrdf:
        """Implement `Fast.from_stored`."""
        packs = (FactorPack.from_stored(kept[str(number)]) for number in range(len(kept) - (_SLICES in kept)))
        return cls(tuple(packs), error, ViewSlices.from_stored(kept[_SLICES]) if _SLICES in kept else None)


def matt_brdf(
    values: Float[np.ndarray, " R"], palette: Palette, precision: Literal["single", "half"] = "single"
) -> FactoredBrdf:
    """Make an ideally diffuse surface: term r is `values[r]` in every direction, times spectrum r, 1/sr."""
    ends = {"theta_h": np.pi / 2, "theta_d": np.pi / 2, "phi_d": np.pi}
    axes = tuple(Axis(name, 2, end) for name, end in ends.items())
    factors = (np.tile(values, (2, 1)), *(np.ones((2, len(values))) for _ in axes[1:]))
    return FactoredBrdf((FactorPack("hd", axes, factors, palette, precision),))


def factor_shader(
    frame: Frame, axes: tuple[Axis, ...], factors: tuple[Float[np.ndarray, "_ R"], ...], half: bool, filtered: bool
) -> TermShader:
    """Lay factors out for the GPU; if `filtered`, with their means over wider and wider samples.

    The texture `factors` has a row for every four terms, axes side by side, and within an axis its levels; float16 if
    the pack is in half precision, which represents its factors exactly. Uniforms: 1 / maximum, size - 1, first column
    and kind of each axis; of filtered factors also first column, size - 1 and 1 / spacing of each level of each axis,
    padded to `MOST_LEVELS`, and the number of each axis' last.

    Raises
    ------
    InputError : a pack of half precision whose factors 16 bits do not represent.
    """
    rank = factors[0].shape[1]
    rows = -(-rank // 4)
    tables = pyramid(axes, factors, half) if filtered else factors
    texels = np.zeros((rows, sum(len(table) for table in tables), 4), dtype=np.float32)
    kinds, levels, last_levels, first = [], [], [], 0
    for axis, table in zip(axes, tables, strict=True):
        padded = np.zeros((len(table), rows * 4), dtype=np.float32)
        padded[:, :rank] = table
        texels[:, first : first + len(table)] = padded.reshape(len(table), rows, 4).swapaxes(0, 1)
        kind = 2.0 if axis.periodic else 1.0 if axis.warp == "sqrt" else 0.0
        kinds.append((1.0 / axis.maximum, axis.size - 1.0, float(first), kind))
        if filtered:
            made = axis_levels(axis)
            each = zip(made.starts, made.sizes, made.spacings, strict=True)
            of_axis = [(float(first + at), size - 1.0, 1.0 / spacing) for at, size, spacing in each]
            levels += of_axis + [of_axis[-1]] * (MOST_LEVELS - len(of_axis))
            last_levels.append(len(of_axis) - 1.0)
        first += len(table)
    return TermShader(
        _FILE,
        {"AXES": len(axes)} | ({"MOST_LEVELS": MOST_LEVELS} if filtered else {}),
        {"factors": halved(texels) if half else texels},
        {"axes": kinds, "azimuth_channel": int(frame == "hd")}
        | ({"levels": levels, "last_level": last_levels} if filtered else {}),
    )


def halved(values: np.ndarray) -> np.ndarray:
    """Convert factors to float16; raises `InputError` if that is not exact."""
    with np.errstate(over="ignore"):
        small = values.astype(np.float16)
    if not np.array_equal(small, values):
        worst = values.flat[np.argmax(np.abs(values - np.nan_to_num(small.astype(np.float64))))]
        raise InputError(
            "factors of a half-precision pack do not fit into 16 bits",
            field="factors",
            found=float(worst),
            expected="numbers that 16 bits hold exactly",
            hint="materials.fitting.half_precision.rounded_to_half makes such a pack",
        )
    return small
