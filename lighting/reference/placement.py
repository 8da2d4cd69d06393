"""Diagnosis of cameras and lights whose image is black or empty.

A body contains a point if its winding number there is a non-zero integer (Jacobson et al. 2013). That holds only for
closed meshes, of either orientation; an open sheet, or a room with a window, has a fractional number and no inside.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ..camera import Camera
from ..mesh.mesh import Mesh
from ..scene import Scene
from ..vectors import dot
from .geometry import Tracer, VisibleGeometry, visible_geometry

# Largest solid angle of holes, as a share of the sphere, in a closed body, since scanned and exported meshes have
# cracks.
CRACK = 1e-3
# Distance, in radii of the scene, below which a light is on a surface: renderers resolve nothing nearer, and it lights
# only a spot.
ON_SURFACE = 1e-3
# Share of lit visible points that is attributed to rounding at outlines, or negligible.
SPECKS = 1e-3
# Number of rays for the diagnosis of a black image.
_ENOUGH = 250_000
# Samples, and directions at each, for testing whether area and environment lights reach an image.
_FEW_SAMPLES, _FEW_DIRECTIONS = 4096, 16
# Triangles per block.
_BLOCK = 200_000


def placement_warnings(scene: Scene, camera: Camera | None = None) -> tuple[str, ...]:
    """Return a warning for a camera inside a body without a light, and for each point light inside a body or on a
    surface.

    Surfaces are opaque, so that a closed body is dark inside without a light. A camera and a light in one body are a
    room, which is fine. The cost is zero unless something is in a part's bounding box, and else some tens of
    nanoseconds per triangle of that part.
    """
    camera = scene.camera() if camera is None else camera
    near = ON_SURFACE * 0.5 * float(np.linalg.norm(np.subtract(*scene.bounds)))
    lamps = [(light.name, light.place) for light in scene.lights if light.place is not None]
    around_camera = _bodies(scene, camera.position)
    around = [_bodies(scene, place) for _, place in lamps]
    warnings: list[str] = []
    dark = [part for part in around_camera if not any(part in bodies for bodies in around)]
    if dark:
        warnings.append(
            f'camera "{camera.name}" stands inside {_named("part", dark)}, and no light does: it sees nothing but dark '
            "walls; move the camera out, or put a light in"
        )
    for (name, place), bodies in zip(lamps, around, strict=True):
        touched = [part.name for part in scene.parts if _touches(part.mesh, place, near)]
        shut = [part for part in bodies if part not in touched and part not in around_camera]
        if touched:
            warnings.append(
                f'light "{name}" stands on the surface of {_named("part", touched)}, less than {near:.2g} away: '
                "of that surface it lights a spot or nothing; move the light off it"
            )
        if shut:
            warnings.append(
                f'light "{name}" stands inside {_named("part", shut)}: it lights nothing that camera '
                f'"{camera.name}" sees; move the light out'
            )
    return tuple(warnings)


def looks_past(scene: Scene, camera: Camera) -> str:
    """Return the warning for an image without any surface."""
    low, high = scene.bounds
    to_middle = 0.5 * (low + high) - camera.position
    distance = float(np.linalg.norm(to_middle))
    parts = _named("part", [part.name for part in scene.parts])
    where = ""
    if distance > 0.0:
        cosine = -float(camera.axes[2] @ to_middle) / distance
        where = (
            f"it looks {np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))):.0f} degrees past the middle of the scene; "
        )
    return f'camera "{camera.name}" sees nothing: {where}no surface of {parts} lies in its view'


def why_black(scene: Scene, camera: Camera | None = None, geometry: VisibleGeometry | None = None) -> tuple[str, ...]:
    """Return a warning if no light reaches the surfaces that a camera sees; () otherwise, or without visible surfaces.

    geometry : result of `visible_geometry` for this camera; without it up to some 250,000 rays are traced.
    """
    camera = scene.camera() if camera is None else camera
    seen = visible_geometry(scene, _coarser(camera)) if geometry is None else geometry
    lit = np.zeros(len(seen.pixel), dtype=bool)
    for reached in seen.lit:
        lit[reached.sample] = True
    if not lit.size or lit.mean() >= SPECKS or _spread_light_reaches(scene, seen):
        return ()
    parts = _named("part", [scene.parts[number].name for number in np.unique(seen.part)])
    lights = _named("light", [light.name for light in scene.lights])
    none = "lights nothing" if len(scene.lights) == 1 else "light nothing"
    return (
        f'the picture of camera "{camera.name}" is black: of {parts}, all that it sees, {lights} {none}: '
        "behind every surface in view, or hidden from it",
    )


def _spread_light_reaches(scene: Scene, seen: VisibleGeometry) -> bool:
    """Return whether area or environment lights reach visible surfaces, tested by a few directions at a few thousand
    samples.
    """
    if not scene.spread_lights or seen.frame is None or seen.geometric is None:
        return False
    some = np.unique(np.linspace(0, len(seen.pixel) - 1, _FEW_SAMPLES).astype(np.int64))
    sample = np.repeat(some, _FEW_DIRECTIONS)
    tracer, rng = Tracer(scene), np.random.default_rng(0)
    position, geometric, shading = seen.position[sample], seen.geometric[sample], seen.frame[sample, 2]
    lit = np.zeros(len(sample), dtype=bool)
    for light in scene.spread_lights:
        towards, _ = light.drawn(position, rng.random((len(sample), 2)))
        towards = np.ascontiguousarray(towards)
        above = (dot(geometric, towards) > 0.0) & (dot(shading, towards) > 0.0)
        start = tracer.lifted(position, geometric)
        free = tracer.free(start, towards, light.distance(start, towards))
        lit |= above & free & (light.luminance(position, towards) > 0.0).any(axis=1)
    return bool(lit.reshape(-1, _FEW_DIRECTIONS).any(axis=1).mean() >= SPECKS)


def winding_number(mesh: Mesh, point: Float[np.ndarray, "3"]) -> float:
    """Compute the winding number of a mesh about a point: 1 inside a closed body that faces outwards.

    The sum of the signed solid angles of its triangles (Van Oosterom and Strackee 1983, eq. 8) over 4 pi.
    """
    total = 0.0
    for start in range(0, len(mesh.faces), _BLOCK):
        a, b, c = (mesh.vertices[mesh.faces[start : start + _BLOCK, k]] - point for k in range(3))
        far_a, far_b, far_c = (np.sqrt(np.einsum("ni,ni->n", side, side)) for side in (a, b, c))
        triple = np.einsum("ni,ni->n", a, np.cross(b, c))
        below = far_a * far_b * far_c + np.einsum("ni,ni->n", a, b) * far_c
        below += np.einsum("ni,ni->n", b, c) * far_a + np.einsum("ni,ni->n", c, a) * far_b
        total += 2.0 * float(np.arctan2(triple, below).sum())
    return total / (4.0 * np.pi)


def _bodies(scene: Scene, point: np.ndarray) -> list[str]:
    """Return the names of closed parts that contain a point."""
    found = []
    for part in scene.parts:
        low, high = part.mesh.bounds
        if ((point > low) & (point < high)).all():
            turns = winding_number(part.mesh, point)
            if round(turns) and abs(turns - round(turns)) < CRACK:
                found.append(part.name)
    return found


def _touches(mesh: Mesh, point: np.ndarray, distance: float) -> bool:
    """Return whether a mesh is within `distance` of a point."""
    low, high = mesh.bounds
    if ((point < low - distance) | (point > high + distance)).any():
        return False
    from trimesh.triangles import closest_point

    for start in range(0, len(mesh.faces), _BLOCK):
        corners = mesh.vertices[mesh.faces[start : start + _BLOCK]]
        near = ((corners.min(axis=1) <= point + distance) & (corners.max(axis=1) >= point - distance)).all(axis=1)
        if near.any():
            nearest = closest_point(corners[near], np.broadcast_to(point, (int(near.sum()), 3)))
            if np.linalg.norm(nearest - point, axis=1).min() <= distance:
                return True
    return False


def _coarser(camera: Camera) -> Camera:
    """Return the same view with a limited number of sample points."""
    pixels = camera.width * camera.height_px
    # A crop cannot be resampled: fewer pixels would be a smaller crop.
    if camera.part_of is not None or pixels * camera.samples**2 <= _ENOUGH:
        return camera
    share = min(1.0, np.sqrt(_ENOUGH / pixels))
    size = {"width": max(1, int(camera.width * share)), "height_px": max(1, int(camera.height_px * share))}
    return replace(camera, **size, samples=1)


def _named(kind: str, names: list[str], most: int = 4) -> str:
    """List names of one kind in quotes, at most the first `most`."""
    shown = ", ".join(f'"{name}"' for name in names[:most])
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{kind}{'s' if len(names) > 1 else ''} {shown}{more}"
