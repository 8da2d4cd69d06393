"""A colour that was made up, by a reconstruction or of RGB, gets figures and no verdict; measured readings get one."""

import numpy as np
import pytest
from metamer.materials.catalogue.material import Material
from metamer.materials.catalogue.samples import sample_of
from metamer.materials.formats.spectra import read_sources
from metamer.materials.records.material import Provenance
from metamer.viewer.match import match

NM = np.arange(400, 701, 10)
FLOP = {-15: 0.9, 15: 0.8, 25: 0.5, 45: 0.2, 75: 0.1, 110: 0.07}
ASKED = {"illuminants": ("D65",), "formulas": ("CIE 2000",)}


def paint(path, angles=FLOP, factor=1.0, at="45as{}"):
    curves = [FLOP[one] * factor * (0.3 + 0.7 / (1.0 + np.exp(-(NM - 520.0 - one) / 25.0))) for one in angles]
    lines = ["Reflectance, fraction", "nm," + ",".join(f"Silver {at.format(one)}" for one in angles)]
    lines += [f"{nm}," + ",".join(f"{one[at]:.5f}" for one in curves) for at, nm in enumerate(NM)]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def silver(tmp_path_factory):
    """A reconstruction as a catalogue keeps it, without a fast form."""
    (made,) = read_sources(paint(tmp_path_factory.mktemp("silver") / "silver.csv"), "mallett-yuksel")
    return Material(made.id, made.family, made.model, made.parameters, made.provenance, None, original=made.original)


def verdicts(report):
    return {one.conditions.geometry: one.verdict for one in report.samples[0].differences}


@pytest.mark.parametrize(("factor", "verdict"), [(1.005, "pass"), (1.3, "fail")])
def test_a_reconstruction_is_judged_by_its_readings_and_elsewhere_not_at_all(silver, tmp_path, factor, verdict):
    standard = sample_of(silver)
    lot = paint(tmp_path / "lot.csv", factor=factor)
    report = match(standard, [lot], "CIE 2000 1.0", **ASKED)
    assert verdicts(report) == {f"45as{one}": verdict for one in FLOP} and report.verdict == verdict
    assert not any("does not state" in note for note in report.notes)
    # The readings themselves, not the BRDF through them.
    again = match(paint(tmp_path / "same.csv", factor=1.0), [lot], **ASKED)
    for one, other in zip(report.samples[0].differences, again.samples[0].differences, strict=True):
        assert one.delta_e == pytest.approx(other.delta_e, abs=1e-9)
    for geometry in ("60as{}", "45as{}.9"):
        report = match(
            standard, [paint(tmp_path / "lot.csv", (15, 25, 45, 75), factor, geometry)], "CIE 2000 1.0", **ASKED
        )
        assert set(verdicts(report).values()) == {"not judged"} and "not measured" in report.summary
    report = match(standard, ["lab:50,0,0@D65/1964_10"], "CIE 2000 1.0", **ASKED)
    assert verdicts(report) == {"": "not judged"}


def test_some_angles_of_a_file_may_be_those_of_the_readings(silver, tmp_path):
    lot = paint(tmp_path / "lot.csv", factor=1.3)
    moved = lot.read_text("utf-8").replace("45as25", "45as30")
    lot.write_text(moved, encoding="utf-8")
    found = verdicts(match(sample_of(silver), [lot], "CIE 2000 1.0", **ASKED))
    assert found.pop("45as30") == "not judged" and set(found.values()) == {"fail"}
    found = verdicts(match(lot, [sample_of(silver)], "CIE 2000 1.0", **ASKED))
    assert found.pop("45as30") == "not judged" and set(found.values()) == {"fail"}


def test_two_reconstructions_are_held_beside_each_other_at_the_angles_of_their_readings(silver, tmp_path):
    (made,) = read_sources(paint(tmp_path / "other.csv", (15, 45, 110), 1.3), "mallett-yuksel")
    other = Material("a/b", "a", made.model, made.parameters, made.provenance, None, original=made.original)
    found = verdicts(match(sample_of(silver), [sample_of(other)], "CIE 2000 1.0", **ASKED))
    assert found == {"45as15": "fail", "45as45": "fail", "45as110": "fail"}


def test_readings_of_a_reconstruction_on_grids_of_their_own_are_kept_and_judged(silver):
    rows = silver.original["readings"]
    apart = {f"reading.{n}.nm": NM for n in range(1, 7)} | {f"reading.{n}": rows[n - 1] for n in range(1, 7)}
    kept = {k: v for k, v in silver.original.items() if not k.startswith("readings")} | apart
    other = Material("a/b", "a", silver.model, silver.parameters, silver.provenance, None, original=kept)
    one, two = (sample_of(each).at("45as75").lab("D65", "1964_10") for each in (silver, other))
    assert one == pytest.approx(two)


@pytest.mark.parametrize(
    ("kind", "tolerance", "code", "word"),
    [
        ("uplifted(mallett-yuksel)", "CIE 2000 50", 1, "not judged"),
        ("uplifted(mallett-yuksel)", "CIE 2000 0.01", 1, "not judged"),
        ("reconstructed(flakes)", "CIE 2000 0.01", 1, "not judged"),
        ("uplifted(mallett-yuksel)", None, 0, "not judged"),
        ("measured", "CIE 2000 0.01", 2, "fail"),
        ("analytic", "CIE 2000 50", 0, "pass"),
    ],
)
def test_where_a_tolerance_is_given_and_nothing_is_judged_the_exit_code_says_so(
    metamer, tmp_path, write_matt, kind, tolerance, code, word
):
    write_matt(tmp_path / "cat", "paint/shown", provenance=Provenance("RGB of somebody", "none", kind))
    words = ["--tolerance", tolerance] if tolerance else []
    lot = "lab:50,1,2@D65/1964_10"
    for sides in (("paint/shown", lot), (lot, "paint/shown")):
        found, out, err = metamer("match", *sides, "--catalogue", tmp_path / "cat", *words)
        assert found == code, err
        assert word in out and ("no tolerance" in out) == (tolerance is None)
