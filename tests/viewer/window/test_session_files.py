"""Sessions in files: what is written is read back, and what cannot be is refused by its place."""

import tomllib
from dataclasses import replace

import pytest
from hypothesis import given, settings
from metamer.runtime.errors import InputError, NoRoomError, UnknownNameError
from metamer.runtime.toml_records import record_of
from metamer.viewer.window.session_loader import load
from metamer.viewer.window.state import SESSION_FILE, Session, Subject
from window_sessions import sessions


# Checks of types look at some items of a list, drawn at random, which hypothesis warns of.
@pytest.mark.filterwarnings("ignore:Do not use the `random` module")
@given(session=sessions)
@settings(deadline=None, max_examples=40)
def test_any_session_is_read_back_as_it_was_written(session):
    document = tomllib.loads(SESSION_FILE.text(session))
    assert document.pop("metamer_session") == SESSION_FILE.version
    assert record_of(Session, document) == session


def test_a_session_goes_through_a_file(tmp_path):
    session = replace(Session(exposure=0.1 + 0.2), cursor=(0.5, 0.5), flicked=True)
    SESSION_FILE.write(tmp_path / "a.toml", session)
    assert SESSION_FILE.read(tmp_path / "a.toml") == session.settled != session
    assert SESSION_FILE.is_one(tmp_path / "a.toml")
    assert [path.name for path in tmp_path.iterdir()] == ["a.toml"]


def test_a_catalogue_behind_a_url_is_refused_before_it_is_asked():
    with pytest.raises(InputError, match=r"the window needs a folder, not a URL"):
        load(Subject("scene"), "nosuch://host/cat")


def test_a_scene_is_no_session(tmp_path):
    (tmp_path / "scene.toml").write_text('[[part]]\nshape = "sphere"\n')
    assert not SESSION_FILE.is_one(tmp_path / "scene.toml") and not SESSION_FILE.is_one(tmp_path / "none.toml")
    with pytest.raises(InputError, match="not a session of the window"):
        SESSION_FILE.read(tmp_path / "scene.toml")


WRONG = {
    "metamer_session = 1\nexposure = 11.0": ("exposure", "11.0", "-10 to 10 stops"),
    'metamer_session = 1\nexposure = "bright"': ("exposure", "'bright'", "a number"),
    "metamer_session = 1\nexposure = true": ("exposure", "True", "a number"),
    "metamer_session = 1\nexposure = nan": ("exposure", "nan", "-10 to 10 stops"),
    "metamer_session = 1\nsamples = 2.0": ("samples", "2.0", "a whole number"),
    "metamer_session = 1\nsubject = 3": ("subject", "3", r"a table, [subject]"),
    "metamer_session = 1\n[view]\nposition = [1, 2]": ("view.position", "[1, 2]", "a list of 3 values"),
    "metamer_session = 1\n[view]\nup = [0, 0, 1]": ("view.up", "[0.0, 0.0, 1.0]", "a direction across the view"),
    'metamer_session = 1\n[[pins]]\npart = "a"\ntriangle = 0\nweights = [1, 0, 0]': ("pins 1.name", None, "a value"),
    'metamer_session = 1\n[[worn]]\npart = "a"\nmaterial = "b"\n[[worn]]\npart = "a"\nmaterial = "c"': (
        "worn", "a", "each once",
    ),
    "metamer_session = 1\n[light]\ndimming = 0": ("light.dimming", "0.0", "0.001 to 1"),
    'metamer_session = 1\n[other]\nmade = "file"': ("other.file", None, "a picture's file"),
    "metamer_session = 1\npins = 4": ("pins", "4", "tables, [[pins]]"),
    "metamer_session = 2": ("metamer_session", "2", "1, which is what this one reads"),
    "metamer_session = 0": ("metamer_session", "0", "1"),
    "metamer_session = true": ("metamer_session", "True", "1"),
}  # fmt: skip


@pytest.mark.parametrize("text", WRONG)
def test_a_mistake_is_named_by_file_key_found_and_expected(tmp_path, text):
    field, found, expected = WRONG[text]
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(InputError) as raised:
        SESSION_FILE.read(tmp_path / "s.toml")
    error = raised.value
    assert str(error.file) == str(tmp_path / "s.toml") and error.field == field
    assert (error.found is None) if found is None else (str(error.found) == found)
    assert error.expected is not None and expected in error.expected


@pytest.mark.parametrize(
    ("text", "nearest"),
    [
        ("exposur = 1", "exposure"),
        ('observer = "1931"', "1931_2"),
        ('[compare]\nmode = "wype"', "wipe"),
        ('[light]\nbooth = "TL87"', "TL84"),
    ],
)
def test_a_misspelt_name_is_told_with_its_neighbour(tmp_path, text, nearest):
    (tmp_path / "s.toml").write_text(f"metamer_session = 1\n{text}\n")
    with pytest.raises(UnknownNameError) as raised:
        SESSION_FILE.read(tmp_path / "s.toml")
    assert nearest in raised.value.nearest


def test_what_is_no_toml_is_refused(tmp_path):
    (tmp_path / "s.toml").write_text("metamer_session = = 1")
    with pytest.raises(InputError, match="not a TOML file"):
        SESSION_FILE.read(tmp_path / "s.toml")


def test_a_full_disk_leaves_the_session_that_was_there(tmp_path, room_for):
    SESSION_FILE.write(tmp_path / "s.toml", Session())
    long = Session(subject=Subject(materials=tuple(f"family/{number}" for number in range(2000))))
    with room_for(4096), pytest.raises((NoRoomError, OSError)):
        SESSION_FILE.write(tmp_path / "s.toml", long)
    assert SESSION_FILE.read(tmp_path / "s.toml") == Session()
    assert len(list(tmp_path.iterdir())) == 1


def test_half_a_character_is_refused_by_its_place(tmp_path):
    with pytest.raises(InputError, match="path: text that cannot be kept"):
        Session(subject=Subject(path="scene-\udcff.toml"))
