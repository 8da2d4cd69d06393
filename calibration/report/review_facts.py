"""Materials and lights of a review: facts shown beside the pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float

from ...spectral.illuminants import canonical_name
from ...spectral.sample import distinct_titles, title_from_id
from .row import ReviewRow

#: Light that colours are adapted to and that shifts are counted from; how eyes get used to another; and the formula.
SHIFT_FROM, SHIFT_ADAPTATION, SHIFT_FORMULA = "D65", "CAT02", "CIE 2000"
ADAPTED = f"{SHIFT_ADAPTATION} to {SHIFT_FROM}"
#: Lights that figures are given for beside those of the pictures: they cost nothing.
FIGURE_LIGHTS = ("D65", "A", "FL11", "FL2", "LED-B3")
_TITLES = {
    "D65": ("Daylight", "daylight"),
    "D50": ("Warm daylight", "daylight"),
    "D75": ("North sky", "daylight"),
    "A": ("Tungsten lamp", "lamp"),
    "FL11": ("Shop light TL84", "tube"),
    "FL2": ("Office light CWF", "tube"),
    "E": ("Equal energy", "other"),
    "horizon": ("Horizon lamp", "lamp"),
}
_KINDS = (("LED-", "LED lamp", "led"), ("FL", "Fluorescent lamp", "tube"), ("HP", "Discharge lamp", "tube"))


@dataclass(frozen=True)
class Shift:
    """Change of a colour from `SHIFT_FROM` to another light after adaptation: ΔE, and its direction in words."""

    delta_e: float
    words: str


@dataclass(frozen=True, eq=False)
class LitColour:
    """Colour of a material's original data under a light for an observer.

    xyz : (3,), Y = 1 for the perfect diffuser. lab : relative to the light's white. adapted_lab : of the corresponding
    colour under `SHIFT_FROM`; None if no adaptation from the light exists. swatch : encoded for the display, 8 bits.
    """

    light: str
    observer: str
    xyz: Float[np.ndarray, "3"]
    lab: Float[np.ndarray, "3"]
    adapted_lab: Float[np.ndarray, "3"] | None
    shift: Shift | None
    swatch: tuple[int, int, int] | None = None


@dataclass(frozen=True, eq=False)
class ReviewedLight:
    """Light of pictures or figures; (L,) relative power, None for the scene's own mixture."""

    name: str
    title: str
    kind: str
    pictured: bool
    wavelengths_nm: Float[np.ndarray, "L"] | None = None
    power: Float[np.ndarray, "L"] | None = None

    @property
    def full_title(self) -> str:
        """Title, followed by the name."""
        return f"{self.title} {self.name}"


@dataclass(frozen=True, eq=False)
class ReviewedMaterial:
    """A material of a review.

    colour, gloss : standing of each, "measured", "analytic", "uplifted", "reconstructed" or "unknown"; plain : in
    sentences. wavelengths_nm, values (L,) : its spectrum, a `quantity`; measured_nm : its measured range, None if the
    record does not state it. colours : by light and observer.
    """

    id: str
    title: str
    family: str
    colour: str = "unknown"
    gloss: str = "unknown"
    plain: str = "Nothing is known of where it comes from."
    wavelengths_nm: Float[np.ndarray, "L"] | None = None
    values: Float[np.ndarray, "L"] | None = None
    quantity: str = "radiance factor at 45a:0"
    measured_nm: tuple[float, float] | None = None
    source: str = ""
    licence: str = ""
    colours: tuple[LitColour, ...] = ()

    @property
    def full_title(self) -> str:
        """Title, followed by the id."""
        return f"{self.title} ({self.id})"

    def under(self, light: str, observer: str) -> LitColour | None:
        """Return its colour under a light for an observer."""
        found = (one for one in self.colours if (one.light, one.observer) == (light, observer))
        return next(found, None)


_Titled = TypeVar("_Titled", ReviewedLight, ReviewedMaterial)


def within_sentence(words: str) -> str:
    """Write words that began with a capital as they stand within a sentence; names such as "LED" stay.

    >>> within_sentence("Tungsten lamp A"), within_sentence("LED B3")
    ('tungsten lamp A', 'LED B3')
    """
    return words[:1].lower() + words[1:] if words[1:2].islower() else words


def light_title(name: str) -> tuple[str, str]:
    """Return a light's title, and its kind; an unknown name is its own title.

    >>> light_title("A"), light_title("LED-B3"), light_title("D55"), light_title("Philips TL-84")
    (('Tungsten lamp', 'lamp'), ('LED lamp', 'led'), ('Daylight', 'daylight'), ('Philips TL-84', 'other'))
    """
    name = canonical_name(name)
    if name in _TITLES:
        return _TITLES[name]
    for start, title, kind in _KINDS:
        if name.startswith(start) and name != start:
            return title, kind
    return ("Daylight", "daylight") if name[:1] == "D" and name[1:].isdigit() else (name, "other")


def light_words(name: str) -> str:
    """Return a light's title, with its name unless the title contains it.

    >>> light_words("D65"), light_words("TL84"), light_words("horizon")
    ('Daylight D65', 'Shop light TL84', 'Horizon lamp')
    """
    title, _ = light_title(name)
    return title if name == title or name.casefold() in title.casefold().split() else f"{title} {name}"


def told_apart(reviewed: Sequence[_Titled]) -> tuple[_Titled, ...]:
    """Return lights or materials with distinct titles."""
    titles = distinct_titles([one.title for one in reviewed], [one.full_title for one in reviewed])
    return tuple(replace(one, title=title) for one, title in zip(reviewed, titles, strict=True))


def materials_of_rows(rows: Sequence[ReviewRow]) -> tuple[ReviewedMaterial, ...]:
    """Collect the materials from rows alone."""
    found = {}
    for row in rows:
        found.setdefault(
            row.material,
            ReviewedMaterial(
                row.material,
                title_from_id(row.material),
                row.material.rpartition("/")[0],
                wavelengths_nm=row.wavelengths_nm,
                values=row.reflectance,
                source=row.provenance.get("Source", ""),
                licence=row.provenance.get("Licence", ""),
            ),
        )
    return told_apart(tuple(found.values()))


def lights_of_rows(rows: Sequence[ReviewRow]) -> tuple[ReviewedLight, ...]:
    """Collect the lights from rows alone."""
    names = dict.fromkeys(row.illuminant for row in rows)
    return told_apart([ReviewedLight(name, *light_title(name), pictured=True) for name in names])


def material_document(one: ReviewedMaterial) -> dict[str, Any]:
    """Return a material as `review.json` has it."""
    spectrum = None
    if one.wavelengths_nm is not None and one.values is not None:
        spectrum = {
            "wavelengths_nm": one.wavelengths_nm.tolist(),
            "values": one.values.tolist(),
            "measured_nm": None if one.measured_nm is None else list(one.measured_nm),
            "quantity": one.quantity,
        }
    return {
        "id": one.id,
        "title": one.title,
        "family": one.family,
        "standing": {"colour": one.colour, "gloss": one.gloss, "plain": one.plain},
        "spectrum": spectrum,
        "source": one.source,
        "licence": one.licence,
        "colours": [_colour(colour) for colour in one.colours],
    }


def light_document(one: ReviewedLight) -> dict[str, Any]:
    """Return a light as `review.json` has it."""
    spd = None
    if one.wavelengths_nm is not None and one.power is not None:
        spd = {"wavelengths_nm": one.wavelengths_nm.tolist(), "values": one.power.tolist()}
    return {"name": one.name, "title": one.title, "kind": one.kind, "pictured": one.pictured, "spd": spd}


def shift_document(shift: Shift | None) -> dict[str, Any] | None:
    """Return a shift as `review.json` has it."""
    if shift is None:
        return None
    return {"from": SHIFT_FROM, "delta_e": shift.delta_e, "formula": SHIFT_FORMULA, "words": shift.words}


def _colour(one: LitColour) -> dict[str, Any]:
    return {
        "light": one.light,
        "observer": one.observer,
        "xyz": one.xyz.tolist(),
        "lab": one.lab.tolist(),
        "adapted_lab": None if one.adapted_lab is None else one.adapted_lab.tolist(),
        "adaptation": ADAPTED,
        "shift": shift_document(one.shift),
        "swatch": None if one.swatch is None else list(one.swatch),
    }
