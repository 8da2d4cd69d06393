"""A review says what its pictures say: figures recomputed from its files, both renderers, and that it can fail."""

import io
import json
import pickle
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from metamer.calibration.report.row_files import read_rows
from metamer.calibration.report.statistics import compared_pixels
from metamer.lighting.reference.reference import reference_image
from metamer.lighting.scene import Review
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.catalogue.instrument_reading import InstrumentReading
from metamer.materials.records.record import MARKER, write_record
from metamer.runtime.errors import InputError, MetamerError, UnknownNameError
from metamer.runtime.progress import TimeLeft
from metamer.spectral.difference import delta_e_xyz, lab_from_xyz
from metamer.spectral.formats.exr import read_exr
from metamer.spectral.formula import formula
from metamer.spectral.illuminants import illuminant
from metamer.spectral.image import ColourImage
from metamer.spectral.metamerism import Conditions, colour_inconstancy
from metamer.spectral.observers import observer
from metamer.spectral.sample import Sample
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.display.transform import DisplayTransform
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.gl.context import NoGL
from metamer.viewer.render.session import RenderSession
from metamer.viewer.review.expected_work import ReviewWork
from metamer.viewer.review.review import OWN_LIGHT, _dearest_first, review
from metamer.viewer.review.words import colour_chain
from metamer.viewer.software.backend import NumpyBackend, software_session
from pictures import read_xyz_exr
from PIL import Image

ROOT = Path(__file__).resolve().parents[3]
LIGHTS = ("D65", "A", "FL11")


@pytest.fixture(scope="module")
def catalogue(tiny_catalogue):
    return Catalogue.open(tiny_catalogue)


@pytest.fixture(scope="module")
def sphere(scenes):
    """A sphere on which every tiny material is swept."""
    return replace(scenes.sphere_scene("tiny/matt-red", size=40, samples=2), review=Review("part0", ("*",), LIGHTS))


def run(scene, catalogue, out, renderer=None, **options):
    found = review(scene, catalogue, out, renderer=renderer or software_session(), version="test", **options)
    return found, json.loads((out / "review.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def written(sphere, catalogue, tmp_path_factory):
    """Folder and review.json of the whole tiny catalogue under three lights, in numpy, references by two processes."""
    out = tmp_path_factory.mktemp("review")
    seen, left, known = [], TimeLeft(), []

    def progress(*step):
        seen.append(step)
        known.append(left.seconds)

    _, document = run(sphere, catalogue, out, jobs=2, progress=progress, left=left)
    # Something is known of all from the first row on, and nothing is left in the end.
    assert all(seconds is not None and seconds > 0.0 for seconds in known) and left.seconds == 0.0
    assert seen == [(k + 1, 12, row["material"]) for k, row in enumerate(document["results"])]
    return out, document


def picture_of(out, row):
    image, coverage = read_xyz_exr(out / row["files"]["XYZ EXR"])
    return image.values.astype(np.float64), coverage, image.white_xyz


def test_shape_of_review_json(written):
    _, document = written
    assert list(document) == [
        "schema", "metamer", "created", "renderer", "status", "verdict", "facts", "summary", "display",
        "budget_delta_e94", "formula", "plan", "warnings", "colour_chain", "self_check", "protocol", "lights",
        "materials", "results",
    ]  # fmt: skip
    assert document["metamer"] == "test" and document["renderer"] == "software (numpy)"
    assert document["budget_delta_e94"] == 1.0 and document["formula"] == "CIE 1994"
    assert document["status"] == "pass"
    assert set(document["plan"]) == {"basis_size", "reasons"}
    assert len(document["results"]) == 12
    for row in document["results"]:
        assert {"material", "illuminant", "observer", "delta_e94", "image", "seconds"} <= set(row)
        assert list(row["delta_e94"]) == ["mean", "p95", "p99", "max"]
        figures = row["delta_e94"]
        assert 0 < figures["mean"] < figures["p95"] <= figures["p99"] <= figures["max"], row
        assert row["observer"] == "CIE 1931 2 Degree Standard Observer"
        assert set(row["seconds"]) == {"render", "reference", "compare", "write"}
        assert all(seconds > 0 for seconds in row["seconds"].values())
        assert (written[0] / row["image"]).is_file()


def test_documented_fields_are_those_written(written):
    """docs/review_json.md holds a JSON Schema: nothing is missing from it, and nothing is written that it lacks."""
    schema = json.loads(re.search(r"```json\n(.*?)```", (ROOT / "docs/review_json.md").read_text(), re.DOTALL)[1])
    _, document = written

    def check(value, rule, where):
        if value is None:
            assert "null" in rule["type"], where
        elif "properties" in rule:
            assert set(value) == set(rule["properties"]), where
            assert set(rule.get("required", ())) <= set(value), where
            for key, inner in rule["properties"].items():
                check(value[key], inner, f"{where}.{key}")
        elif rule.get("type") == "array" and "items" in rule:
            for k, item in enumerate(value):
                check(item, rule["items"], f"{where}[{k}]")
        elif "enum" in rule:
            assert value in rule["enum"], where

    check(document, schema, "review")


def test_figures_are_those_of_the_pictures_and_the_reference(written, sphere, catalogue):
    """From the files alone: EXR against rays and original data, over lit pixels that the ball covers wholly."""
    out, document = written
    for row in document["results"]:
        sample, coverage, white = picture_of(out, row)
        lit = sphere.with_illuminant(illuminant(row["illuminant"])).with_material("part0", row["material"])
        truth, share = reference_image(lit, None, {row["material"]: catalogue.load(row["material"]).brdf()})
        np.testing.assert_allclose(white, lit.adopted_white(), atol=1e-6)
        delta = delta_e_xyz(truth, sample, lit.adopted_white(), "CIE 1994")
        values = delta[compared_pixels(np.minimum(coverage, share), truth, sample)]
        figures = row["delta_e94"]
        found = [values.mean(), *np.percentile(values, (95, 99)), values.max()]
        # The file holds the very numbers that were compared.
        np.testing.assert_allclose(list(figures.values()), found, rtol=1e-9, err_msg=str(row))
        assert row["pixels"] == values.size


def test_the_worst_pixel_and_its_spectra_are_those_of_the_map(written, catalogue):
    """The spectrum that the original data have there gives, under the light, the colour that the reference has."""
    out, document = written
    spectra = 0
    for row in document["results"]:
        delta_e = read_exr(out / row["files"]["ΔE94 EXR"])[1]["deltaE94"]
        worst = row["worst_pixel"]
        at = tuple(worst["place"])
        assert delta_e[at] == pytest.approx(np.nanmax(np.where(np.isfinite(delta_e), delta_e, np.nan)), rel=1e-6)
        assert worst["delta_e94"] == pytest.approx(delta_e[at], rel=1e-6)
        image, _ = read_xyz_exr(out / row["files"]["reference EXR"])
        lab = lab_from_xyz(image.values[at].astype(np.float64), image.white_xyz)
        np.testing.assert_allclose(worst["reference_lab"], lab, atol=1e-3)
        if worst["wavelengths_nm"] is None:
            continue
        spectra += 1
        nm, factor = (np.array(worst[name]) for name in ("wavelengths_nm", "reference_factor"))
        weights = observer("1931_2").weights(illuminant(row["illuminant"]), nm)
        seen = weights @ factor * (np.array(row["white_xyz"]) / weights.sum(axis=1))
        assert np.abs(lab_from_xyz(seen, np.array(row["white_xyz"])) - lab).max() < 1.5, row["material"]
        assert np.abs(np.array(worst["picture_factor"]) - factor).max() < 0.02
    assert spectra >= 9


def test_reference_and_map_are_files_too(written):
    """What a row says can be found again from its files alone, without a ray."""
    out, document = written
    for row in document["results"]:
        sample, *_ = picture_of(out, row)
        reference, _ = read_xyz_exr(out / row["files"]["reference EXR"])
        _, channels = read_exr(out / row["files"]["ΔE94 EXR"])
        kept = channels["deltaE94"]
        compared = ~np.isnan(kept)
        assert compared.sum() == row["pixels"]
        again = delta_e_xyz(reference.values.astype(np.float64), sample, reference.white_xyz, "CIE 1994")
        np.testing.assert_allclose(again[compared], kept[compared], atol=2e-4)
        figures = [kept[compared].mean(), *np.percentile(kept[compared], (95, 99)), kept[compared].max()]
        np.testing.assert_allclose(list(row["delta_e94"].values()), figures, rtol=1e-5)


def test_headers_say_where_a_picture_comes_from(written, sphere):
    out, document = written
    row = document["results"][1]
    said = {
        "scene": sphere.name,
        "camera": sphere.camera().name,
        "material": row["material"],
        "illuminant": row["illuminant"],
        "observer": row["observer"],
        "renderer": document["renderer"],
        "software": "Metamer test",
    }
    for label, picture in (("XYZ EXR", "sample"), ("reference EXR", "reference"), ("ΔE94 EXR", "CIE 1994")):
        header, _ = read_exr(out / row["files"][label])
        assert {name: header[name] for name in said} == said
        assert header["picture"].startswith(picture)
    words = (out / row["image"]).read_bytes()
    assert all(f"{name}: {text}".encode() in words for name, text in said.items())


def test_rows_hold_the_colour_of_the_original_data(written, catalogue):
    """A matt surface looks alike from everywhere, so its 45:0 reading is its reflectance, integrated."""
    _, document = written
    rows = {row["illuminant"]: row for row in document["results"] if row["material"] == "tiny/matt-red"}
    brdf = catalogue.load("tiny/matt-red").brdf()
    eye = observer("1931_2")
    reflectance = np.pi * brdf.eval(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.6, 0.8]))
    for name, row in rows.items():
        xyz = eye.weights(illuminant(name), brdf.wavelengths_nm) @ reflectance
        np.testing.assert_allclose(row["colour"]["xyz"], xyz, rtol=1e-9)
        np.testing.assert_allclose(row["colour"]["lab"], lab_from_xyz(xyz, np.array(row["white_xyz"])), rtol=1e-9)
        assert row["colour"]["geometry"] == "45a:0"


def test_the_chain_says_how_many_bounces_pictures_have(written, sphere):
    _, document = written
    (sample,) = (words for words in document["colour_chain"] if words.startswith("Sample: "))
    (light,) = (words for words in document["colour_chain"] if words.startswith("Both: "))
    assert "in a basis of at most" in sample and light.endswith("direct light with shadows, no interreflection.")

    def chain(bounces):
        plan = SimpleNamespace(basis_size=8, basis=SimpleNamespace(name="balanced"), precision="half precision")
        scene = replace(sphere, bounces="auto")
        return colour_chain(scene, scene.camera(), bounces, plan, ("A",), (None,), DisplayTransform(), "CPU")

    for bounces, ending in (
        ({0}, "no interreflection."),
        ({1}, "and interreflection, 1 bounce."),
        ({3}, "and interreflection, 3 bounces."),
        ({0, 4, 2}, "and interreflection, 0 to 4 bounces."),
    ):
        words = chain(bounces)
        assert [one for one in words if one.startswith("Both: ") and one.endswith(ending)], bounces
        assert [one for one in words if "in bases of their own, folded" in one]


def test_gl_and_numpy_write_the_same_review(written, sphere, catalogue, gl, tmp_path):
    out, document = written
    renderer = gl_session(gl)
    try:
        _, theirs = run(sphere, catalogue, tmp_path, renderer)
    finally:
        renderer.close()
    assert theirs["renderer"].startswith("OpenGL")
    assert any("ran on the GPU" in words for words in theirs["colour_chain"])
    for mine, other in zip(document["results"], theirs["results"], strict=True):
        sample, coverage, white = picture_of(out, mine)
        again, other_coverage, _ = picture_of(tmp_path, other)
        np.testing.assert_array_equal(coverage, other_coverage)
        delta = delta_e_xyz(sample, again, white, "CIE 1994")
        assert delta.max() < 0.1, (mine["material"], mine["illuminant"], delta.max())
        assert other["delta_e94"]["p99"] == pytest.approx(mine["delta_e94"]["p99"], abs=0.02)


def test_jobs_do_not_change_the_figures(written, sphere, catalogue, tmp_path):
    _, document = written
    _, alone = run(sphere, catalogue, tmp_path, jobs=1, materials=["tiny/rough-blue"], illuminants=["A"])
    (row,) = [r for r in document["results"] if (r["material"], r["illuminant"]) == ("tiny/rough-blue", "A")]
    # The plan is that of its own picture, whatever else is reviewed.
    assert alone["results"][0]["delta_e94"] == pytest.approx(row["delta_e94"], abs=1e-9)


def test_one_light_needs_three_numbers_at_most(sphere, catalogue, tmp_path):
    _, document = run(sphere, catalogue, tmp_path, illuminants=["FL11"])
    assert document["plan"]["basis_size"] <= 3
    assert any("One light and no bounce" in reason for reason in document["plan"]["reasons"])


def test_each_picture_is_planned_by_itself(written):
    """Few colours in it need few coefficients, whatever the other materials of the review are."""
    _, document = written
    assert 1 <= document["plan"]["basis_size"] < 10
    assert "is planned by itself" in document["plan"]["reasons"][0]
    assert any("Peercy" in reason for reason in document["plan"]["reasons"])


@pytest.mark.slow_cases("0.95")
@pytest.mark.parametrize("scale", [1.05, 0.95])
def test_wrong_pack_is_found(sphere, catalogue, tmp_path, scale):
    """5 % too light or too dark is over the budget for every material under every light."""
    folder = tmp_path / "wrong"
    folder.mkdir()
    (folder / MARKER).write_bytes((catalogue.folder / MARKER).read_bytes())
    for material_id in catalogue.ids():
        record = catalogue.load(material_id)
        packs = tuple(pack.recoloured(scale * pack.palette.values[0]) for pack in record.fast.packs)
        write_record(replace(record, fast=replace(record.fast, packs=packs)), folder / f"{material_id}.h5")
    found, document = run(sphere, Catalogue.open(folder), tmp_path / "out", illuminants=["D65", "A"])
    assert found.status == document["status"] == "over"
    for row in document["results"]:
        assert row["delta_e94"]["mean"] > 0.5, row


def test_wrong_light_is_found(written, sphere, catalogue):
    """The trap that a reference of its own is for: a picture under A held against the truth under D65."""
    out, document = written
    rows = {(row["material"], row["illuminant"]): row for row in document["results"]}
    sample, _, white = picture_of(out, rows["tiny/rough-blue", "A"])
    truth, *_ = picture_of(out, rows["tiny/rough-blue", "D65"])
    assert delta_e_xyz(truth, sample, white, "CIE 1994").mean() > 1.0


def test_scene_without_review_judges_each_material_over_its_own_pixels(scenes, catalogue, tmp_path):
    scene = scenes.lamp_scene(size=40, samples=2)
    names = {"gloss": "tiny/satin-green", "sharp": "tiny/copper", "matt": "tiny/matt-red"}
    scene = replace(scene, parts=tuple(replace(part, material=names[part.material]) for part in scene.parts))
    _, document = run(scene, catalogue, tmp_path)
    rows = document["results"]
    assert [(row["material"], row["illuminant"]) for row in rows] == [
        (name, OWN_LIGHT) for name in ("tiny/satin-green", "tiny/copper", "tiny/matt-red")
    ]
    pictures = [picture_of(tmp_path, row) for row in rows]
    for sample, coverage, _ in pictures[1:]:
        np.testing.assert_array_equal(sample, pictures[0][0])
        np.testing.assert_array_equal(coverage, pictures[0][1])
    # Pixels on the edge between two parts belong to neither.
    judged, covered = sum(row["pixels"] for row in rows), int((pictures[0][1] == 1).sum())
    assert 0.5 * covered < judged < covered
    truth, share = reference_image(scene, None, {name: catalogue.load(name).brdf() for name in names.values()})
    whole = compared_pixels(share, truth, pictures[0][0])
    assert judged < whole.sum()
    assert document["status"] == "pass"


def test_swatch_is_seen_in_the_mixture_of_all_lights(scenes, catalogue, tmp_path):
    """Half the light from A, half from D65: a swatch under the first alone would be far too warm for this white."""
    suns = [scenes.sun(name=name) for name in ("A", "D65")]
    scene = replace(scenes.sphere_scene("tiny/copper", size=24, samples=1), lights=tuple(suns))
    found, _ = run(scene, catalogue, tmp_path)
    (row,) = found.rows
    weights = [scene.observer.weights(light.spectrum, row.wavelengths_nm) for light in suns]
    xyz = 0.5 * (weights[0] + weights[1]) @ row.reflectance
    rgb, _ = DisplayTransform().encode(ColourImage(xyz[None, None], "xyz", row.white_xyz))
    np.testing.assert_allclose(row.swatch, 255 * rgb[0, 0], atol=0.5)


def test_other_parts_keep_their_material(scenes, catalogue, tmp_path):
    """What is swept on one part is judged there alone."""
    scene = scenes.lamp_scene(size=32, samples=2)
    parts = tuple(replace(part, material="tiny/matt-red") for part in scene.parts)
    scene = replace(scene, parts=parts, review=Review("part1", ("tiny/copper", "tiny/satin-green"), ("D65",)))
    _, document = run(scene, catalogue, tmp_path)
    first, second = document["results"]
    assert first["pixels"] == second["pixels"] < 150
    one, coverage, _ = picture_of(tmp_path, first)
    other, *_ = picture_of(tmp_path, second)
    same = (one == other).all(axis=-1)
    assert same[coverage == 1].mean() > 0.5 and not same.all()


def test_renderer_that_returns_no_numbers_does_not_pass(sphere, catalogue, tmp_path):
    class Holes(RenderSession):
        def render_many(self, *args):
            found = super().render_many(*args)
            found[0][0][20, 20] = np.nan
            return found

    renderer = Holes(NumpyBackend())
    _, document = run(sphere, catalogue, tmp_path, renderer, materials=["tiny/matt-red"], illuminants=["D65"])
    (row,) = document["results"]
    assert row["undefined_pixels"] == 1
    assert row["status"] == document["status"] == "over"
    assert any("no number" in note for note in row["notes"])


def test_page_shows_every_row_and_loads_nothing(written):
    out, document = written
    page = (out / "index.html").read_text(encoding="utf-8")
    for row in document["results"]:
        assert row["material"] in page
    for target in re.findall(r'(?:src|href)="([^"]*)"', page):
        assert target.startswith(("data:", "#", "pictures/", "review.json")), target


def test_material_that_vanishes_while_references_are_computed(sphere, catalogue, tmp_path, monkeypatch):
    """An error in a worker process comes back as itself, not as a broken pool."""
    record = catalogue.load("tiny/matt-red")
    empty = tmp_path / "empty"
    empty.mkdir()
    (empty / MARKER).write_bytes((catalogue.folder / MARKER).read_bytes())
    monkeypatch.setattr(Catalogue, "load", lambda *_: record)
    monkeypatch.setattr(Catalogue, "match", lambda *_: ("tiny/matt-red", "tiny/copper"))
    with pytest.raises(UnknownNameError, match="unknown material"):
        run(sphere, Catalogue(empty), tmp_path / "out", jobs=2, illuminants=["D65"])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "error",
    [
        InputError("is empty", file="a.csv", field="x", found=3, expected="4", hint="fill it"),
        UnknownNameError("light", "D66", ["D65", "A"], file="scene.toml"),
        NoGL((("EGL", "none"),)),
        MetamerError("said"),
    ],
)
def test_errors_survive_the_way_between_processes(error):
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is type(error) and str(back) == str(error) and vars(back) == vars(error)


def test_a_light_that_nothing_adapts_from_is_named_before_any_work(sphere, catalogue, tmp_path):
    """Low-pressure sodium: two lines, so yellow that Bradford's blue response to them is negative."""
    with pytest.raises(InputError, match=r"illuminant LPS: Bradford adaptation has no meaning for this white"):
        review(sphere, catalogue, tmp_path, illuminants=("D65", "LPS"), renderer=software_session(), version="test")
    assert not list(tmp_path.iterdir())


def test_a_colour_shifts_as_far_as_a_match_says_that_it_is_inconstant(written, catalogue):
    """Rows and materials say the same, for both observers, and adapted to its own light a colour stays as it is."""
    _, document = written
    for one in document["materials"]:
        reading = InstrumentReading.of(catalogue.load(one["id"]).brdf())
        curve = Spectrum.sampled(reading.wavelengths_nm, np.clip(reading.factor, 0.0, 1.0), "reflectance")
        sample = Sample(one["id"], "", (curve,))
        assert len(one["colours"]) == 2 * len(document["lights"])
        for told in one["colours"]:
            eye = next(short for short in ("1931_2", "1964_10") if observer(short).name == told["observer"])
            test = Conditions(told["light"], eye)
            expected = colour_inconstancy(sample, Conditions("D65", eye), test, formula("CIE 2000"))
            assert told["shift"]["delta_e"] == pytest.approx(expected, abs=1e-9)
            if told["light"] == "D65":
                np.testing.assert_allclose(told["adapted_lab"], told["lab"], atol=1e-9)
                assert told["shift"]["words"] == "alike"
        for row in (row for row in document["results"] if row["material"] == one["id"]):
            (same,) = (c for c in one["colours"] if (c["light"], c["observer"]) == (row["illuminant"], row["observer"]))
            assert row["shift"] == same["shift"] and row["colour"]["adapted_lab"] == same["adapted_lab"]
    pictured = {light["name"]: light["pictured"] for light in document["lights"]}
    assert pictured == {"D65": True, "A": True, "FL11": True, "FL2": False, "LED-B3": False}


def test_limits_are_shares_of_the_surface_and_their_mask_says_where(scenes, catalogue, tmp_path):
    """A light twice as bright as the reference cuts what faces it; counted again from the picture in XYZ."""
    scene = scenes.sphere_scene("tiny/satin-green", size=32, samples=2)
    scene = replace(scene, viewing=replace(scene.viewing, reference_illuminance_lux=300.0))
    out, document = tmp_path, run(scene, catalogue, tmp_path, illuminants=["D65"])[1]
    (row,) = document["results"]
    sample, coverage, white = picture_of(out, row)
    whole = coverage >= 0.999
    display = DisplayTransform()
    rgb = display.apply(sample @ display.adaptation_from(white).T)
    low, high = (rgb < -1e-3).any(axis=-1) & whole, (rgb > 1.0 + 1e-3).any(axis=-1) & whole
    assert 0.01 < row["limits"]["above_white"] < 1.0
    assert row["limits"]["below_gamut"] == pytest.approx(low.sum() / whole.sum())
    assert row["limits"]["above_white"] == pytest.approx(high.sum() / whole.sum())
    with Image.open(out / row["files"]["limits PNG"]) as image:
        np.testing.assert_array_equal(np.asarray(image), 1 * low + 2 * high)
        assert np.asarray(image.convert("RGBA"))[..., 3].astype(bool).tolist() == (low | high).tolist()
    assert document["summary"]["above_white"] == 1 and "1 has highlights cut at white" in document["verdict"]


def test_pictures_of_the_page_are_transparent_where_no_surface_is(written):
    out, document = written
    row = read_rows(next(iter((out / "rows").iterdir()))).rows[0]
    _, coverage, _ = picture_of(out, next(one for one in document["results"] if one["image"] == row.image))
    with Image.open(io.BytesIO(row.picture)) as image:
        shown = np.asarray(image)
    np.testing.assert_allclose(shown[..., 3] / 255.0, coverage, atol=0.5 / 255 + 1e-6)
    assert (shown[coverage == 0] == 0).all()
    inside = coverage == 1
    with Image.open(out / row.image) as image:
        np.testing.assert_array_equal(shown[inside, :3], np.asarray(image)[inside, :3])


def test_pictures_may_be_larger_than_what_they_are_compared_by(scenes, catalogue, tmp_path):
    """Figures and maps are those of a review of the smaller size; people see the larger picture."""
    scene = scenes.sphere_scene("tiny/satin-green", size=20, samples=1)
    _, small = run(scene, catalogue, tmp_path / "small", illuminants=["D65"])
    out = tmp_path / "both"
    _, both = run(scene, catalogue, out, illuminants=["D65"], size=48, reference_size=20)
    (one,), (row,) = small["results"], both["results"]
    for key in ("delta_e94", "pixels", "limits", "worst_pixel", "shift_lab"):
        assert row[key] == one[key], key
    with Image.open(out / row["image"]) as image:
        assert image.size == (48, 48)
    assert picture_of(out, row)[0].shape == (20, 20, 3)
    assert any("48 x 48 pixels; reference, map and figures are of 20 x 20" in note for note in row["notes"])
    drawn = read_rows(next(iter((out / "rows").iterdir()))).rows[0]
    sizes = [Image.open(io.BytesIO(file)).size for file in (drawn.picture, drawn.reference, drawn.delta_e_map)]
    assert sizes == [(48, 48), (20, 20), (20, 20)]
    again, _ = run(scene, catalogue, out, illuminants=["D65"], size=48, reference_size=20)
    assert again.resumed == 1
    with pytest.raises(InputError, match="references larger than the pictures"):
        run(scene, catalogue, tmp_path / "none", size=20, reference_size=48)


def test_materials_that_share_their_reference_with_few_are_drawn_first():
    models = {"coat/a": "coated", "coat/b": "coated", "metal/c": "metal", "coat/d": "coated", "matt/e": "matt"}
    setting = SimpleNamespace(records={name: SimpleNamespace(model=model) for name, model in models.items()})
    cases = [SimpleNamespace(judged=(name,)) for name in models]
    assert _dearest_first(setting, cases, range(5)) == [2, 4, 0, 1, 3]
    # Materials that are drawn already do not count: one coat is left.
    assert _dearest_first(setting, cases, [1, 4]) == [1, 4]
    assert _dearest_first(setting, [SimpleNamespace(judged=("coat/a", "metal/c")), *cases[1:2]], [1, 0]) == [0, 1]


def test_a_review_is_expected_before_it_begins(sphere, catalogue, tmp_path):
    """So reviews that follow one another have one time left."""
    left, out = TimeLeft(), tmp_path / "out"
    ReviewWork(out, left).expect_scene(sphere, catalogue, None, ["tiny/matt-red", "tiny/satin-green"], ["D65"], 1)
    ReviewWork(tmp_path / "later", left).expect_scene(sphere, catalogue, None, ["tiny/matt-red"], ["D65"], 1)
    expected = set(left._items)
    assert len(expected) == 2 * 2 + 1 + 2 + 1
    run(sphere, catalogue, out, materials=["tiny/matt-red", "tiny/satin-green"], illuminants=["D65"], left=left)
    assert set(left._items) == expected and left.seconds is not None and left.seconds > 0.0
    assert all(left._items[key].taken is not None for key in expected if key[0] == out)
