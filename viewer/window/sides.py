"""Sides of a comparison from a session's names: scenes, surfaces and spectra, each made once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ...calibration.regression.row import Pixels
from ...lighting.environment.booth import light_booth
from ...lighting.environment.environment import EnvironmentLight, mixture
from ...lighting.environment.map_light import load_environment
from ...lighting.mesh import shapes
from ...lighting.mesh.files import load_mesh
from ...lighting.mesh.mesh import Mesh
from ...lighting.scene import Scene
from ...lighting.scene_file.keys import SHAPES
from ...lighting.scene_file.lamps import lamp
from ...materials.catalogue.catalogue import Catalogue
from ...materials.catalogue.material import Material
from ...materials.core.fast import Fast
from ...materials.search.edited_material import VariedCatalogue
from ...runtime.errors import InputError
from ...spectral.illuminants import illuminant
from ...spectral.observers import OBSERVERS, observer
from ...spectral.spectrum import Spectrum
from ..gl.side import CanvasSide
from .edited_materials import Fitting, Values
from .light_choice import LightChoice
from .rotated_lights import turned_lights
from .simplification import is_closed, simplified_scene
from .state import Session
from .stills import read_still

#: Limit of triangles during motion: at a third of the pixels a speed shape of that size is within ΔE94 0.08 (p95) of
#: the exact image, and with a quarter of them within 0.27, in four fifths of the time.
MOVING_TRIANGLES = 96_000
Made = TypeVar("Made")


class _Kept(dict):
    """LRU cache of a few objects."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self.most = most

    def get_or(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """Return the cached object, or make it."""
        found = self.pop(key) if key in self else make()
        while len(self) >= self.most:
            self.pop(next(iter(self)))
        self[key] = found
        return found


class _Fewer(NamedTuple):
    """A scene's meshes, kept alive, their simplified versions, and those never seen from behind."""

    of: tuple[Mesh, ...]
    meshes: tuple[Mesh, ...]
    one_sided: frozenset[int]


@dataclass(frozen=True)
class _Asked:
    """Names that define a side; equal for equal sides."""

    light: LightChoice
    who: str
    worn: tuple[tuple[str, str], ...]
    edits: tuple[tuple[str, Values], ...]
    part: str
    shape: str | None
    catalogue: str | None
    bounces: bool
    influence: str | None


class SessionObjects:
    """Objects named by a session, cached so that equal names give the same object, since renderers compare by identity.

    catalogue : a `Catalogue`, or any object with its `ids()`, `surface(id)` and, for edits, `load(id)`.
    waits : fit edited materials synchronously instead of in the background.
    """

    def __init__(self, scene: Scene, catalogue: Any, waits: bool = False) -> None:
        self.scene, self.catalogue = scene, catalogue
        self._catalogues: dict[str | None, Any] = {None: catalogue}
        self._fits: dict[str | None, Fitting] = {}
        self._waits = waits
        # A BTF may take hundreds of megabytes, a prefiltered map 20.
        self._surfaces, self._scenes, self._sides = _Kept(64), _Kept(32), _Kept(32)
        self._spectra, self._around, self._meshes = _Kept(64), _Kept(4), _Kept(8)
        # Simplified meshes by the identities of a scene's own, which are kept alive with them.
        self._fewer, self._stills = _Kept(4), _Kept(4)
        self._edited: dict[str, Material] = {}

    def close(self) -> None:
        """Stop fitting."""
        for one in self._fits.values():
            one.close()

    @property
    def pending(self) -> bool:
        """True if an edited material is being fitted; sides show its replacement meanwhile."""
        return any(one.pending for one in self._fits.values())

    def arrived(self) -> bool:
        """Return whether a fit has finished since the last call, so that `sides` has changed."""
        arrived = [one.arrived() for one in self._fits.values()]
        return any(arrived)

    @property
    def seen_catalogue(self) -> Any:
        """The catalogue with fitted edited materials."""
        mine = isinstance(self.catalogue, Catalogue) and self._edited
        return VariedCatalogue.of(self.catalogue, self._edited.values()) if mine else self.catalogue

    def sides(self, session: Session) -> tuple[CanvasSide, CanvasSide]:
        """Return A and B, one object if they are equal.

        Raises
        ------
        InputError, UnknownNameError : an unknown material, part or lamp, a missing file; a side that cannot be drawn.
        """
        for words in _left_out(session):
            raise InputError(f"a scene is not shown as {words}", field="session", expected="a scene or materials")
        other = session.other
        part = session.part or self.scene.reviewed_part
        worn = {one.part: one.material for one in session.worn}
        also = worn if other.material is None else worn | {part: other.material}
        first = self._side(session, session.light, session.observer, worn, None)
        second = self._side(
            session, other.light or session.light, other.observer or session.observer, also, other.catalogue
        )
        if other.made == "fast":
            return first, second
        still = None if other.file is None else self._still(session, other.file, second)
        key = second, other.made, id(still)
        return first, self._sides.get_or(key, lambda: replace(second, made=other.made, still=still))

    @property
    def one_sided(self) -> frozenset[int]:
        """Simplified meshes, by identity, that are never seen from behind."""
        return frozenset().union(*(one.one_sided for one in self._fewer.values()))

    def moving(self, side: CanvasSide) -> CanvasSide:
        """Return a simplified side; itself if that would need expensive work, as under area or environment lights."""
        if side.scene.spread_lights or side.scene.bounces != 0:
            return side
        meshes = tuple(part.mesh for part in side.scene.parts)

        def made() -> _Fewer:
            fewer = tuple(part.mesh for part in simplified_scene(side.scene, MOVING_TRIANGLES).parts)
            pairs = zip(meshes, fewer, strict=True)
            return _Fewer(meshes, fewer, frozenset(id(few) for mesh, few in pairs if is_closed(mesh)))

        fewer = self._fewer.get_or(tuple(map(id, meshes)), made).meshes
        parts = tuple(replace(part, mesh=mesh) for part, mesh in zip(side.scene.parts, fewer, strict=True))
        return replace(side, scene=replace(side.scene, parts=parts))

    def _side(
        self, session: Session, light: LightChoice, who: str, worn: Mapping[str, str], catalogue: str | None
    ) -> CanvasSide:
        edits: dict[str, list[tuple[str, float]]] = {}
        for one in session.edits:
            # Fitted materials are named by their values with six digits, so rounded values are used.
            edits.setdefault(one.material, []).append((one.parameter, float(f"{one.value:g}")))
        asked = _Asked(
            light,
            who,
            tuple(sorted(worn.items())),
            tuple((name, tuple(sorted(values))) for name, values in sorted(edits.items())),
            session.part or self.scene.reviewed_part,
            session.subject.shape,
            catalogue,
            session.bounces or session.influence is not None,
            session.influence,
        )
        scene = self._scene(asked)
        names = {name: self._standing_for(name, asked) for name in scene.material_ids}
        key = asked, tuple(names.values())
        return self._sides.get_or(key, lambda: self._made(asked, scene, names))

    def _made(self, asked: _Asked, scene: Scene, names: Mapping[str, str]) -> CanvasSide:
        for part in scene.parts:
            if names[part.material] != part.material:
                scene = scene.with_material(part.name, names[part.material])
        surfaces = {name: self._surface(asked.catalogue, name) for name in scene.material_ids}
        scene.check_surfaces(surfaces)
        if asked.influence is not None:
            scene.part(asked.influence)
        side = CanvasSide(scene, surfaces, self._spectrum(asked), asked.light.dimming, influence=asked.influence)
        # A light without a valid white is refused here, so that the previous image stays.
        _ = side.white
        return side

    def _scene(self, asked: _Asked) -> Scene:
        """Make a scene complete except for a light's spectrum and dimming, or an edit."""
        light = asked.light
        # Only the presence of lamps matters, since they replace any spectrum of a map.
        around = light.booth, light.map, light.uplift, bool(light.lamps)
        # Lights are compared by identity, so they must not depend on materials.
        key = asked.who, asked.part, asked.shape, asked.bounces, around, light.rotation_deg

        def made() -> Scene:
            scene = self.scene
            if asked.shape is not None:
                mesh = self._mesh(asked.shape, scene.part(asked.part).mesh)
                parts = (replace(one, mesh=mesh) if one.name == asked.part else one for one in scene.parts)
                scene = replace(scene, parts=tuple(parts))
            if (found := self._light_around(light)) is not None:
                scene = replace(scene, lights=(found,))
            # The scene's own object if unchanged, so that caches stay valid.
            if scene.observer.name != OBSERVERS[asked.who]:
                scene = replace(scene, observer=observer(asked.who))
            bounces = (scene.bounces or "auto") if asked.bounces else 0
            return replace(turned_lights(scene, light.rotation_deg), bounces=bounces)

        scene = self._scenes.get_or(key, made)
        for part, material in asked.worn:
            scene = scene.with_material(part, material)
        return scene

    def _light_around(self, light: LightChoice) -> EnvironmentLight | None:
        """Make the environment that replaces all lights, with the reference illuminance on a horizontal plane."""
        lux = float(self.scene.viewing.reference_illuminance_lux)
        if light.booth is not None:
            return self._around.get_or(light.booth, lambda: light_booth(light.booth, illuminance_lux=lux, name="booth"))
        if light.map is None:
            return None
        # With a stated spectrum only the map's luminance is used, so any spectrum will do.
        stated = illuminant("E") if light.lamps else None
        uplift = None if light.lamps else light.uplift
        return self._around.get_or(
            (light.map, uplift, bool(light.lamps)),
            lambda: load_environment(self._folder / (light.map or ""), stated, uplift, illuminance_lux=lux, name="map"),
        )

    def _mesh(self, shape: str, in_place_of: Mesh) -> Mesh:
        """Return a generated shape or a mesh from a file, with the size and position of the mesh that it replaces."""

        def made() -> tuple[Mesh, Mesh]:
            if shape in SHAPES and shape != "patches":
                settings = {"uv": True} if "uv" in SHAPES[shape] else {}
                mesh = getattr(shapes, shape)(**settings)
            else:
                mesh = load_mesh(self._folder / shape)
            (low, high), (floor, top) = mesh.bounds, in_place_of.bounds
            scale = float((top - floor).max() / max(float((high - low).max()), 1e-300))
            middle = 0.5 * (floor + top) - scale * 0.5 * (low + high)
            middle[1] = floor[1] - scale * low[1]
            return in_place_of, mesh.placed(scale=scale, translate=middle)

        return self._meshes.get_or((shape, id(in_place_of)), made)[1]

    def _standing_for(self, name: str, asked: _Asked) -> str:
        """Return the id under which a material is drawn: its own, or that of a fit."""
        values = next((values for edited, values in asked.edits if edited == name), None)
        if values is None:
            return name
        if asked.catalogue not in self._fits:
            self._fits[asked.catalogue] = Fitting(self._catalogue(asked.catalogue).load, self._waits)
        found = self._fits[asked.catalogue].material(name, values)
        if found is None:
            return name
        self._surfaces[asked.catalogue, found.id] = found.drawn()
        if asked.catalogue is None:
            self._edited[found.id] = found
        return found.id

    def _catalogue(self, folder: str | None) -> Any:
        if folder not in self._catalogues:
            self._catalogues[folder] = Catalogue.open(folder)
        return self._catalogues[folder]

    def _surface(self, catalogue: str | None, name: str) -> Fast:
        return self._surfaces.get_or((catalogue, name), lambda: self._catalogue(catalogue).surface(name).drawn())

    def _spectrum(self, asked: _Asked) -> Spectrum | None:
        """Return the spectrum that replaces the lights' own; None keeps them."""
        lamps, who = asked.light.lamps, observer(asked.who)
        if not lamps:
            return None

        def made() -> Spectrum:
            catalogue = self._catalogue(asked.catalogue)
            found = [lamp(one.name, one.entry, self._folder, catalogue)[0] for one in lamps]
            return mixture(found, np.array([one.share for one in lamps], dtype=float), who)

        # One lamp is independent of the observer, a blend by luminance is not.
        return self._spectra.get_or((lamps, asked.catalogue, asked.who if len(lamps) > 1 else ""), made)

    def _still(self, session: Session, file: str, side: CanvasSide) -> Pixels:
        lights = {one.spectrum_name or one.name for one in side.scene.lights}
        light = session.other.light or session.light
        named = " + ".join(one.name for one in light.lamps) or (lights.pop() if len(lights) == 1 else "")
        part = session.part or self.scene.reviewed_part
        shows = {
            "material": side.scene.part(part).material,
            "light": named,
            "observer": side.scene.observer.name,
            "scene": self.scene.name,
            "view": session.view.name,
        }
        path = self._folder / file
        stamp = path.stat().st_mtime_ns if path.exists() else 0
        key = file, stamp, tuple(shows.values()) if path.suffix != ".exr" else ()
        return self._stills.get_or(key, lambda: read_still(path, shows))

    @property
    def _folder(self) -> Path:
        """Folder for relative file names."""
        return Path() if self.scene.path is None else self.scene.path.parent


def _left_out(session: Session) -> Iterator[str]:
    """Yield descriptions of settings that scenes do not support."""
    if session.subject.kind == "image":
        yield "an image"
