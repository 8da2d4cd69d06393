"""A review: every material under every light, rendered, compared with the truth, and written as a report."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from shutil import rmtree

import numpy as np
from jaxtyping import Float

from ..calibration.report import status, write_report
from ..calibration.row import ReviewRow, RowColour, review_row
from ..calibration.statistics import DeltaEStatistics, SelfCheck, delta_e_map, delta_e_statistics, self_check
from ..lighting.camera import Camera
from ..lighting.geometry import VisibleGeometry, visible_geometry
from ..lighting.placement import looks_past, placement_warnings, why_black
from ..lighting.plan import ScenePlan, plan_scene
from ..lighting.scene import Scene
from ..materials.catalogue import Catalogue
from ..materials.factors import FactorPack
from ..materials.reading import GEOMETRY, Reading
from ..materials.records.material import MaterialRecord
from ..spectral.difference import lab_from_xyz
from ..spectral.ending import clearing, saying
from ..spectral.errors import InputError
from ..spectral.illuminants import illuminant
from ..spectral.image import ColourImage
from ..spectral.spectrum import Spectrum
from .display import DisplayTransform
from .display_gl import DisplayPass
from .picture import Warn, display_for, display_pass, picture_words, say_if_clipped, unheard
from .png import quantise
from .reading import swatch, xyz_in
from .references import Reference, references
from .renderer import Renderer
from .review_files import picture_name, write_row
from .review_folder import REPORT, UNFINISHED, Drawn, drawing_into, drawn_rows, found_rows, put_in_place
from .review_key import row_key
from .review_words import colour_chain, provenance_words

#: What an illuminant is called where each light keeps its own; one can ask for it so, too.
OWN_LIGHT = "the scene's lights"

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class ReviewResult:
    """Where a review was written, and how it came out; `resumed` of its rows were there already."""

    page: Path
    figures: Path
    status: str
    rows: tuple[ReviewRow, ...]
    plan: ScenePlan
    warnings: tuple[str, ...] = ()
    resumed: int = 0


@dataclass(frozen=True)
class _Case:
    """One picture under all illuminants, and the materials in it that are judged."""

    scene: Scene
    judged: tuple[str, ...]


@dataclass
class _Timer:
    """Seconds by the name of the step."""

    seconds: dict[str, float] = field(default_factory=dict)
    _last: float = field(default_factory=time.perf_counter)

    def lap(self, step: str, share: int = 1) -> None:
        now = time.perf_counter()
        self.seconds[step] = (now - self._last) / share
        self._last = now


def review(
    scene: Scene,
    catalogue: Catalogue,
    out: str | Path,
    *,
    illuminants: Sequence[str] | None = None,
    materials: Sequence[str] | None = None,
    budget: float = 1.0,
    renderer: Renderer,
    camera: str | None = None,
    jobs: int = 1,
    version: str,
    progress: Progress | None = None,
    warn: Warn = unheard,
    again: bool = False,
    resumed: Callable[[int, int], None] = lambda found, total: None,
) -> ReviewResult:
    """Render, compare and report.

    `materials`, or those of the scene's review, are swept over one part, the review's or the first. Without either, the
    scene is judged as it stands, material by material, each over the pixels that show it. The sample is the renderer's
    picture from factor packs; the reference is `lighting.reference` from the original data.

    Rows that an earlier review has drawn from the very same things are taken as they are. A review that is broken off
    leaves what it has drawn in the folder `unfinished`, and a report that was there before.

    Parameters
    ----------
    out : folder, made where missing: `index.html`, `review.json`, what `write_row` writes in `pictures/`, and in
        `rows/` what another review into it may take over.
    illuminants : names; None takes those of the scene's review, or `OWN_LIGHT`.
    materials : ids or patterns in place of those of the scene's review.
    budget : ΔE94 that the 99th percentile of each row is held against.
    jobs : processes that compute references.
    progress : called with (rows done, rows in all, material) for each row that is drawn.
    again : draw every row, also those that are there.
    resumed : called with (rows that were there, rows in all), where there are any, before the others are drawn.
    warn : called at once with a line for each reason why pictures show nothing; the report repeats them.

    Raises
    ------
    InputError : the camera sees no surface, not the part that is reviewed, or nothing that light reaches; a file or a
        name that cannot be used.
    """
    out = Path(out)
    with drawing_into(out):
        names = tuple(dict.fromkeys(illuminants or (scene.review.illuminants if scene.review else (OWN_LIGHT,))))
        spectra = tuple(None if name == OWN_LIGHT else illuminant(name) for name in names)
        view = scene.camera(camera)
        if materials and scene.review is None:
            where = f'The scene has no [review]: the materials are put on its first part, "{scene.reviewed_part}".'
            scene = replace(scene, notes=(*scene.notes, where))
        cases = _cases(scene, catalogue, materials)
        records = {
            material_id: catalogue.surface(material_id)
            for material_id in dict.fromkeys(m for case in cases for m in case.scene.material_ids)
        }
        lights = _distinct_lights(scene, spectra)
        plan = plan_scene([record.packs for record in records.values()], lights, scene.observer, budget)
        display = display_for(scene.viewing)
        _check_whites(scene, names, spectra, display)
        gpu = display_pass(renderer, display)
        geometry = visible_geometry(scene, view)
        warnings = _Warnings(warn)
        _check_view(scene, view, geometry, warnings)
        total = sum(len(case.judged) for case in cases) * len(names)
        setting = _Setting(
            scene, view, geometry, names, spectra, records, plan, display, gpu, renderer, budget, total, version
        )
        keys = [_key(setting, catalogue, case, case is cases[0]) for case in cases]
        drawn: list[Drawn | None] = [None if again else found_rows(out, key) for key in keys]
        there = sum(len(found.rows) for found in drawn if found)
        if there:
            resumed(there, total)

        def reached() -> str:
            done = sum(len(found.rows) for found in drawn if found)
            return f"{done} of {total} rows are in {out}; the same command goes on from here." if done else ""

        with saying(reached):
            _draw_missing(out, catalogue, setting, cases, keys, drawn, jobs, progress, warnings)
            rows = [row for found in drawn if found for row in found.rows]
            # Known differences, put into the first material's reference.
            checks = next((found.checks for found in drawn if found), ())
            for line in (line for found in drawn if found for line in found.warnings):
                warnings(line)
            report = out / UNFINISHED / ".report"
            with clearing(lambda: rmtree(report, ignore_errors=True)):
                write_report(
                    report,
                    rows,
                    plan,
                    renderer.made_by,
                    budget,
                    colour_chain(scene, view, plan, names, spectra, display, "GPU" if gpu else "CPU"),
                    version,
                    checks=checks,
                    title=f"Colour review: {scene.name}",
                    warnings=warnings.said,
                )
                put_in_place(out, keys, report)
    page, figures = (out / name for name in REPORT)
    return ReviewResult(page, figures, status(rows, budget, checks), tuple(rows), plan, tuple(warnings.said), there)


@dataclass(frozen=True, eq=False)
class _Setting:
    """What all rows of a review have in common."""

    scene: Scene
    view: Camera
    geometry: VisibleGeometry
    names: tuple[str, ...]
    spectra: tuple[Spectrum | None, ...]
    records: Mapping[str, MaterialRecord]
    plan: ScenePlan
    display: DisplayTransform
    gpu: DisplayPass | None
    renderer: Renderer
    budget: float
    total: int
    version: str


def _key(setting: _Setting, catalogue: Catalogue, case: _Case, checked: bool) -> str:
    """The hash of what the rows of a case depend on; `checked`: the report's checks of itself are made with them."""
    it = setting
    lit, more = (it.names, it.spectra), (it.renderer.made_by, it.version, *case.judged, checked)
    return row_key(case.scene, it.view, catalogue, *lit, it.plan, it.display, it.budget, it.total, more)


def _draw_missing(
    out: Path,
    catalogue: Catalogue,
    setting: _Setting,
    cases: Sequence[_Case],
    keys: Sequence[str],
    drawn: list[Drawn | None],
    jobs: int,
    progress: Progress | None,
    warn: Warn,
) -> None:
    """Fill in `drawn` where it is None; each entry is kept in the folder before it stands there."""
    missing = [index for index, found in enumerate(drawn) if found is None]
    done = setting.total - sum(len(cases[index].judged) for index in missing) * len(setting.names)
    packs = {
        name: tuple(p.in_basis(setting.plan.basis) for p in record.packs) for name, record in setting.records.items()
    }
    scenes = [cases[index].scene for index in missing]
    truths = references(scenes, catalogue, setting.view, setting.spectra, setting.geometry, jobs)
    with closing(truths):
        for index, truth in zip(missing, truths, strict=True):
            heard = _Warnings(warn)
            with drawn_rows(out, keys[index]) as (folder, kept):
                rows: list[ReviewRow] = []
                checks: list[SelfCheck] | None = [] if index == 0 else None
                for row in _rows(setting, cases[index], packs, truth, folder, checks, heard):
                    rows.append(row)
                    done += 1
                    if progress is not None:
                        progress(done, setting.total, row.material)
                kept.append(Drawn(tuple(rows), tuple(checks or ()), tuple(heard.said)))
            drawn[index] = kept[0]


def _rows(
    setting: _Setting,
    case: _Case,
    packs: Mapping[str, tuple[FactorPack, ...]],
    reference: Reference,
    out: Path,
    checks: list[SelfCheck] | None,
    warn: Warn,
) -> Iterator[ReviewRow]:
    """Draw and compare one case; its pictures go below `out`, and, where they are wanted, self checks into `checks`."""
    scene, view, geometry = setting.scene, setting.view, setting.geometry
    names, spectra, display, gpu = setting.names, setting.spectra, setting.display, setting.gpu
    reference_xyz, reference_seconds = reference
    timer = _Timer()
    shown = {name: packs[name] for name in case.scene.material_ids}
    pictures_xyz = setting.renderer.render_many(case.scene, view, shown, spectra)
    timer.lap("render", len(names))
    timer.seconds["reference"] = reference_seconds / len(names)
    readings = {material_id: Reading.of(setting.records[material_id].brdf()) for material_id in case.judged}
    for index, name in enumerate(names):
        spectrum = spectra[index]
        lit = case.scene if spectrum is None else case.scene.with_illuminant(spectrum, name)
        white = lit.adopted_white()
        background = white * scene.viewing.background_reflectance
        sample_xyz, coverage = pictures_xyz[index]
        sample = ColourImage(sample_xyz, "xyz", white)
        truth = ColourImage(reference_xyz[index], "xyz", white)
        timer.lap("prepare")
        shown_rgb, notes = display.encode(sample, coverage, background, gpu)
        truth_rgb, _ = display.encode(truth, geometry.coverage, background, gpu)
        if notes:
            said_of = f"the picture of {' and '.join(case.judged)} under {name}"
            say_if_clipped(scene, said_of, sample, np.asarray(coverage), display, warn)
        timer.lap("encode", len(case.judged))
        for material_id in case.judged:
            timer.lap("prepare")
            share = np.minimum(coverage, _share_of(geometry, case.scene, material_id))
            difference = delta_e_map(reference_xyz[index], sample.values, white, share)
            statistics = _statistics(difference, material_id, name)
            if checks is not None and not checks:
                checks.extend(self_check(reference_xyz[index], white, share))
            timer.lap("compare")
            said = {"material": material_id, "illuminant": name, "observer": scene.observer.name}
            image, files = write_row(
                out,
                picture_name(material_id, None if spectrum is None else name),
                shown_rgb,
                display.display,
                sample,
                truth,
                (coverage, geometry.coverage),
                difference,
                picture_words(lit, view, setting.renderer.made_by, setting.version) | {"material": material_id},
            )
            timer.lap("write")
            timer.seconds["write"] += timer.seconds["encode"]
            reading = readings[material_id]
            xyz = xyz_in(lit, reading)
            yield review_row(
                **said,
                statistics=statistics,
                picture=quantise(shown_rgb),
                reference=quantise(truth_rgb),
                delta_e=difference,
                budget=setting.budget,
                rows=setting.total,
                image=image,
                files=files,
                seconds={step: timer.seconds[step] for step in ("render", "reference", "compare", "write")},
                wavelengths_nm=reading.wavelengths_nm,
                reflectance=reading.factor,
                reflectance_label="Radiance factor, light at 45°, seen from 0°",
                swatch=swatch(display, xyz, white),
                colour=RowColour(xyz, lab_from_xyz(xyz, white), GEOMETRY),
                white_xyz=white,
                notes=notes,
                provenance=provenance_words(setting.records[material_id]),
            )


class _Warnings:
    """Warnings as they are said, each once."""

    def __init__(self, warn: Warn) -> None:
        self._warn = warn
        self.said: list[str] = []

    def __call__(self, line: str) -> None:
        if line not in self.said:
            self.said.append(line)
            self._warn(line)


def _check_view(scene: Scene, view: Camera, geometry: VisibleGeometry, warn: Warn) -> None:
    """Warn of what stands wrong; refuse a view without what is to be judged, or without light, before the long work."""
    for line in placement_warnings(scene, view):
        warn(line)
    hint = "move the camera, or leave its position out for one that frames the scene"
    if not len(geometry.pixel):
        raise InputError(looks_past(scene, view), file=scene.path, field=f"camera {view.name}", hint=hint)
    if scene.review is not None:
        number = [part.name for part in scene.parts].index(scene.review.on)
        if not (geometry.part == number).any():
            seen = ", ".join(scene.parts[index].name for index in np.unique(geometry.part))
            problem = f'camera "{view.name}" does not see part "{scene.review.on}", which is reviewed'
            raise InputError(problem, file=scene.path, field=f"camera {view.name}", found=f"it sees {seen}", hint=hint)
    for line in why_black(scene, view, geometry):
        # Black equals black: every row would be within its budget.
        raise InputError(line, file=scene.path, field="lights", hint="move the light or the camera")


def _check_whites(
    scene: Scene, names: Sequence[str], spectra: Sequence[Spectrum | None], display: DisplayTransform
) -> None:
    """Say before the long work, not after it, that pictures under a light cannot be shown."""
    for name, spectrum in zip(names, spectra, strict=True):
        lit = scene if spectrum is None else scene.with_illuminant(spectrum, name)
        try:
            display.adaptation_from(lit.adopted_white())
        except InputError as error:
            raise error.at(file=scene.path, field=f"illuminant {name}", found=f"white {error.found}") from error


def _cases(scene: Scene, catalogue: Catalogue, materials: Sequence[str] | None) -> list[_Case]:
    if scene.review is None and not materials:
        return [_Case(scene, scene.material_ids)]
    patterns = materials or (scene.review.materials if scene.review else ())
    ids = dict.fromkeys(found for pattern in patterns for found in catalogue.match_surfaces(pattern))
    return [_Case(scene.with_material(scene.reviewed_part, material_id), (material_id,)) for material_id in ids]


def _statistics(difference: Float[np.ndarray, "H W"], material_id: str, illuminant_name: str) -> DeltaEStatistics:
    try:
        return delta_e_statistics(difference)
    except InputError as reason:
        raise reason.at(field=f"{material_id} under {illuminant_name}") from None


def _distinct_lights(scene: Scene, spectra: Sequence[Spectrum | None]) -> list[Spectrum]:
    """Every light spectrum that the review shows, each once."""
    found = [s for other in spectra for s in ([light.spectrum for light in scene.lights] if other is None else [other])]
    return list({(s.wavelengths_nm.tobytes(), s.samples.tobytes()): s for s in found}.values())


def _share_of(geometry: VisibleGeometry, scene: Scene, material_id: str) -> Float[np.ndarray, "H W"]:
    """(H,W) share of each pixel that shows a material."""
    wearing = [index for index, part in enumerate(scene.parts) if part.material_id == material_id]
    pixels = geometry.pixel[np.isin(geometry.part, wearing)]
    hits = np.bincount(pixels, minlength=geometry.rows * geometry.width)
    return hits.reshape(geometry.rows, geometry.width) / geometry.samples
