"""Cases of a review: materials and lights, and data common to its rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...lighting.camera import Camera
from ...lighting.plan import ScenePlan, plan_scene
from ...lighting.reference.geometry import VisibleGeometry, visible_geometry
from ...lighting.reference.placement import looks_past, placement_warnings, why_black
from ...lighting.scene import Scene
from ...materials.catalogue.catalogue import Catalogue
from ...materials.core.fast import Fast
from ...materials.records.material import MaterialRecord
from ...runtime.errors import InputError
from ...spectral.illuminants import illuminant
from ...spectral.spectrum import Spectrum
from ..display.gl_pass import DisplayPass
from ..display.transform import DisplayTransform
from ..picture import Warn, display_for, display_pass
from ..render.indirect_cache import with_counted_bounces
from ..render.session import RenderSession

#: Name of the illuminant for the lights' own spectra; it can be requested by this name.
OWN_LIGHT = "the scene's lights"


@dataclass(frozen=True)
class ReviewCase:
    """One scene under all illuminants, and its judged materials.

    plan : of this scene alone, independent of other materials of the review. surfaces : fast forms of its materials, in
    the plan's basis.
    """

    scene: Scene
    judged: tuple[str, ...]
    plan: ScenePlan
    surfaces: Mapping[str, Fast]


@dataclass(frozen=True, eq=False)
class Setting:
    """Data common to all rows of a review.

    view : of the comparison with the reference. shown_view : of the shown images, None for `view`.
    names, spectra : of the illuminants; None is each light's own. surfaces : fast forms by material. plan : the one
    with the most coefficients.
    budget : limit of the 99th percentile of ΔE94 of each row. total : number of rows.
    """

    scene: Scene
    view: Camera
    shown_view: Camera | None
    geometry: VisibleGeometry
    names: tuple[str, ...]
    spectra: tuple[Spectrum | None, ...]
    records: Mapping[str, MaterialRecord]
    surfaces: Mapping[str, Fast]
    plan: ScenePlan
    display: DisplayTransform
    gpu: DisplayPass | None
    renderer: RenderSession
    budget: float
    total: int
    version: str


def reviewed_lights_of(scene: Scene, illuminants: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the distinct lights of a review: `illuminants`, those of the scene's review, or `OWN_LIGHT`."""
    return tuple(dict.fromkeys(illuminants or (scene.review.illuminants if scene.review else (OWN_LIGHT,))))


def review_views(
    scene: Scene, camera: str | None, size: int | None, reference_size: int | None
) -> tuple[Camera, Camera | None]:
    """Return the view of the comparison with the reference, and that of the shown images if it differs.

    size, reference_size : pixels on the longer side of images and references; None: the camera's, and as large as the
        images.

    Raises
    ------
    InputError : a reference larger than the images, whose detail would be invisible.
    """
    view = scene.camera(camera)
    shown = view if size is None else view.sized(size)
    compared = shown if reference_size is None else view.sized(reference_size)
    if compared.width > shown.width or compared.height_px > shown.height_px:
        raise InputError(
            "references larger than the pictures",
            field="reference size",
            found=f"{compared.width} x {compared.height_px}",
            expected=f"at most {shown.width} x {shown.height_px}",
            hint=f"--size {max(compared.width, compared.height_px)} makes pictures as large",
        )
    same = (compared.width, compared.height_px) == (shown.width, shown.height_px)
    return compared, None if same else shown


def prepare_review(
    scene: Scene,
    catalogue: Catalogue,
    renderer: RenderSession,
    *,
    illuminants: Sequence[str] | None,
    materials: Sequence[str] | None,
    views: tuple[Camera, Camera | None],
    budget: float,
    version: str,
    warn: Warn,
) -> tuple[Setting, list[ReviewCase]]:
    """Prepare the setting and cases before rendering; parameters: see `review`; `views`: see `review_views`.

    Raises
    ------
    InputError : a camera that sees no surface, not the reviewed part, or nothing lit; an unusable file or name.
    """
    names = reviewed_lights_of(scene, illuminants)
    spectra = tuple(None if name == OWN_LIGHT else illuminant(name) for name in names)
    view, shown_view = views
    if materials and scene.review is None:
        where = f'The scene has no [review]: the materials are put on its first part, "{scene.reviewed_part}".'
        scene = replace(scene, notes=(*scene.notes, where))
    pictured = pictured_scenes(scene, catalogue, materials)
    records = {
        material_id: catalogue.surface(material_id)
        for material_id in dict.fromkeys(m for one, _ in pictured for m in one.material_ids)
    }
    surfaces = {name: record.drawn() for name, record in records.items()}
    _check_materials(pictured, records, surfaces)
    # Image and reference have the same number of bounces.
    shown_in = [one for one in spectra if one is not None]
    lights = _distinct_lights(scene, spectra)
    cases = []
    for one, judged in pictured:
        planned = plan_scene([surfaces[name] for name in one.material_ids], lights, scene.observer, budget)
        counted = with_counted_bounces(one, surfaces, shown_in)
        cases.append(ReviewCase(counted, judged, planned, shown_forms(one, surfaces, planned, scene.bounces != 0)))
    plan = _plan_of_all([case.plan for case in cases])
    display = display_for(scene)
    _check_whites(scene, names, spectra, display)
    needs_uv = any(case.scene.needs_uv(surfaces) for case in cases)
    geometry = visible_geometry(scene, view, with_uv=needs_uv)
    _check_view(scene, view, geometry, warn)
    setting = Setting(
        scene=scene,
        view=view,
        shown_view=shown_view,
        geometry=geometry,
        names=names,
        spectra=spectra,
        records=records,
        surfaces=surfaces,
        plan=plan,
        display=display,
        gpu=display_pass(renderer, display),
        renderer=renderer,
        budget=budget,
        total=sum(len(case.judged) for case in cases) * len(names),
        version=version,
    )
    return setting, cases


def shown_forms(scene: Scene, surfaces: Mapping[str, Fast], plan: ScenePlan, bounced: bool) -> dict[str, Fast]:
    """Return the fast forms of a scene's materials; without bounces in the plan's basis, which is for direct light
    only.
    """
    if bounced:
        return {name: surfaces[name] for name in scene.material_ids}
    return {name: surfaces[name].in_basis(plan.basis) for name in scene.material_ids}


def _plan_of_all(plans: Sequence[ScenePlan]) -> ScenePlan:
    """Return the plan with the most coefficients, for the report."""
    largest = max(plans, key=lambda one: one.basis_size)
    if len(plans) == 1:
        return largest
    fewest = min(one.basis_size for one in plans)
    size = f"{fewest}" if fewest == largest.basis_size else f"{fewest} to {largest.basis_size}"
    words = f"Each of {len(plans)} pictures is planned by itself, with {size} coefficients; this is the largest plan."
    return replace(largest, reasons=(words, *largest.reasons))


def _check_materials(
    pictured: Sequence[tuple[Scene, tuple[str, ...]]],
    records: Mapping[str, MaterialRecord],
    surfaces: Mapping[str, Fast],
) -> None:
    """Raise before rendering for materials that a part cannot have, or without a reading to judge by."""
    for scene, judged in pictured:
        scene.check_surfaces(surfaces)
        for name in judged:
            records[name].brdf()


def pictured_scenes(
    scene: Scene, catalogue: Catalogue, materials: Sequence[str] | None
) -> list[tuple[Scene, tuple[str, ...]]]:
    """Return the scenes to render, and the judged materials of each."""
    if scene.review is None and not materials:
        return [(scene, scene.material_ids)]
    patterns = materials or (scene.review.materials if scene.review else ())
    ids = dict.fromkeys(found for pattern in patterns for found in catalogue.match_surfaces(pattern))
    return [(scene.with_material(scene.reviewed_part, material_id), (material_id,)) for material_id in ids]


def _distinct_lights(scene: Scene, spectra: Sequence[Spectrum | None]) -> list[Spectrum]:
    """Return the distinct light spectra of the review."""
    own = [spectrum for light in scene.lights for spectrum in light.spectra]
    found = [s for other in spectra for s in (own if other is None else [other])]
    return list({spectrum.key: spectrum for spectrum in found}.values())


def _check_view(scene: Scene, view: Camera, geometry: VisibleGeometry, warn: Warn) -> None:
    """Warn of misplaced cameras and lights; raise for a view without judged surfaces or light, before the long work."""
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
        # Otherwise black would equal black, and every row would be within its budget.
        raise InputError(line, file=scene.path, field="lights", hint="move the light or the camera")


def _check_whites(
    scene: Scene, names: Sequence[str], spectra: Sequence[Spectrum | None], display: DisplayTransform
) -> None:
    """Raise before the long work if images under a light cannot be displayed."""
    for name, spectrum in zip(names, spectra, strict=True):
        lit = scene if spectrum is None else scene.with_illuminant(spectrum, name)
        try:
            display.adaptation_from(lit.adopted_white())
        except InputError as error:
            raise error.at(file=scene.path, field=f"illuminant {name}", found=f"white {error.found}") from error
