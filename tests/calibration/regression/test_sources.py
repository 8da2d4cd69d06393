"""Files and folders as sides: what is read of them, and how damage is refused."""

import io
import json
import struct
import zlib

import numpy as np
import pytest
from icc_profiles import DULL, matrix_profile
from metamer.calibration.regression.comparison import compare
from metamer.calibration.regression.criteria import default_criteria
from metamer.calibration.regression.picture_files import SeenSpectra
from metamer.calibration.regression.row import HALF_ROUNDOFF
from metamer.calibration.regression.sources import side_of
from metamer.runtime.errors import ComparisonError, InputError
from metamer.spectral.bispectral import Bispectral
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.spectral_exr import RELATIVE_UNITS, write_bispectral_exr, write_spectral_exr
from metamer.spectral.formats.xyz_exr import write_xyz_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.image import ColourImage
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from metamer.viewer.display.png import png_bytes
from PIL import Image

WHITE = observer("1931_2").white(illuminant("D65"))
SAID = {"scene": "S", "camera": "front", "material": "paint/red", "illuminant": "D65", "observer": "CIE 1931"}
SEEN = SeenSpectra(("D65", "A"))


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


def test_a_workbook_beside_without_a_table_of_wavelengths_is_passed_over(tmp_path):
    for name in ("before", "after"):
        (tmp_path / name).mkdir()
        write_readings(tmp_path / name / "two.csv")
        book = pytest.importorskip("openpyxl").Workbook()
        book.active.append(["illuminant", 1.5])
        book.save(tmp_path / name / "report.xlsx")
    rows = compared(tmp_path / "before", tmp_path / "after").rows
    assert rows and all(row.name.material.startswith("two.csv: ") for row in rows)


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
    assert layer.load().unit_roundoff == HALF_ROUNDOFF


def test_reflectances_are_seen_under_each_light(tmp_path):
    found = compared(write_reflectances(tmp_path / "a.exr"), write_reflectances(tmp_path / "b.exr", 1.02))
    assert [row.name.light for row in found.rows] == ["D65", "A"]
    # Grey stays grey: L* of 0.51 less that of 0.5.
    expected = 116 * (0.51 ** (1 / 3) - 0.5 ** (1 / 3))
    assert all(row.layers["picture"].mean == pytest.approx(expected, abs=1e-4) for row in found.rows)


DYE_NM = np.arange(350.0, 701.0, 50.0)


def dye(strength=0.4):
    """Takes in ultraviolet and blue, and sends out green and red."""
    matrix = np.diag(np.full(DYE_NM.size, 0.3))
    matrix[3:6, :2] = strength / 3.0
    return Bispectral(DYE_NM, DYE_NM, matrix)


def test_fluorescent_pictures_are_seen_with_what_they_send_out(tmp_path):
    """Each pixel as its matrix folds with the light; under A, which has little ultraviolet, another colour."""
    for name, strength in (("a", 0.4), ("b", 0.36)):
        write_bispectral_exr(tmp_path / f"{name}.exr", dye(strength), (2, 3))
    found = compared(tmp_path / "a.exr", tmp_path / "b.exr")
    assert [row.state for row in found.rows] == ["changed", "changed"]
    assert found.rows[0].layers["picture"].mean > found.rows[1].layers["picture"].mean > 0.1
    for row in side_of(tmp_path / "a.exr", SEEN).rows:
        layer = row.layers["picture"]
        held = layer.load()
        expected = dye().fold(illuminant(row.name.light), observer("1931_2"))
        assert held.xyz.shape == (2, 3, 3) and layer.spectrum is None
        np.testing.assert_allclose(held.xyz, np.broadcast_to(expected, (2, 3, 3)), rtol=1e-6)


@pytest.mark.parametrize(
    ("channel", "words"),
    [("T.350,000000nm.550,000000nm", "more power leaves"), ("T.650,000000nm.400,000000nm", "shorter wavelength")],
)
def test_fluorescence_that_cannot_be_is_refused_in_whichever_pixel(tmp_path, channel, words):
    grey = {f"T.{nm:.6f}nm".replace(".", ",").replace("T,", "T."): np.full((2, 3), 0.3) for nm in DYE_NM}
    bad = np.zeros((2, 3))
    bad[1, 2] = 2.0 if "more" in words else 0.01
    write_exr(tmp_path / "a.exr", {}, {**grey, channel: bad})
    with pytest.raises(InputError, match=rf"a\.exr[\s\S]*{words}|{words}[\s\S]*a\.exr"):
        side_of(tmp_path / "a.exr", SEEN).rows[0].layers["picture"].load()


def test_spectra_in_half_precision_have_a_coarser_floor(tmp_path):
    for name, kind in (("a", np.float32), ("b", np.float16)):
        planes = {f"T.{nm},0nm": np.full((2, 2), 0.3, kind) for nm in range(400, 701, 50)}
        write_exr(tmp_path / f"{name}.exr", {}, planes)
    fine, coarse = (side_of(tmp_path / f"{name}.exr", SEEN).rows[0].layers["picture"].load() for name in "ab")
    assert fine.unit_roundoff < coarse.unit_roundoff == HALF_ROUNDOFF


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


def test_what_readings_do_not_say_is_asked_and_answered(tmp_path):
    for name, lightness in (("a", 50.0), ("b", 51.0)):
        rows = "NUMBER_OF_FIELDS 4\nBEGIN_DATA_FORMAT\nSAMPLE_ID LAB_L LAB_A LAB_B\nEND_DATA_FORMAT\nNUMBER_OF_SETS 1\n"
        text = f"CGATS.17\n{rows}BEGIN_DATA\nA1 {lightness} 20 10\nEND_DATA\n"
        (tmp_path / f"{name}.cie").write_text(text, encoding="utf-8")
        spectrum = "\n".join(f"{nm},{lightness / 100}" for nm in range(380, 790, 10))
        (tmp_path / f"{name}.csv").write_text(f"wavelength,red\n{spectrum}\n", encoding="utf-8")
    for suffix, hint in ((".cie", "--colours-for"), (".csv", "--as")):
        with pytest.raises(InputError, match=hint):
            compared(*(tmp_path / f"{name}{suffix}" for name in "ab"))
    answered = SeenSpectra(("D65",), answer=ImportOptions("reflectance", "fraction", colours_for=("D50", "1931_2")))
    for suffix, light in ((".cie", "D50"), (".csv", "D65")):
        sides = (side_of(tmp_path / f"{name}{suffix}", answered) for name in "ab")
        found = compare(*sides, default_criteria())
        assert [row.name.light for row in found.rows] == [light] and found.rows[0].state == "changed"


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


def chunked(*chunks):
    """A PNG of greys with these chunks before its pixels."""
    data = io.BytesIO()
    Image.new("RGB", (8, 8), (90, 120, 60)).save(data, "PNG")
    told = b"".join(struct.pack(">I", len(c)) + k + c + struct.pack(">I", zlib.crc32(k + c)) for k, c in chunks)
    return data.getvalue()[:33] + told + data.getvalue()[33:]


SRGB, LINEAR, PQ = (b"sRGB", b"\0"), (b"gAMA", struct.pack(">I", 100_000)), (b"cICP", bytes([9, 16, 0, 1]))
DULLER = (b"iCCP", b"dull\0\0" + zlib.compress(matrix_profile(columns=DULL)))


@pytest.mark.parametrize(
    "chunks, problem, found",
    [
        ((SRGB, LINEAR), "two displays", "linear (gAMA 1) beside sRGB"),
        ((LINEAR,), "another display", "linear (gAMA 1)"),
        ((PQ, SRGB), "another display", "PQ (cICP)"),
        ((SRGB, DULLER), "another display", "an ICC profile of other colours"),
        ((), "does not say", "--display sRGB"),
    ],
)
def test_a_png_whose_header_says_another_display_is_asked_about(tmp_path, chunks, problem, found):
    plain, stated = tmp_path / "a.png", tmp_path / "b.png"
    plain.write_bytes(chunked(SRGB))
    stated.write_bytes(chunked(*chunks))
    with pytest.raises(InputError, match=problem) as refused:
        compared(plain, stated)
    assert found in str(refused.value) and "b.png" in str(refused.value)
    # An answer holds, and stands beside the figures.
    (row,) = compared(plain, stated, "sRGB").rows
    assert row.state == "identical" and row.layers["picture"].mean == 0.0
    assert [note for note in row.notes if "b.png states" in note and "as --display says" in note] == list(row.notes)
    assert bool(row.notes) == bool(chunks)


@pytest.mark.parametrize(
    "chunks", [(SRGB,), ((b"cICP", bytes([1, 13, 0, 1])), LINEAR), ((b"cICP", bytes([1, 13, 0, 1])), DULLER)]
)
def test_a_png_says_that_it_is_of_srgb_in_several_ways(tmp_path, chunks):
    for name in "ab":
        (tmp_path / f"{name}.png").write_bytes(chunked(*chunks))
    (row,) = compared(tmp_path / "a.png", tmp_path / "b.png").rows
    assert row.state == "identical" and not row.notes


def test_a_png_of_16_bits_is_refused_rather_than_cut_off(tmp_path):
    for name, low in (("a", 0), ("b", 200)):
        codes = np.full((4, 4, 3), (90 << 8) + low, np.uint16)
        (tmp_path / f"{name}.png").write_bytes(png_bytes(codes, [SRGB]))
    with pytest.raises(InputError, match=r"16 bits[^~]*as \.exr"):
        compared(tmp_path / "a.png", tmp_path / "b.png")


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


@pytest.mark.parametrize("text", ["{", "[]", *(f'{{"schema": "metamer.review/{n}"}}' for n in (1, 2, 9))])
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


@pytest.mark.parametrize("version", [1, 2])
def test_figures_of_either_version_are_read(tmp_path, version):
    """Version 2 says more of materials and lights, and the same of rows."""
    write_picture(tmp_path / "a.exr")
    write_exr(tmp_path / "map.exr", {}, {"deltaE94": np.zeros((4, 4), np.float32)})
    files = {"XYZ EXR": "a.exr", "reference EXR": "a.exr", "ΔE94 EXR": "map.exr"}
    row = {"material": "m", "illuminant": "D65", "observer": "o", "notes": ["said"], "files": files}
    row |= {"delta_e94": {"mean": 0.1, "p95": 0.2, "p99": 0.3, "max": 0.4}}
    document = {"metamer": "", "renderer": "", "status": "pass", "colour_chain": [], "results": [row]}
    document |= {"plan": {"basis_size": 3, "reasons": []}, "budget_delta_e94": 1.0}
    document |= {"schema": f"metamer.review/{version}"}
    (tmp_path / "review.json").write_text(json.dumps(document), encoding="utf-8")
    (found,) = side_of(tmp_path, SEEN).rows
    assert (
        found.name.material == "m"
        and found.approximation["p99"] == 0.3
        and set(found.layers) == {"picture", "reference"}
    )


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
