"""A real browser for the pages: Chromium without a window, driven by Playwright."""

import shutil

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.fixture(scope="module")
def browser():
    """Chromium of this machine; none is fetched."""
    if CHROMIUM is None:
        pytest.skip("no Chromium here to open pages with")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield found
        found.close()


@pytest.fixture
def opened(browser):
    """Opens a file as a page of its own; `faults` of it are errors of scripts and whatever it asks the network for."""
    contexts = []

    def open_page(path, **options):
        context = browser.new_context(**{"viewport": {"width": 1440, "height": 900}, **options})
        contexts.append(context)
        page = context.new_page()
        page.faults = []
        page.on("console", lambda said: page.faults.append(said.text))
        page.on("pageerror", lambda error: page.faults.append(str(error)))
        page.on(
            "request", lambda asked: asked.url.startswith(("file:", "data:", "blob:")) or page.faults.append(asked.url)
        )
        page.goto(path.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()


@pytest.fixture(
    params=[{"color_scheme": "light"}, {"color_scheme": "dark"}, {"viewport": {"width": 400, "height": 800}}],
    ids=["light", "dark", "narrow"],
)
def read_by_anyone(request, opened):
    """Opens a file in light, dark and narrow windows, runs a script, and checks what it then is: no fault that axe-core
    knows, WCAG AA contrast among them; nothing wider than the window; no error and no network.
    """
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()

    def check(path, script=None):
        found = opened(path, **request.param)
        if script is not None:
            found.evaluate(script)
        faults = axe.run(found).response["violations"]
        assert not faults, [(fault["id"], [node["html"] for node in fault["nodes"]]) for fault in faults]
        assert found.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert found.faults == []

    return check
