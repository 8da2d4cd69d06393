"""`metamer catalogue list`: filters, order, what a person and what a program reads."""

import json
import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.analytic import Lambert
from metamer.materials.catalogue import head_index
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.directions import spherical
from metamer.materials.core.fit_error import FitError
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.records.record_head import read_head
from metamer.spectral.spectrum import Spectrum


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


@pytest.mark.parametrize("formula", ["94", "2000"])
def test_where_nothing_is_near_a_colour_the_nearest_is_named(metamer, folder, formula, tmp_path):
    """Of what the other filters leave: a farther family does not hide behind them."""
    near = ("--near", "95,0,0", "--formula", formula)
    rows = metamer("catalogue", "list", folder, *near, "--family", "paint")[1].splitlines()
    name, distance = rows[2].split()[0], float(rows[2].split()[-1])
    code, out, _ = metamer("catalogue", "list", folder, *near, "--within", "0.01", "--family", "paint")
    assert code == 0 and out.splitlines()[-1] == f"nearest is {name} at ΔE {distance:.1f}"
    assert "L*" not in out  # no headings of an empty table
    page = ("--html", tmp_path / "page.html")
    code, _, err = metamer("catalogue", "preview", folder, *near, "--within", "0.01", *page)
    assert code == 4 and "try: nearest is " in err


def test_json_is_for_a_program(metamer, folder):
    code, out, _ = metamer("catalogue", "list", folder, "--sort", "chroma", "--reverse", "--limit", 1, "--json", "-")
    document = json.loads(out)
    assert code == 0 and document["unusable"] == []
    (red,) = document["materials"]
    assert red["id"] == "cloth/red" and red["terms"] == [[1, "hd"]] and red["path"].endswith("red.h5")


@pytest.mark.parametrize(
    "words", [("--near", "52,31,18", "--within", "1"), ("--model", "none"), ("--match", "*/*d*"), ("--json", "-")]
)
def test_by_an_index_a_list_says_the_same(metamer, folder, monkeypatch, words):
    pytest.importorskip("duckdb")
    plain = metamer("catalogue", "list", folder, *words)
    monkeypatch.setattr(head_index, "WORTH", 2)
    code, out, err = metamer("catalogue", "list", folder, *words)
    assert (code, out) == plain[:2] and err == plain[2] + f"metamer: {folder}: 4 heads are read into an index, once\n"
    assert metamer("catalogue", "list", folder, *words) == plain


def test_without_duckdb_a_list_of_many_says_once_what_would_be_faster(metamer, folder, monkeypatch):
    plain = metamer("catalogue", "list", folder)
    monkeypatch.setitem(sys.modules, "duckdb", None)
    monkeypatch.setattr(head_index, "WORTH", 2)
    for words in (("list", folder), ("like", "paint/dark", folder)):
        code, out, err = metamer("catalogue", *words)
        assert code == 0 and err.count("extra `index`") == 1
        assert words[0] != "list" or (code, out) == plain[:2]


def test_nothing_fits_says_what_there_is(metamer, folder):
    code, out, _ = metamer("catalogue", "list", folder, "--model", "lambrt")
    assert code == 0 and "0 of 4 materials" in out and "models here: emission, lambert" in out


def test_unusable_file_is_said_and_the_rest_listed(metamer, folder):
    (folder / "paint" / "dark.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + b"\0" * 100)
    code, out, _ = metamer("catalogue", "list", folder)
    assert code == 4 and "dark.h5" in out and "import the material again" in out and "3 materials" in out
    code, out, _ = metamer("catalogue", "list", folder, "--json", "-")
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


@pytest.mark.parametrize(
    ("aims", "figures", "words"),
    [
        (
            {"budget": 0.5, "score": 0.84, "more_terms": 16, "more_score": 0.77},
            "0.84 > 0.5, +16: 0.77",
            "misses the budget of ΔE94 0.5 by 0.34; 16 more terms would have led to about 0.77",
        ),
        (
            {"budget": 0.3, "score": 3.0, "more_terms": 1, "more_score": 3.0},
            "3.00 > 0.3, +1: 3.00",
            "misses the budget of ΔE94 0.3 by 2.70; 1 more term would have gained nothing",
        ),
        ({"budget": 0.25, "score": 0.75}, "0.75 > 0.25", "misses the budget of ΔE94 0.25 by 0.50"),
    ],
)
def test_a_budget_that_is_missed_is_said_with_what_one_more_step_would_have_paid(
    metamer, folder, write_matt, aims, figures, words
):
    declared = Catalogue.open(folder)["paint/dark"].error
    write_matt(folder, "paint/over", 0.3, error=replace(declared, **aims))
    write_matt(folder, "paint/met", 0.3, error=replace(declared, budget=0.5, score=0.5, more_terms=8, more_score=0.4))
    table = metamer("catalogue", "list", folder)[1].splitlines()
    assert table[0].rstrip().endswith("over budget")
    assert [line.split()[0] for line in table if figures in line] == ["paint/over"]
    assert "1 fit over budget" in "\n".join(table)
    shown, met = (metamer("catalogue", "show", name, folder)[1].splitlines() for name in ("paint/over", "paint/met"))
    assert [" ".join(line.split()) for line in shown if line.startswith("budget")] == [f"budget {words}"]
    assert not any(line.startswith("budget") for line in met)
    (document,) = json.loads(metamer("catalogue", "list", folder, "--match", "paint/over", "--json", "-")[1])[
        "materials"
    ]
    assert {name: document[name] for name in aims} == aims


@pytest.mark.slow
def test_the_page_of_a_material_says_the_budget_that_its_fit_missed(metamer, folder, write_matt):
    declared = Catalogue.open(folder)["paint/dark"].error
    write_matt(folder, "paint/over", 0.3, error=replace(declared, budget=0.25, score=0.75))
    assert metamer("catalogue", "show", "paint/over", folder, "--html", folder / "page.html")[0] == 0
    assert "misses the budget of ΔE94 0.25 by 0.50" in (folder / "page.html").read_text()


WHERE = "light 80.0° from the normal, azimuth 0.0°; view 79.5° from the normal, azimuth 180.0°"


def far(maximum, where=WHERE, budget=None):
    return FitError(0.1, 0.2, 0.4, maximum, "A", "1931_2", "sphere", 0.0, where=where, budget=budget, score=budget)


@pytest.mark.parametrize(
    ("maximum", "where", "said", "budget"),
    [
        (56.0, WHERE, f"paint/far: up to ΔE94 56.0 under A: {WHERE}", None),
        (5.1, WHERE, f"paint/far: up to ΔE94 5.1 under A: {WHERE}", None),
        # Measured against the fit's own budget, not the default of an import.
        (1.1, WHERE, f"paint/far: up to ΔE94 1.1 under A: {WHERE}", 0.1),
        (9.9, WHERE, None, 1.0),
        # A record older than the note of such places.
        (56.0, None, "paint/far: up to ΔE94 56.0 under A", None),
        (5.0, WHERE, None, None),
        (0.6, WHERE, None, None),
    ],
)
def test_a_maximum_above_ten_budgets_is_said_with_its_place(
    metamer, tmp_path, write_matt, maximum, where, said, budget
):
    write_matt(tmp_path / "cat", "paint/far", 0.1, error=far(maximum, where, budget))
    listed = metamer("catalogue", "list", tmp_path / "cat")[1].splitlines()
    shown = metamer("catalogue", "show", "paint/far", tmp_path / "cat")[1].splitlines()
    of_one = said and said.partition(": ")[2]
    assert [line for line in listed if "up to ΔE94" in line] == ([said] if said else [])
    assert [line for line in shown if line.startswith("far off")] == ([f"far off       {of_one}"] if said else [])
    assert (where is None) == ("where" not in read_head(tmp_path / "cat" / "paint" / "far.h5")["error"])


def test_of_many_such_maxima_the_largest_are_said(metamer, tmp_path, write_matt):
    for number in range(13):
        write_matt(tmp_path / "cat", f"paint/far-{number}", 0.1, error=far(10.0 + number))
    out = metamer("catalogue", "list", tmp_path / "cat")[1]
    assert "paint/far-12: up to ΔE94 22.0" in out and "paint/far-2:" not in out
    assert "3 materials more of a maximum above ten budgets" in out


def test_the_place_is_where_light_and_view_make_the_difference():
    """A fast form that is off about one pair of directions has its maximum there."""
    matt = Lambert(Spectrum.sampled([400.0, 700.0], [0.2, 0.2]))
    sphere = sphere_protocol(24)
    truth = sphere.reference(matt)
    for worst in (0, 100, len(truth) - 1):
        wrong = truth.copy()
        wrong[worst] *= 3.0
        where = sphere.compare(truth, wrong).where
        numbers = np.radians([float(one) for one in re.findall(r"[\d.]+(?=°)", where)])
        assert where.startswith("light ") and "; view " in where
        found = [spherical(*numbers[:2]), spherical(*numbers[2:])]
        np.testing.assert_allclose(found, [sphere.wi[worst], sphere.wo[worst]], atol=2e-3)
