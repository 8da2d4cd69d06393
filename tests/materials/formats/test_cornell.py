"""Reading scattered BRDF files: the layout, and what is said of files that cannot be used."""

import numpy as np
import pytest
from metamer.materials.core.directions import io_angles
from metamer.materials.formats import cornell
from metamer.materials.formats.cornell import read_cornell
from metamer.runtime.errors import InputError

HEADER = "# A laboratory\n# Test Green, lot #7\n# satin\n# num wls\n{count}\n# wls\n{wavelengths}\n# theta i, phi i\n"
WAVELENGTHS = "400 500 600 700"
ROWS = [
    "0.5 0.0 0.3 -0.2  0.01 0.02 0.03 0.04",
    "0.5 0.0 0.9 3.141593  0.02 0.03 0.04 0.05",
    "1.0 0.0 0.9 1.0  0.00 0.03 0.04 0.05  # a clamped reading",
]


@pytest.fixture
def written(tmp_path):
    def write(rows=ROWS, wavelengths=WAVELENGTHS, count=4):
        path = tmp_path / "green.brdf"
        path.write_text(HEADER.format(count=count, wavelengths=wavelengths) + "\n".join(rows) + "\n", encoding="utf-8")
        return path

    return write


def refused(path, *expected):
    with pytest.raises(InputError) as caught:
        read_cornell(path)
    message = str(caught.value)
    assert str(path) in message
    for words in expected:
        assert words in message, message


def test_layout(written):
    found = read_cornell(written())
    assert found.wavelengths_nm.tolist() == [400, 500, 600, 700]
    assert (
        pytest.approx(np.array([[0.5, 0.3, 0.2], [0.5, 0.9, np.pi], [1.0, 0.9, 1.0]]), abs=1e-6)
        == np.array(io_angles(found.wi, found.wo)).T
    )
    assert found.values[1].tolist() == [0.02, 0.03, 0.04, 0.05]
    assert found.name == "Test Green, lot #7"
    assert found.description == "A laboratory; Test Green, lot #7; satin"


def test_lines_may_break_anywhere(written):
    whole = read_cornell(written())
    words = " ".join(row.partition("#")[0] for row in ROWS).split()
    broken = read_cornell(written(rows=[" ".join(words[i : i + 5]) for i in range(0, len(words), 5)]))
    assert np.array_equal(whole.values, broken.values) and np.array_equal(whole.wo, broken.wo)


@pytest.mark.parametrize("separator", [", ", ",", " , "])
def test_commas_part_numbers_too(written, separator):
    plain = read_cornell(written())
    rows = [separator.join(row.partition("#")[0].split()) for row in ROWS]
    path = written(rows=rows, wavelengths=separator.join(WAVELENGTHS.split()))
    assert cornell.recognises(path.with_suffix(".txt"), path.read_bytes())
    found = read_cornell(path)
    assert np.array_equal(found.values, plain.values) and np.array_equal(found.wo, plain.wo)


def test_a_decimal_comma_is_refused(written):
    refused(written(rows=[row.replace(".", ",") for row in ROWS]), "not a number", "line 9", "'0,5'")


def test_exponents_of_fortran(written):
    plain = read_cornell(written())
    found = read_cornell(written(rows=[ROWS[0].replace("0.01", "1.0D-02").replace("0.5", ".5d0"), *ROWS[1:]]))
    assert np.array_equal(found.values, plain.values) and np.array_equal(found.wi, plain.wi)


def test_wavelengths_that_descend_are_turned_round_with_their_values(written):
    plain = read_cornell(written())
    turned = [" ".join([*row.split()[:4], *row.partition("#")[0].split()[:3:-1]]) for row in ROWS]
    path = written(rows=turned, wavelengths="700 600 500 400")
    assert cornell.recognises(path.with_suffix(".txt"), path.read_bytes())
    found = read_cornell(path)
    assert found.wavelengths_nm.tolist() == [400, 500, 600, 700]
    assert np.array_equal(found.values, plain.values) and np.array_equal(found.missing, plain.missing)
    assert any("turned round" in note for note in found.notes)
    assert not any("turned round" in note for note in plain.notes)


def test_carriage_returns_and_a_byte_order_mark(written):
    path = written()
    expected = read_cornell(path).values
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert np.array_equal(read_cornell(path).values, expected)


def test_no_comments_at_all(tmp_path):
    path = tmp_path / "bare.brdf"
    path.write_text(f"4 {WAVELENGTHS} {' '.join(row.partition('#')[0] for row in ROWS)}")
    assert read_cornell(path).name == "bare" and len(read_cornell(path)) == 3


def test_clamped_zeros_are_missing_and_said_to_be(written):
    found = read_cornell(written())
    assert np.argwhere(found.missing).tolist() == [[2, 0]]
    assert "1 of 12 values are 0" in found.notes[0]


def test_missing_file(tmp_path):
    refused(tmp_path / "none.brdf", "cannot be read", "No such file")


def test_folder(tmp_path):
    refused(tmp_path, "cannot be read")


def test_empty_file(tmp_path):
    (tmp_path / "empty.brdf").write_text("")
    refused(tmp_path / "empty.brdf", "holds no numbers", "an empty file")


def test_comments_only(tmp_path):
    (tmp_path / "comments.brdf").write_text("# nothing\n")
    refused(tmp_path / "comments.brdf", "comments only")


def test_binary_file(tmp_path):
    (tmp_path / "picture.brdf").write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0")
    refused(tmp_path / "picture.brdf", "not a text file")


def test_web_page(tmp_path):
    (tmp_path / "page.brdf").write_text("<!DOCTYPE html>\n<html><body>404</body></html>")
    refused(tmp_path / "page.brdf", "not a file of scattered BRDF measurements", "line 1", "<!DOCTYPE")


def test_table_of_numbers_without_a_count(tmp_path):
    (tmp_path / "table.brdf").write_text("0.5 0.0 0.3\n")
    refused(tmp_path / "table.brdf", "does not begin with a number of wavelengths", "0.5")


def test_single_wavelength(written):
    refused(written(count=1), "one wavelength is no spectrum")


def test_word_among_the_numbers(written):
    refused(written(rows=[ROWS[0], ROWS[1].replace("0.04", "n/a")]), "not a number", "line 10", "n/a")


def test_truncated_last_row(written):
    refused(written(rows=[*ROWS[:2], ROWS[2][:20]]), "a row is not complete", "line 11", "truncated")


def test_truncated_file_with_free_line_breaks(written):
    words = " ".join(row.partition("#")[0] for row in ROWS).split()
    refused(written(rows=[" ".join(words[i : i + 5]) for i in range(0, 20, 5)]), "last row is not complete", "2 rows")


def test_no_rows(written):
    refused(written(rows=[]), "holds no direction pairs")


def test_fewer_wavelengths_than_counted(tmp_path):
    (tmp_path / "short.brdf").write_text("31\n400 410 420\n")
    refused(tmp_path / "short.brdf", "ends early", "3 of 31")


@pytest.mark.parametrize("word", ["nan", "inf"])
def test_not_finite(written, word):
    refused(written(rows=[ROWS[0].replace("0.03", word), ROWS[1]]), "not a finite number", "line 9")


def test_negative_value(written):
    refused(written(rows=[ROWS[0], ROWS[1].replace("0.03", "-0.03")]), "negative f_r", "line 10", "-0.03 at 500 nm")


def test_nothing_measured(written):
    refused(written(rows=["0.5 0.0 0.3 -0.2  0 0 0 0"]), "nothing was measured")


def test_micrometres(written):
    refused(written(wavelengths="0.4 0.5 0.6 0.7"), "micrometres", "multiply them by 1000")


def test_descending_wavelengths(written):
    refused(written(wavelengths="700 500 600 400"), "do not ascend")


def test_duplicated_wavelengths(written):
    refused(written(wavelengths="400 500 500 700"), "stands twice", "500")


def test_polar_angle_below_the_horizon(written):
    refused(written(rows=[ROWS[0], ROWS[1].replace("0.9", "1.7")]), "polar angle", "line 10", "1.7")


def test_angles_in_degrees(written):
    refused(written(rows=["30 0 20 180 0.01 0.02 0.03 0.04"]), "radians", "degrees")


def test_azimuth_alone_in_degrees(written):
    refused(written(rows=["0.5 0 0.3 90 0.01 0.02 0.03 0.04"]), "radians", "degrees")


@pytest.mark.parametrize("name", ["garnet_red", "krylon_blue", "mystique"])
def test_measured_files(shared_data, name):
    found = read_cornell(shared_data / "brdf" / "cornell-spectral" / f"{name}.brdf")
    assert found.values.shape == (1439, 31) and found.wavelengths_nm[[0, -1]].tolist() == [400, 700]
    assert np.array_equal(found.missing, found.values == 0) and found.missing.any()
    assert np.degrees(io_angles(found.wi, found.wo)[0]).max() == pytest.approx(80, abs=1e-3)
