"""History of steps in the window, for undo and redo."""

from __future__ import annotations

from dataclasses import dataclass, replace

from .state import Session

#: Steps that can be undone; a session is a few kilobytes.
MOST_STEPS = 1000


@dataclass(frozen=True)
class Step:
    """A session beside a thing that was done: of `History.past` as it was before, of `History.undone` as after."""

    session: Session
    words: str


@dataclass(frozen=True)
class History:
    """The session now, how it came about, and what was undone of it.

    now : with where the pointer is. past : the first step first. undone : what `redo` brings back, the next one last:
    sessions as they were after what is said.
    stroke : of a step that goes on (a drag): further changes under the same name belong to it.
    """

    now: Session
    past: tuple[Step, ...] = ()
    undone: tuple[Step, ...] = ()
    stroke: str | None = None

    def done(self, session: Session, words: str, stroke: str | None = None) -> History:
        """After a change to `session`.

        stroke : names a drag; changes of one stroke, one after the other, are one step. None ends it. What changes
        nothing is no step, and neither is where the pointer goes.
        """
        going_on = stroke is not None and stroke == self.stroke
        if session.settled == self.now.settled:
            return replace(self, now=session, stroke=self.stroke if going_on else None)
        past = self.past if going_on and self.past else (*self.past, Step(self.now.settled, words))
        return History(session, past[-MOST_STEPS:], (), stroke)

    def released(self) -> History:
        """End its drag: the next one is another step."""
        return replace(self, stroke=None)

    def passed(self, session: Session) -> History:
        """After what nobody undoes: the turntable went on, the pointer moved."""
        return replace(self, now=session)

    def undo(self) -> History:
        """One step back; itself where there is none."""
        if not self.past:
            return self
        last = self.past[-1]
        again = Step(self.now.settled, last.words)
        return History(last.session.with_passing_of(self.now), self.past[:-1], (*self.undone, again))

    def redo(self) -> History:
        """One step forth again; itself where nothing was undone, or something else done since."""
        if not self.undone:
            return self
        next_one = self.undone[-1]
        past = (*self.past, Step(self.now.settled, next_one.words))
        return History(next_one.session.with_passing_of(self.now), past, self.undone[:-1])

    @property
    def undo_words(self) -> str | None:
        """Step that `undo` takes back."""
        return self.past[-1].words if self.past else None

    @property
    def redo_words(self) -> str | None:
        """Step that `redo` does again."""
        return self.undone[-1].words if self.undone else None
