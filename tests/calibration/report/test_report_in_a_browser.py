"""The review page in a real browser: keys, search, orders, links, divider, maps, paper, and what axe-core finds."""

import re

import numpy as np
import pytest
from metamer.calibration.report.direction import direction
from metamer.calibration.report.history import Run
from metamer.calibration.report.report import write_report
from metamer.calibration.report.review_facts import LitColour, ReviewedLight, ReviewedMaterial, light_title
from metamer.calibration.report.row import Limits, RowColour, WorstPixel, review_row
from metamer.calibration.report.statistics import DeltaEStatistics, SelfCheck
from metamer.spectral.difference import delta_e_lab, differences
from metamer.viewer.review.facts import shifts_between

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


EYE = "CIE 1931 2 Degree Standard Observer"
WORST = WorstPixel(
    (1, 2), 1.2, np.array([50.0, 5.0, 5.0]), np.array([50.5, 4.0, 5.0]), np.arange(400.0, 701.0, 10.0),
    np.linspace(0.1, 0.5, 31), np.linspace(0.12, 0.49, 31),
)  # fmt: skip


def written(folder, figures, shape=DELTA_E.shape, beside=False):
    """A page of rows, each a material, a light and a p99, with all that a row may hold; the second run of it.

    `shape` : of the pictures. `beside` : the page is told of larger pictures, which are not there.
    """
    rows, apart = [], np.resize(DELTA_E, shape)
    mask = np.zeros(shape, np.uint8)
    mask[0] = 1
    for number, (material, light, p99) in enumerate(figures):
        picture = np.full((*shape, 4), 90 + number, dtype=np.uint8)
        picture[..., 3] = 255
        files = {"XYZ EXR": "a.exr"} | ({"picture WebP": "pictures/none.webp"} if beside else {})
        rows.append(
            review_row(
                material, light, EYE, statistics=DeltaEStatistics(0.5 * p99, 0.9 * p99, p99, 2.0 * p99, 12),
                picture=picture, reference=picture // 2, delta_e=apart, budget=1.0, rows=len(figures), image="a.png",
                files=files, shift=(0.1, -0.2, 0.05), worst=WORST, notes=("Said of it.",), limits=Limits(0.2, 0.0, 1.5),
                limits_mask=mask, colour=RowColour(np.array([0.2, 0.2, 0.1]), np.array([50.0, 5.0, 5.0]), "45a:0"),
            )
        )  # fmt: skip
    checks = (SelfCheck("L*", 1.0, 1.0),)
    before = [Run("2026-01-01T00:00:00+00:00", "0", "pass", {row.name: 0.9 * row.statistics.p99 for row in rows})]
    lights = [ReviewedLight(name, *light_title(name), pictured=name != "FL2") for name in ("D65", "A", "FL2")]
    materials = [reviewed(name) for name in dict.fromkeys(row.material for row in rows)]
    said = {"checks": checks, "history": before, "lights": lights, "materials": materials}
    return write_report(folder, rows, Plan(), "numpy", 1.0, [], "0", **said)[0]


def reviewed(name):
    """A material with colours under three lights for two observers; blue is nearly red in daylight, and not under A."""
    start = np.array([50.0, 40.0, 5.0]) + (0.3 if "blue" in name else 0.0)
    moved = np.array([0.0, 1.0 + len(name) % 5, 2.0]) * (3.0 if "blue" in name else 1.0)
    colours = []
    for number, eye in enumerate((EYE, "CIE 1964 10 Degree Standard Observer")):
        for light, share in (("D65", 0.0), ("A", 1.0), ("FL2", -0.5)):
            lab = start + share * moved + number
            (shift,) = shifts_between((start + number)[None], lab[None])
            colours.append(LitColour(light, eye, np.full(3, 0.2), lab, lab, shift, (120, 60, 50)))
    nm = np.arange(400.0, 701.0, 10.0)
    words = {"colour": "measured", "gloss": "analytic", "plain": "Measured. Modelled."}
    curve = {"wavelengths_nm": nm, "values": np.linspace(0.1, 0.5, nm.size), "measured_nm": (420.0, 680.0)}
    title = name.partition("/")[2].capitalize()
    return ReviewedMaterial(name, title, name.partition("/")[0], **words, **curve, colours=tuple(colours))


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page of three materials under two lights."""
    return written(tmp_path_factory.mktemp("page"), ROWS)


@pytest.mark.browser
@pytest.mark.parametrize("script", [
    None, "set('view', 'd')", "set('tab', 'shift')", "openDetail(MATERIALS[0])", "one('#help').showModal()",
    "set('marks', true); setSurround('light')", "openDetail(MATERIALS[0]); turn('d'); setSurround('dark')",
])  # fmt: skip
def test_anyone_can_read_every_view_and_none_needs_the_network(page, read_by_anyone, script):
    read_by_anyone(page, script)


def shown(found):
    """Names of the tiles, in their order, and what the first one shows."""
    return found.evaluate("shown.map((tile) => tile.material.name)")


@pytest.mark.browser
def test_keys_change_light_view_marks_observer_and_grey_and_lead_from_picture_to_picture(page, opened):
    """Nothing jumps: tiles stay where they are while the light changes."""
    found = opened(page)
    found.wait_for_function("document.body.dataset.painted")
    place = (
        "JSON.stringify(tiles.map((tile) => { const box = tile.item.getBoundingClientRect(); return [box.x, box.y]; }))"
    )
    before = found.evaluate(place)
    address = "shown[0].image.src"
    daylight = found.evaluate(address)

    def press(key, painted):
        found.keyboard.press(key)
        found.wait_for_function(f"document.body.dataset.painted === '{painted}'")
        return found.evaluate(address)

    tungsten = press("2", "Ap2°false")
    assert tungsten != daylight and found.evaluate(place) == before
    assert len({tungsten, press("r", "Ar2°false"), press("d", "Ad2°false")}) == 3
    assert found.locator("#mapkey").is_visible()
    press("p", "Ap2°false")
    press("m", "Ap2°true")
    assert found.locator(".tile .hatch").first.is_visible()
    assert press("1", "D65p2°true") == daylight
    press("o", "D65p10°true")
    assert "Pictures are for the 2° observer" in found.locator("#observer-note").inner_text()
    found.keyboard.press("b")
    assert found.evaluate("document.documentElement.dataset.surround") == "light"
    found.evaluate("shown[0].button.focus()")
    found.keyboard.press("ArrowRight")
    found.keyboard.press("Enter")
    names = shown(found)
    assert found.locator("#d-name").inner_text() == names[1] and found.locator("#d-pos").inner_text() == "2 of 3"
    found.keyboard.press("ArrowRight")
    assert found.locator("#d-name").inner_text() == names[2]
    found.keyboard.press("Escape")
    found.wait_for_function("document.activeElement === shown[2].button")
    found.keyboard.press("s")
    assert found.locator("#v-shift").is_visible() and not found.locator("#v-pictures").is_visible()
    found.keyboard.press("?")
    assert found.locator("#help").is_visible() and found.faults == []


@pytest.mark.browser
def test_no_row_wraps_on_a_laptop_and_the_first_picture_is_within_300_pixels(page, opened):
    found = opened(page)
    found.set_viewport_size({"width": 1280, "height": 800})
    top = "document.querySelector('#grid li').getBoundingClientRect().top"
    assert found.evaluate(top) <= 300
    found.evaluate("openDetail(MATERIALS[0])")
    heights = found.evaluate("[...document.querySelectorAll('.bar, .dhead')].map((one) => one.clientHeight)")
    assert max(heights) < 60


@pytest.mark.browser
def test_what_needs_a_look_is_first_and_all_words_of_a_search_must_match(page, opened):
    found = opened(page)
    assert shown(found) == ["Blue", "Red", "Gold"]
    for order, expected in (("name", ["Blue", "Gold", "Red"]), ("reviewed", ["Red", "Blue", "Gold"])):
        found.select_option("#order", order)
        assert shown(found) == expected
    for words, expected in (
        ("paint", ["Red", "Blue"]),
        ("paint  BLUE", ["Blue"]),
        ("borderline", ["Red"]),
        ("none", []),
    ):
        found.fill("#find", words)
        assert shown(found) == expected, words
    assert found.locator("#nothing").is_visible()


@pytest.mark.browser
def test_a_link_opens_a_material_under_its_light(page, opened):
    found = opened(page)
    found.evaluate("location.hash = 'metal/gold@A'")
    found.wait_for_function("one('#detail').open")
    assert found.locator("#d-name").inner_text() == "Gold" and found.evaluate("chosen.light") == "A"


@pytest.mark.browser
def test_a_divider_goes_from_picture_to_reference_by_key_and_by_pointer(page, opened):
    found = opened(page)
    found.evaluate("openDetail(MATERIALS[0])")
    divider = found.locator(".compare input")
    divider.wait_for()

    def place():
        return found.evaluate("one('#d-stage').style.getPropertyValue('--x')")

    assert place() == "50%"
    divider.focus()
    found.keyboard.press("ArrowRight")
    assert place() == "51%" and found.locator("#d-name").inner_text() == "Red"
    box = divider.bounding_box()
    found.mouse.click(box["x"] + 0.25 * box["width"], box["y"] + 0.5 * box["height"])
    assert 20.0 < float(place().rstrip("%")) < 30.0


@pytest.mark.browser
@pytest.mark.parametrize("magnified", [False, True])
def test_the_value_under_the_pointer_is_that_of_the_data(page, opened, magnified):
    """Whatever the scale of the colours."""
    found = opened(page)
    found.evaluate("openDetail(MATERIALS[0]); turn('d')")
    found.wait_for_selector("#d-stage canvas")
    if magnified:
        found.evaluate("document.querySelector('#d-stage canvas').dataset.old = 1")
        found.check("#magnify")
        found.wait_for_selector("#d-stage canvas:not([data-old])")
    said = found.evaluate(
        """() => { const canvas = document.querySelector("#d-stage canvas"), said = [];
        const box = canvas.getBoundingClientRect();
        for (let y = 0; y < 3; y += 1) for (let x = 0; x < 4; x += 1) {
          const at = { clientX: box.left + (x + 0.5) / 4 * box.width, clientY: box.top + (y + 0.5) / 3 * box.height };
          canvas.dispatchEvent(new PointerEvent("pointermove", at));
          said.push(document.getElementById("read").textContent);
        }
        return said; }"""
    )
    assert [said[index] for index in (0, 5, 6, 7, 8)] == [
        "Here: ΔE94 0", "Here: ΔE94 above 33.2", "Here: no number", "Not compared here", "Here: ΔE94 at most 0.00600",
    ]  # fmt: skip
    assert said[2].endswith(" to 1.00") and said[3].startswith("Here: ΔE94 1.00 to ")
    for words, value in zip(said, DELTA_E.ravel(), strict=True):
        if match := re.search(r"ΔE94 (.+) to (.+)", words):
            low, high = map(float, match.groups())
            assert low * 0.995 <= value <= high * 1.005 and high / low < 1.05, (words, value)


@pytest.mark.browser
def test_differences_and_words_of_the_page_are_those_of_a_match(page, opened):
    rng = np.random.default_rng(0)
    first = np.concatenate(
        [rng.uniform((0, -60, -60), (100, 60, 60), (300, 3)), rng.normal(50.0, 3.0, (50, 3)) * (1, 0, 0)]
    )
    second = first + rng.normal(0.0, 1.0, first.shape) * rng.choice([0.3, 3.0, 30.0], (len(first), 1))
    told = opened(page).evaluate(
        "(pairs) => pairs.map(([a, b]) => [deltaE2000(a, b), direction(a, b)])", np.stack([first, second], 1).tolist()
    )
    for (value, words), a, b in zip(told, first, second, strict=True):
        assert value == pytest.approx(float(delta_e_lab(a, b, "CIE 2000")), abs=1e-9)
        assert words == direction(a, differences(a, b), 0.5)


@pytest.mark.browser
def test_a_pair_that_matches_in_daylight_alone_is_found_by_its_standard(page, opened):
    found = opened(page)
    found.keyboard.press("s")
    rows = found.locator("#shift-table tbody tr")
    assert rows.count() == 3 and rows.first.locator("button").inner_text() == "Blue"
    found.select_option("#standard", "paint/red")
    assert rows.locator("button").all_inner_texts()[0] == "Blue"
    apart = [float(words) for words in rows.first.locator("td b").all_inner_texts()]
    assert apart[0] < 0.6 and apart[1] > 2.0 * apart[0]


@pytest.mark.browser
def test_a_page_that_was_sent_without_its_folder_shows_the_pictures_in_it(tmp_path, opened):
    found = opened(written(tmp_path, ROWS, beside=True))
    found.wait_for_function("document.body.dataset.painted")
    assert found.evaluate("shown.every((tile) => tile.image.src.startsWith('blob:') && tile.image.naturalWidth === 4)")


@pytest.mark.browser
def test_many_materials_are_few_sheets_to_sign(tmp_path, opened):
    """82 materials: a summary with boxes and a signature, then twelve pictures a page."""
    figures = [(f"paint/colour-{number:02}", light, 0.5) for number in range(82) for light in ("D65", "A")]
    found = opened(written(tmp_path, figures))
    printed = found.pdf(prefer_css_page_size=True)
    assert 8 <= len(re.findall(rb"/Type\s*/Page[^s]", printed)) <= 10
    assert found.locator("#sheet .box").count() == 2 * 82
    assert found.locator("#sheet .verdict").inner_text() == found.locator(".head .verdict").inner_text()
