"""Work beside the window: of each kind the newest, and nothing is lost between two looks."""

import threading
import time

from metamer.materials.catalogue.material import Material
from metamer.viewer.window import edited_materials
from metamer.viewer.window.background import Background
from metamer.viewer.window.edited_materials import Fitting
from patience import patient


def until(true, seconds=30.0):
    end = time.monotonic() + patient(seconds)
    while not true():
        assert time.monotonic() < end
        time.sleep(0.001)


def test_of_a_kind_that_waits_only_the_newest_is_done():
    thread, go, done = Background(), threading.Event(), []
    thread.ask("first", go.wait)
    until(lambda: not thread._waiting)
    for number in range(3):
        thread.ask("numbers", lambda number=number: done.append(number))
    thread.ask("never", lambda: done.append("never"))
    thread.forget("never")
    go.set()
    until(lambda: len(thread._heard) == 2)
    assert done == [2] and [heard.kind for heard in thread.poll()] == ["first", "numbers"]
    thread.close()


def test_a_defect_is_heard_of_and_the_next_work_is_done(capsys):
    thread = Background()
    for work in (lambda: 1 / 0, lambda: 7):
        thread.ask("number", work)
        until(lambda: thread._heard and thread._doing is None)
        (heard,) = thread.poll()
    assert heard.result == 7 and "ZeroDivisionError" in capsys.readouterr().err
    thread.close()


def test_what_has_come_is_pending_until_it_is_heard_of(monkeypatch):
    made = object.__new__(Material)
    monkeypatch.setattr(edited_materials, "varied", lambda *args: made)
    variants = Fitting(lambda name: made)
    assert variants.material("tiny/a", (("reflectance_scale", 0.5),)) is None and variants.pending
    until(lambda: variants._thread._heard and variants._thread._doing is None)
    assert variants.pending
    assert variants.arrived() and not variants.pending and not variants.arrived()
    assert variants.material("tiny/a", (("reflectance_scale", 0.5),)) is made
    variants.close()
