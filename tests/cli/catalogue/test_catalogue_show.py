"""`metamer catalogue show`: a material in words, and as one page."""

import re
from dataclasses import replace

import numpy as np
import pytest
from metamer.cli.catalogue.show import _sliders
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.fit_error import FitError
from metamer.materials.fitting.fit import Trial
from metamer.materials.records.material import Provenance
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer

NM = np.arange(400.0, 701.0, 10.0)


def trials():
    error = FitError(0.5, 0.9, 1.25, 2.0, "D65", "1931_2", "sphere", 0.0)
    first = Trial(0, "hd", 1, 0.0, error, 1.25, True)
    return (first, replace(first, rank=2, error=replace(error, p99=0.6125), score=0.6125))


def measured(**stated):
    reflectance = np.linspace(0.1, 0.6, NM.size)
    seen = observer("1964_10").weights(illuminant("D65"), NM) @ reflectance
    return {
        "wavelengths_nm": NM,
        "values": reflectance,
        "quantity": "reflectance",
        "details.instrument": "a sphere <b>instrument</b>",
        "stated.0.space": "XYZ",
        "stated.0.values": 100 * seen,
        "stated.0.illuminant": "D65",
        "stated.0.observer": "1964_10",
        **stated,
    }


@pytest.fixture
def folder(tmp_path, write_matt, write_spectrum):
    where = tmp_path / "cat"
    odd = Provenance("A <script>alert(1)</script> source", "CC0", "measured", notes="first + second")
    write_matt(where, "paint/red", trials=trials(), original=measured(), provenance=odd)
    write_matt(where, "paint/bare", 0.25)
    write_spectrum(where, "lamp/led")
    return where


def test_what_can_be_changed_and_how_glossy_it_is_are_said_and_why_nothing(metamer, folder):
    for name, said in (
        ("paint/bare", "sliders       reflectance_scale 1 (a number >= 0 and <= 4)"),
        ("lamp/led", "sliders       none: a spectrum without a surface"),
    ):
        assert said in metamer("catalogue", "show", name, folder)[1].splitlines()
    assert (
        "gloss         0.6 gloss units at 60°, 0.0 stops (ISO 2813)"
        in metamer("catalogue", "show", "paint/bare", folder)[1]
    )
    assert "gloss units" not in metamer("catalogue", "show", "lamp/led", folder)[1]
    table = replace(Catalogue.open(folder)["paint/bare"], model="merl")
    assert _sliders(table) == "none: no formula; metamer catalogue like paint/bare finds neighbours"


def test_words(metamer, folder):
    code, out, _ = metamer("catalogue", "show", "paint/red", folder)
    assert code == 0
    for said in (
        "notes         first\n              second",
        "1 term in frame hd (theta_h 2 x theta_d 2 x phi_d 2; 81 spectral coefficients; single precision)",
        "wavelengths_nm float64 31",
        "details       instrument a sphere <b>instrument</b>\n",
        "(45a:0, D65, 1931_2)",
        "Spectrum: reflectance, as measured",
    ):
        assert said in out, out


def test_stated_colour_beside_what_the_spectrum_gives(metamer, folder, write_matt):
    def row(material_id):
        lines = metamer("catalogue", "show", material_id, folder)[1].splitlines()
        return next(line for line in lines if line.startswith("D65, 1964_10"))

    assert row("paint/red").split()[2] == "XYZ" and row("paint/red").endswith(" 0.00")
    wrong = measured(**{"stated.0.values": np.array([30.0, 40.0, 20.0])})
    write_matt(folder, "paint/wrong", original=wrong)
    assert "30.00 40.00 20.00" in row("paint/wrong") and float(row("paint/wrong").split()[-1]) > 5.0
    write_matt(folder, "paint/odd", original=measured(**{"stated.0.illuminant": "my lamp"}))
    code, out, _ = metamer("catalogue", "show", "paint/odd", folder)
    assert code == 0 and "not recomputed: unknown illuminant" in out


def test_trials_are_a_table_of_speed_against_error(metamer, folder):
    out = metamer("catalogue", "show", "paint/red", folder)[1]
    table = out[out.index("Speed against error") :].splitlines()
    assert table[1].split()[:3] == ["lobe", "frame", "rank"] and "seconds" not in table[1]
    assert table[3].split()[:3] == ["1", "hd", "1"] and "1.250" in table[3]
    assert table[4].split()[2] == "2" and "0.613" in table[4]
    assert "Speed against error" not in metamer("catalogue", "show", "paint/bare", folder)[1]


def test_spectrum_of_a_surface_without_a_measurement_is_that_of_45_0(metamer, folder):
    out = metamer("catalogue", "show", "paint/bare", folder)[1]
    assert "radiance factor at 45:0" in out
    bars = [line.partition("│")[2] for line in out.splitlines() if "│" in line]
    # 0.25 of an axis that ends at 0.5 is half of its eight rows.
    assert [bool(line.strip()) for line in bars] == [False] * 4 + [True] * 4


def test_spectrum_without_a_surface(metamer, folder):
    code, out, _ = metamer("catalogue", "show", "lamp/led", folder)
    assert code == 0 and "none: a spectrum without a surface" in out and "emission, as measured" in out
    assert "ΔE94 " not in out


def test_page_is_whole_and_escapes_what_files_say(metamer, folder, tmp_path):
    page = tmp_path / "red.html"
    code, out, _ = metamer("catalogue", "show", "paint/red", folder, "--html", page, "--renderer", "software")
    text = page.read_text(encoding="utf-8")
    assert code == 0 and str(page) in out
    assert "data:image/webp;base64," in text and "Factor packs on a sphere under booth D65" in text
    assert not re.search(r"""(?:src|href)=["'](?!data:|#)|https?://|@import""", text)
    assert "<script>alert" not in text and "&lt;script&gt;alert" in text and "&lt;b&gt;instrument" in text
    assert text.count('<path class="curve"') == 2 and "D65, 1964_10" in text and "1.250" in text


def test_a_page_that_takes_long_says_how_far_it_is(metamer, folder, tmp_path, monkeypatch):
    monkeypatch.setattr("metamer.cli.catalogue.show._LATE_S", 0.0)
    words = ("paint/red", folder, "--html", tmp_path / "page.html", "--renderer", "software")
    code, _, err = metamer("catalogue", "show", *words)
    assert code == 0 and "Drawing: 1/1 drawing" in err


def test_page_of_a_spectrum_has_no_picture(metamer, folder, tmp_path):
    page = tmp_path / "led.html"
    assert metamer("catalogue", "show", "lamp/led", folder, "--html", page)[0] == 0
    text = page.read_text(encoding="utf-8")
    assert (
        "No picture: an emission spectrum, not a surface" in text
        and "<img" not in text
        and '<path class="curve"' in text
    )


def test_page_into_no_folder_is_refused(metamer, folder, tmp_path):
    words = ("catalogue", "show", "lamp/led", folder, "--html", tmp_path / "none" / "a.html")
    code, _, err = metamer(*words)
    assert code == 4 and "no such folder to write to" in err
