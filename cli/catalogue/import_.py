"""`metamer catalogue import`: fit materials and store them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from ...calibration.report.text_tables import columns
from ...materials.catalogue.shipped import shipped_sources
from ...materials.records.standing import missed_words, misses_budget
from ...runtime.errors import InputError, UsageError, visible
from ...runtime.remote import local_folder, place
from ..options import CATALOGUE_HELP, add_json_option, add_scheduler_option, positive_count, positive_delta_e
from ..output import figures_file, say_paragraph, write_json
from ..progress.imports import import_shown

if TYPE_CHECKING:
    from ...materials.intake.importing import ImportOutcome, ImportReport
    from ...spectral.formats.import_options import ImportOptions

_SOURCES_HELP = """file, folder (with all below it), pattern ('**/*.cxf'), zip file or address (s3://bucket/folder) of
measurements: CxF3, CGATS, IES TM-27, QTX, JCAMP-DX, tables of spectra (CSV, .xlsx), spectral OpenEXR, MERL, RGL,
Cornell, glTF, maps, BTFs, family descriptions (.toml); known by content. Default: what ships"""

# Words of spectral.formats.import_options, repeated so that `--help` need not import it; a test compares them.
BTF_FORMS = (
    *("lpca", "lpca-paper", "rfp", "rfnl-1", "rfnl-2", "rfnl-4"),
    *("rfnl-1-separate", "rfnl-2-separate", "rfnl-4-separate"),
)
# Number of refusals for one reason from which they are said together, and of fits that are named at most.
_MANY = 3


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `import`."""
    bring = verbs.add_parser(
        "import",
        help="fit materials and store them in a catalogue",
        description="Read files of materials, fit a fast form to each and store them in a catalogue.",
    )
    # Text, not paths: a path would make one slash of the two in an address.
    bring.add_argument("sources", nargs="*", metavar="SRC", help=_SOURCES_HELP)
    into = bring.add_mutually_exclusive_group()
    into.add_argument("--catalogue", type=place, metavar="CAT", help=CATALOGUE_HELP)
    into.add_argument("--into", dest="catalogue", type=place, default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    bring.add_argument("--dry-run", action="store_true", help="say what is what and what is new; write nothing")
    bring.add_argument("--verbose", action="store_true", help="also name each material and each file not recognised")
    bring.add_argument("--jobs", type=positive_count, metavar="N", help="processes (default: one a core)")
    add_scheduler_option(bring, "fit")
    bring.add_argument(
        "--budget", type=positive_delta_e, default=0.5, metavar="D", help="ΔE94 that a fit aims at (default: 0.5)"
    )
    bring.add_argument(
        "--uplift",
        choices=("mallett-yuksel", "jakob-hanika", "smits"),
        default="mallett-yuksel",
        metavar="METHOD",
        help="how spectra are made for RGB measurements: mallett-yuksel (default), jakob-hanika or smits",
    )
    bring.add_argument(
        "--as",
        dest="quantity",
        choices=("reflectance", "transmittance", "emission", "radiance-factor"),
        help="what was measured, of all files that do not say it; of a file that is imported alone, whatever it says",
    )
    bring.add_argument("--scale", choices=("percent", "fraction"), help="the scale of values, likewise")
    bring.add_argument(
        "--angles",
        choices=("matt",),
        help="make a matt material of each reading of a paint at several angles, in place of one reconstructed from "
        "all of them; --as radiance-factor keeps them as readings",
    )
    bring.add_argument(
        "--decimal", choices=("comma", "point"), help="the decimal mark, of tables whose rows can be read in two ways"
    )
    bring.add_argument(
        "--maps",
        choices=("texels", "mended", "mean"),
        help="how texture maps are drawn: every texel (default), that with bad normals laid level, or their mean",
    )
    bring.add_argument(
        "--normal-map",
        choices=("opengl", "directx"),
        help="where green points in normal maps that neither say nor prove it: up (opengl) or down (directx)",
    )
    bring.add_argument(
        "--specular-map",
        choices=("f0-srgb", "f0-linear"),
        help="what specular maps hold: F at the normal, encoded as sRGB or linear (default: kept, not rendered)",
    )
    bring.add_argument(
        "--encoding", choices=("srgb", "linear", "xyz"), help="how numbers stand for light in the images of a BTF"
    )
    bring.add_argument(
        "--white",
        type=_white,
        metavar="W",
        help="linear number of a perfect white diffuser in a BTF's images, full scale 1: one, or R,G,B",
    )
    bring.add_argument(
        "--includes-cosine", choices=("yes", "no"), help="whether a BTF's values fall with the cosine of the light"
    )
    bring.add_argument("--texel-mm", type=float, metavar="MM", help="what a texel of a BTF is wide on the sample")
    bring.add_argument(
        "--fill", type=float, metavar="SHARE", help="of a BTF's images that may be made of others (default: 0.01)"
    )
    bring.add_argument(
        "--btf-form", choices=BTF_FORMS, help="how a BTF is drawn (default: what its error is smallest by)"
    )
    bring.add_argument("--family", type=_family, metavar="NAME", help="family of all materials (default: the source's)")
    bring.add_argument("--again", action="store_true", help="also fit what is there already: mends damaged files")
    bring.add_argument(
        "--copy", action="store_true", help="copy large arrays into the catalogue; default: they stay in their files"
    )
    add_json_option(bring, "the report, for a program")
    bring.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Import; the exit code: 0, or 4 where something could not be used."""
    sources = args.sources or [shipped_sources()]
    if args.catalogue is not None:
        local_folder(args.catalogue, "an import")
    with ExitStack() as stack:
        # Before what takes a second to load: nobody waits for a first word.
        shown = import_shown(stack, sources)
        from ...materials.catalogue.catalogue import default_catalogue
        from ...materials.intake.importing import ImportInterrupted, import_sources
        from ...runtime.files import check_writable

        for path in figures_file(args.json):
            check_writable(path)
        try:
            report = import_sources(
                sources,
                args.catalogue or default_catalogue(),
                jobs=args.jobs,
                scheduler=args.scheduler,
                budget=args.budget,
                dry_run=args.dry_run,
                progress=None if args.dry_run else shown.progress,
                looked_at=shown.looked_at,
                uplift=args.uplift,
                family=args.family,
                apart=True,
                again=args.again,
                begins=shown.begins,
                doing=shown.doing,
                answer=_answer(args),
                copy=args.copy,
                broken_off=lambda report: _write_json(args, report),
            )
        except ImportInterrupted as interrupted:
            stack.close()
            _say_reasons(interrupted.report, args.verbose)
            _write_json(args, interrupted.report)
            raise
    _write_json(args, report)
    if args.dry_run:
        _print_plan(report, args.verbose)
    else:
        _print_report(report, args.budget, args.verbose)
    return 4 if report.count("failed") or report.stopped else 0


def _answer(args: argparse.Namespace) -> ImportOptions:
    from ...spectral.formats.import_options import ImportOptions

    if args.quantity == "emission" and args.scale is not None:
        raise UsageError("an emission has no scale: leave --scale out")
    quantity = "radiance factor" if args.quantity == "radiance-factor" else args.quantity
    cosine = {"yes": True, "no": False}.get(args.includes_cosine)
    of_btfs = (args.encoding, args.white, cosine, args.texel_mm, args.fill, args.btf_form)
    of_tables = {"angles": args.angles, "decimal": args.decimal}
    try:
        return ImportOptions(quantity, args.scale, args.maps, args.normal_map, args.specular_map, *of_btfs, **of_tables)
    except InputError as reason:
        raise UsageError(str(reason)) from None


def _white(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"a number, or three with commas between them, not {text!r}") from None


def _family(text: str) -> str:
    import re

    if not re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", text):
        raise argparse.ArgumentTypeError(f"lower-case letters, digits and single hyphens, not {text!r}")
    return text


def _print_plan(report: ImportReport, verbose: bool) -> None:
    statuses = ("new", "skipped", "failed")
    counted = [
        (file.name, file.format, len(file.materials), *map(file.count, statuses), "; ".join(file.taken))
        for file in report.files
        if file.materials
    ]
    _print_files(("materials", *statuses, "taken as"), counted, words=True)
    if verbose:
        for file in report.files:
            for material in file.materials:
                say_paragraph(f"{material.status} {material.id}")
    _say_reasons(report, verbose)
    say_paragraph(report.sentence)


def _print_files(headings: tuple[str, ...], rows: list[tuple[Any, ...]], words: bool = False) -> None:
    """Print a table of files: name, format, figures, with 0 left empty; `words`: number of trailing text columns."""
    if not rows:
        return
    base = _common_folder([row[0] for row in rows])
    if base:
        say_paragraph(f"below {base}")
    shown = [
        [name[len(base) :], form or "?", *(str(figure or "") for figure in figures)] for name, form, *figures in rows
    ]
    _print_columns(("file", "format", *headings), shown, left=2, words=words)


def _print_columns(headings: Sequence[str], rows: list[list[str]], **layout: Any) -> None:
    print(columns(headings, [list(map(visible, row)) for row in rows], **layout))


def _common_folder(names: list[str]) -> str:
    """Return the common beginning of all names, up to a slash; "" for one name alone."""
    import os

    # Letter by letter: names are addresses too, and members of archives.
    folder, slash, _ = os.path.commonprefix(names).rpartition("/")  # noqa: RUF071
    return folder + slash if len(names) > 1 else ""


def _print_report(report: ImportReport, budget: float, verbose: bool) -> None:
    _print_files(("imported", "skipped", "failed", "ΔE94 p99", "s"), _summed_by_file(report, verbose))
    if verbose:
        _print_materials(report)
    _say_reasons(report, verbose)
    measured = [(outcome.error.p99, outcome.id) for outcome in report.outcomes if outcome.error]
    if measured:
        from ...materials.core.fit_error import far_off

        say_paragraph("largest ΔE94 p99: {:.3f} ({})".format(*max(measured)))
        fits = [(one.id, one.error) for one in report.outcomes if one.error]
        missed = sum(misses_budget(error) or (error.score is None and error.p99 > budget) for _, error in fits)
        if missed:
            say_paragraph(f"{missed} of {len(measured)} fits miss the budget of ΔE94 {budget:g}")
        over = [f"{name}: its fit {missed_words(error)}" for name, error in fits if misses_budget(error)]
        far = [f"{name}: {words}" for name, error in fits if (words := far_off(error))]
        for lines in (over, far):
            for line in lines if verbose else lines[:_MANY]:
                say_paragraph(line)
    if report.stopped:
        say_paragraph(report.stopped)
    say_paragraph(report.sentence)


def _summed_by_file(report: ImportReport, verbose: bool) -> list[tuple[Any, ...]]:
    """Return a row for each file with imported or failed materials; for the others, too, if `verbose`."""
    rows = []
    of_file: dict[str, list[ImportOutcome]] = {}
    for outcome in report.outcomes:
        of_file.setdefault(outcome.file, []).append(outcome)
    for file in report.files:
        here = of_file.get(file.name, [])
        imported, skipped, failed = (
            sum(outcome.status == status for outcome in here) for status in ("imported", "skipped", "failed")
        )
        if imported or failed or (skipped and verbose):
            p99 = max((outcome.error.p99 for outcome in here if outcome.error), default=None)
            seconds = sum(outcome.seconds for outcome in here)
            figures = ("" if p99 is None else f"{p99:.3f}", f"{seconds:.1f}" if seconds else "")
            rows.append((file.name, file.format, imported, skipped, failed, *figures))
    return rows


def _print_materials(report: ImportReport) -> None:
    rows = []
    for outcome in report.outcomes:
        error = outcome.error
        figures = (f"{error.mean:.3f}", f"{error.p99:.3f}") if error else ("", "")
        rows.append([outcome.id, outcome.status, *figures, f"{outcome.seconds:.1f}" if outcome.seconds else ""])
    _print_columns(("material", "status", "ΔE94 mean", "p99", "s"), rows, left=2)


def _say_reasons(report: ImportReport, verbose: bool) -> None:
    alike: dict[tuple[str, ...], list[str]] = {}
    for outcome in report.outcomes:
        if outcome.status == "failed":
            alike.setdefault(_problem(outcome.reason), []).append(outcome.reason)
    many = {problem for problem, reasons in alike.items() if len(reasons) >= _MANY}
    for problem in many:
        say_paragraph(f"failed: {problem[0]} ({len(alike[problem])})")
        for reason in alike[problem]:
            where, _, rest = reason.partition("\n")
            found = next((line.strip() for line in rest.split("\n") if line.startswith("  found: ")), "")
            say_paragraph(f"  {where.removesuffix(problem[0])}{found.removeprefix('found: ')}")
        for line in problem[1:]:
            say_paragraph(line)
    for outcome in report.outcomes:
        if outcome.status == "failed" and _problem(outcome.reason) in many:
            continue
        if outcome.status == "failed":
            # The reason often begins with the file, which is then all the name that there is.
            named = outcome.reason.startswith(outcome.id)
            say_paragraph(f"failed: {outcome.reason}" if named else f"{outcome.id} failed: {outcome.reason}")
        elif outcome.reason and verbose:
            say_paragraph(f"{outcome.id} {outcome.status}: {outcome.reason}")
    if verbose:
        for file in report.files:
            if not file.materials:
                say_paragraph(f"not recognised: {file.name}" + (f" ({file.note})" if file.note else ""))


def _problem(reason: str) -> tuple[str, ...]:
    """Return the part of an error common to several: the problem, the expectation, and the hint."""
    first, *rest = reason.split("\n")
    return first.rpartition(": ")[2], *(line for line in rest if line.startswith(("  expected: ", "  try: ")))


def _write_json(args: argparse.Namespace, report: ImportReport) -> None:
    """Write the report for programs (docs/catalogue.md), if requested."""
    if args.json is None:
        return
    from dataclasses import asdict

    from ...runtime.distribution import installed_version

    statuses = ("imported", "skipped", "failed", "new")
    document = {
        "metamer": installed_version(),
        "catalogue": str(report.folder),
        "budget_delta_e94": args.budget,
        "uplift": args.uplift,
        "counts": {status: report.count(status) for status in statuses} | {"remaining": report.remaining},
        "materials": [asdict(outcome) for outcome in report.outcomes],
        "files": [
            {
                "name": file.name,
                "format": file.format,
                "materials": [each.id for each in file.materials],
                "taken": list(file.taken),
            }
            for file in report.files
        ],
        "not_recognised": list(report.not_recognised),
        "stopped": report.stopped,
    }
    write_json(args.json, document)
