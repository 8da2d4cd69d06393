"""JSON with a line a value is what the library writes, by its encoder in C."""

import json

import numpy as np
import pytest
from metamer.runtime.json_text import indented_json

VALUES = (
    [], {}, (), "", "ΔE \"94\"\n\u2028", 0.1, -0.0, 1e-300, 10**30, True, None, [[]], [{}], {"a": {}}, ([], ()),
    {"a": [1.0, 2, None, "x"], "b": {"c": [[1], [2.5, [True, {"d": []}]]], "ü\n": ()}, "": [{"x": 1}, {}, "y"]},
)  # fmt: skip


@pytest.mark.parametrize("indent", [0, 1, 3])
@pytest.mark.parametrize("value", VALUES, ids=range(len(VALUES)))
def test_the_text_is_that_of_the_library(value, indent):
    expected = json.dumps(value, indent=indent, ensure_ascii=False, allow_nan=False)
    assert indented_json(value, indent) == expected
    assert indented_json({"k": [value, 1]}, indent) == json.dumps({"k": [value, 1]}, indent=indent, ensure_ascii=False)


def test_random_trees_are_written_as_the_library_does():
    rng = np.random.default_rng(1)

    def tree(depth):
        kind = rng.integers(5 if depth else 3)
        if kind < 3:
            return (float(rng.normal()), int(rng.integers(-9, 9)), f"é{rng.integers(9)}")[kind]
        held = [tree(depth - 1) for _ in range(rng.integers(4))]
        return held if kind == 3 else {f"n{at}": one for at, one in enumerate(held)}

    for _ in range(200):
        one = tree(5)
        assert indented_json(one) == json.dumps(one, indent=1, ensure_ascii=False)


@pytest.mark.parametrize("value", [float("nan"), [1.0, float("inf")], {"a": [[float("-inf")]]}])
def test_what_is_no_number_is_refused(value):
    with pytest.raises(ValueError, match="not JSON compliant"):
        indented_json(value)


@pytest.mark.parametrize("value", [{1: [[]]}, {"a": [object()]}, [{"b"}]])
def test_what_json_has_no_word_for_is_refused(value):
    with pytest.raises(TypeError):
        indented_json(value)


def test_values_go_through_the_encoder_in_c(monkeypatch):
    monkeypatch.setattr(json.encoder, "_make_iterencode", None)
    with pytest.raises(TypeError):
        json.dumps([1.0], indent=1)
    assert indented_json({"a": [[1.0, 2.0]] * 2}).count("\n") == 11
