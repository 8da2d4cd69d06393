"""Loader of a session's scene, catalogue and image, and of choices."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...lighting.mesh.files import SUFFIXES as MESHES
from ...lighting.scene import Scene
from ...lighting.scene_file.files import load_scene, possible_scene, shipped_scene
from ...materials.catalogue.catalogue import Catalogue, default_catalogue
from ...materials.records.models import SPECTRA
from ...runtime.errors import InputError, UnknownNameError
from ...runtime.files import existing_file
from ...runtime.remote import local_folder
from ..display.transform import PINNED_CONFIG
from .choices import Choices
from .file_watcher import files_of_materials, files_of_scene
from .spectral_image import SpectralPicture, XyzPicture
from .spectral_image_file import read_looked_at
from .state import SESSION_FILE, Compare, Other, Session, Subject

#: Default scene for showing materials.
SHOWN_IN = "speed_shape"


@dataclass(frozen=True, eq=False)
class Loaded:
    """Subject in memory.

    subject, catalogue_name : of the request. scene : None for an image. image : None otherwise.
    """

    subject: Subject
    catalogue_name: str | None
    catalogue: Catalogue
    choices: Choices
    scene: Scene | None = None
    image: SpectralPicture | XyzPicture | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """Files that it was read from."""
        if self.scene is None:
            return (Path(self.subject.path or ""),)
        worn = files_of_materials(self.catalogue, self.scene.material_ids)
        return (*files_of_scene(scene_path(self.subject)), *worn)

    def is_of(self, session: Session) -> bool:
        """Return whether it belongs to a session, whatever its shape, which is inserted when drawing."""
        same = replace(session.subject, shape=None) == replace(self.subject, shape=None)
        return same and session.catalogue == self.catalogue_name


def scene_path(subject: Subject) -> Path:
    """Return the file of a subject's scene."""
    return Path(subject.path) if subject.path is not None else shipped_scene(SHOWN_IN)


def load(subject: Subject, catalogue_name: str | None = None) -> Loaded:
    """Load a subject.

    Raises
    ------
    InputError, UnknownNameError, NoRoomError : a missing or unusable file, an unknown material.
    """
    folder = local_folder(default_catalogue() if catalogue_name is None else catalogue_name, "the window")
    # An image needs no materials.
    without = subject.kind == "image" and catalogue_name is None and not folder.exists()
    catalogue = Catalogue(folder) if without else Catalogue.open(folder)
    views = display_views()
    if subject.kind == "image":
        assert subject.path is not None
        image = read_looked_at(subject.path)
        choices = replace(Choices(), views=views, cameras=(), parts=(), shapes=(), booths=())
        return Loaded(subject, catalogue_name, catalogue, choices, image=image)
    scene = load_scene(scene_path(subject), catalogue)
    surfaces = tuple(one.id for one in catalogue.query(unusable=[]) if one.model not in SPECTRA)
    for name in subject.materials:
        catalogue.path(name)
    choices = Choices.of(scene, subject.materials or surfaces, views)
    return Loaded(subject, catalogue_name, catalogue, choices, scene)


@lru_cache(maxsize=8)
def display_views(config: str | None = None) -> Mapping[str, tuple[str, ...]]:
    """Return the displays of an OpenColorIO configuration, each with its views; None is the active one.

    Raises
    ------
    InputError : it cannot be read.
    """
    import PyOpenColorIO as ocio

    name = config or os.environ.get("OCIO") or PINNED_CONFIG
    try:
        found = ocio.Config.CreateFromFile(name)
    except (ocio.Exception, ocio.ExceptionMissingFile) as reason:
        expected = "a configuration that OpenColorIO can load"
        raise InputError("no configuration of OpenColorIO", file=name, found=str(reason), expected=expected) from None
    return {display: tuple(found.getViews(display)) for display in found.getDisplays()}


def subject_of(words: Sequence[str], catalogue: Catalogue) -> Subject | Session:
    """Parse the words of a command as a subject: a scene, an image, a saved session, or materials by ids and patterns.

    Raises
    ------
    InputError, UnknownNameError : incompatible files, an unknown file or material.
    """
    if not words:
        return Subject("scene")
    files = [word for word in words if Path(word).suffix.lower() in (".toml", ".exr", *MESHES)]
    if files:
        if len(words) > 1 and not comparison_of(words):
            expected = "one file, two images, or materials"
            raise InputError("several things to look at", found=", ".join(words), expected=expected)
        return subject_of_file(files[0])
    try:
        found = [name for word in words for name in catalogue.match_surfaces(word)]
    except UnknownNameError:
        for word in words:
            if Path(word).exists():
                raise _not_shown(Path(word)) from None
        raise
    return Subject("materials", materials=tuple(dict.fromkeys(found)))


def _not_shown(path: Path) -> InputError:
    """Return the error for an existing file or folder that cannot be opened."""
    if path.is_file():
        # The error names the kind of a recognised file.
        possible_scene(path)
    return InputError(
        "nothing that the window shows",
        file=path,
        found="a folder" if path.is_dir() else f"a file that ends in {path.suffix or 'nothing'}",
        expected="a scene.toml, a saved session, an OpenEXR image, or materials of the catalogue",
        hint="of a review or a comparison, each row of the page has the command that opens its pictures",
    )


def comparison_of(words: Sequence[str]) -> dict[str, Any]:
    """Return session settings that compare two images by a wipe, the second as B; {} for other words.

    Raises
    ------
    InputError : no such file.
    """
    if [Path(word).suffix.lower() for word in words] != [".exr", ".exr"]:
        return {}
    file = str(existing_file(Path(words[1])))
    return {"other": Other(made="file", file=file), "compare": Compare("wipe")}


def subject_of_file(path: str) -> Subject | Session:
    """Return the subject of a file: a session, an image by its name, else a scene.

    Raises
    ------
    InputError : no such file, or a session that cannot be read.
    """
    if Path(path).is_dir():
        raise _not_shown(Path(path))
    if not Path(path).is_file():
        raise InputError("no such file", file=path, expected="a scene.toml, a saved session, or an OpenEXR image")
    if Path(path).suffix.lower() == ".exr":
        return Subject("image", path)
    return SESSION_FILE.read(path) if SESSION_FILE.is_one(path) else Subject("scene", str(possible_scene(path)))
