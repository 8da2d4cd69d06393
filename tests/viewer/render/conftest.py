"""Fixtures that tests of pictures share: shadows worked out at few vertices."""

import pytest
from metamer.lighting.visibility import precompute, refinement


@pytest.fixture(autouse=True)
def few_vertices(monkeypatch):
    """Both renderers take what hides a light from the same vertices; more of them are tested where they are found."""
    monkeypatch.setattr(refinement, "MOST_VERTICES", 400)
    monkeypatch.setattr(precompute, "_TRAINING", 400)
