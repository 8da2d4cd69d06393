"""Cost and worth of spectra: a traced sample by its spectra, and by red, green and blue.

The truth has every wavelength. One form has as many coefficients as `fewest_spectra` finds that its spectra need; one
has eight; and one is fitted to what a camera saw under D65, and made spectra of afterwards, in every way that there is.
HP1 is no light of any fit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from ...materials.btf.decoding import uplifted_basis
from ...materials.btf.form import SIZES
from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.images import BtfImages
from ...materials.btf.local_pca import LocalPca, gathered, local_pca
from ...materials.btf.metric import folding_of
from ...materials.btf.reduced import InBasis, reduced
from ...spectral.basis import SpectralBasis
from ...spectral.difference import delta_e_xyz
from ...spectral.upsampling import METHODS, upsampling
from ..synthetic_btf.dyes import DYES, dyed
from ..synthetic_btf.synthetic import SyntheticBtf
from .cases import BtfCase, dye_spectra
from .methods import stored_bytes
from .rows import btf_row

#: Lights that all are judged under; of the last, no fit knows.
LIGHTS = ("D65", "A", "FL11", "HP1")
#: The form with the coefficients that it needs, that with eight, the first rounded by as much ΔE94 as the RGB form is,
#: whose steps are coarser, since made-up spectra differ more under other lights than true ones, and those of red, green
#: and blue by their uplifts: published ones; the linear one that is best for dyes of other kinds, and the best for the
#: very dyes of the sample, which is there to compare with, since who has only a camera's images cannot know them.
SPECTRAL, JOINT, SAME = "spectral", "spectral-8", "spectral-same-steps"
OTHERS, ORACLE = "rgb-other-dyes", "rgb-own-dyes"
UPLIFTS = (*(f"rgb-{name}" for name in METHODS), OTHERS, ORACLE)
NAMES = (SPECTRAL, JOINT, SAME, *UPLIFTS)
# Coefficients of the joint fit; texels that are judged; colours at once.
_JOINT, _JUDGED, _BLOCK = 8, 128, 1 << 15
# Least weight of a direction of spectra that the truth keeps, as a share of the largest.
_KEPT = 1e-4

#: Function from coefficients of a form to XYZ under all lights.
_ToXyz = Callable[[Float[np.ndarray, "n J"]], Float[np.ndarray, "n M3"]]


def spectral_rows(case: BtfCase, directions: Float[np.ndarray, "n 3"], wanted: Callable[[str], bool]) -> Iterator[dict]:
    """Yield the rows of a case of spectra; none of another."""
    if case.spectral is None or not any(map(wanted, NAMES)):
        return
    sample = case.spectral()
    judged = _Judged.of(_images(sample, Hemisphere(directions)))

    def each(name: str, made: _Fitted, to_xyz: _ToXyz) -> Iterator[dict]:
        if wanted(name):
            yield from judged.rows(case.name, name, made, to_xyz)

    def spectral(name: str, made: _Fitted) -> Iterator[dict]:
        yield from each(name, made, lambda found: found @ made.form.basis.synthesis.T @ judged.to_xyz)

    few = reduced(judged.images)
    ours = _Fitted.of(few) if wanted(SPECTRAL) or wanted(SAME) else None
    if ours:
        yield from spectral(SPECTRAL, ours)
    if wanted(JOINT):
        yield from spectral(JOINT, _Fitted.of(reduced(judged.images, size=_JOINT)))
    if not wanted(SAME) and not any(map(wanted, UPLIFTS)):
        return
    rgb = _Fitted.of(InBasis(judged.images, uplifted_basis()))
    if ours and wanted(SAME):
        yield from spectral(SAME, _Fitted.of(few, rgb.form.dictionary.step / ours.form.dictionary.step))
    for name, to_xyz in _uplifts(sample, judged.to_xyz).items():
        yield from each(name, rgb, to_xyz)


def _images(sample: SyntheticBtf, both: Hemisphere) -> BtfImages:
    """Traced, in orthonormal coefficients of which nothing is missing."""
    _, lengths, axes = np.linalg.svd(dye_spectra(sample), full_matrices=False)
    axes = axes[lengths > _KEPT * lengths[0]].T
    basis = SpectralBasis("sample", sample.dyes.wavelengths_nm, axes, axes)
    return sample.images(both, both, basis=basis)


def _uplifts(sample: SyntheticBtf, to_xyz: Float[np.ndarray, "L M3"]) -> Mapping[str, _ToXyz]:
    """Return the maps from linear red, green and blue to what lights show."""

    def published(name: str) -> _ToXyz:
        # Values below 0 have no spectrum; `_Judged.rows` holds all other forms' colours at 0, too.
        return lambda rgb: upsampling(name).folded(np.maximum(rgb, 0.0), to_xyz)

    def learnt(spectra: Float[np.ndarray, "n L"]) -> _ToXyz:
        linear = np.linalg.lstsq(spectra @ uplifted_basis().analysis, spectra, rcond=None)[0] @ to_xyz
        return lambda rgb: rgb @ linear

    own = sample.dyes.samples
    strengths = list(np.linspace(0.25, 1.8, 12))
    every = [dyed(name, strengths).samples for name in DYES]
    # Dyes that are not in the sample, whatever their strength.
    others = [some for some in every if not any((np.abs(own - one).max(axis=1) < 1e-9).any() for one in some)]
    found = {f"rgb-{name}": published(name) for name in METHODS}
    return found | {OTHERS: learnt(np.concatenate(others)), ORACLE: learnt(own)}


@dataclass(frozen=True, eq=False)
class _Fitted:
    """A form of the size beyond which bytes buy little, and what it took."""

    form: LocalPca
    seconds: float

    @classmethod
    def of(cls, images: BtfImages, coarser: float = 1.0) -> _Fitted:
        """coarser : so many times the usual steps of the dictionary."""
        begun, size = time.process_time(), SIZES["fine"]
        found = local_pca(images, replace(size, rounded=coarser * size.rounded))
        return cls(found, time.process_time() - begun)


@dataclass(frozen=True, eq=False)
class _Judged:
    """Some texels of a sample in every image. truth (n,M3) : XYZ under all lights. to_xyz (L,M3)."""

    images: BtfImages
    texels: Int[np.ndarray, " t"]
    truth: Float[np.ndarray, "n M3"]
    to_xyz: Float[np.ndarray, "L M3"]

    @classmethod
    def of(cls, images: BtfImages) -> _Judged:
        basis = images.basis
        to_xyz = folding_of(LIGHTS).weights(basis.wavelengths_nm)
        texels = np.random.default_rng(1).permutation(images.height * images.width)[:_JUDGED]
        values = gathered(images, texels).reshape(-1, basis.size)
        return cls(images, texels, np.pi * values @ (basis.synthesis.T @ to_xyz), to_xyz)

    def rows(self, case: str, name: str, made: _Fitted, to_xyz: _ToXyz) -> Iterator[dict]:
        """One a light."""
        form = made.form
        found = np.concatenate([one.reshape(-1, form.basis.size) for one in form.decoded(self.texels)])
        parts = np.array_split(np.pi * found.astype(np.float64), max(1, len(found) // _BLOCK))
        shown = np.maximum(np.concatenate([to_xyz(part) for part in parts]), 0.0)
        whites = self.to_xyz.sum(axis=0)
        count = self.images.height * self.images.width
        more = {
            "bytes_per_texel": stored_bytes(form.stored()) / count,
            "dictionary_bytes": stored_bytes(form.stored()["dictionary"]),
            "fit_cpu_seconds": made.seconds,
            "size": f"J = {form.basis.size}",
            "registered": True,
        }
        for light, at in ((name, slice(3 * i, 3 * i + 3)) for i, name in enumerate(LIGHTS)):
            off = delta_e_xyz(self.truth[:, at], shown[:, at], whites[at])
            yield btf_row(case, name, light, count, (off.mean(), *np.percentile(off, (95.0, 99.0))), **more)


def claims(found: Sequence[dict]) -> list[dict]:
    """Check the claims on spectral forms, as far as there are rows: `claim`, `found`, `bar` (at most) and `kept`."""
    by = {(one["method"], one["light"]): one for one in found if one["method"] in NAMES}
    said = []

    def add(claim: str, value: float, bar: float) -> None:
        said.append({"claim": claim, "found": value, "bar": bar, "kept": bool(value <= bar)})

    ours = by.get((SPECTRAL, "D65"))
    # One fit has all uplifts.
    rgb = next((by[name, "D65"] for name in UPLIFTS if (name, "D65") in by), None)
    if ours and rgb:
        add("bytes of the dictionary, of those of RGB's", ours["dictionary_bytes"] / rgb["dictionary_bytes"], 1.05)
        if (SAME, "D65") in by:
            ratio = by[SAME, "D65"]["dictionary_bytes"] / rgb["dictionary_bytes"]
            add("the same, where both are rounded by as much ΔE94", ratio, 1.05)
        rest = [one["bytes_per_texel"] * one["texels"] - one["dictionary_bytes"] for one in (ours, rgb)]
        add("bytes of weights and clusters, of those of RGB's", rest[0] / rest[1], 1.01)
    if ours and (JOINT, "D65") in by:
        for light in LIGHTS[:3]:
            off = abs(_mean(by[SPECTRAL, light]) - _mean(by[JOINT, light]))
            add(f"mean ΔE94 under {light} beside eight coefficients", off, 0.03)
    unseen = LIGHTS[-1]
    for known, names in (("", UPLIFTS[:-1]), (", one that knows the dyes", UPLIFTS[-1:])):
        some = [_mean(by[name, unseen]) for name in names if (name, unseen) in by]
        if ours and some:
            text = f"mean ΔE94 under {unseen}, which no fit saw, of that of RGB's best uplift{known}"
            add(text, _mean(by[SPECTRAL, unseen]) / min(some), 0.75)
    return said


def _mean(one: Mapping) -> float:
    return one["delta_e94"]["mean"]
