"""A rating of what is seen says of what, in which light, and what the probe read of both sides."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from metamer.spectral.difference import delta_e_xyz
from metamer.viewer.window.choices import Choices
from metamer.viewer.window.displayed_value import Displayed
from metamer.viewer.window.light_choice import LightChoice
from metamer.viewer.window.probe import ProbeReading
from metamer.viewer.window.protocol import rating_of
from metamer.viewer.window.state import Compare, Other, Session

CHOICES = Choices(part="body", parts=("body",), worn={"body": "paint/red"})
WHITE = np.array([0.95, 1.0, 1.09])
SESSION = Session(light=LightChoice.named("FL11"), other=Other("paint/blue", LightChoice.named("A"), "2015_10"))
AT = datetime(2026, 3, 1, 12, tzinfo=UTC)


def reading(xyz):
    return ProbeReading((1, 2), ("body",), ("paint/red",), 1.0, "FL11", "1931_2", np.array(xyz), WHITE)


def test_a_rating_is_of_the_side_that_is_seen():
    of_a = rating_of(SESSION, CHOICES, "approved", score=4, note="good", reviewer="M", at=AT)
    assert of_a.key == ("paint/red", "FL11", "1931_2") and of_a.at == "2026-03-01T12:00:00+00:00"
    alone = replace(SESSION, compare=Compare("B"))
    assert rating_of(alone, CHOICES, "rejected").key == ("paint/blue", "A", "2015_10")
    bare = replace(alone, other=Other())
    assert rating_of(bare, CHOICES, "rejected").key == ("paint/red", "FL11", "1931_2")


def test_a_rating_has_the_probe_s_values_and_the_difference_of_both_sides():
    shown = Displayed(np.array([0.5, 0.2, 0.1]), (128, 51, 26), "")
    first, second = reading([0.3, 0.2, 0.1]), reading([0.31, 0.2, 0.12])
    probed = {one.name: one.value for one in rating_of(
        SESSION, CHOICES, "open", reading=first, other=second, shown=shown).probed}  # fmt: skip
    assert probed["Y"] == 0.2 and probed["G displayed"] == 51.0 and probed["X of B"] == 0.31
    assert probed["ΔE CIE 1994, B from A"] == pytest.approx(float(delta_e_xyz(first.xyz, second.xyz, WHITE)))
    black = rating_of(SESSION, CHOICES, "open", reading=reading([0.0, 0.0, 0.0])).probed
    assert "x" not in {one.name for one in black}


def test_rating_again_takes_the_place_of_what_was_said():
    first = SESSION.rated(rating_of(SESSION, CHOICES, "approved"))
    again = first.rated(rating_of(first, CHOICES, "rejected"))
    assert [one.verdict for one in again.ratings] == ["rejected"]
