"""MaterialX files: their structure, their numbers beside the BRDF and beside Mitsuba's, and what is refused."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from metamer.materials.analytic import CoatedDiffuse, CookTorrance, Lambert, MetallicRoughness, OrenNayar
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.export.files import export
from metamer.materials.formats import materialx_writer
from metamer.materials.formats.materialx_writer import BAR, open_pbr, open_pbr_xyz
from metamer.materials.formats.open_pbr import OpenPbr, dielectric_albedo
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.runtime.errors import InputError
from metamer.spectral.colour_library import colour_science
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.spectrum import Spectrum

NM = np.arange(380.0, 781.0, 5.0)
RAMP = np.linspace(0.1, 0.8, NM.size)
SAID = Provenance("measured by us -- twice", "CC0", "measured", "45:0", "")


def spectrum(values):
    return Spectrum.sampled(NM, values + 0.0 * NM)


def band(low, high, level=0.95):
    return spectrum(np.where((low <= NM) & (high >= NM), level, 0.0))


def metal(distribution="ggx", weight=1.0):
    return CookTorrance(spectrum(0.3), 0.3 + 1e-3 * (NM - 380), 3.0 + 0.0 * NM, 0.2, weight, distribution, "smith")


COPPERY = MetallicRoughness(spectrum(0.0), spectrum(RAMP), 1.0, 0.1)
#: Name, surface and the largest mean of ΔE94.
WRITTEN = [
    ("lambert", Lambert(spectrum(RAMP)), 1e-3),
    ("rough", OrenNayar(spectrum(RAMP), 0.35), 0.4),
    ("metal", metal(), 0.1),
    ("dark metal", replace(metal(), eta=3.2 + 0.0 * NM, k=1.5 + 0.0 * NM), 0.02),
    ("glTF's metal", COPPERY, 1e-3),
    ("glTF's plastic", MetallicRoughness(spectrum(RAMP), spectrum(0.04), 1.0, 0.3), 0.6),
    ("a coat", replace(COPPERY, alpha=0.2, coat=1.0, coat_alpha=0.01), 0.8),
    ("a coat on matt", MetallicRoughness(spectrum(0.9), spectrum(0.0), 0.0, 0.4, 0.3, 0.02), BAR),
    ("outside Rec.709", Lambert(band(500, 560)), 1e-3),
]


def of(name, brdf):
    parameters = {**brdf.parameters(), "wavelengths_nm": NM}
    return MaterialRecord(name, "x", brdf.NAME, parameters, SAID, None, "abc", {})


@pytest.mark.parametrize("name, brdf, most", WRITTEN, ids=[row[0] for row in WRITTEN])
def test_written_numbers_look_like_the_surface(name, brdf, most):
    written = open_pbr(name, brdf)
    assert written.error.mean <= min(most, BAR) and written.error.light == "D65"
    sphere = sphere_protocol(48, True)
    ours, theirs = sphere.reference(brdf), open_pbr_xyz(written.surface, written.space, sphere)
    assert sphere.differences(ours, theirs).mean() <= 1.1 * most
    if most < 0.01:
        np.testing.assert_allclose(theirs, ours, atol=2e-6 * ours.max())
    numbers = [*written.surface.base_color, *written.surface.specular_color, written.surface.specular_roughness]
    assert min(numbers) >= 0.0 and max(numbers) <= 1.0


def test_a_colour_outside_rec709_is_written_in_acescg_and_said():
    inside, outside = open_pbr("grey", Lambert(spectrum(0.5))), open_pbr("green", Lambert(band(500, 560)))
    assert inside.space == "lin_rec709" and not any("Rec.709" in note for note in inside.notes)
    assert outside.space == "acescg" and any("lies outside Rec.709" in note for note in outside.notes)
    np.testing.assert_allclose(inside.surface.base_color, 0.5, atol=1e-6)


def test_acescg_is_that_of_others():
    colour = colour_science()
    spaces = colour.RGB_COLOURSPACES
    theirs = colour.matrix_RGB_to_RGB(spaces["ACEScg"], spaces["sRGB"], "Bradford")
    np.testing.assert_allclose(materialx_writer._REC709_FROM_ACESCG, theirs, atol=1e-3)


@pytest.mark.parametrize(
    "brdf, found",
    [
        (CoatedDiffuse(spectrum(RAMP), 1.5, 0.06), "OpenPBR has no numbers for this surface\n  found: coated_diffuse"),
        (metal(weight=0.3), "specular_weight 0.3"),
        (metal("beckmann"), "facets of GGX alone\n  found: beckmann"),
        (MetallicRoughness(spectrum(RAMP), spectrum(RAMP), 1.0, 0.2), "these facets over a body"),
        (replace(COPPERY, alpha=0.01, coat=1.0, coat_alpha=0.2), "rougher than it is"),
        (MetallicRoughness(spectrum(RAMP), spectrum(0.0), 0.0, 0.4, 1.0, 0.02), "it would look different"),
        (Lambert(band(510, 520)), "outside ACEScg"),
    ],
)
def test_what_openpbr_cannot_say_is_refused_by_name(tmp_path, brdf, found):
    with pytest.raises(InputError) as caught:
        export([of("x/it", brdf)], "materialx", tmp_path / "out.mtlx")
    text = str(caught.value)
    assert found in text and "x/it" in text and "--format mitsuba" in text and not list(tmp_path.iterdir())


@pytest.fixture
def file(tmp_path):
    """A file of three materials, one of whose names another one's becomes."""
    materials = [of("x/it", metal()), of("x-it", COPPERY), of("2/matt", Lambert(spectrum(RAMP)))]
    (done,) = export(materials, "materialx", tmp_path / "out.mtlx")
    assert any("spectra are in out.spectra.csv" in note for note in done.notes)
    assert sum("off by ΔE94" in note for note in done.notes) == 3
    return done.path


def test_a_file_has_a_surface_and_spectra_for_each_material(file):
    root = ElementTree.parse(file).getroot()
    assert (root.tag, root.get("version"), root.get("colorspace")) == ("materialx", "1.39", "lin_rec709")
    names = [one.get("name") for one in root]
    assert len(set(names)) == len(names) and all(name.isidentifier() for name in names)
    assert [one.get("uiname") for one in root.iter("surfacematerial")] == ["x/it", "x-it", "2/matt"]
    entries = {entry.name: entry.spectrum for entry in read_spectra(file.with_name("out.spectra.csv")).entries}
    for material in root.iter("surfacematerial"):
        shader = root.find(f"open_pbr_surface[@name='{material.find('input').get('nodename')}']")
        for one in shader:
            assert (one.get("colorspace") is None) == (one.get("type") == "float")
        assert material.get("metamer_spectra") == "out.spectra.csv"
        assert entries[material.get("metamer_spectra_column")].samples.shape == NM.shape
        assert "CC0" in material.get("doc") and "off by ΔE94" in material.get("doc")
    np.testing.assert_array_equal(entries["2/matt"].samples, RAMP)


def test_the_package_of_materialx_finds_nothing_wrong(file):
    materialx = pytest.importorskip("MaterialX")
    library, document = materialx.createDocument(), materialx.createDocument()
    materialx.loadLibraries(materialx.getDefaultDataLibraryFolders(), materialx.getDefaultDataSearchPath(), library)
    materialx.readFromXmlFile(document, str(file))
    document.setDataLibrary(library)
    assert document.validate() == (True, "")
    assert len(document.getMaterialNodes()) == 3
    for material in document.getMaterialNodes():
        (shader,) = materialx.getShaderNodes(material)
        inputs = [one.getName() for one in shader.getInputs()]
        assert inputs and all(shader.getNodeDef().getActiveInput(name) for name in inputs)
        assert shader.getInput("base_color").getActiveColorSpace() in ("lin_rec709", "acescg")


def test_facets_reflect_no_more_than_there_is():
    cosines = np.array([0.1, 0.5, 1.0])
    for ior, alpha in ((1.5, 0.01), (1.5, 0.5), (3.0, 0.1)):
        albedo = dielectric_albedo(cosines, ior, alpha)
        assert (albedo > 0.0).all() and (albedo < 1.0).all() and albedo[0] > albedo[2]
    np.testing.assert_allclose(dielectric_albedo(np.ones(1), 1.5, 0.01), 0.04, rtol=1e-3)
    # A matt body gives back what a white one gets, however rough.
    rng = np.random.default_rng(0)
    turn, height = 2.0 * np.pi * rng.random(200000), np.sqrt(rng.random(200000))
    side = np.sqrt(1.0 - height**2)
    wi = np.stack([side * np.cos(turn), side * np.sin(turn), height], axis=1)
    wo = np.broadcast_to([np.sin(1.0), 0.0, np.cos(1.0)], wi.shape)
    white = OpenPbr((1.0, 1.0, 1.0), base_diffuse_roughness=0.7, specular_weight=0.0)
    np.testing.assert_allclose(np.pi * white.eval(wi, wo).mean(axis=0), 1.0, atol=0.005)


@pytest.mark.mitsuba
@pytest.mark.parametrize("brdf", [COPPERY, Lambert(spectrum(RAMP))], ids=["metal", "matt"])
def test_numbers_mean_to_mitsuba_what_they_mean_here(brdf):
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    surface = open_pbr("x", brdf).surface
    colour = {"type": "rgb", "value": list(surface.base_color)}
    principled = {"type": "principled", "base_color": colour, "metallic": surface.base_metalness}
    principled |= {"roughness": surface.specular_roughness}
    plugin = mitsuba.load_dict(principled if surface.base_metalness else {"type": "diffuse", "reflectance": colour})
    for light, view in ((0.2, 0.3), (1.0, 0.9), (0.6, -0.4)):
        wi, wo = (np.array([[np.sin(angle), 0.0, np.cos(angle)]]) for angle in (light, -view))
        seen = mitsuba.SurfaceInteraction3f()
        seen.wi = mitsuba.Vector3f(*wo[0])
        value = np.asarray(plugin.eval(mitsuba.BSDFContext(), seen, mitsuba.Vector3f(*wi[0])))
        np.testing.assert_allclose(value / wi[0, 2], surface.eval(wi, wo)[0], rtol=2e-3)


def test_the_bar_is_held(monkeypatch):
    monkeypatch.setattr(materialx_writer, "BAR", 1e-9)
    with pytest.raises(InputError, match="it would look different"):
        open_pbr("x", metal())
