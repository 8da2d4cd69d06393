"""Shapes in signatures are checked while tests run: the import hook of tests/conftest.py takes effect."""

import importlib

import metamer
import numpy as np
import pytest
from jaxtyping import TypeCheckError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.difference import lab_from_xyz
from metamer.spectral.image import ColourImage
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix
from shape_checks import CHECKED_CALLS, next_test


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


def test_every_public_module_came_through_the_hook():
    """The `__init__` of a package comes through the finder of the editable install, and has nothing to check."""
    for home in metamer._HOMES.values():
        module = importlib.import_module(f"metamer.{home.rpartition('.')[0]}")
        assert "jaxtyping" in type(module.__loader__).__module__, module


def test_shapes_are_checked_however_often_a_test_before_has_called_a_function():
    for _ in range(CHECKED_CALLS + 1):
        lab_from_xyz(np.ones((2, 3)), np.ones(3))
    next_test()
    with pytest.raises(TypeCheckError):
        lab_from_xyz(np.ones((2, 4)), np.ones(3))
