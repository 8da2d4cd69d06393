"""`metamer catalogue`: import materials, list, show and verify them."""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..materials.importing import ImportReport, Progress
    from ..materials.record import MaterialRecord

_CATALOGUE_HELP = "catalogue folder (default: $METAMER_CATALOGUE, or ./metamer-catalogue)"


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `catalogue` and what it can do."""
    parser = subparsers.add_parser("catalogue", help="import materials; list, show and verify them")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="{import,list,show,verify}")

    bring = verbs.add_parser("import", help="fit materials and store them in a catalogue")
    bring.add_argument(
        "sources",
        nargs="*",
        type=Path,
        metavar="SRC",
        help="source folder, family description (.toml) or measured file (.brdf, .binary, .bsdf, .exr); "
        "default: what ships",
    )
    bring.add_argument("--into", type=Path, metavar="CAT", help=_CATALOGUE_HELP)
    bring.add_argument("--jobs", type=_positive, metavar="N", help="processes (default: one a core)")
    bring.add_argument(
        "--budget", type=_budget, default=0.5, metavar="D", help="ΔE94 that a fit aims at (default: 0.5)"
    )
    bring.add_argument(
        "--uplift",
        default="mallett-yuksel",
        metavar="METHOD",
        help="how spectra are made for RGB measurements: mallett-yuksel (default), jakob-hanika or smits",
    )
    bring.add_argument("--dry-run", action="store_true", help="say what would be imported, and write nothing")

    listing = verbs.add_parser("list", help="every material with its model and measured error")
    show = verbs.add_parser("show", help="one material: provenance, model, packs, measured error")
    show.add_argument("id", metavar="ID", help='such as "colorchecker/red-gloss"')
    verify = verbs.add_parser("verify", help="read every file and compare its checksum")
    for verb in (listing, show, verify):
        verb.add_argument("catalogue", nargs="?", type=Path, metavar="CAT", help=_CATALOGUE_HELP)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Do what `args.verb` says; the exit code: 0, or 4 where a file could not be used, or 130 after Ctrl-C."""
    return {"import": _import, "list": _list, "show": _show, "verify": _verify}[args.verb](args)


def shipped_sources() -> Path:
    """The folder of the materials that come with metamer."""
    from importlib.resources import files

    return Path(str(files("metamer.catalogs"))) / "shipped"


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"at least 1, not {text}")
    return number


def _budget(text: str) -> float:
    number = float(text)
    if not 0 < number < 100:
        raise argparse.ArgumentTypeError(f"a ΔE94 above 0, not {text}")
    return number


def _import(args: argparse.Namespace) -> int:
    from rich.console import Console

    from ..materials.catalogue import default_catalogue
    from ..materials.importing import ImportInterrupted, import_sources

    console = Console()
    sources = args.sources or [shipped_sources()]
    try:
        with ExitStack() as stack:
            report = import_sources(
                sources,
                args.into or default_catalogue(),
                jobs=args.jobs,
                budget=args.budget,
                dry_run=args.dry_run,
                progress=import_progress(stack),
                uplift=args.uplift,
            )
    except ImportInterrupted as interrupted:
        console.print(f"Interrupted. {interrupted.report.sentence}.", markup=False, highlight=False, soft_wrap=True)
        return 130
    _print_report(console, report, args.budget)
    return 4 if report.count("failed") else 0


def import_progress(stack: ExitStack) -> Progress:
    """A live bar with the time left on a terminal, else a plain line a material; lives as long as `stack`."""
    import os

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console()
    if console.is_terminal and not os.environ.get("NO_COLOR"):
        text = TextColumn("{task.description}", markup=False)
        bar = stack.enter_context(
            Progress(text, BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=console)
        )
        task = bar.add_task("importing", total=None)
        return lambda done, total, outcome: bar.update(task, completed=done, total=total, description=outcome.id)

    def line(done: int, total: int, outcome) -> None:
        # A skipped material took no time: a line each would bury the others.
        if outcome.status != "skipped":
            print(f"[{done}/{total}] {outcome.status} {outcome.id}", flush=True)

    return line


def _print_report(console, report: ImportReport, budget: float) -> None:
    from rich import box
    from rich.table import Table

    rows = [outcome for outcome in report.outcomes if outcome.status != "skipped"]
    if rows:
        table = Table(box=box.SIMPLE)
        for heading in ("material", "status"):
            table.add_column(heading, no_wrap=True)
        for heading in ("ΔE94 mean", "p99", "s"):
            table.add_column(heading, justify="right", no_wrap=True)
        for outcome in sorted(rows, key=lambda outcome: (outcome.status, outcome.id)):
            error = outcome.error
            figures = (f"{error.mean:.3f}", f"{error.p99:.3f}") if error else ("", "")
            table.add_row(outcome.id, outcome.status, *figures, f"{outcome.seconds:.1f}" if outcome.seconds else "")
        _print_table(table)
    for outcome in report.outcomes:
        if outcome.status == "failed":
            _say(console, f"{outcome.id} failed: {outcome.reason}")
    measured = [(outcome.error.p99, outcome.id) for outcome in report.outcomes if outcome.error]
    if measured:
        missed = sum(p99 > budget for p99, _ in measured)
        _say(console, "largest ΔE94 p99: {:.3f} ({})".format(*max(measured)))
        if missed:
            _say(console, f"{missed} of {len(measured)} fits miss the budget of ΔE94 {budget:g}")
    _say(console, report.sentence)


def _list(args: argparse.Namespace) -> int:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    catalogue, console = _opened(args), Console()
    table = Table(box=box.SIMPLE)
    for heading in ("material", "model", "kind"):
        table.add_column(heading, no_wrap=True)
    for heading in ("terms", "ΔE94 p99"):
        table.add_column(heading, justify="right", no_wrap=True)
    unusable, measured = [], set()
    for material_id in catalogue.ids():
        try:
            record = catalogue.load(material_id)
        except Exception as reason:
            from ..spectral.errors import InputError

            if not isinstance(reason, InputError):
                raise
            unusable.append(reason)
            continue
        p99 = f"{record.error.p99:.3f}" if record.error else "?"
        if record.error:
            measured.add(f"{record.error.light} and the observer {record.error.observer}")
        table.add_row(material_id, record.model, record.provenance.kind, _terms(record), p99)
    _print_table(table)
    for reason in unusable:
        _say(console, str(reason))
    for conditions in sorted(measured):
        _say(console, f"ΔE94 p99: factored against original data, on a sphere under {conditions}; show ID says more")
    _say(console, f"{catalogue.folder}: {table.row_count} materials")
    return 4 if unusable else 0


def _show(args: argparse.Namespace) -> int:
    from rich.console import Console

    console, record = Console(), _opened(args).load(args.id)
    said = record.provenance
    # What a measured file says of itself is in the source and in the notes.
    told = ("name", "description", "measurement_notes") if record.model == "scattered" else ()
    parameters = ", ".join(_parameter(name, value) for name, value in record.parameters.items() if name not in told)
    lines = [
        ("material", record.id),
        ("model", record.model),
        ("parameters", parameters),
        ("kind", said.kind),
        ("source", said.source),
        ("licence", said.licence),
        ("geometry", said.geometry or "not stated"),
        ("notes", said.notes.replace(" + ", f"\n{'':11}") or "none"),
        ("packs", "; ".join(_pack(pack) for pack in record.packs)),
    ]
    if record.error:
        error = record.error
        figures = f"mean {error.mean:.3f}, p95 {error.p95:.3f}, p99 {error.p99:.3f}, max {error.maximum:.3f}"
        lines += [("ΔE94", f"{figures} ({error.light}, {error.observer})"), ("protocol", error.protocol)]
    for label, text in lines:
        _say(console, f"{label:11}{text}")
    return 0


def _verify(args: argparse.Namespace) -> int:
    from rich.console import Console

    console, catalogue = Console(), _opened(args)
    found = catalogue.verify()
    damaged = [reason for reason in found.values() if reason is not None]
    for reason in damaged:
        _say(console, str(reason))
    _say(console, f"{catalogue.folder}: {len(found) - len(damaged)} materials intact, {len(damaged)} damaged")
    return 4 if damaged else 0


def _opened(args: argparse.Namespace):
    from ..materials.catalogue import Catalogue, default_catalogue

    return Catalogue.open(args.catalogue or default_catalogue())


def _print_table(table) -> None:
    """Whole, on a terminal or through a pipe that is narrower too: a figure cut short is none."""
    from rich.console import Console

    Console(width=max(Console().width, 200)).print(table)


def _say(console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def _terms(record: MaterialRecord) -> str:
    return " + ".join(f"{pack.rank} {pack.frame}" for pack in record.packs)


def _pack(pack) -> str:
    grid = " x ".join(f"{axis.name} {axis.size}" for axis in pack.axes)
    return f"{pack.rank} terms in frame {pack.frame} ({grid}; {pack.basis.size} spectral coefficients)"


def _parameter(name: str, value: object) -> str:
    shape = getattr(value, "shape", ())
    return f"{name} {shape}" if shape else f"{name} {value}"
