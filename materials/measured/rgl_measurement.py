"""The fields of one file of the RGL data base by their names, which `formats.rgl` lists, checked as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.wavelengths import validated_wavelengths

_AXES = ("phi_i", "theta_i")
# Names of the axes of each field; those that are shared between fields must agree in size.
_SHAPES = {
    "phi_i": "P",
    "theta_i": "T",
    "ndf": ("A ndf", "B ndf"),
    "sigma": ("A sigma", "B sigma"),
    "vndf": ("P", "T", "A", "B"),
    "luminance": ("P", "T", "H", "W"),
    "jacobian": ("one",),
}


@dataclass(frozen=True, eq=False)
class RglMeasurement:
    """The fields of one file under their own names, checked; `name` is the file's."""

    name: str
    fields: Mapping[str, np.ndarray]

    def __post_init__(self) -> None:
        _check(self.fields)

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"] | None:
        """(L,) of a spectral file, nm; None of one in RGB."""
        return np.asarray(self.fields["wavelengths"], dtype=np.float64) if "wavelengths" in self.fields else None

    @property
    def values(self) -> np.ndarray:
        """(P, T, L, H, W) spectra or (P, T, 3, H, W) RGB."""
        return self.fields["spectra" if "wavelengths" in self.fields else "rgb"]

    @property
    def isotropic(self) -> bool:
        """True for up to two azimuths of the light, the convention of the data base."""
        return len(self.fields["phi_i"]) <= 2

    @property
    def jacobian(self) -> bool:
        """True if values must be multiplied by ndf / (4 sigma)."""
        return bool(self.fields["jacobian"].ravel()[0])

    @property
    def description(self) -> str:
        """Description in the file."""
        return self.fields["description"].tobytes().decode("utf-8", "replace").strip("\0 \n")


def _check(fields: Mapping[str, np.ndarray]) -> None:
    """Check that the fields make a BRDF; raises an `InputError` that names the first invalid one."""
    values, third = ("spectra", "L") if "wavelengths" in fields else ("rgb", "C")
    shapes: dict[str, tuple[str, ...]] = {name: tuple(axes) for name, axes in _SHAPES.items()}
    shapes[values] = ("P", "T", third, "H", "W")
    if values == "spectra":
        shapes["wavelengths"] = ("L",)
    missing = sorted({*shapes, "description"} - set(fields))
    if missing:
        found = ", ".join(fields) or "nothing"
        expected, hint = f"also {', '.join(missing)}", "a tensor file of something else, or one that was saved in part"
        raise InputError("a BRDF lacks fields", field=missing[0], found=found, expected=expected, hint=hint)
    sizes = {"C": 3, "one": 1}
    for name, axes in shapes.items():
        field = fields[name]
        expected = tuple(sizes.get(axis, size) for axis, size in zip(axes, field.shape, strict=False))
        # One node cannot be interpolated over a square; over the light's directions it can.
        thin = any(
            size < (1 if axis in "PTLC" or axis == "one" else 2) for axis, size in zip(axes, field.shape, strict=False)
        )
        if field.ndim != len(axes) or field.shape != expected or thin:
            wanted = f"({', '.join(str(sizes.get(axis, axis.split()[0])) for axis in axes)})"
            raise InputError("a field of another shape", field=name, found=field.shape, expected=wanted)
        sizes |= dict(zip(axes, field.shape, strict=True))
        if not np.isfinite(field).all():
            raise InputError("not a finite number", field=name, found="NaN or infinity", expected="numbers")
    for name in _AXES:
        if (np.diff(fields[name].astype(np.float64)) <= 0).any() or np.abs(fields[name]).max() > 6.5:
            raise InputError("angles do not ascend", field=name, found=fields[name], expected="radians, ascending")
    if values == "spectra":
        validated_wavelengths(fields["wavelengths"], field="wavelengths")
    for name in ("ndf", "sigma", "vndf"):
        if fields[name].min() < 0:
            raise InputError("a density is negative", field=name, found=fields[name].min(), expected="0 or more")
    if not (fields["vndf"].max(axis=(-2, -1)) > 0).all():
        at = np.argwhere(fields["vndf"].max(axis=(-2, -1)) <= 0)[0]
        raise InputError(
            "a density is nowhere positive", field=f"vndf{at.tolist()}", found=0.0, expected="a positive one"
        )
