"""The review page in a real browser: search, orders, keys, comparison, maps, paper, and what axe-core finds."""

import numpy as np
import pytest
from metamer.calibration.report.history import Run
from metamer.calibration.report.report import write_report
from metamer.calibration.report.row import RowColour, WorstPixel, review_row
from metamer.calibration.report.statistics import DeltaEStatistics, SelfCheck

#: ΔE94 of the map of the first row.
DELTA_E = np.array([[0.0, 0.5, 1.0, 1.001], [3.0, 40.0, np.inf, np.nan], [0.004, 0.25, 0.26, 2.0]])
ROWS = (
    ("paint/red", "D65", 0.4),
    ("paint/red", "A", 1.2),
    ("paint/blue", "D65", 9.0),
    ("paint/blue", "A", 0.2),
    ("metal/gold", "D65", 0.1),
    ("metal/gold", "A", 0.3),
)


class Plan:
    basis_size = 3
    reasons = ("One light, no bounce: 3 coefficients are exact.",)


WORST = WorstPixel(
    (1, 2), 1.2, np.array([50.0, 5.0, 5.0]), np.array([50.5, 4.0, 5.0]), np.arange(400.0, 701.0, 10.0),
    np.linspace(0.1, 0.5, 31), np.linspace(0.12, 0.49, 31),
)  # fmt: skip


def written(folder, figures, shape=DELTA_E.shape):
    """A page of rows, each a material, a light and a p99, with all that a row may hold; the second run of it.

    `shape` : of the pictures.
    """
    rows, delta_e = [], np.resize(DELTA_E, shape)
    for material, light, p99 in figures:
        picture = np.full((*shape, 3), 90, dtype=np.uint8)
        statistics = DeltaEStatistics(0.5 * p99, 0.9 * p99, p99, 2.0 * p99, 12)
        rows.append(
            review_row(
                material, light, "1931_2", statistics=statistics, picture=picture, reference=picture + 9,
                delta_e=delta_e, budget=1.0, rows=len(figures), image="a.png", files={"XYZ EXR": "a.exr"},
                shift=(0.1, -0.2, 0.05), worst=WORST, notes=("Said of it.",),
                colour=RowColour(np.array([0.2, 0.2, 0.1]), np.array([50.0, 5.0, 5.0]), "45a:0"),
            )
        )  # fmt: skip
    checks = (SelfCheck("L*", 1.0, 1.0),)
    before = [Run("2026-01-01T00:00:00+00:00", "0", "pass", {row.name: 0.9 * row.statistics.p99 for row in rows})]
    return write_report(folder, rows, Plan(), "numpy", 1.0, [], "0", checks=checks, history=before)[0]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page of three materials under two lights."""
    return written(tmp_path_factory.mktemp("page"), ROWS)


@pytest.fixture
def told(page, opened):
    """Runs a script on a page that has just been opened, and gives what it returns."""

    def run(script):
        return opened(page).evaluate(
            "async () => { const $ = (id) => document.getElementById(id);"
            "const set = (id, value) => { $(id).value = value; $(id).dispatchEvent(new Event('input')); };"
            "const cards = () => [...document.querySelectorAll('.card')].filter((card) => !card.hidden)"
            f".map((card) => card.dataset.name); {script} }}"
        )

    return run


@pytest.mark.browser
def test_anyone_can_read_it_and_it_needs_no_network(page, read_by_anyone):
    read_by_anyone(page)


@pytest.mark.browser
def test_paper_has_summary_and_table_and_cards_where_asked_for(page, opened):
    found = opened(page)
    found.emulate_media(media="print")
    assert not found.locator("#cards").is_visible() and found.locator(".matrix").is_visible()
    assert found.locator(".cards-out").is_visible()
    # On paper the box is not seen, and still counts.
    found.evaluate("document.getElementById('print-cards').checked = true")
    assert found.locator("#cards").is_visible() and not found.locator(".cards-out").is_visible()
    assert found.locator(".card").first.evaluate("card => getComputedStyle(card).breakInside") == "avoid"


@pytest.mark.browser
def test_many_materials_are_few_sheets_and_all_of_them_with_cards(tmp_path, opened):
    """One sheet sums up, one is for trust in the figures, then some forty materials a sheet, or six cards with the
    square pictures of the default review.
    """
    many = [(f"paint/{number:02}", light, 0.3) for number in range(82) for light in ("D65", "A", "FL11")]
    found = opened(written(tmp_path, many, (12, 12)))

    def sheets():
        return found.pdf(format="A4").count(b"/Type /Page\n")

    assert 3 < sheets() <= 5
    found.evaluate("document.getElementById('print-cards').checked = true")
    assert 14 < sheets() <= 20


@pytest.mark.browser
def test_all_words_of_a_search_must_match(told):
    found = told(
        """const said = {};
        for (const words of ["", "paint", "RED d65", "paint a", "over", "within gold a", "paint green"]) {
          set("find", words); said[words] = [cards(), $("shown").textContent];
        }
        return said;"""
    )
    everything = ["paint/blue", "paint/red", "metal/gold"]
    assert found == {
        "": [everything, "3 materials, 6 rows"],
        "paint": [everything[:2], "2 of 3 materials, 4 of 6 rows"],
        "RED d65": [["paint/red"], "1 of 3 materials, 1 of 6 rows"],
        "paint a": [["paint/red", "paint/blue"], "2 of 3 materials, 2 of 6 rows"],
        "over": [["paint/blue"], "1 of 3 materials, 1 of 6 rows"],
        "within gold a": [["metal/gold"], "1 of 3 materials, 1 of 6 rows"],
        "paint green": [[], "No matches."],
    }


@pytest.mark.browser
def test_orders(told):
    found = told(
        """return [...$("sort").options].map((option) => {
          $("sort").selectedIndex = option.index; $("sort").dispatchEvent(new Event("input"));
          return [option.textContent, cards().map((name) => name.split("/")[1])];
        });"""
    )
    assert found == [
        ["worst p99 first", ["blue", "red", "gold"]],
        ["worst under D65 first", ["blue", "red", "gold"]],
        ["worst under A first", ["red", "gold", "blue"]],
        ["largest mean first", ["blue", "red", "gold"]],
        ["by name", ["gold", "blue", "red"]],
        ["as reviewed", ["red", "blue", "gold"]],
    ]


@pytest.mark.browser
def test_few_tab_stops_and_arrows_between_them(told):
    """One stop for the names of all materials and one card, whose links it opens; the arrows go to the next."""
    found = told(
        """const stops = () => [...document.querySelectorAll("a[href], button, input, select, [tabindex]")]
          .filter((element) => element.tabIndex >= 0 && !element.closest("[hidden], dialog:not([open])"));
        const press = (key) =>
          document.activeElement.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
        const first = stops()[0].getAttribute("href");
        const open = () => [...document.querySelectorAll(".card")].filter((card) => card.tabIndex === 0).map((card) =>
          [card.dataset.name, [...card.querySelectorAll("a, button")].filter((link) => link.tabIndex === 0).length]);
        const seen = [open()];
        document.querySelector(".card").focus(); press("ArrowRight"); seen.push(open());
        press("ArrowRight"); press("ArrowRight"); press("ArrowLeft"); seen.push(open());
        document.querySelector(".matrix a").focus(); press("ArrowDown");
        return { first, seen, stops: stops().length, name: document.activeElement.textContent };"""
    )
    assert found["first"] == "#overview"
    assert found["seen"] == [[["paint/blue", 8]], [["paint/red", 8]], [["paint/red", 8]]]
    assert found["name"] == "paint/red"
    # Skip link, the six worst, seven controls, a name, a card and its six links and two sliders, review.json.
    assert found["stops"] == 1 + 6 + 7 + 1 + 9 + 1


@pytest.mark.browser
def test_a_link_leads_to_a_row_also_to_one_that_a_search_has_left_out(page, opened):
    found = opened(page)
    found.fill("#find", "gold")
    assert not found.locator('[id="paint/blue@A"]').is_visible()
    found.evaluate("location.hash = '#paint/blue@A'")
    row = found.locator('[id="paint/blue@A"]')
    row.wait_for(state="visible")
    assert found.input_value("#find") == ""
    assert found.evaluate("[...document.querySelectorAll('.card')].find((one) => one.tabIndex === 0).dataset.name") == (
        "paint/blue"
    )
    # And an address with it opens there.
    again = opened(page)
    again.goto(page.as_uri() + "#metal/gold@A")
    again.wait_for_function("document.getElementById('metal/gold@A').getBoundingClientRect().top < innerHeight")
    links = again.evaluate("[...document.querySelectorAll('.links a:first-child')].map((one) => one.hash)")
    assert "#metal/gold@A" in [link.replace("%2F", "/") for link in links] and len(set(links)) == len(ROWS)


@pytest.mark.browser
def test_a_link_and_a_key_end_at_the_head_of_what_they_lead_to_on_a_long_page(tmp_path, opened):
    """Table and cards grow as they come near the screen, and must not push it away again."""
    many = [(f"paint/{number:02}", light, 0.3) for number in range(82) for light in ("D65", "A", "FL11")]
    found = opened(written(tmp_path, many, (12, 12)))

    def settled(script):
        """Where the head of an element ends up."""
        top = f"Math.round({script}.getBoundingClientRect().top)"
        found.wait_for_function(
            f"async () => {{ const before = {top}; await new Promise((done) => setTimeout(done, 400));"
            f" return before === {top}; }}"
        )
        return found.evaluate(top)

    bar = found.evaluate("document.getElementById('controls').getBoundingClientRect().height")
    for name in ("paint/01@A", "paint/70@FL11", "paint/40@D65"):
        found.evaluate(f"location.hash = '#{name}'")
        assert bar - 10 <= settled(f"document.getElementById('{name}')") <= bar + 10, name
    found.locator(".card").first.focus()
    for _ in range(3):
        found.keyboard.press("ArrowRight")
        assert bar - 10 <= settled("document.activeElement") <= bar + 10
    assert found.evaluate("document.activeElement.dataset.name") == "paint/03"


def test_the_table_shows_materials_by_lights_as_pictures(page, opened):
    found = opened(page)
    assert found.locator(".thumb").count() == 0
    found.check("#grid")
    found.wait_for_function("document.querySelectorAll('.thumb[src]').length === 6")
    same = found.evaluate(
        "[...document.querySelectorAll('.thumb')].every((one) => one.src === "
        "document.getElementById(decodeURIComponent(one.parentNode.hash.slice(1))).querySelector('.shot img').src)"
    )
    assert same and found.locator(".thumb").first.get_attribute("alt") == "paint/blue under D65, as rendered"
    found.uncheck("#grid")
    assert not found.locator(".thumb").first.is_visible() and found.faults == []


@pytest.mark.browser
def test_shift_and_the_check_box_show_the_reference(told):
    found = told(
        """const picture = document.querySelector("img.hold"), reference = document.querySelectorAll(".shot img")[1];
        const frame = () => new Promise((done) => setTimeout(() => requestAnimationFrame(done), 20));
        const same = async (wanted) => {
          for (let tries = 0; tries < 50 && (picture.src === reference.src) !== wanted; tries += 1) await frame();
          return picture.src === reference.src;
        };
        const press = (kind) => document.dispatchEvent(new KeyboardEvent(kind, { key: "Shift" }));
        picture.scrollIntoView({ behavior: "instant" });
        const seen = [await same(false)];
        press("keydown"); seen.push(await same(true), picture.alt);
        press("keyup"); seen.push(await same(false));
        $("reference").checked = true; $("reference").dispatchEvent(new Event("input")); seen.push(await same(true));
        return seen;"""
    )
    assert found == [False, True, "paint/blue under D65, reference", False, True]


@pytest.mark.browser
def test_a_slider_goes_from_picture_to_reference_by_key_and_by_pointer(page, opened):
    """C on a card opens it on the first of its rows that a search leaves; Escape leads back to the card."""
    found = opened(page)
    box, stack = found.locator("#compare"), found.locator("#compare .stack")

    def place():
        return found.evaluate("document.querySelector('#compare .stack').style.getPropertyValue('--at')")

    assert not box.is_visible()
    found.fill("#find", "blue a")
    found.locator(".card:visible").first.focus()
    found.keyboard.press("c")
    assert box.is_visible() and found.locator("#compare-title").inner_text() == "paint/blue under A"
    sources = found.evaluate("[...document.querySelectorAll('#compare img')].map((one) => one.src)")
    shots = found.evaluate(
        "[...document.querySelectorAll('#cards > :first-child .row:not([hidden]) .shot img')].map((one) => one.src)"
    )
    assert sources == shots[:2] and sources[0] != sources[1]
    assert place() == "50%"
    found.keyboard.press("ArrowRight")
    assert place() == "51%"
    bounds = stack.bounding_box()
    found.mouse.move(bounds["x"] + 0.25 * bounds["width"], bounds["y"] + 5)
    assert place() == "25%"
    found.keyboard.press("Escape")
    assert not box.is_visible()
    assert found.evaluate("document.activeElement.dataset.name") == "paint/blue"
    found.locator(".compare-open:visible").first.click()
    assert box.is_visible() and found.faults == []


@pytest.mark.browser
def test_the_value_under_the_pointer_is_that_of_the_data(told):
    found = told(
        """const map = document.querySelector("img.coded"), here = map.parentNode.querySelector(".here");
        map.scrollIntoView({ behavior: "instant" });
        const seen = [];
        for (let y = 0; y < 3; y += 1) for (let x = 0; x < 4; x += 1) {
          const box = map.getBoundingClientRect();
          const at = { clientX: box.left + (x + 0.5) / 4 * box.width, clientY: box.top + (y + 0.5) / 3 * box.height };
          here.textContent = "";
          map.dispatchEvent(new PointerEvent("pointermove", at));
          while (!here.textContent) await new Promise((done) => setTimeout(done, 10));
          seen.push(here.textContent);
        }
        return seen;"""
    )
    assert [words.partition(" · pixel ")[2] for words in found] == [f"{x}, {y}" for y in range(3) for x in range(4)]
    said = [words.partition(" · ")[0] for words in found]
    assert [said[index] for index in (0, 5, 6, 7, 8)] == [
        "0",
        "over 33.2",
        "no number",
        "not compared",
        "at most 0.00600",
    ]
    assert said[2].endswith(" to 1.00") and said[3].startswith("1.00 to ") and said[4].endswith(" to 3.00")
    for words, value in zip(said, DELTA_E.ravel(), strict=True):
        if " to " in words:
            low, high = map(float, words.split(" to "))
            assert low * 0.995 <= value <= high * 1.005 and high / low < 1.05, (words, value)


@pytest.mark.browser
def test_a_fitted_map_is_the_same_map_in_other_colours(told):
    """The palette ends at the row's p99, and no code, so no value, has changed."""
    found = told(
        """const map = document.querySelector("img.coded");
        const colours = async () => {
          await map.decode();
          const canvas = document.createElement("canvas"); canvas.width = 4; canvas.height = 3;
          const brush = canvas.getContext("2d"); brush.drawImage(map, 0, 0);
          return [...brush.getImageData(0, 0, 4, 3).data].join();
        };
        const before = [map.src, await colours()];
        set("maps", "fitted");
        const late = map.src === before[0];
        map.scrollIntoView({ behavior: "instant" });
        for (let tries = 0; tries < 100 && map.src === before[0]; tries += 1) {
          await new Promise((done) => setTimeout(done, 20));
        }
        const fitted = [map.src, await colours()], ticks = map.parentNode.querySelector(".scale").textContent.trim();
        set("maps", "");
        return { late, changed: before[1] !== fitted[1], ticks, pixels: before[0].slice(1106) === fitted[0].slice(1106),
          back: map.src === before[0], map: fitted[1].split(",").map(Number) };"""
    )
    assert found["late"], "what is not on the screen waits until it is"
    assert found["changed"] and found["pixels"] and found["back"]
    assert found["ticks"] == "04.5p99 9"
    rgb = np.array(found["map"]).reshape(3, 4, 4)[..., :3]
    assert rgb[1, 1].tolist() == [255, 243, 190] and rgb[1, 2].tolist() == [255, 0, 255]
    assert rgb[1, 3].tolist() == [128, 128, 128]
