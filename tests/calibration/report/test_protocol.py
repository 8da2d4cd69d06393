"""A reviewer's protocol: kept in a file, shown in the report, and no part of its verdict."""

import json

import pytest
from metamer.calibration.report.rating import Probed, Rating, as_json, read_protocol, write_protocol
from metamer.runtime.errors import InputError, UnknownNameError

SEEN = ("paint/red", "FL11", "1931_2")
APPROVED = Rating(
    *SEEN, "approved", 4, 'fine <in> the "shop"', "M. K.", "2026-03-01T12:00:00+00:00", (Probed("L*", 41.25),)
)
REJECTED = Rating("paint/red", "A", "1931_2", "rejected", note="zu grün\n✗")


def test_a_protocol_is_read_back_as_it_was_written(tmp_path):
    write_protocol(tmp_path / "p.toml", [APPROVED, REJECTED])
    assert read_protocol(tmp_path / "p.toml") == (APPROVED, REJECTED)


def test_who_rates_again_is_believed_the_last_time(tmp_path):
    again = Rating(*SEEN, "rejected")
    write_protocol(tmp_path / "p.toml", [APPROVED, REJECTED, again])
    assert read_protocol(tmp_path / "p.toml") == (again, REJECTED)


def test_an_empty_protocol_is_one(tmp_path):
    write_protocol(tmp_path / "p.toml", [])
    assert read_protocol(tmp_path / "p.toml") == ()


ONE = 'metamer_protocol = 1\n[[ratings]]\nmaterial = "a"\nlight = "A"\nobserver = "1931_2"\n'


@pytest.mark.parametrize(
    ("text", "field", "found"),
    [
        ("x = 1", "metamer_protocol", None),
        ("metamer_protocol = 7", "metamer_protocol", 7),
        (f"{ONE}score = 6", "ratings 1.score", 6),
        (f"{ONE}score = true", "ratings 1.score", "True"),
        (f'{ONE}[[ratings.probed]]\nname = "L*"\nvalue = nan', "ratings 1.probed 1.L*", float("nan")),
        (ONE + ONE.partition("\n")[2], "ratings", "a under A"),
    ],
)
def test_what_is_wrong_with_a_protocol_is_named_by_its_place(tmp_path, text, field, found):
    (tmp_path / "p.toml").write_text(text)
    with pytest.raises(InputError) as raised:
        read_protocol(tmp_path / "p.toml")
    assert raised.value.field == field and str(raised.value.found) == str(found)
    assert raised.value.file == tmp_path / "p.toml"


def test_another_verdict_is_refused_with_those_that_there_are(tmp_path):
    (tmp_path / "p.toml").write_text(f'{ONE}verdict = "approval"')
    with pytest.raises(UnknownNameError) as raised:
        read_protocol(tmp_path / "p.toml")
    assert raised.value.nearest[0] == "approved"


def test_what_was_not_said_is_null_in_json():
    first, second = json.loads(json.dumps(as_json([APPROVED, REJECTED])))
    assert first["probed"] == {"L*": 41.25} and first["score"] == 4 and first["reviewer"] == "M. K."
    assert second["score"] is None and second["reviewer"] is None and second["probed"] == {}
