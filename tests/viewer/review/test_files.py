"""Names of a review's pictures: two rows never share a file, on no file system, and a person can read them."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from metamer.viewer.review.files import picture_name

LIGHTS = st.one_of(st.none(), st.sampled_from(["D65", "d65", "FL11", "AS_LIT", "as lit", "F32T8/TL841"]), st.text())
IDS = st.one_of(st.text("ab/_-~.AB", min_size=1), st.text(min_size=1))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (("a/b_c", "D65"), ("a_b/c", "D65")),
        (("a/b", "D65"), ("a~b", "D65")),
        (("a/b", "D65"), ("a//b", "D65")),
        (("gold", "D65"), ("Gold", "D65")),
        (("gold", "D65"), ("gold", "d65")),
        (("gold", None), ("gold", "as lit")),
        (("gold", None), ("gold", "AS_LIT")),
        (("gold.D65", "A"), ("gold", "D65.A")),
        (("\u00e9", "A"), ("e\u0301", "A")),
        (("x" * 300 + "a", "A"), ("x" * 300 + "b", "A")),
    ],
)
def test_names_that_came_near_each_other(one, other):
    assert picture_name(*one).casefold() != picture_name(*other).casefold()


@given(IDS, LIGHTS, IDS, LIGHTS)
def test_different_rows_have_different_names(material, light, other, other_light):
    same = picture_name(material, light).casefold() == picture_name(other, other_light).casefold()
    assert same == ((material, light) == (other, other_light))


@given(IDS, LIGHTS)
def test_every_file_system_takes_the_name(material, light):
    """No sign that one of them forbids, no name of a device, and room for what writing beside it adds."""
    name = picture_name(material, light)
    assert re.fullmatch(r"[A-Za-z0-9_~-]+\.[A-Za-z0-9_~-]+", name)
    assert name.partition(".")[0].lower() not in {"con", "prn", "aux", "nul", "com1", "lpt9"}
    assert len(name) < 230


def test_plain_names_stay_readable():
    assert picture_name("colorchecker/dark-skin_matte", "LED-B3") == "colorchecker~dark-skin_matte.LED-B3"
    assert picture_name("merl/gold-paint", None) == "merl~gold-paint.as_lit"
