"""Registration of the sample's surface against the measured plane: a plane sweep over the views.

Images of a BTF are rectified to one plane. If the sample's surface is h0 texels above it, its image from (theta, phi)
is displaced by h0 tan(theta) away from the viewer, and three views show different threads at the same texel. All views
are shifted back for each of many h0, and the one of best agreement is chosen: the plane sweep of stereo vision (Collins
1996), with one plane for the whole sample. Images are first averaged over the lights, since shadows move with these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...spectral.difference import delta_e_xyz
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from .hemisphere import Hemisphere
from .images import BtfImages, displacement

#: Views that lean more than this, radians, are too foreshortened to be compared, with what rounding leaves.
MOST_LEANING = np.radians(60.0) + 1e-6
# Scale of the details compared: standard deviation, texels, of the blur that is subtracted.
_DETAIL = 6.0
# Texels of h0 between two planes of the sweep.
_STEP = 0.25
# The farthest plane, and the largest share of a picture that any view may be displaced by.
_FARTHEST, _SHARE = 16.0, 0.2
# Smallest picture that tells planes apart, texels.
_SMALLEST = 16
# Hold-out: every fourth of the views in the rings compared, under every third light, on this many texels each way.
_HELD_OUT, _LIGHTS, _TEXELS = 4, 3, 48
# Ratio of errors above which an improvement is chance.
_BETTER = 0.98


@dataclass(frozen=True)
class Registration:
    """Result of a plane sweep and of its test on held-out views.

    offset : h0 to register by, texels; 0 if that does not help. found : h0 of best agreement.
    before, after : ΔE94 under D65 (mean, 95th and 99th percentile) of held-out views, predicted from the three around
        each of them without registration and with it; None if there are too few views to hold any out.
    """

    offset: float
    found: float
    before: tuple[float, float, float] | None = None
    after: tuple[float, float, float] | None = None

    @property
    def words(self) -> str:
        """Description for the notes of a record."""
        if self.before is None or self.after is None:
            return "not registered: too few views, or too few texels, to tell where the surface lies"
        held = "held-out views dE94 {:.2f}, {:.2f}, {:.2f} (mean, p95, p99) without".format(*self.before)
        held += " and {:.2f}, {:.2f}, {:.2f} with it".format(*self.after)
        if self.offset:
            where = "above" if self.offset > 0 else "below"
            return f"registered: the surface lies {abs(self.offset):.2f} texels {where} the measured plane; {held}"
        return f"not registered: a plane at {self.found:.2f} texels is of no use; {held}"


def plane_offset(pictures: Float[np.ndarray, "V H W"], views: Float[np.ndarray, "V 3"]) -> float | None:
    """Find the h0, texels, at which views, shifted back, agree best; None if there is no such optimum.

    pictures : mean of each view over all lights, one number per texel; views that lean more than `MOST_LEANING` are
    ignored.

    Agreement is the variance that remains when shifted views, each of unit variance, are averaged. Shifts are phase
    rotations of the pictures' spectra: exact between texels, where interpolation would blur and so favour whole ones.
    """
    height, width = pictures.shape[1:]
    side = min(height, width)
    some = views[:, 2] >= np.cos(MOST_LEANING)
    lean = np.abs(displacement(views[some], 1.0))
    if side < _SMALLEST or some.sum() < 3 or lean.max() < 1e-3:
        return None
    across, down = np.fft.rfftfreq(width), np.fft.fftfreq(height)
    squared = across**2 + down[:, None] ** 2
    detail = 1.0 - np.exp(-2.0 * np.pi**2 * min(_DETAIL, side / 8.0) ** 2 * squared)
    # Samples do not tile: their edges are faded out. What changes from texel to texel is noise.
    window = np.hanning(height + 2)[1:-1, None] * np.hanning(width + 2)[1:-1]
    seen = [np.fft.irfft2(np.fft.rfft2(one - one.mean()) * detail, one.shape) * window for one in pictures[some]]
    kept = np.flatnonzero((squared < 0.3**2) & (squared > 0.0))
    spectra = np.stack([np.fft.rfft2(one).ravel()[kept] for one in seen])
    # Waves along the width are there once for two.
    twice = np.where(np.broadcast_to(across > 0.0, squared.shape), 2.0, 1.0).ravel()[kept]
    power = np.sqrt(((np.abs(spectra) ** 2) * twice).sum(axis=1, keepdims=True))
    if (power <= 1e-12 * max(1.0, float(np.abs(pictures).max()))).any():
        return None
    spectra = (spectra / power).astype(np.complex64)
    waves = np.stack([np.tile(across, height)[kept], np.repeat(down, len(across))[kept]])
    farthest = min(_FARTHEST, _SHARE * side / lean.max())
    count = int(farthest / _STEP)
    turn = 2j * np.pi * displacement(views[some], _STEP) @ waves
    shifted, once = spectra * np.exp(-count * turn), np.exp(turn).astype(np.complex64)
    agreement = np.empty(2 * count + 1)
    for number in range(len(agreement)):
        agreement[number] = (np.abs(shifted.mean(axis=0)) ** 2 * twice).sum()
        shifted = shifted * once
    best = int(agreement.argmax())
    if best in (0, len(agreement) - 1):
        return None
    before, here, after = agreement[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    return _STEP * (best - count + (0.5 * (before - after) / bend if bend < 0.0 else 0.0))


def held_out_error(images: BtfImages, offset: float) -> tuple[float, float, float] | None:
    """Compute ΔE94 of held-out views predicted from the three around each: mean, 95th and 99th percentile.

    Every fourth view off the normal and within `MOST_LEANING` is held out; None if there are too few. Colours are f_r
    cos under D65 relative to a perfect diffuser lit along its normal, at texels in the middle of the pictures. Shifts
    are linear between texels: on wool and corduroy (UBO2003) shifts by whole texels leave a mean of 4.32 and 4.34 in
    place of 4.16 and 4.07.
    """
    from scipy.ndimage import map_coordinates

    views = images.views.directions
    leaning = np.flatnonzero((views[:, 2] >= np.cos(MOST_LEANING)) & (views[:, 2] < np.cos(np.radians(1.0))))
    held = leaning[::_HELD_OUT]
    kept = np.setdiff1d(np.arange(len(views)), held)
    if not len(held) or len(kept) < 3:
        return None
    fold = np.pi * images.basis.fold(illuminant("D65"), observer("1931_2")).T
    white = observer("1931_2").weights(illuminant("D65"), images.basis.wavelengths_nm).sum(axis=1)
    rows, columns = _middle(images.height), _middle(images.width)
    moved = displacement(views, offset)

    def texels(view: int, light: int) -> Float[np.ndarray, "n 3"]:
        across, down = moved[view]
        xyz = images.image(view, light).astype(np.float64) @ fold
        place = np.meshgrid(rows + down, columns + across, indexing="ij")
        return np.stack(
            [map_coordinates(xyz[..., k], place, order=1, mode="grid-wrap").ravel() for k in range(3)], axis=1
        )

    around, share = Hemisphere(views[kept]).shares(views[held])
    off = []
    for light in range(0, len(images.lights), _LIGHTS):
        known: dict[int, np.ndarray] = {}
        for number, view in enumerate(held):
            found = 0.0
            for corner, part in zip(kept[around[number]].tolist(), share[number], strict=True):
                if part > 1e-6:
                    known[corner] = known[corner] if corner in known else texels(corner, light)
                    found = found + part * known[corner]
            off.append(delta_e_xyz(texels(int(view), light), np.asarray(found), white))
    every = np.concatenate(off)
    return float(every.mean()), float(np.quantile(every, 0.95)), float(np.quantile(every, 0.99))


def registered(images: BtfImages, pictures: Float[np.ndarray, "V H W"]) -> Registration:
    """Find the registration of images; it is used if it predicts held-out views better.

    It must beat both no registration and the plane as far on the other side: shifts between texels blur, and blurred
    images are predicted better at any offset.
    """
    found = plane_offset(pictures, images.views.directions)
    before = held_out_error(images, 0.0) if found is not None else None
    if found is None or before is None:
        return Registration(0.0, 0.0)
    after, blurred = held_out_error(images, found), held_out_error(images, -found)
    assert after is not None and blurred is not None
    helps = after[0] < _BETTER * min(before[0], blurred[0])
    return Registration(found if helps else 0.0, found, before, after)


def _middle(size: int) -> Int[np.ndarray, " n"]:
    """Return the texels in the middle of one axis that are looked at."""
    count = min(size, _TEXELS)
    return np.arange(count) + (size - count) // 2
