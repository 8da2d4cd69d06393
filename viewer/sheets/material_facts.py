"""A material of a catalogue as one page: rendered on a sphere, with everything that its record says."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import asdict

from jaxtyping import UInt8
from numpy import ndarray

from ...calibration.report.material_page import MaterialFacts, render_material_page
from ...lighting.scene import Scene
from ...materials.core.fast import Summand
from ...materials.core.fit_error import far_off
from ...materials.records.description import (
    shown_colours,
    shown_conditions,
    shown_reconstruction,
    shown_spectrum,
    shown_trials,
    shown_values,
    two_decimals,
)
from ...materials.records.material import MaterialRecord
from ...materials.records.models import no_surface
from ...materials.records.record_colour import record_colour
from ...materials.records.standing import missed_words
from ...materials.search.gloss import shown_gloss
from ...runtime.errors import InputError
from ..picture import display_for, display_pass, material_picture
from ..render.session import RenderSession
from ..review.words import provenance_words
from .preview import lights_in_words


def material_page(record: MaterialRecord, scene: Scene | None = None, renderer: RenderSession | None = None) -> str:
    """Return the page as HTML. `scene`, whose reviewed part wears the material, and `renderer` make its picture; a
    spectrum without a surface has none.
    """
    picture, words = None, no_surface(record.model).problem if not record.is_surface else "not rendered"
    if record.is_surface and scene is not None and renderer is not None:
        picture, words = _picture(record, scene, renderer)
    spectrum = shown_spectrum(record)
    headings, trials = shown_trials(record)
    return render_material_page(
        MaterialFacts(
            id=record.id,
            facts=_facts(record),
            provenance=provenance_words(record),
            spectrum=(spectrum.wavelengths_nm, spectrum.values),
            spectrum_label=spectrum.label,
            picture=picture,
            picture_words=words,
            packs=tuple(_summand(one) for one in record.summands),
            trial_headings=headings,
            trials=trials,
            tried=_tried(record),
            stated=_stated(record),
            original=shown_values(record.original),
            parameters=shown_values(record.parameters),
        )
    )


def _picture(record: MaterialRecord, scene: Scene, renderer: RenderSession) -> tuple[UInt8[ndarray, "H W 3"], str]:
    display = display_for(scene)
    picture, notes = material_picture(record, scene, renderer, display, display_pass(renderer, display))
    drawn = f"{record.drawn().WORDS.capitalize()} on a {scene.name.lower()} under {lights_in_words(scene)}"
    return picture, " ".join([f"{drawn}, {renderer.made_by}, for {display.name}.", *notes])


def _facts(record: MaterialRecord) -> dict[str, str]:
    colour, error = record_colour(record), record.error
    facts = {"Model": record.model, "Quantity": record.quantity, "Standing": record.provenance.kind}
    facts |= shown_reconstruction(record)
    if record.summands:
        facts["Terms"] = " + ".join(f"{one.rank} in {one.frame}" for one in record.summands)
    if error is not None:
        facts["Fit, ΔE94 mean"] = f"{error.mean:.3f}"
        facts["Fit, ΔE94 p99"] = f"{error.p99:.3f} ({error.light}, {error.observer})"
        facts["Fit, ΔE94 max"] = far_off(error) or f"{error.maximum:.3f}"
        if missed := missed_words(error):
            facts["Budget"] = missed
    if colour is not None:
        space = "Lab" if "Lab" in colour else "XYZ"
        facts[space] = f"{two_decimals(colour[space])} ({shown_conditions(colour)})"
        if words := shown_gloss(record, colour):
            facts["Gloss"] = words
    return facts


def _summand(summand: Summand) -> dict[str, str]:
    basis = summand.palette.basis
    return {
        "Frame": summand.frame,
        "Terms": str(summand.rank),
        "Grid": summand.grid,
        "Spectral coefficients": f"{basis.size} ({basis.name})",
        "Precision": summand.precision,
    }


def _tried(record: MaterialRecord) -> dict[str, list[tuple[float, float]]]:
    """(terms, ΔE94 p99) of the trials, by lobe and frame."""
    found: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for trial in record.trials:
        found[f"{trial.frame}, {'all packs together' if trial.joint else f'lobe {trial.lobe + 1}'}"].append(
            (float(trial.rank), trial.error.p99)
        )
    return {name: sorted(points) for name, points in found.items()}


def _stated(record: MaterialRecord) -> tuple[dict[str, str], ...]:
    try:
        found = shown_colours(record)
    except InputError as reason:
        return ({"conditions": str(reason), "space": "", "stated": "", "recomputed": "", "delta_e94": ""},)
    return tuple({**asdict(one), "conditions": "; ".join([one.conditions, *one.assumed])} for one in found)
