"""Files and folders as sides: what is read of them, and how damage is refused."""

import json

import numpy as np
import pytest
from metamer.calibration.regression.comparison import compare
from metamer.calibration.regression.criteria import default_criteria
from metamer.calibration.regression.picture_files import Seen
from metamer.calibration.regression.row import HALF_STEP
from metamer.calibration.regression.sources import side_of
from metamer.spectral.errors import ComparisonError, InputError
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.spectral_exr import RELATIVE_UNITS, write_spectral_exr
from metamer.spectral.formats.xyz_exr import write_xyz_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.image import ColourImage
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from PIL import Image

WHITE = observer("1931_2").white(illuminant("D65"))
SAID = {"scene": "S", "camera": "front", "material": "paint/red", "illuminant": "D65", "observer": "CIE 1931"}
SEEN = Seen(("D65", "A"))


def write_picture(path, factor=1.0, white=WHITE, **said):
    values = np.random.default_rng(1).uniform(0.1, 0.6, (12, 16, 3)) * factor
    write_xyz_exr(path, ColourImage(values, "xyz", white), np.ones((12, 16)), {**SAID, **said})
    return path


def compared(a, b, display=None):
    return compare(side_of(a, SEEN, display), side_of(b, SEEN, display), default_criteria())


def write_reflectances(path, factor=1.0):
    grey = np.full((3, 4, WORKING_WAVELENGTHS_NM.size), 0.5) * factor
    write_spectral_exr(path, Spectrum.sampled(WORKING_WAVELENGTHS_NM, grey, "reflectance"))
    return path


def write_readings(path, red=0.5):
    bands = (f"{nm},{red if nm > 600 else 0.1},0.4" for nm in range(380, 790, 10))
    lines = ["wavelength,red reflectance,grey reflectance", *bands]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_picture_is_named_by_its_header(tmp_path):
    found = side_of(write_picture(tmp_path / "a.exr"), SEEN)
    assert found.kind == "picture" and found.rows[0].name == ("paint/red", "D65", "CIE 1931", "S", "front")


def test_a_folder_is_named_by_where_its_pictures_are(tmp_path):
    for name in ("before", "after"):
        (tmp_path / name / "inner").mkdir(parents=True)
        write_picture(tmp_path / name / "inner" / "one.exr")
        write_readings(tmp_path / name / "two.csv")
    found = compared(tmp_path / "before", tmp_path / "after")
    assert found.identical
    assert [row.name.material for row in found.rows[:2]] == ["inner/one.exr", "two.csv: red reflectance"]


def test_two_pictures_of_other_names_are_a_pair_and_it_is_said(tmp_path):
    other = write_picture(tmp_path / "b.exr", 1.01, material="paint/blue")
    found = compared(write_picture(tmp_path / "a.exr"), other)
    assert found.rows[0].state == "changed" and "another material: paint/red and paint/blue" in found.notes[0]


def test_half_precision_has_a_coarser_floor(tmp_path):
    values = np.random.default_rng(1).uniform(0.1, 0.6, (12, 16)).astype(np.float16)
    import OpenEXR

    header = {"type": OpenEXR.scanlineimage, "whiteXYZ": WHITE.astype(np.float32)}
    OpenEXR.File(header, dict.fromkeys("XYZ", values)).write(str(tmp_path / "half.exr"))
    layer = side_of(tmp_path / "half.exr", SEEN).rows[0].layers["picture"]
    assert layer.load().relative_step == HALF_STEP


def test_reflectances_are_seen_under_each_light(tmp_path):
    found = compared(write_reflectances(tmp_path / "a.exr"), write_reflectances(tmp_path / "b.exr", 1.02))
    assert [row.name.light for row in found.rows] == ["D65", "A"]
    # Grey stays grey: L* of 0.51 less that of 0.5.
    expected = 116 * (0.51 ** (1 / 3) - 0.5 ** (1 / 3))
    assert all(row.layers["picture"].mean == pytest.approx(expected, abs=1e-4) for row in found.rows)


def test_radiances_are_relative_to_the_light_that_the_header_names(tmp_path):
    light = illuminant("A").resampled(WORKING_WAVELENGTHS_NM)
    equal = observer("1931_2").weights(illuminant("E"), WORKING_WAVELENGTHS_NM)
    white = np.broadcast_to(light.samples / (equal @ light.samples)[1], (2, 2, WORKING_WAVELENGTHS_NM.size))
    image = Spectrum.sampled(WORKING_WAVELENGTHS_NM, white, "emission")
    write_spectral_exr(tmp_path / "a.exr", image, RELATIVE_UNITS, {**SAID, "illuminant": "A"})
    held = side_of(tmp_path / "a.exr", SEEN).rows[0].layers["picture"].load()
    assert held.xyz[0, 0] == pytest.approx(held.white_xyz, abs=2e-3)
    write_spectral_exr(tmp_path / "b.exr", image, "W.m^-2.sr^-1.nm^-1", SAID)
    with pytest.raises(InputError, match="radiances without a white"):
        side_of(tmp_path / "b.exr", SEEN).rows[0].layers["picture"].load()


def test_readings_are_matched_by_name(tmp_path):
    found = compared(write_readings(tmp_path / "a.csv"), write_readings(tmp_path / "b.csv", 0.52))
    states = {(row.name.material, row.name.light): row.state for row in found.rows}
    assert states["red reflectance", "D65"] == states["red reflectance", "A"] == "changed"
    assert states["grey reflectance", "D65"] == states["grey reflectance", "A"] == "identical"


def test_colours_without_spectra_count_for_what_they_state(tmp_path):
    for name, lightness in (("a", 50.0), ("b", 51.0)):
        lines = ["Illuminant D65, 10 degree observer", "name,L*,a*,b*", f"red,{lightness},20,10", "grey,40,0,0"]
        (tmp_path / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = compared(tmp_path / "a.csv", tmp_path / "b.csv")
    rows = {row.name.material: row for row in found.rows}
    assert rows["red"].layers["reading"].mean == pytest.approx(1.0, abs=1e-9) and rows["grey"].state == "identical"
    assert rows["red"].name.observer == "CIE 1964 10 Degree Standard Observer"


def test_a_png_needs_a_display(tmp_path):
    codes = np.random.default_rng(2).integers(30, 220, (40, 40, 3), dtype=np.uint8)
    for name, shift in (("a", 0), ("b", 1), ("c", 12)):
        Image.fromarray(codes + np.uint8(shift)).save(tmp_path / f"{name}.png")
    with pytest.raises(InputError, match="--display sRGB"):
        compared(tmp_path / "a.png", tmp_path / "b.png")
    near = compared(tmp_path / "a.png", tmp_path / "b.png", "sRGB").rows[0]
    far = compared(tmp_path / "a.png", tmp_path / "c.png", "sRGB").rows[0]
    assert near.layers["picture"].floor_mean > 0.1
    assert far.state == "changed" and far.layers["picture"].mean > 5 * near.layers["picture"].mean


def test_other_whites_are_refused_whatever_the_names(tmp_path):
    other = write_picture(tmp_path / "b.exr", white=observer("1964_10").white(illuminant("D65")))
    with pytest.raises(ComparisonError, match="different whites"):
        compared(write_picture(tmp_path / "a.exr"), other)


@pytest.mark.parametrize("left", [0, 40, 400, -30])
def test_a_truncated_picture_is_refused(tmp_path, left):
    path = write_picture(tmp_path / "a.exr")
    path.write_bytes(path.read_bytes()[:left])
    with pytest.raises(InputError, match=r"a\.exr"):
        compared(path, write_picture(tmp_path / "b.exr"))


def test_what_has_no_white_or_other_channels_is_refused(tmp_path):
    plane = np.ones((4, 4))
    write_exr(tmp_path / "a.exr", {}, dict.fromkeys("XYZ", plane))
    write_exr(tmp_path / "b.exr", {}, dict.fromkeys("RGB", plane))
    for name, words in (("a", "does not say its white"), ("b", "not a picture in XYZ")):
        with pytest.raises(InputError, match=words):
            side_of(tmp_path / f"{name}.exr", SEEN).rows[0].layers["picture"].load()


@pytest.mark.parametrize("text", ["{", "[]", '{"schema": "metamer.review/9"}', '{"schema": "metamer.review/1"}'])
def test_damaged_figures_are_refused(tmp_path, text):
    (tmp_path / "review.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"review\.json"):
        side_of(tmp_path, SEEN)


def test_figures_lead_to_no_file_outside(tmp_path):
    (tmp_path / "review").mkdir()
    write_picture(tmp_path / "secret.exr")
    row = {"material": "m", "illuminant": "D65", "observer": "o", "notes": [], "files": {"XYZ EXR": "../secret.exr"}}
    document = {"schema": "metamer.review/1", "metamer": "", "renderer": "", "status": "pass", "colour_chain": []}
    document |= {"plan": {"basis_size": 3, "reasons": []}, "budget_delta_e94": 1.0, "results": [row]}
    (tmp_path / "review" / "review.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(InputError, match="outside of the review"):
        side_of(tmp_path / "review", SEEN)


def test_nothing_there_and_nothing_comparable_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such file or folder"):
        side_of(tmp_path / "none", SEEN)
    (tmp_path / "notes.xyz").write_bytes(b"\x00\x01")
    with pytest.raises(InputError, match="nothing in this folder"):
        side_of(tmp_path, SEEN)


def test_the_same_file_in_two_folders_is_refused(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    path = write_picture(tmp_path / "a" / "one.exr")
    (tmp_path / "b" / "one.exr").symlink_to(path)
    with pytest.raises(ComparisonError, match="on both sides"):
        compared(tmp_path / "a", tmp_path / "b")
