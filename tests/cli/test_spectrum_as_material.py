"""A light's spectrum is a record of the catalogue too; a part of a scene cannot be made of it, and is told so."""

import pytest


@pytest.fixture
def folder(tmp_path, write_matt, write_spectrum):
    write_matt(tmp_path / "cat", "tiny/matt-red", 0.4)
    write_spectrum(tmp_path / "cat", "tiny/led")
    return tmp_path / "cat"


@pytest.mark.parametrize("reference", [(), ("--reference",)])
def test_render_refuses_it(metamer, scene, folder, tmp_path, reference):
    scene.write_text(scene.read_text().replace("tiny/matt-red", "tiny/led"))
    words = ["render", scene, "--out", tmp_path / "a.png", "--catalogue", folder, "--renderer", "software", *reference]
    code, _, err = metamer(*words)
    assert code == 4 and "tiny/led: an emission spectrum, not a surface" in err and "use it as a light" in err
    assert not (tmp_path / "a.png").exists()


def test_review_sweeps_surfaces_alone_and_refuses_a_spectrum_by_name(metamer, scene, folder, tmp_path):
    words = ["review", scene, "--out", tmp_path / "out", "--catalogue", folder, "--renderer", "software", "--jobs", 1]
    code, out, err = metamer(*words, "--illuminants", "D65")
    assert code == 0, err
    assert "\nThe one picture is accurate enough" in out
    code, _, err = metamer(*words, "--materials", "tiny/led")
    assert code == 4 and "tiny/led: an emission spectrum" in err and "use it as a light" in err


def test_fit_refuses_it(metamer, folder):
    code, _, err = metamer("fit", "tiny/led", "--catalogue", folder)
    assert code == 4 and "tiny/led: an emission spectrum" in err


def test_the_way_that_the_refusal_names_leads_there(metamer, scene, folder, tmp_path):
    """Export the emission, name the file as a light's spectrum, render."""
    words = ["catalogue", "export", "tiny/led", "--format", "csv", "-o", tmp_path / "led.csv", "--catalogue", folder]
    code, _, err = metamer(*words)
    assert code == 0, err
    scene.write_text(scene.read_text().replace('spectrum = "D65"', 'spectrum = "led.csv"'))
    words = ["render", scene, "-o", tmp_path / "a.png", "--catalogue", folder, "--renderer", "software"]
    code, _, err = metamer(*words)
    assert code == 0 and (tmp_path / "a.png").exists(), err
