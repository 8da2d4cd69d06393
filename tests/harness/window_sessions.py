"""Sessions for tests: any that is valid, by hypothesis."""

from hypothesis import strategies as st
from metamer.calibration.report.rating import VERDICTS, Probed, Rating
from metamer.lighting.environment.booth import LAMPS
from metamer.spectral.adaptation import CONE_FROM_XYZ
from metamer.spectral.observers import OBSERVERS
from metamer.viewer.window.light_choice import Lamp, LightChoice
from metamer.viewer.window.places import Pin, Region
from metamer.viewer.window.state import (
    FORMULAS,
    MODES,
    Adaptation,
    Compare,
    DisplaySettings,
    Edit,
    Other,
    Session,
    Subject,
    Worn,
)
from metamer.viewer.window.viewpoint import Viewpoint, orbited, panned, zoomed


def floats(low, high):
    return st.floats(low, high, allow_nan=False)


def maybe(strategy):
    return st.none() | strategy


# Whatever a person may type: quotes, control characters, other scripts.
texts = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12).filter(str.strip)
names = st.sampled_from(["body", "floor", "chips/1", 'a "quoted" one', "Δ λ\n\t\x7f", "ニス"])


def unique(strategy, key, most=3):
    return st.lists(strategy, max_size=most, unique_by=key).map(tuple)


lamps = st.builds(Lamp, texts, floats(1e-6, 1e6), maybe(texts))
lights = st.builds(
    LightChoice,
    unique(lamps, lambda one: one.name),
    st.just(None),
    maybe(texts),
    maybe(st.sampled_from(["smits", "mallett-yuksel"])),
    floats(-360.0, 360.0),
    floats(1e-3, 1.0),
) | st.builds(LightChoice, booth=st.sampled_from(tuple(LAMPS)))


@st.composite
def viewpoints(draw):
    view = Viewpoint(position=(0.6, 2.3, 6.0), target=(0.0, 0.36, 0.0), extent=19.0)
    if draw(st.booleans()):
        view = Viewpoint("flat", (1.0, 1.0, 3.0), projection="orthographic", extent=2.5)
    view = orbited(view, draw(floats(-720.0, 720.0)), draw(floats(-200.0, 200.0)))
    return zoomed(panned(view, draw(floats(-2.0, 2.0)), draw(floats(-2.0, 2.0))), draw(floats(0.1, 10.0)))


@st.composite
def pins(draw):
    first = draw(floats(0.0, 1.0))
    second = draw(floats(0.0, 1.0)) * (1.0 - first)
    return Pin(draw(texts), draw(names), draw(st.integers(0, 10**6)), (first, second, 1.0 - first - second))


def region(name, left, top, width, height):
    return Region(name, left, top, left + width, top + height)


ratings = st.builds(
    Rating,
    texts,
    texts,
    texts,
    st.sampled_from(VERDICTS),
    st.integers(0, 5),
    st.text(st.characters(exclude_categories=["Cs"]), max_size=20),
    st.just(""),
    st.just("2026-03-01T12:00:00+00:00"),
    st.lists(st.builds(Probed, texts, floats(-1e9, 1e9)), max_size=3).map(tuple),
)
others = st.builds(
    Other, maybe(texts), maybe(lights), maybe(st.sampled_from(tuple(OBSERVERS))), maybe(texts),
    st.sampled_from(["fast", "reference"]),
) | st.builds(Other, made=st.just("file"), file=texts)  # fmt: skip
sessions = st.builds(
    Session,
    subject=st.builds(
        Subject, st.sampled_from(["scene", "materials", "image"]), texts, unique(texts, str), maybe(texts)
    ),
    catalogue=maybe(texts),
    view=viewpoints(),
    turntable_deg_s=floats(-360.0, 360.0),
    samples=st.integers(1, 64),
    part=maybe(names),
    worn=unique(st.builds(Worn, names, texts), lambda one: one.part),
    edits=unique(st.builds(Edit, texts, names, floats(-1e12, 1e12)), lambda one: (one.material, one.parameter)),
    light=lights,
    observer=st.sampled_from(tuple(OBSERVERS)),
    other=others,
    compare=st.builds(
        Compare, st.sampled_from(MODES), floats(0.0, 1.0), floats(0.005, 1.0), st.sampled_from(FORMULAS),
        floats(0.01, 100.0), floats(0.01, 100.0), st.booleans(),
    ),
    adaptation=st.builds(Adaptation, st.sampled_from(tuple(CONE_FROM_XYZ)), floats(0.0, 1.0)),
    exposure=floats(-10.0, 10.0),
    surround=floats(20.0, 90.0),
    shown=st.builds(DisplaySettings, maybe(texts), maybe(texts), maybe(texts), st.booleans(), maybe(texts)),
    bounces=st.booleans(),
    influence=maybe(names),
    pins=unique(pins(), lambda one: one.name),
    regions=unique(
        st.builds(region, texts, floats(0.0, 0.5), floats(0.0, 0.5), floats(0.01, 0.5), floats(0.01, 0.5)),
        lambda one: one.name,
    ),
    ratings=unique(ratings, lambda one: one.key),
    interface=st.sampled_from(["dark", "light"]),
)  # fmt: skip
