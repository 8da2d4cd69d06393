"""Thumbnails of a catalogue's materials, and contact sheets."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from ...lighting.scene import Scene
from ...lighting.scene_file.files import load_scene, shipped_scene
from ...materials.catalogue.catalogue import Catalogue
from ...materials.records.colour_standing import colour_standing, title_of
from ...materials.records.description import shown_spectrum
from ...materials.records.material import MaterialRecord
from ...materials.records.query import Summary
from ...runtime.errors import InputError
from ...runtime.files import written_whole
from ...spectral.image import ColourImage
from ...spectral.sample import title_from_id
from ..picture import cut_out, display_for, display_pass, material_cut_out
from ..render.matt_forms import MattForm, by_shape, matt_form
from ..render.session import RenderSession
from .sheet_text import fitted_line, sheet_font, write_line

_CAPTION_POINTS = 11
_LINES = 4
_GAP = 12
# Model of materials shown on a cloth.
_BTF = "btf"
# Number of materials read ahead, so that diffuse ones, whose images differ only in colour, are rendered together.
_AT_ONCE = 50
_PAGE, _INK, _SOFT = (241, 241, 241), (26, 26, 26), (93, 93, 93)
# Background of images: L* 50.
_STAGE = (119, 119, 119)


@dataclass(frozen=True, eq=False)
class Thumbnail:
    """Thumbnail of a material.

    picture : display-encoded sRGB: a sphere that wears the fast form, with its coverage as alpha, or the curve of a
        spectrum without a surface.
    reason : why there is no picture, "" where there is one; the picture is then of the page's own grey.
    title : name for people. colour : standing of its colour, as of `colour_standing`.
    """

    summary: Summary
    picture: UInt8[np.ndarray, "H W c"]
    reason: str = ""
    title: str = ""
    colour: str = "unknown"


def thumbnails(
    catalogue: Catalogue,
    summaries: Sequence[Summary],
    scene: Scene,
    renderer: RenderSession,
    pixels: int = 128,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
    cloth: Scene | None = None,
) -> Iterator[Thumbnail]:
    """Yield one thumbnail per summary, in order, with each material on the reviewed part of `scene`.

    cloth : what BTFs are worn on instead (`thumbnail_scene`); None: the same as all.

    An unusable file gives a grey thumbnail with the reason.
    """
    scene, cloth = (
        replace(one, cameras=(replace(one.camera(), width=pixels, height_px=pixels),))
        for one in (scene, cloth or scene)
    )
    display = display_for(scene)
    on = display_pass(renderer, display)
    done = 0
    for start in range(0, len(summaries), _AT_ONCE):
        found: list[Thumbnail] = []
        matt: list[tuple[int, MattForm]] = []
        for summary in summaries[start : start + _AT_ONCE]:
            blank = np.full((pixels, pixels, 3), _PAGE, dtype=np.uint8)
            try:
                record = catalogue.load(summary.id)
                drawn = record.drawn() if record.is_surface else None
                form = None if drawn is None or scene.bounces else matt_form(drawn)
                if form is not None:
                    matt.append((len(found), form))
                    picture = blank
                elif drawn is not None:
                    picture = material_cut_out(record, cloth if record.model == _BTF else scene, renderer, display, on)
                else:
                    picture = _curve(record, pixels)
                found.append(Thumbnail(summary, picture, title=title_of(record), colour=colour_standing(record)))
            except InputError as reason:
                found.append(Thumbnail(summary, blank, str(reason), title_from_id(summary.id)))
        for alike in by_shape(matt):
            pictures = renderer.render_matt(scene, scene.reviewed_part, [form for _, form in alike])
            for (number, _), (xyz, coverage) in zip(alike, pictures, strict=True):
                shown = cut_out(ColourImage(xyz, "xyz", scene.adopted_white()), coverage, display, on)
                found[number] = replace(found[number], picture=shown)
        for one in found:
            yield one
            done += 1
            progress(done, len(summaries), one.summary.id)


def without_picture(thumbnail: Thumbnail) -> Thumbnail:
    """Return what is said of a material alone: pictures of ten thousand take most of a gigabyte."""
    return replace(thumbnail, picture=np.zeros((0, 0, 4), dtype=np.uint8))


def thumbnail_scene(model: str) -> Scene:
    """Return the scene of thumbnails for a model: a sphere, or of BTFs a cloth, which turns them every way."""
    return load_scene(shipped_scene("thumbnail_cloth" if model == _BTF else "thumbnail"))


def lights_in_words(scene: Scene) -> str:
    """Return the lights of a scene as captions name them: the spectrum of all, or each by name and spectrum."""
    named = [(light.name, light.spectrum_name or "its own spectra") for light in scene.lights]
    if len({spectrum for _, spectrum in named}) == 1:
        return named[0][1]
    return ", ".join(spectrum if spectrum.startswith(name) else f"{name} {spectrum}" for name, spectrum in named)


def contact_sheet(
    found: Sequence[Thumbnail], columns: int = 8, title: str = "", captions: Sequence[str] | None = None
) -> UInt8[np.ndarray, "H W 3"]:
    """Return the thumbnails in rows of `columns`, each with its name, family and standing under it, and the ΔE94 of its
    fit or what `captions` say.
    """
    from PIL import Image

    if not found:
        raise InputError("no materials to show", field="preview", found=0, expected="at least one")
    font = sheet_font(_CAPTION_POINTS)
    line = _CAPTION_POINTS + 4
    side = found[0].picture.shape[0]
    head = 2 * line if title else 0
    columns = min(columns, len(found))
    rows = -(-len(found) // columns)
    cell = side + _LINES * line + _GAP
    sheet = Image.new("RGB", (columns * (side + _GAP) + _GAP, head + rows * cell + _GAP), _PAGE)
    if title:
        write_line(sheet, (_GAP, line // 2), fitted_line(title, font, sheet.width - 2 * _GAP), _INK, font)
    last = [caption(one) for one in found] if captions is None else captions
    for number, (thumbnail, said) in enumerate(zip(found, last, strict=True)):
        left = _GAP + number % columns * (side + _GAP)
        top = head + _GAP + number // columns * cell
        shown = Image.fromarray(thumbnail.picture)
        if shown.mode == "RGBA":
            sheet.paste(_STAGE, (left, top, left + side, top + side))
        sheet.paste(shown, (left, top), shown if shown.mode == "RGBA" else None)
        below = top + side + 2
        family, _, name = thumbnail.summary.id.rpartition("/")
        told = ((name, _INK), (family, _SOFT), (thumbnail.summary.standing, _SOFT), (said, _SOFT))
        for row, (text, ink) in enumerate(told):
            write_line(sheet, (left, below + row * line), fitted_line(text, font, side), ink, font)
    return np.asarray(sheet)


def caption(thumbnail: Thumbnail) -> str:
    """Write the last line under a thumbnail: that it is damaged, the error of its packs, or its quantity."""
    one = thumbnail.summary
    if thumbnail.reason:
        return "cannot be used"
    if one.p99 is None:
        return one.quantity
    return f"fit ΔE94 p99 {one.p99:.2f}"


def write_sheet(path: Path, sheet: UInt8[np.ndarray, "H W 3"]) -> None:
    """Write a contact sheet as PNG, whole or not at all."""
    from PIL import Image

    held = io.BytesIO()
    Image.fromarray(sheet).save(held, "PNG", optimize=True)
    with written_whole(path) as beside:
        beside.write_bytes(held.getvalue())


def _curve(record: MaterialRecord, pixels: int) -> UInt8[np.ndarray, "H W 3"]:
    """Return the spectrum of a light or a filter, which no sphere can wear, as a line over its own range."""
    from PIL import Image, ImageDraw

    spectrum = shown_spectrum(record)
    # Drawn at four times the size and reduced: Pillow's lines are not smoothed.
    scale, margin = 4, 8
    box = scale * (pixels - 2 * margin)
    points = _points(spectrum.wavelengths_nm, spectrum.values, box) + scale * margin
    canvas = Image.new("RGB", (scale * pixels, scale * pixels), (255, 255, 255))
    draw = ImageDraw.Draw(canvas)
    base = scale * (pixels - margin)
    draw.line([(scale * margin, base), (base, base)], _SOFT, scale)
    draw.line([(float(x), float(y)) for x, y in points], _INK, 2 * scale, joint="curve")
    return np.asarray(canvas.resize((pixels, pixels), Image.Resampling.BOX))


def _points(
    wavelengths_nm: Float[np.ndarray, " L"], values: Float[np.ndarray, " L"], side: int
) -> Float[np.ndarray, "L 2"]:
    """Return the curve in a box of `side` pixels, y downwards; its largest value, or 1 where nothing is larger, on
    top."""
    span = wavelengths_nm[-1] - wavelengths_nm[0]
    across = (wavelengths_nm - wavelengths_nm[0]) / span if span > 0 else np.full(len(values), 0.5)
    top = values.max() if values.max() > 0 else 1.0
    return np.stack([side * across, side * (1.0 - values / top)], axis=1)
