"""Every shipped material under D65, A and FL11, as `metamer review` draws it: within the budget, row by row.

All of them under one light from one direction; a matt one, a satin, a gloss one and a metal in the booth of the
default review.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from metamer.materials.analytic.glossmeter import gloss_of
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.records.record_colour import colour_folding

ROOT = Path(__file__).resolve().parent.parent
LIGHTS = ("D65", "A", "FL11")
IN_THE_BOOTH = ("colorchecker/blue-matte", "colorchecker/red-satin", "paint/munsell-5y-8-12-gloss", "metal/copper")
MOST_P99, MOST_MEAN = 1.0, 0.3
#: Gloss units at 60 degrees that a word in a paint's name stands for.
FINISHES = {"matte": (0.0, 10.0), "satin": (20.0, 40.0), "gloss": (70.0, 95.0)}
MOST_PAGE_BYTES = 6_000_000

# The fixture that all tests wait for has a limit of its own, and is not counted to the first that asks for it.
pytestmark = [pytest.mark.slow, pytest.mark.timeout(300, func_only=True)]
LONGEST_COMMAND_S = 1500


@pytest.fixture(scope="module")
def both(tmp_path_factory, kept_catalogue):
    """Folders of the catalogue and of two reviews, made by the command in its own processes."""
    folder = tmp_path_factory.mktemp("shipped")
    catalogue = kept_catalogue("shipped", ROOT / "catalogs" / "shipped", "--jobs", "2")
    out, booth = (folder / name for name in ("review", "booth"))
    options = ["--catalogue", catalogue, "--jobs", "2"]
    # A seventh of the shipped scene's pixels, of fewer samples: what is off in a picture is off in a small one.
    shipped, sphere = (ROOT / "examples" / "sphere.toml").read_text(encoding="utf-8"), folder / "sphere.toml"
    small = re.sub(r"^(width|height_px) = 256$", r"\1 = 96", shipped, flags=re.MULTILINE)
    small = re.sub(r"^samples = 3$", "samples = 2", small, flags=re.MULTILINE)
    assert small.count(" = 96\n") == 2 and small.count("samples = 2\n") == 1
    sphere.write_text(small, encoding="utf-8")
    for words in (
        ["review", sphere, "--out", out, "--illuminants", ",".join(LIGHTS), *options],
        ["review", "--out", booth, "--size", "64", "--materials", ",".join(IN_THE_BOOTH), *options],
    ):
        command = [sys.executable, "-m", "metamer.cli.main", *map(str, words)]
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, encoding="utf-8", timeout=LONGEST_COMMAND_S
        )
        # 1 and 2 say that a row is off; the tests below say which.
        assert done.returncode in (0, 1, 2), done.stdout + done.stderr
    return catalogue, out, booth


@pytest.fixture(scope="module")
def reviewed(both):
    """(folder, review.json, ids in the catalogue) of all materials on a sphere."""
    catalogue, out, _ = both
    ids = {path.relative_to(catalogue).with_suffix("").as_posix() for path in catalogue.rglob("*.h5")}
    return out, json.loads((out / "review.json").read_text(encoding="utf-8")), ids


@pytest.mark.slow
def test_every_material_and_light_has_its_row(reviewed):
    _, document, ids = reviewed
    rows = [(row["material"], row["illuminant"]) for row in document["results"]]
    assert len(ids) == 82 and len(rows) == 246
    assert set(rows) == {(material, light) for material in ids for light in LIGHTS}


def test_every_row_is_within_the_budget(reviewed):
    _, document, _ = reviewed
    missed = [
        (row["material"], row["illuminant"], row["delta_e94"])
        for row in document["results"]
        if row["delta_e94"]["p99"] > MOST_P99 or row["delta_e94"]["mean"] > MOST_MEAN or row["undefined_pixels"]
    ]
    assert not missed
    assert document["status"] == "pass" and document["budget_delta_e94"] == MOST_P99


def test_fast_forms_have_the_gloss_that_their_names_say(both):
    """As a glossmeter reads what pictures are made of."""
    catalogue = Catalogue.open(both[0])
    for name in ("colorchecker/white-9-5-matte", "colorchecker/black-2-satin", "paint/munsell-5y-8-12-gloss"):
        record = catalogue.load(name)
        units = [gloss_of(one, colour_folding(), 0.0).units for one in (record.surface(), record.fast)]
        assert units[1] == pytest.approx(units[0], rel=0.01, abs=0.05), name
        least, most = FINISHES[name.rpartition("-")[2]]
        assert least <= units[1] <= most, name


def test_light_from_all_around_is_within_the_budget(both):
    """Of an import without `--budget`: 0.5 in the mean, four times as much in the 99th percentile."""
    catalogue = Catalogue.open(both[0])
    errors = {name: catalogue.load(name).environment_error for name in catalogue.ids()}
    assert not {name: (e.mean, e.p99) for name, e in errors.items() if e.mean > 0.5 or e.p99 > 2.0}


def test_figures_are_those_of_two_pictures(reviewed):
    """A row of zeros would mean that a picture was compared with itself; few pixels, that little was compared."""
    _, document, _ = reviewed
    for row in document["results"]:
        assert row["delta_e94"]["mean"] > 1e-5, row
        assert row["pixels"] > 5_000, row
    assert all(check["passed"] for check in document["self_check"]) and len(document["self_check"]) >= 2


def test_plan_says_what_it_chose_and_why(reviewed):
    _, document, _ = reviewed
    plan = document["plan"]
    assert 3 <= plan["basis_size"] <= 10
    assert plan["reasons"][0].startswith("Each of 82 pictures is planned by itself, with ")
    assert any("3 lights" in reason for reason in plan["reasons"])
    assert any(f"J = {plan['basis_size']} is kept" in reason for reason in plan["reasons"])


def test_files_are_there(reviewed):
    out, document, _ = reviewed
    for row in document["results"]:
        for kind, name in (("", row["image"]), *row["files"].items()):
            # A mask of few pixels is small.
            assert (out / name).stat().st_size > (50 if kind == "limits PNG" else 1000), name


def test_page_is_self_contained_and_not_too_large(reviewed):
    out, document, _ = reviewed
    page = (out / "index.html").read_text(encoding="utf-8")
    assert len(page.encode()) < MOST_PAGE_BYTES
    targets = set(re.findall(r"""(?:src|href|poster|action|srcset)=["']([^"']+)""", page))
    targets |= set(re.findall(r"""url\(\s*["']?([^"')]+)""", page))
    # A mask of what the screen cannot show is named by its script.
    outside = {t[:80] for t in targets - {"${url}"} if not t.startswith(("data:", "#", "pictures/", "review.json"))}
    assert not outside
    assert not re.search(r"(?:src|href|url\()\W{0,3}(?:https?:)?//", page)
    assert "@import" not in page and "fetch(" not in page and "XMLHttpRequest" not in page
    linked = {t for t in targets if t.startswith("pictures/")}
    assert linked <= {name for row in document["results"] for name in (row["image"], *row["files"].values())}
    assert all(row["material"] in page for row in document["results"])


def test_the_default_review_stands_in_a_booth_and_says_how_uncertain_its_reference_is(both):
    document = json.loads((both[2] / "review.json").read_text(encoding="utf-8"))
    rows = document["results"]
    assert {(row["material"], row["illuminant"]) for row in rows} == {
        (m, light) for m in IN_THE_BOOTH for light in LIGHTS
    }
    # Metals too, which mirror the edges of the booth's panel.
    assert document["status"] == "pass"
    assert any("area and environment light" in words for words in document["colour_chain"])
    for row in rows:
        assert 1e-3 < row["delta_e94"]["mean"] <= MOST_MEAN and row["delta_e94"]["p95"] <= MOST_P99, row
        # Two thirds of a picture of 64 pixels.
        assert row["pixels"] > 2_500
        noise = row["reference_noise"]
        assert 0.0 < noise["mean"] <= noise["aimed"] == 0.1 * MOST_P99 and not noise["limited"], row
        assert noise["mean"] < noise["p99"]
    page = (both[2] / "index.html").read_text(encoding="utf-8")
    noises = re.findall(r'"noise":\{"mean":([0-9.e-]+)', page)
    assert noises == [repr(row["reference_noise"]["mean"]) for row in rows]


def test_a_row_under_one_direction_has_no_noise(reviewed):
    assert all(row["reference_noise"] is None for row in reviewed[1]["results"])
