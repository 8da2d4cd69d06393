"""`metamer catalogue show`: one material in words, and as a page."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...calibration.report.text_tables import columns
from ...runtime.errors import visible
from ...runtime.wording import counted
from ..options import add_catalogue_argument, add_json_option, add_renderer_option, open_catalogue, renderer_for
from ..output import say, write_text
from ..progress.lines import progress_bar
from .texel import print_texel, texel

if TYPE_CHECKING:
    from ...materials.core.fast import Summand
    from ...materials.core.fit_error import FitError, LightError
    from ...materials.records.material import MaterialRecord

_INDENT = 14
# Seconds that a picture which should be quick has before it says how far it is.
_LATE_S = 2.0
# Details of a measured file that the source and the notes already show.
_SENTENCES = ("name", "description", "measurement_notes")


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `show`."""
    show = verbs.add_parser(
        "show",
        help="one material: provenance, spectrum, packs, measured error, speed against error",
        description="Show everything that is known of one material, in words or as a page.",
    )
    show.add_argument("id", metavar="ID", help='such as "colorchecker/red-gloss"')
    add_catalogue_argument(show)
    show.add_argument("--html", type=Path, metavar="FILE", help="write one self-contained page instead")
    show.add_argument("--texel", type=texel, metavar="X,Y", help="what one texel of a BTF shows, as charts instead")
    add_json_option(show, "with --texel: every figure, for a program")
    add_renderer_option(show)
    show.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Show; 0."""
    from ...runtime.errors import UsageError
    from ...runtime.files import check_writable

    if args.json is not None and args.texel is None:
        raise UsageError("--json is for --texel X,Y; what the heads of materials say is in `list --json`")
    if args.html is not None and args.texel is not None:
        raise UsageError("--html and --texel do not go together: the page is of the whole material")
    record = open_catalogue(args.catalogue).load(args.id)
    if args.texel is not None:
        print_texel(record, args.texel, args.json)
        return 0
    if args.html is not None:
        check_writable(args.html)
        _write_page(record, args.html, args.renderer)
        print(args.html)
        return 0
    for label, text in _facts(record):
        print(f"{label:{_INDENT}}{visible(text, lines=True)}")
    for title, text in _parts(record):
        print(f"\n{title}\n{visible(text, lines=True)}")
    return 0


def _facts(record: MaterialRecord) -> list[tuple[str, str]]:
    from ...materials.core.fit_error import far_off
    from ...materials.records.description import shown_reconstruction, shown_values
    from ...materials.records.record_colour import record_colour
    from ...materials.records.standing import missed_words
    from ...materials.search.gloss import shown_gloss

    said, colour = record.provenance, record_colour(record)
    shown = _SENTENCES if record.model == "scattered" else ()
    original = shown_values(record.original)
    # The file's own details of its measurement, a line each.
    details = {name[8:]: original.pop(name) for name in tuple(original) if name.startswith("details.")}
    lines = [
        ("material", record.id),
        ("model", record.model),
        ("quantity", record.quantity),
        ("parameters", _listed(shown_values(record.parameters, shown))),
        ("sliders", _sliders(record)),
        ("kind", said.kind),
        ("source", said.source),
        ("licence", said.licence),
        ("geometry", said.geometry or "not stated"),
        ("notes", said.notes.replace(" + ", f"\n{'':{_INDENT}}") or "none"),
        ("original", _listed(original)),
        ("details", f"\n{'':{_INDENT}}".join(f"{name} {' '.join(text.split())}" for name, text in details.items())),
        ("fast form", "; ".join(_summand(one) for one in record.summands) or "none: a spectrum without a surface"),
    ]
    lines = [line for line in lines if line[0] != "details" or details]
    if colour is not None:
        lines.append(("colour", colour_words(colour)))
        if words := shown_gloss(record, colour):
            lines.append(("gloss", words))
    lines += [(label.lower(), text) for label, text in shown_reconstruction(record).items()]
    if record.error:
        error = record.error
        figures = f"mean {error.mean:.3f}, p95 {error.p95:.3f}, p99 {error.p99:.3f}, max {error.maximum:.3f}"
        lines.append(("fit, ΔE94", f"{figures} ({error.light}, {error.observer})"))
        if words := far_off(error):
            lines.append(("far off", words))
        if error.lights:
            words = (f"{one.light} {one.p99:.3f}{_highlight(one)}" for one in error.lights)
            lines.append(("p99 by light", ", ".join(words)))
        if missed := missed_words(error):
            lines.append(("budget", missed))
        lines.append(("protocol", error.protocol))
    if record.fast is not None and (texels := record.fast.texel_error):
        figures = f"mean {texels.mean:.3f}, p95 {texels.p95:.3f}, p99 {texels.p99:.3f}, max {texels.maximum:.3f}"
        lines += [("of texels", f"ΔE94 {figures} ({texels.light})"), ("its protocol", texels.protocol)]
    if record.environment_error:
        lines += _environment(record, record.environment_error)
    return lines


def _sliders(record: MaterialRecord) -> str:
    """List the parameters that `transfer relight --set` may change, or state why there are none."""
    from ...materials.records.models import MEASURED
    from ...materials.search.sliders import sliders

    if not record.is_surface:
        return "none: a spectrum without a surface"
    if record.model in MEASURED:
        return f"none: no formula; metamer catalogue like {record.id} finds neighbours"
    shown = (f"{one.name} {one.value:g} ({one.domain.words})" for one in sliders(record.surface(), record.id))
    return ", ".join(shown) or "none"


def _environment(record: MaterialRecord, error: FitError) -> list[tuple[str, str]]:
    """Describe the form for environment light, and its error."""
    form = record.drawn().environment_form()
    lobes = "matt" if form.count == 0 else f"{counted(form.count, 'lobe')} and a cosine"
    figures = f"mean {error.mean:.3f}, p95 {error.p95:.3f}, p99 {error.p99:.3f}, max {error.maximum:.3f}"
    daylight = next((f"; p99 {one.p99:.3f} under D65" for one in error.lights if one.light == "D65"), "")
    return [
        ("environment", f"{lobes}, {counted(form.palette.rank, 'term')}; ΔE94 {figures} ({error.light}){daylight}"),
        ("its protocol", error.protocol),
    ]


def _highlight(light: LightError) -> str:
    return "" if light.highlight is None else f" (highlight {light.highlight:.3f})"


def _parts(record: MaterialRecord) -> list[tuple[str, str]]:
    from ...materials.records.description import shown_spectrum, shown_trials
    from .text_chart import text_chart

    spectrum = shown_spectrum(record)
    parts = [(f"Spectrum: {spectrum.label}", text_chart(spectrum.wavelengths_nm, spectrum.values))]
    stated = _stated(record)
    if stated:
        parts.append(("Stated colours against the spectrum (reference: stated)", stated))
    headings, trials = shown_trials(record)
    if trials:
        parts.append(("Speed against error: what the fit tried", columns(headings, trials, left=0)))
    return parts


def _stated(record: MaterialRecord) -> str:
    from ...materials.records.description import shown_colours
    from ...runtime.errors import InputError

    try:
        found = shown_colours(record)
    except InputError as reason:
        return f"not recomputed: {reason}"
    rows = [(one.conditions, one.space, one.stated, one.recomputed, one.delta_e94) for one in found]
    assumed = dict.fromkeys(clause for one in found for clause in one.assumed)
    headings = ("light, observer", "", "stated", "from the spectrum", "ΔE94")
    return "\n".join([columns(headings, rows, left=2), *(f"assumed: {clause}" for clause in assumed)]) if rows else ""


def _write_page(record: MaterialRecord, path: Path, renderer: str) -> None:
    from ...viewer.render.picture_cost import picture_cost
    from ...viewer.sheets.material_facts import material_page
    from ...viewer.sheets.preview import thumbnail_scene

    if record.is_surface:
        scene = thumbnail_scene(record.model)
        stages = picture_cost(scene, scene.camera()).stages
        with renderer_for(renderer) as drawing, progress_bar("Drawing", after=_LATE_S, stages=stages) as progress:
            drawing.configure(on_progress=progress, on_message=say)
            text = material_page(record, scene, drawing)
    else:
        text = material_page(record)
    write_text(path, text)


def colour_words(colour: Mapping[str, Any]) -> str:
    """Format the colour of a head."""
    from ...materials.records.description import shown_conditions, two_decimals

    lab = f"L*a*b* {two_decimals(colour['Lab'])}, " if "Lab" in colour else ""
    return f"{lab}XYZ {' '.join(f'{value:.4f}' for value in colour['XYZ'])} ({shown_conditions(colour)})"


def _summand(summand: Summand) -> str:
    size = summand.palette.basis.size
    shape = f"{summand.grid}; {size} spectral coefficients; {summand.precision} precision"
    return f"{counted(summand.rank, 'term')} in frame {summand.frame} ({shape})"


def _listed(values: dict[str, str]) -> str:
    longest = 60
    short = (f"{name} {text if len(text) <= longest else text[: longest - 1] + '…'}" for name, text in values.items())
    return ", ".join(short).replace("\n", " ") or "none"
