"""Commands: every change of a session with a name, words and keys; what keys, palette and help are made of."""

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
    """One thing that can be done.

    Parameters
    ----------
    name : for scripts and tests, "light.D65". words : for people. group : under which help lists it.
    keys : each as "Ctrl+Shift+P", modifiers in that order; the first is shown.
    change : from a session to the next; None is a matter of the window (save, help), which knows it by `name`.
    held : done while its key is held, and taken back by `change` again when it is released.
    """

    name: str
    words: str
    group: str
    keys: tuple[str, ...] = ()
    change: Change | None = None
    held: bool = False

    def __call__(self, session: Session) -> Session:
        """Return the session after it; itself where it is the window's matter, or where nothing is to be changed."""
        return session if self.change is None else self.change(session)


@dataclass(frozen=True, eq=False)
class Dial:
    """A number of a session that is turned: what sliders are made of, and what commands step.

    low, high : its ends. step : of a key. unit : behind it. logarithmic : a slider's steps are ratios.
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
        """Return the session with this value, held within its ends: a slider is dragged beyond them."""
        return self.put(session, float(min(max(value, self.low), self.high)))

    def stepped(self, session: Session, steps: float) -> Session:
        """Move it by a number of steps; by ratios where it is logarithmic."""
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
        """Find commands for a palette: those in whose words each word of the query occurs, in any order.

        Those where query words begin words come first, then the shorter ones; in capitals or not, with accents or not.
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
        """List the commands for `?`: the commands that have a key, by group, in order."""
        groups = dict.fromkeys(one.group for one in self._all)
        listed = {group: tuple(one for one in self._all if one.group == group and one.keys) for group in groups}
        return {group: some for group, some in listed.items() if some}


def _folded(text: str) -> str:
    """Without capitals and accents: what is compared with what somebody types; ΔE is "de" too."""
    plain = unicodedata.normalize("NFKD", text.replace("Δ", "d").replace("δ", "d"))
    return "".join(letter for letter in plain if not unicodedata.combining(letter)).casefold()


def stepped(dial: Dial, group: str, more: tuple[str, ...] = (), less: tuple[str, ...] = ()) -> tuple[Command, Command]:
    """Return a dial up and down by keys."""
    return (
        Command(f"{dial.name}.up", f"{dial.words} up", group, more, partial(dial.stepped, steps=1.0)),
        Command(f"{dial.name}.down", f"{dial.words} down", group, less, partial(dial.stepped, steps=-1.0)),
    )


def following(known: Sequence[T], now: T, steps: int) -> T:
    """Return the entry so many places on, round and round; from the first or last where `now` is none of them.

    >>> following(("a", "b", "c"), "c", 1), following(("a", "b", "c"), "x", -1)
    ('a', 'c')
    """
    if now not in known:
        return known[0 if steps > 0 else -1]
    return known[(known.index(now) + steps) % len(known)]


def chord_parts(chord: str) -> tuple[frozenset[str], str]:
    """Modifiers and key of a chord.

    >>> sorted(chord_parts("Ctrl+Shift+P")[0]), chord_parts("+")[1]
    (['Ctrl', 'Shift'], '+')
    """
    *before, last = chord.split("+") if not chord.endswith("+") else (*chord[:-1].split("+")[:-1], "+")
    return frozenset(before), last


def searched(names: Sequence[str], words: str) -> tuple[str, ...]:
    """Return the names in which every word occurs.

    >>> searched(("paint/red-gloss", "paint/blue-gloss"), "Gloss red")
    ('paint/red-gloss',)
    """
    asked = _folded(words).split()
    return tuple(name for name in names if all(word in _folded(name) for word in asked))
