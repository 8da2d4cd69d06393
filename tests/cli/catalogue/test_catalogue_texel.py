"""`metamer catalogue show --texel`: what one texel of a BTF shows, of its fast form and of its images."""

import json
import os
import time

import numpy as np
import pytest
from btf_sets import NINE, held, written
from metamer.materials.btf.apparent_brdf import apparent_brdf, in_plane
from metamer.materials.btf.form import SIZES, btf_form
from metamer.materials.btf.metric import folding_of
from metamer.materials.btf.texel_error import TexelSample
from metamer.materials.core.protocol import LIGHTS
from metamer.materials.intake.importing import import_sources
from metamer.runtime.errors import InputError
from metamer.spectral.folding import Folding
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer

FOLDING = Folding(observer("1931_2"), [illuminant(name) for name in LIGHTS], np.pi)
SOME = NINE[:5]


@pytest.fixture(scope="module")
def images():
    return held(size=(6, 7), offset=0.4)


@pytest.fixture(scope="module", params=["lpca", "rfp"])
def fast(images, request):
    return btf_form(images, SIZES["small"]) if request.param == "lpca" else btf_form(images, name=request.param)


def test_of_all_texels_together_the_error_is_that_of_the_form(images, fast):
    sample = TexelSample.drawn(images, 1)
    off = [apparent_brdf(fast, images, int(t % 7), int(t // 7), FOLDING).differences() for t in sample.texels]
    each = np.stack(off).transpose(1, 0, 2, 3).reshape(len(LIGHTS), -1)
    for row, one in zip(fast.texel_error.lights, each, strict=True):
        assert one.mean() == pytest.approx(row.mean, abs=1e-3)
        assert np.percentile(one, 99) == pytest.approx(row.p99, abs=1e-2)


def test_measured_values_are_those_of_the_registered_images(images, fast):
    found = apparent_brdf(fast, images, 3, 5, FOLDING).original
    weights = FOLDING.coefficients(images.basis)
    for view, light in ((0, 0), (3, 6), (8, 2)):
        expected = images.registered(view, light)[5, 3].astype(np.float64) @ weights
        np.testing.assert_allclose(found[view, light], expected, rtol=1e-5)


def test_a_diffuser_lit_along_its_normal_is_white(images, fast):
    white = apparent_brdf(fast, None, 0, 0, FOLDING).whites
    np.testing.assert_allclose(white, folding_of(LIGHTS).weights(images.basis.wavelengths_nm).sum(axis=0))


@pytest.mark.parametrize(("x", "y", "field"), [(7, 0, "x"), (-1, 0, "x"), (0, 6, "y")])
def test_a_texel_outside_is_refused_with_the_size(images, fast, x, y, field):
    with pytest.raises(InputError, match="7 x 6 texels") as caught:
        apparent_brdf(fast, images, x, y, FOLDING)
    assert caught.value.field == field


def test_in_the_plane_of_incidence_the_viewers_side_is_negative(images):
    view, lights = images.views.directions[2], images.lights
    values = lights.directions @ view
    theta = np.arccos(view[2])
    found = in_plane(values, lights, view, np.array([-theta, 0.0, theta]))
    np.testing.assert_allclose(found, [1.0, view[2], np.cos(2 * theta)], atol=1e-6)


@pytest.fixture
def wool(tmp_path):
    folder = tmp_path / "wool"
    written(folder, SOME, SOME)
    for path in [*folder.rglob("*"), folder]:
        os.utime(path, (time.time() - 3600,) * 2)
    said = ImportOptions(encoding="srgb", white=(1.0,), btf_form="lpca")
    report = import_sources([folder], tmp_path / "cat", jobs=1, answer=said)
    assert report.count("imported") == 1, report.outcomes
    return folder


def test_the_command_shows_charts_and_says_everything_in_json(wool, metamer, write_matt):
    cat = wool.parent / "cat"
    words = ("catalogue", "show", "btf/wool", cat, "--texel")
    code, out, _ = metamer(*words, "1,2")
    assert code == 0 and "Seen from theta 30, phi 0: images" in out and "deg" in out and "D65" in out, out
    code, out, _ = metamer(*words, "1,2", "--json", "-")
    told = json.loads(out)
    assert code == 0 and np.shape(told["fast"]) == np.shape(told["original"]) == (5, 5, 3, 3)
    assert np.mean(told["delta_e94_each"], axis=(0, 1))[0] == pytest.approx(told["delta_e94"]["D65"]["mean"])
    assert told["lights_deg"][2] == [30.0, 90.0] and told["gone"] == []
    code, _, err = metamer(*words, "4,0")
    assert code == 4 and "4 x 4 texels" in err
    assert metamer("catalogue", "show", "btf/wool", cat, "--json", "-")[0] == 64
    assert metamer(*words, "red")[0] != 0
    write_matt(cat, "paint/red")
    code, _, err = metamer("catalogue", "show", "paint/red", cat, "--texel", "0,0")
    assert code == 4 and "BTF" in err


def test_without_its_images_the_form_is_shown_alone_and_diff_of_originals_says_so(wool, metamer):
    cat = wool.parent / "cat"
    next(wool.glob("*.png")).unlink()
    code, out, _ = metamer("catalogue", "show", "btf/wool", cat, "--texel", "0,0")
    assert code == 0 and f"the fast form alone, local PCA; images are gone: {wool}" in out and ": images" not in out
    told = json.loads(metamer("catalogue", "show", "btf/wool", cat, "--texel", "0,0", "--json", "-")[1])
    assert told["original"] is None and told["gone"] == [str(wool)] and told["delta_e94"] == {}
    code, _, err = metamer("catalogue", "diff", "btf/wool", "btf/wool", "--catalogue", cat, "--of", "original")
    assert code == 4 and "the original is gone" in err and str(wool) in err
    code, out, _ = metamer("catalogue", "diff", "btf/wool", "btf/wool", "--catalogue", cat)
    assert code == 0 and "local PCA, bytes" in out and "packs" not in out


@pytest.mark.slow
def test_diff_compares_texels_of_two_fast_forms(wool, metamer, tmp_path):
    other = tmp_path / "other"
    said = ImportOptions(encoding="srgb", white=(1.0,), btf_form="rfp")
    assert import_sources([wool], other, jobs=1, answer=said).count("imported") == 1
    sides = [folder / "btf" / "wool.h5" for folder in (wool.parent / "cat", other)]
    code, out, _ = metamer("catalogue", "diff", *sides)
    assert code == 0 and "form local PCA -> reflectance fields" in out and " texels, all " in out
    assert out.count("the largest") == 1 and out.count(", light ") == 3
    code, out, _ = metamer("catalogue", "diff", *sides, "--json", "-")
    (found,) = json.loads(out)["differences"]
    worst = max(light["p99"] for light in found["texels"])
    assert [light["light"] for light in found["texels"]] == ["D65", "A", "FL11"] and worst > 0.1
    assert json.loads(out)["largest"] >= worst
    code, out, _ = metamer("catalogue", "diff", sides[0], sides[0])
    same = [line for line in out.splitlines() if ", light " in line]
    assert code == 0 and len(same) == 3 and all(line.count("0.000") == 4 for line in same)
