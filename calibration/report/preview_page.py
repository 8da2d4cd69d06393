"""The page of a catalogue: every material as a picture, to be searched, filtered and sorted in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from . import plots
from .page import breakable, html_environment, row_id


@dataclass(frozen=True, eq=False)
class PreviewCard:
    """One material on the page.

    kind : of its provenance; standing : the same in one word.
    picture : display-encoded sRGB, square. caption : of its error. facts : words that a search finds, by label.
    lab : CIELAB that the page sorts by, or None. p99 : ΔE94, or None. words : why it has no picture, or "".
    """

    id: str
    family: str
    kind: str
    quantity: str
    caption: str
    picture: UInt8[np.ndarray, "H W 3"]
    facts: dict[str, str]
    lab: Float[np.ndarray, "3"] | None = None
    p99: float | None = None
    words: str = ""
    standing: str = ""

    @property
    def chroma(self) -> float:
        """C*ab, -1 where there is no colour."""
        return -1.0 if self.lab is None else float(np.hypot(self.lab[1], self.lab[2]))

    @property
    def hue(self) -> float:
        """h_ab in degrees, -1 where there is no colour."""
        return -1.0 if self.lab is None else float(np.degrees(np.arctan2(self.lab[2], self.lab[1])) % 360.0)


def render_preview_page(cards: Sequence[PreviewCard], title: str, words: str) -> str:
    """One self-contained HTML page; `words` says how the pictures were made."""
    environment = html_environment(uri=plots.data_uri, lossless=plots.lossless, row_id=row_id, breakable=breakable)
    return environment.get_template("preview.html").render(
        cards=cards,
        title=title,
        words=words,
        families=sorted({card.family for card in cards}),
        kinds=sorted({card.kind for card in cards}),
        quantities=sorted({card.quantity for card in cards}),
    )
