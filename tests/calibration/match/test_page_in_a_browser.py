"""The page of a match in a real browser: one sheet to sign, search, keys, what axe-core finds."""

import numpy as np
import pytest
from metamer.calibration.match.page import on_sheet
from metamer.viewer.match import match
from orange_batch import NM, ORANGE, sample

pytestmark = pytest.mark.browser

PAPER = 0.86 + 0.03 * np.tanh((NM - 450.0) / 40.0)


def written(folder, count, colour=ORANGE, called="lot", **more):
    """A page of a batch whose samples stray to both sides of the tolerance."""
    rng = np.random.default_rng(0)
    lots = [sample(f"{called} {at:03}", colour * (1.0 + rng.normal(0.0, 0.04))) for at in range(count)]
    report = match(sample("master", colour), lots, "CIE 2000 0.5", repeatability=0.05, **more)
    path = folder / "match.html"
    path.write_text(report.html(), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    return written(tmp_path_factory.mktemp("match"), 12, whites=("yellowness",))


def test_anyone_can_read_it_and_it_needs_no_network(page, read_by_anyone):
    read_by_anyone(page)


@pytest.mark.parametrize(
    ("count", "observers", "called"),
    [(2, 1, "lot"), (12, 1, "lot"), (60, 1, "door panel, left, reflectance, lot"), (60, 2, "lot")],
)
def test_what_is_signed_is_one_sheet(tmp_path, opened, count, observers, called):
    """The signatures stand on the first sheet whatever the size of the batch; all figures are on those behind it."""
    eyes = ("1964_10", "1931_2")[:observers]
    path = written(tmp_path, count, called=called, observers=eyes)
    found = opened(path)
    assert on_sheet(3 * observers) < 20

    def sheets():
        return found.pdf(format="A4").count(b"/Type /Page\n")

    behind = sheets()
    assert not found.locator(".signatures").is_visible()
    found.evaluate("document.getElementById('every').remove()")
    assert sheets() == 1 < behind


@pytest.mark.parametrize(("colour", "observers"), [(PAPER, 1), (PAPER, 2), (ORANGE, 1)], ids=["1", "2", "none"])
def test_whiteness_is_on_the_sheet_that_is_signed(tmp_path, opened, colour, observers):
    """Beside each sample, or that there is none and why; every scale and light on the sheets behind it."""
    scales, eyes = ("CIE 2004", "ASTM E313", "yellowness"), ("1964_10", "1931_2")[:observers]
    found = opened(written(tmp_path, 20, colour, whites=scales, observers=eyes), viewport={"width": 703, "height": 900})
    found.emulate_media(media="print")
    table = found.locator(".matrix")
    for head in ("Whiteness, CIE 2004", "Whiteness, ASTM E313", "Yellowness, ASTM E313"):
        assert head in table.inner_text()
    # Nothing is cut off at the edge of A4 with its margins.
    assert found.evaluate("document.querySelector('.matrix').scrollWidth <= 703")
    behind, sheet = found.locator("#every").inner_text(), found.locator("#overview").inner_text()
    # Yellowness is defined for D65 and, of these, once an observer.
    assert behind.count("yellowness, ASTM E313") == 20 * observers
    assert ("none" in table.inner_text()) == ("the standard has none" in sheet) == (colour is ORANGE)
    found.evaluate("document.getElementById('every').remove()")
    assert found.pdf(format="A4").count(b"/Type /Page\n") == 1


def test_words_in_any_order_and_orders(page, opened):
    found = opened(page)

    def names():
        return found.evaluate(
            "[...document.querySelectorAll('.matrix tbody tr:not([hidden]) th a')].map((one) => one.textContent)"
        )

    everything = names()
    found.fill("#find", "lighter lot")
    lighter = names()
    found.fill("#find", "lot lighter")
    assert 0 < len(lighter) < len(everything) == 12 and names() == lighter
    found.fill("#find", "")
    found.select_option("#show", "fail")
    assert names() == everything[: len(names())] and f"{len(names())} of 12 samples" in found.inner_text("#shown")
    found.select_option("#show", "")
    found.select_option("#sort", "order")
    assert names() == sorted(everything)


def test_few_tab_stops_and_a_link_to_each_sample(page, opened):
    found = opened(page)
    stops = found.evaluate(
        "[...document.querySelectorAll('a[href], button, input, select, summary, [tabindex]')]"
        ".filter((one) => one.tabIndex >= 0 && one.checkVisibility()).length"
    )
    assert stops < 20
    found.fill("#find", "lot 003")
    found.evaluate("location.hash = '#s8'")
    found.locator("#s8").wait_for(state="visible")
    assert found.locator("#s8").get_attribute("data-name") == "lot 007"
