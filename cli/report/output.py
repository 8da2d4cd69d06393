"""Output of a comparison: on the terminal, and in files for people and programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..options import add_json_option
from ..output import figures_file, on_standard_output, write_json, write_text
from ..output import say_paragraph as printed
from ..progress.lines import progress_bar

if TYPE_CHECKING:
    from ...calibration.regression.result import Result
    from ...calibration.regression.row import ComparedSide

EXIT_CODES = (
    "Exit code 0: pass, or identical; 1: warnings; 2: failures; 3: the two cannot be compared (the same file, other "
    "whites, observers or sizes, nothing in common); 4: a file is unusable."
)
_FILES = (
    ("html", "a page: summary and worst rows first, with pictures"),
    ("junit", "JUnit XML, a test case a row"),
    ("csv", "a table, a line a layer of a row"),
    ("xlsx", "the same as a workbook (extra `xlsx`)"),
    ("markdown", "a short summary for a merge request"),
)


def add_output_options(command: argparse.ArgumentParser) -> None:
    """Add `--json` and the file options."""
    add_json_option(command)
    for name, words in _FILES:
        command.add_argument(f"--{name}", type=Path, metavar="FILE", help=words)
    command.add_argument(
        "--history", type=Path, metavar="FILE", help="earlier results, whose trend the page shows; this one is added"
    )


def check_output_options(args: argparse.Namespace) -> None:
    """Refuse unwritable files before any work."""
    from ...runtime import files
    from ...runtime.sheets import check_workbook

    asked = (getattr(args, name) for name in (*(name for name, _ in _FILES), "history"))
    # Into a folder that is compared, a page may be written.
    read = (getattr(args, name, None) for name in ("a", "b", "criteria"))
    written = [*(path for path in asked if path is not None), *figures_file(args.json)]
    files.check_outputs(written, (p for p in read if p and Path(p).is_file()))
    if args.xlsx is not None:
        check_workbook(args.xlsx)


def report_result(result: Result, before: ComparedSide, after: ComparedSide, args: argparse.Namespace) -> int:
    """Write and print the requested outputs; return the exit code of the result."""
    from ...calibration.regression.outputs import as_csv, as_json, as_junit, as_markdown, write_xlsx
    from ...calibration.regression.words import as_text
    from ...calibration.report.history import history_text, read_history, with_run
    from ...runtime.distribution import installed_version

    for path, form in ((args.junit, as_junit), (args.csv, as_csv), (args.markdown, as_markdown)):
        if path is not None:
            write_text(path, form(result))
    if args.xlsx is not None:
        write_xlsx(result, args.xlsx)
    runs = () if args.history is None else with_run(read_history(args.history), result.as_run(installed_version()))
    if args.html is not None:
        from ...calibration.regression.page import render_page

        with progress_bar("Writing the page", quiet=on_standard_output(args.json), after=1.0) as progress:
            page = render_page(result, before, after, installed_version(), runs, progress)
        write_text(args.html, page)
    if args.history is not None:
        write_text(args.history, history_text(runs))
    if args.json is not None:
        write_json(args.json, as_json(result, installed_version()))
    if not on_standard_output(args.json):
        printed(as_text(result))
    return result.exit_code
