"""Files: sessions saved and restored, what is dropped, hot reload with the last good one kept, screenshots."""

import shutil
import time
from pathlib import Path

import numpy as np
from metamer.viewer.window.state import SESSION_FILE
from metamer.viewer.window.workspace import SAID_S
from PIL import Image

# All of it is done in the folder that the process runs in.
SCENE = Path("own.toml")


def alike(picture, other):
    """Drawn anew, a pixel on the edge of a shadow may round to its other side."""
    return (picture != other).mean() < 1e-3


def check_a_scene_is_opened_by_its_name(it):
    it.settled()
    shutil.copy(it.session.subject.path, SCENE)
    before = it.session
    it.key("Ctrl+O")
    it.frames(2)
    it.type("Dialog/##file", str(SCENE))
    it.wait(lambda: it.desk.loaded.subject.path == str(SCENE), "the scene")
    it.settled()
    assert it.session.subject.path == str(SCENE) and it.session.view == before.view


def check_a_session_is_saved_and_restored(it):
    it.click("Top/FL2##light")
    it.key("E")
    it.key("Ctrl+S")
    it.frames(2)
    assert it.desk.dialog == "save.as"
    it.type("Dialog/##file", "mine")
    saved = SESSION_FILE.read("mine.toml")
    assert saved == it.session.settled and saved.exposure == 0.5
    it.key("R")
    it.click("Top/A##light")
    assert it.session.settled != saved
    it.desk.open("mine.toml")
    it.settled()
    assert it.session.settled == saved
    it.key("R")
    it.key("1")


def check_nothing_is_written_over_without_a_word(it):
    it.settled()
    text, kept = SCENE.read_text(encoding="utf-8"), Path("kept.toml")
    kept.write_text("precious = true\n", encoding="utf-8")
    it.desk.dialog = "save.as"
    it.frames(3)
    # The scene that is looked at: refused, whatever else is pressed.
    it.type("Dialog/##file", str(SCENE))
    it.type("Dialog/##file", str(SCENE))
    assert "is being looked at" in it.said and SCENE.read_text(encoding="utf-8") == text
    # Another file that is there: asked about once.
    it.type("Dialog/##file", "kept")
    assert it.desk.dialog == "save.as" and kept.read_text(encoding="utf-8") == "precious = true\n"
    it.type("Dialog/##file", "kept")
    assert it.desk.dialog is None and SESSION_FILE.read(kept) == it.session.settled
    it.desk.forget("save.as")
    it.desk.path = None


def check_a_screenshot_is_a_png_whatever_it_is_called(it):
    it.desk.dialog = "screenshot.as"
    it.frames(3)
    it.type("Dialog/##file", "mine.jpg")
    it.wait(lambda: "mine.jpg.png" in it.said, "the screenshot")
    assert Image.open("mine.jpg.png").format == "PNG" and not Path("mine.jpg").exists()


def check_what_is_no_scene_is_said(it):
    Path("notes.toml").write_text("hello = [", encoding="utf-8")
    it.window.dropped(["notes.toml"])
    it.wait(lambda: "notes.toml" in it.said, "a message")
    it.settled()
    before = it.frame
    it.key("Ctrl+Z")
    it.wait(lambda: it.desk.loaded.is_of(it.session) and not it.window.files.busy(), "the scene again")
    it.settled()
    assert it.session.subject.path == str(SCENE) and before is not None


def check_a_changed_scene_is_read_again(it):
    before = it.picture().astype(int)
    text = SCENE.read_text(encoding="utf-8")
    SCENE.write_text(text.replace('"tiny/satin-green"', '"tiny/matt-red"'), encoding="utf-8")
    it.wait(lambda: it.desk.choices.worn["body"] == "tiny/matt-red", "the changed scene")
    it.settled()
    it.wait(lambda: np.abs(it.picture() - before).mean() > 1.0, "another picture")


def check_a_scene_that_breaks_while_it_is_reloaded_leaves_the_last_good_one(it):
    it.settled()
    before, text = it.picture(), SCENE.read_text(encoding="utf-8")
    SCENE.write_text(text.replace('kind = "point"', 'kind = "pint"'), encoding="utf-8")
    it.wait(lambda: "pint" in it.said, "why it is not read")
    it.settled()
    assert alike(it.picture(), before)
    assert it.session.subject.path == str(SCENE)
    it.key("A")
    SCENE.write_text(text, encoding="utf-8")
    it.wait(lambda: "pint" not in it.said, "the mended scene")
    it.settled()


def check_a_shader_that_breaks_leaves_the_last_good_ones(it):
    """In a folder of shaders of its own, so that nothing of the program changes."""
    from metamer.viewer.gl import shaders

    folder, real = Path("shaders"), shaders.shader_folder
    shutil.copytree(real(), folder)
    it.settled()
    before, file = it.picture(), folder / "compare.frag"
    text = file.read_text(encoding="utf-8")
    shaders.shader_folder = lambda: folder.resolve()
    try:
        file.write_text(text.replace("void main", "void mmain"), encoding="utf-8")
        it.key("F5")
        it.wait(lambda: "compare.frag" in it.said, "why it does not compile")
        it.settled()
        assert alike(it.picture(), before)
        file.write_text(text, encoding="utf-8")
        it.key("F5")
        it.wait(lambda: "compare.frag" not in it.said, "the mended shader")
    finally:
        shaders.shader_folder = real
    it.settled()
    assert alike(it.picture(), before)


def check_a_light_of_no_power_is_said(it):
    text = SCENE.read_text(encoding="utf-8")
    Path("dark.csv").write_text("wavelength_nm,power\n" + "".join(f"{nm},0\n" for nm in range(380, 785, 5)), "utf-8")
    before = it.picture()
    it.type("Left/##lamp", "dark.csv")
    it.wait(lambda: any(one.problem for one in it.desk.notices), "that it is dark")
    assert "zero power" in it.said and "Ctrl+Z takes the last step back" in it.said
    assert not any(it.context.item_exists(f"//Notices/Dismiss##{one.about}") for one in it.desk.notices)
    it.frames(3)
    assert alike(it.picture(), before)
    it.key("Ctrl+Z")
    it.frames(3)
    assert not any(one.problem for one in it.desk.notices) and text


def check_a_catalogue_that_is_replaced_underneath_is_read_again(it):
    folder = Path("catalogue")
    shutil.copytree(it.session.catalogue, folder)
    it.desk.do(lambda session: session.__class__(**{**vars(session), "catalogue": str(folder)}), "Catalogue")
    it.wait(lambda: it.desk.loaded.catalogue.folder == folder, "the other catalogue")
    it.settled()
    before = it.picture().astype(int)
    # Another material under the old name is refused; one that is taken away is said; put back, all is well.
    red = folder / "tiny" / "matt-red.h5"
    kept = red.read_bytes()
    red.unlink()
    it.wait(lambda: "matt-red" in it.said and any(one.problem for one in it.desk.notices), "that it is gone")
    assert alike(it.picture(), before)
    red.write_bytes(kept)
    it.wait(lambda: not any(one.problem for one in it.desk.notices), "that it is back")
    it.settled()
    assert alike(it.picture(), before)


def check_a_screenshot_says_how_it_was_made(it):
    it.settled()
    it.key("F12")
    it.wait(lambda: "metamer-" in it.said, "the screenshot")
    (file,) = Path().glob("metamer-*.png")
    picture = Image.open(file)
    words = picture.text["Description"]
    assert "OCIO sRGB - Display / Un-tone-mapped" in words and "CIE 1931 2°" in words and "metamer_session" in words
    np.testing.assert_array_equal(np.asarray(picture), it.picture())
    assert time.time() - file.stat().st_mtime < 60


def check_a_name_without_glyphs_is_shown_all_the_same(it):
    shutil.copy(SCENE, "ニス-Δλ.toml")
    it.window.dropped(["ニス-Δλ.toml"])
    it.wait(lambda: it.desk.loaded.subject.path == "ニス-Δλ.toml", "the scene")
    it.settled()
    it.desk.tell("ニス 🎨 \x07", problem=True, about="test")
    it.frames(3)
    it.click("Notices/Dismiss##test")
    assert not any(one.about == "test" for one in it.desk.notices)


def check_a_message_stays_while_the_mouse_is_over_it(it):
    """Else what is below it moves up, away from under the mouse."""
    it.desk.tell("A message", about="message")
    it.desk.tell("A problem", problem=True, about="problem")
    it.frames(3)
    it.context.mouse_move("//Notices/Dismiss##problem")
    clock = it.desk._clock
    it.desk._clock = lambda: clock() + 2.0 * SAID_S
    it.frames(3)
    it.context.mouse_down()
    it.frames(3)
    assert "A message" in it.said
    it.context.mouse_up()
    it.context.mouse_move_to_pos((1.0, 1.0))
    it.frames(3)
    it.desk._clock = clock
    assert "A message" not in it.said and "A problem" not in it.said


def check_no_other_problem_is_dismissed_where_a_message_goes_meanwhile(it):
    it.desk.tell("A message", about="message")
    for about in ("first", "second"):
        it.desk.tell("A problem", problem=True, about=about)
    it.frames(3)
    it.context.mouse_move("//Notices/Dismiss##first")
    it.context.mouse_down()
    it.desk.forget("message")
    it.frames(3)
    it.context.mouse_up()
    it.frames(2)
    assert any(one.about == "second" for one in it.desk.notices)
    for about in ("first", "second"):
        it.desk.forget(about)
