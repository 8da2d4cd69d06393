"""Trust: the error of this very view, the chain, the plan and why, what was clipped, and how long things take."""

from __future__ import annotations

from imgui_bundle import imgui

from ...chain import chain
from ...picture_statistics import ask_plan
from ..widgets import facts, heading, paragraph, quiet, tooltip
from ..window import Window

# Names of the kinds of work, in the order in which they are listed.
_WORK = {"moving": "while moving", "material": "material", "light, observer": "light, observer", "still": "one sample",
         "exact": "exact picture", "display": "compare and display", "statistics": "statistics"}  # fmt: skip


def draw(window: Window) -> None:
    """All of it."""
    desk, style, frame = window.desk, window.style, window.frame
    heading("THIS VIEW AGAINST THE REFERENCE", style)
    measuring = window.measuring
    if desk.session.subject.kind == "image":
        quiet("An image is shown as it is: there is no reference of it.")
    elif measuring is not None:
        paragraph(measuring.words())
        found = measuring.found
        if found is not None and found.statistics is not None:
            one = found.statistics
            rows = [("ΔE94 mean", f"{one.mean:.3f}"), ("p95", f"{one.p95:.3f}"), ("p99", f"{one.p99:.3f}"),
                    ("maximum", f"{one.max:.2f}"), ("took", f"{found.seconds:.1f} s")]  # fmt: skip
            facts("measured", rows)
        if imgui.button("Measure now"):
            desk.run("reference")
        imgui.same_line()
        _, window.measures_by_itself = imgui.checkbox("by itself", window.measures_by_itself)
        tooltip("Measures each view that stands still, in a process of its own.")
    heading("COLOUR CHAIN", style)
    if frame is not None:
        for words in chain(desk.session, frame.display):
            paragraph(words)
        for words in frame.display.describe() if window.kept.chain_in_full else ():
            quiet(words)
        _, window.kept.chain_in_full = imgui.checkbox("in full", window.kept.chain_in_full)
    heading("CLIPPING", style)
    counted = window.asking.answer("clipping")
    for words in (counted.result or ("Nothing that is seen is clipped.",)) if counted else ("Not counted yet.",):
        quiet(words)
    if desk.session.subject.kind != "image":
        heading("PLAN", style)
        _plan(window)
    heading("TIME", style)
    seconds = frame.seconds if frame is not None else {}
    rows = [(words, f"{1000.0 * seconds[key]:.0f} ms") for key, words in _WORK.items() if key in seconds]
    io = imgui.get_io()
    rows.append(("frames", f"{io.framerate:.0f} a second"))
    facts("time", rows)
    quiet(window.driver)


def _plan(window: Window) -> None:
    answer = window.asking.answer("plan")
    if answer is not None and answer.problem:
        quiet(answer.problem)
    elif answer is not None:
        plan = answer.result
        quiet(f"{plan.basis_size} coefficients, ΔE94 {plan.spectral_delta_e94:.2f} at most, {plan.precision} precision")
        for words in plan.reasons:
            quiet(words)
    if imgui.button("Plan this scene"):
        lights = tuple(name for name in window.desk.choices.lights if name)
        ask_plan(window.asking, window.frame, lights, window.desk.loaded.catalogue)
    tooltip("The smallest spectral basis that keeps these colours within ΔE94 1 under all lights on keys, and why.")
