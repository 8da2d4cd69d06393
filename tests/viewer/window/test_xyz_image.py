"""Pictures in XYZ, as reviews keep them, beside one another: as they are, and nothing that would need spectra."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from metamer.calibration.report.page import window_command
from metamer.cli import view
from metamer.cli.main import main
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.xyz_exr import write_xyz_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.image import ColourImage
from metamer.spectral.observers import OBSERVERS, observer
from metamer.viewer.gl.tile import read
from metamer.viewer.window.image_frame import ImageFrame
from metamer.viewer.window.image_probe import image_reading
from metamer.viewer.window.light_choice import LightChoice
from metamer.viewer.window.session_loader import comparison_of, load, subject_of, subject_of_file
from metamer.viewer.window.spectral_image import XyzPicture
from metamer.viewer.window.spectral_image_file import read_looked_at
from metamer.viewer.window.state import SESSION_FILE, Compare, Other, Subject
from metamer.viewer.window.workspace import begun

SIZE = 7, 5
WHITE = observer("1964_10").white(illuminant("A"))
XYZ = np.random.default_rng(5).uniform(0.05, 0.6, (5, 7, 3)).astype(np.float32)
COVERAGE = np.ones((5, 7), dtype=np.float32)
COVERAGE[0] = 0.25


@pytest.fixture
def files(tmp_path):
    """A reference and a picture, as a review writes them."""
    said = {"illuminant": "A", "observer": OBSERVERS["1964_10"]}
    for name, factor in (("reference", 1.0), ("picture", 1.05)):
        image = ColourImage(factor * COVERAGE[..., None] * XYZ, "xyz", WHITE)
        write_xyz_exr(tmp_path / f"{name}.exr", image, COVERAGE, said)
    return str(tmp_path / "reference.exr"), str(tmp_path / "picture.exr")


@pytest.fixture
def loaded(files, tiny_catalogue):
    return load(Subject("image", files[0]), str(tiny_catalogue))


@pytest.fixture
def frame(gl, loaded):
    made = ImageFrame(gl, loaded.image, loaded.catalogue)
    yield made
    made.release()


def test_a_picture_says_its_light_its_observer_and_its_white(files, tmp_path):
    found = read_looked_at(files[0])
    assert isinstance(found, XyzPicture) and found.kind == "XYZ" and not found.notes
    assert (found.light, found.observer) == ("A", OBSERVERS["1964_10"])
    np.testing.assert_allclose(found.white, WHITE, rtol=1e-6)
    np.testing.assert_array_equal(found.coverage, COVERAGE)
    # Another program's: what it does not say is said to be missing, and no white is no colour.
    write_xyz_exr(tmp_path / "bare.exr", ColourImage(XYZ, "xyz", WHITE), COVERAGE, {"observer": "the cat"})
    bare = read_looked_at(tmp_path / "bare.exr")
    assert bare.observer == bare.light == "" and len(bare.notes) == 2
    assert bare.folded(observer("1931_2")).values.shape == (5, 7, 3)
    write_exr(tmp_path / "none.exr", {}, dict.fromkeys("XYZ", XYZ[..., 0]))
    with pytest.raises(InputError, match="white"):
        read_looked_at(tmp_path / "none.exr")


def test_what_needs_spectra_is_refused(files):
    picture, eye = read_looked_at(files[0]), observer("1964_10")
    np.testing.assert_array_equal(picture.folded(eye).values, np.moveaxis(picture.planes, 0, 2))
    for field, settings in (("light", {"light": illuminant("A")}), ("light", {"own_light": illuminant("A")}),
                            ("luminance", {"luminance": 100.0})):  # fmt: skip
        with pytest.raises(InputError) as caught:
            picture.folded(eye, **settings)
        assert caught.value.field == field
    with pytest.raises(InputError, match="one observer"):
        picture.folded(observer("1931_2"))


def test_two_images_are_named_to_see_one_beside_the_other(files, tiny_catalogue):
    assert subject_of(files, Catalogue.open(tiny_catalogue)) == Subject("image", files[0])
    assert comparison_of(files) == {"other": Other(made="file", file=files[1]), "compare": Compare("wipe")}
    assert comparison_of(files[:1]) == comparison_of(()) == {}
    assert str(window_command(*files)).split()[1:] == ["view", files[0], f"{files[1]}</code>"]
    with pytest.raises(InputError, match="several things"):
        subject_of((*files, files[0]), Catalogue.open(tiny_catalogue))
    with pytest.raises(InputError):
        comparison_of((files[0], "gone.exr"))


@pytest.mark.parametrize("name", ["ball.glb", "ball.OBJ"])
def test_a_mesh_in_place_of_a_scene_is_told_where_it_goes(name, tiny_catalogue, tmp_path):
    (tmp_path / name).write_bytes(b"glTF\0")
    with pytest.raises(InputError, match=r"(?s)a mesh, not a scene.*mesh = \"ball"):
        subject_of([str(tmp_path / name)], Catalogue.open(tiny_catalogue))


@pytest.fixture
def opened(monkeypatch):
    """Runs `metamer view` in a folder where no catalogue is, up to the window: words -> what it would show."""
    desks = []
    shell = SimpleNamespace(check_screen=lambda: None, run=lambda desk, keep: desks.append(desk))
    monkeypatch.setattr(view, "window_module", lambda name: shell)

    def run(*words):
        code = main(["view", *map(str, words)])
        return desks.pop() if code == 0 else code

    return run


def test_images_are_opened_where_no_catalogue_is(opened, files, tiny_catalogue, tmp_path, monkeypatch):
    """A review that was handed on: nothing is imported to look at its pictures."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("METAMER_CATALOGUE", raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    desk = opened(*files)
    assert desk.session.subject.path == files[0] and desk.session.other.file == files[1]
    assert not (tmp_path / "metamer-catalogue").exists()
    assert opened(files[0], "--catalogue", "none") == 4
    # A session is opened with the catalogue that is named beside it.
    SESSION_FILE.write("s.toml", desk.session)
    assert opened("s.toml", "--catalogue", tiny_catalogue).loaded.catalogue.folder == tiny_catalogue


@pytest.mark.parametrize("name", ["review", "review/review.json", "page.html"])
def test_what_is_there_and_is_not_shown_is_called_so(name, tiny_catalogue, tmp_path):
    (tmp_path / "review").mkdir()
    for file in ("review/review.json", "page.html"):
        (tmp_path / file).write_text("{}")
    catalogue, path = Catalogue.open(tiny_catalogue), str(tmp_path / name)
    with pytest.raises(InputError, match="nothing that the window shows") as said:
        subject_of([path], catalogue)
    assert "each row of the page" in str(said.value) and "unknown material" not in str(said.value)
    with pytest.raises(InputError, match="unknown material"):
        subject_of([path + "x"], catalogue)
    if name == "review":
        with pytest.raises(InputError, match="nothing that the window shows"):
            subject_of_file(path)


def test_both_are_seen_for_their_observer_and_compared(gl, frame, loaded, files):
    session = begun(loaded, other=Other(made="file", file=files[1]), compare=Compare("difference"))
    assert session.observer == "1964_10" and not session.light.lamps
    frame.show(session, SIZE)
    frame.step()
    assert frame.problem is None
    first, second = (read(one) for one in frame.canvases)
    np.testing.assert_allclose(first[..., :3], COVERAGE[..., None] * XYZ, rtol=1e-6)
    np.testing.assert_array_equal(first[..., 3], COVERAGE)
    statistics, _ = frame.statistics()
    off = delta_e_xyz(XYZ[1:].astype(float), 1.05 * XYZ[1:].astype(float), WHITE)
    assert statistics.pixels == 28 and statistics.mean == pytest.approx(off.mean(), abs=2e-3)
    assert np.abs(second[1:, :, :3] - 1.05 * XYZ[1:]).max() < 1e-6


def test_another_light_is_refused_and_what_was_seen_stays(frame, loaded, files):
    session = begun(loaded)
    frame.show(session, SIZE)
    frame.step()
    before = read(frame.canvases[0])
    for change in ({"light": LightChoice.named("D65")}, {"observer": "1931_2"}):
        frame.show(replace(session, **change), SIZE)
        assert "a picture in XYZ" in frame.problem
        np.testing.assert_array_equal(read(frame.canvases[0]), before)


def test_a_probe_has_colours_and_no_spectra(frame, loaded):
    session = begun(loaded)
    reading = image_reading(frame, session, 0, replace(session.light, dimming=0.5), session.observer, (3, 2))
    np.testing.assert_allclose(reading.xyz, 0.5 * XYZ[2, 3], rtol=1e-6)
    assert reading.spectra is None and reading.coverage == 1.0
    assert (reading.light, reading.observer) == ("A", OBSERVERS["1964_10"])
    with pytest.raises(InputError, match="one light"):
        image_reading(frame, session, 0, LightChoice.named("D65"), session.observer, (3, 2))
