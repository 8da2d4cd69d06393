"""A comparison as JSON, JUnit, CSV, a workbook, Markdown and a page."""

import csv
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
import pytest
from json_schema import problems, schemas
from metamer.calibration.regression.comparison import compare
from metamer.calibration.regression.criteria import criteria_of, default_criteria
from metamer.calibration.regression.outputs import HEADINGS, as_csv, as_json, as_junit, as_markdown, write_xlsx
from metamer.calibration.regression.page import render_page
from metamer.calibration.regression.row import ComparedSide, PixelLayer, Pixels, Row, RowName
from metamer.calibration.regression.row_pictures import srgb
from metamer.calibration.regression.words import as_text
from metamer.runtime.errors import InputError

WHITE = np.array([0.9505, 1.0, 1.089])
SAID = {"observer": "CIE 1931", "scene": "S", "view": "front"}


def side(path, *grey, drop=0):
    """Rows of one grey each; the names try what outputs must escape."""
    rows = []
    for index, value in enumerate(grey):
        pixels = Pixels(np.full((6, 8, 3), value) * WHITE, np.ones((6, 8)), WHITE)
        name = RowName(("=1+1", "<b>&|red", "third\x07")[index], "D65", **SAID)
        rows.append(Row(name, {"picture": PixelLayer(lambda pixels=pixels: replace(pixels, xyz=pixels.xyz.copy()))}))
    return ComparedSide(Path(path), "pictures", tuple(rows[drop:]), {}, ("A chain.",))


@pytest.fixture(scope="module")
def sides():
    return side("before", 0.5, 0.3, 0.2), side("after", 0.5, 0.33)


@pytest.fixture(scope="module")
def result(sides):
    found = compare(*sides, default_criteria())
    assert [row.state for row in found.worst_first] == ["removed", "changed", "identical"]
    return found


def test_json_has_every_row_and_only_numbers(result):
    document = json.loads(as_json(result, "1.2"))
    assert document["schema"] == "metamer.regression/1" and document["status"] == "fail"
    assert [row["state"] for row in document["results"]] == ["identical", "changed", "removed"]
    expected = 116 * (0.33 ** (1 / 3) - 0.3 ** (1 / 3))
    assert document["results"][1]["layers"]["picture"]["delta_e94"]["p99"] == pytest.approx(expected, abs=1e-6)
    assert document["results"][1]["criteria"][0]["status"] == "fail"


def test_json_follows_its_documented_schema(sides, result):
    schema, _ = schemas("regression_json.md")
    pooled = criteria_of({"criteria": [{"statistic": "mean", "warn": 0, "fail": 1, "over": "rows"}]})
    missing = replace(result, rows=(replace(result.rows[0], approximation=(0.1, 0.2)), *result.rows[1:]), checks=())
    for found in (result, missing, compare(*sides, pooled)):
        document = json.loads(as_json(found, "1.2"))
        assert problems(document, schema) == []
    assert document["over_rows"] and json.loads(as_json(missing, "1.2"))["status"] == "invalid"
    document["results"][0]["state"] = "moved"
    del document["results"][1]["layers"]["picture"]["moved"]
    assert len(problems(document, schema)) == 2


def test_junit_counts_its_failures(result):
    root = ElementTree.fromstring(as_junit(result))
    suite = root.find("testsuite")
    cases = suite.findall("testcase")
    assert (suite.get("tests"), suite.get("failures")) == ("4", "2") == (str(len(cases)), root.get("failures"))
    failed = next(case for case in cases if case.get("classname") == "<b>&|red")
    assert "mean 2.5067" in failed.find("failure").text


def test_csv_is_a_rectangle(result):
    lines = list(csv.reader(io.StringIO(as_csv(result))))
    assert lines[0] == list(HEADINGS) and {len(line) for line in lines} == {len(HEADINGS)}
    changed = dict(zip(*lines[::2], strict=True))
    assert changed["material"] == "<b>&|red" and float(changed["mean"]) == pytest.approx(2.5067, abs=1e-3)


def test_a_workbook_holds_names_as_text(result, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    write_xlsx(result, tmp_path / "r.xlsx")
    sheet = openpyxl.load_workbook(tmp_path / "r.xlsx").active
    cells = {row[0].value: row for row in sheet.iter_rows()}
    assert cells["=1+1"][0].data_type == "s" and cells["<b>&|red"][8].data_type == "n"
    assert [cell.value for cell in sheet[1]] == list(HEADINGS)


def test_a_workbook_without_its_library_says_what_to_install(result, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    with pytest.raises(InputError, match=r"metamer-colour\[xlsx\]"):
        write_xlsx(result, tmp_path / "r.xlsx")


def test_markdown_keeps_its_table(result):
    lines = as_markdown(result).splitlines()
    rows = [line for line in lines if line.startswith("|")]
    assert {len(re.findall(r"(?<!\\)\|", line)) for line in rows} == {7}
    assert lines[0].startswith("### ❌") and any(r"\<b\>&\|red" in line for line in rows)


def test_text_ends_with_the_verdict(result):
    assert as_text(result).splitlines()[-1] == (
        "1 of 3 pictures moved: 1 clearly; 1 is gone; most of all <b>&|red, where the picture changed"
    )


class Page(HTMLParser):
    """Every start tag with its attributes, and the text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.text = [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text += data


def test_the_page_is_self_contained_and_shows_what_moved(result, sides):
    text = render_page(result, *sides, "1.2")
    page = Page(text)
    sources = [attrs["src"] for tag, attrs in page.tags if tag == "img" and "src" in attrs]
    # Both pictures and the map of rows that moved, one of the others.
    assert len(sources) == 5 and all(source.startswith("data:image/") for source in sources)
    assert not [tag for tag, attrs in page.tags if tag == "link" or (tag == "script" and "src" in attrs)]
    assert "http" not in re.sub(r"data:[^\"]*", "", text)
    # A name is text, not a tag.
    assert "<b>&|red" in page.text and "&lt;b&gt;&amp;|red" in text
    assert all(attrs.get("alt") for tag, attrs in page.tags if tag == "img" and "src" in attrs)
    assert page.text.index("1 removed") < page.text.index("Every row")
    links = {unquote(attrs["href"][1:]) for tag, attrs in page.tags if tag == "a"}
    assert links <= {attrs["id"] for tag, attrs in page.tags if "id" in attrs}


def test_a_row_says_how_its_pictures_are_opened_in_the_window(sides):
    def of_files(one, suffix):
        rows = []
        for number, row in enumerate(one.rows):
            file = Path(one.path, f"a {number}{suffix}")
            rows.append(replace(row, layers={kind: replace(each, file=file) for kind, each in row.layers.items()}))
        return replace(one, rows=tuple(rows))

    def commands(suffix):
        both = [of_files(one, suffix) for one in sides]
        text = render_page(compare(*both, default_criteria()), *both, "1.2")
        return re.findall(r"<code>(metamer view .*?)</code>", text)

    assert commands(".exr") == ["metamer view &#39;before/a 1.exr&#39; &#39;after/a 1.exr&#39;"]
    assert commands(".csv") == []


def test_what_made_both_sides_alike_is_told_once(sides):
    made = {"renderer": "numpy", "plan": "8 coefficients"}
    before, after = (replace(one, facts=facts) for one, facts in zip(sides, (made, made | {"plan": "9"}), strict=True))
    text = Page(render_page(compare(before, after, default_criteria()), before, after, "1.2")).text
    assert text.count("numpy") == 1 and "9" in text and "Otherwise made as before." in text


def test_a_row_that_no_criterion_is_for_is_said_beside_the_verdict(sides):
    only = criteria_of({"criteria": [{"label": "chip", "statistic": "mean", "warn": 1.0, "fail": 2.0,
                                      "subset": {"material": "=*"}}], "rows": {"removed": "pass"}})  # fmt: skip
    page = Page(render_page(compare(*sides, only), *sides, "1.2")).text
    assert page.index("No colour moved") < page.index("1 of those that moved are held") < page.index("Limits, to look")


def test_pictures_on_the_page_are_srgb():
    pixels = Pixels(np.array([[WHITE, 0.2140 * WHITE, 2 * WHITE]]), np.ones((1, 3)), WHITE)
    codes, clipped = srgb(pixels)
    # Half of the codes is 21.4 % of the light (IEC 61966-2-1).
    assert codes[0, 0].tolist() == codes[0, 2].tolist() == [255] * 3
    assert np.abs(codes[0, 1] - 127.5).max() <= 0.5
    assert clipped == pytest.approx(1 / 3)
