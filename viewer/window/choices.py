"""Choices of a window: names offered by commands for a scene, catalogue and display."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ...lighting.environment.booth import LAMPS
from ...lighting.scene import Scene
from ...spectral.observers import OBSERVERS
from .checks import Vector
from .state import Session, Subject
from .viewpoint import Viewpoint

#: Default lights on the keys 1 to 9, unless the scene's review names others; None is the scene's own.
LIGHTS: tuple[str | None, ...] = (None, "D65", "A", "FL11", "FL2", "D50", "E", "LED-B3", "HP1")


@dataclass(frozen=True)
class Choices:
    """Names in the order of commands.

    lights : on keys; None is the scene's own. booths, observers. materials : of the shown part. parts, cameras : of the
    scene. low, high : corners of its bounding box. part : default part for materials. shapes : replacements of it.
    views : of each display, by name. reference_illuminance_lux : of the scene.
    """

    lights: tuple[str | None, ...] = LIGHTS
    booths: tuple[str, ...] = tuple(LAMPS)
    observers: tuple[str, ...] = tuple(OBSERVERS)
    materials: tuple[str, ...] = ()
    parts: tuple[str, ...] = ("part",)
    part: str = "part"
    worn: Mapping[str, str] = field(default_factory=dict)
    cameras: tuple[Viewpoint, ...] = (Viewpoint(),)
    low: Vector = (-1.0, -1.0, -1.0)
    high: Vector = (1.0, 1.0, 1.0)
    shapes: tuple[str, ...] = ("sphere", "speed_shape", "cloth", "plane")
    views: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    reference_illuminance_lux: float = 1000.0

    @classmethod
    def of(
        cls,
        scene: Scene,
        materials: Iterable[str] = (),
        views: Mapping[str, Sequence[str]] | None = None,
        lights: Iterable[str] = (),
    ) -> Choices:
        """Collect the choices of a scene; `lights` come after the scene's own and those of its review, before the
        default ones.
        """
        reviewed = scene.review.illuminants if scene.review else ()
        low, high = scene.bounds
        return cls(
            lights=tuple(dict.fromkeys((None, *reviewed, *lights, *LIGHTS)))[:9],
            materials=tuple(materials),
            parts=tuple(part.name for part in scene.parts),
            part=scene.reviewed_part,
            worn={part.name: part.material for part in scene.parts},
            cameras=tuple(Viewpoint.of(camera) for camera in scene.cameras),
            low=_corner(low),
            high=_corner(high),
            reference_illuminance_lux=float(scene.viewing.reference_illuminance_lux),
            views={display: tuple(each) for display, each in (views or {}).items()},
        )

    def shown_part(self, session: Session) -> str:
        """Return the part that materials are shown on."""
        return session.part or self.part

    def material(self, session: Session) -> str:
        """Return the material of the shown part on side A."""
        part = self.shown_part(session)
        return session.material_of(part) or self.worn.get(part, "")


def opened(scene: Scene, subject: Subject, catalogue: str | None = None, **settings: Any) -> Session:
    """Return a window's initial session: the scene's first camera, observer and display."""
    short = next((short for short, key in OBSERVERS.items() if key == scene.observer.name), "1931_2")
    begun: dict[str, Any] = {
        "subject": subject,
        "catalogue": catalogue,
        "view": Viewpoint.of(scene.camera()),
        "samples": scene.camera().samples,
        "observer": short,
        "bounces": scene.bounces != 0,
    }
    session = Session(**(begun | settings))
    if subject.materials:
        session = session.wearing(session.part or scene.reviewed_part, subject.materials[0])
    return session


def _corner(values: Any) -> Vector:
    x, y, z = (float(one) for one in values)
    return x, y, z
