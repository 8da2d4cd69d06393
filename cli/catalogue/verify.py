"""`metamer catalogue verify`: checksums of every file, and declared errors of every material measured again."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ...runtime.wording import counted
from ..options import add_catalogue_argument, add_json_option, add_scheduler_option, open_catalogue, positive_count
from ..output import on_standard_output, write_json
from ..progress.lines import progress_bar

if TYPE_CHECKING:
    from ...materials.core.fit_error import FitError
    from ...materials.records.verification import CatalogueVerification


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `verify`."""
    verify = verbs.add_parser(
        "verify",
        help="check every file and measure every declared error again",
        description="Reads every file, compares its checksum and its head, and measures the ΔE94 of its fast form "
        "against its original data again. Exit code 0: all of it holds; 1: what is there holds, but originals that "
        "were left outside of the catalogue are gone; 4: something does not hold.",
    )
    add_catalogue_argument(verify)
    verify.add_argument("--quick", action="store_true", help="checksums and heads only")
    verify.add_argument("--jobs", type=positive_count, metavar="N", help="processes; default: one a core")
    add_scheduler_option(verify, "verify")
    add_json_option(verify)
    verify.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Verify; 0, or 4 where a file is damaged or a declared error does not hold, or 1 where only originals are gone."""
    from ...materials.records.verification import verify_catalogue

    catalogue = open_catalogue(args.catalogue)
    with progress_bar("Verifying", quiet=on_standard_output(args.json)) as progress:
        found = verify_catalogue(
            catalogue.folder, quick=args.quick, jobs=args.jobs, scheduler=args.scheduler, progress=progress
        )
    if args.json is not None:
        write_json(args.json, _document(found))
    if not on_standard_output(args.json):
        _print(found)
    return 4 if found.damaged else 1 if found.incomplete else 0


def _print(found: CatalogueVerification) -> None:
    from ...materials.records.verification import TOLERANCE

    for one in found.damaged:
        print(one.problem)
    for note in dict.fromkeys(one.note for one in found.results if one.note):
        those = [one.id for one in found.results if one.note == note]
        more = f" and {len(those) - 1} more" if len(those) > 1 else ""
        print(f"{those[0]}{more}: error not measured: {note}")
    for path in found.strays:
        print(f"{path}: left behind by a writer that was killed; no reader uses it, and it may be deleted")
    again = [each for one in found.results for each in (one.measured, one.measured_environment, one.measured_texels)]
    measured = sum(error is not None for error in again)
    if measured:
        hold = "it holds where both" if measured == 1 else "they hold where they"
        print(f"{counted(measured, 'error')} measured again; {hold} agree within ΔE94 {TOLERANCE:g}")
    gone = f", {len(found.incomplete)} without their originals, which are gone" if found.incomplete else ""
    print(f"{found.folder}: {counted(len(found.intact), 'material')} intact{gone}, {len(found.damaged)} damaged")


def _document(found: CatalogueVerification) -> dict[str, Any]:
    """Return every figure, for a program."""
    materials = [
        {
            "id": one.id,
            "problem": None if one.problem is None else str(one.problem),
            "declared": one.declared and _figures(one.declared),
            "measured": one.measured and _figures(one.measured),
            "environment": {
                "declared": one.declared_environment and _figures(one.declared_environment),
                "measured": one.measured_environment and _figures(one.measured_environment),
            },
            "texels": {
                "declared": one.declared_texels and _figures(one.declared_texels),
                "measured": one.measured_texels and _figures(one.measured_texels),
            },
            "note": one.note,
            "missing": one.missing and str(one.missing),
        }
        for one in found.results
    ]
    strays = [str(path) for path in found.strays]
    return {"catalogue": str(found.folder), "materials": materials, "strays": strays}


def _figures(error: FitError) -> dict[str, float]:
    return {name: getattr(error, name) for name in ("mean", "p95", "p99", "maximum")}
