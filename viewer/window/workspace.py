"""Workspace of an open window: its session with history, and notices."""

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

#: Seconds that a message is shown; problems stay until dismissed or solved.
SAID_S = 6.0


@dataclass(frozen=True)
class Notice:
    """Notice to the user. about : its subject; a later notice about the same replaces it. until : None stays."""

    words: str
    problem: bool
    about: str
    until: float | None


class Desk:
    """Mediator of all changes of a session, by commands, dials and panels.

    Attributes
    ----------
    history : with the current session. loaded : subject in memory; a different one named by the session is being
    loaded. notices : last one last. dialog : name of the command that opened it, or None.
    path : of the session's file, or None. actions : of the window, for commands without change of the session.
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
        """Current session."""
        return self.history.now

    @property
    def choices(self) -> Choices:
        """Choices for the session."""
        return self.loaded.choices

    @property
    def looked_at(self) -> tuple[Path, ...]:
        """Files shown by the session, which are never overwritten."""
        other = self.session.other.file
        return (*self.loaded.files, *([] if other is None else [Path(other)]))

    def put(self, loaded: Loaded) -> None:
        """Set the loaded subject."""
        self.loaded = loaded
        self.commands: Commands = commands(loaded.choices)

    def run(self, command: Command | str) -> None:
        """Run a command, given itself or its name."""
        command = self.commands[command] if isinstance(command, str) else command
        if command.change is not None:
            self.do(command.change, command.words)
            return
        if command.name in self.actions:
            self.actions[command.name]()
        else:
            self.dialog = command.name

    def hold(self, command: Command, down: bool) -> None:
        """Press or release a key that acts while held; not undoable."""
        if self.session.flicked != down:
            self.history = self.history.passed(command(self.session))

    def do(self, change: Change, words: str, stroke: str | None = None) -> bool:
        """Change the session; a refused change gives a notice. Return whether it was done.

        stroke : name of a drag, which is one undo step.
        """
        try:
            after = change(self.session)
        except MetamerError as reason:
            self.tell(str(reason), problem=True, about=words)
            return False
        self.history = self.history.done(after, words, stroke)
        return True

    def turn(self, dial: Dial, value: float) -> None:
        """Set the value of a dial while dragging."""
        self.do(lambda session: dial.at(session, value), dial.words, stroke=dial.name)

    def pass_to(self, session: Session) -> None:
        """Apply a change that is not undoable, as of pointer or turntable."""
        self.history = self.history.passed(session)

    def release(self) -> None:
        """End a drag, so that the next one is a separate step."""
        if self.history.stroke is not None:
            self.history = self.history.released()

    def undo(self) -> None:
        """Undo the last step, with a notice."""
        words = self.history.undo_words
        self.history = self.history.undo()
        self.tell(f"Undone: {words}" if words else "Nothing to undo", about="undo")

    def redo(self) -> None:
        """Redo the last undone step."""
        words = self.history.redo_words
        self.history = self.history.redo()
        self.tell(f"Done again: {words}" if words else "Nothing to do again", about="undo")

    def open(self, path: str) -> None:
        """Open a file: a scene, an image, or a saved session; undoable."""
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
        """Switch to another subject, whose camera is known once it is loaded."""
        self.do(lambda session: Session(subject=subject, catalogue=session.catalogue,
                                        interface=session.interface, ratings=session.ratings),
                f"Open {called}")  # fmt: skip

    def arrived(self, loaded: Loaded) -> None:
        """Set the subject loaded for the session; a session without other settings starts with those of the scene."""
        self.put(loaded)
        now = self.session.settled
        bare = Session(subject=now.subject, catalogue=now.catalogue, interface=now.interface, ratings=now.ratings)
        if now == bare:
            session = begun(loaded, interface=now.interface, ratings=now.ratings)
            self.history = replace(self.history, now=session.with_passing_of(self.session))

    def save(self) -> None:
        """Save the session to its file; without one, open the dialog."""
        if self.path is None:
            self.dialog = "save.as"
        else:
            self.save_as(self.path)

    def save_as(self, file: Path) -> bool:
        """Save the session; return whether it was written."""
        done = self.attempt(lambda: SESSION_FILE.write(file, self.session), "save", f"Saved: {file}")
        if done:
            self.path = file
        return done

    def attempt(self, work: Callable[[], object], about: str, said: str) -> bool:
        """Perform work with files; give the notice `said`, or the reason of failure. Return whether it succeeded."""
        try:
            work()
        except (MetamerError, OSError) as reason:
            self.tell(str(reason), problem=True, about=about)
            return False
        self.tell(said, about=about)
        return True

    def tell(self, words: str, problem: bool = False, about: str = "") -> None:
        """Add a notice; problems stay."""
        self.forget(about)
        until = None if problem else self._clock() + SAID_S
        self.notices = (*self.notices, Notice(words, problem, about, until))

    def forget(self, about: str) -> None:
        """Remove notices about a subject."""
        self.notices = tuple(one for one in self.notices if one.about != about)

    def said(self, held: bool = False) -> tuple[Notice, ...]:
        """Return the current notices; while they are held, none expires."""
        now = self._clock()
        self.notices = tuple(one for one in self.notices if held or one.until is None or now < one.until)
        return self.notices


def begun(loaded: Loaded, **settings: Any) -> Session:
    """Return a window's initial session: as the scene states; an image in its own light, reflectances in D65, and
    images in XYZ for their observer.
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
