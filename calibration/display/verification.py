"""Verification of a characterised display: new readings against the model, judged by criteria."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from ...runtime.errors import ComparisonError
from ...spectral.difference import FormulaName, delta_e_xyz, lab_from_xyz
from ...spectral.observers import observer
from .criteria import STATISTICS, VerificationCriteria, VerificationCriterion
from .readings import Readings
from .record import DisplayRecord, digest

Verdict = Literal["pass", "recommended", "fail", "not resolved", "not measured"]
# ΔE94 that white may have moved before it counts as another state of the display, which figures would say nothing of.
STATE_TOLERANCE = 6.0
# The same reading again: of codes, of XYZ as a share and in their unit; of how many patches, and from which share of
# white on, since the darkest are alike by themselves.
_SAME_CODES, _SAME_SHARE, _SAME_CD_M2, _FEWEST_SAME, _BRIGHT = 1e-4, 5e-4, 0.006, 5, 0.05
# Readings of white that are averaged before its figure is believed.
_WHITES = 4
# Luminance of greys that are judged for hue, of white: below, ΔC is mostly noise.
_GREYS_FROM = 0.01
_PERCENT = ("luminance", "contrast")
_CHROMA = ("grey average", "grey maximum")


@dataclass(frozen=True)
class VerificationRow:
    """Judgement of one criterion. value : None if the readings lack data for it. note : why, or how."""

    criterion: VerificationCriterion
    value: float | None
    verdict: Verdict
    note: str = ""

    @property
    def words(self) -> str:
        """Figure in words."""
        return STATISTICS[self.criterion.statistic]

    @property
    def unit(self) -> str:
        """Unit: ΔE by a formula, ΔC, ΔL* or percent."""
        statistic = self.criterion.statistic
        if statistic in _PERCENT:
            return "%"
        return (
            "ΔC*ab" if statistic in _CHROMA else "ΔL*" if statistic == "tone curve" else f"ΔE {self.criterion.formula}"
        )


@dataclass(frozen=True, eq=False)
class Verification:
    """Readings compared with the model's predictions for their codes, the reference.

    Parameters
    ----------
    record : of the display. readings : one a patch. criteria : of the judgement. rows : judged.
    delta_e : (N,) ΔE94 by patch. repeatability : ΔE94 scatter of one reading of white, None if unknown.
    injected : ΔE94 that the whole computation finds for a known difference of 1. when : ISO 8601.
    """

    record: DisplayRecord
    readings: Readings
    criteria: VerificationCriteria
    rows: tuple[VerificationRow, ...]
    delta_e: Float[np.ndarray, " N"]
    repeatability: float | None
    injected: float
    when: str
    notes: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """The worst of all rows."""
        found = {row.verdict for row in self.rows}
        order: tuple[Verdict, ...] = ("fail", "not resolved", "pass", "recommended", "not measured")
        return next(one for one in order if one in found)

    @property
    def kept(self) -> dict[str, Any]:
        """Entry for the trend in the display's file."""
        figures = {row.criterion.statistic: row.value for row in self.rows}
        return {"when": self.when, "verdict": self.verdict, "criteria": self.criteria.name, "figures": figures}

    @property
    def document(self) -> dict[str, Any]:
        """Every figure, for a program."""
        return {
            "display": self.record.name,
            "when": self.when,
            "verdict": self.verdict,
            "criteria": self.criteria.name,
            "observer": self.readings.observer,
            "patches": len(self.readings),
            "repeatability_delta_e94": self.repeatability,
            "injected_delta_e94": self.injected,
            "rows": [
                {
                    "statistic": row.criterion.statistic,
                    "unit": row.unit,
                    "value": row.value,
                    "nominal": row.criterion.nominal,
                    "recommended": row.criterion.recommended,
                    "verdict": row.verdict,
                    "note": row.note,
                }
                for row in self.rows
            ],
            "patches_delta_e94": [
                {"codes": codes.tolist(), "delta_e94": float(value)}
                for codes, value in zip(self.readings.codes, self.delta_e, strict=True)
            ],
            "earlier": [dict(one) for one in self.record.verifications],
            "notes": list(self.notes),
        }


def verify(
    record: DisplayRecord, raw: Readings, criteria: VerificationCriteria, when: str, *, any_state: bool = False
) -> Verification:
    """Judge new readings of a characterised display.

    any_state : judge it even if its white differs so much that its settings must have been changed.

    Raises
    ------
    ComparisonError : the readings are those of the model; or of another display, observer, unit or state of the
        display.
    """
    _refuse_wrong(record, raw)
    readings, white = raw.averaged(), record.model.xyz(np.ones((1, 3)))[0]
    predicted = record.model.xyz(readings.codes)
    moved = float(delta_e_xyz(white, raw.white_xyz, white))
    if moved > STATE_TOLERANCE and not any_state:
        raise ComparisonError(
            f"{raw.source}: the display is in another state than when it was characterised\n"
            f"  found: white has moved by ΔE94 {moved:.1f}, from {_xyy(white)} to {_xyy(raw.white_xyz)}\n"
            f"  expected: at most {STATE_TOLERANCE:g}\n"
            "  try: set brightness, preset and profile as they were, or characterise it anew; --any-state judges all"
        )
    known = raw.repeatability if raw.repeatability is not None else record.repeatability
    repeatability = None if known is None else _scatter(known)
    notes = []
    if known is None:
        notes.append("No reading was repeated: what the instrument scatters by is not known, nor allowed for.")
    rows = tuple(_row(one, raw, readings, predicted, white, repeatability) for one in criteria.criteria)
    apart = delta_e_xyz(predicted, readings.xyz, white)
    return Verification(
        record, readings, criteria, rows, apart, repeatability, _injected(predicted, white), when, tuple(notes)
    )


def _refuse_wrong(record: DisplayRecord, raw: Readings) -> None:
    def refused(problem: str, found: str, hint: str) -> ComparisonError:
        return ComparisonError(f"{raw.source}: {problem}\n  found: {found}\n  try: {hint}")

    if digest(raw) == record.digest:
        raise refused(
            "these are the readings that the display was characterised with",
            f"the same numbers as in {record.readings.source or 'the file of the display'}",
            "measure again, another set: `metamer display patches --for verify`",
        )
    shared, same = _read_again(record, raw)
    if same >= _FEWEST_SAME and same > 0.5 * shared:
        raise refused(
            "these are readings that the display was characterised with",
            f"{same} of the {shared} patches that both have, to the last digits that are written",
            "measure again, another set: `metamer display patches --for verify`",
        )
    named = raw.display.strip()
    if named and record.readings.display and named.casefold() != record.readings.display.strip().casefold():
        raise refused(
            "readings of another display",
            f"{named!r}, where {record.readings.display!r} was characterised",
            "name its own file of the display",
        )
    if observer(raw.observer).name != observer(record.readings.observer).name:
        raise refused(
            "readings of another observer",
            f"{raw.observer}, where {record.readings.observer} was characterised",
            "read the spectra for the same observer, or characterise for this one",
        )
    if raw.absolute != record.readings.absolute:
        words = ("relative to white = 100", "in cd/m2")
        raise refused(
            "readings in another unit",
            f"XYZ {words[raw.absolute]}, where the display was characterised {words[record.readings.absolute]}",
            "--xyz Y100 --white-luminance L says how bright its white is",
        )


def _read_again(record: DisplayRecord, raw: Readings) -> tuple[int, int]:
    """Count the patches that were also measured for the record, and those of them with the same XYZ.

    For patches above a twentieth of white: repeated readings hardly agree in X, Y and Z to a thousandth, copies with
    fewer digits do.
    """
    bright = raw.xyz[:, 1] > _BRIGHT * raw.white_xyz[1]
    inner = bright & ~(raw.codes >= 1.0 - _SAME_CODES).all(axis=1)
    shared = same = 0
    for codes, xyz in zip(raw.codes[inner], raw.xyz[inner], strict=True):
        rows = record.read[(np.abs(record.read[:, :3] - codes) < _SAME_CODES).all(axis=1), 3:]
        if len(rows):
            shared += 1
            close = np.abs(rows - xyz) <= np.maximum(_SAME_SHARE * np.abs(rows), _SAME_CD_M2)
            same += bool(close.all(axis=1).any())
    return shared, same


def _xyy(xyz: np.ndarray) -> str:
    return f"x {xyz[0] / xyz.sum():.4f}, y {xyz[1] / xyz.sum():.4f}, Y {xyz[1]:.1f}"


def _scatter(relative: Float[np.ndarray, "3"]) -> float:
    """Compute the RMS ΔE94 scatter of white from independent scatter in X, Y and Z (CIE 015:2018 eq. 8.3-8.5)."""
    f = relative / 3.0
    off = np.array([116.0 * f[1], 500.0 * np.hypot(f[0], f[1]), 200.0 * np.hypot(f[1], f[2])])
    return float(np.linalg.norm(off))


def _row(
    criterion: VerificationCriterion,
    raw: Readings,
    readings: Readings,
    predicted: np.ndarray,
    white: np.ndarray,
    repeatability: float | None,
) -> VerificationRow:
    found, lacks = _figure(criterion, raw, readings, predicted, white)
    if found is None:
        return VerificationRow(criterion, None, "not measured", lacks)
    statistic = criterion.statistic
    if statistic == "white" and raw.whites.size < _WHITES:
        return VerificationRow(
            criterion, found, "not resolved", f"white was read {raw.whites.size} times; {_WHITES} are averaged"
        )
    if repeatability is not None and statistic not in _PERCENT and criterion.nominal < 2.0 * repeatability:
        return VerificationRow(criterion, found, "not resolved", f"the instrument scatters by ΔE94 {repeatability:.2f}")
    verdict: Verdict = (
        "recommended" if found <= criterion.recommended else "pass" if found <= criterion.nominal else "fail"
    )
    return VerificationRow(criterion, found, verdict)


def _figure(
    criterion: VerificationCriterion, raw: Readings, readings: Readings, predicted: np.ndarray, white: np.ndarray
) -> tuple[float | None, str]:
    """Compute the figure, or return None and the missing data."""
    statistic, formula = criterion.statistic, criterion.formula
    apart = delta_e_xyz(predicted, readings.xyz, white, _formula(formula))
    whole = np.isin(readings.codes, (0.0, 1.0)).all(axis=1)
    if statistic == "white":
        return float(delta_e_xyz(white, raw.white_xyz, white, _formula(formula))), ""
    if statistic == "luminance":
        return 100.0 * abs(float(raw.white_xyz[1] / white[1]) - 1.0), ""
    if statistic in ("average", "p95", "p99", "maximum"):
        of = {
            "average": apart.mean(),
            "p95": np.percentile(apart, 95),
            "p99": np.percentile(apart, 99),
            "maximum": apart.max(),
        }
        return float(of[statistic]), ""
    if statistic == "primaries":
        inks = whole & (readings.codes.sum(axis=1) > 0.0) & (readings.codes.sum(axis=1) < 3.0)
        return (float(apart[inks].max()), "") if inks.any() else (None, "no patch of full codes")
    if statistic == "contrast":
        black = readings.codes.max(axis=1) <= 0.0
        before = float(white[1] / max(record_black(predicted, black), 1e-9)) if black.any() else 0.0
        if not black.any() or readings.xyz[black, 1].min() <= 1e-4 * white[1] or before > 1e4:
            return None, "black is not there, or too dark for the instrument"
        now = float(raw.white_xyz[1] / readings.xyz[black, 1].mean())
        return 100.0 * abs(now / before - 1.0), ""
    grey = (np.ptp(readings.codes, axis=1) < 1e-6) & (predicted[:, 1] > _GREYS_FROM * white[1])
    grey &= readings.codes[:, 0] < 1.0
    if not grey.any():
        return None, "no greys between black and white"
    off = lab_from_xyz(readings.xyz[grey], white) - lab_from_xyz(predicted[grey], white)
    if statistic == "tone curve":
        return float(np.abs(off[:, 0]).max()), ""
    chroma = np.hypot(off[:, 1], off[:, 2])
    return float(chroma.mean() if statistic == "grey average" else chroma.max()), ""


def record_black(predicted: np.ndarray, black: np.ndarray) -> float:
    """Compute the luminance of black by the model."""
    return float(predicted[black, 1].mean())


def _formula(name: str) -> FormulaName:
    from ...spectral.formula import formula

    return formula(name).name  # type: ignore[return-value]


def _injected(predicted: np.ndarray, white: np.ndarray) -> float:
    """Compute ΔE94 for patches with lightness raised by 1: a report that cannot find it is not trusted."""
    from ...spectral.difference import xyz_from_lab

    lab = lab_from_xyz(predicted, white)
    moved = xyz_from_lab(lab + np.array([1.0, 0.0, 0.0]), white)
    return float(delta_e_xyz(predicted, moved, white).mean())


def trend(record: DisplayRecord, statistic: str) -> list[tuple[str, float]]:
    """Return a figure of earlier verifications, by time."""
    found: list[tuple[str, float]] = []
    for one in record.verifications:
        figures: Mapping[str, Any] = one.get("figures", {})
        if figures.get(statistic) is not None:
            found.append((str(one.get("when", "")), float(figures[statistic])))
    return found
