"""`metamer display measure` with a program in place of ArgyllCMS's, and the patches that it and `show` are given."""

import json
import os
import signal
import stat
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from metamer.calibration.display.patch_files import read_patches, write_patches
from metamer.calibration.display.reading_files import read_readings
from metamer.runtime.errors import InputError
from patience import patient

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the program in place of dispread is a script")

# Shows nothing and measures a display of gamma 2.2 with 200 cd/m2; a word in `asked` says what goes wrong.
_DISPREAD = '''#!{python}
import json, os, sys, time
from pathlib import Path
import re
asked = Path({asked!r}).read_text()
Path({heard!r}).write_text(json.dumps([os.getpid(), sys.argv[1:]]))
print("Hit any key to continue,", flush=True)
if asked == "fails":
    sys.exit("dispread: Error - No instrument at port 1")
if asked == "waits":
    time.sleep(600)
text = Path(sys.argv[-1] + ".ti1").read_text()
rows = [row.split() for row in re.search("BEGIN_DATA\\n(.*?)END_DATA", text, re.S)[1].splitlines()]
lines = []
for at, row in enumerate(rows[: 5 if asked == "stops" else None]):
    red, green, blue = (200.0 * (float(cell) / 100.0) ** 2.2 + 0.01 for cell in row[1:4])
    weights = (0.41, 0.36, 0.18), (0.21, 0.72, 0.07), (0.02, 0.12, 0.95)
    xyz = [r * red + g * green + b * blue for r, g, b in weights]
    lines.append(" ".join([*row[:4], *map(str, xyz)]))
    print("\\rpatch", at + 1, "of", len(rows), end="", flush=True)
head = 'CTI3\\n\\nDESCRIPTOR "Argyll Calibration Target chart information 3"\\nDEVICE_CLASS "DISPLAY"\\n'
head += 'NORMALIZED_TO_Y_100 "NO"\\nTARGET_INSTRUMENT "Made up"\\n'
head += "BEGIN_DATA_FORMAT\\nSAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z\\nEND_DATA_FORMAT\\n"
Path(sys.argv[-1] + ".ti3").write_text(head + "BEGIN_DATA\\n" + "\\n".join(lines) + "\\nEND_DATA\\n")
'''  # fmt: skip


@pytest.fixture
def dispread(tmp_path, monkeypatch):
    """Puts the program among the others: (what goes wrong) -> the file in which it says who it is and what it heard."""
    asked, heard, folder = tmp_path / "asked", tmp_path / "heard.json", tmp_path / "bin"
    folder.mkdir()
    program = folder / "dispread"
    program.write_text(_DISPREAD.format(python=sys.executable, asked=str(asked), heard=str(heard)), encoding="utf-8")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", os.pathsep.join([str(folder), os.environ["PATH"]]))

    def put(wrong=""):
        asked.write_text(wrong)
        return heard

    return put


@pytest.fixture
def patches(metamer, tmp_path):
    path = tmp_path / "patches.ti1"
    assert metamer("display", "patches", "-n", 9, "-o", path)[0] == 0
    return path


def _is_gone(heard):
    """Return whether the program has ended; one that has, and is not waited for by anybody yet, still has a number."""
    number = json.loads(heard.read_text())[0]
    state = Path(f"/proc/{number}/stat")
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return True
    return state.is_file() and state.read_text().rpartition(")")[2].split()[0] == "Z"


def test_patches_are_measured_and_a_display_is_made_of_them(metamer, dispread, patches, tmp_path):
    heard, readings, correction = dispread(), tmp_path / "readings.ti3", tmp_path / "panel.ccss"
    correction.write_text("CCSS\n")
    options = ["--screen", 2, "--instrument", 3, "--correction", correction, "--spectra", "--arguments", "-yl -F"]
    code, said, err = metamer("display", "measure", patches, "-o", readings, *options)
    assert code == 0 and "10 readings, Made up" in said and "metamer display characterise" in said
    assert "Hit any key to continue," in err and "patch 10 of 10" in err
    words = json.loads(heard.read_text())[1]
    assert words == ["-v", "-w", "-d", "2", "-c", "3", "-X", str(correction), "-s", "-yl", "-F", "patches"]
    found = read_readings(readings)
    np.testing.assert_allclose(found.codes, read_patches(patches), atol=1e-6)
    assert found.absolute and found.xyz[0, 1] == pytest.approx(200.01)
    code, said, err = metamer("display", "characterise", readings, "-o", tmp_path / "desk.json")
    assert code in (0, 1) and "gog" in said


@pytest.mark.parametrize(
    ("wrong", "says"),
    [("fails", ("ended with 1", "No instrument at port 1")), ("waits", ("said nothing for 1 s", "Hit any key"))],
)
def test_a_program_that_fails_or_waits_for_ever_leaves_no_file(metamer, dispread, patches, tmp_path, wrong, says):
    heard, readings = dispread(wrong), tmp_path / "readings.ti3"
    readings.write_text("before")
    code, _, err = metamer("display", "measure", patches, "-o", readings, "--patience", 1)
    assert code == 4 and all(words in err for words in says) and "--instrument" in err
    assert readings.read_text() == "before" and _is_gone(heard)
    assert not list(tmp_path.glob(".readings*"))


def test_fewer_readings_than_patches_are_said_and_kept(metamer, dispread, patches, tmp_path):
    dispread("stops")
    readings = tmp_path / "readings.ti3"
    code, _, err = metamer("display", "measure", patches, "-o", readings)
    assert code == 4 and "5 of 10" in err and "BEGIN_DATA" in readings.read_text()


def test_ctrl_c_ends_the_program_too(started, dispread, patches, tmp_path):
    heard, readings = dispread("waits"), tmp_path / "readings.ti3"
    process = started("display", "measure", patches, "-o", readings)
    end = time.monotonic() + patient(60)
    while not heard.is_file() or not heard.read_text():
        assert time.monotonic() < end and process.poll() is None, "waited for the program to begin"
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=patient(30))
    assert process.returncode == 130 and "interrupted" in err and not readings.exists()
    while not _is_gone(heard):
        assert time.monotonic() < end, "waited for the program to end"
        time.sleep(0.05)


def test_without_argyll_it_says_so(metamer, patches, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    code, _, err = metamer("display", "measure", patches, "-o", tmp_path / "readings.ti3")
    assert code == 4 and "ArgyllCMS is not installed" in err and "metamer display show" in err


def test_wrong_files_are_refused(metamer, dispread, patches, tmp_path):
    heard = dispread()
    code, _, err = metamer("display", "measure", patches, "-o", tmp_path / "readings.csv")
    assert code == 64 and ".ti3" in err
    table = tmp_path / "patches.csv"
    assert metamer("display", "patches", "-n", 9, "-o", table)[0] == 0
    code, _, err = metamer("display", "measure", table, "-o", tmp_path / "readings.ti3")
    assert code == 4 and "patches.ti1" in err
    code, _, err = metamer(
        "display", "measure", patches, "-o", tmp_path / "r.ti3", "--correction", tmp_path / "no.ccss"
    )
    assert code == 4 and "no.ccss" in err and not heard.exists()


@pytest.mark.parametrize(("bits", "name"), [(8, "p.ti1"), (8, "p.csv"), (10, "p.csv"), (16, "p.ti1")])
def test_patches_are_read_as_they_were_written(tmp_path, bits, name):
    codes = np.random.default_rng(bits).integers(0, 2**bits, (20, 3)) / (2**bits - 1)
    write_patches(tmp_path / name, codes, bits)
    np.testing.assert_allclose(read_patches(tmp_path / name), codes, atol=6e-7)


_CSV = "# codes from 0 to 255\npatch,r,g,b\n"
_TI1 = "{}\nBEGIN_DATA_FORMAT\nRGB_R RGB_G RGB_B\nEND_DATA_FORMAT\nBEGIN_DATA\n1 2 {}\nEND_DATA\n"


@pytest.mark.parametrize(
    "text",
    ["", "r,g,b\n1,2,3\n", f"{_CSV}1,0,0,256\n", _CSV, f"{_CSV}1,0,0\n", f"{_CSV}1,0,0,0\n2,0,0\n",
     f"{_CSV}1,0,0,nan\n", _TI1.format("CTI3", 3), _TI1.format("CTI1", 101)],
)  # fmt: skip
def test_what_is_no_set_of_patches_is_refused_by_name(tmp_path, text):
    path = tmp_path / "patches.csv"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read_patches(path)
    assert "patches.csv" in str(refused.value) and "expected" in str(refused.value)
