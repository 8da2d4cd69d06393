"""Images from files: spectral OpenEXR (Fichet, Pacanowski and Wilkie, JCGT 10(3), 2021) under any light, or XYZ.

An image is stored as float32 planes, one per channel, as in the file: for any light and observer, XYZ is three weights
per plane, so that a change is one matrix product. Fluorescent images have planes for pairs of wavelengths, with weights
by the excitation; their colours are exact, too. An image in XYZ is shown unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.bispectral import Bispectral
from ...spectral.formats.spectral_exr import RELATIVE_UNITS
from ...spectral.illuminants import illuminant
from ...spectral.image import ColourImage
from ...spectral.observers import EFFICACY, Observer
from ...spectral.spectrum import Spectrum
from ..render.session import radiance_weights


@dataclass(frozen=True, eq=False)
class SpectralPicture:
    """Spectral image as stored in its file.

    Parameters
    ----------
    kind : "emission", radiance of each pixel, or "reflectance".
    planes : (C,H,W) float32. into, out : (C,) nm, excitation and emission wavelength of each plane, equal without
        fluorescence.
    wavelengths_nm : (L,) of planes without fluorescence, ascending.
    units : of emission, as stated in the file, or "". light : illuminant named in the header, if known.
    notes : on its values.
    """

    kind: Literal["emission", "reflectance"]
    planes: Float[np.ndarray, "C H W"]
    into: Float[np.ndarray, " C"]
    out: Float[np.ndarray, " C"]
    wavelengths_nm: Float[np.ndarray, " L"]
    units: str = ""
    light: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def coverage(self) -> float:
        """1: all pixels are covered."""
        return 1.0

    @property
    def relative(self) -> bool:
        """True if 1 is the perfect diffuser under equal energy, as written by Metamer."""
        return self.kind == "emission" and self.units == RELATIVE_UNITS

    def folded(
        self,
        observer: Observer,
        light: Spectrum | None = None,
        own_light: Spectrum | None = None,
        luminance: float | None = None,
    ) -> ColourImage:
        """Compute XYZ of the image, and its white with Y = 1.

        Parameters
        ----------
        light : illuminant, required for reflectance; None shows emission in its own light.
        own_light : light in which emission was recorded, by default that of the header. It is replaced by `light` at
            each wavelength, which is right without fluorescence and with lamps of one spectrum.
        luminance : cd/m^2 of white, for emission in absolute units only.

        Raises
        ------
        InputError : a missing light; a missing or superfluous luminance; an own light without power at some wavelength
            of `light`.
        """
        weights, white = self.weights(observer, light, own_light, luminance)
        flat = self.planes.reshape(len(self.planes), -1)
        xyz = (weights.astype(np.float32) @ flat).T.reshape(*self.planes.shape[1:], 3)
        return ColourImage(xyz, "xyz", white)

    def weights(
        self,
        observer: Observer,
        light: Spectrum | None = None,
        own_light: Spectrum | None = None,
        luminance: float | None = None,
    ) -> tuple[Float[np.ndarray, "3 C"], Float[np.ndarray, "3"]]:
        """Return the weights in XYZ = weights @ planes, and the white; parameters and errors: see `folded`."""
        if self.kind == "reflectance":
            if light is None:
                hint = "choose an illuminant or a lamp"
                raise InputError(
                    "a reflectance has no colour without a light", field="light", expected="one", hint=hint
                )
            _check_unneeded(luminance, "reflectances have none")
            return self._of_reflectance(observer, light), observer.white(light)
        return self._of_emission(observer, light, own_light, luminance)

    def spectrum(self, row: int, column: int) -> Float[np.ndarray, " L"]:
        """Return the spectrum of a pixel without fluorescence, at `wavelengths_nm`, in the file's units."""
        return self.planes[: len(self.wavelengths_nm), row, column].astype(np.float64)

    def region(self, rows: slice, columns: slice) -> Float[np.ndarray, " L"]:
        """Return the mean of `spectrum` over a region."""
        planes = self.planes[: len(self.wavelengths_nm), rows, columns]
        return planes.mean(axis=(1, 2), dtype=np.float64)

    def relighting(
        self, observer: Observer, light: Spectrum | None, own_light: Spectrum | None
    ) -> Float[np.ndarray, " L"]:
        """Compute the factor of each wavelength of emission in another light of the same luminance; 1 in its own.

        Raises
        ------
        InputError : an unknown own light; a light without power; an own light without power where the other has some.
        """
        nm, own = self.wavelengths_nm, self._own(own_light)
        if light is None or light.key == own.key:
            return np.ones(len(nm))
        luminous = radiance_weights(observer, nm)[1]
        old, new = (one.averaged(nm).samples for one in (own, light))
        powers = [float(luminous @ samples) for samples in (old, new)]
        for name, power in zip(("own_light", "light"), powers, strict=True):
            if not power > 0.0:
                found = "none at the picture's wavelengths"
                raise InputError("a light of no power", field=name, found=found, expected="some")
        dark = (old <= 0.0) & (new > 0.0)
        if dark.any():
            where = nm[dark]
            raise InputError(
                "no light of the picture's own that another could take the place of",
                field="light",
                found=f"its own light sends nothing at {where[0]:g}{f' to {where[-1]:g}' if len(where) > 1 else ''} nm",
                expected="a light within what it sends",
                hint="render the picture in this light, or as reflectances",
            )
        return np.divide(new, old, out=np.zeros(len(nm)), where=old > 0.0) * (powers[0] / powers[1])

    def _own(self, own_light: Spectrum | None) -> Spectrum:
        """Return the light in which emission was recorded, as stated by the header or the user."""
        if own_light is None and not self.light:
            expected = "the light that the picture was made in, which white is the white of"
            raise InputError("in which light was this made?", field="own_light",
                             found="no light in the header" if self.light is None else self.light,
                             expected=expected)  # fmt: skip
        return own_light or illuminant(self.light or "")

    def _of_reflectance(self, observer: Observer, light: Spectrum) -> Float[np.ndarray, "3 C"]:
        nm = self.wavelengths_nm
        kept = observer.weights(light, nm)
        if len(self.planes) == len(nm):
            return kept
        # The integral of `Bispectral.fold_emission`, for each pair of wavelengths.
        bare = Bispectral(nm, nm, np.zeros((len(nm), len(nm))))
        excited = dict(zip(nm.tolist(), bare.excitation(light).tolist(), strict=True))
        seen = dict(zip(nm.tolist(), observer.sensitivity(nm).T, strict=True))
        pairs = zip(self.into[len(nm) :].tolist(), self.out[len(nm) :].tolist(), strict=True)
        more = [excited[absorbed] * seen[emitted] for absorbed, emitted in pairs]
        return np.concatenate([kept, np.stack(more, axis=1) / observer.luminous(light)], axis=1)

    def _of_emission(
        self, observer: Observer, light: Spectrum | None, own_light: Spectrum | None, luminance: float | None
    ) -> tuple[Float[np.ndarray, "3 C"], Float[np.ndarray, "3"]]:
        nm = self.wavelengths_nm
        to_xyz = radiance_weights(observer, nm)
        weights = to_xyz * self.relighting(observer, light, own_light)
        white = to_xyz @ (light or self._own(own_light)).averaged(nm).samples
        if not white[1] > 0.0:
            found = "none at the picture's wavelengths"
            raise InputError("a light of no power", field="light", found=found, expected="some")
        if self.relative:
            _check_unneeded(luminance, f"the picture is {RELATIVE_UNITS}")
        else:
            if luminance is None or not (np.isfinite(luminance) and luminance > 0.0):
                raise InputError(
                    "how bright is white?",
                    field="luminance",
                    found=luminance,
                    expected=f"cd/m^2, more than 0: the picture is in {self.units or 'units that it does not state'}",
                )
            weights = weights * (
                EFFICACY * float(np.trapezoid(observer.cmfs[:, 1], observer.wavelengths_nm)) / luminance
            )
        return weights, white / white[1]


@dataclass(frozen=True, eq=False)
class XyzPicture:
    """Image in XYZ, as in reviews and baselines, for one light and observer.

    Parameters
    ----------
    planes : (3,H,W) float32, X, Y and Z, premultiplied by `coverage` (H,W).
    white : (3,) reference white.
    light, observer : names stated in its file, or "".
    notes : on the image.
    """

    kind: ClassVar = "XYZ"
    planes: Float[np.ndarray, "3 H W"]
    coverage: Float[np.ndarray, "H W"]
    white: Float[np.ndarray, "3"]
    light: str = ""
    observer: str = ""
    notes: tuple[str, ...] = ()

    def folded(
        self,
        observer: Observer,
        light: Spectrum | None = None,
        own_light: Spectrum | None = None,
        luminance: float | None = None,
    ) -> ColourImage:
        """Return the image unchanged; errors: see `check`."""
        self.check(observer, light, own_light, luminance)
        return ColourImage(np.moveaxis(self.planes, 0, 2), "xyz", self.white)

    def check(
        self,
        observer: Observer,
        light: Spectrum | None = None,
        own_light: Spectrum | None = None,
        luminance: float | None = None,
    ) -> None:
        """Raise for settings that need spectra.

        Raises
        ------
        InputError : a light, an observer other than the file's, or a luminance.
        """
        hint = "open the scene, or render it to a spectral picture (`metamer render --spectral`)"
        if light is not None or own_light is not None:
            expected = f"its own light{f', {self.light}' if self.light else ''}"
            raise InputError("a picture in XYZ is in one light", field="light", expected=expected, hint=hint)
        if self.observer and observer.name != self.observer:
            raise InputError(
                "a picture in XYZ is for one observer",
                field="observer",
                found=observer.name,
                expected=self.observer,
                hint=hint,
            )
        _check_unneeded(luminance, "a picture in XYZ is relative to its white")


def _check_unneeded(luminance: float | None, why: str) -> None:
    if luminance is not None:
        raise InputError("a luminance that nothing asks for", field="luminance", found=luminance, expected=why)
