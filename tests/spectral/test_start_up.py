"""A fast start: nothing heavy is imported before it is needed."""

import importlib.util
import subprocess
import sys
from operator import attrgetter
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from metamer.runtime.disk_cache import cache_folder
from metamer.spectral import colour_library
from patience import patient

HEAVY = ("colour", "scipy", "matplotlib", "moderngl", "trimesh", "h5py", "tensorly", "OpenEXR", "PyOpenColorIO", "PIL")


def heavy_after(code):
    """Heavy packages that a fresh interpreter holds after running `code`."""
    report = f"import sys; print('HEAVY', *(name for name in {HEAVY!r} if name in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\n{report}"], capture_output=True, text=True, timeout=patient(120)
    )
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return done.stdout.splitlines()[-1].split()[1:]


def test_spectral_modules_import_nothing_heavy():
    package = Path(importlib.util.find_spec("metamer.spectral").origin).parent
    names = [".".join(path.relative_to(package).with_suffix("").parts) for path in package.rglob("*.py")]
    modules = [f"metamer.spectral.{name}" for name in names if not name.endswith("__init__")]
    assert len(modules) > 12
    assert heavy_after(f"import {', '.join(modules)}") == []


def test_help_imports_nothing_heavy():
    if importlib.util.find_spec("metamer.cli.main") is None:
        pytest.skip("no command yet")
    code = """
from metamer.cli.main import main
try:
    main(["--help"])
except SystemExit as ended:
    assert not ended.code, ended.code
"""
    assert heavy_after(code) == []


def test_the_door_to_colour_science_lets_nothing_out():
    """No warning, though importing it warns, and no change in how numpy prints numbers."""
    code = """
import warnings
warnings.simplefilter("error")
import numpy as np
before = np.get_printoptions()
from metamer.spectral.colour_library import colour_science
colour_science()
assert np.get_printoptions() == before, np.get_printoptions()
"""
    assert "colour" in heavy_after(code)


GROUPS = get_args(colour_library.Group)


def of_the_library(group):
    """Its tables by name; a chart is a mapping of patches, and a single table goes by the name of its group."""
    found, tables = {}, attrgetter(group)(colour_library.colour_science())
    if not hasattr(tables, "items"):
        return {group: tables}
    for name, table in tables.items():
        patches = {f"{patch} of {name}": table[patch] for patch in table} if group == "SDS_COLOURCHECKERS" else {}
        found |= patches or {name: table}
    return found


def the_same(found, expected):
    """Tables by name, in one order, bit for bit."""
    assert [*found] == [*expected]
    for name, (nm, values) in found.items():
        np.testing.assert_array_equal(nm, expected[name].wavelengths)
        np.testing.assert_array_equal(values, expected[name].values)
    return True


@pytest.fixture
def tables(tmp_path, monkeypatch):
    """Reads tables, with an empty cache of their own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return colour_library.colour_tables.__wrapped__


@pytest.mark.parametrize("group", GROUPS)
def test_tables_are_imported_once_and_kept_bit_for_bit(tables, monkeypatch, group):
    theirs = of_the_library(group)
    assert the_same(tables(group), theirs)
    monkeypatch.setattr(colour_library, "colour_science", None)
    assert the_same(tables(group), theirs)
    # Tables of another version are not read.
    monkeypatch.setattr(colour_library, "version", lambda name: "another")
    with pytest.raises(TypeError):
        tables(group)


@pytest.mark.parametrize(
    "damaged",
    [
        lambda whole: b"",
        lambda whole: b"no archive",
        lambda whole: whole[: len(whole) // 2],
        lambda whole: whole[: len(whole) // 2] + bytes([whole[len(whole) // 2] ^ 1]) + whole[len(whole) // 2 + 1 :],
    ],
    ids=["empty", "other", "cut short", "one bit"],
)
@pytest.mark.parametrize("group", GROUPS)
def test_tables_that_are_damaged_are_made_again(tables, group, damaged):
    theirs = of_the_library(group)
    tables(group)
    (kept,) = cache_folder("colour").iterdir()
    whole = kept.read_bytes()
    kept.write_bytes(damaged(whole))
    assert the_same(tables(group), theirs)
    assert kept.read_bytes() == whole


def test_tables_are_read_where_nothing_can_be_kept(tables, tmp_path):
    (tmp_path / "metamer").write_text("no folder")
    assert the_same(tables("MSDS_CMFS"), colour_library.colour_science().MSDS_CMFS)


def test_lights_observers_and_made_up_spectra_need_no_import_once_they_are_kept():
    for group in GROUPS:
        colour_library.colour_tables.__wrapped__(group)
    code = "from metamer import illuminant, observer; observer('1964_10').white(illuminant('FL11'))"
    made_up = "from metamer.spectral.upsampling import upsampling; upsampling('mallett-yuksel')"
    assert heavy_after(f"{code}; {made_up}") == []


def test_a_table_of_reflectances_needs_no_import_once_they_are_kept(tmp_path):
    for group in GROUPS:
        colour_library.colour_tables.__wrapped__(group)
    rows = "".join(f"{nm},{nm / 10}\n" for nm in range(400, 701, 20))
    (tmp_path / "red.csv").write_text("nm,red\n" + rows)
    code = f"import metamer; metamer.read_spectra({str(tmp_path / 'red.csv')!r}, as_='reflectance', scale='percent')"
    assert heavy_after(code) == []
