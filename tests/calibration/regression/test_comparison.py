"""Two sides compared: what is matched, found, refused, and said to be too small to tell."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from metamer.calibration.regression.change import change
from metamer.calibration.regression.comparison import compare
from metamer.calibration.regression.criteria import criteria_of, default_criteria
from metamer.calibration.regression.row import HALF_ROUNDOFF, ComparedSide, LayerNoise, PixelLayer, Pixels, Row, RowName
from metamer.calibration.regression.words import as_text
from metamer.runtime.errors import ComparisonError, InputError
from metamer.spectral.colour_library import colour_science
from metamer.spectral.difference import lab_from_xyz, xyz_from_lab
from metamer.spectral.formula import ADAPTING_LUMINANCE, NAMES, formula

WHITE = np.array([0.95, 1.0, 1.09])
NAME = RowName("paint/red", "D65", "CIE 1931 2 Degree Standard Observer", "Sphere", "front")


def pixels(size=80, **changes):
    """A picture of many colours, in single precision."""
    lab = np.random.default_rng(3).uniform([25, -40, -40], [90, 40, 40], (size, size, 3))
    xyz = xyz_from_lab(lab, WHITE).astype(np.float32)
    return replace(Pixels(xyz, np.ones(xyz.shape[:2], np.float32), WHITE), **changes)


def moved(one, *shift, where=np.s_[:, :]):
    """The same picture with L*, a*, b* of some pixels shifted."""
    lab = lab_from_xyz(one.xyz, WHITE)
    lab[where] += shift
    return replace(one, xyz=xyz_from_lab(lab, WHITE).astype(one.xyz.dtype))


def side(path, *rows, kind="review", **facts):
    """A side of rows, each a name and its layers."""
    made = [
        Row(
            name,
            {layer: PixelLayer(lambda held=held: held, noise=noise) for layer, (held, noise) in layers.items()},
            off,
        )
        for name, layers, off in rows
    ]
    return ComparedSide(Path(path), kind, tuple(made), facts)


def row(picture, reference=None, name=NAME, noise=None, p99=None):
    layers = {"picture": (picture, None)}
    if reference is not None:
        layers["reference"] = (reference, noise)
    return name, layers, None if p99 is None else {"p99": p99}


def result(before, after, criteria=None):
    return compare(side("a", before), side("b", after), criteria or default_criteria())


def asked(statistic, warn, fail, **more):
    return criteria_of({"criteria": [{"statistic": statistic, "warn": warn, "fail": fail, **more}], "regions": REGIONS})


REGIONS = {"corner": [0.0, 0.0, 0.25, 0.25]}

APPROXIMATION = criteria_of(
    {"criteria": [{"statistic": "mean", "warn": 1.0, "fail": 1.5, "subset": {"of": "approximation"}}]}
)


def test_equal_bytes_are_identical_and_pass():
    found = result(row(pixels()), row(pixels()))
    assert found.identical and found.exit_code == 0 and found.rows[0].state == "identical"


def test_drift_of_a_fifth_is_found_and_measured():
    found = result(row(pixels()), row(moved(pixels(), 0.2, 0, 0)))
    picture = found.rows[0].layers["picture"]
    assert found.exit_code == 1 and found.rows[0].state == "changed"
    assert picture.mean == pytest.approx(0.2, abs=1e-3)
    assert picture.shift == pytest.approx((0.2, 0, 0), abs=1e-3)


def test_one_wrong_pixel_is_found_where_it_is():
    found = result(row(pixels()), row(moved(pixels(), 20.0, 0, 0, where=np.s_[17, 5])))
    picture = found.rows[0].layers["picture"]
    assert found.exit_code == 2 and picture.worst == (17, 5) and picture.mean < 0.01
    assert picture.after_lab[0] - picture.before_lab[0] == pytest.approx(20.0, abs=1e-3)


def test_a_difference_below_half_precision_is_not_claimed():
    one = pixels(unit_roundoff=HALF_ROUNDOFF)
    off = 1.0 + 0.2 * HALF_ROUNDOFF * np.random.default_rng(4).choice([-1.0, 1.0], one.xyz.shape)
    found = result(row(one, one), row(replace(one, xyz=(one.xyz * off).astype(np.float32)), pixels()))
    picture = found.rows[0].layers["picture"]
    assert 0 < picture.mean < picture.floor_mean and found.rows[0].state == "same" and found.exit_code == 0


@pytest.mark.parametrize("name", NAMES)
def test_no_pixel_of_half_precision_is_beyond_its_bound(name):
    """Neighbours in half precision are what rounding can make of equal colours, whichever way each number went."""
    one = pixels()
    stored = one.xyz.astype(np.float16)
    towards = np.random.default_rng(6).choice([-np.inf, np.inf], one.xyz.shape).astype(np.float16)
    before, after = (
        replace(one, xyz=each.astype(np.float32), unit_roundoff=HALF_ROUNDOFF)
        for each in (stored, np.nextafter(stored, towards))
    )
    moved = change(before, after, (formula(name),), "neighbours")
    # The formulas are a little curved even over one step.
    assert (moved.maps[name] <= 1.02 * moved.bounds[name]).all()
    # And no bound is idle: some come near it.
    assert (moved.maps[name] / moved.bounds[name]).max() > 0.9


@pytest.mark.parametrize("name", [*NAMES, "CMC 1.4:0.8"])
def test_every_pixel_is_colour_science_s(name):
    """Of pictures large enough that they are compared in single precision where a formula has a way for that."""
    colour, one, rng = colour_science(), pixels(), np.random.default_rng(8)
    shifts = rng.normal(0, 2, one.xyz.shape) * rng.choice([0.01, 0.3, 3.0], (80, 80, 1))
    other = replace(one, xyz=xyz_from_lab(lab_from_xyz(one.xyz, WHITE) + shifts, WHITE).astype(np.float32))
    found = change(one, other, (formula(name),), "two").maps[formula(name).name]
    if name == "CAM16-UCS":
        seen = [
            colour.XYZ_to_CAM16(100 * s.xyz.astype(float), 100 * WHITE, ADAPTING_LUMINANCE, 20) for s in (one, other)
        ]
        ends = [colour.JMh_CAM16_to_CAM16UCS(np.stack([s.J, s.M, s.h], axis=-1)) for s in seen]
        wanted = colour.delta_E(*ends, method=name)
    else:
        sides = [colour.XYZ_to_Lab(s.xyz.astype(float), colour.XYZ_to_xy(WHITE)) for s in (one, other)]
        weights = formula(name).cmc
        if weights is None:
            wanted = colour.delta_E(*sides, method=name)
        else:
            wanted = colour.difference.delta_E_CMC(*sides, l=weights[0], c=weights[1])
    assert found.shape == (80, 80) and found.max() > 3.0
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-3)


def test_a_limit_below_the_floor_fails_nothing_and_says_so():
    one = pixels(unit_roundoff=HALF_ROUNDOFF)
    off = 1.0 + 0.2 * HALF_ROUNDOFF * np.random.default_rng(4).choice([-1.0, 1.0], one.xyz.shape)
    other = replace(one, xyz=(one.xyz * off).astype(np.float32))
    found = result(row(one), row(other), asked("mean", 1e-6, 1e-6))
    assert found.exit_code == 1 and not found.rows[0].asked[0].resolved
    assert any("can be resolved" in note for note in found.rows[0].notes)


def test_rounding_of_a_renderer_is_no_change():
    one = pixels()
    noise = 1.0 + 1e-6 * np.random.default_rng(5).standard_normal(one.xyz.shape)
    found = result(row(one), row(replace(one, xyz=(one.xyz * noise).astype(np.float32))))
    assert found.rows[0].state == "same" and not found.identical and found.exit_code == 0


@pytest.mark.parametrize(("p99", "state"), [((0.5, 0.9), "worse"), ((0.9, 0.5), "better"), ((0.5, 0.505), "changed")])
def test_a_picture_moves_from_or_towards_its_reference(p99, state):
    before = row(pixels(), pixels(), p99=p99[0])
    after = row(moved(pixels(), 0.3, 0, 0), pixels(), p99=p99[1])
    found = result(before, after).rows[0]
    assert found.state == state and found.approximation == p99
    assert found.notes[0].startswith("Only the picture moved")


def test_a_reference_that_moved_is_the_material_and_no_merit():
    one, other = pixels(), moved(pixels(), 0.3, 0, 0)
    found = result(row(one, one, p99=0.9), row(other, moved(pixels(), 0.3, 0, 0), p99=0.1)).rows[0]
    assert found.state == "changed" and found.notes[0].startswith("The reference changed")


def test_a_reference_that_moved_within_its_noise_is_not_called_still():
    noise = LayerNoise(0.3, 1.0)
    before = row(pixels(), pixels(), noise=noise)
    found = result(before, row(moved(pixels(), 0.2, 0, 0), moved(pixels(), 0.2, 0, 0), noise=noise)).rows[0]
    assert found.layers["picture"].moved and not found.layers["reference"].moved
    assert "cannot be told" in found.notes[0]


def test_added_and_removed_rows_count():
    other = NAME._replace(material="paint/blue")
    before, after = side("a", row(pixels()), row(pixels(), name=other)), side("b", row(pixels()))
    assert compare(before, after, default_criteria()).rows[1].state == "removed"
    assert compare(before, after, default_criteria()).exit_code == 2
    assert compare(after, before, default_criteria()).rows[1].state == "added"
    assert compare(after, before, default_criteria()).exit_code == 1


def test_pixels_without_a_number_never_pass():
    broken = pixels()
    broken.xyz[4, 4] = np.nan
    found = result(row(pixels()), row(broken), asked("mean", 5.0, 5.0))
    assert found.exit_code == 2 and found.rows[0].layers["picture"].undefined == 1


def test_equal_bytes_without_a_number_have_not_moved():
    one, other = pixels(), pixels()
    for broken in (one, other):
        broken.xyz[4, 4] = np.nan
    found = result(row(one), row(other))
    assert found.identical and found.exit_code == 0 and "hold no number" in found.rows[0].notes[0]


def test_an_approximation_may_fail_though_nothing_moved():
    far = moved(pixels(), 2.0, 0, 0)
    found = result(row(far, pixels()), row(moved(pixels(), 2.0, 0, 0), pixels()), APPROXIMATION)
    assert found.identical and found.exit_code == 2
    assert as_text(found).splitlines()[-1].endswith("the same, byte for byte; what is asked of them fails")


def test_another_shape_is_seen_though_no_colour_moved():
    coverage = np.ones((80, 80), np.float32)
    coverage[:, :2] = 0.0
    found = result(row(pixels()), row(pixels(coverage=coverage)))
    assert found.rows[0].layers["picture"].reshaped == pytest.approx(2 / 80)
    assert found.rows[0].layers["picture"].mean == 0.0 and found.exit_code == 2


def test_only_the_pixels_of_a_row_s_own_material_count():
    mask = np.zeros((80, 80), bool)
    mask[:40] = True
    after = moved(pixels(mask=mask), 5.0, 0, 0, where=np.s_[40:])
    found = result(row(pixels(mask=mask)), row(after))
    assert found.rows[0].layers["picture"].pixels == 40 * 80 and found.rows[0].layers["picture"].max == 0.0


def test_a_region_is_looked_at_alone():
    after = moved(pixels(), 5.0, 0, 0, where=np.s_[:20, :20])
    inside, whole = asked("median", 1, 9, subset={"region": "corner"}), asked("median", 1, 9)
    assert result(row(pixels()), row(after), inside).rows[0].asked[0].value == pytest.approx(5.0, abs=1e-2)
    assert result(row(pixels()), row(after), whole).rows[0].asked[0].value == 0.0


def test_rows_may_be_pooled():
    names = [NAME._replace(material=f"patch/{index}") for index in range(4)]
    before = side("a", *(row(pixels(1), name=name) for name in names))
    after = side("b", *(row(moved(pixels(1), index, 0, 0), name=name) for index, name in enumerate(names)))
    found = compare(before, after, asked("mean", 1.0, 2.0, over="rows"))
    assert [one.value for one in found.pooled] == [pytest.approx(1.5, abs=1e-3)] and found.exit_code == 1


@pytest.mark.parametrize("formula", ["CIE 1976", "CIE 1994", "CIE 2000", "CMC 2:1", "CAM16-UCS"])
def test_each_formula_finds_what_was_put_in(formula):
    found = result(row(pixels()), row(moved(pixels(), 1.0, 0, 0)), asked("mean", 9, 9, formula=formula))
    assert found.valid and found.checks
    assert 0.3 < found.rows[0].asked[0].value < 1.7


def test_a_criterion_that_applies_to_nothing_is_said():
    found = result(row(pixels()), row(pixels()), asked("mean", 1, 2, subset={"material": "metal/*"}))
    assert any("applies to no row" in note for note in found.notes)
    # And nobody has said what its row may do.
    assert any(note.startswith("A row is held against no criterion") for note in found.notes)
    found = result(row(pixels()), row(pixels()), asked("mean", 1, 2))
    assert not any("no criterion" in note for note in found.notes)


def test_what_made_the_sides_is_said_where_it_differs():
    before, after = side("a", row(pixels()), metamer="0.1"), side("b", row(pixels()), metamer="0.2")
    assert compare(before, after, default_criteria()).notes == ("Metamer changed from 0.1 to 0.2.",)


@pytest.mark.parametrize(
    ("after", "words"),
    [
        (row(pixels(white_xyz=np.array([1.0985, 1.0, 0.3558]))), "different whites"),
        (row(pixels(40)), "different sizes"),
        (row(pixels(), name=NAME._replace(observer="CIE 1964 10 Degree Standard Observer")), "other observers"),
        (row(pixels(), name=NAME._replace(material="metal/gold")), "no row in common(?s:.*)metamer match"),
        (row(pixels(coverage=np.zeros((80, 80), np.float32))), "no pixel is covered"),
    ],
)
def test_what_cannot_be_compared_is_refused_by_name(after, words):
    with pytest.raises(ComparisonError, match=words) as refused:
        result(row(pixels()), after)
    assert refused.value.exit_code == 3


def test_a_side_is_not_compared_with_itself(tmp_path):
    with pytest.raises(ComparisonError, match="are the same"):
        compare(side(tmp_path, row(pixels())), side(tmp_path, row(pixels())), default_criteria())
    held = pixels()
    with pytest.raises(ComparisonError, match="same array"):
        result(row(held), row(held))


def test_two_rows_of_one_name_are_refused():
    with pytest.raises(InputError, match="two rows of one name"):
        compare(side("a", row(pixels()), row(pixels())), side("b", row(pixels())), default_criteria())
