"""The review report: figures as JSON to their schema, the page whole and self-contained, refusals said."""

import base64
import json
import re
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from json_schema import problems, schemas
from metamer.calibration.report.page import TEMPLATES
from metamer.calibration.report.rating import Probed, Rating
from metamer.calibration.report.report import write_report
from metamer.calibration.report.row import ReferenceNoise, RowColour, review_row
from metamer.calibration.report.statistics import DeltaEStatistics, SelfCheck
from metamer.runtime.errors import ComparisonError, InputError

ROOT = Path(__file__).resolve().parents[3]
CHECKS = (SelfCheck("L* raised by 1", 1.0, 1.0), SelfCheck("C*ab raised by 1", 0.6, 0.6))
VOID = {"meta", "img", "input", "br", "wbr", "path", "circle", "rect", "use"}


@dataclass(frozen=True)
class Plan:
    """Plan with what the report reads of one."""

    basis_size: int = 3
    reasons: tuple[str, ...] = ("One light, no bounce: 3 coefficients are exact.",)


def row(material="paint/red & <blue>", illuminant="D65", p99=0.4, undefined=0, size=16, rows=3, **more):
    """A row with small pictures."""
    rng = np.random.default_rng(1)
    picture = rng.integers(0, 256, (size, size, 3), dtype=np.uint8)
    return review_row(
        material,
        illuminant,
        "CIE 1931 2 Degree Standard Observer",
        statistics=DeltaEStatistics(0.5 * p99, 0.9 * p99, p99, 2.0 * p99, 200, undefined),
        picture=picture,
        reference=picture.copy(),
        delta_e=np.full((size, size), p99),
        budget=1.0,
        rows=rows,
        image=f"{illuminant}.png",
        **{
            "seconds": {"render": 0.02, "reference": 1.5},
            "wavelengths_nm": np.arange(400.0, 701.0, 10.0),
            "reflectance": np.linspace(0.1, 0.9, 31),
            "swatch": (120, 30, 20),
            "white_xyz": np.array([0.95047, 1.0, 1.08883]),
            "provenance": {"Source": "measured <here>"},
            **more,
        },
    )


def write(folder, rows, **more):
    """The report of some rows, with everything else fixed."""
    arguments = {"checks": CHECKS, "created": "2026-01-01T00:00:00+00:00", **more}
    return write_report(folder, rows, Plan(), "numpy", 1.0, ["Bradford, once."], "0.0", **arguments)


class Tags(HTMLParser):
    """Unclosed tags, addresses, images, text."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open, self.links, self.sources, self.ids, self.text, self.scripts = [], [], [], set(), [], {}
        self.script = None
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        if tag not in VOID:
            self.open.append(tag)
        self.links += [attributes["href"]] if "href" in attributes else []
        self.sources += [attributes["src"]] if "src" in attributes else []
        self.ids |= {attributes.get("id")}
        self.script = attributes.get("id") if tag == "script" else None

    def handle_endtag(self, tag):
        assert tag in VOID or self.open.pop() == tag, f"</{tag}> at {self.getpos()}"

    def handle_data(self, data):
        if self.script:
            self.scripts[self.script] = self.scripts.get(self.script, "") + data
        self.text.append(data)


def data_of(page):
    """Return what the page's scripts draw from."""
    return json.loads(Tags(page.read_text("utf-8")).scripts["data"])


def test_json_follows_its_documented_schema(tmp_path):
    (schema,) = schemas("review_json.md")
    rows = [
        row(),
        row(illuminant="A", p99=1.2, files={"XYZ EXR": "a.exr"}),
        row(illuminant="FL11", white_xyz=None),
    ]
    _, path = write(tmp_path, rows)
    document = json.loads(path.read_text("utf-8"))
    assert problems(document, schema) == []
    assert problems({**document, "status": "fine"}, schema) and problems({}, schema)
    first = document["results"][0]
    assert (first["material"], first["illuminant"]) == ("paint/red & <blue>", "D65")
    assert first["delta_e94"] == {"mean": 0.2, "p95": 0.36000000000000004, "p99": 0.4, "max": 0.8}
    assert first["seconds"] == {"render": 0.02, "reference": 1.5}
    assert document["plan"]["basis_size"] == 3
    assert document["budget_delta_e94"] == 1.0


def test_a_row_says_how_its_pictures_are_opened_in_the_window(tmp_path):
    files = {"XYZ EXR": "pictures/red.exr", "reference EXR": "pictures/red.reference.exr"}
    page, _ = write(tmp_path, [row(files=files), row("other", files={"XYZ EXR": "a.exr"})])
    windows = [one["window"] for material in data_of(page)["materials"] for one in material["rows"].values()]
    assert windows == ["metamer view pictures/red.reference.exr pictures/red.exr", None]


def test_page_is_whole_and_needs_nothing_beside_it(tmp_path):
    path, _ = write(tmp_path, [row(), row(illuminant="A", p99=1.2), row("other", p99=9.0)])
    text = path.read_text("utf-8")
    page = Tags(text)
    assert page.open == []
    embedded = json.loads(page.scripts["embedded"])
    heads = [[base64.b64decode(one[view])[:4] for view in "prd"] for one in embedded]
    assert heads == 3 * [[b"RIFF", b"RIFF", b"\x89PNG"]]
    assert not page.sources and not re.search(r"https?://|@import|url\((?!\$\{url\}\))", text)
    for link in page.links:
        assert link[1:] in page.ids if link.startswith("#") else not link.startswith("/"), link
    words = " ".join("".join(page.text).split())
    for part in (
        "1 of 3 pictures is accurate enough to judge colour by; 1 is borderline and 1 is too far off",
        "it approves no colour",
        "Bradford, once.",
        "recovered",
    ):
        assert part in words, part


def test_figures_and_materials_keep_their_order(tmp_path):
    """The page's scripts put what needs a look first; within a material the lights stay as they were asked for."""
    rows = [row("fair", "D65", 0.4), row("fair", "A", 0.5), row("bad", "D65", 0.3), row("bad", "A", 2.0)]
    rows.append(row("holed", "D65", p99=0.2, undefined=1))
    page, figures = write(tmp_path, rows)
    materials = data_of(page)["materials"]
    assert [(one["id"], list(one["rows"])) for one in materials] == [
        ("fair", ["D65", "A"]), ("bad", ["D65", "A"]), ("holed", ["D65"]),
    ]  # fmt: skip
    assert materials[2]["rows"]["D65"]["undefined"] == 1
    listed = [(one["material"], one["illuminant"]) for one in json.loads(figures.read_text("utf-8"))["results"]]
    assert listed == [(one.material, one.illuminant) for one in rows]


def test_equal_reviews_are_equal_pages(tmp_path):
    for name in ("one", "other"):
        write(tmp_path / name, [row(), row(illuminant="A", p99=1.2), row("other", p99=9.0)])
    for file in ("index.html", "review.json"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "other" / file).read_bytes()


def test_colour_of_the_original_data_is_on_the_page(tmp_path):
    beside = ((15.0, np.array([0.4, 0.5, 0.6]), np.array([70.0, 0.0, -3.0])),)
    colour = RowColour(np.array([0.2, 0.1, 0.05]), np.array([38.0, 51.25, -7.0]), "45a:0", beside)
    page, figures = write(tmp_path, [row(colour=colour)])
    (material,) = data_of(page)["materials"]
    told = material["colours"]["2°"]["D65"]
    assert told["lab"] == [38.0, 51.25, -7.0] and told["adapted"] is None and told["shift"] is None
    assert material["rows"]["D65"]["around"] == [[15.0, 70.0]]
    (found,) = json.loads(figures.read_text("utf-8"))["results"]
    lch, (around,) = found["colour"].pop("lch"), found["colour"].pop("around")
    assert around == {"aspecular": 15.0, "xyz": [0.4, 0.5, 0.6], "lab": [70.0, 0.0, -3.0], "lch": [70.0, 3.0, 270.0]}
    assert {key: found["colour"][key] for key in ("xyz", "lab", "geometry", "adapted_lab")} == {
        "xyz": [0.2, 0.1, 0.05], "lab": [38.0, 51.25, -7.0], "geometry": "45a:0", "adapted_lab": None,
    }  # fmt: skip
    np.testing.assert_allclose(lch, [38.0, 51.725840, 352.222362], rtol=1e-8)  # 360° less atan(7 / 51.25)


def test_noise_of_the_reference_is_said_by_row_and_a_limit_is_a_note(tmp_path):
    noise = ReferenceNoise(0.09, 0.42, 0.1, 1024, False)
    limited = ReferenceNoise(0.25, 0.9, 0.1, 16384, True)
    rows = [row(noise=noise), row(illuminant="A", noise=limited), row(illuminant="FL11")]
    page, figures = write(tmp_path, rows)
    assert "a reference is off by at most ΔE94 0.25 on average" in page.read_text("utf-8")
    told = [one["noise"] for one in data_of(page)["materials"][0]["rows"].values()]
    assert told == [{"mean": 0.09, "limited": False}, {"mean": 0.25, "limited": True}, None]
    document = json.loads(figures.read_text("utf-8"))
    (schema,) = schemas("review_json.md")
    assert problems(document, schema) == []
    found = document["results"]
    expected = {"mean": 0.09, "p99": 0.42, "aimed": 0.1, "directions": 1024, "limited": False}
    assert found[0]["reference_noise"] == expected and found[2]["reference_noise"] is None
    assert any("uncertain by ΔE94 0.25" in note and "0.1 was aimed at" in note for note in found[1]["notes"])
    assert not any("uncertain" in note for note in found[0]["notes"])


def test_without_noise_nothing_is_said_of_any(tmp_path):
    page, _ = write(tmp_path, [row()])
    assert "by chance under light that spreads" not in page.read_text("utf-8")
    assert data_of(page)["materials"][0]["rows"]["D65"]["noise"] is None


def test_paper_has_a_sheet_alone_and_keeps_pictures_whole():
    """On paper nothing of the screen is left, and no picture stands apart from its words."""
    paper = (TEMPLATES / "review.css").read_text("utf-8").partition("@media print {")[2]
    assert "body > :not(.sheet) { display: none !important; }" in paper
    assert re.search(r"\.pics {[^}]*break-before: page", paper)
    assert re.search(r"\.pics figure {[^}]*break-inside: avoid", paper)


def test_names_and_notes_are_escaped(tmp_path):
    path, _ = write(tmp_path, [row(notes=("<script>alert(1)</script>",))], title="<b>")
    text = path.read_text("utf-8")
    assert "<script>alert" not in text and "<b></h1>" not in text and "<blue>" not in text
    assert data_of(path)["materials"][0]["id"] == "paint/red & <blue>"


@pytest.mark.parametrize(
    ("rows", "checks", "expected"),
    [
        ([0.4, 1.0], CHECKS, "pass"),
        ([0.4, 1.4], CHECKS, "near"),
        ([0.4, 1.4, 1.6], CHECKS, "over"),
        ([0.4], (), "invalid"),
        ([0.4], (SelfCheck("L*", 1.0, 0.0),), "invalid"),
    ],
)
def test_overall_status(tmp_path, rows, checks, expected):
    page, path = write(tmp_path, [row(p99=p99) for p99 in rows], checks=checks)
    assert json.loads(path.read_text("utf-8"))["status"] == expected
    said = json.loads(path.read_text("utf-8"))["verdict"]
    assert f'class="verdict {expected}"' in page.read_text("utf-8") and data_of(page)["verdict"] == said


def test_what_must_be_said_is_noted():
    assert "hold no number" in " ".join(row(undefined=3).notes)
    assert "exactly equal" in " ".join(row(p99=0.0).notes)
    assert row(size=600).notes == ("Shown in 512 x 512 pixels; the figures are those of all 600 x 600.",)
    assert row().notes == ()


def test_row_refuses_a_picture_compared_with_itself():
    picture = np.zeros((4, 4, 3), dtype=np.uint8)
    with pytest.raises(ComparisonError, match="same array"):
        review_row(
            "a", "D65", "1931_2", statistics=DeltaEStatistics(0.0, 0.0, 0.0, 0.0, 1), picture=picture,
            reference=picture, delta_e=np.zeros((4, 4)), budget=1.0, rows=1, image="a.png",
        )  # fmt: skip


def test_refusals(tmp_path):
    with pytest.raises(InputError, match="at least one"):
        write(tmp_path, [])
    with pytest.raises(InputError, match="budget"):
        write_report(tmp_path, [row()], Plan(), "numpy", 0.0, [], "0.0", checks=CHECKS)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="folder"):
        write(tmp_path / "file" / "out", [row()])


def test_nothing_half_written_is_left(tmp_path):
    write(tmp_path, [row()])
    write(tmp_path, [row()])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["history.json", "index.html", "review.json"]


def test_a_full_catalogue_stays_quick_to_open(tmp_path):
    """240 rows of rendered size: the embedded share of a page of three rows, scaled, stays under 6 MB."""
    y, x = np.mgrid[-1.1:1.1:512j, -1.1:1.1:512j]
    z = np.sqrt(np.clip(1.0 - x * x - y * y, 0.0, None))
    light = (
        np.clip(0.5 * x - 0.4 * y + 0.76 * z, 0.0, 1.0)[..., None] * np.array([0.9, 0.4, 0.2])
        + 0.4 * z[..., None] ** 60
    )
    picture = np.rint(255.0 * np.clip(light, 0.0, 1.0) ** (1 / 2.2)).astype(np.uint8)
    noisy = np.abs(np.random.default_rng(0).normal(0.3, 0.1, (512, 512)))
    noisy[z == 0.0] = np.nan  # around the part nothing is compared
    made = review_row(
        "a", "D65", "1931_2", statistics=DeltaEStatistics(0.3, 0.4, 0.5, 0.6, 9), picture=picture,
        reference=picture.copy(), delta_e=noisy, budget=1.0, rows=240, image="a.png",
    )  # fmt: skip
    embedded = 4 / 3 * (len(made.picture) + len(made.reference) + len(made.delta_e_map))
    assert (embedded + 3700) * 240 < 6e6


def test_a_picture_without_some_numbers_is_the_worst_and_they_are_counted(tmp_path):
    _, figures = write(tmp_path, [row("holed", "D65", p99=0.3, undefined=7), row("door", "A", p99=3.0)])
    document = json.loads(figures.read_text("utf-8"))
    assert document["summary"]["worst"]["material"] == "holed" and "7 pixels hold no number" in document["facts"]


def test_what_reviewers_said_stands_in_page_and_figures_and_changes_no_verdict(tmp_path):
    said = (
        Rating("paint/red & <blue>", "D65", "1931_2", "rejected", 2, "too <b>green</b>", probed=(Probed("L*", 41.25),)),
        Rating("paint/other", "A", "1931_2", "approved"),
    )
    _, without = write(tmp_path / "without", [row()])
    page, figures = write(tmp_path / "with", [row()], ratings=said)
    document = json.loads(figures.read_text("utf-8"))
    (schema,) = schemas("review_json.md")
    assert problems(document, schema) == []
    before = json.loads(without.read_text("utf-8"))
    assert before["protocol"] == [] and document["status"] == before["status"]
    assert [one["verdict"] for one in document["protocol"]] == ["rejected", "approved"]
    html = page.read_text("utf-8")
    assert "1 approved, 1 rejected" in html and "too &lt;b&gt;green&lt;/b&gt;" in html and "L* 41.25" in html
    assert "What reviewers said" not in (tmp_path / "without" / "index.html").read_text("utf-8")
