"""Cells of a hemisphere."""

import numpy as np
import pytest
from metamer.lighting.transfer.cells import HemisphereCells


@pytest.fixture(scope="module")
def cells():
    return HemisphereCells(8)


def test_cells_are_even_by_the_cosine(cells):
    """Directions as dense as the cosine fall into all cells alike."""
    u, v = np.random.default_rng(0).random((2, 200_000))
    radius, turn = np.sqrt(u), 2.0 * np.pi * v
    to = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - u)], axis=1)
    counts = np.bincount(cells.of(to), minlength=len(cells))
    np.testing.assert_allclose(counts, 200_000 / 64, rtol=0.08)


def test_directions_lie_in_their_cells(cells):
    number = np.repeat(np.arange(len(cells)), 50)
    to = cells.within(number, np.random.default_rng(1).uniform(1e-6, 1.0 - 1e-6, (len(number), 2)))
    np.testing.assert_allclose(np.linalg.norm(to, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(cells.of(to), number)
    np.testing.assert_array_equal(cells.of(cells.directions()), np.arange(len(cells)))


def test_a_right_angle_turns_cells_into_cells(cells):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    every = np.arange(len(cells))
    np.testing.assert_array_equal(cells.of(cells.directions() @ turn.T), cells.turned(every))
    found = [cells.quarter]
    for _ in range(3):
        found.append(cells.turned(found[-1]))
    np.testing.assert_array_equal(np.sort(np.concatenate(found)), every)


def test_what_is_below_the_horizon_is_at_the_edge(cells):
    low = np.array([[0.6, 0.0, -0.8], [0.0, 0.0, -1.0]])
    row, column = np.divmod(cells.of(low), 8)
    assert column[0] == 7
    assert row[0] in (3, 4)
    assert ((row == 0) | (row == 7) | (column == 0) | (column == 7)).all()
