"""Descriptions in a review: provenance of materials, and the colour chain from spectrum to display."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ...calibration.display.record import read_record
from ...lighting.camera import Camera
from ...lighting.mesh.ray_index import rays_words
from ...lighting.plan import ScenePlan
from ...lighting.reference.geometry import VisibleGeometry
from ...lighting.scene import Scene
from ...materials.core.surface import Surface
from ...materials.records.description import shown_reconstruction
from ...materials.records.material import MaterialRecord
from ...materials.records.standing import missed_words
from ...runtime.errors import InputError
from ...runtime.wording import counted
from ...spectral.spectrum import Spectrum
from ..display.transform import DisplayTransform

# Tolerance of cosines of measured directions.
_ROUNDING = 1e-6
#: File written by `metamer display config` next to a configuration.
RECORD = "display.json"


def provenance_words(record: MaterialRecord) -> dict[str, str]:
    """Describe the provenance of a material and the error of its fit, by label."""
    said = record.provenance
    words = {"Source": said.source, "Licence": said.licence, "Standing": said.kind, "Model": record.model}
    if said.geometry:
        words["Geometry"] = said.geometry
    if said.notes:
        words["Notes"] = "; ".join(said.notes.split(" + "))
    words |= shown_reconstruction(record)
    words["Terms"] = str(sum(one.rank for one in record.summands))
    if record.error is not None:
        error = record.error
        under = ", ".join(f"{one.light} {one.p99:.2f}" for one in error.lights)
        others = f"; p99 by light: {under}" if under else ""
        words["Fit"] = f"ΔE94 mean {error.mean:.2f}, p99 {error.p99:.2f} under {error.light}{others} ({error.protocol})"
        if missed := missed_words(error):
            words["Budget"] = missed
    return words


def held_words(scene: Scene, geometry: VisibleGeometry, material: str, surface: Surface) -> tuple[str, ...]:
    """Describe the share of an image that shows a material at angles where it was not measured."""
    if surface.measured_to is None:
        return ()
    own = np.isin(geometry.part, [at for at, part in enumerate(scene.parts) if part.material == material])
    lit = [(own[one.sample], one.wi) for one in geometry.lit]
    found = (
        ("seen", geometry.wo[own, 2], surface.measured_to[0]),
        ("lit", np.concatenate([wi[here, 2] for here, wi in lit] or [np.zeros(0)]), surface.measured_to[1]),
    )
    notes = []
    for words, cosine, degrees in found:
        held = np.count_nonzero(cosine < np.cos(np.radians(degrees)) - _ROUNDING)
        if held:
            share = f"{held / len(cosine):.1%} of its points"
            notes.append(f"{share} are {words} from beyond {degrees:g}° off the normal, where values are held.")
    return tuple(notes)


def colour_chain(
    scene: Scene,
    view: Camera,
    bounces: Collection[int],
    plan: ScenePlan,
    names: Sequence[str],
    spectra: Sequence[Spectrum | None],
    display: DisplayTransform,
    encoded_on: str,
) -> list[str]:
    """Return the colour chain from spectrum to display, one sentence per step; `bounces` are those of all images."""
    observer = scene.observer
    traced = f"Reference: {rays_words()}, the original data of each material at every wavelength, float64"
    if scene.spread_lights:
        traced += "; directions of area and environment light are sampled until the noise, stated by row, is a "
        traced += "tenth of the budget (mean)"
    lights = ", ".join(names)
    basis = f"in a basis of at most {plan.basis_size} coefficients ({plan.basis.name})"
    words = [
        f"Lights: {lights}, each folded with the {observer.name} at its own resolution; Y = 1 is the perfect diffuser "
        f"that receives {scene.viewing.reference_illuminance_lux:g} lx.",
        f"{traced}.",
        f"Sample: the materials' fast forms (factor packs, textures) "
        f"{'in bases of their own' if scene.bounces else basis}, folded with light and observer, {plan.precision}.",
        f"Both: {view.samples} x {view.samples} points a pixel, averaged in linear XYZ; direct light with shadows, "
        f"{_bounces_words(bounces)}.",
        "Difference: CIE 1994 (graphic arts) in CIELAB relative to the white of each light, unclipped, over the pixels "
        "that the material covers wholly and light reaches.",
    ]
    for name, spectrum in zip(names, spectra, strict=True):
        note = None if spectrum is None else spectrum.range_note(observer.wavelengths_nm)
        if note:
            words.append(f"{name} is {note}.")
    return [
        *words,
        *display.describe(),
        *display_words(display),
        f"The display transform ran on the {encoded_on}, as OpenColorIO wrote it for it; PNG, 8 bits a channel.",
        *scene.notes,
    ]


def _bounces_words(bounces: Collection[int]) -> str:
    fewest, most = min(bounces), max(bounces)
    if not most:
        return "no interreflection"
    return f"and interreflection, {f'{fewest} to ' if fewest < most else ''}{counted(most, 'bounce')}"


def display_words(display: DisplayTransform, now: datetime | None = None) -> list[str]:
    """Return sentences on name, model, and last verification with its age; none for an uncharacterised display."""
    path = Path(display.config_name).parent / RECORD
    if display.config_name.startswith("ocio://") or not path.is_file():
        return []
    try:
        record = read_record(path)
    except InputError as reason:
        return [f"The file of the display cannot be used: {reason.file}: {reason.problem}."]
    words = [
        f"Display: {record.name}, characterised by {len(record.readings)} patches, model {record.model.name}, observer "
        f"{record.readings.observer}."
    ]
    if not record.verifications:
        return [*words, "It was never verified: `metamer display verify` says whether it still shows what it did."]
    last = record.verifications[-1]
    average = last.get("figures", {}).get("average")
    figure = "" if average is None else f", ΔE {average:.2f} on average"
    return [*words, f"Last verified {last.get('when', '')} ({_age(str(last.get('when', '')), now)}) by "
            f"{last.get('criteria', '')}: {last.get('verdict', '')}{figure}."]  # fmt: skip


def _age(when: str, now: datetime | None) -> str:
    try:
        then = datetime.fromisoformat(when)
    except ValueError:
        return "of unknown age"
    days = ((now or datetime.now(UTC)) - then).days
    return "today" if days < 1 else f"{counted(days, 'day')} ago"
