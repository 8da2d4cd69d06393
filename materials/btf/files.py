"""BTF images in files: read and decoded one by one, each verified by its digest."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from .decoding import Coding
from .hemisphere import Hemisphere
from .images import BtfImages

#: Decoded images that are kept, bytes.
KEPT_BYTES = 64 << 20
#: Images that are kept as their files' numbers, a fourth to an eighth of that each, bytes.
HELD_BYTES = 512 << 20


class OtherSizeError(InputError):
    """Error of an image whose size differs from the others."""


@runtime_checkable
class Bytes(Protocol):
    """Concatenated bytes of the files, verified when read."""

    @property
    def file(self) -> Path:
        """Folder or file that holds them."""
        ...

    def read(self, rows: slice) -> np.ndarray:
        """Read a range of bytes; raises `InputError` if they have changed."""
        ...


class HeldCodes:
    """Cache of undecoded images (8 or 16 bits, or floats), for texels that are read repeatedly.

    Caching begins when an image is requested for the second time and ends at `most` bytes: a single pass over all
    images caches nothing, and repeated passes over more images than fit read the rest from their files each time.
    Images whose shape or type differs from that of the first one are not cached.

    images : number of images. most : bytes.

    Attributes
    ----------
    slot : (images,) index of each in the cache; -1 if it is not cached.
    """

    def __init__(self, images: int, most: int = HELD_BYTES) -> None:
        self.slot, self._most = np.full(images, -1), most
        self._bands: list[np.ndarray] = []
        self._count = 0
        self._asked, self._again = np.zeros(images, dtype=bool), False

    def offer(self, image: int, codes: list[Shaped[np.ndarray, "H W C"]]) -> None:
        """Cache an image that was read, if the rules above allow it."""
        self._again = self._again or bool(self._asked[image])
        self._asked[image] = True
        if not self._again:
            return
        if not self._bands:
            room = min(len(self.slot), self._most // max(1, sum(one.nbytes for one in codes)))
            # Memory is taken as it is written to.
            self._bands = [np.empty((room, *one.shape), one.dtype) for one in codes]
        kinds = [[(one.dtype, *one.shape[-3:]) for one in some] for some in (self._bands, codes)]
        if kinds[0] == kinds[1] and self._count < len(self._bands[0]):
            for band, one in zip(self._bands, codes, strict=True):
                band[self._count] = one
            self.slot[image] = self._count
            self._count += 1

    def texels(
        self, images: Int[np.ndarray, " n"], places: Int[np.ndarray, "n k"]
    ) -> list[Shaped[np.ndarray, "n k C"]]:
        """Return the stored values of some texels (row-major indices) of cached images."""
        found = []
        for band in self._bands:
            _, height, width, channels = band.shape
            found.append(band.reshape(-1, channels).take(self.slot[images, None] * (height * width) + places, axis=0))
        return found


@dataclass(frozen=True, eq=False)
class BtfFiles(BtfImages):
    """BTF images in files; see `BtfImages`.

    data : the bytes of all files; starts : (n + 1,) offset of each file, and the end of the last.
    index : (V,Lt,B) file of each view and light, for each of B wavelengths if an image holds one, else B is 1; -1 if it
        is missing: the image is interpolated from its neighbours.

    Raises
    ------
    InputError : an index that does not fit; when an image is read, a file that is missing, has changed, is of another
        size or cannot be decoded.
    """

    views: Hemisphere
    lights: Hemisphere
    height: int
    width: int
    basis: SpectralBasis
    data: Bytes
    starts: Int[np.ndarray, " n1"]
    index: Int[np.ndarray, "V Lt B"]
    coding: Coding
    texel_mm: float | None = None
    offset: float = 0.0
    kept_bytes: int = KEPT_BYTES
    _kept: OrderedDict[tuple[int, int], np.ndarray] = field(default_factory=OrderedDict, repr=False)

    def __post_init__(self) -> None:
        shape, expected = self.index.shape, (len(self.views), len(self.lights))
        if self.index.ndim != 3 or shape[:2] != expected or self.index.max(initial=-1) >= len(self.starts) - 1:
            raise InputError("files do not fit their directions", field="index", found=shape, expected=str(expected))

    def image(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        """Implement `BtfImages.image`, with a cache of recent images; the result is shared and read-only."""
        key = (int(view), int(light))
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        found = self._filled(*key) if self._made[key] else self._read(*key)
        found.setflags(write=False)
        size = max(1, found.nbytes)
        while self._kept and size * (len(self._kept) + 1) > self.kept_bytes:
            self._kept.popitem(last=False)
        if size <= self.kept_bytes:
            self._kept[key] = found
        return found

    @cached_property
    def missing(self) -> Int[np.ndarray, "K 2"]:
        """(K,2) views and lights of missing images, which are interpolated from their neighbours."""
        return np.argwhere(self._made)

    @cached_property
    def _made(self) -> Bool[np.ndarray, "V Lt"]:
        return np.asarray((self.index < 0).any(axis=2))

    def texels(self, images: Int[np.ndarray, " n"], places: Int[np.ndarray, "n k"]) -> Float[np.ndarray, "n k J"]:
        """Implement `BtfImages.texels`; images read repeatedly stay in memory, undecoded, if `held` has room."""
        held = self.held.slot[images] >= 0
        if len(held) and held.all():
            return self._decoded(self.held.texels(images, places), images % len(self.lights))
        found = np.empty((*places.shape, self.basis.size), dtype=np.float32)
        if held.any():
            found[held] = self.texels(images[held], places[held])
        rest = np.flatnonzero(~held)
        for key, run in self._runs(images[rest]):
            here = rest[run]
            if key in self._kept:
                found[here] = self._kept[key].reshape(-1, self.basis.size)[places[here]]
            elif self._made[key]:
                mixed = np.zeros((len(here), *found.shape[1:]))
                for (view, light), part in self._around(*key):
                    same = np.full(len(here), view * len(self.lights) + light)
                    mixed += part * self.texels(same, places[here])
                found[here] = mixed
            else:
                codes = self._codes(*key)
                self.held.offer(int(images[here[0]]), codes)
                some = [band.reshape(-1, band.shape[2])[places[here]] for band in codes]
                found[here] = self._decoded(some, key[1])
        return found

    @cached_property
    def reading_order(self) -> Int[np.ndarray, " n"]:
        """Order of the files' bytes; see `BtfImages.reading_order`."""
        return np.argsort(np.argsort(self.index[..., 0].ravel(), kind="stable"))

    @cached_property
    def held(self) -> HeldCodes:
        """Cache of undecoded images whose texels are read repeatedly."""
        return HeldCodes(len(self.views) * len(self.lights))

    def _read(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        return self._decoded(self._codes(view, light), light)

    def _codes(self, view: int, light: int) -> list[Shaped[np.ndarray, "H W C"]]:
        """Read the stored values of an image, one array for each file if there is one per wavelength."""
        numbers, found, file = self.index[view, light].tolist(), [], self.data.file
        for band, number in enumerate(numbers):
            file = self.data.file / self.name(view, light, band)
            data = np.asarray(self.data.read(slice(int(self.starts[number]), int(self.starts[number + 1])))).tobytes()
            one = self.coding.codes(data, file, grey=len(numbers) > 1)
            if one.shape[:2] != (self.height, self.width):
                size, expected = size_words(*one.shape[:2]), size_words(self.height, self.width)
                raise OtherSizeError("an image of another size", file=file, found=size, expected=expected)
            found.append(one)
        # Grey stands for every colour; of wavelengths, there are as many as of the other images.
        channels, expected = found[0].shape[2], self.basis.size
        if len(found) == 1 and channels != expected and not (channels == 1 and expected == 3):
            words = f"{expected} channels"
            raise InputError("channels unlike those of the other images", file=file, found=channels, expected=words)
        return found

    def _decoded(
        self, codes: list[Shaped[np.ndarray, "n k C"]], light: int | Int[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n k J"]:
        """Decode texels under one light, or each row under its own."""
        cosine, grey = self.lights.directions[light, 2, None, None], len(codes) > 1
        planes = []
        for number, band in enumerate(codes):
            coding = self.coding.band(number) if grey else self.coding
            planes.append(coding.reflectance(band, cosine, grey))
        return planes[0] if len(planes) == 1 else np.concatenate(planes, axis=-1)

    def name(self, view: int, light: int, band: int = 0) -> str:
        """Return the name of an image's file in its folder, or its directions if the files were copied."""
        names: tuple[str, ...] = getattr(self.data, "names", ())
        number = int(self.index[view, light, band])
        return names[number] if 0 <= number < len(names) else self.words(view, light)

    def words(self, view: int, light: int) -> str:
        """Return the directions of an image, in degrees, written as in file names."""
        lights, views = self._words
        return f"{lights[light]} {views[view]}"

    @cached_property
    def _words(self) -> list[list[str]]:
        """Directions of lights and of views, written as in file names."""
        both = (("tl{:03.4g} pl{:03.4g}", self.lights), ("tv{:03.4g} pv{:03.4g}", self.views))
        return [[words.format(*_degrees(one)) for one in around.directions] for words, around in both]

    def _around(self, view: int, light: int) -> list[tuple[tuple[int, int], float]]:
        """Return the images that a missing one is interpolated from, with their weights.

        They are those of the lights around it in the same view or, if that view has none, of the views around it under
        the same light.
        """
        here = np.asarray((self.index >= 0).all(axis=2))
        if here[view].any():
            some = np.flatnonzero(here[view])
            around = Hemisphere(self.lights.directions[some])
            index, share = around.shares(self.lights.directions[light][None], falling=True)
            pairs = [(view, int(one)) for one in some[index[0]]]
        else:
            some = np.flatnonzero(here[:, light])
            if not len(some):
                raise InputError("an image without any neighbour", field=f"view {view}, light {light}")
            index, share = Hemisphere(self.views.directions[some]).shares(self.views.directions[view][None])
            pairs = [(int(one), light) for one in some[index[0]]]
        return [(pair, part) for pair, part in zip(pairs, share[0].tolist(), strict=True) if part]

    def _filled(self, view: int, light: int) -> Float[np.ndarray, "H W J"]:
        found = np.zeros((self.height, self.width, self.basis.size))
        for pair, part in self._around(view, light):
            found += part * self.image(*pair)
        return found.astype(np.float32)

    def with_offset(self, offset: float) -> BtfFiles:
        """Return the same images, registered by another plane."""
        return replace(self, offset=offset)


def _degrees(direction: Float[np.ndarray, "3"]) -> tuple[float, float]:
    """Convert a unit vector to theta and phi, degrees."""
    theta = np.degrees(np.arctan2(np.hypot(direction[0], direction[1]), direction[2]))
    phi = np.degrees(np.arctan2(direction[1], direction[0])) if theta > 1e-6 else 0.0
    return round(float(theta), 4), round(float(phi) % 360.0, 4) % 360.0


def size_words(height: int, width: int) -> str:
    """Format the size of an image for messages."""
    return f"{width} x {height} texels"
