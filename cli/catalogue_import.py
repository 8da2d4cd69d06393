"""`metamer catalogue import`: fit materials and store them."""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from .catalogue_words import CATALOGUE_HELP, print_table, say

if TYPE_CHECKING:
    from ..materials.importing import ImportReport, Progress


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `import`."""
    bring = verbs.add_parser("import", help="fit materials and store them in a catalogue")
    bring.add_argument(
        "sources",
        nargs="*",
        type=Path,
        metavar="SRC",
        help="source folder, family description (.toml) or measured file (.brdf, .binary, .bsdf, .exr); "
        "default: what ships",
    )
    bring.add_argument("--into", type=Path, metavar="CAT", help=CATALOGUE_HELP)
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
    bring.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Import; the exit code: 0, or 4 where something could not be used, or 130 after Ctrl-C."""
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
        print_table(table)
    for outcome in report.outcomes:
        if outcome.status == "failed":
            say(console, f"{outcome.id} failed: {outcome.reason}")
    measured = [(outcome.error.p99, outcome.id) for outcome in report.outcomes if outcome.error]
    if measured:
        missed = sum(p99 > budget for p99, _ in measured)
        say(console, "largest ΔE94 p99: {:.3f} ({})".format(*max(measured)))
        if missed:
            say(console, f"{missed} of {len(measured)} fits miss the budget of ΔE94 {budget:g}")
    say(console, report.sentence)
