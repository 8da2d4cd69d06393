"""Page of one material: picture, spectrum, provenance, packs, and the cost of accuracy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, UInt8

from . import plots
from .line_plots import MARKS, SIZE, line_plot
from .page import html_environment

_SPECTRUM_SIZE = (460.0, 200.0)


@dataclass(frozen=True, eq=False)
class MaterialFacts:
    """Facts on the page of a material, in words and numbers.

    facts : at the head of the page; provenance, original, parameters : by label.
    picture : display-encoded sRGB; None for a spectrum without a surface. picture_words : how it was made.
    spectrum : wavelengths in nm (L,) and values (L,). trial_headings, trials : table of the fit's trials. tried :
    (terms, ΔE94 p99) of trials, by kind.
    stated : rows of stated against recomputed colours.
    """

    id: str
    facts: Mapping[str, str]
    provenance: Mapping[str, str]
    spectrum: tuple[Float[np.ndarray, " L"], Float[np.ndarray, " L"]]
    spectrum_label: str
    picture: UInt8[np.ndarray, "H W 3"] | None = None
    picture_words: str = ""
    packs: Sequence[Mapping[str, str]] = ()
    trial_headings: Sequence[str] = ()
    trials: Sequence[Sequence[str]] = ()
    tried: Mapping[str, Sequence[tuple[float, float]]] = field(default_factory=dict)
    stated: Sequence[Mapping[str, str]] = ()
    original: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, str] = field(default_factory=dict)


def render_material_page(facts: MaterialFacts) -> str:
    """Render one self-contained HTML page."""
    environment = html_environment(uri=plots.data_uri)
    return environment.get_template("material.html").render(
        material=facts,
        picture=None if facts.picture is None else plots.lossless(facts.picture),
        plot=plots.spectrum_plot(*facts.spectrum, facts.spectrum_label, _SPECTRUM_SIZE),
        # One trial draws no curve, and stands in the table.
        tradeoff=line_plot(facts.tried, "terms", "ΔE94 p99") if sum(map(len, facts.tried.values())) > 1 else None,
        marks=MARKS,
        size=SIZE,
    )
