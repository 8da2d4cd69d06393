"""MATLAB files of versions 4, 5 and 7.3."""

import os
import signal
import struct

import h5py
import numpy as np
import pytest
import scipy.io
from metamer.runtime.errors import InputError
from metamer.spectral.formats import mat, mat_variables
from metamer.spectral.formats.mat import read, recognises
from metamer.spectral.formats.mat_library import variables as variables_of
from metamer.spectral.formats.registry import format_of, read_spectra

WAVELENGTHS = np.arange(400.0, 701.0, 10.0)


@pytest.fixture
def paints(rng):
    """(31,5) reflectances."""
    return 0.8 * rng.random((WAVELENGTHS.size, 5))


@pytest.fixture
def saved(tmp_path):
    """Function that saves variables as a .mat file of version 4 or 5, and gives its path."""

    def save(name="paints.mat", version="5", **variables):
        scipy.io.savemat(tmp_path / name, variables, format=version, do_compression=version == "5")
        return tmp_path / name

    return save


@pytest.fixture
def here(monkeypatch):
    """Variables are read in this process: what they mean is tested, not how they come out of a file."""
    monkeypatch.setattr(mat, "read_variables", lambda path: variables_of(path, mat_variables.MOST_SAMPLES))


def written_7_3(path, **variables):
    """Save arrays and strings as MATLAB does: HDF5 behind 512 bytes, columns first, letters as numbers."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            words = isinstance(value, str)
            held = np.array([[ord(letter)] for letter in value], dtype=np.uint16) if words else np.asarray(value).T
            file.create_dataset(name, data=held).attrs["MATLAB_class"] = np.bytes_("char" if words else "double")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


def check(file, paints, quantity="reflectance"):
    assert len(file.entries) == paints.shape[1]
    for index, entry in enumerate(file.entries):
        assert entry.spectrum.quantity == quantity
        np.testing.assert_array_equal(entry.spectrum.wavelengths_nm, WAVELENGTHS)
        np.testing.assert_array_equal(entry.spectrum.samples, paints[:, index])


@pytest.mark.parametrize("version", ["4", "5"])
def test_spectra_down_the_columns(saved, paints, version):
    path = saved(version=version, wavelength=WAVELENGTHS, data=paints, comment="Reflectance of paints")
    assert recognises(path, path.read_bytes()[:4096]) and format_of(path).NAME == "MATLAB"
    file = read(path)
    check(file, paints)
    assert file.entries[0].name == "paints 1" and file.details["comment"] == "Reflectance of paints"


def test_spectra_across_the_rows_with_names(saved, paints):
    names = np.array(["red", "green", "blue", "grün", "black"], dtype=object)
    file = read(saved(wl=WAVELENGTHS, reflectance=paints.T, names=names))
    check(file, paints)
    assert [entry.name for entry in file.entries] == list(names)


def test_a_struct_of_power(saved, paints):
    check(read(saved(lamp={"wavelength": WAVELENGTHS, "spd": 100 * paints})), 100 * paints, "emission")


def test_wavelengths_as_first_step_and_count(saved, paints):
    check(read(saved(sur_paints=paints, S_paints=np.array([400.0, 10.0, 31.0]))), paints)


def test_wavelengths_under_another_name_are_said(saved, paints):
    file = read(saved(x=WAVELENGTHS, reflectance=paints))
    check(file, paints)
    assert any("x ascends from 400 to 700 and is taken" in note for note in file.notes)


@pytest.mark.parametrize("names", [("R", "T"), ("T", "R")])
def test_t_beside_r_is_a_transmittance_and_alone_sensitivities(saved, paints, names):
    file = read(saved(wavelength=WAVELENGTHS, **dict.fromkeys(names, paints[:, :1])))
    quantities = {"R": "reflectance", "T": "transmittance"}
    assert [entry.spectrum.quantity for entry in file.entries] == [quantities[name] for name in names]
    with pytest.raises(InputError, match="sensitivities"):
        read(saved(wavelength=WAVELENGTHS, T=paints.T))


def test_version_7_3(tmp_path, paints):
    path = written_7_3(tmp_path / "new.mat", wavelength=WAVELENGTHS[None], data=paints, comment="Reflectance of paints")
    file = read_spectra(path)
    assert file.format == "MATLAB"
    check(file, paints)
    assert file.details["comment"] == "Reflectance of paints"


def test_links_out_of_the_file_are_not_followed(tmp_path, paints, refused):
    other = written_7_3(tmp_path / "other.mat", data=paints)
    path = written_7_3(tmp_path / "paints.mat", wavelength=WAVELENGTHS[None])
    with h5py.File(path, "r+") as file:
        file["data"] = h5py.ExternalLink(str(other), "data")
    lines = refused(read, path.read_bytes(), "again.mat")
    assert lines[:2] == ["again.mat: wavelength: no spectra beside the wavelengths", "  found: wavelength (1 x 31)"]


def test_what_is_missing_names_the_variables(saved, refused, paints):
    lines = refused(read, saved(name="x.mat", a=paints, b=np.eye(3)).read_bytes(), "paints.mat")
    assert lines[0] == "paints.mat: no wavelengths in this MATLAB file"
    assert lines[1] == "  found: a (31 x 5), b (3 x 3)"


def test_one_bad_spectrum_of_many(saved, paints):
    paints[3, 1] = -0.5
    paints[7, 2] = np.nan
    file = read(saved(wavelength=WAVELENGTHS, reflectance=paints))
    assert [name for name, _ in file.rejected] == ["paints 2"]
    assert file.entries[1].details["missing samples"] == "1 of 31"


@pytest.mark.parametrize("length", [130, 200, 700])
def test_damaged_files(saved, refused, paints, length):
    data = saved(name="whole.mat", wavelength=WAVELENGTHS, data=paints).read_bytes()
    assert "MATLAB" in refused(read, data[:length])[0]


@pytest.mark.parametrize(("place", "value"), [(144, 5), (172, 1), (193, 9), (496, 255)])
def test_single_bytes_that_end_the_library_end_no_more_than_its_process(tmp_path, refused, paints, place, value):
    """Each of these ends the process that scipy 1.17 reads in; what asked for the file goes on."""
    scipy.io.savemat(tmp_path / "whole.mat", {"wavelength": WAVELENGTHS, "data": paints})
    held = bytearray((tmp_path / "whole.mat").read_bytes())
    held[place] = value
    assert refused(read, bytes(held), "hurt.mat")[0].startswith("hurt.mat: ")


def test_a_variable_that_claims_to_be_huge(saved, refused):
    held = bytearray(saved(name="small.mat", version="4", wavelength=WAVELENGTHS).read_bytes())
    held[4:12] = np.array([100_000, 100_000], dtype="<i4").tobytes()
    lines = refused(read, bytes(held), "huge.mat")
    assert lines[:2] == ["huge.mat: a variable is too large", "  found: wavelength: 100000 x 100000"]


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("name", "variables", "found"),
    [
        ("XYZ.mat", {"data": 3}, "colour-matching functions"),
        ("a.mat", {"data": 3, "comment": "CIE XYZ"}, "colour-matching functions"),
        ("a.mat", {"xyz1931": 3}, "colour-matching functions"),
        ("stockman.mat", {"data": 3}, "sensitivities of the eye"),
        ("a.mat", {"data": 3, "comment": "Stockman-Sharpe cone fundamentals"}, "sensitivities of the eye"),
        ("a.mat", {"T_cones": 3}, "sensitivities of the eye"),
        ("a.mat", {"den_lens_ssf": 1}, "optical densities"),
        ("a.mat", {"data": 3, "comment": "Nikon D1 spectral sensitivities"}, "sensitivities of a camera"),
    ],
)
def test_what_is_no_colour_is_refused_by_its_name(saved, rng, name, variables, found):
    arrays = {key: rng.random((31, value)) if isinstance(value, int) else value for key, value in variables.items()}
    with pytest.raises(InputError, match="not the spectrum of a colour") as caught:
        read(saved(name, wavelength=WAVELENGTHS, **arrays))
    assert found in str(caught.value.found) and "reflectance" in (caught.value.hint or "")


@pytest.mark.usefixtures("here")
def test_names_that_say_reflectance_count_before_others(saved, paints):
    """Paints of a laboratory called Stockman, and the observer's functions beside them."""
    file = read(saved("xyz.mat", wavelength=WAVELENGTHS, refl_cones=paints, xyz=paints[:, :3], comment="by Stockman"))
    check(file, paints)
    assert any("xyz is left out: colour-matching functions" in note for note in file.notes)


@pytest.mark.usefixtures("here")
def test_statistics_of_reflectances_are_none(saved, paints):
    others = {f"reflectance_{which}": paints for which in ("std", "median", "p95", "CV")}
    file = mat.read(saved(wavelength=WAVELENGTHS, reflectance_mean=paints, **others))
    assert len(file.entries) == len(mat.read(saved(wavelength=WAVELENGTHS, reflectance_mean=paints)).entries)
    assert all(any(f"{name} is left out" in note for note in file.notes) for name in others)


def test_a_light_beside_reflectances(saved, paints):
    file = read(saved(wave=WAVELENGTHS, refl_A=paints, illum=np.linspace(10, 100, 31)))
    assert [entry.spectrum.quantity for entry in file.entries] == ["reflectance"] * 5 + ["emission"]
    assert file.entries[5].spectrum.samples[-1] == 100


@pytest.mark.usefixtures("here")
def test_a_scene_has_its_light_alone(saved, paints):
    """The layout of ISETCam: coefficients of a basis a pixel, and the light in a struct with its own wavelengths."""
    light = {"data": np.linspace(1, 2, 31), "wavelength": WAVELENGTHS}
    basis = {"basis": paints[:, :3], "wave": WAVELENGTHS}
    file = read(saved(mcCOEF=np.zeros((4, 4, 3)), basis=basis, comment="scene", illuminant=light))
    (entry,) = file.entries
    assert entry.spectrum.quantity == "emission" and entry.details["variable"] == "illuminant.data"
    assert any("basis.basis is left out" in note for note in file.notes)


@pytest.mark.usefixtures("here")
def test_wavelengths_that_stand_twice_are_no_spectrum(saved, paints):
    check(read(saved(wavelength=WAVELENGTHS, wave2=WAVELENGTHS, x=WAVELENGTHS, reflectance=paints)), paints)


@pytest.mark.usefixtures("here")
def test_each_struct_has_its_own_wavelengths(saved, paints):
    both = {"a": {"wl": WAVELENGTHS, "refl": paints}, "b": {"wl": WAVELENGTHS + 5, "refl": paints}}
    file = read(saved(**both))
    assert [entry.spectrum.wavelengths_nm[0] for entry in file.entries] == [400] * 5 + [405] * 5
    with pytest.raises(InputError, match="two vectors of wavelengths"):
        read(saved(wl=WAVELENGTHS, wave=WAVELENGTHS + 5, refl=paints))
    spaced = read(saved(sur_b=paints, S_a=np.array([300.0, 10, 31]), S_b=np.array([400.0, 10, 31])))
    check(spaced, paints)


@pytest.mark.usefixtures("here")
def test_an_array_of_structs(saved, paints):
    kinds = [("wl", "O"), ("R", "O"), ("name", "O")]
    rows = np.array([(WAVELENGTHS, paints[:, 0], "red"), (WAVELENGTHS + 5, paints[:, 1], "blue")], dtype=kinds)
    file = read(saved(samples=rows))
    assert [entry.name for entry in file.entries] == ["red", "blue"]
    assert [entry.spectrum.wavelengths_nm[0] for entry in file.entries] == [400, 405]
    np.testing.assert_array_equal(file.entries[1].spectrum.samples, paints[:, 1])


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(("scale", "unit", "hint"), [(1e-9, "metres", "1e9"), (1e-3, "micrometres", "1000")])
def test_wavelengths_in_another_unit_are_named(saved, paints, scale, unit, hint):
    with pytest.raises(InputError, match=f"look like {unit}") as caught:
        read(saved(wavelength=WAVELENGTHS * scale, reflectance=paints))
    assert hint in (caught.value.hint or "")


@pytest.mark.parametrize(
    ("name", "count"), [("Clothes_Vhrel.mat", 41), ("DupontPaintChip_Vhrel.mat", 120), ("Objects_Vhrel.mat", 170)]
)
def test_real_sets(shared_data, name, count):
    path = shared_data / "spectra" / "sets" / name
    file = read_spectra(path)
    assert len(file.entries) == count and not file.rejected and not file.notes
    oracle = scipy.io.loadmat(path)
    for index, entry in enumerate(file.entries):
        assert entry.spectrum.quantity == "reflectance"
        np.testing.assert_array_equal(entry.spectrum.samples, oracle["data"][:, index])
    assert entry.spectrum.wavelengths_nm[[0, -1]].tolist() == [400.0, 700.0]


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("order", ["<", ">"])
def test_version_4_is_known_in_both_orders_of_bytes(tmp_path, order):
    """Five numbers, a name and the columns of each matrix; the thousands of the first number are the order of bytes."""
    spectra = np.linspace(0.1, 0.9, 2 * WAVELENGTHS.size).reshape(WAVELENGTHS.size, 2)
    content = b""
    for name, value in (("wavelength", WAVELENGTHS[:, None]), ("reflectance", spectra)):
        head = np.array([1000 if order == ">" else 0, *value.shape, 0, len(name) + 1], dtype=f"{order}i4")
        content += head.tobytes() + name.encode() + b"\0" + value.astype(f"{order}f8").tobytes(order="F")
    path = tmp_path / "paints.mat"
    path.write_bytes(content)
    assert recognises(path, content[:4096]) and format_of(path).NAME == "MATLAB"
    entries = read_spectra(path).entries
    np.testing.assert_array_equal([entry.spectrum.samples for entry in entries], spectra.T)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("name", "comment"),
    [
        ("daylight.mat", "CIE daylight basis functions"),
        ("cieDaylightBasis.mat", "from the CIE, 1986"),
        ("illuminants.mat", "first three principal components of daylight, spectral power distribution"),
        ("daylight_basis.mat", ""),
    ],
)
def test_basis_functions_are_no_lamps(saved, name, comment):
    path = saved(name, wavelength=WAVELENGTHS, S0=0.5 * WAVELENGTHS[:, None], comment=comment)
    with pytest.raises(InputError, match="not the spectrum of a colour") as caught:
        read(path)
    assert "basis functions" in str(caught.value)


@pytest.fixture
def damage(tmp_path, paints):
    """A file that ends the process that scipy reads it in."""
    scipy.io.savemat(tmp_path / "hurt.mat", {"wavelength": WAVELENGTHS, "data": paints})
    held = bytearray((tmp_path / "hurt.mat").read_bytes())
    held[144] = 5
    (tmp_path / "hurt.mat").write_bytes(held)
    return tmp_path / "hurt.mat"


def test_one_process_reads_many_files_whatever_is_between_them(saved, paints, damage):
    path = saved(wavelength=WAVELENGTHS, reflectance=paints)
    check(read(path), paints)
    process = mat_variables._Reader.process
    assert process is not None
    for _ in range(3):
        with pytest.raises(InputError):
            read(damage)
        check(read(path), paints)
    assert mat_variables._Reader.process is process and process.poll() is None


def test_a_process_that_was_ended_is_started_again(saved, paints):
    path = saved(wavelength=WAVELENGTHS, reflectance=paints)
    read(path)
    process = mat_variables._Reader.process
    assert process is not None
    process.kill()
    check(read(path), paints)
    assert mat_variables._Reader.process is not process


def test_a_file_that_takes_too_long_is_refused_and_the_next_one_read(saved, paints, monkeypatch):
    path = saved(wavelength=WAVELENGTHS, reflectance=paints)
    check(read(path), paints)
    process = mat_variables._Reader.process
    assert process is not None
    monkeypatch.setattr(mat_variables, "PATIENCE", 0.1)
    os.kill(process.pid, signal.SIGSTOP)
    with pytest.raises(InputError, match=r"nothing after 0.1 seconds"):
        read(path)
    monkeypatch.undo()
    check(read(path), paints)


@pytest.mark.parametrize(("machine", "called"), [(2, "VAX D"), (3, "VAX G"), (4, "Cray")])
def test_floats_of_other_machines_are_refused(tmp_path, machine, called):
    """Their bytes would be other numbers here, and nothing in them says so but the type."""

    def variable(name, values):
        head = struct.pack("<5i", 1000 * machine, 1, len(values), 0, len(name) + 1)
        return head + name.encode() + b"\0" + np.asarray(values, "<f8").tobytes()

    path = tmp_path / "red.mat"
    path.write_bytes(variable("wavelength", np.arange(400, 701, 10)) + variable("reflectance", np.full(31, 0.4)))
    with pytest.raises(InputError, match=called):
        mat.read(path)
