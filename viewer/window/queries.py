"""Background queries of panels about materials and images, with the last answer of each kind."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from ...lighting.plan import ScenePlan, plan_scene
from ...lighting.scene_file.lamps import lamp
from ...materials.catalogue.catalogue import Catalogue
from ...materials.search.neighbours import Neighbours, like
from ...materials.search.sliders import Slider, sliders
from ...spectral.formula import Formula
from ...spectral.image import ColourImage
from ..display.transform import DisplayTransform
from ..gl.side import CanvasSide
from .background import Background
from .display_pass import surround_xyz, to_display
from .metamerism import Metamerism, metamerism
from .state import Session


@dataclass(frozen=True, eq=False)
class QueryAnswer:
    """Answer to the query `key`: `result`, or the reason for its absence in `problem`."""

    key: Hashable
    result: Any = None
    problem: str | None = None


class Asking:
    """Background thread for queries; only the newest of a kind is answered."""

    def __init__(self) -> None:
        self._thread = Background()
        self._asked: dict[str, Hashable] = {}
        self._answers: dict[str, QueryAnswer] = {}

    def close(self) -> None:
        """Stop answering."""
        self._thread.close()

    def ask(self, kind: str, key: Hashable, work: Callable[[], Any], again: bool = True) -> None:
        """Submit a query; with `again` False, not if it equals the last one of its kind."""
        if again or self._asked.get(kind) != key:
            self._asked[kind] = key
            self._thread.ask(kind, lambda: (key, work()))

    def answer(self, kind: str, key: Hashable = None) -> QueryAnswer | None:
        """Return the last answer of a kind, if it has this key; None is any key."""
        found = self._answers.get(kind)
        return found if found is None or key is None or found.key == key else None

    def busy(self, kind: str | None = None) -> bool:
        """Return whether a query of this kind, or any, is pending."""
        return self._thread.busy(kind)

    def forget(self) -> None:
        """Discard all answers, as after a change of materials."""
        self._asked.clear()
        self._answers.clear()

    def poll(self) -> bool:
        """Collect finished answers; return whether there were any."""
        came = self._thread.poll()
        for heard in came:
            if heard.problem is not None:
                self._answers[heard.kind] = QueryAnswer(self._asked.get(heard.kind), problem=heard.problem)
            else:
                self._answers[heard.kind] = QueryAnswer(*heard.result)
        return bool(came)


def metamers(catalogue: Catalogue, names: Sequence[str], lights: Sequence[str], observers: Sequence[str],
             formula: str) -> Metamerism:  # fmt: skip
    """Compare materials under all lights for all observers; errors: see `metamerism`, and unknown lamps."""
    materials = [catalogue.load(name) for name in names]
    spectra: Mapping[str, Any] = dict.fromkeys(lights)
    return metamerism(materials, spectra, observers, Formula(formula))


def find_neighbours(catalogue: Catalogue, name: str, word: str, amount: float) -> Neighbours:
    """Find materials similar to one, or to it with an offset in appearance; errors: see `like`."""
    return like(catalogue, name, {word: amount})


def sliders_of(catalogue: Catalogue, name: str) -> tuple[Slider, ...]:
    """Return the parameters of a material; InputError if it has none."""
    return sliders(catalogue.surface(name).surface(), name)


def plan_of(side: CanvasSide, lights: Sequence[str], catalogue: Any) -> ScenePlan:
    """Plan a side's materials under its own lights and further ones, by name."""
    spectra = [one.spectrum for one in side.scene.lights]
    spectra += [lamp(name, None, Path(), catalogue)[0] for name in lights]
    return plan_scene(list(side.surfaces.values()), spectra, side.scene.observer)


def clipping(
    xyz: Float[np.ndarray, "H W 3"],
    coverage: Float[np.ndarray, "H W"],
    white: Float[np.ndarray, "3"],
    session: Session,
    display: DisplayTransform,
) -> tuple[str, ...]:
    """Describe the numbers of pixels that the display cannot show; () if it can show all."""
    adapt = to_display(white, session.adaptation)
    behind = (1.0 - coverage.astype(np.float64))[..., None] * surround_xyz(session.surround)
    sent = 2.0**session.exposure * xyz.astype(np.float64) @ adapt.T + behind
    return display.encode(ColourImage(sent, "xyz_d65", white))[1]


def beyond(xyz_d65: Float[np.ndarray, "H W 3"], display: DisplayTransform) -> UInt8[np.ndarray, "H W"]:
    """Find the pixels that a display cannot show: 1 below its range (out of gamut), 2 above, 0 elsewhere."""
    below, above = display.out_of_range(xyz_d65, display.apply(xyz_d65))
    return np.where(above, 2, below).astype(np.uint8)
