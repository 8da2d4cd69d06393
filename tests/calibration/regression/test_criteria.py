"""Criteria as they are written: what is taken, and what is refused by name."""

import numpy as np
import pytest
from metamer.calibration.regression.criteria import (
    STATISTICS,
    TIERS,
    criteria_of,
    default_criteria,
    read_criteria,
    statistic,
)
from metamer.calibration.regression.result import worst_tier
from metamer.calibration.regression.row import RowName
from metamer.runtime.errors import InputError

LINE = {"statistic": "mean", "warn": 0.1, "fail": 0.5}


def test_a_file_is_read(tmp_path):
    path = tmp_path / "criteria.toml"
    path.write_text(
        """
[[criteria]]
label = "paint"
subset = { material = ["paint/*", "metal/gold"], light = "D65", of = "picture", region = "face" }
statistic = "share over 0.5"
formula = "CMC 2:1"
warn = 0.01
fail = 0.1

[regions]
face = [0.25, 0.0, 0.75, 1]

[rows]
removed = "warn"
""",
        encoding="utf-8",
    )
    found = read_criteria(path)
    line = found.lines[0]
    assert (line.label, line.of, line.region, line.formula.name) == ("paint", ("picture",), "face", "CMC 2:1")
    assert line.applies(RowName("paint/red", "D65", "x")) and not line.applies(RowName("paint/red", "A", "x"))
    assert line.applies(RowName("metal/gold", "D65", "")) and not line.applies(RowName("cloth/red", "D65", ""))
    assert (found.removed, found.added, found.regions["face"]) == ("warn", "warn", (0.25, 0.0, 0.75, 1.0))
    assert [one.name for one in found.formulas] == ["CIE 1994", "CMC 2:1"]


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"statistic": "p97"}, "criteria[0].statistic", "p95"),
        ({"statistic": 7}, "criteria[0].statistic", "mean"),
        ({"formula": "CIE 1995"}, "criteria[0].formula", "CIE 1994"),
        ({"warn": "much"}, "criteria[0].warn", "number"),
        ({"warn": -1}, "criteria[0].warn", "0 or above"),
        ({"fail": True}, "criteria[0].fail", "number"),
        ({"fail": 0.01}, "criteria[0]", "warn <= fail"),
        ({"limit": 1}, "criteria[0]", "warn"),
        ({"over": "lights"}, "criteria[0].over", "rows"),
        ({"subset": "paint"}, "criteria[0].subset", "table"),
        ({"subset": {"colour": "red"}}, "criteria[0].subset", "material"),
        ({"subset": {"of": "truth"}}, "criteria[0].subset.of", "reference"),
        ({"subset": {"region": "face"}}, "criteria[0].subset.region", "corner"),
        ({"subset": {"material": 5}}, "criteria[0].subset.material", "pattern"),
    ],
)
def test_a_wrong_line_is_refused_by_field(change, field, words):
    with pytest.raises(InputError, match=words) as refused:
        criteria_of({"criteria": [LINE | change], "regions": {"corner": [0, 0, 0.5, 0.5]}})
    assert refused.value.field == field


@pytest.mark.parametrize(
    "document",
    [
        {},
        {"criteria": LINE},
        {"criteria": [LINE], "regions": {"face": [0.5, 0, 0.4, 1]}},
        {"criteria": [LINE], "regions": {"face": [0, 0, 1]}},
        {"criteria": [LINE], "regions": 5},
        {"criteria": [LINE], "rows": {"removed": "ignore"}},
        {"criteria": [LINE], "rows": {"moved": "pass"}},
        {"criteria": ["mean"]},
    ],
)
def test_a_wrong_document_is_refused(document):
    with pytest.raises(InputError):
        criteria_of(document)


def test_a_table_of_another_name_is_not_passed_over(tmp_path):
    text = '[[criteria]]\nstatistic = "mean"\nwarn = 0\nfail = 1\n[region]\nface = [0, 0, 1, 1]\n'
    (tmp_path / "c.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="regions"):
        read_criteria(tmp_path / "c.toml")


def test_text_that_is_no_toml_names_its_file(tmp_path):
    (tmp_path / "c.toml").write_text("[[criteria", encoding="utf-8")
    with pytest.raises(InputError, match=r"c\.toml"):
        read_criteria(tmp_path / "c.toml")


def test_tiers_have_their_limits_on_the_better_side():
    line = criteria_of({"criteria": [LINE]}).lines[0]
    assert [line.tier(value) for value in (0.1, 0.11, 0.5, 0.51, np.nan, np.inf)] == [
        "pass",
        "warn",
        "warn",
        "fail",
        "fail",
        "fail",
    ]


#: Pixels of 100 and what each is off by; -fail, -failpercent, -hardfail, -warn, -warnpercent and -hardwarn; what idiff
#: of OpenImageIO 3.2.2 ended with, of a picture of so many pixels beside a black one.
IDIFF = [
    ((1, 0.5), (0.5, 0, 9, 0.25, 100, 9), 0),  # on the limit is within it
    ((1, 0.75), (0.5, 0, 9, 0.25, 100, 9), 2),
    ((2, 0.75), (0.5, 2, 9, 0.25, 5, 9), 0),  # as many as are allowed
    ((3, 0.75), (0.5, 2, 9, 0.25, 5, 9), 2),
    ((2, 0.75), (0.5, 2, 9, 0.25, 1, 9), 1),
    ((2, 0.75), (0.5, 2, 9, 0.25, 2, 9), 0),
    ((1, 2.0), (0.5, 1, 3, 0.25, 1, 2), 0),
    ((1, 3.0), (0.5, 1, 3, 0.25, 1, 2), 1),
    ((1, 3.5), (0.5, 1, 3, 0.25, 1, 2), 2),
]


@pytest.mark.parametrize(("pixels", "asked", "code"), IDIFF)
def test_tiers_are_those_of_idiff(pixels, asked, code):
    """By the lines that docs/regression.md gives for its options."""
    fail, fail_percent, hard_fail, warn, warn_percent, hard_warn = asked
    lines = [
        {"statistic": f"share over {warn}", "warn": warn_percent / 100, "fail": 1.0},
        {"statistic": f"share over {fail}", "warn": fail_percent / 100, "fail": fail_percent / 100},
        {"statistic": "max", "warn": hard_warn, "fail": hard_fail},
    ]
    off = np.zeros(100, np.float32)
    off[: pixels[0]] = pixels[1]
    tiers = [line.tier(statistic(line.statistic, off)) for line in criteria_of({"criteria": lines}).lines]
    assert TIERS.index(worst_tier(tiers)) == code


def test_statistics_are_those_of_numpy():
    values = np.random.default_rng(0).exponential(size=999)
    expected = [values.mean(), np.median(values), *np.percentile(values, [95, 99]), values.max()]
    assert [statistic(name, values) for name in STATISTICS] == pytest.approx(expected, rel=1e-12)
    assert statistic("share over 0.7", values) == np.mean(values > 0.7)
    assert np.isnan(statistic("p99", values[:0]))


def test_the_criteria_of_nobody_are_in_order():
    assert all(line.warn < line.fail for line in default_criteria().lines)
