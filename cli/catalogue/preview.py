"""`metamer catalogue preview`: a contact sheet as PNG, and a page to search through, of a catalogue's materials."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..options import add_catalogue_argument, add_illuminant_option, add_renderer_option, positive_count, renderer_for
from ..output import on_standard_output, write_text
from ..progress.lines import progress_bar
from .query import add_query_options, found_by

if TYPE_CHECKING:
    from ...calibration.report.preview_page import PreviewCard
    from ...lighting.scene import Scene
    from ...viewer.sheets.preview import Thumbnail

_DEFAULT = "catalogue"
# Materials on a contact sheet that nobody asked for: more are a picture that no viewer opens.
_SHEET = 1000


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `preview`."""
    preview = verbs.add_parser(
        "preview",
        help="a contact sheet (PNG) and a page with search (HTML) of the materials",
        description=f"Writes {_DEFAULT}.png and {_DEFAULT}.html where neither --png nor --html is given; of more than "
        f"{_SHEET} materials only the page.",
    )
    add_catalogue_argument(preview)
    preview.add_argument("--png", type=Path, metavar="FILE", help="write a contact sheet")
    preview.add_argument(
        "--html",
        type=Path,
        metavar="FILE",
        help="write a page with search; pictures of more materials than open at once lie in FILE_pictures beside it",
    )
    preview.add_argument("--size", type=positive_count, default=128, metavar="N", help="pixels across (default: 128)")
    preview.add_argument("--columns", type=positive_count, default=8, metavar="N", help="of the PNG (default: 8)")
    add_illuminant_option(preview, "default: the light of the scene, D65")
    add_renderer_option(preview)
    add_query_options(preview)
    preview.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Draw; 0, or 4 where a file could not be used or nothing fits."""
    from ...calibration.report.preview_page import render_preview_page, write_preview_page
    from ...calibration.report.sprite_sheets import SpriteSheets
    from ...runtime.errors import InputError
    from ...runtime.files import check_outputs
    from ...viewer.picture import lit_by
    from ...viewer.sheets.preview import contact_sheet, thumbnail_scene, thumbnails, without_picture, write_sheet

    wanted = args.png, args.html
    if wanted == (None, None):
        wanted = Path(f"{_DEFAULT}.png"), Path(f"{_DEFAULT}.html")
    check_outputs(path for path in wanted if path is not None)
    asked = found_by(args)
    catalogue, unusable = asked.catalogue, asked.unusable
    if not asked.fitting:
        found = f"{len(asked.everything)} materials, none of which fits" if asked.everything else "no materials"
        hint = asked.nearest_words or "name fewer filters; metamer catalogue list CAT shows what there is"
        if unusable:
            found += f", and {len(unusable)} files that cannot be used"
            hint = "metamer catalogue verify CAT says what is wrong with each"
        raise InputError("nothing to show", file=catalogue.folder, found=found, expected="one at least", hint=hint)
    png, html = wanted
    if args.png is None and len(asked.fitting) > _SHEET:
        png = None
    scene, cloth = (lit_by(thumbnail_scene(model), args.illuminant) for model in ("", "btf"))
    drawn, sheets = [], SpriteSheets()
    with renderer_for(args.renderer) as renderer, progress_bar("drawing") as progress:
        for one in thumbnails(catalogue, asked.fitting, scene, renderer, args.size, progress, cloth):
            if html is not None:
                sheets.add(one.picture)
            drawn.append(one if png is not None else without_picture(one))
        words = _words(scene, renderer.made_by, len(drawn))
    name = catalogue.folder.resolve().name
    if png is not None:
        write_sheet(png, contact_sheet(drawn, args.columns, f"{name}: {words}"))
        print(png)
    if html is not None:
        if on_standard_output(html):
            write_text(html, render_preview_page(_cards(drawn), sheets.embedded(), sheets.pixels, name, words))
        else:
            write_preview_page(html, _cards(drawn), sheets, name, words)
            print(html)
    for reason in [*unusable, *(one.reason for one in drawn if one.reason)]:
        print(reason)
    return 4 if unusable or any(one.reason for one in drawn) else 0


def _words(scene: Scene, made_by: str, count: int) -> str:
    from ...viewer.sheets.preview import lights_in_words

    lights = lights_in_words(scene)
    return f"{count} materials, their fast forms on a {scene.name.lower()}, BTFs on a cloth, under {lights}, {made_by}"


def _cards(drawn: Sequence[Thumbnail]) -> list[PreviewCard]:
    from ...calibration.report.preview_page import PreviewCard
    from ...spectral.sample import distinct_titles

    titles = distinct_titles([one.title for one in drawn], [f"{one.title} ({one.summary.id})" for one in drawn])
    cards = []
    for title, one in zip(titles, drawn, strict=True):
        said = one.summary
        facts = {"model": said.model, "kind": said.kind, "licence": said.licence}
        if said.terms:
            facts["terms"] = " + ".join(f"{count} in {frame}" for count, frame in said.terms)
        if said.lab is not None:
            facts["L*a*b* (45:0, D65, 2°)"] = " ".join(f"{value:.1f}" for value in said.lab)
        cards.append(
            PreviewCard(
                id=said.id,
                family=said.family,
                kind=said.kind,
                quantity=said.quantity,
                caption=said.quantity if said.p99 is None else f"within ΔE94 {said.p99:.2f} for 99 %",
                facts=facts,
                lab=said.lab,
                p99=said.p99,
                words=one.reason,
                title=title,
                colour=one.colour,
            )
        )
    return cards
