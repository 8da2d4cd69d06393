"""Page of a catalogue: every material as a picture, with search, filters and sorting in the browser.

The page contains the data of all materials, and creates elements only for those on the screen.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from ...runtime.files import takes_bytes, written_whole
from ...runtime.wording import counted
from .page import html_environment, script_json
from .review_data import BADGES
from .row_name import row_id
from .sprite_sheets import SIDE, SpriteSheets, forget_other_sheets, write_sheets

# Bytes of pictures up to which they are in the page: with the words of as many materials it takes 8 MB at most.
_MOST_IN_THE_PAGE = 7_000_000

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

    title : name to show. colour : standing of its colour, one of `BADGES`. kind : of its provenance.
    caption : of its error. facts : searchable words, by label. lab : CIELAB for sorting, or None.
    p99 : ΔE94, or None. words : why it has no picture, or "".
    """

    id: str
    family: str
    kind: str
    quantity: str
    caption: str
    facts: dict[str, str]
    lab: tuple[float, float, float] | None = None
    p99: float | None = None
    words: str = ""
    title: str = ""
    colour: str = "unknown"

    @property
    def attention(self) -> int:
        """Rank in the order of review: unusable materials first, then guesses, measured colours last."""
        order = list(_MEANING)
        return len(order) + 1 if self.words else len(order) - order.index(self.colour)


def catalogue_sentence(cards: Sequence[PreviewCard]) -> str:
    """State in one sentence where the colours of materials come from, and which are not reliable."""
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
    return f"{counted(total, 'material')}: {', '.join(parts)}."


def write_preview_page(path: Path, cards: Sequence[PreviewCard], sheets: SpriteSheets, title: str, words: str) -> None:
    """Write the page; pictures that would slow it down go into a folder beside it, `STEM_pictures`.

    Sheets are named by their content, and the page is written last: an earlier page keeps its sheets until then.
    """
    files, folder = sheets.files(), path.with_name(f"{path.stem}_pictures")
    names: list[str] = []
    # A device or a pipe has nothing beside it.
    if sum(map(len, files)) * 4 // 3 > _MOST_IN_THE_PAGE and not takes_bytes(path):
        names = write_sheets(folder, files)
    addresses = [f"{quote(folder.name)}/{name}" for name in names] or sheets.embedded()
    with written_whole(path) as beside:
        beside.write_text(render_preview_page(cards, addresses, sheets.pixels, title, words), encoding="utf-8")
    forget_other_sheets(folder, names)


def render_preview_page(
    cards: Sequence[PreviewCard], sheets: Sequence[str], pixels: int, title: str, words: str
) -> str:
    """Render the page as HTML.

    sheets : addresses of sprite sheets with a picture of `pixels` across for each card. words : on their making.
    """
    counts = Counter(card.colour for card in cards if not card.words)
    return (
        html_environment()
        .get_template("preview.html")
        .render(
            data=script_json(_data(cards, pixels)),
            sheets=script_json(list(sheets)),
            count=len(cards),
            title=title,
            words=words,
            sentence=catalogue_sentence(cards),
            status_icon="i-warn" if any(card.words for card in cards) else "i-near" if counts["uplifted"] else "i-ok",
            badges=BADGES,
            standings=[(one, BADGES[one], counts[one], _MEANING[one][1]) for one in reversed(_MEANING) if counts[one]],
            families=sorted({card.family for card in cards}),
            quantities=sorted({card.quantity for card in cards}),
            beside=next((unquote(one.rpartition("/")[0]) for one in sheets if not one.startswith("data:")), ""),
        )
    )


def _data(cards: Sequence[PreviewCard], pixels: int) -> dict[str, Any]:
    """Return the data of the page's script: a list per material, in which repeated texts are indices of `texts`."""
    texts: dict[str, int] = {}

    def text(words: str) -> int:
        return texts.setdefault(words, len(texts))

    rows = [
        [
            card.id,
            card.title or card.id,
            *map(text, (card.family, card.quantity, card.colour, card.caption, card.words)),
            card.attention,
            None if card.p99 is None else float(card.p99),
            None if card.lab is None else [round(float(value), 4) for value in card.lab],
            [text(words) for fact in card.facts.items() for words in fact],
            *([row_id(card.id)] if row_id(card.id) != card.id else []),
        ]
        for card in cards
    ]
    return {"side": SIDE, "pixels": pixels, "badges": BADGES, "texts": list(texts), "cards": rows}
