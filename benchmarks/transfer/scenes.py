"""Scenes whose parts colour one another: some on a table, a box of saturated colours, the inside of a car."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...lighting.camera import Camera
from ...lighting.environment.booth import light_booth
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.environment.latlong import texel_directions
from ...lighting.mesh.files import load_mesh
from ...lighting.mesh.mesh import Mesh
from ...lighting.mesh.shapes import sphere
from ...lighting.scene import Part, Scene
from ...lighting.vectors import Number
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM
from ..papers.transfer_tensors.families import Family, cook_torrance
from ..papers.transfer_tensors.parametric import Tuned

#: Pixels along a side of a picture, each of one sample in its middle.
SIDE = 48
# Texels of a generated sky.
_SKY = (32, 64)


@dataclass(frozen=True, eq=False)
class TransferScene:
    """A scene under one light from all around, of which every part is a region of its own.

    materials : by material id, as many as parts; of one family. longest_edge : between sites, in radii of the scene,
    with which there are 10,500 to 14,000 of them, as in the paper's smallest scenes.
    """

    name: str
    light: str
    scene: Scene
    materials: dict[str, Tuned]
    longest_edge: float


@cache
def family() -> Family:
    """Return the family that all materials are of."""
    return cook_torrance()


def scenes(full: bool, data: Path | None = None) -> list[TransferScene]:
    """Make the scenes of a quick or a full run; with `data`, one with a measured mesh too."""
    made: list[tuple[str, Callable[[], tuple[list[tuple[Mesh, Tuned]], Camera]], float]] = [("table", _table, 0.042)]
    if full:
        made += [("box", _box, 0.048), ("car", _car, 0.07)]
        if data is not None and (data / "meshes" / "spot.obj").is_file():
            made.append(("spot", lambda: _spot(data / "meshes" / "spot.obj"), 0.045))
    found = []
    for name, make, longest_edge in made:
        parts, camera = make()
        lights = (("sky", low_sun_sky()), ("two-lamps", _two_lamps()), ("booth", _booth()))
        for light, lamp in lights if full else lights[:1]:
            named = [Part(f"{name}-{number}", mesh, f"{name}-{number}") for number, (mesh, _) in enumerate(parts)]
            scene = Scene(tuple(named), (lamp,), (camera,), observer("1931_2"))
            materials = {part.material: tuned for part, (_, tuned) in zip(named, parts, strict=True)}
            found.append(TransferScene(name, light, scene, materials, longest_edge))
    return found


def ramp(*stops: float) -> Float[np.ndarray, " L"]:
    """Return a reflectance from violet to red, smooth between so many values."""
    return np.interp(NM, np.linspace(400.0, 700.0, len(stops)), stops)


_NONE, _GREY = np.zeros(len(NM)), np.full(len(NM), 0.5)
_RED = ramp(0.05, 0.04, 0.05, 0.08, 0.6, 0.75, 0.78)
_GREEN = ramp(0.05, 0.08, 0.35, 0.55, 0.2, 0.08, 0.08)
_BLUE = ramp(0.45, 0.55, 0.35, 0.1, 0.05, 0.05, 0.06)
_BEIGE, _NAVY = ramp(0.35, 0.45, 0.55, 0.6, 0.65), ramp(0.12, 0.1, 0.06, 0.04, 0.05)
_GOLD = ramp(0.35, 0.38, 0.5, 0.8, 0.9, 0.93, 0.95)


def matt(colour: Float[np.ndarray, " L"]) -> Tuned:
    """Without a highlight."""
    return Tuned(NM, colour, _NONE, family(), (0.04, 0.3))


def gloss(colour: Float[np.ndarray, " L"], roughness: float = 0.2) -> Tuned:
    """Below a clear coat."""
    return Tuned(NM, colour, np.ones(len(NM)), family(), (0.04, roughness))


def _metal(colour: Float[np.ndarray, " L"], roughness: float = 0.25) -> Tuned:
    return Tuned(NM, _NONE, colour, family(), (0.95, roughness))


def _quad(*corners: Sequence[Number]) -> Mesh:
    """Four corners, counter-clockwise as seen from its front."""
    at = np.array(corners, dtype=float)
    normal = np.cross(at[1] - at[0], at[3] - at[0])
    return Mesh(at, np.tile(normal / np.linalg.norm(normal), (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))


def _block(centre: Sequence[Number], size: Sequence[Number], turn_deg: Number = 0.0) -> Mesh:
    """Return a box, turned about the vertical."""
    import trimesh

    box = trimesh.creation.box(size)
    corners, normals = box.vertices[box.faces].reshape(-1, 3), np.repeat(box.face_normals, 3, axis=0)
    cosine, sine = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    return Mesh(corners @ turn.T + centre, normals @ turn.T, np.arange(len(corners)).reshape(-1, 3))


def _ball(centre: Sequence[Number], radius: Number) -> Mesh:
    ball = sphere(3)
    return Mesh(ball.vertices * radius + centre, ball.normals, ball.faces)


def _ring(centre: Sequence[Number], radius: Number, thick: Number, upright: bool = False) -> Mesh:
    import trimesh

    ring = trimesh.creation.torus(radius, thick, major_sections=24, minor_sections=10)
    # Lying on the ground, or facing the viewer.
    order = (0, 1, 2) if upright else (0, 2, 1)
    faces = ring.faces if upright else ring.faces[:, ::-1]
    return Mesh(ring.vertices[:, order] + centre, ring.vertex_normals[:, order], faces)


def _table() -> tuple[list[tuple[Mesh, Tuned]], Camera]:
    """Return a grey table, a red wall, a ball of blue gloss, a golden ring and a green block."""
    parts = [
        (_quad((-1.2, 0, 1.2), (1.2, 0, 1.2), (1.2, 0, -1.2), (-1.2, 0, -1.2)), matt(_GREY)),
        (_quad((-1.2, 0, -1.2), (1.2, 0, -1.2), (1.2, 1.2, -1.2), (-1.2, 1.2, -1.2)), matt(_RED)),
        (_ball((-0.45, 0.36, -0.35), 0.35), gloss(_BLUE)),
        (_ring((0.45, 0.115, 0.35), 0.3, 0.11), _metal(_GOLD)),
        (_block((0.5, 0.301, -0.55), (0.5, 0.6, 0.5), 30.0), matt(_GREEN)),
    ]
    return parts, _camera((0.8, 1.7, 3.2), (0.0, 0.3, 0.0), 38.0)


def _box() -> tuple[list[tuple[Mesh, Tuned]], Camera]:
    """Five sides of saturated colours, open above, with two blocks."""
    a, b, c, d = (-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)
    e, f, g, h = (-1, 1.2, 1), (1, 1.2, 1), (1, 1.2, -1), (-1, 1.2, -1)
    parts = [
        (_quad(a, b, c, d), matt(np.full(len(NM), 0.75))),
        (_quad(d, c, g, h), matt(_GREEN)),
        (_quad(a, d, h, e), matt(_RED)),
        (_quad(c, b, f, g), matt(_BLUE)),
        (_block((-0.4, 0.35, -0.3), (0.5, 0.7, 0.5), 20.0), gloss(_GREY)),
        (_block((0.45, 0.2, 0.3), (0.4, 0.4, 0.4), -25.0), matt(_BEIGE)),
    ]
    return parts, _camera((0.0, 1.9, 3.6), (0.0, 0.4, 0.0), 38.0)


def _car() -> tuple[list[tuple[Mesh, Tuned]], Camera]:
    """Return a car's inside, seen from behind: floor, roof, doors, dashboard, console, seats, trim and a wheel."""
    carpet, roof, leather = matt(_NAVY), matt(_BEIGE), gloss(ramp(0.08, 0.07, 0.1, 0.3, 0.45), 0.35)
    trim = _metal(np.full(len(NM), 0.7), 0.15)
    parts = [
        (_block((0, -0.03, 0), (1.5, 0.06, 2.4)), carpet),
        (_block((0, 1.23, 0.1), (1.4, 0.06, 1.6)), roof),
        (_block((-0.75, 0.35, 0), (0.06, 0.7, 2.2)), matt(_BEIGE)),
        (_block((0.75, 0.35, 0), (0.06, 0.7, 2.2)), matt(_BEIGE)),
        (_block((0, 0.6, -0.95), (1.44, 0.35, 0.4)), gloss(_NAVY, 0.4)),
        (_block((0, 0.2, 0.05), (0.24, 0.4, 1.0)), gloss(ramp(0.05, 0.05, 0.05), 0.15)),
        (_block((-0.4, 0.22, 0.15), (0.46, 0.18, 0.5)), leather),
        (_block((-0.4, 0.6, 0.44), (0.46, 0.6, 0.12)), leather),
        (_block((0.4, 0.22, 0.15), (0.46, 0.18, 0.5)), leather),
        (_block((0.4, 0.6, 0.44), (0.46, 0.6, 0.12)), leather),
        (_block((-0.71, 0.55, 0), (0.02, 0.05, 2.0)), trim),
        (_block((0.71, 0.55, 0), (0.02, 0.05, 2.0)), trim),
        (_block((0, 0.68, -0.745), (1.2, 0.04, 0.012)), trim),
        (_ring((-0.4, 0.68, -0.58), 0.17, 0.02, upright=True), gloss(ramp(0.05, 0.05, 0.05), 0.3)),
    ]
    return parts, _camera((0.25, 1.0, 1.7), (0.0, 0.5, -0.5), 55.0)


def _spot(path: Path) -> tuple[list[tuple[Mesh, Tuned]], Camera]:
    """Return a measured mesh on a red floor before a green wall."""
    mesh = load_mesh(path)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    scale = 1.0 / float((high - low).max())
    middle = 0.5 * (low + high) * (1.0, 0.0, 1.0) + low * (0.0, 1.0, 0.0)
    body = Mesh((mesh.vertices - middle) * scale, mesh.normals, mesh.faces)
    parts = [
        (body, gloss(_GREY, 0.35)),
        (_quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)), matt(_RED)),
        (_quad((-1, 0, -1), (1, 0, -1), (1, 1.2, -1), (-1, 1.2, -1)), matt(_GREEN)),
    ]
    return parts, _camera((0.9, 1.0, 2.6), (0.0, 0.4, 0.0), 38.0)


def _camera(position: Sequence[Number], target: Sequence[Number], angle: Number) -> Camera:
    return Camera(
        position=tuple(position), target=tuple(target), vertical_fov_deg=angle, width=SIDE, height_px=SIDE, samples=1
    )


def low_sun_sky() -> EnvironmentLight:
    """Return a clear sky that is brighter about a low sun, and ground below."""
    to = texel_directions(*_SKY)
    sun = np.array([0.5, 0.6, 0.62]) / np.linalg.norm([0.5, 0.6, 0.62])
    field = np.where(to[..., 1] > 0.0, 1.0 + 0.5 * to[..., 1], 0.15) + 30.0 * np.exp(60.0 * (to @ sun - 1.0))
    return EnvironmentLight(field[None], (illuminant("D65"),), 1000.0, spectrum_name="D65")


def _booth() -> EnvironmentLight:
    """Return a panel overhead, grey walls and an open front."""
    return light_booth(spectrum=illuminant("D65"), spectrum_name="D65")


def _two_lamps() -> EnvironmentLight:
    """Daylight from the left, tungsten from the right, and little of both from everywhere."""
    to = texel_directions(*_SKY)
    fields = []
    for side in (-1.0, 1.0):
        at = np.array([0.8 * side, 0.5, 0.4]) / np.linalg.norm([0.8, 0.5, 0.4])
        fields.append(0.15 + 6.0 * np.exp(12.0 * (to @ at - 1.0)))
    return EnvironmentLight(np.stack(fields), (illuminant("D65"), illuminant("A")), 1000.0, spectrum_name="D65 and A")
