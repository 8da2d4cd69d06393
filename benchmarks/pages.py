"""Size of pages, and time of a browser for what a person does on them.

Pages of made-up materials are opened in Chromium, without a window: words are typed, rows shown and sorted, sliders
moved. Each step counts with the processor time that the page's thread takes until two more frames are drawn, which
other work on the machine changes little.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ..calibration.report.text_tables import columns
from ..runtime.errors import InputError
from .made_up_pages import PAGES
from .timing import command, write_json

#: Names of Chromium's executable.
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_FRAMES = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done))))"
_SEEN = "[...document.querySelectorAll('{}')].find((one) => one.checkVisibility() && !one.closest('.late'))"
# Its middle, brought onto the screen; or null.
_PLACE = """(() => {{ const one = {}; if (!one) return null;
  one.scrollIntoView({{ behavior: "instant", block: "center" }});
  const box = one.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }})()"""
_WORDS = "sample 1 d65"
Step = tuple[str, Callable[[], object]]


def run(rows: int = 500, sized: int = 246, only: Sequence[str] = tuple(PAGES)) -> dict:
    """Write and open pages.

    Parameters
    ----------
    rows : of the pages that are worked with. sized : of those that are weighed. only : which pages.

    Returns
    -------
    dict for JSON: `rows`, `sized`, and `pages`, an entry a kind: `page`, `bytes` with `sized` rows; with `rows` rows
    `load_ms`, and `steps`, a list of `step`, `cpu_ms`; `cpu_ms_p95` and `cpu_ms_max` of them.

    Raises
    ------
    InputError : no Chromium here, or no Playwright.
    """
    found = []
    with tempfile.TemporaryDirectory() as folder, _browser() as browser:
        for name in only:
            place = Path(folder) / name
            place.mkdir()
            size = PAGES[name](place, sized).stat().st_size
            found.append({"page": name, "bytes": size, **_worked_with(browser, PAGES[name](place, rows))})
    return {"rows": rows, "sized": sized, "pages": found}


@contextmanager
def _browser() -> Iterator[Any]:
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        raise InputError("no browser to open pages with", found="no Chromium", expected=" or ".join(BROWSERS))
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        hint = "python -m pip install playwright"
        raise InputError("Playwright, which drives the browser, is not installed", hint=hint) from None
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-gpu"])
        yield browser
        browser.close()


def _worked_with(browser: Any, path: Path) -> dict[str, Any]:
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    session = context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def busy_ms() -> float:
        told = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
        return 1000.0 * told["TaskDuration"]

    def taken_ms(act: Callable[[], object]) -> float:
        # Whatever was begun before is over.
        page.evaluate(_FRAMES)
        before = busy_ms()
        act()
        page.evaluate(_FRAMES)
        return busy_ms() - before

    load = taken_ms(lambda: page.goto(path.as_uri()))
    steps = [{"step": name, "cpu_ms": taken_ms(act)} for name, act in _steps(page)]
    context.close()
    spent = [one["cpu_ms"] for one in steps]
    return {
        "load_ms": load,
        "steps": steps,
        "cpu_ms_p95": float(np.percentile(spent, 95.0)),
        "cpu_ms_max": max(spent),
    }


def _steps(page: Any) -> Iterator[Step]:
    """Yield what a person does, one after the other; only what the page has. All of it by keys and the mouse, since
    what drives the browser would otherwise do work of its own on the page.
    """

    def pressed(what: str, keys: Sequence[str]) -> Iterator[Step]:
        for key in keys:
            yield what, lambda key=key: page.keyboard.press(key)

    def there(place: str) -> bool:
        """Return whether the page has it; it gets the focus."""
        return page.evaluate(f"(() => {{ const one = {_SEEN.format(place)}; if (one) one.focus(); return !!one; }})()")

    there("#find")
    yield from pressed("type a letter", ["Space" if letter == " " else letter for letter in _WORDS])
    yield from pressed("delete a letter", ["Backspace"] * len(_WORDS))
    if page.evaluate("!!document.getElementById('detail')"):
        yield from _review_steps(page, pressed, there)
        return
    for choice in page.evaluate("[...document.querySelectorAll('form select:not([hidden])')].map((one) => one.id)"):
        others = page.evaluate("(id) => document.getElementById(id).options.length - 1", choice)
        there(f"#{choice}")
        yield from pressed(f"choose in #{choice}", ["ArrowDown"] * others + ["Home"])
    page.evaluate("document.activeElement.blur()")
    yield from pressed("change the grey", ["b"] * 3)
    for place, key in (("[data-line] a, .thumbnail a", "ArrowDown"), (".card", "ArrowRight")):
        if there(place):
            yield from pressed(f"press {key}", [key] * 4)
    if page.evaluate("!!document.querySelector('.compare')"):
        yield from pressed("go to the divider", ["c"])
        yield from pressed("move the divider", ["ArrowRight"] * 3)
    for place in ("img.coded", "button.more"):
        box = page.evaluate(_PLACE.format(_SEEN.format(place)))
        if box is not None:
            yield f"point at {place}", lambda box=box: page.mouse.move(*box)
            yield f"click {place}", lambda box=box: page.mouse.click(*box)
    last = page.evaluate("[...document.querySelectorAll('[data-line] a, .thumbnail a')].at(-1).getAttribute('href')")
    yield "follow a link to the last row", lambda: page.evaluate("(to) => { location.hash = to; }", last)
    page.evaluate("document.activeElement.blur()")
    yield from pressed("scroll by a screen", ["PageUp"] * 2 + ["PageDown"] * 2 + ["End", "Home"])


def _review_steps(
    page: Any, pressed: Callable[[str, Sequence[str]], Iterator[Step]], there: Callable[[str], bool]
) -> Iterator[Step]:
    """Yield the actions of a person on the page of a review, once it has searched."""
    there("#order")
    yield from pressed("choose in #order", ["ArrowDown"] * 6 + ["Home"])
    there(".tile[tabindex]")
    yield from pressed("press an arrow", ["ArrowRight"] * 4)
    yield from pressed("press a light", ["2", "3", "1"])
    yield from pressed("press a view", ["r", "d", "p"])
    yield from pressed("tick and untick marks", ["m", "m"])
    yield from pressed("open a picture", ["Enter"])
    page.wait_for_selector(".compare input")
    there(".compare input")
    yield from pressed("move the divider", ["ArrowRight"] * 3)
    yield from pressed("press the map", ["d"])
    page.wait_for_selector("#d-stage canvas")
    box = page.evaluate(_PLACE.format(_SEEN.format("#d-stage canvas")))
    yield "point at the map", lambda: page.mouse.move(*box)
    yield from pressed("close the picture", ["Escape"])
    yield from pressed("press the colour shift", ["s", "g"])
    last = page.evaluate("Object.values(MATERIALS.at(-1).rows).at(-1).anchor")
    yield "follow a link to the last row", lambda: page.evaluate("(to) => { location.hash = to; }", last)
    page.evaluate("document.activeElement.blur()")
    yield from pressed("scroll by a screen", ["PageUp"] * 2 + ["PageDown"] * 2 + ["End", "Home"])


def report(figures: dict) -> str:
    """Return the figures as a table."""
    body = [
        [
            one["page"],
            f"{one['bytes'] / 1e6:.2f}",
            f"{one['load_ms']:.0f}",
            str(len(one["steps"])),
            f"{one['cpu_ms_p95']:.0f}",
            f"{one['cpu_ms_max']:.0f}: {max(one['steps'], key=lambda step: step['cpu_ms'])['step']}",
        ]
        for one in figures["pages"]
    ]
    headings = ["page", f"MB, {figures['sized']} rows", "opened, ms", "steps", "p95, ms", "longest, ms"]
    return (
        f"pages of {figures['rows']} rows in Chromium, its thread's processor time\n{columns(headings, body, left=1)}"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = command(__doc__)
    parser.add_argument("--rows", type=int, default=500, metavar="N", help="of pages that are worked with (500)")
    parser.add_argument("--sized", type=int, default=246, metavar="N", help="of pages that are weighed (246)")
    parser.add_argument("--page", action="append", choices=list(PAGES), help="only this one; may be said again")
    args = parser.parse_args(arguments)
    figures = run(args.rows, args.sized, args.page or tuple(PAGES))
    print(report(figures))
    write_json(args.json, figures)


if __name__ == "__main__":
    main()
