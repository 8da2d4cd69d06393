"""Criteria of a verification: figures with their limits, and recommended sets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...runtime.errors import InputError, UnknownNameError
from ...runtime.toml_records import RecordFile
from ...spectral.difference import FormulaName

#: Figures that `verification` knows, in words.
STATISTICS = {
    "white": "white",
    "average": "average of all patches",
    "p95": "95 % of all patches",
    "p99": "99 % of all patches",
    "maximum": "worst patch",
    "grey average": "greys, average ΔC",
    "grey maximum": "greys, largest ΔC",
    "primaries": "worst primary or secondary",
    "tone curve": "greys, largest ΔL*",
    "luminance": "luminance of white, percent off",
    "contrast": "contrast, percent off",
}


@dataclass(frozen=True)
class VerificationCriterion:
    """One criterion.

    statistic : of `STATISTICS`. nominal : limit of passing. recommended : stricter limit. formula : of ΔE.
    """

    statistic: str
    nominal: float
    recommended: float
    formula: str = "CIE 1994"

    def __post_init__(self) -> None:
        if self.statistic not in STATISTICS:
            raise UnknownNameError("statistic", self.statistic, STATISTICS, field="statistic")
        if not 0.0 < self.recommended <= self.nominal:
            raise InputError(
                "limits that contradict each other",
                field=self.statistic,
                found=f"nominal {self.nominal:g}, recommended {self.recommended:g}",
                expected="0 < recommended <= nominal",
            )


@dataclass(frozen=True)
class VerificationCriteria:
    """A list of them with its name."""

    name: str
    criteria: tuple[VerificationCriterion, ...] = ()


_E00: FormulaName = "CIE 2000"
#: Criteria by name. The first are those that Metamer takes where none are named.
KNOWN = {
    "metamer": VerificationCriteria(
        "Metamer",
        (
            VerificationCriterion("white", 2.0, 1.0),
            VerificationCriterion("average", 1.5, 1.0),
            VerificationCriterion("p95", 3.0, 2.0),
            VerificationCriterion("maximum", 4.0, 3.0),
            VerificationCriterion("grey average", 1.0, 0.5),
            VerificationCriterion("grey maximum", 2.5, 1.5),
            VerificationCriterion("primaries", 3.0, 2.0),
            VerificationCriterion("tone curve", 2.0, 1.0),
            VerificationCriterion("luminance", 10.0, 5.0),
            VerificationCriterion("contrast", 30.0, 15.0),
        ),
    ),
    "iso-14861": VerificationCriteria(
        "ISO 14861", (VerificationCriterion("average", 2.5, 2.5, _E00), VerificationCriterion("p99", 4.5, 4.5, _E00))
    ),
    "iso-12647-7": VerificationCriteria(
        "ISO 12647-7:2016",
        (
            VerificationCriterion("average", 2.5, 2.5, _E00),
            VerificationCriterion("maximum", 5.0, 5.0, _E00),
            VerificationCriterion("grey average", 2.0, 2.0, _E00),
            VerificationCriterion("grey maximum", 3.5, 3.5, _E00),
        ),
    ),
}
_FILE = RecordFile(
    VerificationCriteria, "metamer_criteria", 1, "criteria of a verification", "you, from docs/display.md"
)


def criteria_named(name: str | Path | None) -> VerificationCriteria:
    """Return criteria by name, or of a TOML file; None: Metamer's.

    Raises
    ------
    InputError : neither a known name nor a file of criteria.
    """
    if name is None:
        return KNOWN["metamer"]
    if str(name).casefold() in KNOWN:
        return KNOWN[str(name).casefold()]
    if not Path(name).exists():
        raise UnknownNameError("criteria", str(name), KNOWN, field="--criteria")
    found = _FILE.read(name)
    if not found.criteria:
        raise InputError("no criteria", file=name, field="criteria", expected="one [[criteria]] at least")
    return found
