"""Workspace of an open window: its session with all that was done, and what it has to say."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...runtime.errors import MetamerError
from ...spectral.observers import OBSERVERS
from .choices import Choices, opened
from .command_list import commands
from .commands import Change, Command, Commands, Dial
from .history import History
from .light_choice import LightChoice
from .session_loader import Loaded, subject_of_file
from .spectral_image import XyzPicture
from .state import SESSION_FILE, Session, Subject

#: Seconds for which something that went well is said; problems stay until they are dismissed or solved.
SAID_S = 6.0


@dataclass(frozen=True)
class Notice:
    """Something that is said. about : of what; a later notice about the same takes its place. until : None stays."""

    words: str
    problem: bool
    about: str
    until: float | None


class Desk:
    """All changes of a session come here: by commands, by dials, by what a panel makes of a click.

    Attributes
    ----------
    history : with the session as it is now. loaded : what is in memory; the session may name something else, which
    then is being loaded. notices : the last one last. dialog : by the name of the command that opened it, or None.
    path : of the session's file, once it has one. actions : what the window does for commands that change no session.
    """

    def __init__(self, loaded: Loaded, session: Session, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.history = History(session)
        self.put(loaded)
        self.notices: tuple[Notice, ...] = ()
        self.dialog: str | None = None
        self.path: Path | None = None
        self.reviewer = ""
        self.actions: dict[str, Callable[[], None]] = {
            "undo": self.undo,
            "redo": self.redo,
            "save": self.save,
        }

    @property
    def session(self) -> Session:
        """Session as it is now."""
        return self.history.now

    @property
    def choices(self) -> Choices:
        """Choices of the session."""
        return self.loaded.choices

    @property
    def looked_at(self) -> tuple[Path, ...]:
        """Files that the session shows, which nothing is written over."""
        other = self.session.other.file
        return (*self.loaded.files, *([] if other is None else [Path(other)]))

    def put(self, loaded: Loaded) -> None:
        """Work on what was loaded."""
        self.loaded = loaded
        self.commands: Commands = commands(loaded.choices)

    def run(self, command: Command | str) -> None:
        """Do what a command says, by itself or by its name."""
        command = self.commands[command] if isinstance(command, str) else command
        if command.change is not None:
            self.do(command.change, command.words)
            return
        if command.name in self.actions:
            self.actions[command.name]()
        else:
            self.dialog = command.name

    def hold(self, command: Command, down: bool) -> None:
        """A key that acts while it is held is pressed or released; nobody undoes that."""
        if self.session.flicked != down:
            self.history = self.history.passed(command(self.session))

    def do(self, change: Change, words: str, stroke: str | None = None) -> bool:
        """Change the session; a change that is refused is said, and nothing changes. Whether it was done.

        stroke : names a drag, all of which is one step to undo.
        """
        try:
            after = change(self.session)
        except MetamerError as reason:
            self.tell(str(reason), problem=True, about=words)
            return False
        self.history = self.history.done(after, words, stroke)
        return True

    def turn(self, dial: Dial, value: float) -> None:
        """A slider is dragged."""
        self.do(lambda session: dial.at(session, value), dial.words, stroke=dial.name)

    def pass_to(self, session: Session) -> None:
        """Apply a change that nobody undoes: the pointer has moved, the turntable gone on."""
        self.history = self.history.passed(session)

    def release(self) -> None:
        """The mouse was let go: the next drag is a step of its own."""
        if self.history.stroke is not None:
            self.history = self.history.released()

    def undo(self) -> None:
        """Take the last step back, and say which."""
        words = self.history.undo_words
        self.history = self.history.undo()
        self.tell(f"Undone: {words}" if words else "Nothing to undo", about="undo")

    def redo(self) -> None:
        """Do again what was undone."""
        words = self.history.redo_words
        self.history = self.history.redo()
        self.tell(f"Done again: {words}" if words else "Nothing to do again", about="undo")

    def open(self, path: str) -> None:
        """Look at a file: a scene, an image, or a session that was saved. To undo it is to go back."""
        try:
            found = subject_of_file(path)
        except MetamerError as reason:
            self.tell(str(reason), problem=True, about="open")
            return
        self.forget("open")
        if isinstance(found, Session):
            self.path = Path(path)
            self.do(lambda session: found, f"Open {Path(path).name}")
        else:
            self.look_at(found, Path(path).name)

    def look_at(self, subject: Subject, called: str) -> None:
        """Another subject; where the camera stands in it is known once it is loaded."""
        self.do(lambda session: Session(subject=subject, catalogue=session.catalogue,
                                        interface=session.interface, ratings=session.ratings),
                f"Open {called}")  # fmt: skip

    def arrived(self, loaded: Loaded) -> None:
        """Take what has been loaded for the session: a session that says no more than that begins as the scene does."""
        self.put(loaded)
        now = self.session.settled
        bare = Session(subject=now.subject, catalogue=now.catalogue, interface=now.interface, ratings=now.ratings)
        if now == bare:
            session = begun(loaded, interface=now.interface, ratings=now.ratings)
            self.history = replace(self.history, now=session.with_passing_of(self.session))

    def save(self) -> None:
        """Write the session to its file; where it has none, that is asked for."""
        if self.path is None:
            self.dialog = "save.as"
        else:
            self.save_as(self.path)

    def save_as(self, file: Path) -> bool:
        """Write the session; whether it was written."""
        done = self.attempt(lambda: SESSION_FILE.write(file, self.session), "save", f"Saved: {file}")
        if done:
            self.path = file
        return done

    def attempt(self, work: Callable[[], object], about: str, said: str) -> bool:
        """Do something with files; say `said`, or why it was not done. Whether it was."""
        try:
            work()
        except (MetamerError, OSError) as reason:
            self.tell(str(reason), problem=True, about=about)
            return False
        self.tell(said, about=about)
        return True

    def tell(self, words: str, problem: bool = False, about: str = "") -> None:
        """Say something; problems stay."""
        self.forget(about)
        until = None if problem else self._clock() + SAID_S
        self.notices = (*self.notices, Notice(words, problem, about, until))

    def forget(self, about: str) -> None:
        """Drop what was said about something."""
        self.notices = tuple(one for one in self.notices if one.about != about)

    def said(self, held: bool = False) -> tuple[Notice, ...]:
        """Messages to be read now; while they are held, none goes because its time is up."""
        now = self._clock()
        self.notices = tuple(one for one in self.notices if held or one.until is None or now < one.until)
        return self.notices


def begun(loaded: Loaded, **settings: Any) -> Session:
    """Return the session that a window begins with: as the scene says; an image in its own light, reflectances in D65,
    and pictures in XYZ for their observer.
    """
    subject, catalogue = loaded.subject, loaded.catalogue_name
    if loaded.scene is not None:
        return opened(loaded.scene, subject, catalogue, **settings)
    reflects = loaded.image is not None and loaded.image.kind == "reflectance"
    light = LightChoice.named("D65") if reflects else LightChoice()
    if isinstance(loaded.image, XyzPicture):
        known = {name: short for short, name in OBSERVERS.items()}
        settings["observer"] = known.get(loaded.image.observer, Session.observer)
    return Session(subject=subject, catalogue=catalogue, light=light, **settings)
