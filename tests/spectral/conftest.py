"""Fixtures that the spectral tests share: the oracle, and the chart that bases are tried on."""

import numpy as np
import pytest
from metamer.benchmarks.basis import stage
from metamer.spectral.colour_library import colour_science


@pytest.fixture(scope="session")
def colour():
    """colour-science, the oracle: its import warns about optional packages, which the door keeps quiet."""
    return colour_science()


@pytest.fixture(scope="session")
def chart():
    """ColorChecker under D65, A and FL1-FL12: `reflectances` (24,81), `weights` by light, `columns` (81,42)."""
    return stage()


@pytest.fixture
def rng():
    return np.random.default_rng(20211)
