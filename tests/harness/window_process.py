"""Runs checks in the window, in a process of its own: python window_process.py CHECKS.py CATALOGUE WORDS OUT.json

CHECKS.py holds functions `check_*(it)`, run one after the other in one window; `it` drives it with imgui's test engine.
OUT.json says of each "" or why it failed. A file may say how the window is in SIZE and SCALE.
"""

from __future__ import annotations

import importlib.util
import json
import sys
import time
import traceback
from pathlib import Path

from imgui_bundle import hello_imgui, imgui, immapp
from imgui_bundle.immapp import testing
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.viewer.window import worker
from metamer.viewer.window.canvas_renderer import Quality
from metamer.viewer.window.session_loader import comparison_of, load, subject_of
from metamer.viewer.window.shell import main_loop
from metamer.viewer.window.state import Session
from metamer.viewer.window.workspace import Desk, begun
from patience import patient

# Seconds that anything may take to come about; software GL on a busy machine is slow.
PATIENCE_S = 45.0


class It:
    """The window under test, and the hands that use it."""

    def __init__(self, context, window):
        self.context, self.window = context, window

    @property
    def desk(self):
        return self.window.desk

    @property
    def session(self):
        return self.desk.session

    @property
    def frame(self):
        return self.window.frame

    def frames(self, count=2):
        self.context.yield_(count)

    def wait(self, condition, what=""):
        """Wait until it is true."""
        end = time.monotonic() + patient(PATIENCE_S)
        while not condition():
            assert time.monotonic() < end, f"waited for {what or condition}; {self.state}"
            self.frames(1)

    def settled(self):
        """Wait until the picture is exact, and nothing is being read or loaded."""
        self.frames(2)
        window = self.window

        def still():
            frame = window.frame
            return frame is not None and frame.texture is not None and frame.quality == Quality.EXACT

        self.wait(lambda: still() and not window.files.busy() and not window.probing.busy, "an exact picture")

    @property
    def state(self):
        """State in words, for messages."""
        window, frame = self.window, self.window.frame
        drawn = "nothing drawn" if frame is None else f"{frame.quality!r} {frame.reached:.2f} {frame.problem}"
        busy = f"files {window.files.busy()}, probing {window.probing.busy}, asking {window.asking.busy()}"
        return f"{drawn}; {busy}; moving {window.moving}; said: {self.said}"

    @property
    def said(self):
        return " | ".join(one.words for one in self.desk.notices)

    def words(self):
        """Return all that panels write in a frame, a text each."""
        heard, kinds = [], ("text_unformatted", "text_disabled", "text_wrapped", "text")
        real = {kind: getattr(imgui, kind) for kind in kinds}
        for kind, written in real.items():
            setattr(imgui, kind, lambda words, written=written: (heard.append(words), written(words))[1])
        try:
            self.frames(2)
        finally:
            for kind, written in real.items():
                setattr(imgui, kind, written)
        return heard

    def click(self, label):
        """A widget by its place and label: "Top/A##compare"."""
        self.context.item_click(f"//{label}")
        self._no_error(label)
        self.frames(1)

    def pick(self, label):
        """A widget by its label alone, wherever it is."""
        self.context.item_click(f"**/{label}")
        self._no_error(label)
        self.frames(1)

    def choose(self, combo, label):
        """An entry of a list that has to be opened."""
        self.context.item_click(f"//{combo}")
        self.frames(2)
        self.context.item_click(f"//$FOCUSED/{label}")
        self._no_error(f"{combo}, {label}")
        self.frames(1)

    def type(self, label, text):
        """Text into a field, and Enter."""
        self.context.item_input(f"//{label}")
        self.context.key_chars_replace_enter(text)
        self._no_error(label)
        self.frames(2)

    def key(self, chord):
        """Press a key as commands name it."""
        from imgui_bundle import imgui
        from metamer.viewer.window.commands import chord_parts
        from metamer.viewer.window.shell.keys import key_of

        held, name = chord_parts(chord)
        modifiers = {"Ctrl": imgui.Key.mod_ctrl, "Shift": imgui.Key.mod_shift, "Alt": imgui.Key.mod_alt}
        found = key_of(name)
        if found is None:
            self.context.key_chars(name)
        else:
            code = int(found)
            for one in held:
                code |= int(modifiers[one])
            self.context.key_press(code)
        self.frames(2)

    def point(self, across=0.5, along=0.5):
        """The mouse to a place of the picture, in shares of it; returns the place on the screen."""
        info = self.context.item_info("//Picture/picture")
        low, high = info.rect_full.min, info.rect_full.max
        place = low.x + across * (high.x - low.x), low.y + along * (high.y - low.y)
        self.context.mouse_move_to_pos(place)
        self.frames(2)
        return place

    def tab(self, name):
        self.click(f"Right/tabs/{name}")
        self.frames(2)

    def picture(self):
        """Return what the display is sent, (H,W,3) of 8 bits; read between two frames, where the context is."""
        from metamer.viewer.window.canvas_readback import read_codes

        return self.on_gpu(lambda: read_codes(self.frame.texture).copy())

    def on_gpu(self, work):
        """Have something done where the GL context is, between two frames."""
        found = []
        before = self.window.step

        def step():
            before()
            if not found:
                found.append(work())
                self.window._context.screen.use()

        self.window.step = step
        try:
            self.wait(lambda: bool(found), "the GPU")
        finally:
            self.window.step = before
        return found[0]

    def capture(self, path):
        testing.capture(self.context, str(path))

    def _no_error(self, what):
        assert not self.context.is_error(), f"not found: {what}"


def checks_of(path):
    """The functions of a file of checks, in order, and the file as a module."""
    spec = importlib.util.spec_from_file_location(Path(path).stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return {name: one for name, one in vars(module).items() if name.startswith("check_")}, module


def main(path, catalogue, words, out):
    # On a busy machine the lowest priority would never be served.
    worker.NICE = 0
    checks, module = checks_of(path)
    found = subject_of(words.split(), Catalogue.open(catalogue))
    if isinstance(found, Session):
        session, loaded = found, load(found.subject, found.catalogue)
    else:
        loaded = load(found, catalogue)
        session = begun(loaded, **comparison_of(words.split()))
    results = {}

    def script(context, window):
        imgui.test_engine.get_io(hello_imgui.get_imgui_test_engine()).config_watchdog_kill_test = 200.0
        it = It(context, window)
        for name, check in checks.items():
            begun = time.perf_counter()
            try:
                check(it)
                results[name] = "failed in the test engine" if context.is_error() else ""
            except BaseException:
                results[name] = traceback.format_exc()
            print(f"{name}: {time.perf_counter() - begun:.1f} s", flush=True)
            if results[name]:
                # Whatever is done after an error of the engine does nothing.
                break

    def runs(params, window):
        window.measures_by_itself = getattr(module, "MEASURES", False)
        testing.run(
            test_function=lambda context: script(context, window),
            runner_params=params,
            add_ons_params=immapp.AddOnsParams(with_implot=True),
        )

    desk = Desk(loaded, session)
    size, scale = getattr(module, "SIZE", (960, 620)), getattr(module, "SCALE", 1.0)
    try:
        main_loop.run(desk, size=size, runs=runs, scale=scale)
    finally:
        Path(out).write_text(json.dumps(results), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
