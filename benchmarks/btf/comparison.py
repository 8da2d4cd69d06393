"""One BTF by every method: alone, under light from all around, and from views that no fit saw."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ...materials.btf.hemisphere import Hemisphere
from ...materials.btf.images import HeldImages
from ...materials.btf.texels import BtfTexels
from .cases import BtfCase
from .environments import PlacedLight
from .held_out_views import HeldOut
from .methods import Made, Method
from .rows import btf_row, seen_error
from .speed import form_times
from .under_light import TERMS, Surround, all_placed, gather_form

#: Rows that need no codec: measured views between others, and light in two bases.
HELD, BALANCED, HARMONIC = "held-views", f"light-basis-{TERMS}", "light-basis-sh25"
#: All of it under light from all around: ours, and the paper's way.
END_TO_END, PAPER_END_TO_END = "end-to-end", "end-to-end-paper"


class Sky:
    """Every environment above BTFs of some lights, made for the first that asks."""

    def __init__(self, data: Path | None, progress: Callable[[str], None]) -> None:
        self._data, self._progress = data, progress
        self._made: list[tuple[Hemisphere, tuple[list[PlacedLight], int]]] = []

    def over(self, images: HeldImages) -> Surround:
        """Texels of a BTF in all of it."""
        for lights, made in self._made:
            if np.array_equal(lights.directions, images.lights.directions):
                return Surround.of(images, *made)
        self._progress("light from all around")
        self._made.append((images.lights, all_placed(images.lights, self._data)))
        return Surround.of(images, *self._made[-1][1])


@dataclass(frozen=True, eq=False)
class Compared:
    """Measurements of one case. wanted : says of the name of a row whether it is asked for."""

    case: BtfCase
    wanted: Callable[[str], bool]
    sky: Sky
    progress: Callable[[str], None]

    def rows(self, ways: list[Method]) -> Iterator[dict]:
        """First those that take images as they were measured, then those that are registered."""
        for registered in (False, True):
            some = [way for way in ways if way.registered == registered and any(map(self.wanted, rows_of(way)))]
            bare = registered and any(map(self.wanted, (HELD, BALANCED, HARMONIC)))
            if some or bare:
                self.progress(f"{self.case.name}{', registered' if registered else ''}")
                images = self.case.registered() if registered else self.case.measured()
                yield from _Half(self, images, registered).rows(some)


def rows_of(way: Method) -> list[str]:
    """Names of the rows that a method leads to."""
    found = [way.name]
    if way.name == "lpca":
        found.append(END_TO_END)
    if way.name == "lpca-paper":
        found.append(PAPER_END_TO_END)
    return found + ([f"held-{way.name}"] if way.held else [])


class _Half:
    """A case's images, registered or not."""

    def __init__(self, compared: Compared, images: HeldImages, registered: bool) -> None:
        self._case, self._wanted, self._progress = compared.case.name, compared.wanted, compared.progress
        self._offset = compared.case.offset
        self._sky, self._images, self._registered = compared.sky, images, registered

    @cached_property
    def _surround(self) -> Surround:
        return self._sky.over(self._images)

    @cached_property
    def _held_out(self) -> HeldOut | None:
        return HeldOut.of(self._images)

    def rows(self, ways: list[Method]) -> Iterator[dict]:
        if self._registered:
            yield from self._without_codec()
        for way in ways:
            self._progress(f"{self._case}, {way.name}{f' ({way.size})' if way.size else ''}")
            if any(map(self._wanted, (way.name, END_TO_END, PAPER_END_TO_END))):
                yield from self._of(way)
            if way.held and self._wanted(f"held-{way.name}") and self._held_out is not None:
                made = way.make(self._held_out.fitted)
                found, epsilon = self._held_out.error(made.reconstruct)
                yield self._row(f"held-{way.name}", "D65", found, made, epsilon=epsilon, size=way.size)

    def _without_codec(self) -> Iterator[dict]:
        if self._wanted(HELD) and self._held_out is not None:
            found, epsilon = self._held_out.error(self._held_out.fitted.image)
            yield self._row(HELD, "D65", found, epsilon=epsilon)
        for name in (BALANCED, HARMONIC):
            if self._wanted(name):
                weights = self._surround.balanced() if name == BALANCED else self._surround.harmonic()
                yield self._row(name, self._surround.light, self._surround.error(weights))

    def _of(self, way: Method) -> Iterator[dict]:
        images = self._images
        made = way.make(images)
        if self._wanted(way.name):
            found, epsilon = seen_error(images, made.reconstruct)
            fold, pixels = form_times(
                made.form, images.height * images.width, images.views, images.lights, images.basis
            )
            times = {"fold_ms": fold, "ms_per_megapixel": pixels}
            yield self._row(way.name, "D65", found, made, epsilon=epsilon, size=way.size, **times)
        form = made.form
        for name in (END_TO_END, PAPER_END_TO_END):
            if name in rows_of(way) and self._wanted(name) and isinstance(form, BtfTexels):
                weights = gather_form(form) if name == END_TO_END else self._surround.harmonic()
                values = self._surround.decoded(form)
                light, found = self._surround.light, self._surround.error(weights, values, form.form.basis)
                yield self._row(name, light, found, made, size=way.size)

    def _row(self, name: str, light: str, found: tuple[float, float, float], made: Made | None = None, **more) -> dict:
        texels = self._images.height * self._images.width
        if made is not None:
            more |= {"bytes_per_texel": made.bytes_per_texel, "fit_cpu_seconds": made.fit_cpu_seconds}
        offset = self._offset() if self._registered else None
        return btf_row(self._case, name, light, texels, found, registered=self._registered, offset=offset, **more)
