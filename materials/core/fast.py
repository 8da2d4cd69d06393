"""Fast forms: surfaces as sums of terms times palettes, which renderers draw. Geometry is scalar, colour a small fold.

What a fast form is made of are summands. Each has its own palette and says what its terms are at any points, once in
numpy (`Summand.terms`) and once in GLSL (`Summand.shader`); nobody else knows. `docs/adding_a_surface.md` adds one.
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
    frame : the angles that the shader gets: "io", with the light that arrives, or "hd", with that times cos(theta_i).
    precision : "half" where 16 bits hold exactly what its textures hold.
    mixed : how many entries of the palette are mixed at a point.
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
        """f_r cos(theta_i) without spectra, times what arrives; places are the points' numbers."""

    @abc.abstractmethod
    def shader(self, filtered: bool = False) -> TermShader:
        """Return the twin of `terms`; `filtered`: each term's mean over what a sample spans of the frame's angles.

        Raises
        ------
        InputError : the summand calls itself half precision and holds what 16 bits do not.
        """

    @property
    @abc.abstractmethod
    def key(self) -> tuple:
        """Equal for summands of equal terms, whatever their spectra; good while both live."""

    @property
    @abc.abstractmethod
    def nbytes(self) -> int:
        """Bytes of its arrays, spectra included."""

    @property
    @abc.abstractmethod
    def grid(self) -> str:
        """Grid that it is tabulated on, in words."""

    def in_basis(self: AnySummand, basis: SpectralBasis) -> AnySummand:
        """Return the same with its spectra projected into another basis."""
        return replace(self, palette=self.palette.in_basis(basis))  # pyright: ignore[reportArgumentType]


class Fast(Surface):
    """A surface that is a sum of summands: what a catalogue stores beside the original, and renderers draw.

    Subclasses are frozen dataclasses. NAME is the group of a material's file in which `stored` lies, WORDS what people
    call such a form.

    Attributes
    ----------
    summands : at least one, all at the same wavelengths.
    error : measured against the original; None where it was not.
    note : what is to be said of how it was chosen, once, where it is stored first.
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
        """True if a summand does."""
        return any(summand.uses_uv for summand in self.summands)

    @property
    def rank(self) -> int:
        """Terms of all summands."""
        return sum(summand.rank for summand in self.summands)

    @property
    def precision(self) -> str:
        """ "single", "half", or both in the order of the summands, with a plus between."""
        return "+".join(dict.fromkeys(summand.precision for summand in self.summands))

    def average(self) -> Fast:
        """Implement `Surface.average`; a fast form again."""
        return self

    def without_holes(self) -> Fast:
        """Return the same for who leaves out where `cutout` has holes: from afar the mean of what is there."""
        return self

    @abc.abstractmethod
    def in_basis(self, basis: SpectralBasis) -> Fast:
        """Return the same with all palettes in another basis."""

    def environment_form(self) -> EnvironmentForm:
        """Environment form of the surface.

        Raises
        ------
        InputError : the form does not say.
        """
        expected = "`environment_form` of its class, or lights that shine from one direction each"
        problem = "this fast form cannot be lit from all around"
        raise InputError(problem, field=self.NAME, found="no environment form", expected=expected)

    @property
    def texel_error(self) -> FitError | None:
        """Error of single texels, views and lights, where the original was measured so; None of any other form."""
        return None

    @property
    def environment_error(self) -> FitError | None:
        """Error of the environment form against the original, where it was measured (`slices.error`)."""
        return None

    @abc.abstractmethod
    def stored(self) -> dict[str, Any]:
        """Return what a file stores: text, numbers, arrays and mappings of those, by name."""

    @classmethod
    @abc.abstractmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> Fast:
        """Return the form whose `stored()` this is; KeyError where something is missing, InputError where it does not
        fit.
        """

    def shaded(self, points: Points) -> Float[np.ndarray, "N L"]:
        """f_r cos(theta_i) times what arrives, at every wavelength: what keeps its wavelength of what leaves."""
        total = np.zeros((len(points), len(self.wavelengths_nm)))
        for one in self.summands:
            one.terms(points).add_to(total, one.palette.samples)
        return total

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """f_r in 1/sr; what terms and palettes come to, negative values included."""
        shaded, cosine = self.shaded(points), points.wi[:, 2:]
        return np.divide(shaded, cosine, out=np.zeros_like(shaded), where=cosine > 0)

    def shaded_xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """f_r cos(theta_i) times what arrives, under each of M lights: as renderers sum it up."""
        xyz = np.zeros((len(points), 3 * len(folding.lights)))
        for one in self.summands:
            one.terms(points).add_to(xyz, one.palette.folded(folding))
        return xyz

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """`shaded_xyz` without the cosine, 1/sr."""
        shaded, cosine = self.shaded_xyz(points, folding), points.wi[:, 2:]
        return np.divide(shaded, cosine, out=np.zeros_like(shaded), where=cosine > 0)


def check_summands(summands: tuple[Summand, ...]) -> None:
    """Raises `InputError` where there are none, or where they are sampled at different wavelengths."""
    if not summands:
        raise InputError("no summands", field="summands", found=0, expected="at least one")
    grids = [summand.palette.wavelengths_nm for summand in summands]
    if any(not np.array_equal(grid, grids[0]) for grid in grids):
        raise InputError("summands sampled at different wavelengths", field="summands", expected="one wavelength grid")
