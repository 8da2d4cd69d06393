"""Commands: changes of a session with name, words and keys, for keyboard, palette and help."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from .state import Session

Change = Callable[[Session], Session]
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Command:
    """A user command.

    Parameters
    ----------
    name : for scripts and tests, "light.D65". words : for users. group : in help.
    keys : each like "Ctrl+Shift+P", modifiers in that order; the first is shown.
    change : from a session to the next; None for commands of the window (save, help), identified by `name`.
    held : active while its key is held; releasing it applies `change` again to revert it.
    """

    name: str
    words: str
    group: str
    keys: tuple[str, ...] = ()
    change: Change | None = None
    held: bool = False

    def __call__(self, session: Session) -> Session:
        """Return the changed session; the same one for commands of the window, or if nothing changes."""
        return session if self.change is None else self.change(session)


@dataclass(frozen=True, eq=False)
class Dial:
    """Adjustable number of a session, for sliders and step commands.

    low, high : range. step : of a key. unit : for display. logarithmic : a slider's steps are ratios.
    """

    name: str
    words: str
    low: float
    high: float
    step: float
    value: Callable[[Session], float]
    put: Callable[[Session, float], Session]
    unit: str = ""
    logarithmic: bool = False

    def at(self, session: Session, value: float) -> Session:
        """Return the session with this value, clamped to the range, since sliders can be dragged beyond it."""
        return self.put(session, float(min(max(value, self.low), self.high)))

    def stepped(self, session: Session, steps: float) -> Session:
        """Change the value by a number of steps, by ratios if logarithmic."""
        now = self.value(session)
        return self.at(session, now * self.step**steps if self.logarithmic else now + steps * self.step)


class Commands:
    """All commands of a window, found by name, by key, and by words."""

    def __init__(self, all_of_them: Iterable[Command]) -> None:
        self._all = tuple(all_of_them)
        self.by_name = {one.name: one for one in self._all}
        self.by_key: dict[str, Command] = {}
        for one in self._all:
            for key in one.keys:
                if key in self.by_key:
                    raise ValueError(f"{key} is the key of {self.by_key[key].name} and of {one.name}")
                self.by_key[key] = one
        if len(self.by_name) != len(self._all):
            raise ValueError("two commands of one name")

    def __iter__(self) -> Iterator[Command]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    def __getitem__(self, name: str) -> Command:
        return self.by_name[name]

    def found(self, query: str) -> tuple[Command, ...]:
        """Find commands whose words contain every word of the query, in any order.

        Matches at the beginning of words come first, then shorter ones; case and accents are ignored.
        """
        asked = _folded(query).split()
        hits: list[tuple[tuple[int, int, int], Command]] = []
        for number, one in enumerate(self._all):
            text = _folded(" ".join((one.group, one.words, one.name.replace(".", " "), *one.keys)))
            if all(word in text for word in asked):
                begun = text.split()
                inside = sum(not any(other.startswith(word) for other in begun) for word in asked)
                hits.append(((inside, len(one.words) if asked else 0, number), one))
        return tuple(one for _, one in sorted(hits, key=lambda hit: hit[0]))

    def help(self) -> dict[str, tuple[Command, ...]]:
        """Return the commands with keys by group, in order, for `?`."""
        groups = dict.fromkeys(one.group for one in self._all)
        listed = {group: tuple(one for one in self._all if one.group == group and one.keys) for group in groups}
        return {group: some for group, some in listed.items() if some}


def _folded(text: str) -> str:
    """Remove case and accents for matching typed text; ΔE becomes "de"."""
    plain = unicodedata.normalize("NFKD", text.replace("Δ", "d").replace("δ", "d"))
    return "".join(letter for letter in plain if not unicodedata.combining(letter)).casefold()


def stepped(dial: Dial, group: str, more: tuple[str, ...] = (), less: tuple[str, ...] = ()) -> tuple[Command, Command]:
    """Return the commands that step a dial up and down."""
    return (
        Command(f"{dial.name}.up", f"{dial.words} up", group, more, partial(dial.stepped, steps=1.0)),
        Command(f"{dial.name}.down", f"{dial.words} down", group, less, partial(dial.stepped, steps=-1.0)),
    )


def following(known: Sequence[T], now: T, steps: int) -> T:
    """Return the entry `steps` places after `now`, cyclically; from the first or last if `now` is unknown.

    >>> following(("a", "b", "c"), "c", 1), following(("a", "b", "c"), "x", -1)
    ('a', 'c')
    """
    if now not in known:
        return known[0 if steps > 0 else -1]
    return known[(known.index(now) + steps) % len(known)]


def chord_parts(chord: str) -> tuple[frozenset[str], str]:
    """Split a chord into modifiers and key.

    >>> sorted(chord_parts("Ctrl+Shift+P")[0]), chord_parts("+")[1]
    (['Ctrl', 'Shift'], '+')
    """
    *before, last = chord.split("+") if not chord.endswith("+") else (*chord[:-1].split("+")[:-1], "+")
    return frozenset(before), last


def searched(names: Sequence[str], words: str) -> tuple[str, ...]:
    """Return the names that contain every word.

    >>> searched(("paint/red-gloss", "paint/blue-gloss"), "Gloss red")
    ('paint/red-gloss',)
    """
    asked = _folded(words).split()
    return tuple(name for name in names if all(word in _folded(name) for word in asked))
