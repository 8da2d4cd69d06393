"""Export: what each format holds of a material, what comes back of it, and what is refused."""

import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley, CookTorrance, Lambert
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.core.directions import io_from_half_difference
from metamer.materials.export.files import FORMATS, export
from metamer.materials.export.spectrum import exported_spectrum
from metamer.materials.formats.bispectral import read_bispectral
from metamer.materials.formats.merl import DARKEST, read_merl
from metamer.materials.formats.rgl import read_rgl
from metamer.materials.measured.merl import node_angles
from metamer.materials.measured.rgl import RglBrdf
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.bispectral import Bispectral
from metamer.spectral.colour_library import colour_science
from metamer.spectral.formats.exr import read_exr
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.formats.spectral_exr import read_spectral_exr
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

SAID = Provenance("measured by us -- twice", "CC0", "measured", "45:0", "kept dry")
GRID = np.array([380.5, 400.0, 412.25, 550.0, 700.0])
VALUES = np.array([0.05, 0.1, 1 / 3, 0.8, 0.75])


def record(name, model, parameters=None, provenance=SAID, **original):
    return MaterialRecord(name, name.split("/")[0], model, parameters or {}, provenance, None, "abc", original)


def of(name, brdf, **original):
    parameters = dict(brdf.parameters())
    if brdf.NAME != "fluorescent_lambert":
        parameters["wavelengths_nm"] = brdf.wavelengths_nm
    return record(name, brdf.NAME, parameters, **original)


def spectrum_only(name, model, scale=1.0):
    quantity = model.replace("_", " ")
    return record(name, model, wavelengths_nm=GRID, values=VALUES * scale, quantity=quantity)


@pytest.fixture
def lambert():
    return Lambert(Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.linspace(0.1, 0.7, 81)))


@pytest.fixture
def measured(lambert):
    """A surface whose spectrum was measured at other wavelengths than those that it is shaded at."""
    told = {"details.condition": "M1", "details.instrument": "Acme 7", "stated.0.space": "XYZ"}
    told |= {"stated.0.values": np.array([10.0, 20.0, 30.0]), "stated.0.illuminant": "D65"}
    return of("chart/red", lambert, wavelengths_nm=GRID, values=VALUES, quantity="reflectance", **told)


@pytest.fixture
def dye():
    nm = np.arange(380.0, 781.0, 20.0)
    matrix = np.diag(np.linspace(0.2, 0.8, nm.size))
    matrix[8, 2:5] = 0.1
    return FluorescentLambert(Bispectral(nm, nm, matrix))


# The spectrum


def test_the_measurement_goes_out_at_its_own_wavelengths(measured):
    entry = exported_spectrum(measured)
    np.testing.assert_array_equal(entry.spectrum.wavelengths_nm, GRID)
    np.testing.assert_array_equal(entry.spectrum.samples, VALUES)
    assert entry.details["condition"] == "M1" and entry.details["geometry"] == "45:0"
    assert [(c.space, c.illuminant) for c in entry.stated] == [("XYZ", "D65"), ("Lab", "D50")]


def test_lab_is_that_of_colour_science(lambert):
    colour = colour_science()
    entry = exported_spectrum(of("x/grey", lambert))
    table = colour.SpectralDistribution(dict(zip(WORKING_WAVELENGTHS_NM, entry.spectrum.samples, strict=True)))
    table = table.interpolate(colour.SpectralShape(380, 780, 1)).extrapolate(colour.SpectralShape(360, 830, 1))
    light = colour.SDS_ILLUMINANTS["D50"].copy().align(colour.SpectralShape(360, 830, 1))
    eye = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    with np.errstate(all="ignore"):
        xyz = colour.sd_to_XYZ(table, eye, light, method="Integration") / 100
        white = colour.sd_to_XYZ(colour.sd_ones(colour.SpectralShape(360, 830, 1)), eye, light, method="Integration")
    lab = colour.XYZ_to_Lab(xyz, colour.XYZ_to_xy(white))
    np.testing.assert_allclose(entry.stated[0].values, lab, atol=0.01)


def test_a_surface_without_a_spectrum_is_read_at_45_0():
    brdf = CookTorrance.examples(WORKING_WAVELENGTHS_NM)[1]
    entry = exported_spectrum(of("x/gloss", brdf))
    wi, wo = np.array([np.sqrt(0.5), 0, np.sqrt(0.5)]), np.array([0.0, 0, 1])
    np.testing.assert_allclose(entry.spectrum.samples, np.pi * brdf.eval(wi, wo), rtol=1e-12)
    assert entry.details["geometry"] == "45a:0" and "no measured spectrum" in entry.details["computed"]


def test_an_anisotropic_surface_is_read_from_all_sides():
    brdf = AshikhminShirley.examples(WORKING_WAVELENGTHS_NM)[2]
    assert not brdf.isotropic
    first = exported_spectrum(of("x/brushed", brdf)).spectrum
    turned = AshikhminShirley(brdf.diffuse, brdf.specular, brdf.exponent_v, brdf.exponent_u)
    np.testing.assert_allclose(exported_spectrum(of("x/t", turned)).spectrum.samples, first.samples, rtol=1e-12)


# Round trips


@pytest.mark.parametrize("form", ["csv", "cxf"])
@pytest.mark.parametrize("model", ["emission", "transmittance", "radiance_factor", "lambert"])
def test_spectra_come_back_bit_for_bit(tmp_path, form, model, measured):
    one = (
        measured if model == "lambert" else spectrum_only("set/one", model, 1.4 if model == "radiance_factor" else 1.0)
    )
    (done,) = export([one], form, tmp_path / f"x.{form}")
    (entry,) = read_spectra(done.path).entries
    assert entry.name == one.id and entry.spectrum.quantity == one.quantity
    np.testing.assert_array_equal(entry.spectrum.wavelengths_nm, GRID)
    np.testing.assert_array_equal(entry.spectrum.samples, one.measured_spectrum().samples)


@pytest.mark.parametrize("model", ["emission", "lambert"])
def test_pictures_hold_spectra_to_float32(tmp_path, model, measured):
    one = measured if model == "lambert" else spectrum_only("set/lamp", model)
    (done,) = export([one], "exr", tmp_path / "x.exr")
    (entry,) = read_spectra(done.path).entries
    assert entry.spectrum.quantity == one.quantity
    np.testing.assert_array_equal(entry.spectrum.wavelengths_nm, GRID)
    np.testing.assert_array_equal(entry.spectrum.samples, VALUES.astype(np.float32))


def test_fluorescence_comes_back_to_float32(tmp_path, dye):
    (done,) = export([of("dye/orange", dye)], "exr", tmp_path / "x.exr")
    (back,) = read_bispectral(done.path)
    np.testing.assert_array_equal(back.bispectral.matrix, dye.bispectral.matrix.astype(np.float32))
    np.testing.assert_array_equal(back.bispectral.wavelengths_in_nm, dye.bispectral.wavelengths_in_nm)


def test_bands_that_only_excite_come_back_where_nothing_leaves(tmp_path, dye):
    told = dye.bispectral
    narrow = FluorescentLambert(Bispectral(told.wavelengths_in_nm, told.wavelengths_out_nm[3:], told.matrix[3:]))
    (done,) = export([of("dye/narrow", narrow)], "exr", tmp_path / "x.exr")
    (back,) = read_bispectral(done.path)
    np.testing.assert_array_equal(back.bispectral.matrix[3:], narrow.bispectral.matrix.astype(np.float32))
    assert (back.bispectral.matrix[:3] == 0).all()


def test_where_it_comes_from_goes_along(tmp_path, measured, dye):
    export([measured], "csv", tmp_path / "x.csv")
    text = (tmp_path / "x.csv.txt").read_text()
    assert "chart/red: licence: CC0\n" in text and "chart/red: source: measured by us -- twice\n" in text
    file = read_spectra(export([measured], "cxf", tmp_path / "x.cxf")[0].path)
    assert file.details["tag: licence"] == "CC0" and file.entries[0].details["tag provenance: kind"] == "measured"
    assert file.entries[0].details["condition"].startswith("M1")
    assert [c.illuminant for c in file.entries[0].stated] == ["D50"] or len(file.entries[0].stated) == 2
    for one, name in ((measured, "a"), (of("d/d", dye), "b")):
        header, _ = read_exr(export([one], "exr", tmp_path / f"{name}.exr")[0].path)
        assert header["metamer_licence"] == "CC0" and header["spectralLayoutVersion"] == "1.0"


def test_words_of_a_source_do_not_change_what_a_table_holds(tmp_path, lambert):
    said = Provenance("refractive index and transmittance of a dyed polymer, absorbance", "CC0", "analytic")
    one = record("plastic/x", "lambert", {**lambert.parameters(), "wavelengths_nm": WORKING_WAVELENGTHS_NM}, said)
    file = read_spectra(export([one], "csv", tmp_path / "x.csv")[0].path)
    assert file.entries[0].spectrum.quantity == "reflectance" and file.notes == ()


def test_emission_keeps_its_units_in_a_picture(tmp_path):
    lamp = spectrum_only("set/lamp", "emission")
    lamp.original["details.units"] = "W.m^-2.nm^-1"
    (done,) = export([lamp], "exr", tmp_path / "x.exr")
    assert read_spectral_exr(done.path).units == "W.m^-2.nm^-1"


def test_a_texture_goes_out_whole_as_a_picture_and_as_its_mean_elsewhere(tmp_path, lambert):
    values = np.random.default_rng(2).normal(0.5, 0.4, (12, 9, 5)).astype(np.float32)
    kept = {"texture.values": values, "texture.wavelengths_nm": GRID, "texture.quantity": "reflectance"}
    one = of("textures/cloth", lambert, **kept)
    (done,) = export([one], "exr", tmp_path / "x.exr")
    assert done.notes == ("the whole texture",)
    _, channels = read_exr(done.path)
    back = np.stack([channels[f"T.{nm:.6f}nm".replace(".", ",").replace(",", ".", 1)] for nm in GRID], axis=-1)
    np.testing.assert_array_equal(back, values)
    drawn = record("textures/wool", "spectral_texture", {"wavelengths_nm": GRID, "texture": np.abs(values) / 2})
    drawn = replace(drawn, original={name: value for name, value in kept.items() if name != "texture.values"})
    (done,) = export([drawn], "exr", tmp_path / "y.exr")
    np.testing.assert_array_equal(read_exr(done.path)[1]["T.400,000000nm"], np.abs(values[..., 1]) / 2)
    for form in ("csv", "cxf", "mitsuba"):
        assert "their mean" in " ".join(export([one], form, tmp_path / form)[0].notes)


# Files and folders


def test_several_in_one_file_and_in_a_folder(tmp_path, lambert):
    several = [of("a/one", lambert), of("b/two", lambert)]
    (together,) = export(several, "csv", tmp_path / "all.csv")
    assert [entry.name for entry in read_spectra(together.path).entries] == ["a/one", "b/two"]
    apart = export(several, "exr", tmp_path / "new")
    assert [done.path.name for done in apart] == ["a-one.exr", "b-two.exr"]
    (tmp_path / "there").mkdir()
    assert export(several[:1], "cxf", tmp_path / "there")[0].path == tmp_path / "there" / "a-one.cxf"


def test_nothing_is_written_over_without_being_asked(tmp_path, lambert):
    place, one = tmp_path / "x.csv", of("a/one", lambert)
    place.write_text("mine")
    with pytest.raises(InputError, match="already") as caught:
        export([one], "csv", place)
    assert "--force" in str(caught.value) and place.read_text() == "mine"
    export([one], "csv", place, force=True)
    assert place.read_text() != "mine"


def test_either_everything_is_written_or_nothing(tmp_path, lambert):
    several = [of("a/one", lambert), spectrum_only("b/lamp", "emission")]
    with pytest.raises(InputError, match="b/lamp"):
        export(several, "mitsuba", tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_export_leaves_nothing(tmp_path, lambert, monkeypatch):
    def interrupted(path, records):
        path.write_text("half")
        raise KeyboardInterrupt

    monkeypatch.setitem(FORMATS, "csv", replace(FORMATS["csv"], write=interrupted))
    with pytest.raises(KeyboardInterrupt):
        export([of("a/one", lambert)], "csv", tmp_path / "x.csv")
    assert list(tmp_path.iterdir()) == []


def test_two_materials_never_share_a_file(tmp_path, lambert):
    with pytest.raises(InputError, match="share a file"):
        export([of("a/b-c", lambert), of("a-b/c", lambert)], "exr", tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_other_wavelengths_do_not_fit_one_table(tmp_path, lambert, measured):
    with pytest.raises(InputError, match="in one table") as caught:
        export([of("a/one", lambert), measured], "csv", tmp_path / "x.csv")
    assert str(tmp_path / "x.csv") in str(caught.value) and "folder" in str(caught.value)
    assert len(export([of("a/one", lambert), measured], "cxf", tmp_path / "x.cxf")) == 1


def test_names_that_are_none(tmp_path, lambert):
    one = of("a/one", lambert)
    with pytest.raises(UnknownNameError, match="export format") as caught:
        export([one], "cfx", tmp_path / "x")
    assert "nearest: cxf" in str(caught.value)
    with pytest.raises(InputError, match="no such folder"):
        export([one], "csv", tmp_path / "gone" / "x.csv")
    with pytest.raises(InputError, match="nothing to export"):
        export([], "csv", tmp_path / "x.csv")
    (tmp_path / "x.csv").mkdir()
    export([one], "csv", tmp_path / "x.csv")
    (tmp_path / "x.csv" / "a-one.cxf").mkdir()
    with pytest.raises(InputError, match="a folder stands"):
        export([one], "cxf", tmp_path / "x.csv", force=True)


@pytest.mark.parametrize(
    "model, form, words",
    [
        ("emission", "merl", "not a surface"),
        ("emission", "mitsuba", "not a surface"),
        ("transmittance", "exr", "no channels for transmittance"),
        ("transmittance", "merl", "not a surface"),
        ("radiance_factor", "exr", "radiance factor above 1"),
        ("radiance_factor", "mitsuba", "not a surface"),
        ("dye", "csv", "no single spectrum"),
        ("dye", "cxf", "no single spectrum"),
        ("dye", "merl", "fluorescent"),
        ("dye", "mitsuba", "fluorescent"),
        ("brushed", "merl", "anisotropic"),
    ],
)
def test_what_a_format_has_no_room_for_is_refused(tmp_path, dye, model, form, words):
    if model == "dye":
        one = of("x/y", dye)
    elif model == "brushed":
        one = of("x/y", AshikhminShirley.examples(WORKING_WAVELENGTHS_NM)[2])
    else:
        one = spectrum_only("x/y", model, 2.0 if model == "radiance_factor" else 1.0)
    with pytest.raises(InputError, match=words) as caught:
        export([one], form, tmp_path / f"out{FORMATS[form].suffix}")
    assert "x/y" in str(caught.value) and list(tmp_path.iterdir()) == []


@pytest.mark.slow_cases("satin_rosaline_rgb", "cc_iris_purple_gem_rgb")
@pytest.mark.parametrize("name", ["satin_rosaline_rgb", "cc_iris_purple_gem_rgb"])
def test_measurements_go_out_in_every_form_that_has_room(tmp_path, shared_data, name):
    brdf = RglBrdf(read_rgl(shared_data / "brdf" / "rgl" / f"{name}.bsdf"))
    said = Provenance("RGL", "CC0", "uplifted(mallett-yuksel)")
    one = record(f"measured/{name}", "rgl", brdf.parameters(), said)
    (entry,) = read_spectra(export([one], "cxf", tmp_path / "x.cxf")[0].path).entries
    assert entry.details["tag provenance: kind"] == "uplifted(mallett-yuksel)"
    wi, wo = np.array([np.sqrt(0.5), 0, np.sqrt(0.5)]), np.array([0.0, 0, 1])
    read = np.pi * brdf.eval(wi, wo)
    np.testing.assert_allclose(entry.spectrum.samples, np.maximum(read, 0.0), rtol=1e-9)
    assert ("taken as zero" in str(entry.details)) == (read.min() < 0)
    table = read_merl(export([one], "merl", tmp_path / "x.binary")[0].path).values
    theta_h, theta_d, phi_d = node_angles()
    pair = io_from_half_difference(theta_h[20], theta_d[30], phi_d[90])
    np.testing.assert_allclose(table[20, 30, 90], np.maximum(brdf.eval_measured(*pair), DARKEST), rtol=1e-9)


def test_a_merl_table_with_its_words_beside_it(tmp_path, lambert):
    one = of("x/clay", lambert)
    (done,) = export([one], "merl", tmp_path / "clay.binary")
    assert read_merl(done.path).values.max() > 0
    text = (tmp_path / "clay.binary.txt").read_text()
    assert "licence: CC0" in text and "linear sRGB" in text


@pytest.mark.parametrize("form", ["ubo", "ubo-spectral"])
def test_what_has_no_images_is_no_btf(tmp_path, lambert, form):
    with pytest.raises(InputError, match="no images to write"):
        export([of("x/grey", lambert)], form, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


# Killed

KILLED = """
import os, pathlib, signal, sys
from metamer.materials.export import files as exporting

def write(path, records):
    path.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)

exporting.FORMATS["csv"] = exporting.ExportFormat(".csv", True, write, "")
exporting.export([None], "csv", pathlib.Path(sys.argv[1]) / "a.csv")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_what_a_killed_export_left_goes_with_the_next(tmp_path, lambert):
    ours, others = tmp_path / "a.csv", tmp_path / ".export.settings"
    others.mkdir()
    assert subprocess.run([sys.executable, "-c", KILLED, tmp_path], check=False).returncode == -signal.SIGKILL
    (left,) = set(tmp_path.iterdir()) - {others}
    assert left.is_dir() and (left / "files" / "a.csv").read_text() == "half"
    export([of("x/grey", lambert)], "csv", ours)
    assert set(tmp_path.iterdir()) == {ours, others, tmp_path / "a.csv.txt"}


def test_an_export_that_is_still_at_work_keeps_its_folder(tmp_path, lambert, monkeypatch):
    def write(path, records):
        path.write_text("half")
        export([of("x/grey", lambert)], "cxf", tmp_path / "b.cxf")
        assert path.read_text() == "half"
        return ()

    monkeypatch.setitem(FORMATS, "csv", replace(FORMATS["csv"], write=write))
    export([of("x/grey", lambert)], "csv", tmp_path / "a.csv")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "b.cxf"]
