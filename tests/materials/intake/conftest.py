"""Imports whose fits take no time."""

import numpy as np
import pytest
from metamer.materials.core.axes import Axis
from metamer.materials.core.fit_error import FitError
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.materials.intake import importing
from metamer.spectral.palette import Palette


@pytest.fixture
def fits(monkeypatch):
    """Replaces the fit by a small pack at once; the list of ids that were fitted."""
    fitted = []

    def fit_one(material, budget, say=None):
        fitted.append(material.id)
        axes = tuple(Axis(name, 2, 1.5) for name in ("theta_i", "theta_o", "phi"))
        error = FitError(0.1, 0.2, 0.3, 0.4, "D65", "1931_2", "none", 0.0)
        pack = FactorPack("io", axes, (np.ones((2, 1)),) * 3, Palette.of(np.ones((1, 81))))
        return importing.FitResult(FactoredBrdf((pack,), error), 0.5)

    monkeypatch.setattr(importing, "fit_material", fit_one)
    return fitted
