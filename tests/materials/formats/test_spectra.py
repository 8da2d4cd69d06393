"""Files of spectra as materials: what is stored, what it is called, what is said of it."""

from types import ModuleType

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.formats import spectra
from metamer.materials.formats.naming import id_word
from metamer.materials.formats.spectra import read_sources
from metamer.materials.intake.importing import import_sources
from metamer.materials.intake.work import fit_material
from metamer.materials.records.models import rebuild
from metamer.materials.records.source import MaterialSource, Rejected
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.formats.registry import SpectralEntry, SpectralFile, StatedColour
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

NM = np.arange(400.0, 701.0, 10.0)


def entry(name="red", values=0.5, quantity="reflectance", nm=NM, **more):
    return SpectralEntry(name, Spectrum.sampled(nm, np.broadcast_to(values, len(nm)), quantity), **more)


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """Sources of a file with these entries, whatever the format."""

    def made(*entries, stem="chart", **more):
        path = tmp_path / f"{stem}.any"
        path.write_bytes(b"content")

        reader = ModuleType("any_format")
        reader.NAME, reader.SUFFIXES = "any format", (".any",)
        reader.read = lambda path: SpectralFile("any format", entries, **more)
        reader.recognises = lambda path, head: head == b"content"
        monkeypatch.setattr(spectra, "format_of", lambda path: reader)
        monkeypatch.setattr(spectra, "readers", lambda: (reader,))
        return list(read_sources(path, "mallett-yuksel"))

    return made


def test_reflectance_becomes_a_diffuse_surface_that_says_so(sources):
    (red,) = sources(entry())
    assert (red.id, red.family, red.model) == ("chart/red", "chart", "lambert")
    np.testing.assert_array_equal(red.parameters["wavelengths_nm"], WORKING_WAVELENGTHS_NM)
    np.testing.assert_allclose(red.parameters["reflectance"], 0.5)
    said = red.provenance
    assert said.kind == "measured" and said.source == "chart.any (any format): red"
    assert "taken to be perfectly diffuse" in said.notes
    assert "known from 400 to 700 nm; from 380 to 780 nm, its end values are repeated" in said.notes
    assert "chart.any: SHA-256 ed7002b4" in said.notes


def test_the_measurement_is_kept_as_it_came(sources):
    colours = (StatedColour("XYZ", np.array([40.0, 41.0, 42.0]), "D50", "1931_2"), StatedColour("Lab", np.ones(3)))
    nm = np.array([402.5, 431.0, 700.25])
    (red,) = sources(
        entry(nm=nm, stated=colours, details={"geometry": "45:0", "condition": "M1"}), details={"instrument": "i1"}
    )
    kept = red.original
    np.testing.assert_array_equal(kept["wavelengths_nm"], nm)
    np.testing.assert_array_equal(kept["values"], np.full(3, 0.5))
    assert kept["quantity"] == "reflectance" and kept["name"] == "red" and kept["format"] == "any format"
    assert (kept["stated.0.space"], kept["stated.0.illuminant"], kept["stated.0.observer"]) == ("XYZ", "D50", "1931_2")
    np.testing.assert_array_equal(kept["stated.0.values"], [40.0, 41.0, 42.0])
    assert kept["stated.1.space"] == "Lab" and "stated.1.illuminant" not in kept
    assert (kept["details.geometry"], kept["details.condition"], kept["file.instrument"]) == ("45:0", "M1", "i1")
    assert red.provenance.geometry == "45:0"


@pytest.mark.parametrize("quantity", ["transmittance", "emission", "radiance factor"])
def test_what_is_no_reflectance_is_kept_without_a_surface(sources, quantity):
    (found,) = sources(entry(quantity=quantity, values=0.9))
    assert found.model == quantity.replace(" ", "_") and not found.parameters
    assert "diffuse" not in found.provenance.notes


def test_every_quantity_is_stored_and_comes_back(sources, tmp_path, monkeypatch):
    entries = [entry(quantity=q, name=q) for q in ("reflectance", "transmittance", "emission", "radiance factor")]
    sources(*entries)
    report = import_sources([tmp_path / "chart.any"], tmp_path / "cat", jobs=1)
    assert [outcome.status for outcome in report.outcomes] == ["imported"] * 4, report.outcomes
    catalogue = Catalogue.open(tmp_path / "cat")
    assert not any(catalogue.verify().values())
    for each in entries:
        record = catalogue.load(f"chart/{id_word(each.name)}")
        assert record.quantity == each.name and record.is_surface == (each.name == "reflectance")
        np.testing.assert_array_equal(record.measured_spectrum().samples, each.spectrum.samples)
        np.testing.assert_array_equal(record.measured_spectrum().wavelengths_nm, each.spectrum.wavelengths_nm)


def test_names_that_stand_twice_are_numbered_and_that_is_noted(sources):
    found = sources(entry("Red"), entry("red"), entry("red-2"), entry("RED"))
    assert [each.id for each in found] == ["chart/red", "chart/red-2", "chart/red-2-2", "chart/red-3"]
    assert "named 'red' in the file, as another sample is" in found[1].provenance.notes
    assert "as another sample" not in found[0].provenance.notes
    assert [each.original["name"] for each in found] == ["Red", "red", "red-2", "RED"]


@pytest.mark.parametrize(
    "name", ["赤", "Красный", "🎨", "赤 1", "x" * 300, "..", "a/../../b", "ΔE", "null\0", "\ud800"]
)
def test_any_name_gives_an_id_that_is_a_path(sources, name):
    first, second = sources(entry(name))[0], sources(entry(name))[0]
    family, _, word = first.id.partition("/")
    assert family == "chart" and word.replace("-", "").isalnum() and word.isascii() and len(word) < 100
    assert first.id == second.id and first.original["name"]


def test_names_that_differ_beyond_latin_letters_stay_apart():
    assert len({id_word(name) for name in ("赤 1", "青 1", "1", "Красный 1")}) == 4
    assert id_word("Crème") == id_word("Cre\u0300me") == "creme"


def test_samples_without_a_name_are_numbered(sources):
    assert [each.id for each in sources(entry(""), entry("  "))] == ["chart/sample-1", "chart/sample-2"]


@pytest.mark.parametrize(
    ("nm", "said"), [(np.array([550.0]), "1 wavelengths"), (np.linspace(900.0, 2500.0, 9), "900 to 2500 nm")]
)
def test_reflectance_beyond_the_visible_is_refused(sources, nm, said):
    good, bad = sources(entry("good"), entry("bad", nm=nm))
    assert isinstance(good, MaterialSource) and isinstance(bad, Rejected)
    assert bad.name == "chart/bad" and "no spectrum of visible light" in str(bad.reason) and said in str(bad.reason)


@pytest.mark.parametrize(("ends", "share"), [((700, 1000), "100 %"), ((550, 560), "100 %"), ((440, 650), "25 %")])
def test_no_colour_is_made_up_for_what_was_not_measured(sources, ends, share):
    narrow, enough = sources(entry("narrow", nm=np.linspace(*ends, 5)), entry("enough", nm=np.linspace(430, 650, 5)))
    assert isinstance(enough, MaterialSource)
    assert isinstance(narrow, Rejected) and "too little of the visible light was measured" in str(narrow.reason)
    assert f"found: {ends[0]} to {ends[1]} nm; beyond lies {share}" in str(narrow.reason)


@pytest.mark.parametrize("quantity", ["transmittance", "emission", "radiance factor"])
def test_too_little_of_the_visible_is_refused_whatever_it_is(sources, quantity):
    (found,) = sources(entry(quantity=quantity, nm=np.linspace(450.0, 560.0, 5)))
    assert isinstance(found, Rejected) and "too little of the visible light" in str(found.reason)


def test_a_light_may_end_where_it_is_dark(sources):
    """What was measured from 500 to 600 nm of a green laser is all of it; of a lamp cut there, it is not."""
    laser = np.exp(-0.5 * ((np.linspace(500.0, 600.0, 101) - 532.0) / 3.0) ** 2)
    (found,) = sources(entry(quantity="emission", nm=np.linspace(500.0, 600.0, 101), values=laser))
    assert isinstance(found, MaterialSource)
    (cut,) = sources(entry(quantity="emission", nm=np.linspace(500.0, 600.0, 101), values=laser + 0.1))
    assert isinstance(cut, Rejected)


def test_a_plan_says_where_the_samples_end(tmp_path):
    path = tmp_path / "tile.csv"
    path.write_text("nm,R (%)\n" + "".join(f"{nm},50\n" for nm in range(380, 648)))
    (found,) = read_sources(path, "mallett-yuksel")
    assert found.taken == "reflectance in percent, by the heading 'R (%)'; known from 380 to 647 nm only"


def test_a_text_that_nobody_recognises_is_no_table(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("Spectrum from 380 to 730 nm in 36 steps\n1.0000, 1.8286, 2.6571\n")
    with pytest.raises(InputError, match="no table of wavelengths and values"):
        list(read_sources(path, "mallett-yuksel"))


def test_entries_that_the_reader_rejects_are_passed_on(sources):
    found = sources(entry(), rejected=(("green", InputError("negative reflectance")),))
    assert [each.name for each in found if isinstance(each, Rejected)] == ["chart/green"]


def test_notes_of_the_file_are_in_every_record(sources):
    (red,) = sources(entry(), notes=("percent, divided by 100",))
    assert "percent, divided by 100" in red.provenance.notes


@pytest.mark.parametrize(("key", "licence"), [("licence", "CC0"), ("Copyright", "Me, 2026"), ("other", None)])
def test_licence_that_the_file_states(sources, key, licence):
    (red,) = sources(entry(), details={key: licence or "x"})
    assert red.provenance.licence == (licence or "not stated in the file")


EVERY = np.arange(360.0, 831.0)


def test_what_is_measured_more_finely_than_the_working_grid_stays_the_truth(sources):
    """The original that pictures are compared with has every sample: review, fit and record see it as measured."""
    fine = 0.2 + 0.1 * np.sin(EVERY / 30) + 0.01 * np.random.default_rng(1).normal(size=EVERY.size)
    (one,) = sources(SpectralEntry("noisy", Spectrum.sampled(EVERY, fine)))
    np.testing.assert_array_equal(one.parameters["wavelengths_nm"], EVERY)
    np.testing.assert_allclose(one.parameters["reflectance"], fine, rtol=1e-12)
    assert "finer than 5 nm" in one.provenance.notes and "every sample" in one.provenance.notes
    done = fit_material(one, 0.5)
    light, eye = illuminant("FL11"), observer("1931_2")
    truth, shown = (
        eye.weights(light, EVERY) @ fine,
        done.fast.packs[0].palette.folded(Folding(eye, [light], np.pi))[0, 0],
    )
    assert delta_e_xyz(truth, shown, eye.white(light)) < 0.1
    np.testing.assert_array_equal(done.fast.packs[0].palette.basis.wavelengths_nm, WORKING_WAVELENGTHS_NM)


def test_only_what_is_seen_of_a_long_measurement_is_shaded_and_all_of_it_is_kept(sources):
    nm = np.arange(250.0, 2501.0)
    (one,) = sources(entry(nm=nm))
    kept = one.parameters["wavelengths_nm"]
    assert kept[0] < 360 and kept[-1] > 830 and len(kept) < 480
    np.testing.assert_array_equal(one.original["wavelengths_nm"], nm)


def test_an_edge_that_no_5_nm_hold_is_declared(sources):
    """The error is against the measurement, not against what the working wavelengths made of it."""
    edge = np.where(EVERY < 547, 0.02, 0.95)
    (one,) = sources(SpectralEntry("cut-off", Spectrum.sampled(EVERY, edge)))
    done = fit_material(one, 0.5)
    assert done.fast is not None
    sphere = sphere_protocol(128).under(done.fast.error.light)
    brdf = rebuild(one.model, one.parameters)
    white = illuminant_white(done.fast.error.light)
    expected = delta_e_xyz(sphere.reference(brdf), sphere.sample(done.fast), white)
    assert done.fast.error.maximum == pytest.approx(expected.max(), abs=1e-9)
    assert done.fast.error.maximum > 0.05
    assert min(pack.palette.values[0].min() for pack in done.fast.packs) >= 0
    assert max(pack.palette.values[0].max() for pack in done.fast.packs) <= 1 / np.pi


def illuminant_white(name):
    return observer("1931_2").white(illuminant(name))
