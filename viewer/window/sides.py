"""Sides of a comparison as they are drawn: scenes, surfaces and spectra by the names in it, each made once."""

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

#: Triangles of a scene while something moves: at a third of the pixels a speed shape of so many is within ΔE94 0.08
#: (p95) of the exact picture, and one of a quarter of them within 0.27, in four fifths of the time.
MOVING_TRIANGLES = 96_000
Made = TypeVar("Made")


class _Kept(dict):
    """The last few things, by key; what was asked for last goes last."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self.most = most

    def get_or(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """Return what is kept, made where it is not."""
        found = self.pop(key) if key in self else make()
        while len(self) >= self.most:
            self.pop(next(iter(self)))
        self[key] = found
        return found


class _Fewer(NamedTuple):
    """A scene's meshes, kept alive, those of fewer triangles, and which of them nobody sees from behind."""

    of: tuple[Mesh, ...]
    meshes: tuple[Mesh, ...]
    one_sided: frozenset[int]


@dataclass(frozen=True)
class _Asked:
    """Names that make a side: equal for sides that are the same."""

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
    """Objects that a session names, kept so that the same name is the same object: what is drawn is told apart by that.

    catalogue : a `Catalogue`, or anything with its `ids()`, `surface(id)` and, for edits, `load(id)`.
    waits : materials with other parameters are fitted at once, not beside what is drawn.
    """

    def __init__(self, scene: Scene, catalogue: Any, waits: bool = False) -> None:
        self.scene, self.catalogue = scene, catalogue
        self._catalogues: dict[str | None, Any] = {None: catalogue}
        self._fits: dict[str | None, Fitting] = {}
        self._waits = waits
        # A BTF may take hundreds of megabytes, a map with what it gives 20.
        self._surfaces, self._scenes, self._sides = _Kept(64), _Kept(32), _Kept(32)
        self._spectra, self._around, self._meshes = _Kept(64), _Kept(4), _Kept(8)
        # Meshes of fewer triangles by the identities of a scene's own, which are kept with them.
        self._fewer, self._stills = _Kept(4), _Kept(4)
        self._edited: dict[str, Material] = {}

    def close(self) -> None:
        """Fit nothing more."""
        for one in self._fits.values():
            one.close()

    @property
    def pending(self) -> bool:
        """True if a material with other parameters is being fitted: sides show what stands for it meanwhile."""
        return any(one.pending for one in self._fits.values())

    def arrived(self) -> bool:
        """Return whether one has been fitted since this was last asked: then `sides` has other ones."""
        arrived = [one.arrived() for one in self._fits.values()]
        return any(arrived)

    @property
    def seen_catalogue(self) -> Any:
        """The catalogue, with the materials of other parameters that have been fitted."""
        mine = isinstance(self.catalogue, Catalogue) and self._edited
        return VariedCatalogue.of(self.catalogue, self._edited.values()) if mine else self.catalogue

    def sides(self, session: Session) -> tuple[CanvasSide, CanvasSide]:
        """Return a and B; one object where they are alike.

        Raises
        ------
        InputError, UnknownNameError : a material, a part, a lamp or a file that is not there; what cannot be drawn.
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
        """Meshes of fewer triangles, by identity, that nobody sees from behind."""
        return frozenset().union(*(one.one_sided for one in self._fewer.values()))

    def moving(self, side: CanvasSide) -> CanvasSide:
        """Return a side of fewer triangles; itself where that would need work of its own, as under lights that
        spread."""
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
            # Fitted materials are named by their values in six digits, so those values are used.
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
        # A light that nobody can be used to is refused while what was seen can stay.
        _ = side.white
        return side

    def _scene(self, asked: _Asked) -> Scene:
        """Make a scene in which only a light's spectrum and its dimming, or an edit, is left to be put in."""
        light = asked.light
        # Only whether there are lamps: they replace any spectrum of a map.
        around = light.booth, light.map, light.uplift, bool(light.lamps)
        # Lights are told apart by identity: they are the same whatever is worn.
        key = asked.who, asked.part, asked.shape, asked.bounces, around, light.rotation_deg

        def made() -> Scene:
            scene = self.scene
            if asked.shape is not None:
                mesh = self._mesh(asked.shape, scene.part(asked.part).mesh)
                parts = (replace(one, mesh=mesh) if one.name == asked.part else one for one in scene.parts)
                scene = replace(scene, parts=tuple(parts))
            if (found := self._light_around(light)) is not None:
                scene = replace(scene, lights=(found,))
            # The scene's own, where it is that: what is kept by it stays good.
            if scene.observer.name != OBSERVERS[asked.who]:
                scene = replace(scene, observer=observer(asked.who))
            bounces = (scene.bounces or "auto") if asked.bounces else 0
            return replace(turned_lights(scene, light.rotation_deg), bounces=bounces)

        scene = self._scenes.get_or(key, made)
        for part, material in asked.worn:
            scene = scene.with_material(part, material)
        return scene

    def _light_around(self, light: LightChoice) -> EnvironmentLight | None:
        """Make the light in place of all lights, as strong on a horizontal plane as the reference illuminance."""
        lux = float(self.scene.viewing.reference_illuminance_lux)
        if light.booth is not None:
            return self._around.get_or(light.booth, lambda: light_booth(light.booth, illuminance_lux=lux, name="booth"))
        if light.map is None:
            return None
        # A spectrum that is stated makes nothing of the map but its luminance: any one does for all.
        stated = illuminant("E") if light.lamps else None
        uplift = None if light.lamps else light.uplift
        return self._around.get_or(
            (light.map, uplift, bool(light.lamps)),
            lambda: load_environment(self._folder / (light.map or ""), stated, uplift, illuminance_lux=lux, name="map"),
        )

    def _mesh(self, shape: str, in_place_of: Mesh) -> Mesh:
        """Return a generated shape or a mesh's file, as large as what it takes the place of, and standing where that
        does.
        """

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
        """Return the id of what a material is drawn as: itself, or what was fitted of it."""
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
        """Return the spectrum in place of the lights' own; None is theirs."""
        lamps, who = asked.light.lamps, observer(asked.who)
        if not lamps:
            return None

        def made() -> Spectrum:
            catalogue = self._catalogue(asked.catalogue)
            found = [lamp(one.name, one.entry, self._folder, catalogue)[0] for one in lamps]
            return mixture(found, np.array([one.share for one in lamps], dtype=float), who)

        # One lamp is the same to everybody, a blend by luminance is not.
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
        """Folder that files are looked up in."""
        return Path() if self.scene.path is None else self.scene.path.parent


def _left_out(session: Session) -> Iterator[str]:
    """Describe what a session asks for and no scene shows."""
    if session.subject.kind == "image":
        yield "an image"
