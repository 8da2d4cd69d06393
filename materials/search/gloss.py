"""Gloss of catalogued materials, as a glossmeter reads their fast forms."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..analytic.glossmeter import Gloss, gloss_of
from ..records.material import MaterialRecord
from ..records.record_colour import colour_folding, from_afar


def record_gloss(record: MaterialRecord, body: float) -> Gloss | str:
    """Measure the gloss of a material's fast form, or return why that is impossible; `body` as of `gloss_of`."""
    if record.fast is None:
        return "no colour is known of it"
    if record.fast.cutout is not None:
        return "it has holes: what is seen depends on what lies behind"
    mean = from_afar(record.fast, record.surface)
    if mean is None:
        return "nobody knows its mean over its texture"
    return gloss_of(mean, colour_folding(), body)


def shown_gloss(record: MaterialRecord, colour: Mapping[str, Any]) -> str:
    """Describe the gloss of a record, with its `record_colour`; "" if it has none to measure."""
    found = record_gloss(record, colour["XYZ"][1])
    return "" if isinstance(found, str) else f"{found.units:.1f} gloss units at 60°, {found.stops:.1f} stops (ISO 2813)"
