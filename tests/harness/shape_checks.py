"""Checks of shapes in signatures: of the first calls of each function in each test, unless all are asked for."""

import functools
import os
import types
from collections.abc import Sequence

import jaxtyping

#: Calls of one function that are checked in one test: a loop of thousands passes shapes of the same code each time.
CHECKED_CALLS = 20
ALL_SHAPES = os.environ.get("METAMER_SHAPES") == "all"
_tests = 0


def check_shapes(modules: Sequence[str]) -> None:
    """Check shapes in these modules, by METAMER_SHAPES in all of Metamer; none of them is imported yet."""
    if not ALL_SHAPES:
        # The decorator that the import hook puts on functions.
        jaxtyping.jaxtyped = _of_first_calls(jaxtyping.jaxtyped)
    jaxtyping.install_import_hook("metamer" if ALL_SHAPES else modules, "beartype.beartype")


def next_test() -> None:
    """Begin to count calls anew: whether a call is checked does not hang on the tests before."""
    global _tests
    _tests += 1


def _of_first_calls(jaxtyped):
    def decorator(*, typechecker):
        check = jaxtyped(typechecker=typechecker)

        def decorated(function):
            checked = check(function)
            return _sparing(checked, function) if isinstance(function, types.FunctionType) else checked

        return decorated

    return decorator


def _sparing(checked, function):
    test, calls = -1, 0

    @functools.wraps(checked)
    def called(*args, **kwargs):
        nonlocal test, calls
        if test != _tests:
            test, calls = _tests, 0
        calls += 1
        return (checked if calls <= CHECKED_CALLS else function)(*args, **kwargs)

    return called
