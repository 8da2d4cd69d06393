"""The one sentence of a review: how many pictures are near enough, and what the screen cannot show of them."""

import pytest
from metamer.calibration.report.review_words import as_markdown, facts_sentence, verdict_sentence

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
            {"pictures": 3, "accurate": 3, "below_gamut": 2, "too_strong": 0, "below_black": 2},
            "All 3 pictures are accurate enough to judge colour by; 2 have shadows darker than the screen's black.",
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


def document(*results):
    """Make a document as `review.json` has it: material, p99, shares below the gamut and above white."""
    return {
        "status": "over",
        "verdict": "1 of 2 pictures is accurate enough.",
        "facts": "Rendering error.",
        "display": "sRGB - Display",
        "budget_delta_e94": 1.0,
        "warnings": ["A lamp is <dark>."],
        "plan": {"basis_size": 8, "reasons": ["a reason that nobody reads in a merge request"]},
        "materials": [
            {"id": one, "title": one.rpartition("/")[2].replace("-", " ").capitalize()} for one, *_ in results
        ],
        "results": [
            {
                "material": name,
                "illuminant": "TL84",
                "status": "pass" if p99 <= 1.0 else "over",
                "undefined_pixels": 0,
                "delta_e94": {"mean": 0.5 * p99, "p99": p99, "max": 2.0 * p99},
                "limits": None if below is None else {"below_gamut": below, "above_white": above},
            }
            for name, p99, below, above in results
        ],
    }


def test_a_summary_names_what_needs_a_look_as_people_do():
    """The farthest off first; what is accurate and wholly shown is left out, and so are plan and hashes."""
    text = as_markdown(
        document(
            ("paint/sky-blue", 0.2, 0.0, 0.005),
            ("paint/pale|red", 0.3, 0.16, 0.1),
            ("paint/signal-red", 1.004, None, None),
        )
    )
    rows = [line for line in text.splitlines() if line.startswith("|")][2:]
    assert rows == [
        "| Signal red under shop light TL84 | too far off | 0.50 | 1.004 | 2.01 |  |",
        r"| Pale\|red under shop light TL84 | accurate enough | 0.15 | 0.30 | 0.60 "
        "| 16 % too strong, 10 % cut at white |",
    ]
    assert "- A lamp is \\<dark\\>." in text and "reason" not in text and "Sky blue" not in text


def test_shadows_below_black_are_not_called_too_strong():
    """The one is part of the other in the file, whose older ones have the sum alone."""
    review = document(("paint/sky-blue", 0.2, 0.3, 0.0))
    review["results"][0]["limits"]["below_black"] = 0.28
    assert "| 2 % too strong, 28 % darker than its black |" in as_markdown(review)


def test_a_summary_of_a_good_review_has_no_table():
    assert "|" not in as_markdown(document(("paint/sky-blue", 0.2, 0.0, 0.0)))
