"""`metamer bench`: speed against error, measured here and now."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

from ..runtime.worker_pool import usable_cores
from .options import Added, add_catalogue_option, add_json_option, catalogue_for, comma_separated, positive_count
from .output import figures_file, say, write_json, write_text

#: Benchmarks and their sentences in the help; without a name, the first two are run.
WHAT = {
    "basis": "the error of spectral bases by their size",
    "shading": "the time that folded terms take, beside RGB",
    "interactive": "another light, camera, map or colour, beside drawing anew",
    "factor": "packs beside other ways to factor a BRDF: minutes, with measured data half an hour",
    "svbrdf": "glossy surfaces under environments, shadows and all, beside the truth: minutes",
    "btf": "BTFs in few numbers, by what was published and by ours: minutes, all of it an hour",
    "transfer": "interreflection by kept rays and by precomputed tensors, beside paths: minutes",
    "report": "which changes `metamer report` finds, and whether it raises false alarms: a minute, all of it an hour",
    "display": "displays measured, modelled and driven, beside what they truly show: minutes",
    "catalogue": "queries on a catalogue of many materials, by its index: seconds, of a million minutes",
    "all": "basis and shading",
}


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `bench`."""
    command = subparsers.add_parser(
        "bench",
        help="speed against error, measured on this machine",
        description="Measure speed against error here and now. Without a word: all.",
    )
    command.set_defaults(run=run, what="all")
    _add_json(command, None)
    kinds = command.add_subparsers(metavar=f"{{{','.join(WHAT)}}}")
    for what, words in WHAT.items():
        kind = kinds.add_parser(what, help=words, description=f"Measure {words}.")
        kind.set_defaults(what=what)
        # A default here would take the place of what was said before the word.
        _add_json(kind, argparse.SUPPRESS)
        if what == "factor":
            _add_factor_options(kind)
        if what == "svbrdf":
            _add_svbrdf_options(kind)
        if what == "transfer":
            _add_transfer_options(kind)
        if what == "btf":
            _add_btf_options(kind)
        if what == "report":
            _add_report_options(kind)
        if what == "display":
            kind.add_argument("--case", metavar="PATTERN", help="only displays called so: * and ? for anything")
        if what == "catalogue":
            kind.add_argument("--materials", type=positive_count, default=20_000, metavar="N", help="default: 20000")


def _add_json(command: argparse.ArgumentParser, default: Any) -> None:
    add_json_option(command, default=default)


def _add_transfer_options(transfer: argparse.ArgumentParser) -> None:
    transfer.add_argument("--full", action="store_true", help="more scenes, lights, rays and sites: half an hour, 5 GB")
    transfer.add_argument("--case", metavar="PATTERN", help="only scenes called so: * and ? for anything")
    transfer.add_argument("--data", type=Path, metavar="DIR", help="a measured mesh joins in; default: $METAMER_DATA")


def _add_svbrdf_options(svbrdf: argparse.ArgumentParser) -> None:
    svbrdf.add_argument(
        "--full", action="store_true", help="more lights, meshes, points, fits and a catalogue: a quarter of an hour"
    )
    svbrdf.add_argument(
        "--case", metavar="PATTERN", help="only cases called so, or materials of the catalogue: * and ? for anything"
    )
    svbrdf.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help="measured skies, meshes, maps and materials join in; default: $METAMER_DATA",
    )
    add_catalogue_option(svbrdf)


def _add_report_options(report: argparse.ArgumentParser) -> None:
    report.add_argument("--full", action="store_true", help="every material, larger pictures, 24 repeats: an hour")
    report.add_argument("--materials", metavar="PATTERN", help="only those; default: three, with --full all")
    add_catalogue_option(report)


def _add_btf_options(btf: argparse.ArgumentParser) -> None:
    btf.add_argument("--full", action="store_true", help="larger crops, all cases and all methods: an hour")
    btf.add_argument("--case", metavar="PATTERN", help="only BTFs called so: * and ? for anything")
    btf.add_argument("--method", metavar="PATTERN", help="only methods called so: * and ? for anything")
    btf.add_argument("--texels", type=int, metavar="N", help="crop measured BTFs to N x N; 64, with --full 128")
    btf.add_argument("--data", type=Path, metavar="DIR", help="measured BTFs and skies join in; default: $METAMER_DATA")


def _add_factor_options(factor: argparse.ArgumentParser) -> None:
    factor.add_argument("--html", type=Path, metavar="FILE", help="also write a page with pictures, maps and plots")
    factor.add_argument(
        "--cases", type=comma_separated, action=Added, metavar="A,B", help="surfaces by name; default: all there are"
    )
    factor.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help="measured surfaces join in, a minute or two each; default: $METAMER_DATA, without it analytic ones only",
    )
    factor.add_argument("--baseline", action="store_true", help="also time tensorly, half a minute a surface")
    factor.add_argument("--no-points", action="store_true", help="leave out speed against error")
    factor.add_argument("--growth", action="store_true", help="decompose tables up to the paper's size and beyond")


def run(args: argparse.Namespace) -> int:
    """Measure and print; 0."""
    if args.what == "factor":
        return _factor(args)
    figures = {}
    if args.what in ("basis", "all"):
        from ..benchmarks import basis

        figures["basis"] = basis.run()
        print(basis.report(figures["basis"]))
    if args.what in ("shading", "all"):
        from ..benchmarks import shading

        figures["shading"] = shading.run()
        print(shading.report(figures["shading"]))
    if args.what == "interactive":
        from ..benchmarks import edits, interactive, reviewing

        figures["interactive"] = interactive.run()
        print(interactive.report(figures["interactive"]))
        figures["interactive"]["window"] = reviewing.run()
        print(reviewing.report(figures["interactive"]["window"]))
        figures["interactive"]["edits"] = edits.run()
        print(edits.report(figures["interactive"]["edits"]))
    if args.what == "svbrdf":
        return _svbrdf(args)
    if args.what == "btf":
        return _btf(args)
    if args.what == "transfer":
        return _transfer(args)
    if args.what == "report":
        return _report(args)
    if args.what == "display":
        return _display(args)
    if args.what == "catalogue":
        return _catalogue(args)
    if args.json:
        _write_figures(args.json, figures)
    return 0


def _data(args: argparse.Namespace) -> Path | None:
    return args.data or (Path(folder) if (folder := os.environ.get("METAMER_DATA")) else None)


def _svbrdf(args: argparse.Namespace) -> int:
    from ..benchmarks.svbrdf import benchmark

    catalogue = None
    # Ids have a slash in them, and cases have none.
    if (args.full and args.case is None) or args.catalogue or "/" in (args.case or ""):
        catalogue = catalogue_for(args.catalogue, jobs=1).folder
    measured = benchmark.run(args.full, _data(args), lambda line: print(line, flush=True), args.case, catalogue)
    print(benchmark.report(measured))
    if args.json:
        _write_figures(args.json, {"rows": measured["rows"]})
    return 0


def _display(args: argparse.Namespace) -> int:
    from ..benchmarks.display import benchmark

    measured = benchmark.run(lambda line: print(line, flush=True), args.case)
    print(benchmark.report(measured))
    if args.json:
        _write_figures(args.json, measured)
    return 0


def _catalogue(args: argparse.Namespace) -> int:
    from ..benchmarks import heads

    measured = heads.run(args.materials, say)
    print(heads.report(measured))
    if args.json:
        _write_figures(args.json, measured)
    return 0


def _btf(args: argparse.Namespace) -> int:
    from ..benchmarks.btf import benchmark

    say, data = lambda line: print(line, flush=True), _data(args)
    measured = benchmark.run(args.full, data, say, args.case, args.method, args.texels)
    print(benchmark.report(measured))
    if args.json:
        _write_figures(args.json, {"rows": measured["rows"]})
    return 0


def _transfer(args: argparse.Namespace) -> int:
    from ..benchmarks.transfer import benchmark

    measured = benchmark.run(args.full, _data(args), lambda line: print(line, flush=True), args.case)
    print(benchmark.report(measured))
    if args.json:
        _write_figures(args.json, measured)
    return 0


def _report(args: argparse.Namespace) -> int:
    from ..benchmarks import false_alarms, injected_changes

    folder = catalogue_for(args.catalogue, jobs=usable_cores()).folder
    pattern = args.materials or ("*" if args.full else "colorchecker/blue-*")
    size, repeats = (64, 24) if args.full else (24, 8)
    changed = injected_changes.run(folder, pattern, size, usable_cores())
    print(injected_changes.report(changed))
    unchanged = false_alarms.run(folder, pattern, size, repeats, say=lambda line: print(line, flush=True))
    print(false_alarms.report(unchanged))
    if args.json:
        _write_figures(args.json, {"injected": changed, "false_alarms": unchanged})
    return 0


def _factor(args: argparse.Namespace) -> int:
    from ..benchmarks.factor import benchmark, report

    data = _data(args)
    measured = benchmark.run(
        args.cases,
        data=data,
        picture_pixels=140 if args.html else 0,
        baseline=args.baseline,
        points=not args.no_points,
        growth=args.growth,
        progress=lambda line: print(line, flush=True),
    )
    print(report.report(measured))
    if args.json:
        _write_figures(args.json, report.result_document(measured))
    if args.html:
        _write(args.html, report.page(measured))
    return 0


def _write_figures(target: Path, document: Any) -> None:
    write_json(target, document)
    for path in figures_file(target):
        print(path)


def _write(path: Path, text: str) -> None:
    write_text(path, text)
    print(path)
