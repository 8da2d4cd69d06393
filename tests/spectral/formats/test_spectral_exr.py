"""Spectral OpenEXR: round trips, the layout's own words, and files that are something else."""

import numpy as np
import OpenEXR
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from metamer.runtime.errors import InputError
from metamer.spectral.formats import spectral_exr
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.registry import format_of, read_spectra
from metamer.spectral.formats.spectral_exr import read_spectral_exr, write_spectral_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

FLAT = np.full((2, 3), 0.5, np.float32)


def image(rng, quantity, top=1.0, grid=WORKING_WAVELENGTHS_NM):
    return Spectrum.sampled(grid, rng.uniform(0, top, (3, 5, grid.size)), quantity)


def refusal(path):
    with pytest.raises(InputError) as caught:
        read_spectral_exr(path)
    return str(caught.value).replace(f"{path.parent}/", "").splitlines()


@pytest.mark.parametrize(("quantity", "top"), [("reflectance", 1.0), ("emission", 5e4)])
def test_round_trip_to_float32(tmp_path, rng, quantity, top):
    written = image(rng, quantity, top)
    write_spectral_exr(tmp_path / "x.exr", written)
    found = read_spectral_exr(tmp_path / "x.exr")
    assert found.spectrum.quantity == quantity
    assert found.reradiation is None
    np.testing.assert_array_equal(found.spectrum.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    np.testing.assert_array_equal(found.spectrum.samples, written.samples.astype(np.float32))


def test_wavelengths_between_nanometres_come_back(tmp_path, rng):
    grid = np.array([379.9, 404.6565, 546.074, 1013.98])
    write_spectral_exr(tmp_path / "x.exr", image(rng, "emission", grid=grid))
    np.testing.assert_allclose(read_spectral_exr(tmp_path / "x.exr").spectrum.wavelengths_nm, grid, atol=1e-6)


def test_channels_and_attributes_are_those_of_the_layout(tmp_path, rng):
    write_spectral_exr(tmp_path / "e.exr", image(rng, "emission"))
    write_spectral_exr(tmp_path / "r.exr", image(rng, "reflectance"))
    with OpenEXR.File(str(tmp_path / "e.exr"), separate_channels=True) as file:
        assert {"S0.550,000000nm", "R", "G", "B"} <= set(file.channels())
        assert file.header()["spectralLayoutVersion"] == "1.0"
        assert file.header()["emissiveUnits"] == "W.m^-2.sr^-1.nm^-1"
    with OpenEXR.File(str(tmp_path / "r.exr"), separate_channels=True) as file:
        assert "T.550,000000nm" in file.channels() and "emissiveUnits" not in file.header()


def test_units_come_back(tmp_path, rng):
    write_spectral_exr(tmp_path / "x.exr", image(rng, "emission"), units="W.m^-2.nm^-1")
    assert read_spectral_exr(tmp_path / "x.exr").units == "W.m^-2.nm^-1"


def test_preview_of_a_perfect_diffuser_is_white(tmp_path):
    write_spectral_exr(tmp_path / "x.exr", Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.ones((1, 1, 81))))
    with OpenEXR.File(str(tmp_path / "x.exr"), separate_channels=True) as file:
        preview = [float(file.channels()[name].pixels[0, 0]) for name in "RGB"]
    np.testing.assert_allclose(preview, 1.0, atol=1e-6)


def test_channels_are_sorted_by_number_not_by_letter(tmp_path):
    write_exr(tmp_path / "x.exr", {}, {f"T.{nm},0nm": np.full((1, 1), nm / 2000) for nm in (1000, 400, 90, 700)})
    found = read_spectral_exr(tmp_path / "x.exr").spectrum
    assert found.wavelengths_nm.tolist() == [90.0, 400.0, 700.0, 1000.0]
    np.testing.assert_allclose(found.samples[0, 0], found.wavelengths_nm / 2000, rtol=1e-6)


def test_points_commas_and_other_units_of_length(tmp_path):
    write_exr(tmp_path / "x.exr", {}, {"S0.4.5e2nm": FLAT, "S0.0,55um": FLAT, "S0.650nm": FLAT})
    assert read_spectral_exr(tmp_path / "x.exr").spectrum.wavelengths_nm.tolist() == [450.0, 550.0, 650.0]


def test_bispectral_channels_are_input_then_output(tmp_path):
    plain = {f"T.{nm},000000nm": FLAT for nm in (400, 500, 600)}
    write_exr(tmp_path / "x.exr", {}, {**plain, "T.400,000000nm.500,000000nm": 0.5 * FLAT})
    found = read_spectral_exr(tmp_path / "x.exr").reradiation
    assert found.shape == (2, 3, 3, 3)
    np.testing.assert_array_equal(found[0, 0], [[0.5, 0, 0], [0.25, 0.5, 0], [0, 0, 0.5]])


# Bad files.


def test_missing_file(tmp_path):
    assert refusal(tmp_path / "nowhere.exr")[0] == "nowhere.exr: no such file"


@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n\0\0", b"nm,Red\n400,0.1\n"])
def test_other_kinds_of_file(tmp_path, content):
    path = tmp_path / "x.exr"
    path.write_bytes(content)
    assert refusal(path)[0] == "x.exr: header: not an OpenEXR file"


@pytest.mark.parametrize("kept", [0.01, 0.3, 0.6, 0.95])
def test_truncated_file(tmp_path, rng, capfd, kept):
    path = tmp_path / "x.exr"
    write_spectral_exr(path, image(rng, "reflectance"))
    whole = path.read_bytes()
    path.write_bytes(whole[: int(kept * len(whole))])
    lines = refusal(path)
    assert lines[0] in [f"x.exr: {where}: the OpenEXR file cannot be read" for where in ("header", "pixels")]
    assert lines[-1] == "  try: the picture is damaged or cut short: save or copy it again"


def test_plain_rgb_picture(tmp_path):
    write_exr(tmp_path / "x.exr", {}, dict.fromkeys("RGB", FLAT))
    assert refusal(tmp_path / "x.exr") == [
        "x.exr: channels: no spectral channels",
        "  found: B, G, R",
        "  expected: channels such as T.550,000000nm or S0.550,000000nm",
    ]


def test_emission_and_reflectance_in_one_file(tmp_path):
    write_exr(tmp_path / "x.exr", {}, {"S0.400,0nm": FLAT, "T.400,0nm": FLAT})
    assert refusal(tmp_path / "x.exr")[0] == "x.exr: channels: emission and reflectance in one file"


def test_two_layers_with_the_same_wavelengths(tmp_path):
    write_exr(tmp_path / "x.exr", {}, {"left.T.400,0nm": FLAT, "right.T.400,0nm": FLAT})
    lines = refusal(tmp_path / "x.exr")
    assert lines[0].endswith("T.400,0nm: two channels hold the same wavelength")
    assert "layers or views" in lines[-1]


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.nan, "reflectance is not a number"),
        (-0.25, "negative reflectance"),
        (80.0, "reflectance looks like percent"),
        (1.5, "reflectance above 1"),
    ],
)
def test_values_that_cannot_be(tmp_path, value, message):
    broken = FLAT.copy()
    broken[1, 2] = value
    write_exr(tmp_path / "x.exr", {}, {"T.400,0nm": FLAT, "T.410,0nm": broken})
    lines = refusal(tmp_path / "x.exr")
    assert lines[0] == f"x.exr: T channels: {message}"
    assert lines[1] == f"  found: {value:g} at 410 nm"


@pytest.mark.parametrize("value", [np.nan, -0.25])
def test_reradiation_that_cannot_be(tmp_path, value):
    plain = {f"T.{nm},0nm": FLAT for nm in (400, 500)}
    write_exr(tmp_path / "x.exr", {}, {**plain, "T.400,0nm.500,0nm": np.full((2, 3), value)})
    lines = refusal(tmp_path / "x.exr")
    assert lines[0] == "x.exr: T.400nm.500nm: re-radiation is negative or not a number"
    assert lines[1] == f"  found: {value:g}"


def test_reradiation_without_its_wavelength(tmp_path):
    write_exr(tmp_path / "x.exr", {}, {"T.400,0nm": FLAT, "T.400,0nm.500,0nm": FLAT})
    assert "a re-radiation channel without its wavelength" in refusal(tmp_path / "x.exr")[0]


def test_spectrum_that_is_no_image(tmp_path):
    with pytest.raises(InputError, match="not an image"):
        write_spectral_exr(tmp_path / "x.exr", illuminant("D65"))
    assert not list(tmp_path.iterdir())


# Real files.


@pytest.mark.parametrize(
    ("name", "shape", "ends"),
    [("Ohta1997.exr", (4, 6, 16), (400, 700)), ("Macbeth.exr", (400, 600, 36), (380, 730))],
)
def test_real_charts_load(shared_data, name, shape, ends):
    found = read_spectral_exr(shared_data / "spectra" / "exr" / name)
    assert found.spectrum.samples.shape == shape
    assert tuple(found.spectrum.wavelengths_nm[[0, -1]]) == ends
    assert found.spectrum.quantity == "reflectance" and found.reradiation is None


def test_real_chart_is_a_colorchecker(shared_data, chart):
    """The 24 patches of another author's average lie within a few ΔE94 of ours."""
    from metamer.spectral.difference import delta_e_xyz

    found = read_spectral_exr(shared_data / "spectra" / "exr" / "Ohta1997.exr").spectrum
    light = illuminant("D65")
    weights = observer("1931_2").weights(light, found.wavelengths_nm)
    theirs = found.samples.reshape(24, -1) @ weights.T
    ours = chart.reflectances @ chart.weights["D65"].T
    off = delta_e_xyz(ours, theirs, observer("1931_2").white(light))
    assert np.median(off) < 4 and off.max() < 15, off


def test_real_fluorescent_image_loads(shared_data):
    found = read_spectral_exr(shared_data / "spectra" / "exr" / "BiSpectral.exr")
    assert found.reradiation.shape == (16, 16, 41, 41)
    # Fluorescence is redder than the light absorbed: below the diagonal of [out, in] and never above it.
    assert np.tril(found.reradiation, -1).max() > 0
    assert np.triu(found.reradiation, 1).max() == 0


# Charts: one spectrum a colour


def chart(tmp_path, quantity="reflectance", units="W.m^-2.nm^-1"):
    values = np.array([[[0.25, 0.5, 0.75]] * 3, [[0.5, 0.5, 0.5], [0.25, 0.5, 0.75], [0.5, 0.5, 0.5]]])
    path = tmp_path / "chart.exr"
    write_spectral_exr(path, Spectrum.sampled([400.0, 500.0, 600.0], values, quantity), units)
    return path


def test_a_chart_gives_a_spectrum_for_each_colour_in_reading_order(tmp_path):
    file = read_spectra(chart(tmp_path))
    assert file.format == "spectral OpenEXR" and file.details == {"picture": "3 x 2"}
    assert [entry.name for entry in file.entries] == ["chart 1", "chart 2"]
    assert file.entries[0].details == {"first pixel": "row 0, column 0", "pixels": "4"}
    np.testing.assert_array_equal(file.entries[1].spectrum.samples, [0.5, 0.5, 0.5])


def test_a_picture_of_one_emission_keeps_its_units(tmp_path):
    path = tmp_path / "lamp.exr"
    write_spectral_exr(path, Spectrum.sampled([400.0, 500.0], np.full((2, 2, 2), 7.0), "emission"), "W.sr^-1.nm^-1")
    (entry,) = read_spectra(path).entries
    assert (entry.name, entry.spectrum.quantity) == ("lamp", "emission")
    assert entry.details["units"] == "W.sr^-1.nm^-1"


def test_units_of_a_type_that_is_no_text_are_not_stated(tmp_path):
    path = chart(tmp_path, "emission")
    content = path.read_bytes()
    assert content.count(b"emissiveUnits\0string\0") == 1
    path.write_bytes(content.replace(b"emissiveUnits\0string\0", b"emissiveUnits\0strin\xee\0"))
    assert {entry.details["units"] for entry in read_spectra(path).entries} == {"not stated"}


def test_a_texture_and_a_fluorescent_picture_are_no_charts(tmp_path, rng):
    write_spectral_exr(tmp_path / "t.exr", Spectrum.sampled([400.0, 500.0], rng.uniform(0, 1, (200, 300, 2))))
    channels = {f"T.{nm},0nm": FLAT for nm in (400, 500)} | {"T.400,0nm.500,0nm": FLAT * 0.1}
    write_exr(tmp_path / "f.exr", {}, channels)
    for name, words in (("t", "a texture"), ("f", "fluorescent")):
        with pytest.raises(InputError, match=words) as caught:
            read_spectra(tmp_path / f"{name}.exr")
        assert "metamer catalogue import" in str(caught.value)


def test_channels_are_found_behind_long_attributes(tmp_path):
    path = tmp_path / "x.exr"
    write_exr(path, {"aaa": "long " * 4000}, {"T.400,0nm": FLAT, "T.500,0nm": FLAT})
    assert format_of(path) is spectral_exr


def test_other_pictures_are_left_to_others(tmp_path):
    write_exr(tmp_path / "rgb.exr", {}, dict.fromkeys("RGB", FLAT))
    assert format_of(tmp_path / "rgb.exr") is None


def test_a_header_that_asks_for_terabytes_costs_nothing(tmp_path):
    path = chart(tmp_path)
    raw, mark = bytearray(path.read_bytes()), b"dataWindow\0box2i\0"
    place = raw.index(mark) + len(mark) + 4
    raw[place : place + 16] = np.array([0, 0, 299999, 299999], "<i4").tobytes()
    path.write_bytes(bytes(raw))
    with pytest.raises(InputError, match="too large a picture"):
        spectral_exr.read(path)


def test_a_matrix_for_each_of_many_pixels_is_refused_before_it_is_set_aside(tmp_path, monkeypatch):
    """Re-radiation takes the square of the bands: 4 x 2 x 3 x 3 samples here, more than the limit of 71."""
    channels = {f"T.{nm},0nm": np.full((2, 4), 0.2, np.float32) for nm in (400, 500, 600)}
    write_exr(tmp_path / "x.exr", {}, channels | {"T.400,0nm.500,0nm": np.full((2, 4), 0.1, np.float32)})
    assert read_spectral_exr(tmp_path / "x.exr").reradiation is not None
    monkeypatch.setattr(spectral_exr, "MOST_SAMPLES", 71)
    assert refusal(tmp_path / "x.exr")[:2] == [
        "x.exr: re-radiation: too large a picture",
        "  found: 4 x 2 pixels of 3 x 3 bands",
    ]


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_mutated_bytes_are_read_or_refused(tmp_path, data):
    raw = bytearray(chart(tmp_path).read_bytes())
    for _ in range(data.draw(st.integers(1, 5))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / "bad.exr"
    path.write_bytes(bytes(raw))
    spectral_exr.recognises(path, bytes(raw[:4096]))
    try:
        spectral_exr.read(path)
    except InputError as reason:
        assert str(path) in str(reason)


@pytest.mark.slow_cases("Macbeth-25")
@pytest.mark.parametrize("name, count", [("Macbeth", 25), ("Ohta1997", 24)])
def test_real_charts(shared_data, name, count):
    path = shared_data / "spectra" / "exr" / f"{name}.exr"
    if not path.is_file():
        pytest.skip(f"no {path}")
    file = read_spectra(path)
    assert len(file.entries) == count and file.rejected == ()
    assert all(entry.spectrum.quantity == "reflectance" for entry in file.entries)
