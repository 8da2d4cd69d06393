"""Damaged files, thousands for every reader: each is read, or refused by an `InputError`; nothing else may happen.

    python tests/harness/fuzz.py [READER ...] [--count 10000] [--seed 1] [--data DIR] [--keep DIR] [--json F]

Readers are those of both lists of formats. The files that are damaged are small ones written here (`fuzz_seeds`) and,
with `--data`, those of a folder that the reader recognises. A reader works in a process of its own, with a limit on
memory and on CPU time for each file; a crash, a hang, too much memory or any other exception is a failure. `--keep`
stores the files that failed. Each is made again from its number: `--seed` and the reader's name fix all of them. MATLAB
files are read in forks of one process, some seconds a thousand; a scattered BRDF that is still one takes a second.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import resource
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path

from fuzz_seeds import seeds
from metamer.benchmarks.timing import command, write_json
from metamer.materials.formats import registry as material_formats
from metamer.materials.records.source import Rejected
from metamer.runtime.errors import InputError
from metamer.spectral.formats import registry as spectral_formats
from metamer.spectral.formats.import_options import ImportOptions

# Seconds of the processor, not of the clock: how busy the machine is must not decide.
SECONDS_A_FILE = 10.0
# On the clock, for what waits and does nothing.
SECONDS_WITHOUT_AN_ANSWER = 600.0
# Answer for images that do not state these.
ANSWER = ImportOptions(encoding="linear", white=(1.0,), includes_cosine=True)
# Address space beside what the process has when it begins: a reader that allocates by a number in a damaged file fails.
BYTES = 3 << 30
# Whole copies of large files are few: to write them takes longer than to read them.
_LARGE = 1 << 20
_WORDS = (
    b"nan",
    b"inf",
    b"-inf",
    b"1e999",
    b"-1",
    b"0",
    b"99999999999999999999",
    b"",
    b"\0",
    b"\xff\xfe",
    b'"',
    b"<",
    b">",
    b"&",
    b"&lol;",
    b"{",
    b"]",
    b",",
    b";",
    b"\t",
    b"\n",
    b"\r",
    b"9" * 400,
    b" " * 300,
    "é漢\u202e".encode(),
)
_NUMBERS = (0, 1, -1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FFFFFFFFFFFFFFF)


def damaged(content: bytes, others: list[bytes], rng: random.Random) -> bytes:
    """The content with one to twenty places changed."""
    held = bytearray(content)
    if len(held) > _LARGE and rng.random() < 0.995:
        held = held[: rng.choice((0, 3, 12, 40, 4096, 70000))]
    for _ in range(rng.choice((1, 1, 1, 2, 5, 20))):
        held = held or bytearray(b"0")
        at = rng.randrange(min(len(held), rng.choice((16, 200, 1 << 40))))
        kind = rng.randrange(11)
        if kind == 0:
            held[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            held[at] = rng.randrange(256)
        elif kind == 2:
            del held[at : at + rng.choice((1, 4, 10, 200))]
        elif kind == 3:
            held = held[:at]
        elif kind == 4:
            held[at:at] = rng.randbytes(rng.choice((1, 8, 64)))
        elif kind == 5:
            start = rng.randrange(len(held))
            held[at:at] = held[start : start + rng.choice((10, 200, 5000))]
        elif kind == 6:
            held[at : at + rng.choice((0, 1, 4))] = rng.choice(_WORDS)
        elif kind == 7:
            number = rng.choice(_NUMBERS) & 0xFFFFFFFFFFFFFFFF
            size, form = rng.choice(((1, "B"), (2, "H"), (4, "I"), (8, "Q")))
            place = struct.pack(rng.choice("<>") + form, number & ((1 << 8 * size) - 1))
            held[at : at + size] = place
        elif kind == 8:
            other = rng.choice(others)[: 1 << 16]
            start = rng.randrange(len(other) + 1)
            held[at : at + rng.choice((0, 50))] = other[start : start + rng.choice((20, 400))]
        elif kind == 9 and len(held) < _LARGE:
            old, new = (
                rng.choice((b".", b",", b"\t", b" ", b"\n", b"0", b'"')),
                rng.choice((b",", b".", b";", b"", b"\r\n", b"9")),
            )
            held = held.replace(old, new, rng.choice((1, -1)))
        elif len(held) < _LARGE:
            lines = bytes(held).split(b"\n")
            line = lines.pop(rng.randrange(len(lines)))
            for _ in range(rng.randrange(3)):
                lines.insert(rng.randrange(len(lines) + 1), line)
            held = bytearray(b"\n".join(lines))
    return bytes(held)


def made(reader: str, seed: int, number: int, files: dict[str, bytes]) -> tuple[str, bytes]:
    """Name and content of the file with that number."""
    rng = random.Random(f"{reader}/{seed}/{number}")
    name = rng.choice(sorted(files))
    # The first of all is not damaged: seeds have to be read.
    return (name, files[name]) if number == 0 else (name, damaged(files[name], list(files.values()), rng))


def read(reader: str, path: Path) -> str:
    """Say what becomes of one file: "read", "refused", or "not recognised" where a reader would not be asked."""
    with path.open("rb") as file:
        head = file.read(4096)
    if reader in spectral_formats.FORMATS:
        module = import_module(f"metamer.spectral.formats.{reader}")
        known = module.recognises(path, head)
        try:
            module.read(path)
        except InputError as reason:
            _words(reason)
            return "refused" if known else "not recognised"
        return "read"
    module = import_module(f"metamer.materials.formats.{reader}")
    known = module.recognises(path, head)
    try:
        for companion in getattr(module, "companions", lambda path: ())(path):
            Path(companion).exists()
        answer = [ANSWER] if getattr(module, "ASKS_MORE", False) else []
        found = list(module.read_sources(path, "mallett-yuksel", *answer))
    except InputError as reason:
        _words(reason)
        return "refused" if known else "not recognised"
    for material in found:
        if isinstance(material, Rejected):
            _words(material.reason)
        else:
            assert material.content_hash
    return "read" if any(not isinstance(material, Rejected) for material in found) else "refused"


def _words(reason: InputError) -> None:
    """Check that what is said is text that can be shown, and no picture of the whole file."""
    text = str(reason)
    text.encode("utf-8")
    assert reason.problem and len(text) < 20000, len(text)


class _TooLong(BaseException):
    """Not an Exception: a reader that catches everything must not catch this."""


def too_long(*_: object) -> None:
    """Stop the reading of a file: a handler of SIGPROF."""
    raise _TooLong


def _serve(connection: Connection, reader: str, seed: int, numbers: list[int], files: dict[str, bytes]) -> None:
    signal.signal(signal.SIGPROF, too_long)
    # Libraries of C speak for themselves, a line for each damaged block.
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    # Readers' own imports come before the limit is set.
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        _one(reader, Path(folder), *made(reader, seed, 0, files))
        pages = int(Path("/proc/self/statm").read_text().split()[0]) if Path("/proc/self/statm").exists() else 0
        limit = pages * resource.getpagesize() + BYTES
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        for number in numbers:
            connection.send((number, *_one(reader, Path(folder), *made(reader, seed, number, files))))


def _one(reader: str, folder: Path, name: str, content: bytes) -> tuple[str, str, float]:
    path = folder / name
    path.write_bytes(content)
    begin = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, SECONDS_A_FILE)
    try:
        outcome, place = read(reader, path), ""
    except _TooLong:
        outcome, place = "too long", traceback.format_exc(limit=-4)
    except BaseException as reason:
        outcome, place = type(reason).__name__, traceback.format_exc(limit=-4)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        path.unlink(missing_ok=True)
    return outcome, place, time.process_time() - begin


def fuzzed(reader: str, seed: int, count: int, files: dict[str, bytes]) -> Iterator[tuple[int, str, str, float]]:
    """(number, outcome, place, CPU seconds) of every file; a process that dies or hangs is an outcome, and replaced."""
    context = multiprocessing.get_context("spawn")
    todo = list(range(count))
    while todo:
        ours, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs, reader, seed, todo, files), daemon=True)
        process.start()
        theirs.close()
        try:
            while todo:
                if not _answers(ours, process.pid or 0):
                    yield todo.pop(0), "hang", "no answer, not even to a signal", SECONDS_A_FILE
                    break
                number, *rest = ours.recv()
                todo.remove(number)
                yield number, *rest
        except (EOFError, ConnectionResetError):
            process.join(10)
            yield todo.pop(0), "crash", f"exit code {process.exitcode}", 0.0
        finally:
            process.kill()
            process.join()
            ours.close()


def _answers(connection: Connection, process: int) -> bool:
    """Wait until a process has something to say: False where it works for far longer than a signal allows, or waits."""
    begin, limit = time.monotonic(), _cpu_seconds(process) + SECONDS_A_FILE + 30.0
    while not connection.poll(1.0):
        if _cpu_seconds(process) > limit or time.monotonic() - begin > SECONDS_WITHOUT_AN_ANSWER:
            return False
    return True


def _cpu_seconds(process: int) -> float:
    """CPU seconds of a process so far; 0 where the system does not tell, or it has ended."""
    try:
        words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


GOOD = ("read", "refused", "not recognised")


def report(reader: str, seed: int, count: int, files: dict[str, bytes], keep: Path | None = None) -> dict:
    """Outcomes of one reader, and its failures by what happened and where, with the number of a file for each."""
    outcomes: Counter[str] = Counter()
    failures: dict[str, dict] = {}
    slowest = 0.0
    # Some files of a folder are rightly refused; none of these is.
    own = set(seeds()[reader])
    begin = time.perf_counter()
    for number, outcome, place, seconds in fuzzed(reader, seed, count, files):
        outcomes[outcome] += 1
        slowest = max(slowest, seconds)
        if number == 0 and outcome != "read" and reader != "unreadable" and made(reader, seed, 0, files)[0] in own:
            raise RuntimeError(f"{reader}: the undamaged file is {outcome}: {place}")
        if outcome not in GOOD:
            last = [line.strip() for line in place.splitlines() if line.strip()]
            key = f"{outcome}: " + " | ".join([line for line in last if line.startswith("File")][-1:] + last[-1:])
            row = failures.setdefault(key, {"count": 0, "number": number, "trace": place})
            row["count"] += 1
            if keep is not None and row["count"] == 1:
                name, content = made(reader, seed, number, files)
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{reader}-{number}-{name}").write_bytes(content)
    return {
        "reader": reader,
        "files": count,
        "outcomes": dict(outcomes),
        "slowest_seconds": slowest,
        "seconds": time.perf_counter() - begin,
        "failures": failures,
    }


def readers() -> tuple[str, ...]:
    """Every reader of both lists; `spectra` is all of the first."""
    return (*spectral_formats.FORMATS, *(name for name in material_formats.FORMATS if name != "spectra"))


def files_of(reader: str, data: Path | None) -> dict[str, bytes]:
    """The small files of a reader, and those of a folder that it recognises."""
    found = dict(seeds()[reader])
    package = "spectral" if reader in spectral_formats.FORMATS else "materials"
    module = import_module(f"metamer.{package}.formats.{reader}")
    for path in sorted(data.rglob("*")) if data else ():
        if path.is_file() and path.stat().st_size < 64 << 20:
            content = path.read_bytes()
            if path.suffix.lower() in (*module.SUFFIXES, *(Path(name).suffix for name in found)) and module.recognises(
                path, content[:4096]
            ):
                found[path.name] = content
    return found


def main(words: list[str] | None = None) -> int:
    """Damage, read, tell; 1 where a reader failed."""
    parser = command(__doc__)
    parser.add_argument("readers", nargs="*", choices=[*readers(), []], metavar="READER")
    parser.add_argument("--count", type=int, default=10000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--keep", type=Path)
    args = parser.parse_args(words)
    rows = []
    for reader in args.readers or readers():
        row = report(reader, args.seed, args.count, files_of(reader, args.data), args.keep)
        rows.append(row)
        said = ", ".join(f"{count} {outcome}" for outcome, count in sorted(row["outcomes"].items()))
        times = f"{row['seconds']:.0f} s, slowest {row['slowest_seconds']:.2f} CPU s"
        print(f"{reader:16} {row['files']} files in {times}: {said}", flush=True)
        for key, failure in row["failures"].items():
            print(f"    {failure['count']} x {key} (file {failure['number']})", flush=True)
    write_json(args.json, rows)
    return int(any(row["failures"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
