"""BTF as a surface: the original that fast forms approximate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ...spectral.folding import Folding
from ..core.fast import Fast
from ..core.points import Points
from ..core.surface import Surface
from ..svbrdf.texels import between
from .decoding import Coding
from .files import BtfFiles
from .hemisphere import Hemisphere
from .images import BtfImages, displacement
from .mean import MeanBtf

# Lookups of points in images per block: some 2 MB, which stay in cache.
_AT_ONCE = 1 << 13


@dataclass(frozen=True, eq=False)
class MeasuredBtf(Surface):
    """f_r interpolated among three views and three lights around each pair of directions (Meseth et al. 2003, eq. 4).

    f_r cos(theta_i) is measured and interpolated, and divided by the cosine at the end. Below the lowest measured light
    f_r is clamped; beyond the outermost views values are. Interpolation is linear between texels, and every view is
    shifted back by its displacement (`offset`), so that all show the surface at the same place.

    Parameters
    ----------
    images : the measurement.
    means : (V,Lt,J) mean of each image over its texels.
    form : name of the requested fast form (`form.NAMES`); "" leaves the choice to its budget.

    Raises
    ------
    InputError : means of another shape.
    """

    NAME: ClassVar[str] = "btf"
    uses_uv: ClassVar[bool] = True
    isotropic = False
    # Each call goes through the images once.
    points_at_once: ClassVar[int] = 1 << 17

    images: BtfImages
    means: Float[np.ndarray, "V Lt J"]
    form: str = ""

    def __post_init__(self) -> None:
        expected = (len(self.images.views), len(self.images.lights), self.images.basis.size)
        if self.means.shape != expected:
            raise InputError(
                "means do not fit the images", field="means", found=self.means.shape, expected=str(expected)
            )

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """(L,) of the images' basis."""
        return self.images.basis.wavelengths_nm

    def at(self, points: Points) -> Float[np.ndarray, "N L"]:
        """Implement `Surface.at`; each image is read once, however many points there are."""
        return self.images.basis.reconstruct(self._coefficients(points))

    def xyz(self, points: Points, folding: Folding) -> Float[np.ndarray, "N M3"]:
        """Implement `Surface.xyz`, without reconstructing spectra."""
        basis = self.images.basis
        weights = folding.weights(self.wavelengths_nm)
        return self._coefficients(points) @ (weights if basis.is_sampled else basis.synthesis.T @ weights)

    def _coefficients(self, points: Points) -> Float[np.ndarray, "N J"]:
        assert points.uv is not None
        images, out = self.images, np.zeros((len(points), self.images.basis.size))
        lit = np.flatnonzero((points.wi[:, 2] > 0) & (points.wo[:, 2] > 0))
        if len(lit):
            wi, wo, uv = points.wi[lit], points.wo[lit], points.uv[lit]
            seen, from_views = images.views.shares(wo)
            shone, from_lights = images.lights.shares(wi, falling=True)
            pair = (seen[:, :, None] * len(images.lights) + shone[:, None, :]).ravel()
            share = (from_views[:, :, None] * from_lights[:, None, :]).ravel()
            # The four texels are the same under all lights.
            moved = displacement(images.views.directions, images.offset) / (images.width, -images.height)
            row, column, part = between(
                (uv[:, None] + moved.take(seen, axis=0)).reshape(-1, 2), images.height, images.width
            )
            place, found = row * images.width + column, np.zeros((images.basis.size, len(lit)))
            # Numbers of 16 bits are sorted many times faster.
            rank = images.reading_order.astype(np.min_scalar_type(images.reading_order.size))
            order = np.argsort(rank[pair], kind="stable")
            order = order[share[order] > 0.0]
            # No image is in two of the pieces.
            begins = np.flatnonzero(np.diff(pair[order], prepend=-1))
            for some in np.split(order, begins[1:][np.diff(begins // _AT_ONCE) > 0]):
                of_view, point = some // 3, some // 9
                four = images.texels(pair[some], place.take(of_view, axis=0))
                parts = np.einsum("nk,nkj->nj", part.take(of_view, axis=0), four.astype(np.float64))
                for total, each in zip(found, parts.T, strict=True):
                    np.add.at(total, point, share[some] * each)
            out[lit] = found.T / wi[:, 2:]
        return out

    def average(self) -> MeanBtf:
        """Return its mean over all texels, in every direction."""
        return MeanBtf(self.images.views, self.images.lights, self.means, self.images.basis)

    def own_form(self, budget: float = 0.5) -> Fast | None:
        """Make the form by `form.btf_form`."""
        from .form import btf_form

        return btf_form(self.images, budget, name=self.form) if self.form else btf_form(self.images, budget)

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> MeasuredBtf:
        """Return the surface whose `parameters()` these are."""
        given = parameters
        basis = SpectralBasis.sampled(given["wavelengths_nm"])
        if "synthesis" in given:
            basis = SpectralBasis("uplifted", given["wavelengths_nm"], given["analysis"], given["synthesis"])
        channels = tuple(str(given["channels"]).split("\n")) if given.get("channels") else ()
        coding = Coding(str(given["encoding"]), given["white"], bool(given["includes_cosine"]), channels)
        starts = np.concatenate([[0], np.cumsum(np.asarray(given["sizes"], dtype=np.int64))])
        images = BtfFiles(
            Hemisphere(np.asarray(given["views"])),
            Hemisphere(np.asarray(given["lights"])),
            int(given["height"]),
            int(given["width"]),
            basis,
            given["images"],
            starts,
            np.asarray(given["index"], dtype=np.int64),
            coding,
            float(given["texel_mm"]) if "texel_mm" in given else None,
            float(given["offset"]),
        )
        return cls(images, np.asarray(given["means"], dtype=np.float64), str(given.get("form", "")))

    def parameters(self) -> dict[str, Any]:
        """Return the parameters that rebuild this surface; its images must be in files."""
        images = self.images
        if not isinstance(images, BtfFiles):
            raise InputError("a BTF that is in no files", field="images", expected="images that were imported")
        coding = images.coding
        found: dict[str, Any] = {
            "wavelengths_nm": images.basis.wavelengths_nm,
            "images": images.data,
            "sizes": np.diff(images.starts),
            "index": images.index,
            "views": images.views.directions,
            "lights": images.lights.directions,
            "means": np.asarray(self.means, dtype=np.float32),
            "height": images.height,
            "width": images.width,
            "encoding": coding.encoding,
            "white": coding.white,
            "includes_cosine": coding.includes_cosine,
            "channels": "\n".join(coding.channels),
            "offset": images.offset,
        }
        if not images.basis.is_sampled:
            found |= {"analysis": images.basis.analysis, "synthesis": images.basis.synthesis}
        found |= {"form": self.form} if self.form else {}
        return found | ({} if images.texel_mm is None else {"texel_mm": images.texel_mm})
