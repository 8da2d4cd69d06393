"""Reviews: every material under every light, rendered, compared with the reference, and reported.

Steps are in files of their own: `cases`, `draw`, `compare`, `files`. This one runs them in order, and reuses rows of an
earlier review with identical inputs.
"""

from __future__ import annotations

import html
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from shutil import rmtree
from typing import Any

from ...calibration.report.history import HISTORY, read_history
from ...calibration.report.rating import Rating
from ...calibration.report.report import status, verdict_of, write_report
from ...calibration.report.row import ReviewRow
from ...lighting.plan import ScenePlan
from ...lighting.scene import Scene
from ...materials.catalogue.catalogue import Catalogue
from ...materials.catalogue.instrument_reading import InstrumentReading
from ...runtime.notebook import data_frame, html_table, new_axes
from ...runtime.progress import TimeLeft
from ...runtime.shutdown import clearing, saying
from ..picture import Warn, unheard
from ..render.session import RenderSession
from .case_rows import Warnings, drawn_case
from .cases import OWN_LIGHT, ReviewCase, Setting, prepare_review, review_views
from .cluster import drawn_on_cluster
from .expected_work import ReviewWork
from .facts import reviewed_lights, reviewed_materials
from .folder import REPORT, UNFINISHED, DrawnRows, drawing_into, drawn_rows, found_rows, put_in_place
from .references import reference_pictures
from .row_key import case_key
from .words import colour_chain

__all__ = ["OWN_LIGHT", "ReviewResult", "review"]

Progress = Callable[[int, int, str], None]
# Columns of a review as a table.
_HEADINGS = ("material", "illuminant", "observer", "mean", "p95", "p99", "maximum", "standing")
ReadingOf = Callable[[str], InstrumentReading]


@dataclass(frozen=True)
class ReviewResult:
    """Result of a review and its folder; `resumed` of its rows were reused.

    verdict, facts : opening sentences of the page.
    """

    page: Path
    figures: Path
    status: str
    rows: tuple[ReviewRow, ...]
    plan: ScenePlan
    verdict: str = ""
    facts: str = ""
    warnings: tuple[str, ...] = ()
    resumed: int = 0

    def to_pandas(self) -> Any:
        """Return a `pandas.DataFrame` with a line per row of the report: names, ΔE94 of the fast image, and provenance
        of the material.

        Raises
        ------
        InputError : pandas is not installed.
        """
        return data_frame(_HEADINGS, self._lines())

    def plot(self, axes: Any = None) -> Any:
        """Plot the 99th percentile of ΔE94 of each row with matplotlib; returns the axes.

        Raises
        ------
        InputError : matplotlib is not installed.
        """
        axes = new_axes() if axes is None else axes
        axes.barh([f"{one.material}, {one.illuminant}" for one in self.rows], [one.statistics.p99 for one in self.rows])
        axes.invert_yaxis()
        axes.set_xlabel("ΔE94, 99th percentile")
        return axes

    def _lines(self) -> Iterator[list[object]]:
        for one in self.rows:
            found, standing = one.statistics, one.provenance.get("Standing", "unknown")
            yield [one.material, one.illuminant, one.observer, found.mean, found.p95, found.p99, found.max, standing]

    def _repr_html_(self) -> str:
        words = (
            f"<p><b>{html.escape(self.verdict)}</b><br>{html.escape(self.facts)}<br>{html.escape(str(self.page))}</p>"
        )
        return words + html_table(_HEADINGS, list(self._lines()))


def review(
    scene: Scene,
    catalogue: Catalogue,
    out: str | Path,
    *,
    illuminants: Sequence[str] | None = None,
    materials: Sequence[str] | None = None,
    budget: float = 1.0,
    renderer: RenderSession,
    camera: str | None = None,
    size: int | None = None,
    reference_size: int | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    version: str,
    progress: Progress | None = None,
    warn: Warn = unheard,
    again: bool = False,
    ratings: Sequence[Rating] = (),
    resumed: Callable[[int, int], None] = lambda found, total: None,
    left: TimeLeft | None = None,
) -> ReviewResult:
    """Render a review, compare it with the reference, and write the report.

    `materials`, or those of the scene's review, are swept over one part, the review's or the first. Without either, the
    unchanged scene is judged, each material over its own pixels. The sample is the renderer's image from fast forms;
    the reference is `lighting.reference.reference` from the original data.

    Rows of an earlier review with identical inputs are reused. An interrupted review leaves finished rows in the folder
    `unfinished`, and the previous report intact.

    Parameters
    ----------
    out : folder, created if missing, for `index.html`, `review.json`, the files of `write_review_row` in `pictures/`,
        and reusable rows in `rows/`.
    illuminants : names; None: those of the scene's review, or `OWN_LIGHT`.
    materials : ids or patterns instead of those of the scene's review.
    budget : ΔE94 that the 99th percentile of each row is held against.
    size, reference_size : pixels on the longer side of images, by default the camera's, and of references, by default
        as large as the images. Figures, maps and EXRs have the size of the references.
    jobs : processes for references.
    scheduler : address of a Dask scheduler whose workers draw all rows instead (`cluster`); this process writes them.
    progress : called with (rows done, number of rows, material) for each drawn row.
    again : draw every row, also existing ones.
    ratings : a reviewer's protocol (`calibration.report.rating`), for the report.
    resumed : called with (reused rows, number of rows), if any are reused, before the others are drawn.
    left : estimator of the remaining time, updated with expected and finished work.
    warn : called with a message for each reason why images show nothing; the report repeats them.

    Raises
    ------
    InputError : a camera that sees no surface, not the reviewed part, or nothing lit; an unusable file, name or
        cluster; a cluster with different inputs.
    """
    out = Path(out)
    with drawing_into(out):
        warnings = Warnings(warn)
        setting, cases = prepare_review(
            scene,
            catalogue,
            renderer,
            illuminants=illuminants,
            materials=materials,
            views=review_views(scene, camera, size, reference_size),
            budget=budget,
            version=version,
            warn=warnings,
        )
        work = ReviewWork(out, TimeLeft() if left is None else left)
        scenes = [(case.scene, case.judged) for case in cases]
        work.expect(scenes, catalogue, (setting.view, setting.shown_view), len(setting.names), jobs)
        keys = [case_key(setting, catalogue, case, case is cases[0]) for case in cases]
        drawn: list[DrawnRows | None] = [None if again else found_rows(out, key) for key in keys]
        for index, found in enumerate(drawn):
            if found is not None:
                work.there(index)
        there = _rows_in(drawn)
        if there:
            resumed(there, setting.total)

        def reached() -> str:
            done = _rows_in(drawn)
            return f"{done} of {setting.total} rows are in {out}; the same command goes on from here." if done else ""

        with saying(reached):
            reading_of = cache(lambda material: InstrumentReading.of(setting.records[material].brdf()))
            _draw_missing(
                out, catalogue, setting, cases, keys, drawn, (jobs, scheduler), progress, work, warnings, reading_of
            )
            work.report(0.0)
            result = _report(out, setting, cases, keys, [one for one in drawn if one], warnings, ratings, reading_of)
            work.report(1.0)
    return replace(result, resumed=there)


def _rows_in(drawn: Sequence[DrawnRows | None]) -> int:
    return sum(len(found.rows) for found in drawn if found)


def _report(
    out: Path,
    setting: Setting,
    cases: Sequence[ReviewCase],
    keys: Sequence[str],
    drawn: Sequence[DrawnRows],
    warnings: Warnings,
    ratings: Sequence[Rating],
    reading_of: ReadingOf,
) -> ReviewResult:
    """Write the report of all rows, and move everything into place."""
    it = setting
    rows = tuple(row for found in drawn for row in found.rows)
    # Known differences, inserted into the first material's reference.
    checks = next((found.checks for found in drawn), ())
    for line in (line for found in drawn for line in found.warnings):
        warnings(line)
    bounces = {int(case.scene.bounces) for case in cases}
    lit_by = (bounces, it.plan, it.names, it.spectra, it.display, "GPU" if it.gpu else "CPU")
    report = out / UNFINISHED / ".report"
    with clearing(lambda: rmtree(report, ignore_errors=True)):
        write_report(
            report,
            rows,
            it.plan,
            it.renderer.made_by,
            it.budget,
            colour_chain(it.scene, it.view, *lit_by),
            it.version,
            checks=checks,
            title=f"Colour review: {it.scene.name}",
            warnings=warnings.said,
            history=read_history(out / HISTORY),
            ratings=ratings,
            materials=reviewed_materials(it, tuple(dict.fromkeys(row.material for row in rows)), reading_of),
            lights=reviewed_lights(it),
            display=it.display.name,
        )
        put_in_place(out, keys, report)
    page, figures = (out / name for name in REPORT)
    said = verdict_of(rows, it.budget, it.display.name, checks)
    found = status(rows, it.budget, checks)
    return ReviewResult(page, figures, found, rows, it.plan, *said, tuple(warnings.said))


def _draw_missing(
    out: Path,
    catalogue: Catalogue,
    setting: Setting,
    cases: Sequence[ReviewCase],
    keys: Sequence[str],
    drawn: list[DrawnRows | None],
    workers: tuple[int, str | None],
    progress: Progress | None,
    work: ReviewWork,
    warn: Warn,
    reading_of: ReadingOf,
) -> None:
    """Draw the entries of `drawn` that are None; each is stored in the folder first.

    workers : processes for references; address of a scheduler whose workers do all work, or None.
    """
    jobs, scheduler = workers
    missing = _dearest_first(setting, cases, [index for index, found in enumerate(drawn) if found is None])
    for index in missing[:1]:
        work.first(index)
    done = setting.total - sum(len(cases[index].judged) for index in missing) * len(setting.names)

    at, drawn_of = 0, Counter[int]()

    def finished(row: ReviewRow) -> None:
        nonlocal done
        done += 1
        drawn_of[at] += 1
        work.rows(at, drawn_of[at] / (len(cases[at].judged) * len(setting.names)))
        if progress is not None:
            progress(done, setting.total, row.material)

    if scheduler is not None:
        orders = ((index, cases[index], keys[index], index == 0) for index in missing)
        with closing(drawn_on_cluster(setting, catalogue, orders, scheduler)) as results:
            for index, found, files in results:
                with drawn_rows(out, keys[index]) as (folder, kept):
                    for name, content in files.items():
                        (folder / name).write_bytes(content)
                    kept.append(found)
                drawn[index] = found
                for line in found.warnings:
                    warn(line)
                for row in found.rows:
                    finished(row)
        return
    scenes = [cases[index].scene for index in missing]
    truths = reference_pictures(
        scenes,
        catalogue,
        setting.view,
        setting.spectra,
        setting.geometry,
        jobs,
        setting.budget,
        lambda number, share: work.traced(missing[number], share),
    )
    with closing(truths):
        for index, truth in zip(missing, truths, strict=True):
            at = index
            work.rows(index, 0.0)
            with drawn_rows(out, keys[index]) as (folder, kept):
                kept.append(drawn_case(setting, cases[index], truth, folder, index == 0, finished, warn, reading_of))
            drawn[index] = kept[0]


def _dearest_first(setting: Setting, cases: Sequence[ReviewCase], some: Sequence[int]) -> list[int]:
    """Order cases so that no process works alone at the end: materials of a common model share most of their reference,
    so those of the rarest models are most expensive and come first.
    """
    models = [[setting.records[name].model for name in case.judged] for case in cases]
    alike = Counter(model for index in some for model in models[index])
    return sorted(some, key=lambda index: min(alike[model] for model in models[index]))
