"""Pages of a catalogue and of a material in a real browser: search, orders, the skip link, what axe-core finds."""

import numpy as np
import pytest
from metamer.calibration.material_page import MaterialFacts, render_material_page
from metamer.calibration.preview_page import PreviewCard, render_preview_page

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
@pytest.mark.parametrize(
    "options",
    [{"color_scheme": "light"}, {"color_scheme": "dark"}, {"viewport": {"width": 400, "height": 800}}],
    ids=["light", "dark", "narrow"],
)
def test_anyone_can_read_it_and_it_needs_no_network(request, opened, kind, options):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    found = opened(request.getfixturevalue(kind), **options)
    found.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    faults = axe.run(found).response["violations"]
    assert not faults, [(fault["id"], [node["html"] for node in fault["nodes"]]) for fault in faults]
    assert found.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert found.faults == []


def test_words_in_any_order_and_orders(path, opened):
    found = opened(path)

    def names():
        return [one.get_attribute("data-id") for one in found.locator(".thumbnail:visible").all()]

    for words, expected in (("cc0 red", ["paint/red"]), ("red CC0", ["paint/red"]), ("green", [])):
        found.fill("#find", words)
        assert names() == expected, words
    assert found.locator("#none").is_visible()
    found.fill("#find", "")
    found.select_option("#sort", "p99")
    assert names() == ["paint/blue", "paint/red", "metal/gold"]
    found.select_option("#sort", "lightness")
    assert names() == ["paint/blue", "paint/red", "metal/gold"]
    found.select_option("#sort", "id")
    assert names() == ["metal/gold", "paint/blue", "paint/red"]


def test_the_skip_link_leads_past_the_controls(path, opened):
    found = opened(path)
    found.locator(".skip").focus()
    assert found.locator(".skip").bounding_box()["x"] >= 0
    found.keyboard.press("Enter")
    assert found.evaluate("document.activeElement.id") == "sheet"
