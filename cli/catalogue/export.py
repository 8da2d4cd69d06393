"""`metamer catalogue export`: materials as files that other programs read."""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...runtime.remote import place
from ..options import CATALOGUE_HELP, add_output_option, open_catalogue
from ..output import say_paragraph
from ..progress.lines import progress_bar

if TYPE_CHECKING:
    from ...materials.catalogue.catalogue import Catalogue
    from ...materials.records.material import MaterialRecord

# Names of `materials.export.files.FORMATS`, which is imported only when something is exported.
_FORMATS = "csv, cxf, exr, gltf, materialx, merl, mitsuba, parquet, ubo, ubo-spectral or xlsx"


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `export`."""
    export = verbs.add_parser(
        "export",
        help=f"write materials as {_FORMATS}",
        description="Write materials of a catalogue for other programs.",
    )
    export.add_argument("ids", nargs="+", metavar="ID", help='such as "colorchecker/red-gloss" or "colorchecker/*"')
    export.add_argument("--catalogue", type=place, metavar="CAT", help=CATALOGUE_HELP)
    export.add_argument("--format", required=True, metavar="FORMAT", help=_FORMATS)
    add_output_option(export, "file, or folder for a file a material", metavar="OUT", required=True)
    export.add_argument("--force", action="store_true", help="write over what is there")
    export.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Export; 0. What cannot be written raises `InputError`."""
    from ...materials.export.files import export

    catalogue = open_catalogue(args.catalogue)
    ids = tuple(dict.fromkeys(name for pattern in args.ids for name in _matched(catalogue, pattern)))
    with progress_bar("Writing", after=1.0) as progress:
        records = _Records(catalogue, ids)
        done = export(
            records, args.format, args.out, force=args.force, progress=lambda n, of: progress(n, of, "images")
        )
    # Notes on every file are printed once.
    common = [note for note in done[0].notes if all(note in one.notes for one in done)] if len(done) > 1 else []
    for exported in done:
        say_paragraph(str(exported.path))
        for note in exported.notes:
            if note not in common:
                say_paragraph(f"  {note}")
    for note in common:
        say_paragraph(f"all {len(done)}: {note}")
    return 0


@dataclass(frozen=True)
class _Records(Collection):
    """Materials, loaded one at a time, since thousands do not fit into memory."""

    catalogue: Catalogue
    ids: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.ids)

    def __iter__(self) -> Iterator[MaterialRecord]:
        return (self.catalogue.load(name) for name in self.ids)

    def __contains__(self, record: object) -> bool:
        return getattr(record, "id", None) in self.ids


def _matched(catalogue: Catalogue, pattern: str) -> tuple[str, ...]:
    """Return ids; an existing id is itself, whatever characters it has."""
    if any(mark in pattern for mark in "*?["):
        return catalogue.match(pattern)
    catalogue.path(pattern)
    return (pattern,)
