"""`metamer catalogue preview`: every material as a small picture, on a sheet and on a page."""

import base64
import io
import json
import re

import numpy as np
import pytest
from metamer.calibration.report import preview_page
from metamer.calibration.report.review_data import BADGES
from metamer.cli.catalogue import preview
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from metamer.viewer.sheets.preview import contact_sheet, thumbnail_scene, thumbnails
from metamer.viewer.sheets.sheet_text import line_length, write_line
from metamer.viewer.software.backend import software_session
from PIL import Image, ImageFont


@pytest.fixture
def folder(tmp_path, write_matt, write_spectrum):
    where = tmp_path / "cat"
    write_matt(where, "paint/dark", 0.05)
    write_matt(where, "paint/light", 0.8)
    write_spectrum(where, "lamp/led")
    return where


def data(page, name="data"):
    return json.loads(re.search(f'id="{name}">(.*)</script>', page)[1])


def pictures(page):
    """The pictures of a page, cut out of its sheets."""
    side, pixels = data(page)["side"], data(page)["pixels"]
    cells = []
    for address in data(page, "sheets"):
        sheet = Image.open(io.BytesIO(base64.b64decode(address.partition(",")[2]))).convert("RGB")
        across, down = (length // (pixels + 2) for length in sheet.size)
        assert across <= side and sheet.size == (across * (pixels + 2), down * (pixels + 2))
        lines = np.asarray(sheet).reshape(down, pixels + 2, across, pixels + 2, 3).swapaxes(1, 2)
        cells += list(lines[:, :, 1:-1, 1:-1].reshape(-1, pixels, pixels, 3))
    return cells[: len(data(page)["cards"])]


def test_a_sheet_and_a_page(metamer, folder, tmp_path):
    png, html = tmp_path / "sheet.png", tmp_path / "page.html"
    code, out, _ = metamer(
        "catalogue", "preview", folder, "--png", png, "--html", html, "--size", 32, "--renderer", "software"
    )
    assert code == 0 and str(png) in out and str(html) in out
    sheet = np.asarray(Image.open(png))
    assert sheet.shape[1] == 3 * (32 + 12) + 12
    page = html.read_text("utf-8")
    assert "<script>" in page and "http" not in page
    led, dark, light = pictures(page)
    assert dark.shape == light.shape == led.shape == (32, 32, 3)
    middle = slice(12, 20), slice(10, 18)
    assert light[middle].mean() > dark[middle].mean() + 60
    assert led.min() < 60 < led.max(), "a lamp is drawn as a curve"


def test_filters_choose_and_order(metamer, folder, tmp_path):
    html = tmp_path / "page.html"
    chosen = ("--family", "paint", "--sort", "lightness", "--reverse", "--limit", "1")
    drawn = ("--html", html, "--size", 16, "--renderer", "software")
    code, _, _ = metamer("catalogue", "preview", folder, *drawn, *chosen)
    assert code == 0 and [card[0] for card in data(html.read_text("utf-8"))["cards"]] == ["paint/light"]


@pytest.mark.slow
def test_pictures_that_are_many_lie_beside_the_page(metamer, folder, tmp_path, monkeypatch):
    """And only those: sheets of another page go once it has been replaced, whatever else is there stays."""
    html, beside = tmp_path / "my page.html", tmp_path / "my page_pictures"
    drawn = ("--html", html, "--size", 16, "--renderer", "software")
    assert metamer("catalogue", "preview", folder, *drawn)[0] == 0 and not beside.exists()
    inside = data(html.read_text("utf-8"), "sheets")
    monkeypatch.setattr(preview_page, "_MOST_IN_THE_PAGE", 100)
    assert metamer("catalogue", "preview", folder, *drawn)[0] == 0
    (address,) = data(html.read_text("utf-8"), "sheets")
    (file,) = beside.iterdir()
    assert address == f"my%20page_pictures/{file.name}"
    assert file.read_bytes() == base64.b64decode(inside[0].partition(",")[2]), "the same picture, wherever it is"
    (beside / "notes.webp").write_text("mine")
    assert metamer("catalogue", "preview", folder, *drawn, "--match", "paint/*")[0] == 0
    assert not file.exists() and len(list(beside.glob("*.webp"))) == 2
    monkeypatch.undo()
    assert metamer("catalogue", "preview", folder, *drawn)[0] == 0
    assert [one.name for one in beside.iterdir()] == ["notes.webp"]
    code, out, _ = metamer("catalogue", "preview", folder, "--html", "-", *drawn[2:])
    assert code == 0 and data(out, "sheets") == inside


def test_a_contact_sheet_of_many_is_drawn_only_where_it_is_asked_for(metamer, folder, tmp_path, monkeypatch):
    monkeypatch.setattr(preview, "_SHEET", 2)
    monkeypatch.chdir(tmp_path)
    words = ("catalogue", "preview", folder, "--size", 8, "--renderer", "software")
    assert metamer(*words)[0] == 0 and {"catalogue.html"} == {one.name for one in tmp_path.glob("catalogue.*")}
    assert metamer(*words, "--png", "catalogue.png")[0] == 0 and (tmp_path / "catalogue.png").exists()


def test_nothing_fits(metamer, folder, tmp_path):
    code, _, err = metamer("catalogue", "preview", folder, "--html", tmp_path / "x.html", "--match", "nothing/*")
    assert code == 4 and "3 materials, none of which fits" in err and not (tmp_path / "x.html").exists()


def test_a_damaged_file_is_shown_as_one(metamer, folder, tmp_path):
    file = folder / "paint" / "dark.h5"
    content = bytearray(file.read_bytes())
    content[-200:] = bytes(200)
    file.write_bytes(content)
    html = tmp_path / "page.html"
    code, out, _ = metamer("catalogue", "preview", folder, "--html", html, "--size", 16, "--renderer", "software")
    page = html.read_text("utf-8")
    assert code == 4 and "dark.h5" in out
    assert len(pictures(page)) == 3 and ", 1 cannot be used." in page
    assert [card[0] for card in data(page)["cards"] if data(page)["texts"][card[6]]] == ["paint/dark"]


@pytest.mark.slow
def test_the_light_matters(metamer, folder, tmp_path, write_matt):
    write_matt(folder, "paint/red", np.where(WORKING_WAVELENGTHS_NM < 600, 0.05, 0.8))
    found = []
    for light in ("D65", "FL11"):
        html = tmp_path / f"{light}.html"
        options = (
            "--html",
            html,
            "--size",
            16,
            "--illuminant",
            light,
            "--match",
            "paint/red",
            "--renderer",
            "software",
        )
        assert metamer("catalogue", "preview", folder, *options)[0] == 0
        assert f"under {light}" in html.read_text("utf-8")
        found.append(pictures(html.read_text("utf-8"))[0][8, 6].astype(int))
    assert np.abs(found[0] - found[1]).max() > 10


def test_long_names_fit_under_their_picture(folder, load_sphere):
    with software_session() as renderer:
        catalogue = Catalogue.open(folder)
        drawn = list(thumbnails(catalogue, catalogue.query(), load_sphere, renderer, 16))
    narrow = contact_sheet(drawn, columns=1)
    assert narrow.shape[1] == 16 + 2 * 12
    assert not (narrow[:, -12:] - narrow[0, 0]).any(), "nothing is written beyond the edge"


def test_words_on_a_contact_sheet_stand_apart():
    """Between words there is clearly more room than between letters: three empty columns in a row at least."""
    font = ImageFont.load_default(11)
    text = "materials, their factor packs"
    drawn = Image.new("RGB", (200, 20))
    write_line(drawn, (0, 0), text, (255, 255, 255), font)
    inked = np.asarray(drawn).any(axis=(0, 2))[: line_length(text, font)]
    gaps = [len(gap) for gap in re.findall(r"0+", "".join("1" if column else "0" for column in inked).strip("0"))]
    assert sum(gap >= 3 for gap in gaps) == text.count(" "), gaps


def test_a_capital_delta_is_drawn_as_one():
    """A triangle: one stroke at the top, a bar as wide as the letter at the foot, and nothing in its middle."""
    drawn = Image.new("RGB", (60, 40))
    write_line(drawn, (0, 0), "Δ", (255, 255, 255), ImageFont.load_default(30))
    ink = np.asarray(drawn)[..., 0].astype(float)
    rows = np.flatnonzero(ink.sum(axis=1))
    first, last = ink[rows[0] + 1], ink[rows[-1]]
    assert (last > 100).sum() > 4 * (first > 100).sum() > 0
    middle = ink[(rows[0] + 2 * rows[-1]) // 3]
    inside = np.flatnonzero(middle > 100)
    assert (middle[inside[0] : inside[-1]] == 0).any()


@pytest.fixture
def load_sphere():
    from metamer.lighting.scene_file.files import load_scene, shipped_scene

    return load_scene(shipped_scene())


def test_a_target_that_cannot_be_written_is_refused_before_anything_is_drawn(metamer, folder, tmp_path):
    for target in (tmp_path / "missing" / "x.png", tmp_path):
        code, out, err = metamer("catalogue", "preview", folder, "--png", target, "--renderer", "software")
        assert code == 4 and "drawing" not in out + err and str(target.name if target == tmp_path else "missing") in err
    kept = tmp_path / "kept.html"
    kept.write_text("old")
    code, _, _ = metamer("catalogue", "preview", folder, "--html", kept, "--match", "nothing/*")
    assert code == 4 and kept.read_text() == "old"
    assert not [entry for entry in tmp_path.iterdir() if entry.name.startswith(".")]


def test_where_every_file_is_damaged_it_says_so(metamer, folder, tmp_path):
    for file in folder.rglob("*.h5"):
        file.write_bytes(b"garbage")
    code, _, err = metamer("catalogue", "preview", folder, "--html", tmp_path / "x.html")
    assert code == 4 and "3 files that cannot be used" in err and "catalogue verify" in err


def test_a_btf_is_shown_on_a_cloth():
    """The sphere's thumbnail fills the middle alone; a cloth hangs from side to side."""
    worn = {model: thumbnail_scene(model) for model in ("btf", "cook_torrance")}
    assert {model: scene.parts[0].name for model, scene in worn.items()} == {"btf": "cloth", "cook_torrance": "sphere"}
    assert worn["btf"].parts[0].mesh.uv is not None
    assert [light.spectrum_name for light in worn["btf"].lights] == [
        light.spectrum_name for light in worn["cook_torrance"].lights
    ]


@pytest.mark.slow_cases("measured-measured", "analytic-unknown", "reconstructed(flakes)-reconstructed")
@pytest.mark.parametrize(
    ("kind", "standing"),
    [
        ("measured", "measured"),
        ("analytic", "unknown"),
        ("uplifted(mallett-yuksel)", "uplifted"),
        ("reconstructed(flakes)", "reconstructed"),
    ],
)
def test_every_place_that_shows_a_material_shows_its_standing(metamer, tmp_path, write_matt, kind, standing):
    """What was made of RGB has a fit of 0.00, and must not look better than what was measured."""
    from metamer.materials.records.material import Provenance

    cat, page, one = tmp_path / "one", tmp_path / "page.html", tmp_path / "one.html"
    write_matt(cat, "paint/shown", provenance=Provenance("RGB of somebody", "none", kind))
    options = ("--html", page, "--size", 16, "--renderer", "software")
    assert metamer("catalogue", "preview", cat, *options)[0] == 0
    html = page.read_text("utf-8")
    (card,) = data(html)["cards"]
    colour = data(html)["texts"][card[4]]
    badge = re.search(f'<template id="badge-{colour}"><span class="(badge[^"]*)">.*?</svg>([^<]+)</span>', html)
    assert badge[2] == BADGES[standing] and ("guess" in badge[1]) == (standing in ("uplifted", "unknown"))
    _, out, _ = metamer("catalogue", "list", cat)
    assert kind in out and "fit ΔE94 p99" in out
    assert ("a small fit is no small error" in out) == (standing in ("uplifted", "reconstructed"))
    _, out, _ = metamer("catalogue", "show", "paint/shown", cat, "--html", one, "--renderer", "software")
    assert kind in out + one.read_text("utf-8")
    _, out, _ = metamer("catalogue", "show", "paint/shown", cat)
    assert kind in out and "fit, ΔE94" in out
    lot = "lab:50,1,2@D65/1964_10"
    _, out, err = metamer("match", "paint/shown", lot, "--catalogue", cat)
    assert ("not measured: it judges no colour" in out) == (standing in ("uplifted", "reconstructed")), err
