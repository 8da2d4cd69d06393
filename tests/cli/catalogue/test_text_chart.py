"""The chart of a terminal loses no line and knows no number that breaks it."""

import numpy as np
import pytest
from metamer.cli.catalogue.text_chart import text_chart


def rows(text):
    return [line.partition("│")[2] for line in text.splitlines() if "│" in line]


def test_a_line_narrower_than_a_column_is_seen():
    nm = np.arange(380.0, 781.0, 1.0)
    values = np.where(nm == 546.0, 1.0, 0.01)
    top = rows(text_chart(nm, values, width=40))[0]
    assert top.strip() == "█" and top.index("█") == int((546 - 380) / 400 * 40)


@pytest.mark.parametrize("values", [(0.0, 0.0), (1e-30, 2e-30), (3e9, 1e9), (-1.0, 0.5), (0.9999999999, 1.0)])
def test_any_size_fits(values):
    text = text_chart(np.array([400.0, 700.0]), np.array(values), width=20, height=4)
    assert max(map(len, text.splitlines())) <= 9 + 20 + 3 and len(rows(text)) == 4
    assert ("█" in text) == (max(values) > 0)


def test_one_sample_has_an_axis():
    assert "550" in text_chart(np.array([550.0, 550.0 + 1e-6]), np.array([0.2, 0.2]), width=10)
