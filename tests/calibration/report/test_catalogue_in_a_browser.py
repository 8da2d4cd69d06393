"""Pages of a catalogue and of a material in a real browser: search, orders, the skip link, what axe-core finds."""

import numpy as np
import pytest
from metamer.calibration.report import preview_page
from metamer.calibration.report.material_page import MaterialFacts, render_material_page
from metamer.calibration.report.preview_page import PreviewCard, write_preview_page
from metamer.calibration.report.sprite_sheets import SpriteSheets

pytestmark = pytest.mark.browser

CARDS = (
    ("paint/red", "paint", (40.0, 50.0, 20.0), 0.4, "CC0"),
    ("paint/blue", "paint", (30.0, 5.0, -40.0), 2.0, "MIT"),
    ("metal/gold", "metal", None, None, "CC0"),
)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    cards = [
        PreviewCard(
            name, family, "analytic", "reflectance", "fit: 0.4", {"Licence": licence}, lab, p99,
            "" if p99 else "no picture: no fast form",
            name.rpartition("/")[2].capitalize(), "uplifted" if name == "paint/blue" else "measured",
        )
        for name, family, lab, p99, licence in CARDS
    ]  # fmt: skip
    found = tmp_path_factory.mktemp("preview") / "preview.html"
    write_preview_page(found, cards, sheets_of(len(cards)), "materials", "Spheres under D65.")
    return found


def sheets_of(count, pixels=4):
    """Sheets of plain pictures, each of another colour (`code`)."""
    sheets = SpriteSheets()
    for number in range(count):
        sheets.add(np.tile(np.array(code(number), dtype=np.uint8), (pixels, pixels, 1)))
    return sheets


def code(number):
    return number % 251, 40 + number // 251, 255 - number % 256


@pytest.fixture(scope="module")
def material(tmp_path_factory):
    """A page with all that it may hold."""
    facts = MaterialFacts(
        "paint/red", {"Kind": "analytic"}, {"Source": "measured"}, (np.arange(400.0, 701.0, 10.0), np.full(31, 0.4)),
        "Reflectance", np.full((4, 4, 3), 90, dtype=np.uint8), "Sphere under D65.", [{"Pack": "1", "Terms": "3"}],
        ["terms", "p99"], [["3", "0.4"]], {"packs": [(3.0, 0.4), (6.0, 0.2)]},
        [{"conditions": "D65", "space": "Lab", "stated": "1", "recomputed": "1", "delta_e94": "0"}],
    )  # fmt: skip
    found = tmp_path_factory.mktemp("material") / "material.html"
    found.write_text(render_material_page(facts), encoding="utf-8")
    return found


@pytest.mark.parametrize("kind", ["path", "material"])
def test_anyone_can_read_it_and_it_needs_no_network(request, read_by_anyone, kind):
    more = "document.querySelectorAll('button.more').forEach((one) => one.click())"
    read_by_anyone(request.getfixturevalue(kind), more)


def test_words_in_any_order_and_orders(path, opened):
    found = opened(path)

    def names():
        return [one.get_attribute("data-name") for one in found.locator(".thumbnail:visible").all()]

    for words, expected in (("cc0 red", ["paint/red"]), ("red CC0", ["paint/red"]), ("green", [])):
        found.fill("#find", words)
        assert names() == expected, words
    assert found.inner_text("#shown") == "No matches."
    found.fill("#find", "")
    found.select_option("#sort", "p99")
    assert names() == ["paint/blue", "paint/red", "metal/gold"]
    found.select_option("#sort", "lightness")
    assert names() == ["paint/blue", "paint/red", "metal/gold"]
    found.select_option("#sort", "name")
    assert names() == ["metal/gold", "paint/blue", "paint/red"]
    found.select_option("#family", "metal")
    assert names() == ["metal/gold"] and found.inner_text("#shown") == "1 of 3 materials"


def test_a_standing_is_chosen_by_its_button_and_guesses_are_named(path, opened):
    """A guess has a dashed edge and a word; what cannot be used is none of the measured ones."""
    found = opened(path)
    assert found.locator(".verdict").inner_text() == (
        "3 materials: 1 measured, 1 guessed from RGB, to be judged in daylight only, 1 cannot be used."
    )
    assert [one.get_attribute("data-name") for one in found.locator(".thumbnail").all()] == [
        "metal/gold", "paint/blue", "paint/red",
    ]  # fmt: skip
    found.click("[data-choose=uplifted]")
    shown = found.locator(".thumbnail:visible")
    assert shown.count() == 1 and "Guessed from RGB" in shown.inner_text()
    assert shown.locator(".badge").evaluate("one => getComputedStyle(one).borderTopStyle") == "dashed"
    found.click("[data-choose=measured]")
    assert [one.get_attribute("data-name") for one in found.locator(".thumbnail:visible").all()] == ["paint/red"]


def test_the_skip_link_leads_past_the_controls(path, opened):
    found = opened(path)
    found.locator(".skip").focus()
    assert found.locator(".skip").bounding_box()["x"] >= 0
    found.keyboard.press("Enter")
    assert found.evaluate("document.activeElement.id") == "overview"


def test_few_tab_stops_arrows_and_a_link_to_each_material(path, opened):
    found = opened(path)
    stops = found.evaluate(
        "[...document.querySelectorAll('a[href], button, input, select, summary, [tabindex]')]"
        ".filter((one) => one.tabIndex >= 0 && one.checkVisibility()).length"
    )
    # Skip link, a grey, keys, three standings, three controls, one name and what it opens.
    assert stops == 1 + 3 + 1 + 3 + 3 + 2
    found.locator(".name a").first.focus()
    found.keyboard.press("ArrowRight")
    found.keyboard.press("ArrowDown")
    assert found.evaluate("document.activeElement.hash") == "#paint/red"
    found.fill("#find", "gold")
    found.evaluate("location.hash = '#paint/blue'")
    found.locator("[id='paint/blue']").wait_for(state="visible")
    assert found.input_value("#find") == "" and found.faults == []


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """More materials than a screen shows, with pictures beside the page, one of them described at length."""
    cards = [
        PreviewCard(
            f"paint/{number:03}", "paint", "analytic", "reflectance", "fit",
            {"Source": "long " * (300 if number == 7 else 1)}, None, float(number), colour="measured",
        )
        for number in range(1200)
    ]  # fmt: skip
    file = tmp_path_factory.mktemp("large") / "preview.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(preview_page, "_MOST_IN_THE_PAGE", 0)
        write_preview_page(file, cards, sheets_of(len(cards)), "materials", "Spheres.")
    return file


def shown(found):
    return [one.get_attribute("data-name") for one in found.locator(".thumbnail").all()]


# Colours in the middle of all pictures on the page, by the names beside them, once all are loaded.
COLOURS = """async () => {
  const found = {};
  for (const item of document.querySelectorAll(".thumbnail")) {
    const image = item.querySelector("img"), stage = item.querySelector(".stage").getBoundingClientRect();
    await image.decode();
    const box = image.getBoundingClientRect(), scale = image.naturalWidth / box.width;
    const canvas = new OffscreenCanvas(1, 1), pen = canvas.getContext("2d");
    const x = (stage.x + stage.width / 2 - box.x) * scale, y = (stage.y + stage.height / 2 - box.y) * scale;
    pen.drawImage(image, -Math.floor(x), -Math.floor(y));
    found[item.dataset.name] = [...pen.getImageData(0, 0, 1, 1).data.slice(0, 3)];
  }
  return found;
}"""


# Tiles fill the page from the bar down to the end of the screen, or of the page, but for the gaps between them.
COVERED = """() => {
  const boxes = [...document.querySelectorAll(".thumbnail")].map((one) => one.getBoundingClientRect());
  const end = Math.min(innerHeight, document.querySelector("footer").getBoundingClientRect().top);
  const top = Math.max(76, document.getElementById("overview").getBoundingClientRect().top);
  return Math.min(...boxes.map((one) => one.top)) < top + 40 && Math.max(...boxes.map((one) => one.bottom)) > end - 40;
}"""


def test_each_material_has_its_own_picture_of_a_sheet(path, opened):
    """Also of the last sheet, which is not full. Of pictures beside the page a browser tells a script no colours."""
    found = opened(path)
    ids = ["paint/red", "paint/blue", "metal/gold"]
    assert found.evaluate(COLOURS) == {name: list(code(number)) for number, name in enumerate(ids)}


def test_only_what_is_near_the_screen_is_there_wherever_it_is_scrolled(large, opened):
    found = opened(large)
    assert found.inner_text("#shown") == "1200 materials" and 10 < len(shown(found)) < 60
    found.select_option("#sort", "name")
    for share in (0.5, 1.0, 0.25):
        found.evaluate("(share) => scrollTo(0, share * document.documentElement.scrollHeight)", share)
        found.wait_for_function(COVERED)
        there = shown(found)
        assert len(there) < 60
        first = int(there[0][-3:] if len(there[0]) == 9 else there[0][-4:])
        numbers = [int(name.partition("/")[2]) for name in there]
        assert numbers == list(range(first, first + len(there))), "in order and without a gap"
    found.wait_for_function("[...document.images].every((one) => one.complete && one.naturalWidth)")
    assert found.faults == []


def test_what_is_opened_pushes_the_rows_below_it_and_stays_open(large, opened):
    found = opened(large)
    found.select_option("#sort", "name")
    found.evaluate("location.hash = '#paint/007'")
    row = found.locator("[id='paint/007']")
    row.locator(".more").click()
    below = found.evaluate(
        """() => {
          const tiles = [...document.querySelectorAll(".thumbnail")].map((one) => one.getBoundingClientRect());
          const bottom = document.getElementById("paint/007").getBoundingClientRect().bottom;
          const tops = [...new Set(tiles.map((one) => Math.round(one.top)))].sort((a, b) => a - b);
          const own = Math.round(document.getElementById("paint/007").getBoundingClientRect().top);
          return tops[tops.indexOf(own) + 1] - bottom;
        }"""
    )
    assert 0 < below < 40
    # A focused name would stay there.
    found.evaluate("document.activeElement.blur()")
    found.evaluate("scrollTo(0, 30000)")
    row.wait_for(state="detached")
    found.evaluate("scrollTo(0, 0)")
    row.locator(".told").wait_for(state="visible")
    assert row.locator(".more").get_attribute("aria-expanded") == "true"


def test_the_keyboard_goes_beyond_what_is_there(large, opened):
    """Scrolling away keeps the focus; the last name is on the screen when End has led to it."""
    found = opened(large)
    found.select_option("#sort", "name")
    found.locator(".name a").first.focus()
    focused = "decodeURIComponent(document.activeElement.hash)"
    for _ in range(60):
        found.keyboard.press("ArrowRight")
    assert found.evaluate(focused) == "#paint/060"
    found.evaluate("scrollTo(0, 40000)")
    found.wait_for_function(COVERED)
    assert found.locator("[id='paint/060']").bounding_box()["y"] < -10000
    assert found.evaluate(focused) == "#paint/060"
    for key, name in (("End", "paint/1199"), ("ArrowLeft", "paint/1198"), ("Home", "paint/000")):
        found.keyboard.press(key)
        assert found.evaluate(focused) == f"#{name}"
        box = found.locator(f"[id='{name}'] .name").bounding_box()
        assert 60 < box["y"] < 880, key
    assert found.locator(".thumbnail a[tabindex='0']").count() == 1


def test_pictures_that_are_not_beside_the_page_are_missed(large, tmp_path, opened):
    alone = tmp_path / "alone.html"
    alone.write_bytes(large.read_bytes())
    found = opened(alone)
    found.locator("#no-pictures").wait_for(state="visible")
    assert "preview_pictures" in found.inner_text("#no-pictures")
    whole = opened(large)
    whole.wait_for_function("[...document.images].every((one) => one.complete && one.naturalWidth)")
    assert not whole.locator("#no-pictures").is_visible()


def test_paper_has_all_materials_and_no_controls(large, opened):
    """More than a screen lays out at once, in the order that was asked for, and then the screen has few again."""
    found = opened(large)
    found.select_option("#sort", "p99")
    found.evaluate("dispatchEvent(new Event('beforeprint'))")
    found.emulate_media(media="print")
    assert shown(found) == [f"paint/{number:03}" for number in reversed(range(1200))]
    assert not found.locator("#find").is_visible()
    flow = found.evaluate("[...document.querySelectorAll('.thumbnail')].map((one) => one.getBoundingClientRect().top)")
    assert flow == sorted(flow) and len(set(flow)) == 200
    found.emulate_media(media="screen")
    found.evaluate("dispatchEvent(new Event('afterprint'))")
    assert len(shown(found)) < 60
