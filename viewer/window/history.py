"""History of steps in the window, for undo and redo."""

from __future__ import annotations

from dataclasses import dataclass, replace

from .state import Session

#: Largest number of undo steps; a session is a few kilobytes.
MOST_STEPS = 1000


@dataclass(frozen=True)
class Step:
    """Change with a session: in `History.past` the one before it, in `History.undone` the one after."""

    session: Session
    words: str


@dataclass(frozen=True)
class History:
    """Current session with its undo and redo steps.

    now : including transient values such as the pointer. past : oldest step first. undone : steps for `redo`, the next
    one last, with sessions after each change.
    stroke : name of a continuing step (a drag), to which further changes belong.
    """

    now: Session
    past: tuple[Step, ...] = ()
    undone: tuple[Step, ...] = ()
    stroke: str | None = None

    def done(self, session: Session, words: str, stroke: str | None = None) -> History:
        """Return the history after a change to `session`.

        stroke : name of a drag; successive changes of one stroke are one step. None ends it. Changes of nothing, or of
        transient values only, are no steps.
        """
        going_on = stroke is not None and stroke == self.stroke
        if session.settled == self.now.settled:
            return replace(self, now=session, stroke=self.stroke if going_on else None)
        past = self.past if going_on and self.past else (*self.past, Step(self.now.settled, words))
        return History(session, past[-MOST_STEPS:], (), stroke)

    def released(self) -> History:
        """End the drag, so that the next one is another step."""
        return replace(self, stroke=None)

    def passed(self, session: Session) -> History:
        """Return the history after a change that is not undoable, as by turntable or pointer."""
        return replace(self, now=session)

    def undo(self) -> History:
        """Undo one step; itself if there is none."""
        if not self.past:
            return self
        last = self.past[-1]
        again = Step(self.now.settled, last.words)
        return History(last.session.with_passing_of(self.now), self.past[:-1], (*self.undone, again))

    def redo(self) -> History:
        """Redo one step; itself if there is none."""
        if not self.undone:
            return self
        next_one = self.undone[-1]
        past = (*self.past, Step(self.now.settled, next_one.words))
        return History(next_one.session.with_passing_of(self.now), past, self.undone[:-1])

    @property
    def undo_words(self) -> str | None:
        """Description of the step that `undo` reverts."""
        return self.past[-1].words if self.past else None

    @property
    def redo_words(self) -> str | None:
        """Description of the step that `redo` repeats."""
        return self.undone[-1].words if self.undone else None
