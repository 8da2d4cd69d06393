"""Work of a reviewer, done in real windows: files of checks run in a process each, and each check is a test here."""

from pathlib import Path

import pytest

pytestmark = pytest.mark.window

HERE = Path(__file__).resolve().parent


def checks(name):
    """The names of a file's checks, without importing what only that process has."""
    path = HERE / f"checks_{name}.py"
    lines = path.read_text(encoding="utf-8").splitlines()
    return [line.split("(")[0].removeprefix("def ") for line in lines if line.startswith("def check_")]


@pytest.fixture(scope="module")
def done(in_window, small_scene):
    """Results of a file of checks; each file runs once."""
    kept = {}

    def results(name):
        if name not in kept:
            kept[name] = in_window(HERE / f"checks_{name}.py", str(small_scene))
        return kept[name]

    return results


def all_checks():
    names = [path.stem.removeprefix("checks_") for path in sorted(HERE.glob("checks_*.py"))]
    return [pytest.param(name, check, id=f"{name}-{check[6:]}") for name in names for check in checks(name)]


@pytest.mark.parametrize(("name", "check"), all_checks())
def test_in_the_window(done, name, check):
    results, said = done(name)
    assert check in results, f"not reached: {said}"
    assert results[check] == "", results[check]
