"""Turntables: images from all around, and animations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...lighting.camera import Camera
from ...lighting.scene import Scene
from ...lighting.vectors import unit
from ...materials.catalogue.catalogue import Catalogue
from ...runtime.files import written_whole
from ..picture import Picture, bounced_words
from ..render.session import RenderSession

# Milliseconds per turn.
_TURN_MS = 6000


def turntable_cameras(camera: Camera, frames: int) -> tuple[Camera, ...]:
    """Return the camera at equal steps of a full turn about its target, anticlockwise seen from the tip of its `up`.

    >>> [one.position.astype(int).tolist() for one in turntable_cameras(Camera(position=(0, 1, 2)), 4)]
    [[0, 1, 2], [2, 1, 0], [0, 1, -2], [-2, 1, 0]]
    """
    target, axis = np.asarray(camera.target, dtype=np.float64), unit(np.asarray(camera.up, dtype=np.float64))
    off = np.asarray(camera.position, dtype=np.float64) - target
    along = (off @ axis) * axis
    across, side = off - along, np.cross(axis, off)
    angles = 2.0 * np.pi * np.arange(frames) / frames
    return tuple(
        replace(
            camera,
            name=f"{camera.name}, turned by {np.degrees(angle):g} degrees",
            position=target + along + np.cos(angle) * across + np.sin(angle) * side,
        )
        for angle in angles
    )


def turntable(
    scene: Scene, catalogue: Catalogue, camera: str | None, renderer: RenderSession, frames: int
) -> Iterator[Picture]:
    """Render the images of a full turn, the first as by `picture`; indirect light is computed once.

    Raises
    ------
    UnknownNameError : a material that is not in the catalogue, an unknown camera.
    InputError : see `RenderSession.render`.
    """
    surfaces = renderer.forms(catalogue, scene)
    for view in turntable_cameras(scene.camera(camera), frames):
        xyz, coverage = renderer.render(scene, view, surfaces)
        light = renderer.bounced
        yield Picture(
            scene, view, xyz, coverage, renderer.made_by + bounced_words(0 if light is None else light.bounces)
        )


def write_animated(output: Path, frames: Sequence[Path]) -> None:
    """Combine image files into an endlessly looping animation: lossless WebP."""
    from PIL import Image

    first, *rest = (Image.open(frame).convert("RGB") for frame in frames)
    with written_whole(output) as beside:
        first.save(
            beside,
            format="WEBP",
            save_all=True,
            append_images=rest,
            duration=_TURN_MS // len(frames),
            loop=0,
            lossless=True,
        )
