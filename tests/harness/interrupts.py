"""Do `review`, `fit`, `import` and `transfer build` end as they should, at whatever moment a signal comes?

    python tests/harness/interrupts.py [--count 200] [--kills 20] [--commands review,fit,import,build] [--json OUT.json]

Each run is hit once, at a random moment between its start and the end of an undisturbed one: by SIGINT to all of its
processes, as a terminal sends it, by SIGTERM to the command alone, as `kill` does, or by SIGKILL. After SIGINT and
SIGTERM it must end within 3 s with 130 or 143, say one line, leave nothing half-written, no process and nothing in the
temporary folder. After SIGKILL the same command must end as if nothing had happened, and clear away what was left.

A signal may come before the first line of Metamer runs: SIGTERM then ends Python silently, by the signal itself (143 to
a shell), and SIGINT makes Python say a traceback that no program can prevent. Those are counted apart (`early`), and so
are signals that come when all is done (`late`). Linux only: looks into /proc.
"""

from __future__ import annotations

import json
import math
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from kills import contents
from metamer.benchmarks.importing import generated, import_command
from metamer.benchmarks.timing import command, write_json
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime.files import half_written
from metamer.runtime.kept_arrays import read_arrays
from patience import patient

LIMIT_S = 3.0
# A command that goes on for longer after a signal, and ends as if there had been none, has not heard it.
LATE_S = 1.0
SIGNALS = ("SIGINT", "SIGTERM")
COMMANDS = ("review", "fit", "import", "build")
# Rays of each vertex in `build`: some seconds, and some hundred blocks.
RAYS = 4096
UNHEARD = ("early", "late")
# Words that no command may say on its way out, and the line that it does say.
_WRONG = re.compile(r"Traceback|Exception ignored|Error|resource_tracker|Warning|^  File ")
_CLOSING = re.compile(r"metamer: (interrupted|terminated); nothing half-written is left behind\..*")
_SHARED_MEMORY = re.compile(r"(sem\.)?(mp|psm)[-_].*")

SCENE = """
[scene]
name = "Ball"

[[part]]
name = "ball"
shape = "sphere"
subdivisions = 2
material = "matt/c000-matt"

[[light]]
direction_to_light = [-0.45, 0.46, 0.766]
spectrum = "D65"

[[camera]]
projection = "orthographic"
position = [0, 0, 4]
target = [0, 0, 0]
height = 2.2
width = 24
height_px = 24
samples = 1

[review]
on = "ball"
illuminants = ["D65", "A"]
"""


@dataclass(frozen=True)
class Hit:
    """One run that was hit: `verdict` is "right", "early", "late", or what was wrong."""

    command: str
    signal: str
    moment: float
    seconds: float
    code: int
    verdict: str


class Workplace:
    """Sources, a catalogue and a scene; and the words of each command, whose results go to `out`."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.out, self.temporary = folder, folder / "out", folder / "tmp"
        self.temporary.mkdir(parents=True)
        source = generated(folder / "source", 4, ("matt",))
        with zipfile.ZipFile(folder / "source.zip", "w") as packed:
            for path in sorted(source.iterdir()):
                packed.write(path, path.name)
        self.catalogue = folder / "catalogue"
        subprocess.run(import_command(source, self.catalogue, 1), check=True, capture_output=True)
        (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
        self.seconds: dict[str, float] = {}

    def words(self, name: str) -> list[str]:
        """The command line of `review`, `fit`, `import` or `transfer build`."""
        if name == "import":
            return import_command(self.folder / "source.zip", self.out, 2, "--json", str(self.folder / "said.json"))
        if name == "build":
            words = ["transfer", "build", str(self.folder / "scene.toml"), "--into", str(self.out), "--rays", str(RAYS)]
            words += ["--processes", "2", "--catalogue", str(self.catalogue)]
            return [sys.executable, "-m", "metamer.cli.main", *words]
        start = [sys.executable, "-m", "metamer.cli.main", name]
        if name == "fit":
            more = ["matt/c001-matt", "--budget", "0.001", "--json", str(self.out / "fit.json")]
            return [*start, *more, "--catalogue", str(self.catalogue)]
        more = [str(self.folder / "scene.toml"), "--out", str(self.out), "--renderer", "software", "--jobs", "2"]
        return [*start, *more, "--catalogue", str(self.catalogue)]

    def cleared(self, name: str) -> None:
        """An empty place for results."""
        shutil.rmtree(self.out, ignore_errors=True)
        (self.folder / "said.json").unlink(missing_ok=True)
        if name == "fit":
            self.out.mkdir()

    def started(self, name: str) -> subprocess.Popen:
        """The command at work, in a session of its own; what it says goes into files, which never stop it."""
        with (self.folder / "stdout").open("wb") as out, (self.folder / "stderr").open("wb") as err:
            env = {**os.environ, "TMPDIR": str(self.temporary)}
            return subprocess.Popen(self.words(name), stdout=out, stderr=err, env=env, start_new_session=True)

    def said(self) -> list[str]:
        """Lines on standard error."""
        return (self.folder / "stderr").read_text(encoding="utf-8").splitlines()

    def whole(self, name: str) -> float:
        """Seconds of an undisturbed run into an empty place; raises where that goes wrong."""
        self.cleared(name)
        begin = time.perf_counter()
        code = self.started(name).wait(timeout=patient(600))
        if code not in (0, 1, 2) or self.left():
            raise RuntimeError(f"{name} ended with {code}: {self.said()}; left {self.left()}")
        return time.perf_counter() - begin

    def left(self) -> list[str]:
        """Return what stands in the temporary folder."""
        return sorted(path.name for path in self.temporary.iterdir())

    def half_results(self, name: str) -> list[str]:
        """Files that nobody should find after a signal."""
        wrong = [str(path.relative_to(self.out)) for path in half_written(self.out)]
        if name == "review" and self.out.exists():
            names = {path.name for path in self.out.iterdir()}
            if "index.html" in names:
                wrong += {"index.html", "review.json", "pictures", "rows"} - names
            else:
                wrong += names - {"unfinished"}
                wrong += [] if names else ["an empty folder"]
            kept = self.out / "unfinished"
            if kept.exists():
                wrong += [path.name for path in kept.iterdir() if not (path / "rows.npz").is_file()]
                wrong += [] if any(kept.iterdir()) else ["nothing unfinished"]
        if name == "import" and (self.out / "catalogue.toml").exists():
            wrong += [f"{key}: {reason}" for key, reason in Catalogue.open(self.out).verify().items() if reason]
        if name == "build" and self.out.exists():
            for path in self.out.iterdir():
                read_arrays(path)
        for path in (self.folder / "said.json", self.out / "fit.json"):
            if path.exists():
                json.loads(path.read_text(encoding="utf-8"))
        return wrong


def hit(place: Workplace, name: str, kind: str, moment: float) -> Hit:
    """Run a command into an empty place and send it a signal."""
    place.cleared(name)
    number, before = getattr(signal, kind), _shared_memory()
    process = place.started(name)
    begin = time.perf_counter()
    time.sleep(moment)
    ready, done = _listens(process.pid), process.poll() is not None
    sent = time.perf_counter()
    try:
        (os.killpg if kind == "SIGINT" else os.kill)(process.pid, number)
    except ProcessLookupError:
        done = True
    try:
        code = process.wait(timeout=patient(30))
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        code = process.wait()
    seconds = time.perf_counter() - sent
    while (alive := _alive(process.pid)) and time.perf_counter() - sent < LIMIT_S:
        time.sleep(0.01)
    verdict = _verdict(place, name, number, code, ready, done)
    if verdict == "late" and not done and seconds > LATE_S:
        verdict = f"unheard: went on for {seconds:.1f} s"
    if verdict in ("right", "late", "early"):
        wrong = [f"process {pid}" for pid in alive] + place.left() + sorted(_shared_memory() - before)
        wrong += place.half_results(name)
        if seconds > LIMIT_S:
            wrong.append(f"{seconds:.1f} s")
        verdict = f"left: {', '.join(wrong)}" if wrong else verdict
    if alive:
        os.killpg(process.pid, signal.SIGKILL)
    for path in place.temporary.iterdir():
        shutil.rmtree(path, ignore_errors=True)
    return Hit(name, kind, sent - begin, seconds, code, verdict)


def _verdict(place: Workplace, name: str, number: int, code: int, ready: bool, done: bool) -> str:
    closing = [line for line in place.said() if _CLOSING.fullmatch(line)]
    # A line at the very end, and nothing amiss among those that tell how far the command is.
    said = [line for line in place.said() if _CLOSING.fullmatch(line) or _WRONG.search(line)]
    if closing and place.said()[-1] != closing[-1]:
        said.append(place.said()[-1])
    if code == 128 + number and len(said) == len(closing) == 1:
        return "right"
    if not ready and code in (1, -number) and not closing:
        return "early"
    if (done or code in (0, 1, 2)) and not said:
        return "late"
    return f"code {code}, said {said}"


def killed(place: Workplace, name: str, moment: float, expected: dict[str, str]) -> Hit:
    """SIGKILL to the command alone; then the same command must end with the same files, and leave nothing."""
    place.cleared(name)
    process = place.started(name)
    begin = time.perf_counter()
    time.sleep(moment)
    process.kill()
    code, sent = process.wait(), time.perf_counter()
    while (alive := _alive(process.pid)) and time.perf_counter() - sent < LIMIT_S:
        time.sleep(0.01)
    seconds = time.perf_counter() - sent
    again = place.started(name).wait(timeout=patient(600))
    wrong = [f"process {pid}" for pid in alive] + place.left()
    wrong += [] if again in (0, 1, 2) else [f"code {again}: {place.said()}"]
    wrong += [] if results(place, name) == expected else ["other files"]
    verdict = f"left: {', '.join(wrong)}" if wrong else "right" if code == -signal.SIGKILL else "late"
    return Hit(name, "SIGKILL", sent - begin, seconds, code, verdict)


def results(place: Workplace, name: str) -> dict[str, str]:
    """SHA-256 of every file of a result, but for those that say when and how long."""
    found = contents(place.out)
    timed = ("index.html", "review.json", "fit.json")
    return {path: "" if path in timed or path.startswith("rows/") else digest for path, digest in found.items()}


def _listens(pid: int) -> bool:
    """Tell whether the process has a handler for SIGTERM, which Metamer sets in its first line and Python does not."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return True
    caught = re.search(r"SigCgt:\s*([0-9a-f]+)", status)
    return caught is None or bool(int(caught[1], 16) >> (signal.SIGTERM - 1) & 1)


def _alive(session: int) -> list[int]:
    """Processes of a session that still run."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[3]) == session and fields[0] != "Z":
                found.append(int(entry.name))
    return found


def _shared_memory() -> set[str]:
    try:
        return {path.name for path in Path("/dev/shm").iterdir() if _SHARED_MEMORY.fullmatch(path.name)}
    except OSError:
        return set()


def measured(
    folder: Path,
    commands: tuple[str, ...],
    count: int,
    kills: int,
    seed: int,
    tell: Callable[[str], None],
    first: float,
) -> list[Hit]:
    """Runs of each command until `count` heard SIGINT, as many SIGTERM and `kills` SIGKILL, in the `first` seconds."""
    place, rng, found = Workplace(folder), random.Random(seed), []
    for name in commands:
        place.whole(name)
        # A machine that others use, too, takes now longer, now shorter.
        seconds = min(first, *(place.whole(name) for _ in range(2)))
        expected = results(place, name)
        for kind, times in (*((kind, count) for kind in SIGNALS), ("SIGKILL", kills)):
            # A signal that comes too early or too late tells nothing: another is sent in its place, as often at most.
            heard = tries = 0
            while heard < times and tries < 2 * times:
                moment = rng.uniform(0.0, 1.02 * seconds)
                one = killed(place, name, moment, expected) if kind == "SIGKILL" else hit(place, name, kind, moment)
                found.append(one)
                tries, heard = tries + 1, heard + (one.verdict not in UNHEARD)
                if one.verdict not in ("right", *UNHEARD):
                    tell(f"{name} {kind} at {one.moment:.3f} of {seconds:.1f} s: {one.verdict}")
            tell(_line(name, kind, found))
    return found


def _say(line: str) -> None:
    print(line, flush=True)


def _line(name: str, kind: str, hits: list[Hit]) -> str:
    ours = [one for one in hits if (one.command, one.signal) == (name, kind)]
    counted = Counter(one.verdict if one.verdict in ("right", *UNHEARD) else "wrong" for one in ours)
    slowest = max((one.seconds for one in ours), default=0.0)
    figures = "  ".join(f"{counted[word]:5d} {word}" for word in ("right", "early", "late", "wrong"))
    return f"{name:7s} {kind:8s} {len(ours):5d} hits: {figures}   slowest end {slowest:.2f} s"


def not_deaf() -> None:
    """Hear SIGINT: a shell's background job is deaf to it, and hands that down to every command measured here."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def main(words: list[str] | None = None) -> int:
    """Measure, print and store; 1 where any run ended otherwise than it should."""
    parser = command(__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--kills", type=int, default=5)
    parser.add_argument("--commands", default=",".join(COMMANDS))
    parser.add_argument(
        "--first", type=float, default=math.inf, metavar="S", help="moments in the first S seconds only"
    )
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args(words)
    not_deaf()
    with tempfile.TemporaryDirectory() as private:
        commands = tuple(args.commands.split(","))
        hits = measured(Path(private), commands, args.count, args.kills, args.seed, _say, args.first)
    write_json(args.json, [asdict(one) for one in hits])
    return int(any(one.verdict not in ("right", *UNHEARD) for one in hits))


if __name__ == "__main__":
    sys.exit(main())
