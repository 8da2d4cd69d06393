"""`metamer catalogue list`: filters, order, what a person and what a program reads."""

import json

import numpy as np
import pytest


@pytest.fixture
def folder(tmp_path, write_matt, write_spectrum):
    write_matt(tmp_path / "cat", "paint/dark", 0.1)
    write_matt(tmp_path / "cat", "paint/light", 0.8)
    write_matt(tmp_path / "cat", "cloth/red", np.linspace(0.05, 0.9, 81))
    write_spectrum(tmp_path / "cat", "lamp/led")
    return tmp_path / "cat"


def test_table_says_all_and_under_which_light(metamer, folder):
    code, out, _ = metamer("catalogue", "list", folder)
    assert code == 0
    assert out.splitlines()[0].split() == [
        "material",
        "model",
        "kind",
        "terms",
        "fit",
        "ΔE94",
        "p99",
        "under",
        "L*",
        "a*",
        "b*",
    ]
    assert "lamp/led     emission  analytic  emission" in out
    assert "observer 1931_2" in out and out.rstrip().endswith("4 materials")


def test_filters_and_order(metamer, folder):
    code, out, _ = metamer("catalogue", "list", folder, "--family", "paint", "--sort", "lightness", "--reverse")
    assert code == 0 and out.index("paint/light") < out.index("paint/dark")
    assert "cloth/red" not in out and "2 of 4 materials" in out
    assert "1 of 4" in metamer("catalogue", "list", folder, "--quantity", "emission,transmittance")[1]
    assert "1 of 4" in metamer("catalogue", "list", folder, "--match", "*/*d*", "--model", "lambert", "--limit", 1)[1]


def test_near_a_colour(metamer, folder):
    code, out, _ = metamer("catalogue", "list", folder, "--near", "91.5,0,0", "--within", "1")
    assert code == 0 and "ΔE94" in out.splitlines()[0] and "1 of 4 materials" in out
    assert out.splitlines()[2].split()[0] == "paint/light"
    assert "ΔE2000" in metamer("catalogue", "list", folder, "--near", "50,0,0", "--formula", 2000)[1].splitlines()[0]


def test_json_is_for_a_program(metamer, folder):
    code, out, _ = metamer("catalogue", "list", folder, "--sort", "chroma", "--reverse", "--limit", 1, "--json")
    document = json.loads(out)
    assert code == 0 and document["unusable"] == []
    (red,) = document["materials"]
    assert red["id"] == "cloth/red" and red["terms"] == [[1, "hd"]] and red["path"].endswith("red.h5")


def test_nothing_fits_says_what_there_is(metamer, folder):
    code, out, _ = metamer("catalogue", "list", folder, "--model", "lambrt")
    assert code == 0 and "0 of 4 materials" in out and "models here: emission, lambert" in out


def test_unusable_file_is_said_and_the_rest_listed(metamer, folder):
    (folder / "paint" / "dark.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + b"\0" * 100)
    code, out, _ = metamer("catalogue", "list", folder)
    assert code == 4 and "dark.h5" in out and "import the material again" in out and "3 materials" in out
    code, out, _ = metamer("catalogue", "list", folder, "--json")
    assert code == 4 and len(json.loads(out)["unusable"]) == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--within", "3"), "need a colour"),
        (("--sort", "near"), "need a colour"),
        (("--near", "50,20"), "three numbers such as 50,20,10"),
        (("--near", "nan,0,0"), "a colour, not"),
        (("--sort", "size"), "invalid choice"),
        (("--limit", "-1"), "whole number"),
        (("--within", "0", "--near", "1,2,3"), "above 0"),
    ],
)
def test_wrong_words_are_wrong_usage(metamer, folder, words, said):
    code, _, err = metamer("catalogue", "list", folder, *words)
    assert code == 64 and said in err
