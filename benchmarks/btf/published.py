"""Figures of the papers on their methods, to stand beside what is measured here."""

from __future__ import annotations

from collections.abc import Mapping

from ...calibration.report.text_tables import columns

#: Methods of the columns of `EPSILON`, by the names that they have here.
METHODS = ("lafortune without scales", "lafortune", "rfp", "rfnl-2")
#: Mean epsilon of Meseth, Mueller and Klein 2003 (table 1): four lobes of Lafortune's without and with scales, RFP, and
#: RFNL of two lobes.
EPSILON: Mapping[str, tuple[float, float, float, float]] = {
    "proposte": (0.0978, 0.0794, 0.0689, 0.0736),
    "wool": (0.0788, 0.0693, 0.0719, 0.0582),
    "stone": (0.0904, 0.0816, 0.0797, 0.0640),
    "corduroy": (0.1114, 0.0859, 0.0513, 0.0537),
    "aluminium": (0.0572, 0.0558, 0.0846, 0.0479),
}
# Of the same paper (section 5.3) and of Mueller, Meseth and Klein 2004 (section 5.3): neither states another error.
_NOTES = (
    "Meseth 2003: 365 MB for 256 x 256 texels and 81 fields in 32 bits; 21 fps under a point light and 14 fps in an "
    "environment, GeForce FX 5800",
    "Müller 2004: 16 clusters of 4 components, 16.9 MB; 0.8 s for a light, 12 fps, GeForce FX 5900; no error is given",
)


def published_epsilon(case: str, method: str) -> float | None:
    """Return what the paper has for a material and a method of these names; None for others."""
    if case not in EPSILON or method not in METHODS:
        return None
    return EPSILON[case][METHODS.index(method)]


def published() -> str:
    """Return all of it, as a table."""
    body = [[material, *(f"{value:.3f}" for value in values)] for material, values in EPSILON.items()]
    title = "As published: epsilon of Meseth et al. 2003, of the same materials from other files"
    return "\n".join([title, columns(["material", *METHODS], body), *_NOTES])
