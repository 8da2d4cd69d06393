"""The shipped catalogue: every table has its origin and hash, and says what its origin says."""

import hashlib
import re
import tomllib

import numpy as np
import pytest
from metamer.materials.analytic import MODELS
from metamer.materials.analytic.glossmeter import gloss_of
from metamer.materials.catalogue.shipped import shipped_sources
from metamer.materials.formats.family_tables import tables_from
from metamer.materials.intake.sources import read_sources
from metamer.materials.records.models import rebuild
from metamer.materials.records.record_colour import colour_folding, radiance_factor_45_0
from metamer.materials.records.source import Rejected
from metamer.spectral.colour_library import colour_science
from metamer.spectral.formats.csv import read_csv_spectra

SHIPPED = shipped_sources()
MANIFEST = SHIPPED / "sources.toml"
TABLES = tomllib.loads(MANIFEST.read_text(encoding="utf-8"))
FILES = {name: entry for name, entry in TABLES.items() if "file" in entry}
#: Gloss units at 60 degrees that a word in a paint's name stands for.
FINISHES = {"matte": (0.0, 10.0), "satin": (20.0, 40.0), "gloss": (70.0, 95.0)}


@pytest.fixture(scope="module")
def materials():
    return read_sources(SHIPPED)


def test_every_shipped_material_can_be_built(materials):
    assert not [f"{found.name}: {found.reason}" for found in materials if isinstance(found, Rejected)]
    ids = [material.id for material in materials]
    assert len(set(ids)) == len(ids)
    assert sum(material_id.startswith("colorchecker/") for material_id in ids) == 72
    families = {material_id.split("/")[0] for material_id in ids}
    assert {"colorchecker", "paint", "plastic", "metal"} <= families


def test_three_finishes_of_every_patch(materials):
    ids = {material.id for material in materials}
    patches = {match[1] for material_id in ids if (match := re.fullmatch("colorchecker/(.*)-matte", material_id))}
    assert len(patches) == 24
    assert {f"colorchecker/{patch}-{finish}" for patch in patches for finish in ("satin", "gloss")} <= ids


@pytest.mark.parametrize("finish", ["matte", "satin", "gloss"])
def test_patches_read_as_the_chart_does(materials, finish):
    """At its own 45:0: neither the coat's share of a reading nor shadows of a rough surface are the body's colour."""
    table = tables_from(TABLES, MANIFEST)["babelcolor"]
    named = {material.id: material for material in materials}
    for column in table.columns:
        material = named[f"colorchecker/{column}-{finish}"]
        chart = table.spectrum(column).resampled(material.parameters["wavelengths_nm"])
        read = radiance_factor_45_0(rebuild(material.model, material.parameters))
        np.testing.assert_allclose(read, chart.samples, rtol=1e-9)


def test_names_of_paints_agree_with_the_glossmeter(materials):
    named = 0
    for material in materials:
        finish = material.id.rpartition("-")[2]
        if finish in FINISHES:
            # Every eighth wavelength: gloss has no colour.
            few = {name: value if np.ndim(value) == 0 else value[::8] for name, value in material.parameters.items()}
            surface = rebuild(material.model, few)
            least, most = FINISHES[finish]
            assert least <= gloss_of(surface, colour_folding(), 0.0).units <= most, material.id
            named += 1
    assert named == 75


def test_every_material_says_where_it_comes_from(materials):
    for material in materials:
        assert len(material.provenance.source) > 20, material.id
        assert material.provenance.licence != "that of the description", material.id
        assert material.provenance.kind == "analytic"


def test_every_file_is_in_the_manifest_and_the_other_way_round():
    listed = {entry["file"] for entry in FILES.values()}
    present = {path.relative_to(SHIPPED).as_posix() for path in SHIPPED.rglob("*.csv")}
    assert listed == present
    assert not [path for path in SHIPPED.rglob("*") if path.is_file() and path.suffix not in (".csv", ".toml")]


@pytest.mark.parametrize("name", FILES)
def test_hash_of_a_file_is_that_of_the_manifest(name):
    data = (SHIPPED / FILES[name]["file"]).read_bytes()
    assert hashlib.sha256(data).hexdigest() == FILES[name]["sha256"]


@pytest.mark.parametrize("name", TABLES)
def test_every_table_may_be_redistributed_or_is_read_from_its_package(name):
    licence = TABLES[name]["licence"]
    assert any(word in licence for word in ("CC0", "public domain", "BSD-3-Clause"))
    assert TABLES[name]["sha256"]


def test_colorchecker_is_that_of_colour_science():
    table = tables_from(TABLES, MANIFEST)["babelcolor"]
    expected = colour_science().SDS_COLOURCHECKERS["BabelColor Average"]
    assert len(table.columns) == 24
    for column, patch in zip(table.columns, expected.values(), strict=True):
        np.testing.assert_array_equal(table.spectrum(column).samples, patch.values)


def test_munsell_chips_are_those_of_colour_science():
    from colour.quality.datasets.vs import SDS_VS

    shipped = read_csv_spectra(SHIPPED / FILES["munsell"]["file"])
    for spectrum, sample in zip(shipped.values(), SDS_VS["NIST CQS 9.0"].values(), strict=True):
        np.testing.assert_array_equal(spectrum.wavelengths_nm, sample.wavelengths)
        np.testing.assert_allclose(spectrum.samples, sample.values, atol=5e-7)


@pytest.mark.parametrize(("name", "b", "c"), [("pmma", 1.1819, 0.011313), ("polycarbonate", 1.4182, 0.021304)])
def test_polymer_index_follows_its_sellmeier_formula(name, b, c):
    index = read_csv_spectra(SHIPPED / FILES[name]["file"], "emission")["n"]
    um2 = (index.wavelengths_nm / 1000) ** 2
    np.testing.assert_allclose(index.samples, np.sqrt(1 + b * um2 / (um2 - c)), atol=6e-6)


@pytest.mark.parametrize(
    ("metal", "at_nm", "reflectance"),
    [("gold", 450, 0.40), ("gold", 650, 0.96), ("copper", 650, 0.95), ("aluminium", 550, 0.92)],
)
def test_normal_reflectance_of_the_metals_is_the_known_one(metal, at_nm, reflectance):
    table = read_csv_spectra(SHIPPED / FILES[metal]["file"], "emission")
    n, k = (np.interp(at_nm, table[key].wavelengths_nm, table[key].samples) for key in ("n", "k"))
    assert ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2) == pytest.approx(reflectance, abs=0.02)


def test_albedo_of_every_material_stays_physical(materials):
    """A white that sends back more light than it got would be a wrong table, scale or weight."""
    models = {model.NAME: model for model in MODELS}
    u = (np.arange(48) + 0.5) / 48
    sin2, phi = np.meshgrid(u, 2 * np.pi * u)
    wo = np.stack([np.sqrt(sin2) * np.cos(phi), np.sqrt(sin2) * np.sin(phi), np.sqrt(1 - sin2)], axis=-1).reshape(-1, 3)
    for material in materials:
        parameters = dict(material.parameters)
        brdf = models[material.model].from_parameters(parameters.pop("wavelengths_nm"), parameters)
        albedo = np.pi * brdf.eval(np.array([0.0, 0.6, 0.8]), wo).mean(axis=0)
        assert 0 < albedo.max() < 1.02 * brdf.ALBEDO_BOUND, material.id
