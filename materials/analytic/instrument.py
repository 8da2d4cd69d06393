"""Models whose body is derived from an instrument's reading of the whole surface, and the known instruments."""

from __future__ import annotations

import abc
from typing import ClassVar, NamedTuple, Self

from ...runtime.errors import InputError
from ...spectral.spectrum import Spectrum
from .model import AnalyticBrdf

# Angle from the normal at which a sphere instrument lights or views, where none is stated (CIE 015:2018, 5).
_SPHERE_DEG = 8.0
#: Geometries that `reads` knows, for messages.
GEOMETRIES = "45:0, di:8 (specular component included), de:8 (excluded)"


class Instrument(NamedTuple):
    """Geometry of an instrument.

    sphere_deg : viewing angle of a sphere from the normal; None for 45:0. included : whether a sphere includes the
    specular component; None if that is not stated, or for 45:0.
    """

    sphere_deg: float | None = None
    included: bool | None = None

    @classmethod
    def of(cls, geometry: str) -> Instrument:
        """Parse a geometry in any of the notations of `measurement.geometry_in`.

        Raises
        ------
        InputError : another geometry, or none.
        """
        # No fit and no picture asks for it.
        from ...spectral.measurement import Measurement

        measurement = Measurement.of("reflectance", {"geometry": geometry})
        found, specular = measurement.geometry, measurement.parts.get("specular component")
        if found is not None and found.kind == "directional" and (found.first, found.second) == (45.0, 0.0):
            return cls()
        if found is not None and found.kind == "sphere":
            degrees = _SPHERE_DEG if found.first is None else found.first
            return cls(degrees, None if specular is None else specular.value == "included")
        raise not_stated(geometry)


def not_stated(geometry: str) -> InputError:
    """Return the error for a spectrum whose measuring geometry is unknown."""
    return InputError(
        "which light the instrument counted is not stated",
        field="geometry",
        found=geometry or "nothing",
        expected=GEOMETRIES,
        hint='state it with the spectrum, geometry = "45:0", or geometry = "body" where it is that of the body alone',
    )


class ReadBrdf(AnalyticBrdf):
    """Model with the spectrum of a body inside, other than an instrument's reading of the whole.

    Attributes
    ----------
    READ : the field that `reads` finds.
    """

    READ: ClassVar[str]

    @abc.abstractmethod
    def reads(self, reading: Spectrum, geometry: str) -> Self:
        """Find the body for which an instrument reads a given spectrum of the whole.

        Parameters
        ----------
        reading : reflectance factor of the whole, on any wavelengths.
        geometry : "45:0", "di:8" or "de:8" in any of their notations.

        Raises
        ------
        InputError : another geometry, or readings that no body in [0, 1] has.
        """
