"""Fixtures that the tests of lighting share."""

import warnings

import numpy as np
import pytest
from metamer.lighting.vectors import welded


@pytest.fixture(scope="module")
def mi():
    """Mitsuba 3 with spectra, or a skip that says what is missing."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mitsuba = pytest.importorskip("mitsuba", reason="mitsuba: pip install 'metamer-colour[mitsuba]'")
        if "scalar_spectral" not in mitsuba.variants():
            pytest.skip("this Mitsuba has no scalar_spectral variant")
        mitsuba.set_variant("scalar_spectral")
    return mitsuba


@pytest.fixture(scope="session")
def watertight():
    """Check that every edge of a mesh, found by position, is of two triangles that run along it in opposite senses."""

    def is_watertight(mesh):
        corners = welded(mesh.vertices)[1][mesh.faces]
        edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
        there = {(a, b) for a, b in edges.tolist()}
        return len(there) == len(edges) and all((b, a) in there for a, b in there)

    return is_watertight
