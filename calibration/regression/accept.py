"""Acceptance of reviewed rows of a run into its baseline: one, some, or all."""

from __future__ import annotations

import fnmatch
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...runtime.errors import ComparisonError, InputError, UnknownNameError
from ...runtime.files import written_whole
from .baseline import BaselineContent, baseline_side, changing, check_suite, pixel_file, put, read_kept
from .row import RowName


def accept(baseline: Path, run: Path, patterns: Sequence[str] | None) -> tuple[str, ...]:
    """Copy rows of a run into the baseline; return the names of those that changed.

    Parameters
    ----------
    run : the folder of `metamer report run`, which stores the rendered rows like a baseline.
    patterns : of materials, as "paint/*", or of whole names; None accepts every row, and removes those that the run has
        not rendered.

    Raises
    ------
    ComparisonError : both are the same, or of other suites. InputError : either is damaged, or cannot be written to.
    UnknownNameError : a pattern matches no row of either.
    """
    if baseline.exists() and run.exists() and baseline.samefile(run):
        raise ComparisonError(f"{baseline} and {run} are the same: nothing to accept")
    fresh = read_kept(run)
    with changing(baseline):
        old = read_kept(baseline)
        check_suite(baseline, old.suite, run, fresh.suite)
        ours, theirs = (_by_name(kept) for kept in (old, fresh))
        chosen = _chosen({**ours, **theirs}, patterns, run)
        taken = [name for name in chosen if ours.get(name) != theirs.get(name)]
        whole = baseline_side(run)
        for row in whole.rows:
            if row.name in taken:
                for layer in row.layers.values():
                    # Read, so that a damaged file is refused before anything of the baseline changes.
                    layer.load()
        for name in taken:
            for layer in theirs.get(name, {"layers": {}})["layers"].values():
                source, target = (pixel_file(folder, layer["sha256"]) for folder in (run, baseline))
                if not target.exists():
                    with written_whole(target) as beside:
                        shutil.copyfile(source, beside)
        kept = {name: (theirs if name in chosen else ours).get(name) for name in {**ours, **theirs}}
        made = fresh if patterns is None else old
        put(
            baseline,
            BaselineContent(
                made.suite,
                made.environment,
                made.facts,
                made.chain,
                tuple(row for row in kept.values() if row is not None),
            ),
        )
    return tuple(str(name) for name in taken)


def _by_name(kept: BaselineContent) -> dict[RowName, Mapping[str, Any]]:
    try:
        return {RowName(*(str(row[part]) for part in RowName._fields)): row for row in kept.rows}
    except (KeyError, TypeError) as reason:
        raise InputError("a row without a name", field=str(reason), expected=", ".join(RowName._fields)) from None


def _chosen(rows: Mapping[RowName, Any], patterns: Sequence[str] | None, run: Path) -> set[RowName]:
    if patterns is None:
        return set(rows)
    found: set[RowName] = set()
    for pattern in patterns:
        fits = {name for name in rows if any(fnmatch.fnmatchcase(text, pattern) for text in (name.material, str(name)))}
        if not fits:
            raise UnknownNameError("row", pattern, [str(name) for name in rows], file=run)
        found |= fits
    return found
