"""Spectral OpenEXR textures: the texture as it came, its mean, and what is refused."""

import warnings

import numpy as np
import OpenEXR
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from metamer.materials.formats import bispectral, texture_exr
from metamer.materials.records.models import rebuild
from metamer.materials.records.source import Rejected
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import NO_ANSWER, ImportOptions
from metamer.spectral.formats.registry import read_spectra

NM = (400.0, 500.0, 600.0, 700.0)


def write(path, channels, **attributes):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        OpenEXR.File(header, {name: np.ascontiguousarray(values) for name, values in channels.items()}).write(str(path))
    return path


def texture(kind="T", dtype=np.float16, size=(12, 10), seed=3):
    values = np.random.default_rng(seed).uniform(0.1, 0.9, (*size, len(NM))).astype(dtype)
    return values, {f"{kind}.{nm:.0f},0nm": values[..., at] for at, nm in enumerate(NM)}


def read(path, answer=NO_ANSWER):
    return list(texture_exr.read_sources(path, "mallett-yuksel", answer))


def test_a_reflective_texture_is_kept_to_the_bit_as_a_surface_beside_its_mean(tmp_path):
    values, channels = texture()
    preview = dict.fromkeys("RGB", values[..., 0])
    path = write(tmp_path / "Oak Wood.exr", channels | preview, spectralLayoutVersion="1.0", EV=1.5)
    assert texture_exr.recognises(path, path.read_bytes()[:4096])
    (oak,) = read(path)
    assert (oak.id, oak.model) == ("textures/oak-wood", "spectral_texture")
    assert oak.parameters["texture"].dtype == np.float16
    np.testing.assert_array_equal(oak.parameters["texture"], values)
    np.testing.assert_array_equal(oak.original["texture.wavelengths_nm"], NM)
    mean = values.astype(np.float64).mean(axis=(0, 1))
    np.testing.assert_allclose(oak.original["values"], mean, rtol=1e-12)
    average = rebuild(oak.model, oak.parameters).average()
    np.testing.assert_allclose(average.reflectance.samples, mean, rtol=1e-12)
    assert oak.original["exr.spectralLayoutVersion"] == "1.0" and oak.original["exr.EV"] == "1.5"
    assert "preview" in oak.provenance.notes and "end values are repeated" in oak.provenance.notes


def test_a_finer_texture_keeps_its_wavelengths(tmp_path):
    """Sixty-one channels of 4 nm: no sample is lost to the working wavelengths."""
    nm = 440.0 + 4.0 * np.arange(61)
    values = np.random.default_rng(2).uniform(0.1, 0.9, (12, 10, nm.size)).astype(np.float32)
    channels = {f"T.{at:.0f},0nm": values[..., index] for index, at in enumerate(nm)}
    (found,) = read(write(tmp_path / "Fine.exr", channels))
    np.testing.assert_array_equal(found.parameters["wavelengths_nm"], nm)
    np.testing.assert_array_equal(found.parameters["texture"], values)
    assert "finer than 5 nm" in found.provenance.notes


def test_emission_with_its_polarisation(tmp_path):
    values, channels = texture("S0", np.float32)
    first, more = texture("S1", np.float32, seed=4)
    path = write(tmp_path / "sky.exr", channels | more, emissiveUnits="W.m^-2.sr^-1.nm^-1")
    (sky,) = read(path)
    assert sky.model == "emission" and sky.original["quantity"] == "emission" and not sky.parameters
    np.testing.assert_array_equal(sky.original["texture.values"], values)
    np.testing.assert_array_equal(sky.original["texture.S1.values"], first)
    assert sky.original["exr.emissiveUnits"] == "W.m^-2.sr^-1.nm^-1"


def test_an_attribute_of_no_known_type_is_no_failure(tmp_path):
    """A damaged header may name a type that is no text: OpenEXR's own object then has no words for itself."""
    path = write(tmp_path / "a.exr", texture()[1], capDate="2024:04:28")
    raw = path.read_bytes()
    assert raw.count(b"capDate\0string\0") == 1
    path.write_bytes(raw.replace(b"capDate\0string\0", b"capDate\0str\xcf\x80g\0"))
    (found,) = read(path)
    assert found.original["exr.capDate"]
    path.write_bytes(raw.replace(b"capDate\0string\0", b"capDate\0str\xcfng\0"))
    (found,) = read(path)
    assert "not readable" in found.original["exr.capDate"]


def test_layers_and_quantities_are_records_of_their_own(tmp_path):
    values, plain = texture()
    lit, shining = texture("S0", seed=5)
    front, layer = texture(seed=6)
    path = write(tmp_path / "a.exr", plain | shining | {f"front.{name}": value for name, value in layer.items()})
    found = {source.id: source for source in read(path)}
    assert set(found) == {"textures/a", "textures/a-emission", "textures/a-front"}
    np.testing.assert_array_equal(found["textures/a"].parameters["texture"], values)
    np.testing.assert_array_equal(found["textures/a-emission"].original["texture.values"], lit)
    np.testing.assert_array_equal(found["textures/a-front"].parameters["texture"], front)


def test_channels_beside_the_spectral_ones_are_kept(tmp_path):
    _, channels = texture()
    depth = np.arange(120, dtype=np.float32).reshape(12, 10)
    (found,) = read(write(tmp_path / "a.exr", channels | {"Z": depth}))
    np.testing.assert_array_equal(found.original["channel.Z"], depth)


@pytest.mark.parametrize(
    ("words", "nanometres"),
    [
        (("550,5", "n", "m"), 550.5),
        (("0.55", "u", "m"), 550.0),
        (("5.5e-7", None, "m"), 550.0),
        (("5500", None, "m"), 5.5e12),
        (("545,077196", "T", "Hz"), 550.0),
        (("545077196363636.4", None, "Hz"), 550.0),
    ],
)
def test_wavelengths_in_any_unit(words, nanometres):
    assert texture_exr.wavelength_of(*words) == pytest.approx(nanometres, rel=1e-8)


def test_frequencies_are_sorted_as_wavelengths(tmp_path):
    values, _ = texture()
    channels = {f"T.{299792.458 / nm:.6f}THz".replace(".", ",").replace(",", ".", 1): None for nm in NM}
    channels = {name: values[..., at] for at, name in enumerate(channels)}
    (found,) = read(write(tmp_path / "a.exr", channels))
    np.testing.assert_allclose(found.original["texture.wavelengths_nm"], NM, rtol=1e-6)
    np.testing.assert_array_equal(found.parameters["texture"], values)


def test_few_colours_are_a_chart_of_spectra(tmp_path):
    patches = np.random.default_rng(1).uniform(0.1, 0.9, (2, 3, 4)).astype(np.float32)
    values = patches.repeat(5, axis=0).repeat(4, axis=1)
    found = read(write(tmp_path / "chart.exr", {f"T.{nm:.0f}nm": values[..., at] for at, nm in enumerate(NM)}))
    assert len(found) == 6 and {source.model for source in found} == {"lambert"}


@pytest.mark.parametrize(
    "name", [lambda nm: f"{nm / 1000:g}um", lambda nm: f"{nm * 1e-9:.9e}m", lambda nm: f"{299792.458 / nm:.9f}THz"]
)
def test_a_chart_is_one_in_any_unit(tmp_path, name):
    values = np.random.default_rng(1).uniform(0.1, 0.9, (2, 3, 4)).astype(np.float32)
    path = write(tmp_path / "chart.exr", {f"T.{name(nm)}": values[..., at] for at, nm in enumerate(NM)})
    found = read(path)
    assert [source.id.partition("/")[0] for source in found] == ["chart"] * 6
    for source, pixel in zip(found, values.reshape(-1, 4), strict=True):
        np.testing.assert_allclose(source.original["wavelengths_nm"], NM, rtol=1e-8)
        np.testing.assert_array_equal(source.original["values"], pixel)


def test_values_out_of_range_are_kept_and_said(tmp_path):
    values, _ = texture(dtype=np.float32)
    values[0, 0, 0], values[1, 1, 1] = -0.01, 1.2
    (found,) = read(write(tmp_path / "a.exr", {f"T.{nm:.0f}nm": values[..., at] for at, nm in enumerate(NM)}))
    assert found.model == "spectral_texture"
    assert "1 of 480 values are negative, down to -0.01" in found.provenance.notes
    assert "1 of 480 values exceed 1, up to 1.2" in found.provenance.notes


def test_a_mean_above_one_is_no_surface(tmp_path):
    values = texture(dtype=np.float32)[0] + 1.0
    (found,) = read(write(tmp_path / "a.exr", {f"T.{nm:.0f}nm": values[..., at] for at, nm in enumerate(NM)}))
    assert found.model == "radiance_factor" and found.original["quantity"] == "radiance factor"


@pytest.mark.parametrize("size", [(1, 1), (12, 10)])
@pytest.mark.parametrize("scale", [10.0, 63.0, 1e4])
def test_percent_is_no_radiance_factor(tmp_path, size, scale):
    channels = {name: scale * values.astype(np.float32) for name, values in texture(size=size)[1].items()}
    (refusal,) = read(write(tmp_path / "a.exr", channels))
    assert isinstance(refusal, Rejected) and "reflectance looks like percent" in str(refusal.reason)


@pytest.mark.parametrize("size", [(1, 1), (1, 3), (12, 10)])
@pytest.mark.parametrize("scale", [0.01, 1e-4, 0.0])
def test_what_is_darker_than_any_surface_is_asked_about(tmp_path, size, scale):
    """A picture of one colour, a chart and a texture; the person's word counts."""
    values = {name: scale * value.astype(np.float32) for name, value in texture(size=size)[1].items()}
    path = write(tmp_path / "a.exr", values)
    (refusal,) = read(path)
    assert isinstance(refusal, Rejected) and "too dark for a surface" in str(refusal.reason)
    assert "S0" in str(refusal.reason) and "--scale fraction" in str(refusal.reason)
    found = read(path, ImportOptions(scale="fraction"))
    assert found and all(one.model in ("lambert", "spectral_texture") for one in found)
    if size[1] < 10:
        with pytest.raises(InputError, match="too dark for a surface"):
            read_spectra(path)
        entry = read_spectra(path, ImportOptions(scale="fraction", against="overruled")).entries[0]
        np.testing.assert_array_equal(entry.spectrum.samples, [value[0, 0] for value in values.values()])


def test_a_dark_patch_beside_others_is_read(tmp_path):
    values = texture(dtype=np.float32)[0]
    values[:6] *= 0.001
    (found,) = read(write(tmp_path / "a.exr", {f"T.{nm:.0f}nm": values[..., at] for at, nm in enumerate(NM)}))
    assert found.model == "spectral_texture"


def changed(name, at, value):
    values, _ = texture(dtype=np.float32)
    values[at] = value
    return {f"{name}.{nm:.0f}nm": values[..., index] for index, nm in enumerate(NM)}


REFUSED = {
    "NaN": (changed("T", (2, 3, 1), np.nan), "T pixel (2, 3)", "not a finite number"),
    "no spectral channels": ({"R": np.zeros((3, 3), np.float32)}, "channels", "no spectral channels"),
    "polarisation alone": (texture("S1")[1], "channels", "polarisation without its intensity"),
    "a wavelength twice": (texture()[1] | {"T.0.4um": texture()[0][..., 0]}, "T.400,0nm", "the same wavelength"),
}


@pytest.mark.parametrize(("channels", "field", "problem"), REFUSED.values(), ids=REFUSED)
def test_what_is_refused(tmp_path, channels, field, problem):
    path = write(tmp_path / "a.exr", channels)
    with pytest.raises(InputError) as caught:
        read(path)
    said = caught.value
    assert said.file == path and said.field == field and problem in said.problem
    assert said.found and said.expected and said.hint


def test_negative_means_are_refused(tmp_path):
    (found,) = read(write(tmp_path / "a.exr", changed("T", (..., 1), -0.2)))
    assert isinstance(found, Rejected) and found.reason.field == "mean" and found.reason.hint


def test_a_huge_picture_is_refused_by_its_header(tmp_path, monkeypatch):
    path = write(tmp_path / "a.exr", texture()[1])
    monkeypatch.setattr(texture_exr, "MOST_SAMPLES", 400)
    with pytest.raises(InputError, match="too large a picture") as caught:
        read(path)
    assert caught.value.found == "480 samples" and caught.value.hint


@pytest.mark.parametrize("kept", [0, 5, 60, 700, -3])
def test_cut_files(tmp_path, capfd, kept):
    path = write(tmp_path / "a.exr", texture()[1])
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(InputError) as caught:
        read(path)
    said = caught.value
    assert said.file == path and said.field and said.found and said.expected and said.hint


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_bytes_are_refused_in_words(tmp_path, data):
    path = tmp_path / "a.exr"
    if not path.exists():
        write(path, texture(size=(9, 9))[1])
        (tmp_path / "whole").write_bytes(path.read_bytes())
    raw = bytearray((tmp_path / "whole").read_bytes())
    for _ in range(data.draw(st.integers(1, 6))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(raw)
    texture_exr.recognises(path, bytes(raw[:4096]))
    bispectral.recognises(path, bytes(raw[:4096]))
    try:
        found = read(path)
    except InputError as reason:
        assert reason.file == path and reason.hint
        return
    assert all(isinstance(each, Rejected) or each.original for each in found)


@pytest.mark.slow
def test_the_charts_and_the_fluorescent_picture(shared_data):
    folder = shared_data / "spectra" / "exr"
    for name, count in (("Ohta1997.exr", 24), ("Macbeth.exr", 25)):
        path = folder / name
        assert texture_exr.recognises(path, path.read_bytes()[:4096])
        assert len(read(path)) == count
    path = folder / "BiSpectral.exr"
    assert bispectral.recognises(path, path.read_bytes()[:4096])
