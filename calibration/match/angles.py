"""Samples read at several angles: the angles common to all sides, and figures over them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...runtime.errors import ComparisonError, UsageError
from ...spectral.angles import FEWEST, FLOP_ANGLES, FLOP_CONDITIONS, common, flop_index
from ...spectral.measurement import Geometry, geometry_in
from ...spectral.sample import Sample, same_conditions

# ΔE*ab from their mean beyond which repeated readings of one angle are hardly of one angle.
_SCATTER = 1.0


@dataclass(frozen=True)
class OverAngles:
    """Figures of one sample over its angles, by the first formula, of each angle the worst light.

    worst : the angle of the largest difference. mean, largest : ΔE over the angles. standard_flop, sample_flop : flop
    index of each; None where 45as15, 45as45 or 45as110 is missing. by_formula : mean and largest of each formula.
    """

    worst: str
    mean: float
    largest: float
    standard_flop: float | None
    sample_flop: float | None
    by_formula: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def flop_difference(self) -> float | None:
        """Sample minus standard."""
        if self.standard_flop is None or self.sample_flop is None:
            return None
        return self.sample_flop - self.standard_flop


def shared_angles(
    standard: Sample, samples: Sequence[Sample], wanted: Sequence[str] = ()
) -> tuple[tuple[Geometry, ...], tuple[str, ...]]:
    """Pair angles by their numbers: those to compare at, and notes on missing ones; none for single geometries.

    Parameters
    ----------
    wanted : aspecular angles of light at 45 degrees, such as "15", or notations; none: all common ones.

    Raises
    ------
    ComparisonError : a side has one angle or another geometry only, too few are shared, or a sample lacks an angle at
        which another one can be judged. UsageError : not an angle, or nothing was read at angles.
    """
    sides = (standard, *samples)
    # A reconstruction has its readings' angles, and is evaluated at those that a file has.
    measured = [side for side in sides if side.angles and side.angled is None]
    if not measured and all(side.angled for side in sides):
        measured = [side for side in sides if side.angles]
    if not measured:
        if wanted:
            raise UsageError("no side was read at several angles, so there are none to choose from")
        return (), ()
    for side in sides:
        others = next((other for other in measured if other is not side), side)
        if len(side.angles) == 1 or not (side.angles or side.angled):
            has = side.geometries[0].notation if side.angles else side.details.get("geometry") or "one geometry"
            raise ComparisonError(
                f"{side.name} of {side.source} has {has} alone\n"
                f"  found: {has} in {side.source}, {_listed(others.geometries)} in {others.source}\n"
                f"  expected: {FEWEST} angles or more that both sides have\n"
                "  try: measure both at the same angles"
            )
    shared = common([side.geometries for side in measured])
    every = dict.fromkeys(one.notation for side in measured for one in side.geometries)
    if wanted:
        shared = tuple(_chosen(text, shared) for text in wanted)
    elif len(shared) < FEWEST:
        raise ComparisonError(
            f"{len(shared)} angles are shared, too few to tell of an effect\n"
            + "\n".join(f"  found: {_listed(side.geometries)} in {side.source} ({side.name})" for side in measured[:4])
            + f"\n  expected: {FEWEST} angles or more that all sides have"
            + ("\n  try: name them with --angles to judge these alone" if shared else "")
        )
    if not wanted:
        _check_none_is_spared(standard, samples, shared)
    notes: list[str] = []
    for side in measured:
        lacking = [name for name in every if not _has(side, name)]
        if lacking and not wanted:
            notes.append(f"Not judged: {', '.join(lacking)}, which {side.name} of {side.source} does not have.")
        if any(one.first is None for one in side.geometries):
            notes.append(
                f"{side.name} of {side.source} does not state the angle of its light, which is taken as alike."
            )
        notes += _scattered(side)
    return shared, tuple(notes)


def _scattered(side: Sample) -> list[str]:
    """State at which angles repeated readings, which are averaged, differ by more than `_SCATTER`."""
    notes = []
    for geometry, part in zip(side.geometries, side.angles, strict=True):
        if len(part.readings) < 2:
            continue
        labs = np.array([replace(part, readings=(one,)).lab(*FLOP_CONDITIONS) for one in part.readings])
        off = float(np.linalg.norm(labs - labs.mean(axis=0), axis=1).max())
        if off > _SCATTER:
            times = f"{side.name} of {side.source} was read {len(labs)} times at {geometry.notation}"
            notes.append(
                f"{times}, up to ΔE*ab {off:.1f} from their mean, which is compared: was it always that angle?"
            )
    return notes


def _check_none_is_spared(standard: Sample, samples: Sequence[Sample], shared: Sequence[Geometry]) -> None:
    """Refuse to omit an angle of one sample because another sample lacks it: the first might fail only there."""
    anywhere = standard.angled is not None and not standard.made_up
    for side in samples:
        spared = [
            one.notation
            for one in side.geometries
            if not any(one.matches(each) for each in shared) and (anywhere or _has(standard, one.notation))
        ]
        lacking = next((one for one in samples if spared and one.angles and not _has(one, spared[0])), None)
        if lacking is not None:
            who, other = (f"{one.name} of {one.source}" for one in (lacking, side))
            raise ComparisonError(
                f"{who} lacks {spared[0]}, at which {other} can be judged\n"
                f"  found: {_listed(lacking.geometries)} of {who}; {_listed(side.geometries)} of {other}\n"
                "  expected: samples that were read at the same angles\n"
                "  try: match them apart, or name with --angles those that all are to be judged at"
            )


def over_angles(
    standard: Sample, sample: Sample, by_angle: Sequence[tuple[str, Mapping[str, float]]]
) -> OverAngles | None:
    """Compute figures over angles from pairs of a notation and its ΔE by formula; None without any."""
    worst: dict[str, dict[str, float]] = {}
    for angle, delta_e in by_angle:
        for name, value in delta_e.items():
            found = worst.setdefault(name, {})
            found[angle] = max(found.get(angle, 0.0), value)
    first = next(iter(worst.values()))
    if "" in first:
        return None
    farthest = max(first, key=lambda angle: first[angle])
    figures = {name: (float(np.mean(list(one.values()))), max(one.values())) for name, one in worst.items()}
    mean, largest = next(iter(figures.values()))
    return OverAngles(farthest, mean, largest, _flop(standard), _flop(sample), figures)


def _flop(side: Sample) -> float | None:
    if not side.spectral and not any(same_conditions(FLOP_CONDITIONS, kind) for kind in side.stated_for):
        return None
    lightness = {}
    for angle in FLOP_ANGLES:
        notation = f"45as{angle:g}"
        if side.angled is not None or _has(side, notation):
            lightness[angle] = float(side.at(notation).lab(*FLOP_CONDITIONS)[0])
    return flop_index(lightness)


def _has(side: Sample, notation: str) -> bool:
    wanted = geometry_in(notation)
    return wanted is not None and any(one.matches(wanted) for one in side.geometries)


def _chosen(text: str, shared: Sequence[Geometry]) -> Geometry:
    try:
        wanted = geometry_in(f"45as{float(text):g}")
    except ValueError:
        wanted = geometry_in(text)
    if wanted is None or wanted.kind != "multi-angle":
        raise UsageError(f"{text!r} is no angle: name aspecular angles such as 15,45,110, or notations such as 45as15")
    found = next((one for one in shared if one.matches(wanted)), None)
    if found is None:
        raise ComparisonError(f"not every side was read at {wanted.notation}; all have {_listed(shared) or 'none'}")
    return found


def _listed(angles: Sequence[Geometry]) -> str:
    return ", ".join(one.notation for one in angles)
