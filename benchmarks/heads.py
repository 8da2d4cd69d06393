"""Speed of queries on a catalogue of many materials: by its index, and with every head read.

    metamer bench catalogue [--materials 20000] [--json OUT.json]

The materials are heads alone, generated: a query reads no more of a file. `cold` is the first query of a process of its
own, from the catalogue to the answer, DuckDB's import and all, after the system was asked to forget the index; `warm`
the least of nine more; `changed` one more when a material has been written anew. `peak` is the high-water mark of
resident memory (VmHWM, on Linux alone).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..materials.catalogue import head_index
from ..materials.catalogue.catalogue import Catalogue
from ..materials.records.query import Query, read_heads
from ..materials.records.record import SUFFIX, material_path, write_marker
from ..materials.records.record_head import FORMAT, SCHEMA, head_bytes
from ..runtime.files import written_whole
from .importing import peak_bytes

# Materials of a folder.
_FAMILY = 1_000
# Most materials whose heads are read one by one: more take minutes and gigabytes.
_ONE_BY_ONE = 100_000
_HUES = ("red", "orange", "yellow", "green", "blue", "violet", "grey")
QUERIES = {
    "nearest": Query(near=(52.0, 31.0, 18.0), limit=12),
    "text": Query(ids=("*violet*7*",), limit=12),
    "words": Query(families=("paint-1*",), models=("lambert",), sort="chroma", reverse=True, limit=12),
}


def head(number: int, lab: tuple[float, float, float]) -> dict[str, Any]:
    """Make the head of a matt spectrum, as an import writes it."""
    family = f"paint-{number // _FAMILY}"
    p99 = round(0.001 * (number % 97), 3)
    return {
        "format": FORMAT,
        "schema": SCHEMA,
        "id": f"{family}/{_HUES[number % len(_HUES)]}-{number}",
        "family": family,
        "model": "lambert",
        "kind": "measured",
        "quantity": "reflectance",
        "licence": "generated for a benchmark",
        "terms": [[1, "hd"]],
        "precision": "half",
        "error": {
            **{"mean": p99 / 3, "p95": p99 / 2, "p99": p99, "maximum": 2 * p99},
            **{
                "light": "D65",
                "observer": "1931_2",
                "lights": dict.fromkeys(("D65", "A", "FL11", "LED-B3", "HP1"), p99),
            },
            "where": "light 87.6° from the normal, azimuth 360.0°; view 77.6° from the normal, azimuth 359.9°",
        },
        "colour": {
            **{"Lab": lab, "XYZ": (0.3, 0.3, 0.3)},
            **{"illuminant": "D65", "observer": "1931_2", "geometry": "45a:0"},
        },
        "sizes": {"packs": 696, "parameters": 1296, "original": 496},
        "source_hash": f"{number:064x}",
        "checksum": f"{number * 7919:064x}",
    }


def generated(folder: Path, materials: int) -> Path:
    """Return a catalogue of so many heads, a thousand a folder."""
    folder.mkdir(parents=True)
    write_marker(folder)
    draw = np.random.default_rng(11)
    labs = np.round(draw.uniform((5, -60, -60), (98, 60, 60), (materials, 3)), 4).tolist()
    for number, lab in enumerate(labs):
        said = head(number, lab)
        path = material_path(folder, said["id"])
        if number % _FAMILY == 0:
            path.parent.mkdir()
        with open(path, "wb", buffering=0) as file:  # noqa: PTH123  pathlib's takes half as long again
            file.write(head_bytes(said, path))
    return folder


def changed(folder: Path, number: int = 0) -> None:
    """Write one material anew, as an import does."""
    said = head(number, (50.0, float(time.time_ns() % 50), 0.0))
    path = material_path(folder, said["id"])
    with written_whole(path) as beside:
        beside.write_bytes(head_bytes(said, path))


def asked(folder: Path, name: str) -> dict[str, float]:
    """Ask one query of a catalogue in this process: the first time, and nine times more."""
    query, catalogue = QUERIES[name], Catalogue(folder)

    def ask() -> float:
        begin = time.perf_counter()
        if not catalogue.heads().select(query):
            raise RuntimeError(f"{name}: nothing found")
        return time.perf_counter() - begin

    cold, warm = ask(), min(ask() for _ in range(9))
    changed(folder)
    update = ask()
    return {"cold_s": cold, "warm_s": warm, "after_a_change_s": update, "peak_mb": peak_bytes(os.getpid()) / 1e6}


def in_a_process(folder: Path, name: str) -> dict[str, float]:
    """Ask in a process of its own, from a disk that has to be read."""
    _forgotten(folder / head_index.FOLDER)
    words = [sys.executable, "-m", __name__, "--ask", name, "--folder", str(folder)]
    return json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


def _forgotten(folder: Path) -> None:
    """Ask the system to keep no file of a folder in memory."""
    if hasattr(os, "posix_fadvise"):
        for path in folder.iterdir():
            with path.open("rb") as file:
                os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def run(materials: int, say: Callable[[str], None] = print) -> dict[str, Any]:
    """Make a catalogue, index it, and ask; rows of seconds and megabytes."""
    with tempfile.TemporaryDirectory() as private:
        begin = time.perf_counter()
        folder = generated(Path(private) / "catalogue", materials)
        made = time.perf_counter() - begin
        say(f"{materials} heads made in {made:.1f} s")
        # A younger file may change again at the same time, and is read again.
        time.sleep(head_index.TICK_NS / 1e9)
        begin = time.perf_counter()
        if head_index.index_of(folder, say) is None:
            raise RuntimeError(f"no index: {materials} materials, of which {head_index.WORTH} take one, and DuckDB")
        built = time.perf_counter() - begin
        size = sum(path.stat().st_size for path in (folder / head_index.FOLDER).iterdir())
        figures: dict[str, Any] = {
            "materials": materials,
            "built_s": built,
            "built_per_s": materials / built,
            "index_mb": size / 1e6,
        }
        if materials <= _ONE_BY_ONE:
            begin = time.perf_counter()
            heads = read_heads(folder, SUFFIX)
            for query in QUERIES.values():
                heads.select(query)
            figures["every_head_read_s"] = time.perf_counter() - begin
        figures["rows"] = [{"query": name, **in_a_process(folder, name)} for name in QUERIES]
    return figures


def report(figures: dict[str, Any]) -> str:
    """Put the figures in words."""
    lines = [
        f"{figures['materials']} materials: index built in {figures['built_s']:.1f} s "
        f"({figures['built_per_s']:.0f}/s), {figures['index_mb']:.1f} MB"
    ]
    if "every_head_read_s" in figures:
        lines.append(f"every head read, and the queries below: {figures['every_head_read_s']:.2f} s")
    lines.append(f"{'query':10}{'cold s':>10}{'warm s':>10}{'changed s':>11}{'peak MB':>10}")
    lines += [
        f"{row['query']:10}{row['cold_s']:10.3f}{row['warm_s']:10.3f}{row['after_a_change_s']:11.3f}{row['peak_mb']:10.0f}"
        for row in figures["rows"]
    ]
    return "\n".join(lines)


def main(words: list[str] | None = None) -> int:
    """Answer one process of `in_a_process`."""
    import argparse

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ask", choices=QUERIES, required=True)
    parser.add_argument("--folder", type=Path, required=True)
    args = parser.parse_args(words)
    print(json.dumps(asked(args.folder, args.ask)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
