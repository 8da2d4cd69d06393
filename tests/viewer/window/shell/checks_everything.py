"""Every command is done once; every tab is opened; and undo takes all of it back."""

import random

SIZE = (920, 560)
# Commands that end the window or leave the screen, or open a dialog, which another check does.
APART = {"quit", "fullscreen", "reload"}
# Commands that take long to draw in software: done, and undone before they are drawn.
SLOW = ("booth.", "bounces", "influence.", "shape.", "samples.up", "other.reference", "reference")


def check_every_command_can_be_done_and_undone(it):
    it.settled()
    first = it.session.settled
    commands = [one for one in it.desk.commands if one.name not in APART]
    random.Random(7).shuffle(commands)
    for number, one in enumerate(commands):
        it.desk.run(one)
        if one.name.startswith(SLOW):
            it.desk.undo()
        elif number % 4 == 0:
            it.frames(1)
        # Dialogs and held keys are not left as they are.
        it.desk.dialog = None
        if it.session.flicked:
            it.desk.run("compare.flick")
    it.window.panels_shown = True
    it.frames(2)
    for _ in range(len(it.desk.history.past)):
        it.desk.undo()
    assert it.session.settled == first and not it.desk.history.past
    it.settled()


def check_every_tab_is_drawn(it):
    for tab in ("Edit", "Metamerism", "Protocol", "Trust", "Pins"):
        it.tab(tab)


def check_shares_are_written_as_shares(it):
    for _ in range(6):
        it.key("E")
    it.tab("Trust")
    it.settled()
    it.wait(lambda: any("%) clipped" in one for one in it.words()), "what is clipped")
    assert not any("%%" in one for one in it.words())
    it.key("R")


def check_an_idle_frame_draws_no_picture_and_reads_none_back(it):
    it.settled()
    it.frames(3)
    made, kept = it.frame.texture, {}
    from metamer.viewer.gl.full_screen import FullScreen
    from metamer.viewer.window.shell import window as reading

    for holder, name in ((FullScreen, "draw"), (reading, "values_of")):
        kept[holder, name] = real = getattr(holder, name)

        def noted(*args, _real=real, _name=name, **kwargs):
            calls.append(_name)
            return _real(*args, **kwargs)

        setattr(holder, name, noted)
    calls = []
    try:
        it.frames(5)
    finally:
        for (holder, name), real in kept.items():
            setattr(holder, name, real)
    assert calls == [] and it.frame.texture is made and not it.window.busy


def check_gl_reports_no_error_and_nothing_is_undefined(it):
    import numpy as np
    from metamer.viewer.gl.tile import read

    it.settled()
    assert it.on_gpu(lambda: it.window._context.error) == "GL_NO_ERROR"
    assert np.isfinite(it.on_gpu(lambda: read(it.frame.canvases[0]))).all()
