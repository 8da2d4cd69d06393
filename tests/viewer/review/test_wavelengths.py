"""Reviews of materials on wavelengths of their own: fluorescent ones, and ones measured every nanometre."""

import json
from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.mesh import shapes
from metamer.lighting.scene import Review
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.protocol import measured
from metamer.materials.intake.importing import import_sources
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.record import MARKER, write_record
from metamer.spectral.bispectral import fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.illuminants import illuminant
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.review.review import review
from metamer.viewer.software.backend import software_session

LIGHTS = ("D65", "A", "FL11")


def run(scene, catalogue, out, renderer=None, **options):
    review(scene, catalogue, out, renderer=renderer or software_session(), version="test", **options)
    return json.loads((out / "review.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("kind", ["numpy", "GL"])
def test_a_fluorescent_material_of_31_wavelengths_beside_one_of_81(kind, tiny_catalogue, scenes, tmp_path, request):
    """Swept one after another, and side by side in one picture; both packs are shown within the budget of the plan."""
    grid = np.arange(400.0, 701.0, 10.0)
    bump = (np.exp(-(((grid - centre) / 35.0) ** 2)) for centre in (440.0, 530.0))
    dye = FluorescentLambert(fluorophore(Spectrum.sampled(grid, 0.2 + 0.0 * grid), 0.6 * next(bump), next(bump), 0.9))
    provenance = Provenance("a test", "none", "analytic")
    record = MaterialRecord("tiny/dye", "tiny", dye.NAME, dye.parameters(), provenance, measured(dye.own_form(), dye))
    plain = Catalogue.open(tiny_catalogue).load("tiny/matt-red")
    folder = tmp_path / "catalogue"
    folder.mkdir()
    (folder / MARKER).write_text("schema = 2\n")
    for one in (record, plain):
        write_record(one, folder / f"{one.id}.h5")
    renderer = software_session() if kind == "numpy" else gl_session(request.getfixturevalue("gl"))
    swept = replace(scenes.sphere_scene("tiny/dye", 32, 2), review=Review("part0", ("*",), LIGHTS))
    balls = [
        (shapes.sphere(4, 0.5).transformed(np.eye(4) + np.array([[0, 0, 0, x]] + 3 * [[0.0] * 4])), material)
        for x, material in ((-0.5, "tiny/dye"), (0.5, "tiny/matt-red"))
    ]
    both = scenes.scene_of(balls, [scenes.sun()], swept.camera())
    for scene, out in ((swept, tmp_path / "swept"), (both, tmp_path / "both")):
        names = LIGHTS if scene is both else None
        document = run(scene, Catalogue.open(folder), out, renderer, illuminants=names)
        assert document["status"] == "pass"
        rows = document["results"]
        assert {(row["material"], row["illuminant"]) for row in rows} == {
            (material, light) for material in ("tiny/dye", "tiny/matt-red") for light in LIGHTS
        }
        assert all(row["delta_e94"]["max"] < 0.2 for row in rows if row["material"] == "tiny/dye"), rows


def test_a_review_sees_every_nanometre_that_was_measured(scenes, tmp_path):
    """The reference is the measurement; a picture from packs on 5 nm is compared with that, and says what it lacks."""
    table = tmp_path / "dyes.csv"
    nm = np.arange(380, 781)
    noise = 0.02 * np.random.default_rng(4).normal(size=nm.size)
    rows = [
        f"{at},{value:.6f},{edge:.2f}"
        for at, value, edge in zip(nm, 0.4 + noise, 0.05 + 0.9 * (nm >= 547), strict=True)
    ]
    table.write_text("\n".join(["wavelength_nm,noisy,edge", *rows]) + "\n")
    answer = ImportOptions("reflectance", "fraction")
    report = import_sources([table], tmp_path / "catalogue", jobs=1, answer=answer)
    assert {outcome.status for outcome in report.outcomes} == {"imported"}
    catalogue = Catalogue.open(tmp_path / "catalogue")
    for material_id in ("dyes/noisy", "dyes/edge"):
        np.testing.assert_array_equal(catalogue.load(material_id).brdf().wavelengths_nm, nm)
    scene = replace(scenes.sphere_scene("dyes/noisy", 32, 2), review=Review("part0", ("*",), ("D65", "FL11")))
    document = run(scene, catalogue, tmp_path / "out")
    found = {(row["material"], row["illuminant"]): row["delta_e94"]["max"] for row in document["results"]}
    eye = scene.observer
    for (material_id, light), figure in found.items():
        record = catalogue.load(material_id)
        spectrum = record.measured_spectrum()
        white = eye.white(illuminant(light))
        truth = eye.weights(illuminant(light), spectrum.wavelengths_nm) @ spectrum.samples
        shown = np.pi * record.summands[0].palette.folded(Folding(eye, [illuminant(light)]))[0, 0]
        assert figure == pytest.approx(delta_e_xyz(truth, shown, white), rel=0.3, abs=0.02), (material_id, light)
    assert found["dyes/noisy", "D65"] < 0.03 and found["dyes/edge", "FL11"] > 0.1
