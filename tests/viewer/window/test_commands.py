"""Commands, keys, palette and history."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metamer.lighting.scene_file.files import load_scene, shipped_scene
from metamer.spectral.illuminants import illuminant
from metamer.viewer.window.choices import LIGHTS, Choices, opened
from metamer.viewer.window.command_list import commands, swapped
from metamer.viewer.window.commands import Command, Commands
from metamer.viewer.window.history import History
from metamer.viewer.window.light_choice import LightChoice
from metamer.viewer.window.numeric_controls import DIALS, EXPOSURE, TOLERANCE
from metamer.viewer.window.places import Pin, Region
from metamer.viewer.window.state import Other, Subject
from metamer.viewer.window.viewpoint import orbited, panned, zoomed
from window_sessions import sessions

SCENE = load_scene(shipped_scene("speed_shape"))
MATERIALS = ("paint/red", "paint/blue", "metal/gold")
CHOICES = Choices.of(SCENE, MATERIALS, {"sRGB - Display": ("Un-tone-mapped", "ACES 1.0 - SDR Video")})
COMMANDS = commands(CHOICES)
CHANGING = tuple(one for one in COMMANDS if one.change is not None)
START = opened(SCENE, Subject(path="speed_shape.toml"))


def test_every_light_that_has_a_key_is_known():
    assert [illuminant(name).quantity for name in LIGHTS if name] == ["emission"] * 8


def test_every_command_does_something_from_some_state():
    """None is there that changes nothing, wherever it is called."""
    elsewhere = replace(
        START,
        light=replace(LightChoice.named("C"), dimming=0.5), observer="2015_2",
        other=Other("paint/blue", LightChoice.named("C"), "2015_2", made="reference"),
        view=zoomed(orbited(START.view, 20.0, 20.0), 1.5), part="elsewhere", influence="floor", exposure=1.0,
        subject=replace(START.subject, shape="cloth"), shown=replace(START.shown, proof="x"),
        compare=replace(START.compare, mode="wipe", formula="CIE 2000", position=0.4),
        adaptation=replace(START.adaptation, degree=0.3), turntable_deg_s=10.0,
    )  # fmt: skip
    elsewhere = elsewhere.edited("paint/red", "roughness", 0.3)
    region = Region("r", 0.0, 0.0, 1.0, 1.0)
    elsewhere = replace(elsewhere, pins=(Pin("a", "body", 0, (1.0, 0.0, 0.0)),), regions=(region,))
    idle = [one.name for one in CHANGING if one(elsewhere) == elsewhere and one(START) == START]
    assert not idle


def test_the_keys_that_people_know():
    known = {
        "1": "light.scene", "2": "light.D65", "Shift+2": "other.light.D65", "W": "compare.wipe", "F6": "compare.wipe",
        "E": "exposure.up", "Shift+E": "exposure.down", "R": "reset", "F": "view.frame", "?": "help", "H": "help",
        "Ctrl+Shift+P": "palette", "Ctrl+Z": "undo", "Shift": "compare.flick", "D": "compare.difference",
    }  # fmt: skip
    assert {key: COMMANDS.by_key[key].name for key in known} == known


def test_numbers_switch_lights_and_keep_how_they_are_turned_and_dimmed():
    turned = replace(START, light=LightChoice(rotation_deg=30.0, dimming=0.5))
    lit = COMMANDS.by_key["3"](turned)
    assert lit.light.words == "A, turned by 30°, dimmed to 0.5"
    assert COMMANDS.by_key["1"](lit).light == turned.light


def test_a_key_that_two_commands_have_is_refused():
    with pytest.raises(ValueError, match="W is the key of a and of b"):
        Commands([Command("a", "A", "g", ("W",)), Command("b", "B", "g", ("W",))])


@pytest.mark.parametrize(
    ("query", "first"),
    [
        ("wipe", "compare.wipe"),
        ("map de", "compare.difference"),
        ("ΔE map", "compare.difference"),
        ("65 booth", "booth.D65"),
        ("b light fl11", "other.light.FL11"),
        ("WARMER", "material.like"),
        ("gold material", "material.metal/gold"),
    ],
)
def test_the_palette_finds_words_in_any_order(query, first):
    assert COMMANDS.found(query)[0].name == first


def test_the_palette_shows_all_where_nothing_is_asked_and_none_where_nothing_fits():
    assert len(COMMANDS.found("")) == len(COMMANDS) and COMMANDS.found("xyzzy light") == ()


def test_help_lists_every_key_once():
    listed = [key for group in COMMANDS.help().values() for one in group for key in one.keys]
    assert sorted(listed) == sorted(COMMANDS.by_key)


def test_a_flick_shows_the_other_side_and_leaves_no_trace():
    flick = COMMANDS["compare.flick"]
    assert flick.held and START.seen == "A"
    held = flick(START)
    assert held.seen == "B" and held.settled == START and flick(held) == START
    assert flick(COMMANDS["compare.B"](START)).seen == "A"


def test_swapping_twice_changes_nothing_that_is_seen():
    session = replace(START, other=Other("paint/blue", LightChoice.named("A"), "2015_10"))
    once = swapped(session, CHOICES)
    assert once.light == LightChoice.named("A") and once.observer == "2015_10"
    assert CHOICES.material(once) == "paint/blue" and once.other.light == START.light
    assert swapped(once, CHOICES).other == session.other
    assert CHOICES.material(swapped(once, CHOICES)) == CHOICES.material(session)


# Actions of a user: a command, a slider dragged, the camera dragged, an undo, a redo, the pointer moved.
MOVES = st.one_of(
    st.sampled_from(CHANGING).map(lambda one: ("do", one)),
    st.tuples(st.just("dial"), st.sampled_from(DIALS), st.floats(-400.0, 400.0)),
    st.tuples(st.just("drag"), st.floats(-90.0, 90.0), st.floats(-90.0, 90.0)),
    st.tuples(st.just("cursor"), st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
    st.sampled_from([("undo",), ("redo",), ("release",)]),
)


def moved(history, move):
    kind, *given_ = move
    now = history.now
    if kind == "do":
        return history.done(given_[0](now), given_[0].words)
    if kind == "dial":
        return history.done(given_[0].at(now, given_[1]), given_[0].words, given_[0].name)
    if kind == "drag":
        return history.done(replace(now, view=orbited(now.view, *given_)), "Orbit", "orbit")
    if kind == "cursor":
        return history.passed(replace(now, cursor=tuple(given_)))
    return {"undo": history.undo, "redo": history.redo, "release": history.released}[kind]()


@given(walk=st.lists(MOVES, min_size=200, max_size=200))
@settings(deadline=None, max_examples=10)
def test_undo_through_a_walk_of_200_commands_leads_back_to_the_start(walk):
    history = History(START)
    for move in walk:
        history = moved(history, move)
    end, steps = history.now.settled, len(history.past)
    while history.past:
        history = history.undo()
    assert history.now.settled == START
    assert len(history.undone) >= steps
    for _ in range(steps):
        history = history.redo()
    assert history.now.settled == end


@pytest.mark.filterwarnings("ignore:Do not use the `random` module")
@given(start=sessions, walk=st.lists(MOVES, max_size=20))
@settings(deadline=None, max_examples=10)
def test_from_any_session_commands_lead_to_sessions_and_back(start, walk):
    history = History(start)
    for move in walk:
        history = moved(history, move)
    while history.past:
        history = history.undo()
    assert history.now.settled == start


def test_a_drag_is_one_step_and_the_next_one_another():
    history = History(START)
    for degrees in (1.0, 2.0, 3.0):
        history = history.done(replace(START, view=orbited(START.view, degrees)), "Orbit", "orbit")
    assert len(history.past) == 1
    history = history.released().done(replace(START, view=orbited(START.view, 9.0)), "Orbit", "orbit")
    assert len(history.past) == 2 and history.undo().now.view == orbited(START.view, 3.0)
    assert history.undo().undo().now == START and history.undo_words == "Orbit"


def test_what_is_done_after_an_undo_ends_what_was_undone():
    history = History(START).done(EXPOSURE.at(START, 1.0), "Exposure").undo()
    assert history.redo_words == "Exposure" and history.redo().now.exposure == 1.0
    assert history.done(TOLERANCE.at(START, 2.0), "Tolerance").redo_words is None


def test_an_undo_leaves_the_pointer_where_it_is():
    history = History(START).done(EXPOSURE.at(START, 1.0), "Exposure")
    undone = history.passed(replace(history.now, cursor=(0.25, 0.75), flicked=True)).undo()
    assert undone.now.cursor == (0.25, 0.75) and undone.now.flicked and undone.now.exposure == 0.0


def test_a_dial_ends_at_its_ends_and_steps_by_ratios_where_it_is_logarithmic():
    assert EXPOSURE.at(START, 1e9).exposure == 10.0
    assert TOLERANCE.stepped(START, 2.0).compare.tolerance == pytest.approx(2.0)


def test_panning_moves_by_heights_of_the_picture():
    view = START.view
    across = panned(view, 1.0, 0.0)
    assert across.distance == pytest.approx(view.distance)
    off = [b - a for a, b in zip(view.target, across.target, strict=True)]
    assert sum(one * one for one in off) ** 0.5 == pytest.approx(view.height_at_target)
