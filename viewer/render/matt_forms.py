"""Forms of one term, as of diffuse materials: images of forms with the same shape differ only in colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...materials.core.fast import Fast
from ...materials.factored.pack import FactoredBrdf
from ...runtime.fingerprint import fingerprint


@dataclass(frozen=True, eq=False)
class MattForm:
    """Form with the key of its shape, and the largest value of its environment form, which is not part of the key.

    Two forms with the same key differ only in their spectra and in that value, up to single precision.
    """

    form: FactoredBrdf
    key: str
    scale: float


def matt_form(form: Fast) -> MattForm | None:
    """Return a form as a form of one term; None if it has more, or glossy lobes."""
    if not isinstance(form, FactoredBrdf) or len(form.packs) != 1 or form.packs[0].rank != 1:
        return None
    one, around = form.packs[0], form.environment_form()
    value = around.value.reshape(-1)
    if around.value.shape[-1] != 1 or around.sharpness.size or not value.any():
        return None
    scale = float(value[np.argmax(np.abs(value))])
    shape = (around.value / scale).round(6) + 0.0
    return MattForm(form, fingerprint(one.frame, one.axes, one.factors, one.precision, shape), scale)


def by_shape(forms: Sequence[tuple[int, MattForm]]) -> list[list[tuple[int, MattForm]]]:
    """Group numbered forms by shape."""
    groups: dict[str, list[tuple[int, MattForm]]] = {}
    for number, one in forms:
        groups.setdefault(one.key, []).append((number, one))
    return list(groups.values())
