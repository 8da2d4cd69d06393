"""Survey of every image of a BTF: their presence, readability and means."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from ...runtime.errors import InputError
from ..btf.files import BtfFiles, OtherSizeError, size_words
from ..btf.registration import MOST_LEANING
from .btf_names import image_name
from .naming import printable

# Most names given in full.
_NAMED = 6


@dataclass(frozen=True, eq=False)
class Sorted:
    """Files sorted by the content of their names.

    views, lights : (V,2), (Lt,2) theta and phi, degrees, ascending. wavelengths_nm : (B,) if there is a file for each.
    files : in the order of the index. index : (V,Lt,B) number of the file, -1 if it is missing.
    """

    views: Float[np.ndarray, "V 2"]
    lights: Float[np.ndarray, "Lt 2"]
    wavelengths_nm: Float[np.ndarray, " B"] | None
    files: tuple[Path, ...]
    index: Int[np.ndarray, "V Lt B"]


def sorted_files(paths: list[Path], folder: Path) -> Sorted:
    """Sort the files of one set by view, light and wavelength.

    Raises
    ------
    InputError : a direction below the horizon or duplicated, a wavelength in only some of the names.
    """
    named = {path: name for path in paths if (name := image_name(path)) is not None}
    below = [path for path, name in named.items() if any(not 0.0 <= at[0] <= 90.0 for at in (name.light, name.view))]
    if below:
        raise InputError(
            "a direction below the horizon",
            file=folder,
            field="theta",
            found=_few(below, folder),
            expected="tl and tv from 0 to 90 degrees",
            hint="correct these names, or move these images elsewhere",
        )
    lengths = {name.wavelength_nm for name in named.values()}
    if None in lengths and len(lengths) > 1:
        without = [path for path, name in named.items() if name.wavelength_nm is None]
        raise InputError(
            "images with a wavelength in their names, and without",
            file=folder,
            field="wavelength",
            found=_few(without, folder),
            expected="a wavelength in all names, as in 550nm, or in none",
            hint="move those that do not belong to the set elsewhere",
        )
    keys = {path: (_angles(name.view), _angles(name.light), name.wavelength_nm) for path, name in named.items()}
    twice = [key for key, count in Counter(keys.values()).items() if count > 1]
    if twice:
        same = [path for path, key in keys.items() if key in twice]
        raise InputError(
            "images of the same directions",
            file=folder,
            field="names",
            found=_few(same, folder),
            expected="each view and light once",
            hint="move one of each to another folder; of different samples, give each its own; of different "
            "wavelengths, write them as in 550nm",
        )
    views, lights = sorted({key[0] for key in keys.values()}), sorted({key[1] for key in keys.values()})
    bands = sorted(lengths, key=lambda length: length or 0.0)
    index = np.full((len(views), len(lights), len(bands)), -1, dtype=np.int64)
    files = tuple(sorted(keys, key=lambda path: (keys[path][0], keys[path][1], keys[path][2] or 0.0)))
    rows, columns = ({one: at for at, one in enumerate(axis)} for axis in (views, lights))
    planes = {one: at for at, one in enumerate(bands)}
    for number, path in enumerate(files):
        view, light, length = keys[path]
        index[rows[view], columns[light], planes[length]] = number
    nm = None if bands == [None] else np.array(bands, dtype=np.float64)
    return Sorted(np.array(views), np.array(lights), nm, files, index)


def _angles(at: tuple[float, float]) -> tuple[float, float]:
    """Normalise a direction: at the pole, phi is ignored."""
    return (at[0], at[1] % 360.0 if at[0] else 0.0)


@dataclass(frozen=True, eq=False)
class Survey:
    """Survey of images: the usable images, their means, and notes.

    means : (V,Lt,J) over texels of f_r cos. pictures : (V,H,W) of each view the mean over lights, one number per texel;
    zero if it is not used. negative : count of numbers below zero.
    """

    images: BtfFiles
    means: Float[np.ndarray, "V Lt J"]
    pictures: Float[np.ndarray, "V H W"]
    negative: int
    notes: tuple[str, ...]


def surveyed(images: BtfFiles, fill: float, folder: Path) -> Survey:
    """Read every image once.

    fill : largest share of the set that may be interpolated from neighbours.

    Raises
    ------
    InputError : images of different sizes; more of them missing or damaged than `fill`; no readable image.
    """
    shape = len(images.views), len(images.lights)
    index, means = images.index.copy(), np.zeros((*shape, images.basis.size))
    compared = images.views.directions[:, 2] >= np.cos(MOST_LEANING)
    pictures = np.zeros((shape[0], images.height, images.width), dtype=np.float32)
    damaged: dict[str, str] = {}
    sizes: dict[str, list[str]] = {}
    negative = 0
    for view, light in np.argwhere((index >= 0).all(axis=2)).tolist():
        try:
            values = images.image(view, light)
        except InputError as reason:
            name = images.name(view, light)
            if isinstance(reason, OtherSizeError):
                sizes.setdefault(str(reason.found), []).append(name)
            else:
                damaged[name] = reason.problem
                index[view, light] = -1
            continue
        sizes.setdefault(size_words(*values.shape[:2]), []).append(images.name(view, light))
        means[view, light] = values.mean(axis=(0, 1), dtype=np.float64)
        negative += int((values < 0.0).sum())
        if compared[view]:
            # As bright as it looks: highlights do not drown the rest.
            pictures[view] += np.sqrt(np.maximum(values.mean(axis=2), 0.0))
    if len(sizes) > 1:
        usual = max(sizes, key=lambda size: len(sizes[size]))
        others = [f"{name} {size}" for size, names in sizes.items() if size != usual for name in names]
        raise InputError(
            "images of different sizes",
            file=folder,
            field="size",
            found=_listed(others),
            expected=f"{usual}, as {len(sizes[usual])} have",
            hint="export all images in one resolution",
        )
    notes = _lacking(images, index, damaged, fill, folder)
    images = replace(images, index=index)
    for view, light in images.missing.tolist():
        means[view, light] = images.image(view, light).mean(axis=(0, 1), dtype=np.float64)
    return Survey(images, means, pictures, negative, notes)


def _lacking(
    images: BtfFiles, index: Int[np.ndarray, "V Lt B"], damaged: dict[str, str], fill: float, folder: Path
) -> tuple[str, ...]:
    """Note the images that are interpolated from their neighbours; refuse more than `fill` of them."""
    lacking = np.argwhere((images.index < 0).any(axis=2)).tolist()
    names = [f"{images.words(view, light)}" for view, light in lacking]
    names += [f"{name} ({problem})" for name, problem in damaged.items()]
    if not names:
        return ()
    every = index.shape[0] * index.shape[1]
    if len(names) > fill * every or not (index >= 0).all(axis=2).any():
        raise InputError(
            "images are missing or damaged",
            file=folder,
            field="images",
            found=f"{len(lacking)} missing and {len(damaged)} damaged of {every}: {_listed(names)}",
            expected=f"every view under every light; {100.0 * fill:g} % may be filled",
            hint="fetch the missing ones, or let more be made of their neighbours: --fill SHARE",
        )
    return (f"{len(names)} of {every} images are missing or damaged, and made of those around them: {_listed(names)}",)


def _listed(names: list[str]) -> str:
    return ", ".join(map(printable, names[:_NAMED])) + (
        f", and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    )


def _few(paths: list[Path], folder: Path) -> str:
    """List some names, and the number of the others."""
    return _listed([path.relative_to(folder).as_posix() for path in sorted(paths)])
