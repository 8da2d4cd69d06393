"""Rendering of a review's cases on a Dask cluster: reference, image and figures of each.

Data common to all cases are sent once. Workers read the catalogue at the same path, and confirm by the key of each case
that material file, code, display, device and versions are identical. Rows and images are returned, and only this
process writes into the review's folder.
"""

from __future__ import annotations

import platform
import threading
from collections.abc import Generator, Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from ...calibration.report.row_files import DrawnRows
from ...lighting.plan import ScenePlan
from ...materials.catalogue.catalogue import Catalogue
from ...materials.catalogue.instrument_reading import InstrumentReading
from ...runtime.code_hash import product_hash
from ...runtime.dask_cluster import numbered_on_cluster
from ...runtime.errors import InputError
from ...runtime.private_folder import private_folder
from ..gl.backend import GLBackend, gl_session
from ..picture import display_for, display_pass, unheard
from ..render.session import RenderSession
from ..software.backend import software_session
from .case_rows import drawn_case
from .cases import ReviewCase, Setting, shown_forms
from .files import PICTURES
from .references import reference_of
from .row_key import case_key

#: Order of a case by its number: the case, its key, and whether to include the report's self-checks.
Order = tuple[int, ReviewCase, str, bool]
# Fields of a setting that workers create themselves.
_OWN = ("records", "surfaces", "display", "gpu", "renderer")


def drawn_on_cluster(
    setting: Setting, catalogue: Catalogue, orders: Iterator[Order], scheduler: str
) -> Generator[tuple[int, DrawnRows, dict[str, bytes]], None, None]:
    """Yield the number of each case, its rows, and its files by path in the review's folder, as completed.

    Raises
    ------
    InputError : see `clustered`; a worker without OpenGL or the catalogue, or with different inputs.
    MetamerError : a case without a result from any worker.
    """
    shared = {one.name: getattr(setting, one.name) for one in fields(setting) if one.name not in _OWN}
    kind = "gl" if isinstance(setting.renderer.backend, GLBackend) else "software"
    begin = _begin, (catalogue.folder.resolve(), shared, kind, setting.renderer.settings.filtering)
    numbers: list[int] = []

    def tasks() -> Iterator[tuple[Any, ...]]:
        for number, case, key, checked in orders:
            numbers.append(number)
            worn = tuple(part.material for part in case.scene.parts)
            yield worn, case.scene.bounces, case.judged, case.plan, key, checked

    for at, (rows, files) in numbered_on_cluster(_drawn_there, tasks(), scheduler, _code, begin):
        yield numbers[at], rows, files


def _code() -> str:
    """Hash the code that must be identical on all machines."""
    return product_hash(("runtime", "spectral", "materials", "lighting", "calibration", "viewer"))


class _Held(threading.local):
    """State of a review on a worker's thread, since OpenGL contexts are bound to threads."""

    renderer: RenderSession | None = None
    catalogue: Catalogue
    shared: dict[str, Any]


_held = _Held()


def _begin(folder: Path, shared: dict[str, Any], kind: str, filtering: Any) -> None:
    if _held.renderer is not None:
        _held.renderer.close()
        _held.renderer = None
    if not folder.is_dir():
        raise InputError(
            "a worker does not find the catalogue",
            file=folder,
            found=f"no such folder on {platform.node()}",
            expected="a catalogue on a file system that all workers have in the same place",
        )
    _held.catalogue, _held.shared = Catalogue.open(folder), shared
    _held.renderer = gl_session(filtering=filtering) if kind == "gl" else software_session(filtering)
    _held.renderer.configure(jobs=1)


def _drawn_there(
    worn: tuple[str, ...], bounces: Any, judged: tuple[str, ...], plan: ScenePlan, key: str, checked: bool
) -> tuple[DrawnRows, dict[str, bytes]]:
    """Render a case on a worker; `worn` are the materials of its parts."""
    catalogue, renderer, scene = _held.catalogue, _held.renderer, _held.shared["scene"]
    assert renderer is not None
    # Parts of one scene object, since cached sums are found by the identity of its meshes and lights.
    parts = tuple(replace(part, material=name) for part, name in zip(scene.parts, worn, strict=True))
    scene = replace(scene, parts=parts, bounces=bounces)
    records = {name: catalogue.surface(name) for name in scene.material_ids}
    surfaces = {name: record.drawn() for name, record in records.items()}
    display = display_for(scene)
    setting = Setting(
        **_held.shared,
        records=records,
        surfaces=surfaces,
        display=display,
        gpu=display_pass(renderer, display),
        renderer=renderer,
    )
    shown = shown_forms(scene, surfaces, plan, setting.scene.bounces != 0)
    case = ReviewCase(scene, judged, plan, shown)
    if case_key(setting, catalogue, case, checked) != key:
        raise InputError(
            "a worker would draw something else",
            field=", ".join(judged),
            found=f"on {platform.node()}: {renderer.made_by}, {display.name}, the catalogue {catalogue.folder}",
            expected="files of the catalogue, libraries and renderer as they are here",
            hint="--renderer software draws alike on all machines",
        )
    truth = reference_of(
        scene, {name: record.surface() for name, record in records.items()},
        setting.view, setting.spectra, setting.geometry, setting.budget,
    )  # fmt: skip

    def reading_of(material: str) -> InstrumentReading:
        return InstrumentReading.of(records[material].brdf())

    with private_folder() as folder:
        (folder / PICTURES).mkdir()
        rows = drawn_case(setting, case, truth, folder, checked, lambda row: None, unheard, reading_of)
        files = {
            path.relative_to(folder).as_posix(): path.read_bytes()
            for path in sorted(folder.rglob("*"))
            if path.is_file()
        }
    return rows, files
