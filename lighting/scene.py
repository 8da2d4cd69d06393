"""Scenes: parts with materials, lights, cameras, the observer and viewing conditions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from ..materials.core.surface import Cutout, Surface
from ..runtime.errors import InputError, UnknownNameError
from ..spectral.adaptation import Method
from ..spectral.observers import Observer
from ..spectral.spectrum import Spectrum
from .camera import Camera
from .lights import DeltaLight, Light, SpreadLight
from .mesh.mesh import Mesh
from .vectors import Number


@dataclass(frozen=True)
class Viewing:
    """Viewing conditions of a picture.

    Parameters
    ----------
    reference_illuminance_lux : illuminance at which a perfect diffuser has Y = 1.
    background_reflectance : grey behind the image, for display only; the image itself has coverage 0 there.
    adaptation : chromatic adaptation transform to the display white ("Bradford", "CAT02", "CAT16").
    ocio_config, display, view : of the display transform; None is its default.
    """

    reference_illuminance_lux: Number = 1000.0
    background_reflectance: Number = 0.2
    adaptation: Method = "Bradford"
    ocio_config: str | None = None
    display: str | None = None
    view: str | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.reference_illuminance_lux < np.inf:
            raise InputError(
                "no illuminance to refer to",
                field="reference_illuminance_lux",
                found=self.reference_illuminance_lux,
                expected="more than 0 lx",
            )
        if not 0.0 <= self.background_reflectance <= 1.0:
            raise InputError(
                "not a reflectance",
                field="background_reflectance",
                found=self.background_reflectance,
                expected="0 to 1",
                hint="give a fraction, not per cent" if self.background_reflectance > 1.0 else None,
            )


@dataclass(frozen=True)
class Review:
    """Sweep of a review: materials (ids, or patterns with * and ?) on one part, under several illuminants."""

    on: str
    materials: tuple[str, ...] = ("*",)
    illuminants: tuple[str, ...] = ("D65", "A", "FL11")


@dataclass(frozen=True, eq=False)
class Part:
    """Mesh in world coordinates (`Mesh.placed`), the id of its material, and the material's holes, None until
    `Scene.cut`.

    static : its material cannot be changed.
    """

    name: str
    mesh: Mesh
    material: str
    cutout: Cutout | None = None
    static: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class Scene:
    """Scene description: everything that an image depends on.

    Parameters
    ----------
    parts, lights, cameras : at least one of each; names of parts and of cameras are unique. Lights of several spectra
        are reweighted for `observer` (`Light.for_observer`).
    observer : colour-matching functions.
    viewing : luminance scale and display.
    review : sweep of `metamer review`, or None.
    notes : repairs and assumptions made while reading.
    path : of the file, or None.
    bounces : largest number of surfaces on a light path besides the visible one; 0 is direct light alone, "auto" as
        many as are visible.

    Raises
    ------
    InputError : no part, light or camera; duplicate names; a review of an unknown part.
    """

    parts: tuple[Part, ...]
    lights: tuple[Light, ...]
    cameras: tuple[Camera, ...]
    observer: Observer
    viewing: Viewing = field(default_factory=Viewing)
    name: str = "scene"
    review: Review | None = None
    notes: tuple[str, ...] = ()
    path: Path | None = None
    bounces: int | Literal["auto"] = 0

    def __post_init__(self) -> None:
        if self.bounces != "auto" and not (type(self.bounces) is int and self.bounces >= 0):
            raise InputError(
                "not a number of bounces",
                file=self.path,
                field="bounces",
                found=self.bounces,
                expected='a whole number from 0, or "auto"',
            )
        for what in ("parts", "lights", "cameras"):
            if not getattr(self, what):
                raise InputError(f"a scene without {what}", file=self.path, field=what, expected="at least one")
        for what in ("parts", "cameras"):
            names = [item.name for item in getattr(self, what)]
            repeated = sorted({name for name in names if names.count(name) > 1})
            if repeated:
                raise InputError(
                    f"two {what} share a name",
                    file=self.path,
                    field=what,
                    found=repeated[0],
                    hint="give each a name of its own, with the key `name`",
                )
        object.__setattr__(self, "lights", tuple(light.for_observer(self.observer) for light in self.lights))
        if self.review is not None:
            self.part(self.review.on)

    def __repr__(self) -> str:
        return f"<Scene {self.name}: parts {len(self.parts)}, lights {len(self.lights)}, cameras {len(self.cameras)}>"

    def part(self, name: str) -> Part:
        """Return the part called `name`; UnknownNameError suggests the nearest names."""
        for part in self.parts:
            if part.name == name:
                return part
        raise UnknownNameError("part", name, [part.name for part in self.parts], file=self.path)

    def parts_like(self, pattern: str) -> tuple[str, ...]:
        """Return the names of parts that equal `pattern`, or else match it (`*` and `?`); `UnknownNameError` without
        any.
        """
        names = [part.name for part in self.parts]
        found = tuple(names[number] for number in _like(pattern, names))
        if not found:
            raise UnknownNameError("part", pattern, names, file=self.path)
        return found

    def lights_like(self, pattern: str) -> tuple[int, ...]:
        """Return the indices of lights whose names equal `pattern`, or else match it (`*` and `?`)."""
        return _like(pattern, [light.name for light in self.lights])

    def camera(self, name: str | None = None) -> Camera:
        """Return the camera called `name`, or the first."""
        if name is None:
            return self.cameras[0]
        for camera in self.cameras:
            if camera.name == name:
                return camera
        raise UnknownNameError("camera", name, [camera.name for camera in self.cameras], file=self.path)

    def needs_uv(self, surfaces: Mapping[str, Surface]) -> bool:
        """Return whether a part has a material that needs texture coordinates."""
        return any(surfaces[part.material].uses_uv for part in self.parts)

    def check_surfaces(self, surfaces: Mapping[str, Surface]) -> None:
        """Raise `UnknownNameError` for a material that is not in `surfaces`, and `InputError` for one that needs
        texture coordinates which the part's mesh lacks.
        """
        for part in self.parts:
            field = f"part {part.name}"
            if part.material not in surfaces:
                raise UnknownNameError("material", part.material, surfaces, file=self.path, field=field)
            if surfaces[part.material].uses_uv and part.mesh.uv is None:
                raise InputError(
                    f"{part.material} is a texture, and the mesh has no texture coordinates",
                    file=self.path,
                    field=field,
                    found=next((note for note in part.mesh.notes if "texture coordinates" in note), "none"),
                    expected="u and v at each vertex",
                    hint="unwrap it in the program that made it and export it again, or choose a uniform material",
                )

    def cut(self, surfaces: Mapping[str, Surface]) -> Scene:
        """Return the scene with the holes of its materials; itself if nothing changes."""
        cutouts = [surfaces[part.material].cutout for part in self.parts]
        if all(part.cutout is cutout for part, cutout in zip(self.parts, cutouts, strict=True)):
            return self
        parts = (replace(part, cutout=cutout) for part, cutout in zip(self.parts, cutouts, strict=True))
        return replace(self, parts=tuple(parts))

    @property
    def cutouts(self) -> tuple[Cutout | None, ...]:
        """Opacity mask of each part."""
        return tuple(part.cutout for part in self.parts)

    @cached_property
    def delta_lights(self) -> tuple[DeltaLight, ...]:
        """Lights that reach each point from one direction."""
        return tuple(light for light in self.lights if isinstance(light, DeltaLight))

    @cached_property
    def spread_lights(self) -> tuple[SpreadLight, ...]:
        """Area and environment lights."""
        return tuple(light for light in self.lights if isinstance(light, SpreadLight))

    @property
    def material_ids(self) -> tuple[str, ...]:
        """Ids of the materials on the parts, each once, in the order of the parts."""
        return tuple(dict.fromkeys(part.material for part in self.parts))

    @property
    def reviewed_part(self) -> str:
        """Name of the part that reviews put materials on: the review's, else the first."""
        return self.review.on if self.review else self.parts[0].name

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Lowest and highest corner of the bounding box of all parts."""
        return bounds_of(part.mesh for part in self.parts)

    def with_material(self, part: str, material_id: str) -> Scene:
        """Return the scene with another material on one part; meshes are shared, so that geometry caches stay valid.

        Raises
        ------
        UnknownNameError : unknown part. InputError : it is static.
        """
        self.check_changes(part)
        parts = tuple(replace(p, material=material_id) if p.name == part else p for p in self.parts)
        return replace(self, parts=parts)

    def check_changes(self, part: str) -> None:
        """Raise `UnknownNameError` for an unknown part, and `InputError` for a static one."""
        if self.part(part).static:
            raise InputError(
                "a static part keeps its material",
                file=self.path,
                field=part,
                found="another material for it",
                expected="a part without `static = true`",
                hint="take `static = true` from that [[part]], or leave its material as it is",
            )

    def with_illuminant(self, spectrum: Spectrum, name: str = "") -> Scene:
        """Return the scene with every light's spectrum replaced; strengths and positions are kept."""
        return replace(self, lights=tuple(light.with_spectrum(spectrum, name) for light in self.lights))

    def mixed(self, under_each: Float[np.ndarray, "lights *n"]) -> Float[np.ndarray, "*n"]:
        """Average values under each light, weighted by `illuminances_lux`.

        The common rule for the scene's white and for every colour shown beside it.
        """
        weights = self._illuminances
        check_lit(weights, self.path)
        return np.average(under_each, axis=0, weights=weights)

    @cached_property
    def _illuminances(self) -> Float[np.ndarray, "_"]:
        return illuminances_lux(self.lights, *self.bounds)

    def adopted_white(self) -> Float[np.ndarray, "3"]:
        """Return XYZ, Y = 1, of a perfect diffuser under the mixture (`mixed`) of all lights, the white for
        adaptation.
        """
        return self.adopted_whites((None,))[0]

    def adopted_whites(self, illuminants: Sequence[Spectrum | None]) -> Float[np.ndarray, "M 3"]:
        """Return `adopted_white` with each illuminant replacing every light's spectrum; None keeps the lights' own.

        The same as for `with_illuminant`, since strengths and positions are kept.
        """
        spectra = ([light.spectrum if one is None else one for light in self.lights] for one in illuminants)
        return np.stack([self.mixed(np.stack([self.observer.white(one) for one in some])) for some in spectra])


def _like(pattern: str, names: Sequence[str]) -> tuple[int, ...]:
    """Return the indices of names equal to a pattern, or else matching it."""
    whole = pattern in names
    return tuple(n for n, name in enumerate(names) if (name == pattern if whole else fnmatchcase(name, pattern)))


def bounds_of(meshes: Iterable[Mesh]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return the lowest and highest corner of the bounding box of `meshes`."""
    lows, highs = zip(*(mesh.bounds for mesh in meshes), strict=True)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def framing_camera(low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"], **settings: Any) -> Camera:
    """Return a camera in front (looking along -z) that frames the box from `low` to `high`; settings: see `Camera`."""
    centre, half = 0.5 * (low + high), 0.5 * np.maximum(high - low, 1e-9)
    aspect = settings.get("width", 256) / settings.get("height_px", 256)
    needed = 1.1 * max(half[1], half[0] / aspect)
    if settings.get("projection", "perspective") == "orthographic":
        settings.setdefault("height", 2.0 * needed)
        distance = half[2] + needed
    else:
        settings.setdefault("vertical_fov_deg", 30.0)
        # `Camera` refuses angles out of range.
        distance = half[2] + needed / np.tan(np.deg2rad(np.clip(settings["vertical_fov_deg"], 1e-3, 179.0)) / 2.0)
    position = centre + np.array([0.0, 0.0, distance])
    return Camera(position=position, target=centre, **settings).fitted(low, high)


def illuminances_lux(
    lights: Iterable[Light], low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "_"]:
    """Compute the illuminance, lx, by each light on a surface facing it at the centre of the box from `low` to `high`.

    The distance of a light near the centre is clamped (`Light.counted_from`); `held_off_notes` lists such lights.
    """
    return np.array([light.counted_from(low, high)[0] for light in lights])


def check_lit(illuminances: Float[np.ndarray, "_"], path: Path | None) -> None:
    """Raise InputError if no light reaches the centre of a scene, so that its white is undefined."""
    if not illuminances.sum() > 0.0:
        raise InputError(
            "no light falls on the middle of the scene",
            file=path,
            field="lights",
            found="an illuminance of 0: it lies behind a softbox, or an environment sends nothing from above",
            expected="some light in the middle of the box around all parts",
            hint="turn the light round, or add another one",
        )


def held_off_notes(
    lights: Iterable[Light], low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"]
) -> tuple[str, ...]:
    """Return a note for each light whose distance `illuminances_lux` clamps."""
    notes = []
    for light in lights:
        _, distance, counted = light.counted_from(low, high)
        if distance < counted:
            notes.append(
                f"{light.name} stands {distance:.3g} from the middle of the scene; for the white and the reference "
                f"illuminance it counts as {counted:.3g} off"
            )
    return tuple(notes)
