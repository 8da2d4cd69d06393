"""State of panels that is no part of a session: what is typed, which tab is open."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class PanelState:
    """searched : of materials. typed : into fields, by their names. tab : that is to be opened next.

    spectrum : which kind is plotted. compared : materials that are looked at for metamerism. note, score : of the next
    rating. amount : that a wish asks for. chain_in_full : whether the chain is told at length. found : typed into the
    palette, and the row chosen.
    """

    searched: str = ""
    typed: dict[str, str] = field(default_factory=dict)
    tab: str | None = None
    spectrum: str = "reflectance"
    compared: list[str] = field(default_factory=list)
    note: str = ""
    score: int = 0
    amount: float = 10.0
    chain_in_full: bool = False
    found: str = ""
    row: int = 0
