"""Pages of a catalogue and of a material in a real browser: search, orders, the skip link, what axe-core finds."""

import numpy as np
import pytest
from metamer.calibration.report.material_page import MaterialFacts, render_material_page
from metamer.calibration.report.preview_page import PreviewCard, render_preview_page

pytestmark = pytest.mark.browser

CARDS = (
    ("paint/red", "paint", np.array([40.0, 50.0, 20.0]), 0.4, "CC0"),
    ("paint/blue", "paint", np.array([30.0, 5.0, -40.0]), 2.0, "MIT"),
    ("metal/gold", "metal", None, None, "CC0"),
)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    cards = [
        PreviewCard(
            name, family, "analytic", "reflectance", "fit: 0.4", np.full((4, 4, 3), 90, dtype=np.uint8),
            {"Licence": licence}, lab, p99, "" if p99 else "no picture: no fast form",
            name.rpartition("/")[2].capitalize(), "uplifted" if name == "paint/blue" else "measured",
        )
        for name, family, lab, p99, licence in CARDS
    ]  # fmt: skip
    found = tmp_path_factory.mktemp("preview") / "preview.html"
    found.write_text(render_preview_page(cards, "materials", "Spheres under D65."), encoding="utf-8")
    return found


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


def test_paper_has_all_materials_and_no_controls(tmp_path, opened):
    """More than a screen lays out at once, in the order that was asked for."""
    picture = np.full((4, 4, 3), 90, dtype=np.uint8)
    cards = [
        PreviewCard(f"paint/{number:03}", "paint", "analytic", "reflectance", "fit", picture, {}, None, float(number))
        for number in range(120)
    ]
    file = tmp_path / "preview.html"
    file.write_text(render_preview_page(cards, "materials", "Spheres."), encoding="utf-8")
    found = opened(file)
    found.select_option("#sort", "p99")
    found.evaluate("dispatchEvent(new Event('beforeprint'))")
    found.emulate_media(media="print")
    names = [one.get_attribute("data-name") for one in found.locator(".thumbnail:visible").all()]
    assert names == [f"paint/{number:03}" for number in reversed(range(120))]
    assert not found.locator("#find").is_visible()
