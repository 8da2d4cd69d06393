"""`import metamer`: the names that scripts need, loaded when they are asked for."""

import ast
import os
import re
import subprocess
import sys
import warnings
from dataclasses import replace
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import metamer
import numpy as np
import pytest
from metamer.materials.records.record import MARKER
from metamer.materials.records.record_head import read_head
from metamer.runtime.errors import InputError, UnknownNameError, UsageError
from metamer.viewer.api import renderer_named
from metamer.viewer.software.backend import software_session
from pictures import read_xyz_exr
from PIL import Image

TREE = ast.parse(Path(metamer.__file__).read_text(encoding="utf-8"))


def python(*words, folder=None):
    """Standard output of a fresh Python, which says nothing on standard error but how far it is on a busy machine."""
    environment = {**os.environ, "PYTHONUTF8": "1"}
    done = subprocess.run([sys.executable, *words], cwd=folder, env=environment, capture_output=True, encoding="utf-8")
    said = [line for line in done.stderr.splitlines() if not re.match(r"(Rendering|Reviewing): \d+/\d+ ", line)]
    assert done.returncode == 0 and not said, done.stdout + done.stderr
    return done.stdout


# Names.


def test_every_name_is_what_its_module_has():
    for name in metamer.__all__:
        assert getattr(metamer, name) is getattr(metamer, name) is not None
        assert name in dir(metamer)
    assert {name for name in dir(metamer) if name[0] != "_"} & {
        "TYPE_CHECKING",
        "annotations",
        "import_module",
    } == set()
    assert metamer.__version__ == version("metamer-colour")
    assert metamer.Catalogue.__module__ == "metamer.materials.catalogue.catalogue"


def test_the_reference_has_every_name_and_the_site_every_page():
    root = Path(metamer.__file__).parent
    told = re.findall(r"^::: metamer\.(\w+)$", (root / "docs" / "api.md").read_text(encoding="utf-8"), re.M)
    assert sorted(told) == sorted(name for name in metamer.__all__ if not name.startswith("_"))
    listed = re.findall(r"\S+\.md$", (root / "mkdocs.yml").read_text(encoding="utf-8"), re.M)
    pages = {path.name for path in (root / "docs").glob("*.md")} | {"decisions/README.md"}
    assert sorted(listed) == sorted(pages)


def test_type_checkers_see_the_same_names_in_the_same_modules():
    block = next(node for node in TREE.body if isinstance(node, ast.If))
    seen = {
        alias.asname: f"{node.module}.{alias.name}"
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert seen == metamer._HOMES
    assert find_spec("metamer").submodule_search_locations
    assert (Path(metamer.__file__).parent / "py.typed").is_file()


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'colour'"):
        _ = metamer.colour
    assert not hasattr(metamer, "_nothing")


def test_import_brings_nothing_along():
    code = "import sys; before = set(sys.modules); import metamer; print(*sorted(set(sys.modules) - before))"
    assert python("-c", code).split() == ["metamer"]


def test_every_name_called_first_says_what_it_is():
    for name in set(metamer.__all__) - {"__version__"}:
        assert len(getattr(metamer, name).__doc__) > 40, name


def test_python_m_metamer_is_the_command(tmp_path):
    assert python("-m", "metamer", "--version", folder=tmp_path) == f"metamer {version('metamer-colour')}\n"
    said = python("-m", "metamer", "--help", folder=tmp_path)
    assert said == python("-m", "metamer.cli.main", "--help", folder=tmp_path)
    assert said.startswith("usage: metamer ")


# Catalogue and material.


@pytest.fixture(scope="module")
def catalogue(tiny_catalogue):
    return metamer.Catalogue.open(tiny_catalogue)


def test_a_catalogue_is_gone_through_by_ids(catalogue):
    assert list(catalogue) == list(catalogue.ids()) and len(catalogue) == 4
    assert "tiny/copper" in catalogue and "tiny/gold" not in catalogue
    copper = catalogue["tiny/copper"]
    assert isinstance(copper, metamer.Material) and copper.id == "tiny/copper"
    assert repr(copper) == "<Material tiny/copper: cook_torrance, analytic>"
    with pytest.raises(UnknownNameError, match="nearest: tiny/copper"):
        catalogue["tiny/coper"]


def test_the_catalogue_of_the_environment_is_the_default(tiny_catalogue, monkeypatch):
    monkeypatch.setenv("METAMER_CATALOGUE", str(tiny_catalogue))
    assert metamer.Catalogue.open().folder == tiny_catalogue


@pytest.mark.parametrize("light", ["D65", "A", "FL11"])
def test_colour_of_a_matt_surface_is_that_of_its_reflectance(catalogue, light):
    red = catalogue["tiny/matt-red"]
    spectrum, eye = metamer.illuminant(light), metamer.observer("1964_10")
    expected = eye.weights(spectrum, red.brdf().wavelengths_nm) @ red.parameters["reflectance"]
    np.testing.assert_allclose(red.xyz(light, "1964_10"), expected, rtol=1e-12)
    np.testing.assert_array_equal(red.xyz(spectrum, eye), red.xyz(light, "1964_10"))
    assert red.lab(light, eye)[0] == pytest.approx(116 * np.cbrt(expected[1]) - 16, rel=1e-12)
    assert metamer.delta_e(red.lab(light), red.lab(light)) == 0


def test_colour_is_that_of_lists_but_for_the_error_of_the_packs(catalogue):
    for name in catalogue:
        listed = read_head(catalogue.path(name))["colour"]["Lab"]
        assert metamer.delta_e(catalogue[name].lab(), np.array(listed)) < 1.0, name


def test_spectra_without_a_surface_count_as_measured(write_spectrum, tmp_path):
    write_spectrum(tmp_path, "filter/red", "transmittance")
    write_spectrum(tmp_path, "lamp/red")
    catalogue = metamer.Catalogue.open(tmp_path)
    red = catalogue["filter/red"]
    spectrum = red.spectrum()
    expected = metamer.observer("1931_2").weights(metamer.illuminant("A"), spectrum.wavelengths_nm) @ spectrum.samples
    np.testing.assert_allclose(red.xyz("A"), expected)
    with pytest.raises(InputError, match="a light has no colour under a light"):
        catalogue["lamp/red"].lab()
    assert red.xyz(catalogue["lamp/red"].spectrum())[1] > 0


# Scene and picture.


SCENE = """
[[part]]
shape = "sphere"
subdivisions = 4
material = "tiny/satin-green"

[[camera]]
name = "near"
width = 24
height_px = 16

[[camera]]
name = "away"
position = [0, 0, 4]
target = [0, 0, 9]
width = 24
height_px = 16
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory, catalogue):
    path = tmp_path_factory.mktemp("scene") / "ball.toml"
    path.write_text(SCENE, encoding="utf-8")
    return metamer.load_scene(path, catalogue)


def test_shipped_scenes():
    assert metamer.load_scene(metamer.shipped_scene()).name == "Sphere"
    with pytest.raises(UnknownNameError, match="nearest: sphere"):
        metamer.shipped_scene("spere")


@pytest.mark.slow
def test_a_picture_has_its_arrays_and_writes_what_the_command_writes(scene, catalogue, tmp_path):
    picture = metamer.render(scene, catalogue, illuminant="A", renderer="software")
    assert isinstance(picture, metamer.Picture)
    assert picture.xyz.shape == (16, 24, 3) and picture.coverage.shape == (16, 24)
    np.testing.assert_array_equal(picture.white, metamer.observer("1931_2").white(metamer.illuminant("A")))
    assert repr(scene) == "<Scene ball: parts 1, lights 1, cameras 2>"
    assert repr(picture) == "<Picture of ball, near: 24 x 16>"
    assert picture.lab().shape == (16, 24, 3) and picture.rgb().dtype == np.uint8
    command = ["render", scene.path, "--catalogue", catalogue.folder, "--illuminant", "A", "--renderer", "software"]
    for name in ("a.exr", "a.png"):
        picture.write(tmp_path / name)
        python("-m", "metamer", *map(str, command), "-o", str(tmp_path / f"command-{name}"))
        assert (tmp_path / name).read_bytes() == (tmp_path / f"command-{name}").read_bytes(), name
    read, coverage = read_xyz_exr(tmp_path / "a.exr")
    np.testing.assert_array_equal(read.values, picture.xyz)
    np.testing.assert_array_equal(coverage, picture.coverage)
    with Image.open(tmp_path / "a.png") as file:
        np.testing.assert_array_equal(np.asarray(file), picture.rgb())
    with pytest.raises(UsageError, match=r"written as \.exr or \.png"):
        picture.write(tmp_path / "a.jpg")


def test_the_reference_is_the_slow_truth(scene, catalogue):
    fast, slow = (metamer.render(scene, catalogue, reference=one, renderer="software") for one in (False, True))
    inside = (fast.coverage == 1) & (slow.coverage == 1)
    difference = metamer.delta_e(slow.lab()[inside], fast.lab()[inside])
    assert 0 < difference.max() < 1.5
    assert "rays" in slow.made_by
    with pytest.raises(UsageError, match="no factors to filter"):
        metamer.render(scene, catalogue, reference=True, filtering="mipmapped")


def test_a_renderer_is_kept_where_one_is_given(scene, catalogue):
    with software_session() as renderer:
        first, second = (metamer.render(scene, catalogue, renderer=renderer) for _ in range(2))
    np.testing.assert_array_equal(first.xyz, second.xyz)
    with pytest.raises(UnknownNameError, match="nearest: software"):
        renderer_named("softwear")


def test_a_scene_is_its_file_and_a_light_whatever_holds_a_spectrum(scene, catalogue):
    import io

    import colour

    named = metamer.render(scene, catalogue, illuminant="A", renderer="software")
    read = metamer.render(str(scene.path), catalogue, illuminant=colour.SDS_ILLUMINANTS["A"], renderer="software")
    np.testing.assert_array_equal(read.xyz, named.xyz)
    assert any("in place of the spectra" in note for note in read.scene.notes)
    spectrum = metamer.render(scene.path, catalogue, illuminant=metamer.illuminant("A"), renderer="software")
    np.testing.assert_array_equal(spectrum.xyz, named.xyz)
    with Image.open(io.BytesIO(named._repr_png_())) as shown:
        np.testing.assert_array_equal(np.asarray(shown), named.rgb())
    with pytest.raises(InputError, match="no such file"):
        metamer.render("nothing.toml", catalogue)
    with pytest.raises(InputError, match="no spectrum"):
        metamer.render(scene, catalogue, illuminant=3)


@pytest.mark.parametrize("kind", ["dict", "colour", "pandas"])
def test_a_spectrum_becomes_a_material_that_is_drawn(kind, scene, tmp_path):
    import colour
    import pandas

    nm, red = np.arange(380.0, 781.0, 10.0), np.linspace(0.05, 0.8, 41)
    value = {
        "dict": dict(zip(nm, red, strict=True)),
        "colour": colour.SpectralDistribution(red, nm),
        "pandas": pandas.Series(red, nm),
    }[kind]
    made = metamer.Material.from_spectrum(value, "mine/red")
    np.testing.assert_allclose(made.xyz("A"), metamer.Spectrum(value).xyz("A"), atol=2e-6)
    assert made.spectrum().quantity == "reflectance" and np.array_equal(made.spectrum().samples, red)
    (tmp_path / MARKER).write_text("")
    catalogue = metamer.Catalogue.open(tmp_path)
    assert catalogue.add(made) == tmp_path / "mine" / "red.h5"
    np.testing.assert_array_equal(catalogue["mine/red"].xyz(), made.xyz())
    picture = metamer.render(scene.with_material(scene.parts[0].name, "mine/red"), catalogue, renderer="software")
    assert picture.xyz[8, 12, 0] > picture.xyz[8, 12, 2] > 0
    with pytest.raises(InputError, match=r"(?s)there is a material of this id.*replace=True"):
        catalogue.add(made)
    for name in ("red", "../red", "a/../red", "/red", "a/"):
        with pytest.raises(InputError, match="not an id"):
            catalogue.add(replace(made, id=name))


def test_an_analytic_brdf_becomes_a_material_that_is_drawn_within_its_budget(scene, tmp_path):
    from metamer.materials.analytic.ashikhmin_shirley import AshikhminShirley

    nm = np.arange(380.0, 781.0, 5.0)
    body, coat = (metamer.Spectrum.sampled(nm, np.full(nm.size, value)) for value in (0.3, 0.05))
    satin = AshikhminShirley(body, coat, 40.0, 40.0)
    made = metamer.Material.from_brdf(satin, "mine/satin", budget=0.5)
    assert made.error is not None and made.error.p99 <= 0.5 and made.provenance.kind == "analytic"
    catalogue = metamer.Catalogue.open(tmp_path / "own", create=True)
    catalogue.add(made)
    np.testing.assert_array_equal(catalogue["mine/satin"].surface().parameters()["exponent_u"], 40.0)
    worn = scene.with_material(scene.parts[0].name, "mine/satin")
    found = metamer.render(worn, catalogue, renderer="software")
    off = found.difference(metamer.render(worn, catalogue, reference=True))
    assert off.p99 < 0.5
    assert str(off) == f"mean {off.mean:.3f}, p95 {off.p95:.3f}, p99 {off.p99:.3f}, max {off.max:.3f} over {off.pixels} pixels"  # fmt: skip  # noqa: E501


def test_samples_by_name_keep_their_names(tmp_path):
    nm = np.arange(380.0, 781.0, 10.0)
    red = metamer.Spectrum((nm, np.linspace(0.05, 0.8, 41)))
    report = metamer.match(red, {"lot 7": red * 0.98, 8: (nm, red.samples * 0.9)}, "CIE 2000 0.8")
    assert [one.sample.name for one in report.samples] == ["lot 7", "8"]
    # A file's, too; of one with several, each has its own behind it.
    np.savetxt(
        tmp_path / "two.csv",
        np.c_[nm, red.samples * 90, red.samples * 80],
        header="nm,p R%,q R%",
        delimiter=",",
        comments="",
    )
    found = metamer.match(red, {"lot 9": tmp_path / "two.csv"}, "CIE 2000 0.8")
    assert [one.sample.name.partition(":")[0] for one in found.samples] == ["lot 9", "lot 9"]
    for wrong in (None, 0.5, red.samples):
        with pytest.raises(InputError, match="lot 7: no sample"):
            metamer.match(red, {"lot 7": wrong}, "CIE 2000 0.8")
    # Wavelengths and values, of one sample and of two, are no names.
    for values, names in ((red.samples, ["sample 1"]), (np.c_[red.samples, red.samples] * 0.95, ["1", "2"])):
        found = metamer.match(red * 0.9, dict(zip(nm, values, strict=True)), "CIE 2000 0.8")
        assert [one.sample.name for one in found.samples] == names


def test_what_is_no_matt_colour_becomes_no_surface():
    nm = np.arange(380.0, 781.0, 10.0)
    lamp = metamer.Material.from_spectrum((nm, np.linspace(0.0, 9.0, 41)), "mine/lamp", "emission")
    assert not lamp.is_surface and lamp.spectrum().samples[-1] == 9.0
    with pytest.raises(InputError, match="too little of the visible"):
        metamer.Material.from_spectrum({500.0: 0.2, 600.0: 0.4})
    with pytest.raises(InputError, match="no spectrum"):
        metamer.Material.from_spectrum("red.csv")
    with pytest.raises(InputError, match="more than one spectrum"):
        metamer.Material.from_spectrum(metamer.Spectrum.sampled(nm, np.zeros((2, 41))))


def test_every_material_has_a_spectrum(catalogue):
    for name in catalogue:
        material = catalogue[name]
        assert material.xyz("A") == pytest.approx(material.spectrum().xyz("A"), abs=2e-6), name
        assert name in material._repr_html_() and "<svg" in material._repr_html_()
    copper = catalogue["tiny/copper"].spectrum()
    assert copper.quantity == "radiance factor"
    shown = catalogue._repr_html_()
    assert "4 materials" in shown
    for name in catalogue:
        assert f"<td>{name}</td><td>{catalogue[name].provenance.kind}</td>" in shown


def test_a_catalogue_in_a_notebook_shows_many_materials_in_part_and_says_which_are_damaged(catalogue, tmp_path):
    (tmp_path / MARKER).write_bytes((catalogue.folder / MARKER).read_bytes())
    (tmp_path / "many").mkdir()
    kept = catalogue.path("tiny/copper").read_bytes()
    for number in range(63):
        (tmp_path / "many" / f"{number:02}{catalogue.path('tiny/copper').suffix}").write_bytes(
            kept if number else b"torn"
        )
    shown = metamer.Catalogue.open(tmp_path)._repr_html_()
    assert "63 materials" in shown and "and 3 more" in shown and "many/59" in shown and "many/60" not in shown
    assert not re.search("<td>many/00</td><td>(measured|analytic)", shown) and "<td>many/00</td>" in shown


def test_figures_of_a_match_are_a_table_and_a_drawing(catalogue):
    from matplotlib.figure import Figure

    red = catalogue["tiny/matt-red"].spectrum()
    report = metamer.match(red, [red * 0.9, red * 0.98], "CIE 2000 0.8")
    frame = report.to_pandas()
    assert list(frame["sample"].unique()) == ["sample 1", "sample 2"] and len(frame) == 6
    first = frame.iloc[0]
    expected = metamer.delta_e(red.lab("D65", "1964_10"), (red * 0.9).lab("D65", "1964_10"), "CIE 2000")
    assert first["ΔE CIE 2000"] == pytest.approx(float(expected), abs=1e-9)
    shown = report._repr_html_()
    assert "sample 1" in shown and "fail" in shown and f"{first['ΔE CIE 2000']:.2f}" in shown
    axes = report.plot(Figure().subplots())
    assert len(axes.lines) == 5 and axes.get_xlabel() == "Δa*"
    assert axes.lines[2].get_xdata()[0] == pytest.approx(first["Δa*"])


def test_a_catalogue_is_given_by_its_folder(scene, catalogue, as_users_call):
    small = replace(scene, cameras=(replace(scene.camera("near"), width=4, height_px=4, samples=1),))
    found = metamer.render(small, str(catalogue.folder), renderer="software")
    assert np.array_equal(found.xyz, metamer.render(small, catalogue, renderer="software").xyz)
    for take in (metamer.render, metamer.review):
        with pytest.raises(InputError, match=r"(?s)not a catalogue.*<Material tiny/copper.*with_material"):
            take(small, catalogue["tiny/copper"])


def test_a_match_with_a_stated_colour_is_no_list_of_letters():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        report = metamer.match("lab:50,10,10@D65/1964_10", "lab:50,10,11@D65/1964_10")
    assert len(report.samples) == 1 and report.samples[0].differences[0].delta_e["CIE 1976"] == pytest.approx(1.0)


def test_a_picture_of_nothing_is_warned_of(scene, catalogue):
    with pytest.warns(UserWarning, match="sees no"):
        metamer.render(scene, catalogue, camera="away", renderer="software")


@pytest.mark.parametrize(("field", "name"), [("materials", "tiny/none"), ("illuminants", "D66")])
def test_one_name_in_a_review_is_no_list_of_letters(scene, catalogue, tmp_path, field, name):
    with pytest.raises(UnknownNameError, match=f"found: '{name}'"):
        metamer.review(scene, catalogue, tmp_path / "none", renderer="software", **{field: name})


def test_review_of_a_script_is_that_of_the_command(scene, catalogue, tmp_path):
    steps = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = metamer.review(
            scene,
            catalogue,
            tmp_path / "script",
            illuminants=["A"],
            renderer="software",
            camera="near",
            progress=lambda *step: steps.append(step),
        )
    assert steps == [(1, 1, "tiny/satin-green")] and [row.illuminant for row in found.rows] == ["A"]
    command = ["review", scene.path, "--catalogue", catalogue.folder, "--illuminants", "A", "--renderer", "software"]
    said = python("-m", "metamer", *map(str, command), "--camera", "near", "--out", str(tmp_path / "script"))
    assert "resumed: 1 of 1 rows were there" in said
    frame = found.to_pandas()
    assert list(frame["p99"]) == [row.statistics.p99 for row in found.rows]
    assert "tiny/satin-green" in found._repr_html_() and found.verdict.split("<")[0][:20] in found._repr_html_()
    standing = catalogue["tiny/satin-green"].provenance.kind
    assert list(frame["standing"]) == [standing] and f"<td>{standing}</td>" in found._repr_html_()
    assert found.verdict in said and re.search(r"1 picture in \d+ s\.", said)


# Arguments that are of another kind.


NM = np.arange(380.0, 781.0, 20.0)
GREY, PAPER = ((NM, np.full(NM.size, level)) for level in (0.3, 0.4))


@pytest.mark.parametrize(
    ("argument", "name"),
    [
        ("illuminants", "A"),
        ("observers", "1931_2"),
        ("formulas", "CIE 2000"),
        ("whites", "CIE 2004"),
        ("across", "geometry"),
    ],
)
def test_one_name_is_a_list_of_one(as_users_call, argument, name):
    found, listed = (metamer.match(GREY, PAPER, **{argument: given}).asked for given in (name, [name]))
    assert found == listed


def test_one_angle_is_a_list_of_one(as_users_call):
    with pytest.raises(UsageError) as one:
        metamer.match(GREY, PAPER, angles="15")
    with pytest.raises(UsageError) as listed:
        metamer.match(GREY, PAPER, angles=["15"])
    assert str(one.value) == str(listed.value)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: metamer.match(GREY, PAPER, 0.8),
        lambda: metamer.match(GREY, PAPER, illuminants=[metamer.Spectrum(GREY)]),
        lambda: metamer.match(GREY, PAPER, illuminants=np.array([1.0, 2.0])),
        lambda: metamer.match(GREY, PAPER, illuminants=5),
        lambda: metamer.match(GREY, PAPER, observers=[10]),
        lambda: metamer.match(GREY, PAPER, formulas=2000),
        lambda: metamer.match(GREY, PAPER, angles=15),
        lambda: metamer.illuminant(GREY),
        lambda: metamer.illuminant(6500),
        lambda: metamer.observer({}),
        lambda: metamer.delta_e([50.0, 0.0, 0.0], [51.0, 0.0, 0.0], None),
        lambda: metamer.fit(metamer.Spectrum(GREY)),
        lambda: metamer.fit(None),
    ],
)
def test_an_argument_of_another_kind_is_refused_in_words(as_users_call, wrong):
    with pytest.raises(InputError, match="expected"):
        wrong()


def test_a_measured_lamp_that_stands_for_a_name_is_told_where_it_goes(as_users_call):
    with pytest.raises(InputError, match=r"metamer\.render"):
        metamer.illuminant(metamer.illuminant("A"))


def lamp_file(path, *names):
    lamp = metamer.illuminant("FL11")
    columns = np.c_[lamp.wavelengths_nm, np.outer(lamp.samples, 1.0 + np.arange(len(names)))]
    np.savetxt(path, columns, "%.17g", ",", header=",".join(("nm", *names)), comments="")
    return path


def test_a_match_is_told_under_measured_lamps(tmp_path, as_users_call):
    """By file, spectrum and name: figures are those of the illuminant that was measured."""
    tube = metamer.illuminant("FL11")
    ours = lamp_file(tmp_path / "booth-4.csv", "tube")
    lamps = {"our tube": tube, "our file": ours, "our name": "FL11"}
    expected = metamer.match(GREY, PAPER, "CIE 2000 1.0", illuminants="FL11").samples[0].differences[0]
    for asked, names in (
        (["FL11", 2.0 * tube], ("FL11", "measured lamp")),
        ((tube.wavelengths_nm, tube.samples), ("measured lamp (2)",)),
        (["FL11", str(ours)], ("FL11", "booth-4")),
        (ours, ("booth-4",)),
        (f"{lamp_file(tmp_path / 'two.csv', 'left', 'right')}#right", ("right",)),
        (lamps, tuple(lamps)),
    ):
        report = metamer.match(GREY, PAPER, "CIE 2000 1.0", illuminants=asked)
        told = [figures.conditions.illuminant for figures in report.samples[0].differences]
        assert tuple(told) == names
        for figures in report.samples[0].differences:
            np.testing.assert_allclose(figures.sample_lab, expected.sample_lab, atol=1e-9)
        assert names[-1] in report.html()
    with pytest.raises(InputError, match=r'two\.csv#1"'):
        metamer.match(GREY, PAPER, illuminants=tmp_path / "two.csv")
    with pytest.raises(InputError, match="no such file"):
        metamer.match(GREY, PAPER, illuminants=["no-lamp.csv"])


def test_what_is_assumed_of_a_measured_lamp_is_said():
    short = metamer.Spectrum({450.0: 1.0, 700.0: 2.0}, quantity="emission")
    report = metamer.match(GREY, PAPER, illuminants={"short": short})
    assert any("short is known from 450 to 700 nm" in note for note in report.asked.notes)


def test_numpy_takes_the_samples_of_a_spectrum(as_users_call):
    spectrum = metamer.Spectrum(GREY)
    taken = np.asarray(spectrum)
    np.testing.assert_array_equal(taken, spectrum.samples)
    assert taken.dtype == np.float64 and not np.shares_memory(taken, spectrum.samples)
    assert np.asarray(spectrum, dtype=np.float32).dtype == np.float32
    assert np.mean(spectrum) == pytest.approx(spectrum.samples.mean())
    with pytest.raises(ValueError, match=r"spectrum\.samples"):
        np.array(spectrum, copy=False)


def test_an_unknown_quantity_of_a_file_is_named_by_its_argument(tmp_path, as_users_call):
    np.savetxt(tmp_path / "a.csv", np.c_[NM, GREY[1]], "%.5f", ",", header="nm,a", comments="")
    with pytest.raises(InputError, match=r"as_=: unknown quantity\n  found: 'reflectanse'"):
        metamer.read_spectra(tmp_path / "a.csv", as_="reflectanse", scale="fraction")


@pytest.mark.parametrize("made", [False, True])
def test_a_new_catalogue_is_made_where_it_is_asked_for(tmp_path, made):
    folder = tmp_path / "new"
    if made:
        folder.mkdir()
    with pytest.raises(InputError):
        metamer.Catalogue.open(folder)
    assert metamer.Catalogue.open(folder, create=True).ids() == () and (folder / MARKER).is_file()
    lamp = metamer.Material.from_spectrum(GREY, "mine/lamp", "emission")
    metamer.Catalogue.open(folder, create=True).add(lamp)
    assert metamer.Catalogue.open(folder, create=True).ids() == ("mine/lamp",)


def test_a_folder_of_other_files_is_made_no_catalogue(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    for folder in (tmp_path, tmp_path / "notes.txt"):
        with pytest.raises(InputError, match="not a catalogue"):
            metamer.Catalogue.open(folder, create=True)


@pytest.mark.parametrize("name", ["dye", "", "/dye", "mine/", ".mine/dye", "mine//dye", "mine/../dye"])
def test_an_id_is_refused_before_the_fit(name, monkeypatch):
    monkeypatch.setattr("metamer.materials.fitting.fit.fit", lambda *_, **__: pytest.fail("fitted"))
    with pytest.raises(InputError, match="family/name"):
        metamer.Material.from_spectrum(GREY, name)


@pytest.mark.parametrize("take", [metamer.Spectrum, metamer.Material.from_spectrum])
@pytest.mark.parametrize("file", ["foo.csv", Path("foo.csv")])
def test_a_file_in_place_of_a_spectrum_is_told_what_reads_it(take, file):
    with pytest.raises(InputError, match=r"metamer\.read_spectra"):
        take(file)


@pytest.mark.parametrize("power", [1.5, 80.0])
def test_a_lamp_taken_for_a_reflectance_is_told_of_emission(power):
    for values in ((NM, power * GREY[1] / GREY[1].max()), {400.0: 0.1, 700.0: power}):
        with pytest.raises(InputError, match='quantity="emission"'):
            metamer.Spectrum(values)


@pytest.mark.parametrize("quantity", ["reflectance", "emission"])
@pytest.mark.parametrize("kind", [np.array, list, tuple])
def test_wavelengths_before_samples_are_told_their_order(as_users_call, kind, quantity):
    with pytest.raises(InputError, match="samples come first"):
        metamer.Spectrum(kind(NM), kind(GREY[1]), quantity)
    assert metamer.Spectrum(kind(GREY[1]), kind(NM), quantity).samples.shape == NM.shape


@pytest.mark.parametrize("kind", [np.array, list, tuple])
def test_wavelengths_before_percent_are_told_their_order(as_users_call, kind):
    """Percent that rise pass for wavelengths."""
    percent = np.linspace(12.0, 60.0, len(NM))
    with pytest.raises(InputError, match="samples come first"):
        metamer.Spectrum(kind(NM), kind(percent))
    with pytest.raises(InputError, match="wavelengths come first in a pair"):
        metamer.Spectrum((kind(percent), kind(NM)))
    with pytest.raises(InputError, match="divide by 100"):
        metamer.Spectrum(kind(percent), kind(NM))


def test_a_match_is_told_in_one_line():
    told = repr(metamer.match(GREY, PAPER, "CIE 2000 1.0"))
    assert told.startswith("<MatchReport of 1 beside standard: ") and "\n" not in told and len(told) < 400
