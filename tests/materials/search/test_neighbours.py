"""Neighbours of a material, and wishes in words."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.search import neighbours
from metamer.materials.search.appearance_offset import PAIRS, WORDS, Appearance, wished
from metamer.materials.search.neighbours import like
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.difference import delta_e_lab

GREY = Appearance((50.0, 0.0, 0.0), 0.0)
ORANGE = Appearance((60.0, 30.0, 40.0), 2.0)


@pytest.fixture
def greys(tmp_path, write_matt, write_spectrum):
    """Matt greys of four reflectances, a reddish one and a lamp."""
    for percent in (10, 20, 40, 80):
        write_matt(tmp_path / "cat", f"paint/grey-{percent}", percent / 100)
    write_matt(tmp_path / "cat", "paint/red", np.linspace(0.1, 0.3, 81))
    write_spectrum(tmp_path / "cat", "lamp/led")
    return Catalogue.open(tmp_path / "cat")


@pytest.fixture
def tiny(tiny_catalogue):
    return Catalogue.open(tiny_catalogue)


def ids(found):
    return [one.summary.id for one in found.found]


def test_a_wish_of_nothing_gives_the_nearest_first(greys):
    found = like(greys, "paint/grey-20")
    assert set(ids(found)) == {"paint/grey-10", "paint/grey-40", "paint/grey-80", "paint/red"}
    distances = [one.distance for one in found.found]
    assert distances == sorted(distances) and found.own_distance == 0.0
    one = found.found[0]
    assert one.distance == pytest.approx(float(delta_e_lab(np.array(found.of.lab), np.array(one.look.lab))), abs=1e-9)


def test_a_wish_leads_to_what_fulfils_it(greys):
    """From grey 20 (L* 51.8) to grey 40 (L* 69.5)."""
    found = like(greys, "paint/grey-20", {"lighter": 18})
    first = found.found[0]
    assert first.summary.id == "paint/grey-40"
    assert found.wish.got(first.look)["lighter"] == pytest.approx(17.6, abs=0.1)
    assert max(found.wish.besides(first.look).values(), default=0.0) < 0.01
    assert ids(like(greys, "paint/grey-20", {"warmer": 10}))[0] == "paint/red"


def test_who_is_farther_from_the_wish_than_the_material_itself_is_no_answer(greys):
    assert ids(like(greys, "paint/grey-80", {"lighter": 5})) == []
    assert ids(like(greys, "paint/grey-20", {"darker": 16})) == ["paint/grey-10"]


def test_a_material_alone_in_its_catalogue_has_no_neighbour(tmp_path, write_matt):
    write_matt(tmp_path / "cat", "paint/grey", 0.5)
    found = like(Catalogue.open(tmp_path / "cat"), "paint/grey")
    assert found.found == () and found.looked_at == 0


def test_what_cannot_be_compared_is_named(greys, tmp_path, write_matt):
    write_matt(tmp_path / "cat", "signal/vest", packs=(), error=None)
    found = like(greys, "paint/grey-20")
    assert found.left_out == {
        "lamp/led": "an emission spectrum, not a surface",
        "signal/vest": "no colour is known of it",
    }


def test_what_fluoresces_or_has_holes_is_named(greys, monkeypatch):
    summaries = greys.query()
    vest = replace(summaries[1], id="signal/vest", quantity="bispectral")
    assert neighbours.unlike(vest) == "fluorescent: its colour is that of one light"
    record = greys["paint/grey-40"]
    monkeypatch.setattr(type(record.fast), "cutout", object(), raising=False)
    assert "holes" in neighbours.look_of(record, greys.summary("paint/grey-40"))


def test_a_light_asked_for_neighbours_is_refused(greys):
    with pytest.raises(InputError, match=r"lamp/led: no neighbours\n  found: an emission spectrum"):
        like(greys, "lamp/led")


def test_a_damaged_file_holds_up_no_other(greys):
    path = greys.path("paint/grey-40")
    content = bytearray(path.read_bytes())
    content[-1000:] = bytes(1000)
    path.write_bytes(content)
    found = like(greys, "paint/grey-20")
    assert "paint/grey-40" not in ids(found) and len(found.found) == 3
    assert [reason.file for reason in found.unusable] == [path]


def test_gloss_counts_as_much_as_its_weight_says(tiny):
    """From matt red it is a long way to copper in colour: worth it where a stop counts much, else not."""
    found = like(tiny, "tiny/matt-red", {"glossier": 2}, stop=40.0)
    first = found.found[0]
    assert first.summary.id == "tiny/copper"
    assert found.wish.got(first.look)["glossier"] == pytest.approx(2.0, abs=0.5)
    assert found.wish.start.gloss == pytest.approx(0.0, abs=1e-3)
    assert first.look.gloss_units > 5.0 > found.wish.start.gloss_units
    colour = float(delta_e_lab(np.array(found.wish.to.lab), np.array(first.look.lab)))
    gloss = 40.0 * (first.look.gloss - found.wish.to.gloss)
    assert first.distance == pytest.approx(np.hypot(colour, gloss), rel=1e-9)
    assert ids(like(tiny, "tiny/matt-red", {"glossier": 2}, stop=1.0)) == []


def test_nothing_is_glossier_than_the_metal(tiny):
    assert ids(like(tiny, "tiny/copper", {"glossier": 1})) == []


def test_only_what_may_be_near_is_read_and_nothing_is_missed(greys, monkeypatch):
    """All of them, sorted, are what a search that stops early begins with."""
    everything = like(greys, "paint/grey-20", {"lighter": 30}, limit=100)
    read = []
    look_of = neighbours.look_of
    monkeypatch.setattr(neighbours, "look_of", lambda record, one: read.append(one.id) or look_of(record, one))
    first = like(greys, "paint/grey-20", {"lighter": 30}, limit=1)
    assert ids(first) == ids(everything)[:1] and first.found[0].distance == everything.found[0].distance
    # Itself, and two candidates at most before what is left is farther in colour alone.
    assert len(read) <= 3 < len(greys)


def test_without_a_weight_gloss_does_not_count(tiny):
    found = like(tiny, "tiny/matt-red", {}, stop=0.0)
    for one in found.found:
        assert one.distance == pytest.approx(float(delta_e_lab(np.array(found.of.lab), np.array(one.look.lab))))
    with pytest.raises(InputError, match="weight of gloss"):
        like(tiny, "tiny/matt-red", {}, stop=-1.0)


@pytest.mark.parametrize(("more", "less"), [pair[:2] for pair in PAIRS])
def test_a_word_and_its_opposite_lead_apart(more, less):
    there, back = (wished(ORANGE, {word: 1.5}).to.point - ORANGE.point for word in (more, less))
    assert np.linalg.norm(there) == pytest.approx(1.5)
    np.testing.assert_allclose(there, -back, atol=1e-12)
    with pytest.raises(InputError, match=f"found: {more} and {less}"):
        wished(ORANGE, {less: 1, "lighter": 1, more: 2} if more != "lighter" else {less: 1, more: 2})


def test_words_add_up_and_each_says_what_it_got():
    wish = wished(ORANGE, {"redder": 3, "warmer": 10, "glossier": 1})
    warm = np.radians(50.0)
    expected = [60, 33 + 10 * np.cos(warm), 40 + 10 * np.sin(warm), 3]
    np.testing.assert_allclose(wish.to.point, expected, atol=1e-12)
    got = wish.got(Appearance((55.0, 33.0, 40.0), 1.5))
    assert got["redder"] == pytest.approx(3.0) and got["warmer"] == pytest.approx(3 * np.cos(warm))
    assert got["glossier"] == pytest.approx(-0.5)
    assert wish.besides(Appearance((55.0, 33.0, 40.0), 1.5)) == pytest.approx({"darker": 5.0})


def test_an_unknown_word_is_said_with_those_that_there_are():
    with pytest.raises(UnknownNameError) as raised:
        wished(GREY, {"warmr": 1})
    assert "nearest: warmer" in str(raised.value) and all(word in str(raised.value) for word in WORDS)


@pytest.mark.parametrize(
    ("start", "wish", "said"),
    [
        (GREY, {"stronger": 5}, "no hue"),
        (GREY, {"darker": 51}, "no more than there is"),
        (GREY, {"duller": 0.5}, "no more than there is"),
        (ORANGE, {"greyer": 51}, "a chroma of 50.00"),
        (ORANGE, {"warmer": 0}, "cooler is the word"),
        (ORANGE, {"warmer": -3}, "cooler is the word"),
        (ORANGE, {"duller": float("nan")}, "more than 0"),
    ],
)
def test_what_no_material_can_be_is_refused(start, wish, said):
    with pytest.raises(InputError, match=said):
        wished(start, wish)
