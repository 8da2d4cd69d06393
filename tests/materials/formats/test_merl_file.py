"""The layout of MERL files: what is read, and how everything else is refused."""

import os

import numpy as np
import pytest
from metamer.materials.formats.merl import SCALES, read_merl, recognises
from metamer.materials.measured.merl import SHAPE
from metamer.runtime.errors import InputError

HEADER = np.array(SHAPE, "<i4").tobytes()
BODY = 3 * 90 * 90 * 180 * 8


@pytest.fixture(scope="module")
def planes():
    """Stored values of a whole file: every one different."""
    return (1.0 + np.arange(3 * 90 * 90 * 180, dtype=float)).reshape(3, *SHAPE)


def write(path, planes, header=HEADER):
    path.write_bytes(header + planes.astype("<f8").tobytes())
    return path


def test_scales_and_the_order_of_the_axes(tmp_path, planes):
    path = write(tmp_path / "paint.binary", planes)
    told = read_merl(path)
    assert told.name == "paint"
    assert told.values.shape == (90, 90, 180, 3)
    # Red, green and blue are stored in different units.
    np.testing.assert_allclose(told.values[7, 11, 13], planes[:, 7, 11, 13] * np.array([1.0, 1.15, 1.66]) / 1500)
    assert recognises(path.with_suffix(".bin"), path.read_bytes()[:4096])


def test_what_is_not_a_reading_stays_as_it_is(tmp_path, planes):
    gaps = planes.copy()
    gaps[1, 2, 3, 4], gaps[2, 2, 3, 4] = 0.0, -1.0
    values = read_merl(write(tmp_path / "a.binary", gaps)).values
    assert values[2, 3, 4, 1] == 0
    assert values[2, 3, 4, 2] == -SCALES[2]
    assert values[2, 3, 4, 0] > 0


@pytest.mark.parametrize(
    ("head", "zeros", "problem", "found"),
    [
        (b"", 0, "not a MERL file", "0 bytes"),
        (HEADER[:7], 0, "not a MERL file", "7 bytes"),
        (b"\x89PNG\r\n\x1a\n", 60, "not a MERL file", "PNG"),
        (b"theta_i phi_i theta_o phi_o\n", 0, "not a MERL file", "theta_i"),
        (np.array([90, 90, 360], "<i4").tobytes(), 64, "other dimensions", "(90, 90, 360)"),
        (np.array([90, 90, 180], ">i4").tobytes(), 64, "not a MERL file", "Z"),
        (HEADER, 0, "ends early", "12 bytes"),
        (HEADER, BODY - 1, "ends early", f"{BODY + 11} bytes"),
        (HEADER, BODY + 8, "goes on", f"{BODY + 20} bytes"),
        (HEADER, BODY, "nothing was measured", "0 and less"),
    ],
)
def test_refused_with_what_was_found(tmp_path, head, zeros, problem, found):
    path = tmp_path / "bad.binary"
    path.write_bytes(head)
    os.truncate(path, len(head) + zeros)
    with pytest.raises(InputError) as refusal:
        read_merl(path)
    assert problem in str(refusal.value)
    assert found in str(refusal.value)
    assert "bad.binary" in str(refusal.value)


def test_a_file_of_nothing_but_dropouts(tmp_path, planes):
    with pytest.raises(InputError, match="nothing was measured"):
        read_merl(write(tmp_path / "a.binary", np.full_like(planes, -1.0)))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_not_a_number_is_named_by_its_place(tmp_path, planes, bad):
    broken = planes.copy()
    broken[1, 2, 3, 4] = bad
    with pytest.raises(InputError, match=r"green\[2, 3, 4\]"):
        read_merl(write(tmp_path / "a.binary", broken))


def test_missing_and_not_a_file(tmp_path):
    for path in (tmp_path / "absent.binary", tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            read_merl(path)
