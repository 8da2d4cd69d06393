"""Functions for scripts: `metamer render` and `metamer review`, with the same options, for objects or files."""

from __future__ import annotations

import atexit
import os
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from ..calibration.report.rating import read_protocol
from ..lighting.scene import Scene
from ..materials.catalogue.catalogue import Catalogue
from ..runtime.distribution import installed_version
from ..runtime.errors import InputError, UnknownNameError, UsageError
from ..runtime.worker_pool import usable_cores
from .gl.backend import create_session, gl_session, software_session
from .gl.context import DISABLE_VARIABLE, NoGL
from .picture import REFERENCE_NOISE, Picture, lit_by, picture, reference_picture, shown_on
from .render.picture_cost import picture_cost
from .render.scene_layers import Filtering
from .render.session import RenderSession

if TYPE_CHECKING:
    from .review.review import ReviewResult

#: "auto" is OpenGL where there is a driver, else numpy.
RendererName = Literal["auto", "gl", "software"]
Progress = Callable[[int, int, str], None]


def render(
    scene: Scene | str | Path,
    catalogue: Catalogue | str | Path | None = None,
    *,
    camera: str | None = None,
    illuminant: object = None,
    display: str | None = None,
    reference: bool = False,
    bounces: int | Literal["auto"] | None = None,
    noise: float | None = None,
    filtering: Filtering | None = None,
    renderer: RendererName | RenderSession = "auto",
    progress: Progress | None = None,
) -> Picture:
    """Render an image of a scene: `xyz` (H,W,3), `white` (3,), `coverage` (H,W); its `write` saves it.

    Python's warnings tell why a picture may show nothing.

    Parameters
    ----------
    scene : or the path of its file. catalogue : where the materials are, or its folder; default: `Catalogue.open()`.
    camera : its name in the scene; default: the first.
    illuminant : in place of every light's own spectrum: its name, a file of a measured lamp (FILE or
        FILE#ENTRY), or an emission as of `Spectrum.of`.
    display : target display instead of the scene's: a display of its OpenColorIO configuration, `icc:FILE` or
        `icc:screen`.
    reference : use the reference renderer (ray tracing, every wavelength, the original data) instead of fast forms.
    bounces : largest number of surfaces on a light path besides the visible one, or "auto": as many as are visible;
        default: `Scene.bounces`, which is 0 unless the scene states it.
    noise : of a reference: mean sampling noise, ΔE94, of area and environment lights and bounces; default 0.1.
    filtering : "mipmapped" averages highlights smaller than a sample; default: "linear".
    renderer : a name, whose session is cached for the next image, so that another light or observer of the same scene
        costs only a fold (`close_renderers` frees it); or your own session (`create_session` of
        `metamer.viewer.gl.backend`), which keeps `filtering` and `progress`, too.
    progress : called with (done, total, what) during long renderings.

    Raises
    ------
    InputError, UnknownNameError : an unknown camera, light or material; a material without a surface; not enough
        memory.
    UsageError : `filtering` with `reference`, which has no factors; `noise` without it.
    """
    if reference and filtering not in (None, "linear"):
        raise UsageError("filtering and reference: the reference has no factors to filter, leave one out")
    if not reference and noise is not None:
        raise UsageError("noise is of references: add reference=True")
    catalogue = _opened(catalogue)
    scene = shown_on(_read(scene, catalogue), display)
    scene = lit_by(scene if bounces is None else replace(scene, bounces=bounces), illuminant)
    view = scene.camera(camera)
    kind = "reference" if reference else "picture"
    picture_cost(scene, view, kind).check_room(scene, view)
    said: list[str] = []
    if reference:
        made = reference_picture(
            scene, catalogue, camera, said.append, progress, REFERENCE_NOISE if noise is None else noise
        )
    else:
        given: dict[str, object] = {"filtering": filtering, "on_progress": progress}
        given = {name: value for name, value in given.items() if value is not None}
        if isinstance(renderer, str):
            opened = _kept.of(renderer)
            given = {"filtering": "linear", "on_progress": None, "keeps_terms": True} | given
        else:
            opened = nullcontext(renderer)
        with opened as drawing:
            drawing.configure(**given)
            made = picture(scene, catalogue, camera, drawing, said.append)
    for line in said:
        warnings.warn(line, stacklevel=2)
    return made


def review(
    scene: Scene | str | Path,
    catalogue: Catalogue | str | Path | None = None,
    out: str | Path = "review",
    *,
    illuminants: str | Sequence[str] | None = None,
    materials: str | Sequence[str] | None = None,
    budget: float = 1.0,
    camera: str | None = None,
    display: str | None = None,
    size: int | None = None,
    reference_size: int | None = None,
    renderer: RendererName | RenderSession = "auto",
    jobs: int | None = None,
    scheduler: str | None = None,
    again: bool = False,
    protocol: str | Path | None = None,
    progress: Progress | None = None,
) -> ReviewResult:
    """Render materials under several lights, compare with the reference, and write the report into the folder `out`.

    The result's `status` is "pass", "near" or "over", `rows` has the figures, `page` is the report. Rows in `out` from
    identical inputs are not drawn again. Python warnings explain images that may show nothing.

    Parameters
    ----------
    scene : or the path of its file. catalogue : where the materials are, or its folder; default: `Catalogue.open()`.
    illuminants : one name or several; default: those of the scene's review, or of its lights.
    materials : one or several ids or patterns, swept over the review's part or the first; default: those of the scene's
        review.
    budget : ΔE94 that the 99th percentile of each row is held against.
    camera : its name in the scene; default: the first. display : as of `render`.
    size, reference_size : pixels on the longer side of images (default: the camera's), and of references, figures and
        maps (default: as large as the images).
    renderer : as of `render`.
    jobs : processes for references; default: one per core.
    scheduler : address of a Dask scheduler whose workers draw instead; needs the extra `cluster`.
    again : draw every row, also existing ones.
    protocol : a reviewer's protocol from the window, for the report.
    progress : called with (rows done, number of rows, material).

    Raises
    ------
    InputError, UnknownNameError : a camera that sees nothing to judge; an unusable file or name.
    """
    from .review.cases import review_views, reviewed_lights_of
    from .review.review import review as review_into

    illuminants = (illuminants,) if isinstance(illuminants, str) else illuminants
    materials = (materials,) if isinstance(materials, str) else materials
    catalogue = _opened(catalogue)
    scene = shown_on(_read(scene, catalogue, bool(materials)), display)
    # Read first, since a review takes minutes.
    ratings = () if protocol is None else read_protocol(protocol)
    jobs = jobs or usable_cores()
    view, _ = review_views(scene, camera, size, reference_size)
    picture_cost(scene, view, "review", spectra=len(reviewed_lights_of(scene, illuminants)), jobs=jobs).check_room(
        scene, view
    )
    with _ready(renderer) as drawing:
        result = review_into(
            scene,
            catalogue,
            out,
            illuminants=illuminants,
            materials=materials,
            budget=budget,
            renderer=drawing,
            camera=camera,
            size=size,
            reference_size=reference_size,
            jobs=jobs,
            scheduler=scheduler,
            version=installed_version(),
            progress=progress,
            again=again,
            ratings=ratings,
        )
    for line in result.warnings:
        warnings.warn(line, stacklevel=2)
    return result


def _opened(catalogue: Catalogue | str | Path | None) -> Catalogue:
    if catalogue is None or isinstance(catalogue, str | Path):
        return Catalogue.open(catalogue)
    if not isinstance(catalogue, Catalogue):
        raise InputError(
            "not a catalogue",
            field="catalogue",
            found=repr(catalogue)[:80],
            expected="a Catalogue, or its folder",
            hint="`Catalogue.add` puts a material into one, and `Scene.with_material` onto a part by its id",
        )
    return catalogue


def _read(scene: Scene | str | Path, catalogue: Catalogue, swept: bool = False) -> Scene:
    if isinstance(scene, Scene):
        return scene
    from ..lighting.scene_file.files import load_scene

    return load_scene(scene, catalogue, swept=swept)


def renderer_named(name: str) -> tuple[RenderSession, NoGL | None]:
    """Return a renderer, and for "auto" the reason if it is not OpenGL.

    Raises
    ------
    UnknownNameError : an unknown name. NoGL : "gl" without a driver.
    """
    if name not in get_args(RendererName):
        raise UnknownNameError("renderer", name, get_args(RendererName))
    if name == "auto":
        return create_session(keeps_terms=False)
    return (gl_session() if name == "gl" else software_session()), None


class _KeptSessions(threading.local):
    """Cached sessions of `render` on one thread, since GL contexts are bound to threads, by renderer and whether OpenGL
    is disabled.
    """

    def __init__(self) -> None:
        self._sessions: dict[tuple[str, str | None], RenderSession] = {}

    @contextmanager
    def of(self, name: str) -> Iterator[RenderSession]:
        """Yield the session of a renderer, which stays open unless drawing fails."""
        key = name, os.environ.get(DISABLE_VARIABLE)
        session = self._sessions.pop(key, None) or renderer_named(name)[0]
        try:
            yield session
        except BaseException:
            session.close()
            raise
        # A progress callback may have rendered and created another one.
        if (other := self._sessions.pop(key, None)) is not None:
            other.close()
        self._sessions[key] = session

    def close(self) -> None:
        """Close all sessions."""
        while self._sessions:
            self._sessions.popitem()[1].close()


_kept = _KeptSessions()
atexit.register(_kept.close)


def close_renderers() -> None:
    """Free the sessions that `render` has cached on this thread."""
    _kept.close()


@contextmanager
def _ready(renderer: str | RenderSession) -> Iterator[RenderSession]:
    """Yield the renderer of a name, closed afterwards, or the given one, which stays open."""
    if not isinstance(renderer, str):
        yield renderer
        return
    with renderer_named(renderer)[0] as made:
        yield made
