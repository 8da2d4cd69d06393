"""Base of analytic models: parameters that can be stored and rebuilt, and their validation."""

from __future__ import annotations

import abc
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError, UnknownNameError
from ...spectral.folding import Folding
from ...spectral.spectrum import Spectrum, check_values
from ...spectral.wavelengths import validated_wavelengths
from ..core.brdf import Brdf, eval_lit
from ..core.points import Points
from ..core.surface import Directed, SumOfTerms

Parameter = Float[np.ndarray, " L"] | float | str


class AnalyticBrdf(Brdf):
    """A reflection model with a closed formula; its subclasses are frozen dataclasses of its parameters.

    A field that is a `Spectrum` is a reflectance, an array is any other spectral quantity, and the rest are numbers,
    each with its `Domain`, or names. The GLSL twin, `<NAME>.glsl` beside the module, is a function `float NAME(vec3 wi,
    vec3 wo, ...)` of the same parameters in the same order at one wavelength; a name becomes its index in `CHOICES`.

    Attributes
    ----------
    NAME : name in catalogues and of the GLSL function.
    CHOICES : allowed names of each parameter that is a name.
    ALBEDO_BOUND : upper bound of the directional albedo; above 1 only if that of the published model is.
    """

    NAME: ClassVar[str]
    CHOICES: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    ALBEDO_BOUND: ClassVar[float] = 1.0

    @classmethod
    @abc.abstractmethod
    def examples(cls, wavelengths_nm: np.ndarray) -> tuple[AnalyticBrdf, ...]:
        """Return instances that span the parameters, ends included, for the conformance and parity tests."""

    @abc.abstractmethod
    def _eval_lit(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Evaluate f_r (N,L) of pairs (N,3) that are all above the horizon."""

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Evaluate f_r (...,L) in 1/sr; see `Brdf.eval`."""
        return eval_lit(self._eval_lit, len(self.wavelengths_nm), wi, wo)

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Fold the spectra of terms first, then evaluate these: `Surface.xyz`."""
        terms = self.sum_of_terms
        if terms is None:
            return super().xyz(points, folding)
        folded = terms(folding.weights(self.wavelengths_nm))
        return eval_lit(folded, 3 * len(folding.lights), points.wi, points.wo)

    def parameters(self) -> dict[str, Parameter]:
        """Return the parameters that rebuild this BRDF, beside `wavelengths_nm`: an array (L,), a number or a name by
        field.
        """
        values = {name: getattr(self, name) for name in self._declared()}
        return {name: v.samples if isinstance(v, Spectrum) else v for name, v in values.items()}

    @classmethod
    def from_parameters(cls, wavelengths_nm: np.ndarray, parameters: Mapping[str, Any]) -> AnalyticBrdf:
        """Return the BRDF whose `parameters()` these are.

        Raises
        ------
        InputError : a parameter is missing, not one of this model's, or out of its domain.
        """
        declared = cls._declared()
        for name in parameters:
            if name not in declared:
                raise UnknownNameError(f"parameter of {cls.NAME}", name, declared, field=name)
        missing = [name for name in declared if name not in parameters]
        if missing:
            raise InputError(f"missing parameter of {cls.NAME}", field=missing[0], expected="; ".join(declared))
        grid = validated_wavelengths(wavelengths_nm)
        return cls(**{name: _from_stored(kind, grid, parameters[name], name) for name, kind in declared.items()})

    @classmethod
    def domains(cls) -> dict[str, Domain]:
        """List the domains of numeric parameters, in order."""
        concrete: Any = cls
        return {field.name: field.metadata["domain"] for field in fields(concrete) if "domain" in field.metadata}

    @classmethod
    def _declared(cls) -> dict[str, str]:
        """Return the parameters in order, each with its annotation."""
        concrete: Any = cls
        return {field.name: str(field.type) for field in fields(concrete) if field.init}

    def _set(self, **values: object) -> None:
        """Set fields that were derived or checked during construction of the frozen dataclass."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _checked_reflectance(self, name: str) -> np.ndarray:
        """Return samples (L,) of the field `name`, a reflectance on the model's wavelengths, which the first sets."""
        spectrum: Spectrum = getattr(self, name)
        if spectrum.quantity != "reflectance":
            raise InputError("wrong quantity", field=name, found=spectrum.quantity, expected="reflectance")
        samples = spectrum.samples
        if samples.ndim != 1:
            raise InputError("not one spectrum", field=name, found=f"shape {samples.shape}", expected="(L,)")
        grid = self.__dict__.setdefault("wavelengths_nm", spectrum.wavelengths_nm)
        if not np.array_equal(spectrum.wavelengths_nm, grid):
            raise InputError(
                "wavelengths differ from those of the other spectra",
                field=name,
                found=_range(spectrum.wavelengths_nm),
                expected=_range(grid),
                hint="resample one of them: spectrum.resampled(wavelengths_nm)",
            )
        check_values(samples, grid, "reflectance", field=name)
        return samples

    def _checked_spectral(self, name: str, low: float, *, open_low: bool = False) -> np.ndarray:
        """Return the field `name` as an array (L,) of numbers >= `low` (> with `open_low`) on the model's
        wavelengths."""
        values = np.asarray(getattr(self, name), dtype=np.float64)
        if values.shape != self.wavelengths_nm.shape:
            raise _misfit(name, values, self.wavelengths_nm)
        bad = ~(np.isfinite(values) & ((values > low) if open_low else (values >= low)))
        if bad.any():
            at = int(np.argmax(bad))
            raise InputError(
                "out of its domain",
                field=name,
                found=f"{values[at]:g} at {self.wavelengths_nm[at]:g} nm",
                expected=f"finite and {'>' if open_low else '>='} {low:g}",
            )
        return values

    def _check_numbers(self) -> None:
        """Store the parameters that are numbers as such; raise `InputError` for one out of its domain."""
        for name, domain in self.domains().items():
            number = _number(getattr(self, name), name)
            if not domain.holds(number):
                raise InputError("out of its domain", field=name, found=f"{number:g}", expected=domain.words)
            self._set(**{name: number})

    def _checked_choice(self, name: str) -> str:
        """Return the field `name`, one of its names in `CHOICES`."""
        value = str(getattr(self, name))
        if value not in self.CHOICES[name]:
            raise UnknownNameError(name, value, self.CHOICES[name], field=name)
        return value


@dataclass(frozen=True, eq=False)
class ModelPart(Brdf):
    """One lobe of a model: `evaluate(wi (N,3), wo (N,3)) -> (N,L)` above the horizon.

    folded : weights (L,C) -> a function that evaluates `evaluate(wi, wo) @ weights`, (N,C), without spectra; None if
        spectra are required.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    isotropic: bool
    evaluate: Directed
    folded: Callable[[np.ndarray], Directed] | None = None
    _kept: list[tuple[Folding, Directed]] = field(default_factory=list, repr=False)

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """Evaluate f_r (...,L) of this part in 1/sr; see `Brdf.eval`."""
        return eval_lit(self.evaluate, len(self.wavelengths_nm), wi, wo)

    @property
    def sum_of_terms(self) -> SumOfTerms | None:
        """Terms that others of the model may share: `Surface.sum_of_terms`."""
        return self.folded if isinstance(self.folded, SumOfTerms) else None

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Implement `Surface.xyz`; folded before the evaluation if possible."""
        if self.folded is None:
            return super().xyz(points, folding)
        if not self._kept or self._kept[0][0] is not folding:
            self._kept[:] = [(folding, self.folded(folding.weights(self.wavelengths_nm)))]
        return eval_lit(self._kept[0][1], 3 * len(folding.lights), points.wi, points.wo)


def _from_stored(kind: str, grid: np.ndarray, value: object, name: str) -> object:
    """Convert a stored value to the type that the field `name` is annotated with."""
    if kind == "float":
        return _number(value, name)
    if kind == "str":
        return value.decode() if isinstance(value, bytes) else str(value)
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError("not numbers", field=name, found=repr(value)[:80], expected="an array (L,)") from None
    if array.shape != grid.shape:
        raise _misfit(name, array, grid)
    if kind != "Spectrum":
        return array
    check_values(array, grid, "reflectance", field=name)
    return Spectrum.sampled(grid, array, "reflectance")


def _number(value: Any, name: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError("not a number", field=name, found=repr(value)[:80], expected="a number") from None


def _misfit(name: str, values: np.ndarray, grid: np.ndarray) -> InputError:
    return InputError(
        "values do not fit the wavelengths", field=name, found=f"shape {values.shape}", expected=f"{grid.shape}"
    )


def _range(grid: np.ndarray) -> str:
    return f"{len(grid)} from {grid[0]:g} to {grid[-1]:g} nm"


@dataclass(frozen=True)
class Domain:
    """Finite numbers from `low` (excluded with `open_low`) to `high`; `unit` is "" if there is none."""

    low: float
    high: float = np.inf
    open_low: bool = False
    unit: str = ""

    def holds(self, number: float) -> bool:
        """Return whether the number is in the domain."""
        above = number > self.low if self.open_low else number >= self.low
        return bool(np.isfinite(number) and above and number <= self.high)

    @property
    def words(self) -> str:
        """Description for a message: "a number > 0 and <= 1"."""
        upper = f" and <= {self.high:g}" if np.isfinite(self.high) else ""
        unit = f" {self.unit}" if self.unit else ""
        return f"a number {'>' if self.open_low else '>='} {self.low:g}{upper}{unit}"


def in_domain(low: float, high: float = np.inf, *, open_low: bool = False, unit: str = "") -> dict[str, Domain]:
    """Make the metadata of a dataclass field with a number in this domain."""
    return {"domain": Domain(low, high, open_low, unit)}
