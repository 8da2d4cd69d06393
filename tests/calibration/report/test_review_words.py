"""The one sentence of a review: how many pictures are near enough, and what the screen cannot show of them."""

import pytest
from metamer.calibration.report.review_words import facts_sentence, verdict_sentence

NONE = {"borderline": 0, "too_far_off": 0, "below_gamut": 0, "above_white": 0, "limits_unknown": 0}


@pytest.mark.parametrize(
    ("counts", "expected"),
    [
        ({"pictures": 1, "accurate": 1}, "The one picture is accurate enough to judge colour by."),
        ({"pictures": 72, "accurate": 72}, "All 72 pictures are accurate enough to judge colour by."),
        (
            {"pictures": 72, "accurate": 72, "below_gamut": 6, "above_white": 9},
            "All 72 pictures are accurate enough to judge colour by; 6 hold colours that an sRGB screen cannot show, "
            "and 9 have highlights cut at white.",
        ),
        (
            {"pictures": 4, "accurate": 1, "borderline": 1, "too_far_off": 2, "below_gamut": 1},
            "1 of 4 pictures is accurate enough to judge colour by; 1 is borderline and 2 are too far off; "
            "1 holds colours that an sRGB screen cannot show.",
        ),
        (
            {"pictures": 2, "accurate": 0, "too_far_off": 2, "limits_unknown": 2},
            "0 of 2 pictures are accurate enough to judge colour by; 2 are too far off; "
            "of 2 it is not known what the screen cannot show.",
        ),
    ],
)
def test_a_verdict_is_one_sentence(counts, expected):
    assert verdict_sentence(NONE | counts, "sRGB - Display", valid=True) == expected


def test_a_review_whose_check_failed_gives_no_verdict():
    said = verdict_sentence(NONE | {"pictures": 2, "accurate": 2}, "sRGB - Display", valid=False)
    assert said.startswith("The report's check of itself") and "accurate" not in said


def test_a_figure_over_its_limit_is_not_written_as_the_limit():
    said = facts_sentence({"worst": {"p99": 1.002}}, 1.0)
    assert "ΔE94 1.002 of the reference (limit 1)" in said and "approves no colour" in said
