"""Fast form of a spectral texture: a picture of coefficients, times a few spectra.

Texels' reflectances R (n,L) are written in the basis whose R coefficients best preserve their products with lights
(`SpectralBasis.balanced`, after Peercy 1993): each texel has R numbers, and all share the spectra. A sample under any
light costs a look-up of R numbers and one fold.
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
from ...spectral.difference import delta_e_xyz
from ...spectral.folding import Folding
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.palette import Palette
from ..core.axes import Frame
from ..core.environment_form import EnvironmentForm, Lobes
from ..core.fast import Fast, Summand
from ..core.fit_error import FitError
from ..core.points import Points
from ..core.protocol import LIGHTS
from ..core.terms import Terms, TermShader
from ..factored.pack import FactoredBrdf, matt_brdf
from .texels import filtered, levels_of, look_up, packed

# Texels that the number of terms is judged on.
_JUDGED = 8192
# Share of the budget that a texel's colour may be off: directions cost nothing here, but half precision does.
_SHARE = 0.2
# Texels per block.
_BLOCK = 1 << 16


@dataclass(frozen=True, eq=False)
class TextureForm(Fast):
    """Fast form of a matt texture: exact in every direction, with the colours of texels within a budget."""

    NAME: ClassVar[str] = "texture"
    WORDS: ClassVar[str] = "texture"
    isotropic = True

    texture: TexturePlanes
    error: FitError | None = None

    @property
    def summands(self) -> tuple[Summand, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The texture, as the only summand."""
        return (self.texture,)

    def average(self) -> FactoredBrdf:
        """Return one constant term for each plane, its mean."""
        texture = self.texture
        mean = texture.planes.mean(axis=(0, 1), dtype=np.float64)
        return replace(matt_brdf(mean, texture.palette), error=self.error)

    def in_basis(self, basis: SpectralBasis) -> TextureForm:
        """Implement `Fast.in_basis`; the planes are shared."""
        return replace(self, texture=self.texture.in_basis(basis))

    def environment_form(self) -> MattTexture:
        """Implement `Fast.environment_form`."""
        return MattTexture(self.texture)

    def stored(self) -> dict[str, Any]:
        """Return the stored fields: `planes`, in their precision, and the palette."""
        texture = self.texture
        return {"planes": texture.planes, "precision": texture.precision, "palette": texture.palette.stored()}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any], error: FitError | None) -> TextureForm:
        """Implement `Fast.from_stored`."""
        palette = Palette.from_stored(kept["palette"])
        return cls(TexturePlanes(np.asarray(kept["planes"]), palette, kept["precision"]), error)


def texture_form(wavelengths_nm: Float[np.ndarray, " L"], reflectance: np.ndarray, budget: float = 0.5) -> TextureForm:
    """Fit the fast form of reflectances (H,W,L), its palette at their own wavelengths.

    The number of terms is the smallest that keeps ΔE94 under each of `protocol.LIGHTS` within a fifth of `budget` at
    the 99th percentile of the texels judged, and within `budget` at all of them; three terms per light leave no error.
    Planes are in half precision if that stays within the same bounds.
    """
    texels = reflectance.reshape(-1, reflectance.shape[2])
    judged = texels[:: max(1, len(texels) // _JUDGED)].astype(np.float64)
    folding = Folding(observer("1931_2"), [illuminant(name) for name in LIGHTS])
    weights = folding.weights(wavelengths_nm)
    full = SpectralBasis.balanced(judged, weights, wavelengths_nm=wavelengths_nm)
    truth, whites = judged @ weights, weights.sum(axis=0)

    def within(coefficients: np.ndarray, basis: SpectralBasis) -> bool:
        off = differences(truth, coefficients @ (basis.synthesis.T @ weights), whites)
        return bool(np.percentile(off, 99, axis=1).max() <= _SHARE * budget and off.max() <= budget)

    size = next((j for j in range(1, full.size) if within(judged @ full.analysis[:, :j], full.truncated(j))), full.size)
    basis = full.truncated(size)
    # Each plane's largest magnitude is 1: what was divided out goes into its spectrum.
    tallest = np.zeros(size)
    for start in range(0, len(texels), _BLOCK):
        found = np.abs(texels[start : start + _BLOCK].astype(np.float64) @ basis.analysis)
        tallest = np.maximum(tallest, found.max(axis=0))
    scale = np.where(tallest > 0, tallest, 1.0)
    analysis = basis.analysis / scale
    half = within((judged @ analysis).astype(np.float16) * scale, basis)
    planes = np.empty((len(texels), size), dtype=np.float16 if half else np.float32)
    for start in range(0, len(texels), _BLOCK):
        planes[start : start + _BLOCK] = texels[start : start + _BLOCK].astype(np.float64) @ analysis
    spectra = (basis.synthesis * scale).T / np.pi
    palette = Palette.of(spectra, SpectralBasis.sampled(wavelengths_nm))
    shaped = planes.reshape(*reflectance.shape[:2], size)
    return TextureForm(TexturePlanes(shaped, palette, "half" if half else "single"))


def differences(
    reference: Float[np.ndarray, "n M3"], sample: Float[np.ndarray, "n M3"], whites: Float[np.ndarray, " M3"]
) -> Float[np.ndarray, "M n"]:
    """Compute ΔE94 of each texel under each light."""
    each = (slice(start, start + 3) for start in range(0, len(whites), 3))
    return np.stack([delta_e_xyz(reference[:, at], sample[:, at], whites[at]) for at in each])


@dataclass(frozen=True, eq=False)
class MattTexture(EnvironmentForm):
    """Environment form of matt textures: no Gaussians; the integral of a coefficient over the cosine is pi times it."""

    uses_uv: ClassVar[bool] = True
    count = 0

    texture: TexturePlanes

    @property
    def palette(self) -> Palette:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Palette of the texture."""
        return self.texture.palette

    def lobes(self, points: Points) -> Lobes:
        """Implement `EnvironmentForm.lobes`."""
        matt = np.pi * self.texture.coefficients(points)
        count, rank = matt.shape
        return Lobes(np.zeros((count, 0, 3)), np.zeros((count, 0)), np.zeros((count, 0, rank)), matt[:, None])

    def shader(self, filtered: bool = False) -> TermShader:
        """Return the texture's own look-up, with a cosine in place of its term."""
        return replace(self.texture.shader(filtered), file=Path(__file__).with_name("matt_texture.glsl"))

    @property
    def key(self) -> tuple:
        """Key of the texture."""
        return self.texture.key


@dataclass(frozen=True, eq=False)
class TexturePlanes(Summand):
    """Coefficients of every texel: term r is plane r at the point, times the cosine.

    planes : (H,W,R), in float16 where `precision` is "half". palette : one entry of R spectra, 1/sr.
    """

    uses_uv: ClassVar[bool] = True

    planes: np.ndarray
    palette: Palette
    precision: Literal["single", "half"] = "single"
    frame: Frame = "hd"

    def __post_init__(self) -> None:
        expected = (self.palette.entries, self.palette.rank)
        if self.planes.ndim != 3 or not self.planes.size or (1, self.planes.shape[2]) != expected:
            words = f"(H, W, {self.palette.rank}), one entry"
            raise InputError("planes do not fit", field="planes", found=self.planes.shape, expected=words)

    @cached_property
    def levels(self) -> list[np.ndarray]:
        """Mip levels of the planes (`texels.levels_of`)."""
        return levels_of(self.planes)

    def terms(self, points: Points) -> Terms:
        """Implement `Summand.terms`, averaged over the footprint of points that have one."""
        return Terms(self.coefficients(points) * points.angles(self.frame).scale[:, None])

    def coefficients(self, points: Points) -> Float[np.ndarray, "N R"]:
        """Interpolate each plane at each point, or average it over the point's footprint."""
        assert points.uv is not None
        if points.spans is None or points.footprint is None:
            return look_up(self.planes, points.uv)
        return filtered(self.levels, points.uv, points.footprint)

    def shader(self, filtered: bool = False) -> TermShader:
        """Make the shader by `texels.packed`."""
        levels = self.levels if filtered else [self.planes]
        # Means of halves are no halves.
        texels, sizes, places = packed(levels, self.planes.dtype == np.float16 and not filtered)
        return TermShader(Path(__file__).with_name("texture.glsl"), sizes, {"planes": texels}, {"levels": places})

    @property
    def key(self) -> tuple:
        """Identity of the planes."""
        return "texture", id(self.planes)

    @property
    def nbytes(self) -> int:
        """Bytes of planes and spectra."""
        return self.planes.nbytes + self.palette.values.nbytes

    @property
    def grid(self) -> str:
        """Texels across and down."""
        return f"{self.planes.shape[1]} x {self.planes.shape[0]} texels"
