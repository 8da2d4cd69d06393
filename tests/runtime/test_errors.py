"""Words of errors."""

from pathlib import Path

import pytest
from metamer.runtime.errors import ComparisonError, InputError, MetamerError, UnknownNameError, UsageError


def test_message_names_the_thing_the_value_the_expectation_and_the_next_step():
    error = InputError(
        "negative reflectance", file=Path("a.csv"), field="Red", found="-0.1 at 400 nm", expected=">= 0", hint="look"
    )
    assert str(error).splitlines() == [
        "a.csv: Red: negative reflectance",
        "  found: -0.1 at 400 nm",
        "  expected: >= 0",
        "  try: look",
    ]


def test_parts_that_are_not_known_are_left_out():
    assert str(InputError("no such file")) == "no such file"
    assert str(InputError("zero", field="x", found=0)) == "x: zero\n  found: 0"


@pytest.mark.parametrize(("kind", "code"), [(MetamerError, 4), (InputError, 4), (ComparisonError, 3), (UsageError, 64)])
def test_exit_codes(kind, code):
    assert kind("reason").exit_code == code
    assert issubclass(kind, MetamerError)


def test_whoever_knows_more_of_the_place_says_so():
    error = InputError("too large", field="values", found=3, expected="<= 1", hint="look")
    placed = error.at(file="a.csv", field="red")
    assert str(placed).splitlines() == ["a.csv: red: too large", "  found: 3", "  expected: <= 1", "  try: look"]
    assert error.file is None and "a.csv" not in str(error)
    unknown = UnknownNameError("light", "d65", ["D65"]).at(file="b.toml")
    assert isinstance(unknown, UnknownNameError) and unknown.nearest == ["D65"] and str(unknown).startswith("b.toml: ")


def test_unknown_name_gives_the_nearest():
    error = UnknownNameError("illuminant", "d56", ["D50", "D55", "D65", "FL11"])
    assert error.nearest[0] in {"D55", "D65"}
    assert "nearest:" in str(error) and "found: 'd56'" in str(error)


def test_unknown_name_far_from_all_lists_the_few_that_are_known():
    error = UnknownNameError("method", "quite else", ["A", "B"])
    assert error.nearest == []
    assert "expected: A, B" in str(error) and "try" not in str(error)


def test_unknown_name_among_many_does_not_list_them_all():
    said = str(UnknownNameError("light", "x", [f"lamp {n}" for n in range(20)]))
    assert "one of 20 known names, such as lamp 0, lamp 1" in said and "lamp 19" not in said
    assert "such as" not in str(UnknownNameError("light", "lamp 21", [f"lamp {n}" for n in range(20)]))
