"""Cases of compression: BTFs that were measured, where their files are, and some that are traced."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.images import HeldImages
from ...materials.btf.metric import folding_of
from ...spectral.basis import SpectralBasis
from ..synthetic_btf.samples import corduroy, leather, woven
from ..synthetic_btf.synthetic import SyntheticBtf
from .png_components import CodedBtf, ubo_directions

#: Folders of coded BTFs, below `btf/` of the data.
MEASURED = ("wool", "corduroy")
#: Texels along each side of a crop of a measured BTF, in a quick and in a full run; and of one that is traced.
CROP, TRACED = (64, 128), (24, 48)
#: Directions that are traced, views and lights alike.
DIRECTIONS = ubo_directions()
# Coefficients of traced spectra: of two dyes, their products and white nothing is lost that is seen.
_SIZE = 8


@dataclass(frozen=True, eq=False)
class BtfCase:
    """A BTF, made when it is asked for, since two do not fit beside each other.

    name : as rows call it. measured, registered : its images, as they were taken, and moved back by what views
    displace; neither needs `BtfImages.registered` any more. offset : what they were moved by, texels. full : only the
    long run has it. spectral : the sample that was traced, for all that its spectra tell; None where nobody looks at
    them.
    """

    name: str
    measured: Callable[[], HeldImages]
    registered: Callable[[], HeldImages]
    offset: Callable[[], float]
    full: bool = False
    spectral: Callable[[], SyntheticBtf] | None = None


def btf_cases(data: Path | None, full: bool, texels: int | None = None) -> list[BtfCase]:
    """Return the cases that a run of this length has; without `data`, or files in it, only traced ones.

    texels : along each side of the crops of measured ones; None: `CROP`.
    """
    found = []
    for name in MEASURED:
        folder = None if data is None else data / "btf" / name
        if folder is not None and (folder / "meta.json").is_file():
            found.append(_measured(name, folder, CROP[full] if texels is None else texels))
    return found + [case for case in _traced(TRACED[full]) if full or not case.full]


def _measured(name: str, folder: Path, texels: int) -> BtfCase:
    files = _Files(folder)
    return BtfCase(
        name,
        lambda: files.coded.crop(texels, 0.0),
        lambda: files.coded.crop(texels, files.coded.offset),
        lambda: files.coded.offset,
    )


class _Files:
    """Read when they are needed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @cached_property
    def coded(self) -> CodedBtf:
        """The BTF in the folder."""
        return CodedBtf.read(self._folder)


def _traced(texels: int) -> Iterator[BtfCase]:
    """Cloth of two dyes, ridges and grain: each of full rank, with shadows and light from facet to facet."""
    samples = {
        "dyes": partial(woven, 3, texels, yarns=4),
        "corduroy": partial(corduroy, 4, texels, wales=max(1, texels // 12)),
        "leather": partial(leather, 5, texels),
    }
    for name, made in samples.items():
        traced = _Traced(made)
        yield BtfCase(
            f"synthetic-{name}",
            lambda traced=traced: traced.images,
            lambda traced=traced: moved(traced.images),
            lambda traced=traced: traced.images.offset,
            full=name != "dyes",
            spectral=made if name == "dyes" else None,
        )


class _Traced:
    """Images that are traced once."""

    def __init__(self, made: Callable[[], SyntheticBtf]) -> None:
        self._made = made

    @cached_property
    def images(self) -> HeldImages:
        """All of them, in a small basis."""
        sample, both = self._made(), Hemisphere(DIRECTIONS)
        nm = sample.dyes.wavelengths_nm
        basis = SpectralBasis.balanced(dye_spectra(sample), folding_of().weights(nm), _SIZE, nm)
        return sample.images(both, both, basis=basis)


def dye_spectra(sample: SyntheticBtf) -> Float[np.ndarray, "n L"]:
    """Return all that a traced sample's spectra are sums of: dyes, their products and white."""
    dyes = sample.dyes.samples
    products = (dyes[:, None] * dyes).reshape(-1, dyes.shape[1])
    return np.concatenate([dyes, products, np.ones((1, dyes.shape[1]))])


def moved(images: HeldImages) -> HeldImages:
    """Registered images that need not be registered again."""
    if images.offset == 0.0:
        return images
    values = np.empty_like(images.values)
    for view in range(len(images.views)):
        for light in range(len(images.lights)):
            values[view, light] = images.registered(view, light)
    return replace(images, values=values, offset=0.0)
