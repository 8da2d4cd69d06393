"""The page of a comparison in a real browser: two verdicts, search, links, keys, divider, map, paper, axe-core."""

from pathlib import Path

import numpy as np
import pytest
from metamer.calibration.regression.comparison import compare
from metamer.calibration.regression.criteria import default_criteria
from metamer.calibration.regression.page import render_page
from metamer.calibration.regression.row import ComparedSide, PixelLayer, Pixels, Row, RowName
from metamer.calibration.report.history import Run

pytestmark = pytest.mark.browser

WHITE = np.array([0.9505, 1.0, 1.089])
NM = np.arange(400.0, 701.0, 10.0)
#: Material and light; what picture and reference are multiplied by afterwards, None where the row is gone.
ROWS = (
    ("paint/red", "D65", 1.0, 1.0),
    ("paint/red", "A", 1.2, 1.2),
    ("paint/blue", "D65", 1.005, 1.0),
    ("paint/blue", "A", 1.0, 1.0),
    ("metal/50 % gold", "D65", None, None),
    ("metal/50 % gold", "A", 1.01, 1.01),
)
TO_CARDS = "[...document.querySelectorAll('.card')].filter((one) => !one.hidden).map((one) => one.dataset.name)"


def layer(gain, shape, spectrum=None):
    """A ramp of greys; new arrays each time."""
    ramp = gain * np.linspace(0.2, 0.6, shape[0] * shape[1]).reshape(*shape, 1)
    return PixelLayer(lambda: Pixels(ramp * WHITE, np.ones(shape), WHITE), spectrum=spectrum)


def sides(rows, shape=(6, 8)):
    """Before, and after."""
    found = ([], [])
    for material, light, *gains in rows:
        name = RowName(material, light, "CIE 1931 2 Degree Standard Observer", "booth")
        for rows_of, (picture, reference) in zip(found, ((1.0, 1.0), gains), strict=True):
            if picture is not None:
                layers = {"picture": layer(picture, shape), "reference": layer(reference, shape)}
                rows_of.append(Row(name, layers, {"p99": 0.1 if picture == reference else 0.9}))
    return tuple(
        ComparedSide(Path(path), "review", tuple(one)) for path, one in zip(("before", "after"), found, strict=True)
    )


def written(folder, pair):
    result = compare(*pair, default_criteria())
    runs = [Run(f"2026-01-0{day}T00:00:00", "0", "warn", {str(one.name): 0.3 for one in result.rows}) for day in (1, 2)]
    path = folder / "page.html"
    path.write_text(render_page(result, *pair, "0", runs), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    return written(tmp_path_factory.mktemp("page"), sides(ROWS))


def test_anyone_can_read_it_and_it_needs_no_network(page, read_by_anyone):
    read_by_anyone(page)


def test_approximation_and_material_share_no_word(page, opened):
    """A state is a sign and a word, and no hue stands beside a colour: words alone tell the two apart."""
    found = opened(page)
    told = found.evaluate(
        """[...document.querySelectorAll(".badge")].map((one) =>
          [one.classList.contains("approximation") ? "approximation" : "material", one.innerText])"""
    )
    words = {cause: {word for of, text in told if of == cause for word in text.split()} for cause, _ in told}
    assert set(words) == {"approximation", "material"}
    assert {"clearly", "error"} <= words["material"] | words["approximation"]
    assert not words["material"] & words["approximation"]
    headings = found.locator(".boxes b").all_inner_texts()
    assert headings == ["Colours moved beyond their limits.", "The approximation's error is near its limits."]


def test_what_moved_is_shown_and_which_part_changed(page, opened):
    """What did not move is there when it is asked for."""
    found = opened(page)
    shown = "[...document.querySelectorAll('.row')].filter((one) => one.checkVisibility()).length"
    assert found.evaluate(shown) == 4
    told = [one.inner_text() for one in found.locator(".tell").all() if one.is_visible()]
    assert "gone" in told[0] and "The material changed." in told[1] and "stronger" not in told[1]
    assert "The renderer changed." in told[-1] and "lighter" in told[-1]
    found.select_option("#show", "")
    assert found.evaluate(shown) == 6
    assert "did not move" in found.locator(".row[data-status^=identical] .tell").first.inner_text()


def test_words_in_any_order_states_and_orders(page, opened):
    found = opened(page)
    everything = found.evaluate(TO_CARDS)
    assert everything == ["metal/50 % gold", "paint/red", "paint/blue"]
    found.select_option("#show", "")
    for words, expected in (
        ("paint identical", ["paint/red", "paint/blue"]),
        ("a red", ["paint/red"]),
        ("grew error", ["paint/blue"]),
        ("removed", ["metal/50 % gold"]),
        ("green", []),
    ):
        found.fill("#find", words)
        assert found.evaluate(TO_CARDS) == expected, words
    found.fill("#find", "")
    for state, expected in (("error grew", 1), ("clearly moved", 1), ("removed", 1), ("identical", 2)):
        found.select_option("#show", state)
        assert len(found.evaluate(TO_CARDS)) == expected, state
    found.select_option("#show", "")
    found.select_option("#sort", "name")
    assert found.evaluate(TO_CARDS) == sorted(everything)


def test_links_lead_to_rows_and_few_tab_stops(page, opened):
    found = opened(page)
    stops = found.evaluate(
        "[...document.querySelectorAll('a[href], button, input, select, summary, [tabindex]')]"
        ".filter((one) => one.tabIndex >= 0 && one.checkVisibility()).length"
    )
    # Skip link, greys, paper, print, keys, four controls, a card with two dividers and their figures, three folds.
    assert stops == 1 + 3 + 3 + 4 + 5 + 3
    found.fill("#find", "blue")
    link = found.locator(".matrix a.cell", has_text="removed").get_attribute("href")
    found.evaluate(f"location.hash = '{link}'")
    found.wait_for_function("document.querySelector(':target') && document.querySelector(':target').checkVisibility()")
    assert found.evaluate("document.querySelector(':target').closest('.card').dataset.name") == "metal/50 % gold"
    assert found.faults == []


def test_the_divider_goes_from_before_to_after_by_key(page, opened):
    found = opened(page)
    found.fill("#find", "red")
    found.locator(".card:visible").first.focus()
    found.keyboard.press("c")
    assert found.evaluate("document.activeElement.getAttribute('aria-label')").startswith("Divider")
    place = found.locator(".card:visible .compare").first
    before, after = (
        found.locator(f".card:visible {one}").first.get_attribute("src") for one in ("img.other", ".compare img")
    )
    found.wait_for_function("document.querySelector('.card:not([hidden]) .compare .top[src]')")
    assert place.locator(".top").get_attribute("src") == before != after
    found.keyboard.press("ArrowRight")
    assert place.evaluate("one => one.style.getPropertyValue('--x')") == "51%" and found.faults == []


def test_grey_is_the_readers_choice_on_every_page(page, opened):
    found = opened(page)
    found.keyboard.press("b")
    assert found.evaluate("document.documentElement.dataset.surround") == "light"
    found.keyboard.press("?")
    assert found.locator("#help").is_visible()
    found.keyboard.press("b")
    assert found.evaluate("document.documentElement.dataset.surround") == "light"
    found.locator("#keys-on").uncheck()
    found.keyboard.press("Escape")
    found.keyboard.press("b")
    assert found.evaluate("document.documentElement.dataset.surround") == "light"


def test_the_value_under_the_pointer_is_that_of_the_data(page, opened):
    """Grey of 1.2 times the light: the largest L* difference is in the brightest corner."""
    found = opened(page)
    found.fill("#find", "red a")
    coded = found.locator(".card:visible img.coded").first
    coded.scroll_into_view_if_needed()
    box = coded.bounding_box()
    coded.hover(position={"x": box["width"] - 2, "y": box["height"] - 2})
    here = found.locator(".card:visible .here").first
    found.wait_for_function("[...document.querySelectorAll('.here')].some((one) => one.textContent)")
    low, high = map(float, here.inner_text().partition(" · ")[0].split(" to "))
    expected = 116 * ((1.2 * 0.6) ** (1 / 3) - 0.6 ** (1 / 3))
    assert low * 0.995 <= expected <= high * 1.005 and high / low < 1.05
    assert here.inner_text().endswith(" · pixel 7, 5")


def test_readings_show_their_spectra(tmp_path, opened):
    """A reading is one colour: its spectra stand in the place of a map."""
    rows = []
    for gain in (1.0, 1.1):
        reading = layer(gain, (1, 1), lambda place, gain=gain: (NM, np.full(len(NM), 0.4 * gain)))
        rows.append((Row(RowName("chip", "D65", "CIE 1931"), {"reading": reading}),))
    pair = [ComparedSide(Path(name), "readings", one) for name, one in zip(("a.cxf", "b.cxf"), rows, strict=True)]
    found = opened(written(tmp_path, pair))
    assert found.locator(".spectra .first").count() == 1 and found.locator("img.coded").count() == 0
    assert found.locator(".boxes p").count() == 1 and "cannot be told apart" in found.locator(".boxes").inner_text()
    assert "The reading changed." in found.locator(".tell").inner_text()
    assert found.faults == []


def test_paper_is_a_summary_and_a_table_and_cards_where_asked_for(tmp_path, opened):
    """20 materials under three lights, all of them another: the summary is the first sheet, and no card is split."""
    many = [(f"paint/{n:02}", light, 1.1, 1.1) for n in range(20) for light in ("D65", "A", "FL11")]
    found = opened(written(tmp_path, sides(many, (4, 4))))

    def sheets():
        return found.pdf(format="A4").count(b"/Type /Page\n")

    few = sheets()
    assert few <= 3
    found.emulate_media(media="print")
    assert not found.locator("#cards").is_visible() and found.locator(".cards-out").is_visible()
    found.evaluate("document.getElementById('print-cards').checked = true")
    assert found.locator(".seen").first.evaluate("part => getComputedStyle(part).breakInside") == "avoid"
    assert few + 5 < sheets() <= few + 20
