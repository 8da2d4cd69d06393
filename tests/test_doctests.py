"""Examples in docstrings say what is true."""

import doctest
import importlib
import tomllib
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
MODULES = [
    f"{package}.{path.stem}".removesuffix(".__init__")
    for package in PACKAGES
    for path in sorted(ROOT.joinpath(*package.split(".")[1:]).glob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]


def test_there_are_examples():
    assert MODULES


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    # An import of colour-science, in whichever test came before, makes numpy print as it did long ago.
    with np.printoptions(legacy=False):
        failed, tried = doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS)
    assert tried and not failed
