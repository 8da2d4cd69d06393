"""What the viewer's tests share."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def scenes() -> ModuleType:
    """The module scenes.py beside this file: small scenes and hand-made packs."""
    path = Path(__file__).with_name("scenes.py")
    spec = importlib.util.spec_from_file_location("viewer_test_scenes", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
