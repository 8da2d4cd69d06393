"""Comparison in order: rows are matched, a known difference is injected, each pair is compared and judged."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from ...runtime.errors import ComparisonError
from ...spectral.measurement import AllowedDifference, crossed, remarks, why_not_comparable
from ...spectral.measurement import Side as Measured
from ..report.statistics import SelfCheck
from .change import Change, change
from .criteria import RESHAPED, Criteria, Criterion, Region, Tier, default_criteria, statistic
from .matching import matched
from .result import AskedCriteria, Figures, Result, RowResult, SideWords, State, worst_tier
from .row import ComparedSide, LayerKind, LayerNoise, PixelLayer, Pixels, Row
from .sampling_noise import Chance
from .self_test import injected

#: ΔE94 that pictures of one scene may be apart where nothing but the order of sums in single precision is another.
ROUNDING_MEAN, ROUNDING_MAX = 0.002, 0.02
#: Notes on a row whose reference moved, and on one whose picture moved alone.
REFERENCE_CHANGED = "The reference changed: the material, the light or the scene differs."
PICTURE_ALONE = "Only the picture moved: fit, plan or renderer is another; material, light and scene are not."
# Least change of the distance between picture and reference for a row to be called better or worse.
_NEARER = 0.01
# Sentences on how readings were measured that are told one by one.
_MOST_SENTENCES = 12
_94 = "CIE 1994"

Progress = Callable[[int, int, str], None]


def compare(
    before: ComparedSide,
    after: ComparedSide,
    criteria: Criteria,
    progress: Progress = lambda done, total, what: None,
    across: Collection[AllowedDifference] = (),
) -> Result:
    """Compare two sides; the first is the reference of every ΔE. Only the pictures of one row are in memory at a time.

    across : accepted differences between measurements, which the notes state.

    Raises
    ------
    ComparisonError : the sides are identical, have nothing in common, or differ in whites, observers or sizes; or
        readings that were measured differently.
    InputError : a file that cannot be read.
    """
    found = matched(before, after)
    unlike, remarked = _measurements(before, after, found.pairs, across)
    rows: list[RowResult] = []
    checks: tuple[SelfCheck, ...] = ()
    pools: dict[tuple[int, str], list[tuple[float, float]]] = defaultdict(list)
    for number, (a, b) in enumerate(found.pairs):
        row, pixels = _compared(a, b, criteria, pools)
        if not checks and pixels is not None:
            checks = injected(pixels, criteria.formulas, str(a.name))
        rows.append(row)
        progress(number + 1, len(found.pairs), str(a.name))
    rows += [RowResult(row.name, "removed", criteria.removed, {}, notes=row.notes) for row in found.removed]
    rows += [RowResult(row.name, "added", criteria.added, {}, notes=row.notes) for row in found.added]
    pooled = tuple(_pooled(criteria.lines[index], of, values) for (index, of), values in sorted(pools.items()))
    words = [SideWords(one.path, one.kind, one.facts, one.chain) for one in (before, after)]
    notes = (*found.notes, *unlike, *remarked, *_other_facts(before, after), *_unused(criteria, rows, pooled))
    return Result(words[0], words[1], tuple(rows), pooled, checks, criteria.lines, notes, unlike)


def _measurements(
    before: ComparedSide, after: ComparedSide, pairs: Sequence[tuple[Row, Row]], across: Collection[AllowedDifference]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Describe differences in how pairs were measured, and what one side does not state, each once.

    Raises
    ------
    ComparisonError : they were measured differently, and that was not accepted.
    """
    unlike: dict[str, None] = {}
    told: dict[str, None] = {}
    for a, b in pairs:
        if a.measurement is None or b.measurement is None:
            continue
        sides = [
            Measured(row.name.material or str(row.name), str(_source(row, side)), measurement)
            for row, side, measurement in ((a, before, a.measurement), (b, after, b.measurement))
        ]
        if reason := why_not_comparable(sides[0], sides[1], across):
            raise ComparisonError(reason)
        unlike |= dict.fromkeys(crossed(sides[0], sides[1]))
        told |= dict.fromkeys(remarks(sides[0], sides[1]))
    sentences = tuple(told)
    more = len(sentences) - _MOST_SENTENCES
    return tuple(unlike), (
        *sentences[:_MOST_SENTENCES],
        f"... and {more} more of that kind.",
    ) if more > 0 else sentences


def _source(row: Row, side: ComparedSide) -> Path:
    return next((layer.file for layer in row.layers.values() if layer.file is not None), side.path)


def _compared(
    a: Row, b: Row, criteria: Criteria, pools: dict[tuple[int, str], list[tuple[float, float]]]
) -> tuple[RowResult, Pixels | None]:
    """Compare one pair of rows; also return the pixels of the first's first layer."""
    layers: dict[LayerKind, Figures] = {}
    asked: list[AskedCriteria] = []
    notes: list[str] = []
    first: Pixels | None = None
    now: dict[LayerKind, Pixels] = {}
    for kind, one in a.layers.items():
        other = b.layers.get(kind)
        if other is None:
            continue
        label = f"{a.name}, {kind}"
        _two_files(one, other, label)
        pixels, now[kind] = one.load(), other.load()
        first = first or pixels
        notes += dict.fromkeys(layer.remark for layer in (one, other) if layer.remark)
        moved = change(pixels, now[kind], criteria.formulas, label, largest=criteria.largest)
        noise = (one.noise, other.noise)
        layers[kind] = _figures(moved, noise, kind)
        asked += _asked(moved, kind, a, criteria, noise, pools)
    if any("approximation" in one.of for one in criteria.lines) and {"picture", "reference"} <= now.keys():
        pair, label = (now["reference"], now["picture"]), f"{b.name}, approximation"
        error = change(*pair, criteria.formulas, label, largest=criteria.largest)
        asked += _asked(error, "approximation", a, criteria, (b.layers["reference"].noise,), pools)
    only = [kind for kind in {**a.layers, **b.layers} if kind not in layers]
    if only:
        notes.append(f"Only one side has a {' and a '.join(only)} of this row.")
    off = None
    if a.approximation is not None and b.approximation is not None:
        off = (a.approximation["p99"], b.approximation["p99"])
    tier: Tier = worst_tier([one.tier for one in asked])
    for kind, figures in layers.items():
        if figures.undefined:
            # The same bytes have not moved, whatever they hold.
            tier = tier if figures.identical else "fail"
            notes.append(f"{figures.undefined} compared pixels of the {kind} hold no number; they are in no figure.")
    notes += _why(layers)
    state = _state(layers, off)
    notes += [
        f"{one.criterion.label} ({one.of}): what rounding and noise of these files may come to is above the limit to "
        f"warn, {one.criterion.warn:g}: nothing as small as that can be resolved."
        for one in asked
        if not one.resolved and not _untouched(layers, one.of)
    ]
    there = {*layers, *(("approximation",) if off is not None else ())}
    unasked = not any(one.applies(a.name) and there & set(one.of) for one in criteria.lines)
    return RowResult(a.name, state, tier, layers, tuple(asked), off, tuple(notes), unasked), first


def _untouched(layers: Mapping[LayerKind, Figures], of: str) -> bool:
    """Return whether a layer has the same bytes, so that noise plays no role."""
    return any(kind == of and found.identical for kind, found in layers.items())


def _two_files(a: PixelLayer, b: PixelLayer, label: str) -> None:
    if a.file is None or b.file is None or not (a.file.exists() and b.file.exists()):
        # The reader refuses a missing file.
        return
    if a.file.samefile(b.file):
        raise ComparisonError(f"{label}: {a.file} is on both sides: a comparison with itself says nothing")


def _figures(moved: Change, noises: Sequence[LayerNoise | None], kind: LayerKind) -> Figures:
    values, compared = _numbers(moved.maps[_94], None)
    chance = Chance.of(noises, values.size)
    (floors, _), (bounds, _) = (_numbers(maps[_94], None) for maps in (moved.floors, moved.bounds))
    rounding = (ROUNDING_MEAN, ROUNDING_MAX) if kind == "picture" else (0.0, 0.0)
    floor_mean = max(math.hypot(statistic("mean", floors), chance.floor("mean")), rounding[0])
    floor_max = max(math.hypot(statistic("max", bounds), chance.floor("max")), rounding[1])
    mean, largest = statistic("mean", values), statistic("max", values)
    undefined = int(np.count_nonzero(compared)) - values.size
    beyond = not (mean <= floor_mean and largest <= floor_max)
    return Figures(
        mean=mean,
        median=statistic("median", values),
        p95=statistic("p95", values),
        p99=statistic("p99", values),
        max=largest,
        floor_mean=floor_mean,
        floor_max=floor_max,
        pixels=values.size,
        undefined=undefined,
        reshaped=moved.reshaped,
        identical=moved.identical,
        moved=not moved.identical and (beyond or moved.reshaped > 0),
        shift=moved.shift,
        worst=moved.worst,
        before_lab=moved.before_lab,
        after_lab=moved.after_lab,
    )


def _numbers(
    delta_e: Float[np.ndarray, "H W"], part: Bool[np.ndarray, "H W"] | None
) -> tuple[Float[np.ndarray, " n"], Bool[np.ndarray, "H W"]]:
    """Return ΔE of the compared pixels that have a number, and the mask of compared ones."""
    compared = ~np.isnan(delta_e) if part is None else ~np.isnan(delta_e) & part
    values = delta_e[compared]
    return values[np.isfinite(values)], compared


def _asked(
    moved: Change,
    of: str,
    row: Row,
    criteria: Criteria,
    noises: Sequence[LayerNoise | None],
    pools: dict[tuple[int, str], list[tuple[float, float]]],
) -> list[AskedCriteria]:
    """Return the criteria that apply to this layer of this row; pooled ones are added to their pool."""
    found = []
    for index, one in enumerate(criteria.lines):
        if of not in one.of or not one.applies(row.name):
            continue
        if one.statistic == RESHAPED:
            if of not in ("reading", "approximation"):
                found.append(AskedCriteria(one, of, moved.reshaped, 0.0, one.tier(moved.reshaped)))
            continue
        shape = moved.maps[one.formula.name].shape
        part = None if one.region is None else _part(criteria.regions[one.region], shape)
        values, _ = _numbers(moved.maps[one.formula.name], part)
        rounded = moved.bounds if one.statistic == "max" else moved.floors
        floors, _ = _numbers(rounded[one.formula.name], part)
        if not values.size and (one.region is not None or moved.identical):
            # Nothing of the material is in that part of the picture; or no number, which is said of the row.
            continue
        name = "mean" if one.pooled else one.statistic
        by_chance = Chance.of(noises, values.size).floor(name)
        floor = math.hypot(statistic(name, floors), by_chance)
        value = statistic(name, values)
        if one.pooled:
            pools[index, of].append((value, floor))
        else:
            found.append(_judged(one, of, value, floor))
    return found


def _judged(one: Criterion, of: str, value: float, floor: float) -> AskedCriteria:
    """Judge a figure; beyond a limit by no more than rounding and noise, it warns and does not fail."""
    tier = one.tier(value)
    return AskedCriteria(one, of, value, floor, "warn" if tier == "fail" and value <= floor else tier)


def _pooled(one: Criterion, of: str, values: Sequence[tuple[float, float]]) -> AskedCriteria:
    figures, floors = (np.array(column) for column in zip(*values, strict=True))
    return _judged(one, of, statistic(one.statistic, figures), statistic(one.statistic, floors))


def _part(region: Region, shape: tuple[int, ...]) -> Bool[np.ndarray, "H W"]:
    left, top, right, bottom = region
    y, x = ((np.arange(size) + 0.5) / size for size in shape)
    return ((y >= top) & (y < bottom))[:, None] & ((x >= left) & (x < right))[None, :]


def _state(layers: Mapping[LayerKind, Figures], off: tuple[float, float] | None) -> State:
    if layers and all(one.identical for one in layers.values()):
        return "identical"
    if not any(one.moved or one.undefined for one in layers.values()):
        return "same"
    # Against a reference that has moved too, nearer is no merit of the picture's.
    still = "reference" in layers and layers["reference"].identical
    if off is None or not still or abs(off[1] - off[0]) <= _NEARER:
        return "changed"
    return "worse" if off[1] > off[0] else "better"


def _why(layers: Mapping[LayerKind, Figures]) -> list[str]:
    """Describe the part of the approximation and that of the material."""
    if not {"picture", "reference"} <= layers.keys():
        return []
    picture, reference = layers["picture"], layers["reference"]
    if reference.moved:
        return [REFERENCE_CHANGED]
    if not picture.moved:
        return []
    if reference.identical:
        return [PICTURE_ALONE]
    return [
        f"The picture moved; whether the reference did cannot be told: its mean of {reference.mean:.2g} lies within "
        f"the {reference.floor_mean:.2g} of rounding and noise."
    ]


def _other_facts(before: ComparedSide, after: ComparedSide) -> list[str]:
    """Name differences in what made the two sides."""
    labels = [label for label in {**before.facts, **after.facts} if before.facts.get(label) != after.facts.get(label)]
    return [
        f"{label[:1].upper()}{label[1:]} changed from {before.facts.get(label, 'not stated')} to "
        f"{after.facts.get(label, 'not stated')}."
        for label in labels
    ]


def _unused(criteria: Criteria, rows: Sequence[RowResult], pooled: Sequence[AskedCriteria]) -> list[str]:
    """Return notes on criteria that apply to no row, and on rows without a criterion; none for the default criteria."""
    if criteria == default_criteria():
        return []
    used = {id(one.criterion) for row in rows for one in row.asked} | {id(one.criterion) for one in pooled}
    notes = [
        f'The criterion "{one.label}" applies to no row ({", ".join(one.of)}).'
        for one in criteria.lines
        if id(one) not in used
    ]
    free = [row for row in rows if row.unasked]
    if free:
        count = f"{len(free)} rows are" if len(free) > 1 else "A row is"
        notes.append(f"{count} held against no criterion, whatever moved: {free[0].name}{', ...' if free[1:] else ''}.")
    return notes
