"""Names of a BTF's images, and which of them are one set."""

import numpy as np
import pytest
from btf_sets import written
from metamer.materials.formats.btf_names import directions_of, image_name, is_first, members, set_folder

UBO_NAME = "{n:05d} tl{tl:03d} pl{pl:03d} tv{tv:03d} pv{pv:03d}.png"
FEW = [(0, 0), (45, 90)]


@pytest.mark.parametrize(
    ("name", "light", "view"),
    [
        ("00001 tl000 pl000 tv000 pv000.jpg", (0, 0), (0, 0)),
        ("06561 tl075 pl345 tv060 pv018.JPG", (75, 345), (60, 18)),
        ("17_tl015_pl060_tv030_pv330.png", (15, 60), (30, 330)),
        ("tl000_pl000_tv075_pv015.exr", (0, 0), (75, 15)),
        ("tv075_pv015_tl030_pl000.exr", (30, 0), (75, 15)),
        ("fabric01_TL15_PL30_TV0_PV0.png", (15, 30), (0, 0)),
        ("tl012.5_pl007.5_tv0_pv0.png", (12.5, 7.5), (0, 0)),
        ("tl=15 pl=30 tv=0 pv=0.png", (15, 30), (0, 0)),
        ("tv030_pv060/00012 tl015 pl120.jpg", (15, 120), (30, 60)),
        ("tl015_pl120/tv030_pv060.jpg", (15, 120), (30, 60)),
    ],
)
def test_directions_stand_in_names_whatever_runs_with_them(tmp_path, name, light, view):
    found = image_name(tmp_path / "wool" / name)
    assert (found.light, found.view, found.wavelength_nm) == (light, view, None)


@pytest.mark.parametrize(
    "name", ["wool_albedo.png", "tl000 pl000 tv000.jpg", "tl000 pl000 tv000 pv000.txt", "tv000_pv000/thumb.jpg"]
)
def test_other_names_are_none(tmp_path, name):
    assert image_name(tmp_path / name) is None


@pytest.mark.parametrize(
    "name", ["tl0_pl0_tv0_pv0_550nm.png", "tl0_pl0_tv0_pv0 550 nm.png", "550nm/tl0_pl0_tv0_pv0.png"]
)
def test_a_wavelength_stands_in_the_name_or_in_the_folder(tmp_path, name):
    assert image_name(tmp_path / name).wavelength_nm == 550.0
    assert set_folder(tmp_path / "wool" / name).name == "wool"


@pytest.mark.parametrize(
    "name",
    [
        UBO_NAME,
        "tv{tv:03d}_pv{pv:03d}/" + UBO_NAME,
        "tv{tv:03d}_pv{pv:03d}/{n:05d} tl{tl:03d} pl{pl:03d}.png",
        "view{v}/" + UBO_NAME,
        "{v}/" + UBO_NAME,
        "tv{tv:03d}/pv{pv:03d}/tl{tl:03d} pl{pl:03d}.png",
    ],
)
def test_a_set_may_lie_in_folders_of_its_views(tmp_path, name):
    written(tmp_path / "wool", FEW, FEW, name=name)
    written(tmp_path / "linen", FEW, FEW, name=name)
    files = sorted(path for path in (tmp_path / "wool").rglob("*.png"))
    assert len(files) == 4
    for path in files:
        assert set_folder(path) == tmp_path / "wool" and members(path) == files
        assert is_first(path) == (path == files[0])


def test_samples_that_are_numbered_are_sets_of_their_own(tmp_path):
    for name in ("fabric01", "fabric02"):
        written(tmp_path / name, FEW, FEW)
    assert set_folder(next((tmp_path / "fabric02").iterdir())) == tmp_path / "fabric02"


def test_two_samples_in_one_folder_are_two_sets(tmp_path):
    for name in ("wool", "silk2"):
        written(tmp_path, FEW, FEW, name=name + "_tl{tl:03d}_pl{pl:03d}_tv{tv:03d}_pv{pv:03d}.png")
    firsts = [path.name for path in sorted(tmp_path.iterdir()) if is_first(path)]
    assert firsts == ["silk2_tl000_pl000_tv000_pv000.png", "wool_tl000_pl000_tv000_pv000.png"]
    assert len(members(tmp_path / firsts[0])) == 4


def test_a_set_that_changes_is_looked_at_again(tmp_path):
    written(tmp_path / "wool", FEW, FEW, name="view{v}/" + UBO_NAME)
    first, *_, last = sorted((tmp_path / "wool").rglob("*.png"))
    assert len(members(first)) == 4
    last.unlink()
    assert len(members(first)) == 3


def test_a_folder_that_may_not_be_looked_into_is_passed_over(tmp_path, monkeypatch):
    import os

    written(tmp_path / "wool", FEW, FEW)
    (tmp_path / "wool" / "locked").mkdir()
    scandir = os.scandir

    def refuses(path="."):
        if str(path).endswith("locked"):
            raise PermissionError("locked")
        return scandir(path)

    monkeypatch.setattr(os, "scandir", refuses)
    assert len(members(next((tmp_path / "wool").glob("*.png")))) == 4


def test_phi_goes_from_u_to_v():
    np.testing.assert_allclose(
        directions_of([(0, 77), (90, 0), (90, 90), (30, 180)]),
        [[0, 0, 1], [1, 0, 0], [0, 1, 0], [-0.5, 0, np.sqrt(0.75)]],
        atol=1e-12,
    )
