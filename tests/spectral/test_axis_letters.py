"""Shapes in signatures are checked while tests run: the import hook of tests/conftest.py takes effect."""

import sys

import numpy as np
import pytest
from jaxtyping import TypeCheckError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.difference import lab_from_xyz
from metamer.spectral.image import ColourImage
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix


def test_wrong_last_axis_is_caught():
    with pytest.raises(TypeCheckError, match="xyz"):
        lab_from_xyz(np.zeros((2, 4)), np.ones(3))


def test_list_in_place_of_an_array_is_caught():
    with pytest.raises(TypeCheckError):
        lab_from_xyz([[0.1, 0.2, 0.3]], np.ones(3))


def test_two_axes_of_one_letter_must_agree():
    with pytest.raises(TypeCheckError):
        SpectralBasis("loose", WORKING_WAVELENGTHS_NM, np.zeros((81, 3)), np.zeros((80, 3)))


def test_fields_of_dataclasses_are_caught():
    with pytest.raises(TypeCheckError):
        ColourImage(np.zeros((4, 4, 3), np.float32), "xyz", np.ones(4))


def test_unknown_literal_is_caught():
    with pytest.raises(TypeCheckError):
        interpolation_matrix(WORKING_WAVELENGTHS_NM, WORKING_WAVELENGTHS_NM, "repeat")


def test_every_module_of_ours_came_through_the_hook():
    ours = [
        name
        for name, module in sys.modules.items()
        if name.startswith("metamer.") and getattr(module, "__file__", None)
    ]
    plain = [
        name
        for name in ours
        if not name.startswith("metamer.catalogs") and "jaxtyping" not in type(sys.modules[name].__loader__).__module__
    ]
    # A package's own __init__ comes through the finder of the editable install; ours are empty or nearly so.
    # pytest loads its plug-ins before any conftest.
    plugin = "metamer.calibration.regression.pytest_plugin"
    assert all(sys.modules[name].__file__.endswith("__init__.py") or name == plugin for name in plain), plain
