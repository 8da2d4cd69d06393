"""Background reading of probes under the pointer and at pins, with cached ray tracers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...lighting.camera import Camera
from ...lighting.scene import Scene
from ...runtime.errors import MetamerError
from ..gl.side import CanvasSide
from .background import Background
from .image_frame import ImageFrame
from .image_probe import image_reading
from .light_choice import LightChoice
from .picking import Picker
from .places import Pin
from .probe import Prober, ProbeReading
from .state import Session


@dataclass(frozen=True, eq=False)
class ProbedView:
    """Probed view: sides, the exact image's camera, the catalogue, and names of lights."""

    sides: tuple[CanvasSide, CanvasSide]
    camera: Camera
    catalogue: Any
    lights: tuple[str, str]


@dataclass(frozen=True, eq=False)
class Spot:
    """Result of a probe.

    pixel : position; None if not visible, with the reason in `why`. readings : of A and B, or one if they are equal.
    """

    name: str
    pixel: tuple[int, int] | None
    why: str = ""
    readings: tuple[ProbeReading, ...] = ()


class Probing:
    """Requests for readings, and their latest results.

    Attributes
    ----------
    cursor : reading where the pointer last rested. pins : last readings; `fresh` tells whether they are of the current
    view. problem : reason for missing readings.
    """

    def __init__(self) -> None:
        self._thread = Background()
        self._rays = _Rays()
        self._asked: dict[str, tuple] = {}
        self._read: dict[str, tuple] = {}
        self._pinned = 0
        self.cursor: Spot | None = None
        self.pins: tuple[Spot, ...] = ()
        self.problem: str | None = None

    def close(self) -> None:
        """Stop reading."""
        self._thread.close()

    @property
    def busy(self) -> bool:
        """True if a reading is in progress."""
        return self._thread.busy()

    def fresh(self, kind: str, view: ProbedView | None) -> bool:
        """Return whether the last reading of a kind ("cursor", "pins") is of this view and position.

        view : None for an image.
        """
        key = self._read.get(kind)
        return key is not None and key is self._asked.get(kind) and (view is None or key[0] is view)

    def at(self, view: ProbedView, pixel: tuple[int, int]) -> None:
        """Read the pixel under the pointer, unless already requested."""
        self._ask("cursor", (view, pixel), lambda: self._rays.spot(view, pixel))

    def at_image(self, frame: ImageFrame, session: Session, pixel: tuple[int, int]) -> None:
        """Read a pixel of a spectral image."""
        key = (session.light, session.observer, session.other, session.subject, pixel)
        self._ask("cursor", key, lambda: _image_spot(frame, session, pixel))

    def at_pins(self, view: ProbedView, pins: Sequence[Pin]) -> None:
        """Read the pins at their current positions in the image."""
        if not pins:
            self.pins = ()
        self._ask("pins", (view, *pins), lambda: tuple(self._rays.pinned(view, one) for one in pins))

    def pin(self, view: ProbedView, place: tuple[float, float], name: str) -> None:
        """Find the surface point at an image position, pixels; `poll` returns it."""
        # Each request is a separate kind, so that none replaces another.
        self._pinned += 1
        find = self._rays.picker
        self._thread.ask(f"pin {self._pinned}", lambda: find(view.sides[0].scene).pin(view.camera, *place, name))

    def poll(self) -> list[Pin | None]:
        """Collect finished readings; return points to be pinned, None for positions without a surface."""
        found: list[Pin | None] = []
        for heard in self._thread.poll():
            self.problem = heard.problem
            if heard.problem is not None:
                continue
            if heard.kind in ("cursor", "pins"):
                self._read[heard.kind], read = heard.result
                if heard.kind == "cursor":
                    self.cursor = read
                else:
                    self.pins = read
            else:
                found.append(heard.result)
        return found

    def _ask(self, kind: str, key: tuple, work: Any) -> None:
        before = self._asked.get(kind)
        if before is None or len(before) != len(key) or any(
            one is not other and one != other for one, other in zip(before, key, strict=True)
        ):  # fmt: skip
            self._asked[kind] = key
            self._thread.ask(kind, lambda: (key, work()))


class _Rays:
    """State of the background thread: probers of both sides, and ray pickers."""

    def __init__(self) -> None:
        self._probers: dict[int, Prober] = {}
        self._picker: Picker | None = None

    def spot(self, view: ProbedView, pixel: tuple[int, int], name: str = "cursor") -> Spot:
        # References and files have colours only.
        both = view.sides[0] is not view.sides[1] and view.sides[1].made == "fast"
        return Spot(name, pixel, "", tuple(self._reading(view, number, pixel) for number in range(1 + both)))

    def pinned(self, view: ProbedView, pin: Pin) -> Spot:
        try:
            sight = self.picker(view.sides[0].scene).sight(view.camera, pin)
        except MetamerError as reason:
            return Spot(pin.name, None, str(reason))
        return Spot(pin.name, None, sight.why) if sight.pixel is None else self.spot(view, sight.pixel, pin.name)

    def picker(self, scene: Scene) -> Picker:
        known = self._picker
        if known is None or [id(part.mesh) for part in known.scene.parts] != [id(part.mesh) for part in scene.parts]:
            known = self._picker = Picker(scene)
        return known

    def _reading(self, view: ProbedView, number: int, pixel: tuple[int, int]) -> ProbeReading:
        side = view.sides[number]
        scene = side.lit
        if number not in self._probers:
            self._probers[number] = Prober(scene, view.catalogue)
        prober = self._probers[number]
        if prober.scene is not scene:
            prober.turn_to(scene, view.catalogue)
        return dimmed(prober.at(view.camera, *pixel, light=view.lights[number]), side.dimming)


def dimmed(reading: ProbeReading, factor: float) -> ProbeReading:
    """Return a reading in dimmed light, relative to the same white."""
    if factor == 1.0:
        return reading
    spectra = reading.spectra
    if spectra is not None:
        spectra = replace(spectra, incident=factor * spectra.incident, reflected=factor * spectra.reflected)
    return replace(reading, xyz=factor * reading.xyz, spectra=spectra)


def _image_spot(frame: ImageFrame, session: Session, pixel: tuple[int, int]) -> Spot:
    other = session.other
    sides: list[tuple[LightChoice, str]] = [(session.light, session.observer)]
    if other.light is not None or other.observer is not None or other.file is not None:
        sides.append((other.light or session.light, other.observer or session.observer))
    return Spot("cursor", pixel, "", tuple(
        image_reading(frame, session, number, choice, who, pixel) for number, (choice, who) in enumerate(sides)
    ))  # fmt: skip
