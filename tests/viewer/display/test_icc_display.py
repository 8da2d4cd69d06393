"""The display of an ICC profile at the end of the chain: CPU and GPU, limits, words, the screen's own profile."""

import numpy as np
import pytest
from icc_profiles import FORMS, matrix_profile, old_tables
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.image import ColourImage
from metamer.viewer.display.gl_pass import DisplayPass
from metamer.viewer.display.proof import Proof
from metamer.viewer.display.transform import DISPLAY_WHITE_XYZ, DisplayTransform


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A file of each form, by its name."""
    folder = tmp_path_factory.mktemp("profiles")
    for number, data in enumerate(FORMS.values()):
        (folder / f"{number}.icc").write_bytes(data)
    return {form: folder / f"{number}.icc" for number, form in enumerate(FORMS)}


@pytest.mark.parametrize("form", FORMS)
def test_gpu_and_cpu_show_one_thing(form, files, gl):
    display = DisplayTransform(f"icc:{files[form]}")
    rgb = np.random.default_rng(1).uniform(size=(17, 29, 3)).astype(np.float32)
    xyz = display.decode(rgb)
    for back, given, expected in ((False, xyz, display.apply(xyz)), (True, rgb, xyz)):
        drawn = DisplayPass(gl, display, back)(given)
        assert np.abs(drawn - expected).max() <= 1e-5


@pytest.mark.parametrize("form", FORMS)
def test_white_is_full_code_and_the_view_colorimetric(form, files):
    display = DisplayTransform(f"icc:{files[form]}")
    # White lies between nodes of these small tables.
    off = 0.03 if "tables" in form else 1e-4
    np.testing.assert_allclose(display.apply(DISPLAY_WHITE_XYZ[None]), 1.0, atol=off)
    words = display.describe()
    # Even steps of XYZ are too few for greys: that such a table misses white is said.
    assert display.name == "ICC: Desk" and ("not colorimetric" in " ".join(words)) == ("to XYZ" in form)
    assert any("“Desk”" in line and str(files[form]) in line for line in words)
    assert display.shows_limits == ("to XYZ" not in form)


@pytest.mark.parametrize("form", ["matrix and a parametric curve, version 4", "tables of 16 bits to Lab, version 2"])
def test_colours_that_it_cannot_show_are_counted(form, files):
    """Two out of gamut, one brighter than white, one within; tables hide it in their codes, and are asked what they
    show.
    """
    display = DisplayTransform(f"icc:{files[form]}")
    xyz = np.array([[0.1, 0.6, 0.05], [0.5, 0.2, 0.9], 1.4 * DISPLAY_WHITE_XYZ, 0.4 * DISPLAY_WHITE_XYZ])
    below, above = display.out_of_range(xyz, display.apply(xyz))
    np.testing.assert_array_equal(below | above, [True, True, True, False])
    assert above[2] and not below[3]
    image = ColourImage(xyz[None].astype(np.float32), "xyz_d65", DISPLAY_WHITE_XYZ)
    rgb, notes = display.encode(image)
    assert rgb.min() >= 0.0 and rgb.max() <= 1.0
    assert notes[0].startswith("3 of 4 pixels (75.00%) clipped to “ICC: Desk”")


@pytest.mark.parametrize("form", ["matrix and a parametric curve, version 4", "tables of 16 bits to Lab, version 2"])
def test_a_proof_counts_what_is_lost_and_by_how_much(form, files):
    display = DisplayTransform(f"icc:{files[form]}")
    xyz = np.array([[[0.1, 0.6, 0.05], [0.5, 0.2, 0.9], 1.4 * DISPLAY_WHITE_XYZ, 0.4 * DISPLAY_WHITE_XYZ]])
    found = Proof(display).statistics(xyz)
    np.testing.assert_array_equal(found.lost, [[True, True, True, False]])
    shown = display.decode(np.clip(display.apply(xyz), 0.0, 1.0)).astype(float)
    np.testing.assert_allclose(found.delta_e, delta_e_xyz(xyz, shown, DISPLAY_WHITE_XYZ))
    assert found.delta_e[found.lost].min() > 2.0


@pytest.mark.parametrize("count", [9, 17])
def test_colours_within_the_gamut_are_not_counted_however_coarse_the_tables_are(count, tmp_path):
    """Tables back to codes that are off by some ΔE94: said of the profile, and not of colours."""
    (tmp_path / "coarse.icc").write_bytes(old_tables(b"XYZ ", count=count))
    display = DisplayTransform(f"icc:{tmp_path / 'coarse.icc'}")
    codes = np.random.default_rng(2).uniform(size=(4000, 3)).astype(np.float32)
    xyz = display.decode(codes)
    sent = display.apply(xyz)
    off = delta_e_xyz(xyz.astype(float), display.decode(np.clip(sent, 0, 1)).astype(float), DISPLAY_WHITE_XYZ)
    assert (off > 1.0).mean() > 0.2
    below, above = display.out_of_range(xyz, sent)
    assert not (below | above).any()
    beyond = np.array([[0.05, 0.6, 0.05], [0.9, 0.3, 0.02]])
    assert np.any(display.out_of_range(beyond, display.apply(beyond)), axis=0).all()
    # One colour by itself, as the probe asks.
    assert np.any(display.out_of_range(beyond[0], display.apply(beyond[0])))
    assert "miss its own colours by ΔE94" in " ".join(display.describe())


def test_other_views_configurations_and_files_are_refused(files, tmp_path):
    name = f"icc:{files['tables of 8 bits to Lab, version 2']}"
    with pytest.raises(UnknownNameError, match="Un-tone-mapped"):
        DisplayTransform(name, "ACES 1.0 - SDR Video")
    with pytest.raises(InputError, match="leave ocio_config out"):
        DisplayTransform(name, config="ocio://default")
    with pytest.raises(InputError, match="no such file"):
        DisplayTransform(f"icc:{tmp_path / 'none.icc'}")


def test_a_profile_that_is_written_anew_is_read_anew(tmp_path):
    path = tmp_path / "desk.icc"
    path.write_bytes(matrix_profile(name="Before"))
    before = DisplayTransform(f"icc:{path}")
    assert before.name == "ICC: Before" and before == DisplayTransform(f"icc:{path}")
    path.write_bytes(old_tables(name="After"))
    after = DisplayTransform(f"icc:{path}")
    # Cached objects of displays (passes of the window, descriptions) belong to one or the other.
    assert after.name == "ICC: After" and after != before and hash(after) != hash(before)


def test_ocio_of_the_environment_does_not_matter(files, monkeypatch):
    monkeypatch.setenv("OCIO", "/nowhere/config.ocio")
    assert DisplayTransform(f"icc:{files['matrix and an exponent, version 2']}").name == "ICC: Desk"


def test_a_system_that_has_no_profile_says_so(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(InputError, match="name the file: icc:FILE"):
        DisplayTransform("icc:screen")
