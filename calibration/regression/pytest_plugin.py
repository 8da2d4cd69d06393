"""pytest plugin for `assert_colour_close`: a fixture with an evidence folder per test.

pytest loads it wherever Metamer is installed; nothing heavy is imported before a test uses it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--colour-evidence DIR`."""
    parser.getgroup("metamer").addoption(
        "--colour-evidence",
        metavar="DIR",
        default="colour-evidence",
        help="where colours that are not close leave figures, pictures and a page, a folder a test (colour-evidence)",
    )


@pytest.fixture
def assert_colour_close(request: pytest.FixtureRequest) -> Callable[..., Any]:
    """Return `metamer.calibration.regression.assertions.assert_colour_close` with evidence in a folder of this test."""
    from .assertions import assert_colour_close

    root = request.config.rootpath / str(request.config.getoption("--colour-evidence"))
    name = re.sub(r"[^\w.-]+", "-", request.node.nodeid).strip("-")
    calls = 0

    def held(reference: Any, sample: Any, criteria: Any = None, **more: Any) -> Any:
        nonlocal calls
        __tracebackhide__ = True
        calls += 1
        folder = root / (name if calls == 1 else f"{name}-{calls}")
        return assert_colour_close(reference, sample, criteria, **{"evidence": folder, **more})

    return held
