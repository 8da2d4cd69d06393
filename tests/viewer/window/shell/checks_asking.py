"""Asking: the error of this view, clipping, the plan; parameters, neighbours, metamerism; the protocol."""

from pathlib import Path

import numpy as np
from metamer.calibration.report.rating import read_protocol
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.spectral.formula import Formula
from metamer.viewer.window.metamerism import metamerism
from metamer.viewer.window.state import Other

# The reference is asked for by the check alone.
MEASURES = False


def check_the_reference_of_this_view_is_measured(it):
    it.settled()
    it.tab("Trust")
    assert it.window.measuring.words() == "not measured"
    it.click("Right/tabs/Trust/Measure now")
    # A first figure of some rows, which is soon; all of them take a while on two cores.
    it.wait(lambda: (found := it.window.measuring.found) is not None and found.statistics is not None, "the reference")
    words = it.window.measuring.words()
    assert words.startswith("ΔE94 p95 ") and "ago" in words
    # The catalogue was fitted to within 1.
    assert 0.0 < it.window.measuring.found.statistics.p95 < 2.0


def check_a_change_of_view_forgets_it(it):
    it.key("Left")
    it.settled()
    assert it.window.measuring.found is None
    it.key("Home")
    it.settled()


def check_what_is_clipped_is_counted(it):
    for _ in range(6):
        it.key("E")
    it.settled()
    it.wait(lambda: (found := it.window.asking.answer("clipping")) and found.result, "clipped pixels")
    words = it.window.asking.answer("clipping").result[0]
    codes = it.picture()
    assert "brighter than white" in words
    # Every code at its end is one that was clipped, or that ends there by rounding.
    assert int(words.split(" ")[0]) == np.count_nonzero((codes == 255).any(-1)) or (codes == 255).any()
    it.key("R")
    it.settled()
    it.wait(lambda: (found := it.window.asking.answer("clipping")) is not None and not found.result, "nothing clipped")


def check_a_plan_is_told_with_its_reasons(it):
    it.click("Right/tabs/Trust/Plan this scene")
    it.wait(lambda: it.window.asking.answer("plan") is not None, "a plan")
    plan = it.window.asking.answer("plan").result
    assert plan.basis_size >= 3 and plan.reasons


def check_parameters_are_those_of_the_formula(it):
    it.tab("Edit")
    it.wait(lambda: it.window.asking.answer("sliders", "tiny/satin-green") is not None, "sliders")
    names = [one.name for one in it.window.asking.answer("sliders", "tiny/satin-green").result]
    assert "exponent_u" in names and "diffuse_scale" in names


def check_a_slider_edits_in_one_step_and_is_taken_back(it):
    steps = len(it.desk.history.past)
    it.context.item_input_value("//Right/tabs/Edit/##diffuse_scale", 0.5)
    it.frames(3)
    (edit,) = it.session.edits
    assert (edit.material, edit.parameter) == ("tiny/satin-green", "diffuse_scale") and abs(edit.value - 0.5) < 1e-3
    assert len(it.desk.history.past) == steps + 1
    it.click("Right/tabs/Edit/As in the catalogue")
    it.frames(2)
    assert not it.session.edits
    it.settled()


def check_neighbours_are_found_and_put_on_b(it):
    it.context.item_input_value("//Right/tabs/Edit/##amount", 50.0)
    it.click("Right/tabs/Edit/redder")
    it.wait(lambda: it.window.asking.answer("like") is not None, "neighbours")
    found = it.window.asking.answer("like").result
    names = [one.summary.id for one in found.found]
    assert names and "tiny/satin-green" not in names
    it.click("Right/tabs/Edit/###like 0")
    assert it.session.other.material == names[0]


def check_metamers_are_told_worst_first_and_shown(it):
    it.desk.do(lambda session: session, "nothing")
    it.tab("Metamerism")
    it.click("Right/tabs/Metamerism/Compare##metamers")
    it.wait(lambda: it.window.asking.answer("metamerism") is not None, "metamers")
    found = it.window.asking.answer("metamerism").result
    off = [one.delta_e for one in found.cells]
    assert off == sorted(off, reverse=True) and len(off) == 8 * 4
    catalogue = Catalogue.open(it.session.catalogue)
    names = ("tiny/satin-green", it.session.other.material)
    lights = {one.conditions.illuminant: None for one in found.cells}
    again = metamerism([catalogue.load(one) for one in names], lights, it.desk.choices.observers, Formula("CIE 1994"))
    assert [one.delta_e for one in again.cells] == off
    worst = found.cells[0]
    it.pick(f"{worst.conditions.illuminant}, {worst.conditions.observer.replace('_', ' ')}°##cell 0")
    assert it.session.light.lamps[0].name == worst.conditions.illuminant
    assert it.session.observer == worst.conditions.observer and it.session.other.material == worst.material
    it.key("Ctrl+Z")
    it.settled()


def check_what_is_seen_is_rated_with_what_the_probe_reads(it):
    it.key("A")
    it.point(0.5, 0.45)
    it.settled()
    it.wait(lambda: it.window.probing.cursor is not None and not it.window.probing.busy, "a reading")
    it.tab("Protocol")
    it.type("Right/tabs/Protocol/##reviewer", "Ann")
    it.type("Right/tabs/Protocol/##note", "a little too green")
    it.click("Right/tabs/Protocol/Approve")
    (rating,) = it.session.ratings
    assert (rating.verdict, rating.material, rating.note) == ("approved", "tiny/satin-green", "a little too green")
    read = {one.name: one.value for one in rating.probed}
    assert abs(read["L*"] - it.window.probing.cursor.readings[0].lab[0]) < 1e-9 and rating.reviewer == "Ann"


def check_keys_rate_and_the_protocol_is_written(it):
    it.desk.do(lambda session: session.wearing("body", "tiny/matt-red"), "Material")
    it.settled()
    it.key("Ctrl+Backspace")
    assert [one.verdict for one in it.session.ratings] == ["approved", "rejected"]
    it.click("Right/tabs/Protocol/Write the protocol...")
    it.frames(2)
    it.type("Dialog/##file", "protocol")
    assert read_protocol(Path("protocol.toml")) == it.session.ratings


def check_what_cannot_be_shown_is_said_and_all_else_goes_on(it):
    """Whatever is refused: the message is there, and goes with what asked for it."""
    it.desk.do(lambda session: session.__class__(**{**vars(session), "other": Other(material="no/such")}), "Wrong")
    it.frames(3)
    assert "no/such" in it.said
    it.key("Ctrl+Z")
    it.frames(3)
    assert "no/such" not in " ".join(one.words for one in it.desk.notices if one.problem)
