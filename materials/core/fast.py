"""Fast forms: surfaces as sums of terms times palettes, which renderers draw. Geometry is scalar, colour a small fold.

A fast form is a sum of summands. Each has its own palette and evaluates its terms at any points, once in numpy
(`Summand.terms`) and once in GLSL (`Summand.shader`); no other code knows them. `docs/adding_a_surface.md` adds one.
"""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar, Literal, TypeVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ...spectral.folding import Folding
from ...spectral.palette import Palette
from .axes import Frame
from .environment_form import EnvironmentForm
from .fit_error import FitError
from .points import Points
from .surface import Surface
from .terms import Terms, TermShader

#: Along a side of a GL texture: what OpenGL 4.1 promises.
MOST_TEXELS = 16384


AnySummand = TypeVar("AnySummand", bound="Summand")


class Summand(abc.ABC):
    """Terms times one palette; subclasses are frozen dataclasses.

    Attributes
    ----------
    palette : (P,R,J): the spectra that terms are multiplied with.
    frame : the angles that the shader gets: "io", with the incident light, or "hd", with that times cos(theta_i).
    precision : "half" if 16 bits represent its textures exactly.
    mixed : number of palette entries mixed at a point.
    """

    palette: Palette
    frame: Frame
    precision: Literal["single", "half"] = "single"
    uses_uv: ClassVar[bool] = False
    mixed: ClassVar[int] = 1

    @property
    def rank(self) -> int:
        """Number of terms R."""
        return self.palette.rank

    @abc.abstractmethod
    def terms(self, points: Points) -> Terms:
        """Evaluate f_r cos(theta_i) without spectra, times the incident light; places are indices of the points."""

    @abc.abstractmethod
    def shader(self, filtered: bool = False) -> TermShader:
        """Return the GLSL twin of `terms`; `filtered`: with terms averaged over a sample's span of the frame's angles.

        Raises
        ------
        InputError : the summand claims half precision, which does not represent its textures.
        """

    @property
    @abc.abstractmethod
    def key(self) -> tuple:
        """Equal for summands of equal terms, whatever their spectra; valid while both exist."""

    @property
    @abc.abstractmethod
    def nbytes(self) -> int:
        """Bytes of its arrays, spectra included."""

    @property
    @abc.abstractmethod
    def grid(self) -> str:
        """Grid of its tables, in words."""

    def in_basis(self: AnySummand, basis: SpectralBasis) -> AnySummand:
        """Return the summand with its spectra projected into another basis."""
        return replace(self, palette=self.palette.in_basis(basis))  # pyright: ignore[reportArgumentType]


class Fast(Surface):
    """A surface that is a sum of summands: what a catalogue stores beside the original, and renderers draw.

    Subclasses are frozen dataclasses. NAME is the group of `stored` in a material's file, WORDS the form's name for
    users.

    Attributes
    ----------
    summands : at least one, all at the same wavelengths.
    error : measured against the original; None if it was not.
    note : remark on how it was chosen, shown once, when it is first stored.
    """

    NAME: ClassVar[str]
    WORDS: ClassVar[str] = "terms"
    summands: tuple[Summand, ...]
    error: FitError | None
    note: str = ""

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """(L,) of the palettes."""
        return self.summands[0].palette.wavelengths_nm

    @property
    def uses_uv(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """True if a summand needs texture coordinates."""
        return any(summand.uses_uv for summand in self.summands)

    @property
    def rank(self) -> int:
        """Number of terms of all summands."""
        return sum(summand.rank for summand in self.summands)

    @property
    def precision(self) -> str:
        """ "single", "half", or both in the order of the summands, with a plus between."""
        return "+".join(dict.fromkeys(summand.precision for summand in self.summands))

    def average(self) -> Fast:
        """Implement `Surface.average`; the result is a fast form."""
        return self

    def without_holes(self) -> Fast:
        """Return the form for renderers that discard holes by `cutout`: footprints average over the opaque part."""
        return self

    @abc.abstractmethod
    def in_basis(self, basis: SpectralBasis) -> Fast:
        """Return the form with all palettes in another basis."""

    def environment_form(self) -> EnvironmentForm:
        """Return the environment form of the surface.

        Raises
        ------
        InputError : the form has none.
        """
        expected = "`environment_form` of its class, or lights that shine from one direction each"
        problem = "this fast form cannot be lit from all around"
        raise InputError(problem, field=self.NAME, found="no environment form", expected=expected)

    @property
    def texel_error(self) -> FitError | None:
        """Error over single texels, views and lights, if the original was measured so; None for other forms."""
        return None

    @property
    def environment_error(self) -> FitError | None:
        """Error of the environment form against the original, if it was measured (`slices.error`)."""
        return None

    @abc.abstractmethod
    def stored(self) -> dict[str, Any]:
        """Return the stored fields: text, numbers, arrays and mappings of those, by name."""

    @classmethod
    @abc.abstractmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> Fast:
        """Return the form whose `stored()` this is; KeyError if a field is missing, InputError if one does not fit."""

    def shaded(self, points: Points) -> Float[np.ndarray, "N L"]:
        """Evaluate f_r cos(theta_i) times the incident light, at every wavelength, without fluorescence."""
        total = np.zeros((len(points), len(self.wavelengths_nm)))
        for one in self.summands:
            one.terms(points).add_to(total, one.palette.samples)
        return total

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """Evaluate f_r in 1/sr as reconstructed from terms and palettes, negative values included."""
        shaded, cosine = self.shaded(points), points.wi[:, 2:]
        return np.divide(shaded, cosine, out=np.zeros_like(shaded), where=cosine > 0)

    def shaded_xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Compute f_r cos(theta_i) times the incident light, under each of M lights, in the sum that renderers use."""
        xyz = np.zeros((len(points), 3 * len(folding.lights)))
        for one in self.summands:
            one.terms(points).add_to(xyz, one.palette.folded(folding))
        return xyz

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Compute `shaded_xyz` without the cosine, 1/sr."""
        shaded, cosine = self.shaded_xyz(points, folding), points.wi[:, 2:]
        return np.divide(shaded, cosine, out=np.zeros_like(shaded), where=cosine > 0)


def check_summands(summands: tuple[Summand, ...]) -> None:
    """Raise `InputError` if there are none, or if they are sampled at different wavelengths."""
    if not summands:
        raise InputError("no summands", field="summands", found=0, expected="at least one")
    grids = [summand.palette.wavelengths_nm for summand in summands]
    if any(not np.array_equal(grid, grids[0]) for grid in grids):
        raise InputError("summands sampled at different wavelengths", field="summands", expected="one wavelength grid")
