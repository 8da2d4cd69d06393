"""A made-up sample: its relief, its dyes, and its images."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.images import HeldImages
from ...runtime.errors import InputError
from ...runtime.memory import check_room
from ...spectral.basis import SpectralBasis
from ...spectral.spectrum import Spectrum
from .relief import Relief
from .transport import MATT, CoatGloss, ReliefTransport, traced


@dataclass(frozen=True, eq=False)
class SyntheticBtf:
    """A sample whose BTF is known at every wavelength.

    relief : its surface, and which dye is where.
    dyes : reflectances (P,L).
    gloss : a white lobe that light from the lamp meets; light between facets does not.
    plane : height of the measured plane, texels, as the relief's heights are; None: that of the highest point.
    seed : of all rays that are drawn.
    gathering : squared, the rays that gather light from other facets for each; 0: none is gathered.
    samples : squared, the rays of each view into a texel.
    texel_mm : what a texel is wide; None: not said.

    Raises
    ------
    InputError : spectra that are no reflectances of as many dyes as the relief has.
    """

    relief: Relief
    dyes: Spectrum
    gloss: CoatGloss = MATT
    plane: float | None = None
    seed: int = 0
    gathering: int = 8
    samples: int = 4
    texel_mm: float | None = None

    def __post_init__(self) -> None:
        needed = int(self.relief.dye.max()) + 1
        shape = self.dyes.samples.shape
        if self.dyes.quantity != "reflectance" or len(shape) != 2 or shape[0] < needed:
            raise InputError(
                "spectra that are not those of the dyes",
                field="dyes",
                found=f"{self.dyes.quantity} of shape {shape}",
                expected=f"reflectances ({needed}, wavelengths)",
            )

    @property
    def height_of_plane(self) -> float:
        """Height of the measured plane, texels."""
        return float(self.relief.heights.max()) if self.plane is None else self.plane

    @property
    def offset(self) -> float:
        """Texels by which the surface stands above the measured plane on the mean: `BtfImages.offset`."""
        return self.relief.mean_height - self.height_of_plane

    def dyed(self, dyes: Spectrum) -> SyntheticBtf:
        """Return the same sample with other dyes; a `ReliefTransport` of the one is one of the other."""
        return replace(self, dyes=dyes)

    def transport(
        self, views: Hemisphere, lights: Hemisphere, progress: Callable[[int, int, str], None] | None = None
    ) -> ReliefTransport:
        """Trace its light: the part that takes time, and knows no dyes. See `transport.traced`."""
        return traced(
            self.relief,
            views,
            lights,
            plane=self.height_of_plane,
            seed=self.seed,
            gathering=self.gathering,
            samples=self.samples,
            progress=progress,
        )

    def lit(
        self, transport: ReliefTransport, basis: SpectralBasis | None = None
    ) -> Iterator[Float[np.ndarray, "V H W J"]]:
        """Return its images from all views under one light after the other: f_r cos(theta_i), 1/sr.

        Products of dyes are made at every wavelength and only then given to the `basis`; None: the wavelengths
        themselves.

        Raises
        ------
        InputError : a basis of other wavelengths than the dyes'.
        """
        fold = _Fold(self, transport, self.basis if basis is None else basis)
        return (fold.under(light) for light in range(len(transport.lights)))

    @cached_property
    def basis(self) -> SpectralBasis:
        """The wavelengths of the dyes."""
        return SpectralBasis.sampled(self.dyes.wavelengths_nm)

    def images(
        self,
        views: Hemisphere,
        lights: Hemisphere,
        progress: Callable[[int, int, str], None] | None = None,
        *,
        basis: SpectralBasis | None = None,
        transport: ReliefTransport | None = None,
    ) -> HeldImages:
        """Return all images, float32, in the `basis` (None: sampled at the dyes' wavelengths, which takes most memory).

        transport : of the same sample with other dyes, and the same views and lights: nothing is traced again.
        progress : called with (steps done, steps in all, what is done), while tracing and again while folding.

        Raises
        ------
        InputError : images that memory does not hold; a transport of something else.
        """
        kept = self.basis if basis is None else basis
        shape = (len(views), len(lights), *self.relief.texels, kept.size)
        check_room(
            4 * int(np.prod(shape, dtype=np.int64)),
            "the images of a sample do not fit in memory",
            found=f"{shape[0]} views, {shape[1]} lights, {shape[2]} x {shape[3]} texels, {shape[4]} coefficients",
            hint="fewer texels, or a basis of few coefficients",
        )
        if transport is None:
            transport = self.transport(views, lights, progress)
        elif transport.relief is not self.relief or transport.views is not views or transport.lights is not lights:
            raise InputError(
                "a transport of another sample, or of other directions",
                field="transport",
                expected="one that was traced on this relief for these views and lights",
            )
        values = np.empty(shape, dtype=np.float32)
        for light, image in enumerate(self.lit(transport, kept)):
            values[:, light] = image
            if progress is not None:
                progress(light + 1, len(lights), "folding dyes")
        return HeldImages(views, lights, values, kept, self.texel_mm, self.offset)


class _Fold:
    """Spectra of dyes, and their products, in a basis."""

    def __init__(self, sample: SyntheticBtf, transport: ReliefTransport, basis: SpectralBasis) -> None:
        if not np.array_equal(basis.wavelengths_nm, sample.dyes.wavelengths_nm):
            raise InputError(
                "a basis of other wavelengths than the dyes",
                field="basis",
                found=f"{basis.wavelengths_nm[[0, -1]].tolist()} nm, {len(basis.wavelengths_nm)} samples",
                expected=f"those of the dyes, {len(sample.dyes.wavelengths_nm)} samples",
            )
        self._transport, self._gloss = transport, sample.gloss
        self._dye = sample.relief.facet_dyes
        spectra = sample.dyes.samples
        self._once = (basis.project(spectra) / np.pi).astype(np.float32)
        self._twice = [(basis.project(one * spectra) / np.pi).astype(np.float32) for one in spectra]
        self._white = basis.project(np.ones_like(spectra[0])).astype(np.float32)

    def under(self, light: int) -> Float[np.ndarray, "V H W J"]:
        """Images of all views."""
        transport = self._transport
        leaving = self._once[self._dye] * transport.direct[:, light, None]
        gathered = transport.gathered(light, len(self._once)).astype(np.float32)
        for dye, twice in enumerate(self._twice):
            facets = np.flatnonzero(self._dye == dye)
            leaving[facets] += gathered[facets] @ twice
        shape = (len(transport.views), *transport.relief.texels, len(self._white))
        images = (transport.shown @ leaving).reshape(shape)
        if self._gloss.strength:
            images += transport.lobe(light, self._gloss)[..., None] * self._white
        return images
