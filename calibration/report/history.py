"""History of runs beside a report: the largest and the mean figure, row by row."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ...runtime.json_text import indented_json

HISTORY, SCHEMA = "history.json", "metamer.history/1"
#: Runs that are kept.
MOST = 30
# Size of the drawing and distance of its marks, SVG units.
_WIDTH, _HEIGHT, _APART = 340.0, 90.0, 11.0


@dataclass(frozen=True)
class Run:
    """One run.

    created : ISO 8601. version : of Metamer. status : how it came out. rows : a figure of each row, ΔE94, by its name.
    """

    created: str
    version: str
    status: str
    rows: Mapping[str, float] = field(default_factory=dict)

    @property
    def largest(self) -> float:
        """Largest figure of all rows; 0 of none."""
        return max(self.rows.values(), default=0.0)

    @property
    def mean(self) -> float:
        """Mean figure of all rows; 0 of none."""
        return math.fsum(self.rows.values()) / max(len(self.rows), 1)


def read_history(path: Path) -> tuple[Run, ...]:
    """Read the runs of a file, oldest first; none if it is missing, damaged or of another kind.

    Defects of a history must not stop work.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["schema"] != SCHEMA:
            return ()
        return tuple(
            Run(
                str(one["created"]),
                str(one["version"]),
                str(one["status"]),
                {str(name): float(value) for name, value in one["rows"].items()},
            )
            for one in document["runs"]
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return ()


def with_run(runs: Sequence[Run], run: Run) -> tuple[Run, ...]:
    """Append a run, which replaces the last one if all figures are equal."""
    # To four digits: a history is read, and may lie in version control. What has no number has none there either.
    figures = {name: float(f"{value:.4g}") for name, value in run.rows.items() if math.isfinite(value)}
    rounded = Run(run.created, run.version, run.status, figures)
    kept = list(runs)
    if kept and (kept[-1].version, kept[-1].status, kept[-1].rows) == (rounded.version, rounded.status, rounded.rows):
        kept.pop()
    return (*kept, rounded)[-MOST:]


def history_text(runs: Sequence[Run]) -> str:
    """Write a history as text."""
    document = {"schema": SCHEMA, "runs": [asdict(run) for run in runs]}
    return indented_json(document, indent=0) + "\n"


def trend_plot(runs: Sequence[Run], label: str) -> dict[str, Any] | None:
    """Plot the largest and the mean figure of each run as lines from 0 upwards; None for a single run."""
    if len(runs) < 2:
        return None
    top = max(run.largest for run in runs) or 1.0
    across = [_WIDTH * at / (len(runs) - 1) for at in range(len(runs))]
    lines = []
    for name in ("largest", "mean"):
        values = [getattr(run, name) for run in runs]
        places = [(x, _HEIGHT * (1.0 - value / top)) for x, value in zip(across, values, strict=True)]
        path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
        lines.append({"name": name, "path": path, "places": places, "first": values[0], "last": values[-1]})
    # Names at the ends of the lines, not on top of each other: the mean is never above the largest.
    lines[0]["label_at"] = float(lines[0]["places"][-1][1])
    lines[1]["label_at"] = max(float(lines[1]["places"][-1][1]), lines[0]["label_at"] + _APART)
    said = "; ".join(f"{one['name']} {one['first']:.2f} to {one['last']:.2f}" for one in lines)
    return {
        "width": _WIDTH,
        "height": _HEIGHT,
        "top": f"{top:.2g}",
        "lines": lines,
        "first": runs[0].created[:10],
        "last": runs[-1].created[:10],
        "words": f"{label} over {len(runs)} runs: {said}",
        "titles": [f"{run.created[:16].replace('T', ' ')}, Metamer {run.version}, {run.status}" for run in runs],
    }


def earlier_figures(runs: Sequence[Run], row: str) -> tuple[float, ...]:
    """Return a row's figures in up to five runs before the last, oldest first."""
    return tuple(run.rows[row] for run in runs[:-1] if row in run.rows)[-5:]
