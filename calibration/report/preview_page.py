"""The page of a catalogue: every material as a picture, to be searched, filtered and sorted in the browser."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from . import plots
from .page import breakable, html_environment, row_id
from .review_data import BADGES

# By standing of the colour: its word in the page's sentence, and what it means for judging; those to look at first.
_MEANING = {
    "uplifted": (
        "guessed from RGB",
        "Only three numbers were known; the spectrum was made up. Right in daylight, a guess under any other light.",
    ),
    "unknown": ("of unknown origin", "Nobody has stated where the colour comes from."),
    "reconstructed": (
        "rebuilt from photos",
        "Taken from many photographs of a sample. Pattern and gloss are real; the colour is as good as the camera.",
    ),
    "analytic": ("calculated", "Worked out by a formula or from optical constants. As good as the formula."),
    "measured": ("measured", "Read from a real sample with an instrument. Trust it under every light."),
}


@dataclass(frozen=True, eq=False)
class PreviewCard:
    """One material on the page.

    title : name for people. colour : standing of its colour, one of `BADGES`. kind : of its provenance.
    picture : display-encoded sRGB, square; alpha is its coverage. caption : of its error. facts : words that a search
    finds, by label. lab : CIELAB that the page sorts by, or None. p99 : ΔE94, or None. words : why it has no picture,
    or "".
    """

    id: str
    family: str
    kind: str
    quantity: str
    caption: str
    picture: UInt8[np.ndarray, "H W c"]
    facts: dict[str, str]
    lab: Float[np.ndarray, "3"] | None = None
    p99: float | None = None
    words: str = ""
    title: str = ""
    colour: str = "unknown"

    @property
    def chroma(self) -> float:
        """C*ab, -1 where there is no colour."""
        return -1.0 if self.lab is None else float(np.hypot(self.lab[1], self.lab[2]))

    @property
    def hue(self) -> float:
        """h_ab in degrees, -1 where there is no colour."""
        return -1.0 if self.lab is None else float(np.degrees(np.arctan2(self.lab[2], self.lab[1])) % 360.0)

    @property
    def attention(self) -> int:
        """Rank for the order of looking: what cannot be used first, then guesses, measured colours last."""
        order = list(_MEANING)
        return len(order) + 1 if self.words else len(order) - order.index(self.colour)


def catalogue_sentence(cards: Sequence[PreviewCard]) -> str:
    """State in one sentence where the colours of materials come from, and which are not to be judged."""
    total, lights = len(cards), sum(card.quantity == "emission" for card in cards)
    unusable = sum(bool(card.words) for card in cards)
    counts = Counter(card.colour for card in cards if not card.words and card.quantity != "emission")
    parts = [f"{counts[one]} {_MEANING[one][0]}" for one in reversed(_MEANING) if counts[one] and one != "uplifted"]
    parts += [f"{lights} {'light' if lights == 1 else 'lights'}"] if lights else []
    guesses = counts["uplifted"]
    if guesses:
        parts.append(f"{guesses} guessed from RGB, to be judged in daylight only")
    if unusable:
        parts.append(f"{unusable} cannot be used")
    return f"{total} material{'' if total == 1 else 's'}: {', '.join(parts)}."


def render_preview_page(cards: Sequence[PreviewCard], title: str, words: str) -> str:
    """One self-contained HTML page; `words` says how the pictures were made."""
    environment = html_environment(uri=plots.data_uri, lossless=plots.lossless, row_id=row_id, breakable=breakable)
    counts = Counter(card.colour for card in cards if not card.words)
    return environment.get_template("preview.html").render(
        cards=cards,
        title=title,
        words=words,
        sentence=catalogue_sentence(cards),
        status_icon="i-warn" if any(card.words for card in cards) else "i-near" if counts["uplifted"] else "i-ok",
        badges=BADGES,
        standings=[(one, BADGES[one], counts[one], _MEANING[one][1]) for one in reversed(_MEANING) if counts[one]],
        families=sorted({card.family for card in cards}),
        quantities=sorted({card.quantity for card in cards}),
    )
