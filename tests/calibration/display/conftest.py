"""Readings of simulated displays, made once: to be read only."""

import numpy as np
import pytest
from metamer.benchmarks.display.simulated import displays
from metamer.calibration.display.choice import choose
from metamer.calibration.display.patches import patches


def eight_bits(codes):
    return np.round(codes * 255.0) / 255.0


@pytest.fixture(scope="session")
def simulated():
    return {display.name: display for display in displays()}


@pytest.fixture(scope="session")
def lcd(simulated):
    """An LCD's 61 patches with white between, as the instrument said."""
    return simulated["LCD"].measured(eight_bits(patches(61)), 0)


@pytest.fixture(scope="session")
def wrgb(simulated):
    """A display whose channels do not add up, 125 patches."""
    return simulated["WRGB OLED"].measured(eight_bits(patches(125)), 0)


@pytest.fixture(scope="session")
def lcd_choice(lcd):
    return choose(lcd)


@pytest.fixture(scope="session")
def wrgb_choice(wrgb):
    return choose(wrgb)


@pytest.fixture
def written(tmp_path):
    """Writes readings as CSV with codes to `scale`: (readings, scale, unit) -> path."""

    def write(readings, scale=255.0, unit=" cd/m2", name="readings.csv"):
        rows = [",".join(f"{value:.6g}" for value in (*codes * scale, *xyz))
                for codes, xyz in zip(readings.codes, readings.xyz, strict=True)]  # fmt: skip
        path = tmp_path / name
        path.write_text(f"r,g,b,X{unit},Y{unit},Z{unit}\n" + "\n".join(rows) + "\n", encoding="utf-8")
        return path

    return write
