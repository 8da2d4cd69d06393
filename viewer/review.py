"""A review: every material under every light, rendered, compared with the truth, and written as a report."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..calibration.report import ReviewRow, review_row, status, write_report
from ..calibration.statistics import DeltaEStatistics, SelfCheck, delta_e_map, delta_e_statistics, self_check
from ..lighting.geometry import VisibleGeometry, visible_geometry
from ..lighting.plan import ScenePlan, plan_scene
from ..lighting.scene import Scene
from ..materials.brdf import Brdf
from ..materials.catalogue import Catalogue
from ..materials.records.record_colour import radiance_factor_45_0
from ..spectral.errors import InputError
from ..spectral.files import made_folder
from ..spectral.formats.xyz_exr import write_xyz_exr
from ..spectral.illuminants import illuminant
from ..spectral.image import ColourImage
from ..spectral.spectrum import Spectrum
from .display import DisplayTransform
from .picture import display_for, display_pass
from .png import quantise, write_png
from .references import references
from .renderer import Renderer
from .review_words import colour_chain, provenance_words

#: Word for "each light as the scene has it" where an illuminant is asked for.
OWN_LIGHT = "as lit"

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class ReviewResult:
    """Where a review was written, and how it came out."""

    page: Path
    figures: Path
    status: str
    rows: tuple[ReviewRow, ...]
    plan: ScenePlan


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
) -> ReviewResult:
    """Render, compare and report.

    A scene with a `review` sweeps materials over one part; any other is judged as it stands, material by material,
    each over the pixels that show it. The sample is the renderer's picture from factor packs; the reference is
    `lighting.reference` from the original data.

    Parameters
    ----------
    out : folder, made where missing: `index.html`, `review.json`, and a PNG and an XYZ EXR a row in `pictures/`.
    illuminants : names; None takes those of the scene's review, or `OWN_LIGHT`.
    materials : ids or patterns that replace those of the scene's review.
    budget : ΔE94 that the 99th percentile of each row is held against.
    jobs : processes that compute references.
    progress : called with (rows done, rows in all, material).
    """
    out = made_folder(out)
    made_folder(out / "pictures")
    names = tuple(dict.fromkeys(illuminants or (scene.review.illuminants if scene.review else (OWN_LIGHT,))))
    spectra = tuple(None if name == OWN_LIGHT else illuminant(name) for name in names)
    view = scene.camera(camera)
    cases = _cases(scene, catalogue, materials)
    records = {
        material_id: catalogue.surface(material_id)
        for material_id in dict.fromkeys(m for case in cases for m in case.scene.material_ids)
    }
    lights = _distinct_lights(scene, spectra)
    plan = plan_scene([record.packs for record in records.values()], lights, scene.observer, budget)
    packs = {name: tuple(p.in_basis(plan.basis) for p in record.packs) for name, record in records.items()}
    display = display_for(scene.viewing)
    _check_whites(scene, names, spectra, display)
    gpu = display_pass(renderer, display)
    geometry = visible_geometry(scene, view)
    rows: list[ReviewRow] = []
    checks: tuple[SelfCheck, ...] = ()
    total = sum(len(case.judged) for case in cases) * len(names)

    # Pictures of this run must never stand beside the figures of an earlier one, not even after Ctrl-C.
    for figures_of_before in (out / "index.html", out / "review.json"):
        figures_of_before.unlink(missing_ok=True)
    truths = references([case.scene for case in cases], catalogue, view, spectra, geometry, jobs)
    for case, (reference_xyz, reference_seconds) in zip(cases, truths, strict=True):
        timer = _Timer()
        shown = {name: packs[name] for name in case.scene.material_ids}
        pictures_xyz = renderer.render_many(case.scene, view, shown, spectra)
        timer.lap("render", len(names))
        timer.seconds["reference"] = reference_seconds / len(names)
        curves = {material_id: _reading(records[material_id].brdf()) for material_id in case.judged}
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
            timer.lap("encode", len(case.judged))
            for material_id in case.judged:
                timer.lap("prepare")
                share = np.minimum(coverage, _share_of(geometry, case.scene, material_id))
                difference = delta_e_map(reference_xyz[index], sample.values, white, share)
                statistics = _statistics(difference, material_id, name)
                checks = checks or self_check(reference_xyz[index], white, share)
                timer.lap("compare")
                image = f"pictures/{material_id.replace('/', '_')}.{name.replace(' ', '_').replace('/', '_')}.png"
                said = {"illuminant": name, "observer": scene.observer.name, "material": material_id}
                words = (f"{material_id} under {name}, {scene.observer.name}, Metamer {version}",)
                write_png(out / image, shown_rgb, display=display.display, words=words)
                exr = image.removesuffix("png") + "exr"
                write_xyz_exr(out / exr, sample, coverage, said)
                timer.lap("write")
                timer.seconds["write"] += timer.seconds["encode"]
                wavelengths_nm, factor = curves[material_id]
                rows.append(
                    review_row(
                        **said,
                        statistics=statistics,
                        picture=quantise(shown_rgb),
                        reference=quantise(truth_rgb),
                        delta_e=difference,
                        budget=budget,
                        rows=total,
                        image=image,
                        files={"XYZ EXR": exr},
                        seconds={step: timer.seconds[step] for step in ("render", "reference", "compare", "write")},
                        wavelengths_nm=wavelengths_nm,
                        reflectance=factor,
                        reflectance_label="Radiance factor, light at 45°, seen from 0°",
                        swatch=_swatch(display, lit, wavelengths_nm, factor, white),
                        white_xyz=white,
                        notes=notes,
                        provenance=provenance_words(records[material_id]),
                    )
                )
                if progress is not None:
                    progress(len(rows), total, material_id)
    page, figures = write_report(
        out,
        rows,
        plan,
        renderer.made_by,
        budget,
        colour_chain(scene, view, plan, names, spectra, display, "GPU" if gpu else "CPU"),
        version,
        checks=checks,
        title=f"Colour review: {scene.name}",
    )
    return ReviewResult(page, figures, status(rows, budget, checks), tuple(rows), plan)


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
    if scene.review is None:
        if materials:
            raise InputError(
                "this scene does not say on which part materials are swept",
                file=scene.path,
                field="[review] on",
                hint='add [review] with on = "PART", or leave --materials out',
            )
        return [_Case(scene, scene.material_ids)]
    patterns = materials or scene.review.materials
    ids = dict.fromkeys(found for pattern in patterns for found in catalogue.match_surfaces(pattern))
    return [_Case(scene.with_material(scene.review.on, material_id), (material_id,)) for material_id in ids]


def _statistics(difference: Float[np.ndarray, "H W"], material_id: str, illuminant_name: str) -> DeltaEStatistics:
    try:
        return delta_e_statistics(difference)
    except InputError as reason:
        raise reason.at(field=f"{material_id} under {illuminant_name}") from None


def _distinct_lights(scene: Scene, spectra: Sequence[Spectrum | None]) -> list[Spectrum]:
    """Every light spectrum that the review shows, each once."""
    found = [s for other in spectra for s in ([light.spectrum for light in scene.lights] if other is None else [other])]
    return list({(s.wavelengths_nm.tobytes(), s.values.tobytes()): s for s in found}.values())


def _share_of(geometry: VisibleGeometry, scene: Scene, material_id: str) -> Float[np.ndarray, "H W"]:
    """(H,W) share of each pixel that shows a material."""
    wearing = [index for index, part in enumerate(scene.parts) if part.material_id == material_id]
    pixels = geometry.pixel[np.isin(geometry.part, wearing)]
    hits = np.bincount(pixels, minlength=geometry.rows * geometry.width)
    return hits.reshape(geometry.rows, geometry.width) / geometry.samples


def _reading(brdf: Brdf) -> tuple[Float[np.ndarray, "L"], Float[np.ndarray, "L"]]:
    """Wavelengths in nm, and pi f_r at 45:0, the geometry that most colour instruments have."""
    return brdf.wavelengths_nm, radiance_factor_45_0(brdf)


def _swatch(
    display: DisplayTransform,
    scene: Scene,
    wavelengths_nm: np.ndarray,
    factor: np.ndarray,
    white: np.ndarray,
) -> tuple[int, int, int]:
    """The colour of a radiance factor in the mixture of lights that `white` is the white of."""
    middle = 0.5 * np.add(*scene.bounds)
    strengths = [float(light.incident(middle)[1]) for light in scene.lights]
    under_each = [scene.observer.weights(light.spectrum, wavelengths_nm) @ factor for light in scene.lights]
    xyz = np.average(under_each, axis=0, weights=strengths)
    rgb, _ = display.encode(ColourImage(xyz[None, None], "xyz", white))
    red, green, blue = (int(code) for code in quantise(rgb)[0, 0])
    return red, green, blue
