"""Views that no fit saw: each of them made from the three around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.images import BtfImages
from ...materials.btf.registration import MOST_LEANING
from ...spectral.basis import SpectralBasis
from .rows import Reconstruct, seen_error

# Interval of the views left out, among those in the compared rings.
_HELD_OUT = 4


@dataclass(frozen=True, eq=False)
class SomeViews(BtfImages):
    """A BTF without some of its views."""

    images: BtfImages
    kept: Int[np.ndarray, " V"]
    views: Hemisphere
    lights: Hemisphere
    height: int
    width: int
    basis: SpectralBasis

    @classmethod
    def of(cls, images: BtfImages, kept: Int[np.ndarray, " V"]) -> SomeViews:
        """Choose the views that are kept, in that order."""
        views = Hemisphere(images.views.directions[kept])
        return cls(images, kept, views, images.lights, images.height, images.width, images.basis)

    def image(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """Implement `BtfImages.image`."""
        return self.images.image(int(self.kept[view]), light)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A BTF in two: views to fit to, and those that are judged."""

    fitted: SomeViews
    judged: SomeViews

    @classmethod
    def of(cls, images: BtfImages) -> HeldOut | None:
        """One in four of the views off the normal within 60 degrees is judged; None where that leaves none, or too
        few.
        """
        height = images.views.directions[:, 2]
        leaning = np.flatnonzero((height >= np.cos(MOST_LEANING)) & (height < np.cos(np.radians(1.0))))
        held = leaning[::_HELD_OUT]
        kept = np.setdiff1d(np.arange(len(height)), held)
        if not len(held) or len(kept) < 3:
            return None
        return cls(SomeViews.of(images, kept), SomeViews.of(images, held))

    def error(self, reconstruct: Reconstruct) -> tuple[tuple[float, float, float], float]:
        """Compute `rows.seen_error` of the judged views, from a form of the fitted ones."""
        around, share = self.fitted.views.shares(self.judged.views.directions)

        def between(view: int, light: int) -> Float[np.ndarray, "H W J"]:
            some = [
                part * reconstruct(int(corner), light)
                for corner, part in zip(around[view], share[view], strict=True)
                if part > 0.0
            ]
            return np.sum(some, axis=0)

        return seen_error(self.judged, between)
