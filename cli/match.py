"""`metamer match`: samples beside their standard: differences, verdicts, metamerism, and the page that is signed."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..calibration.report.text_tables import columns
from ..runtime.errors import UsageError
from ..runtime.remote import place
from .options import (
    Added,
    add_across_option,
    add_answer_options,
    add_json_option,
    answer_of,
    checked,
    comma_separated,
    parse_lights,
    parse_observer,
)
from .output import on_standard_output, write_json, write_text
from .progress.lines import progress_bar

if TYPE_CHECKING:
    from ..calibration.match.page import MatchReport

_FILLED_IN = ("project", "part", "supplier", "instrument")
_CODES = {"not judged": 0, "pass": 0, "not resolved": 1, "fail": 2}


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `match`."""
    match = subparsers.add_parser(
        "match",
        help="samples beside a standard: differences, verdicts, metamerism",
        description="Does this batch match the master? STANDARD and SAMPLE are an id of the catalogue, a file of "
        "readings (CxF3, CGATS, QTX, JCAMP-DX, instrument text, tables such as CSV with wavelengths down or across, "
        "or a sample, a wavelength and its value in each row), FILE#NAME for one reading of it, a folder of such "
        'files, or a colour such as "lab:52.1,10.3,-5.6@D65/1964_10". Readings of one name in one file count as '
        "one sample, by their mean. Exit code 1 where a verdict is too close to call, or a tolerance is given and "
        "nothing of a sample is judged, since a colour was made up and not measured; 2 where a sample fails, 3 "
        "where nothing can be compared, 4 where a file is unusable, 64 where words of the command are.",
    )
    match.add_argument("standard", metavar="STANDARD", help="what the samples are to match")
    match.add_argument("samples", metavar="SAMPLE", nargs="+", help="one or more, or files and folders that hold them")
    match.add_argument(
        "--tolerance",
        type=_tolerance,
        metavar="WORDS",
        help='such as "CMC 2:1 1.0" or "CIE 2000 0.8"; none: not judged',
    )
    match.add_argument(
        "--formulas",
        type=_formulas,
        action=Added,
        metavar="X,Y",
        help="ΔE by these (default: CIE 2000,CMC 2:1,CIE 1994,CIE 1976, and at angles DIN 6175-2); also CMC l:c, "
        "CAM16-UCS",
    )
    match.add_argument(
        "--illuminants",
        type=parse_lights,
        action=Added,
        metavar="X,Y",
        help="names, or files of measured lamps (default: D65,A,TL84; that of a standard of one colour)",
    )
    match.add_argument("--observers", type=_observers, action=Added, metavar="X,Y", help="default: 1964_10")
    match.add_argument(
        "--angles",
        type=comma_separated,
        action=Added,
        default=(),
        metavar="X,Y",
        help="of paint read at several angles, those to judge, such as 15,45,110 (default: all that both sides have)",
    )
    match.add_argument(
        "--repeatability",
        type=_repeatability,
        metavar="D",
        help="ΔE*ab that the instrument's readings scatter by, root mean square",
    )
    match.add_argument(
        "--repeated", metavar="FILE", help="readings of one thing, which tell what the instrument's readings scatter by"
    )
    add_answer_options(match)
    add_across_option(match)
    match.add_argument(
        "--whiteness",
        action="append",
        nargs="?",
        const="CIE 2004",
        choices=("CIE 2004", "ASTM E313", "ASTM E313-73"),
        help="whiteness, with tint, of each; default CIE 2004",
    )
    match.add_argument("--yellowness", action="store_true", help="yellowness of each by ASTM E313")
    match.add_argument("--catalogue", type=place, metavar="CAT", help="where ids are looked up")
    for name in _FILLED_IN:
        match.add_argument(f"--{name}", default="", metavar="WORDS", help=f"{name}, filled in at the head of the page")
    match.add_argument("--html", type=Path, metavar="FILE", help="a page to print and sign; - as of --json")
    add_json_option(match)
    match.add_argument("--csv", type=Path, metavar="FILE", help="a table, a line a sample and condition")
    match.add_argument("--xlsx", type=Path, metavar="FILE", help="the same as a workbook (extra `xlsx`)")
    match.add_argument("--junit", type=Path, metavar="FILE", help="JUnit XML, a test case a sample")
    match.add_argument("--markdown", type=Path, metavar="FILE", help="a short summary for a merge request")
    match.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Compare; the exit code is in the command's description."""
    from ..calibration.match.outputs import as_junit, as_markdown, figures
    from ..calibration.match.table import as_csv, write_xlsx
    from ..runtime.files import check_outputs
    from ..runtime.sheets import check_workbook

    if on_standard_output(args.xlsx):
        raise UsageError("--xlsx: a workbook goes into a file, not to standard output")
    asked = (args.html, args.json, args.csv, args.xlsx, args.junit, args.markdown)
    outputs = [path for path in asked if path is not None and not on_standard_output(path)]
    check_outputs(outputs, [args.standard, *args.samples, *([args.repeated] if args.repeated else [])])
    if args.xlsx is not None:
        check_workbook(args.xlsx)
    report = _report(args)
    quiet = on_standard_output(args.json)
    if not quiet:
        _print(report)
    if args.json is not None:
        write_json(args.json, figures(report))
    if args.html is not None:
        write_text(args.html, report.html())
    for path, form in ((args.csv, as_csv), (args.junit, as_junit), (args.markdown, as_markdown)):
        if path is not None:
            write_text(path, form(report))
    if args.xlsx is not None:
        write_xlsx(report, args.xlsx)
    for path in outputs if not quiet else ():
        print(f"Written: {path}")
    # A missing verdict must not read as a pass where a tolerance was asked for.
    codes = _CODES if args.tolerance is None else {**_CODES, "not judged": _CODES["not resolved"]}
    return max(codes[one.verdict] for one in report.samples)


def _tolerance(text: str) -> str:
    from ..calibration.match.tolerance import Tolerance

    return checked(text, Tolerance.of)


def _formulas(text: str) -> tuple[str, ...]:
    from ..spectral.formula import formula

    return tuple(checked(name, formula) for name in comma_separated(text))


def _observers(text: str) -> tuple[str, ...]:
    return tuple(map(parse_observer, comma_separated(text)))


def _repeatability(text: str) -> float:
    from ..calibration.match.uncertainty import Repeatability

    return float(checked(text, lambda number: Repeatability(float(number))))


def _report(args: argparse.Namespace) -> MatchReport:
    from ..viewer.match import match

    with progress_bar("Reading", after=1.0) as progress:
        return match(
            args.standard,
            args.samples,
            args.tolerance,
            formulas=args.formulas,
            illuminants=args.illuminants,
            observers=args.observers,
            repeatability=args.repeatability,
            repeated=args.repeated,
            catalogue=args.catalogue,
            whites=[*(args.whiteness or ()), *(["yellowness"] if args.yellowness else [])],
            answer=answer_of(args),
            across=args.across,
            angles=args.angles,
            signed={name: getattr(args, name) for name in _FILLED_IN},
            progress=progress,
        )


def _print(report: MatchReport) -> None:
    from ..calibration.match.tolerance import VERDICT_WORDS

    judging = report.asked.judging.name
    several = len(report.asked.conditions) > 1
    rows = []
    for one in report.samples:
        for at, found in enumerate(one.differences):
            known = found.spread
            off = found.off
            ends = [f"{value:+.2f}" for value in (off.lightness, off.a, off.b, off.chroma, off.hue)]
            about = "" if known is None else f" ±{known.delta_e[judging]:.2f}"
            others = [f"{found.delta_e[name]:.2f}" for name in found.delta_e if name != judging]
            head = [one.sample.name if at == 0 else "", report.place(found.conditions)]
            rows.append(
                [
                    *head,
                    *ends,
                    f"{found.delta_e[judging]:.2f}{about}",
                    *others,
                    VERDICT_WORDS[found.verdict],
                    found.words,
                ]
            )
    first = report.samples[0].differences[0]
    others = [name for name in first.delta_e if name != judging]
    axes = ["ΔL*", "Δa*", "Δb*", "ΔC*", "ΔH*"]
    headings = ["sample", "light", *axes, judging, *others, "verdict", "direction"]
    print(f"Standard: {report.standard.name} ({report.standard.source})\n{report.facts}")
    print(columns(headings, rows, left=2, words=True))
    if several:
        _print_indices(report)
    _print_angles(report)
    _print_whites(report)
    _print_batches(report)
    for words in report.notes:
        print(words)
    print(report.summary)


def _print_indices(report: MatchReport) -> None:
    """Print a column per index and changed condition, a row per sample."""
    heads = list(dict.fromkeys(f"{i.name}, {i.changed}" for one in report.samples for i in one.indices))
    if not heads:
        return
    print(f"\nFrom {report.place(report.asked.conditions[0])}, ΔE by {report.asked.judging.name}:")
    for number, head in enumerate(heads, 1):
        print(f"  {number}  {head}")
    rows = []
    for one in report.samples:
        told = {f"{i.name}, {i.changed}": "-" if i.value is None else f"{i.value:.2f}" for i in one.indices}
        rows.append([one.sample.name, *(told[head] for head in heads)])
    print(columns(["sample", *map(str, range(1, len(heads) + 1))], rows, left=1))
    for words in dict.fromkeys(i.words for one in report.samples for i in one.indices if i.words):
        print(f"No index: {words}")


def _print_angles(report: MatchReport) -> None:
    """Print a row per sample that was read at several angles."""
    rows = []
    for one in report.samples:
        if one.angles is not None:
            flop = (one.angles.standard_flop, one.angles.sample_flop, one.angles.flop_difference)
            numbers = [f"{one.angles.largest:.2f}", f"{one.angles.mean:.2f}"]
            rows.append(
                [one.sample.name, one.angles.worst, *numbers, *("-" if v is None else f"{v:.2f}" for v in flop)]
            )
    if rows:
        name_of_first = next(iter(report.samples[0].differences[0].delta_e))
        print(f"\nOver the angles, {name_of_first}, of each the worst light; flop index (D65, 1964_10):")
        headings = ["sample", "worst angle", "largest", "mean", "flop, standard", "flop, sample", "difference"]
        print(columns(headings, rows, left=2))
        more = [name for name in report.samples[0].differences[0].delta_e if name != name_of_first]
        for one in report.samples:
            told = one.angles.by_formula if one.angles is not None else {}
            words = (
                f"{other}: largest {told[other][1]:.2f}, mean {told[other][0]:.2f}" for other in more if other in told
            )
            print(f"{one.sample.name}, {'; '.join(words)}")


def _print_whites(report: MatchReport) -> None:
    """Print a row per sample, scale and condition."""
    rows = []
    for one in report.samples:
        for at, found in enumerate(one.whites):
            known = "" if found.uncertainty is None else f" ±{found.uncertainty:.2f}"
            numbers = ["-" if value is None else f"{value:.2f}" for value in (found.standard, found.sample)]
            off = "-" if found.off is None else f"{found.off:+.2f}{known}"
            tints = ["" if value is None else f"{value:.2f}" for value in (found.standard_tint, found.sample_tint)]
            rows.append([one.sample.name if at == 0 else "", found.name, found.conditions, *numbers, off, *tints])
    if rows:
        print("\nWhiteness and yellowness:")
        headings = [
            "sample",
            "scale",
            "light, observer",
            "standard",
            "sample",
            "difference",
            "tint, standard",
            "tint, sample",
        ]
        print(columns(headings, rows, left=3))
    for words in dict.fromkeys(found.words for one in report.samples for found in one.whites if found.words):
        print(f"None: {words}")


def _print_batches(report: MatchReport) -> None:
    rows = []
    for where, found in zip(report.asked.conditions, report.batches, strict=True):
        if found is not None:
            figures = [*(f"{value:+.2f}" for value in found.mean), *(f"{value:.2f}" for value in found.deviation)]
            drift = "too few to tell" if found.per_sample is None else ", ".join(found.drifts) or "none"
            rows.append([report.place(where), *figures, f"{found.scatter:.2f}", drift])
    if rows:
        count = len(report.samples)
        print(f"\nThe batch of {count}: mean of sample minus standard, standard deviation, mean ΔE from their own mean")
        print(columns(["", "ΔL*", "Δa*", "Δb*", "s L*", "s a*", "s b*", "scatter", "drift"], rows, left=1, words=True))
