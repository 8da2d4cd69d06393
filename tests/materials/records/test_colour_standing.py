"""Colour and gloss of a material have a standing each, as its record states them: nothing is guessed."""

from types import SimpleNamespace

import numpy as np
import pytest
from metamer.materials.formats import family
from metamer.materials.records.colour_standing import colour_standing, gloss_standing, standing_sentences, title_of
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.source import Rejected
from metamer.runtime.errors import InputError, MetamerError

DESCRIPTION = """
family = "paint"
kind = "analytic"
{family}
[[material]]
name = "red"
model = "oren_nayar"
reflectance = {reflectance}
sigma = 0.3
{material}
"""
TABLE = '{ table = "chart", column = "Bordeaux 7", geometry = "45:0" }'


def record(kind, model, **original):
    """A record of that provenance and model."""
    return MaterialRecord("paint/red", "paint", model, {}, Provenance("s", "l", kind), None, original=original)


def read(folder, of_family="", of_material="", reflectance=TABLE):
    """The material of a description with these lines in it."""
    (folder / "chart.csv").write_text("wavelength_nm,Bordeaux 7\n400,0.1\n500,0.2\n700,0.3\n", encoding="utf-8")
    sources = '[chart]\nfile = "chart.csv"\nsource = "measured here"\nlicence = "CC0"\n'
    (folder / "sources.toml").write_text(sources, encoding="utf-8")
    text = DESCRIPTION.format(family=of_family, material=of_material, reflectance=reflectance)
    (folder / "paint.toml").write_text(text, encoding="utf-8")
    (found,) = family.read_sources(folder / "paint.toml", "")
    if isinstance(found, Rejected):
        raise found.reason
    return found


@pytest.mark.parametrize(
    ("kind", "model", "original", "expected"),
    [
        ("analytic", "oren_nayar", {"colour": "measured"}, ("measured", "analytic")),
        ("analytic", "coated_diffuse", {}, ("unknown", "analytic")),
        ("analytic", "cook_torrance", {"colour": "analytic"}, ("analytic", "analytic")),
        ("measured", "lambert", {}, ("measured", "analytic")),
        ("measured", "rgl", {}, ("measured", "measured")),
        ("measured", "btf", {}, ("measured", "measured")),
        ("uplifted(mallett-yuksel)", "merl", {}, ("uplifted", "measured")),
        ("uplifted(mallett-yuksel)", "metallic_roughness", {}, ("uplifted", "analytic")),
        ("reconstructed(flakes)", "flake_tilt", {}, ("measured", "reconstructed")),
    ],
)
def test_colour_and_gloss_stand_apart(kind, model, original, expected):
    found = record(kind, model, **original)
    assert (colour_standing(found), gloss_standing(found)) == expected
    plain = standing_sentences(found)
    assert ("was measured on a real sample" in plain) == (expected[0] == "measured")
    assert ("does not say whether the colour was measured" in plain) == (expected[0] == "unknown")


@pytest.mark.parametrize("lines", [('colour = "measured"', ""), ("", 'colour = "measured"')])
def test_a_description_says_where_a_colour_comes_from(tmp_path, lines):
    source = read(tmp_path, *lines)
    assert source.original["colour"] == "measured"
    np.testing.assert_array_equal(source.original["colour_nm"], [400.0, 700.0])


def test_a_description_that_says_nothing_of_a_colour_leaves_it_unknown(tmp_path):
    assert dict(read(tmp_path, "", 'title = "Bordeaux, matt"').original) == {"title": "Bordeaux, matt"}


@pytest.mark.parametrize("line", ['colour = "guessed"', "title = 3", 'title = " "'])
def test_what_a_description_cannot_say_is_refused(tmp_path, line):
    with pytest.raises(MetamerError, match=r"paint\.toml"):
        read(tmp_path, "", line)


def test_a_constant_is_no_measured_colour(tmp_path):
    with pytest.raises(InputError, match="no measured colour"):
        read(tmp_path, 'colour = "measured"', reflectance="{ constant = 0.2 }")


@pytest.mark.parametrize(
    ("original", "expected"),
    [({"title": "Signal red, gloss"}, "Signal red, gloss"), ({"name": "RAL 3001"}, "RAL 3001"), ({}, "Signal red 2")],
)
def test_a_title_is_what_was_said_or_the_id_spelt_out(original, expected):
    assert title_of(SimpleNamespace(id="paint/signal-red-2", original=original)) == expected
