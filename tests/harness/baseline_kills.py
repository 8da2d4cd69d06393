"""Does SIGKILL do a baseline any harm?

    python tests/harness/baseline_kills.py [--kills 30] [--verbs baseline,run,accept] [--json OUT.json]

A scene has changed since its baseline was recorded. `metamer report baseline`, `run` and `accept` are killed, with all
of their processes, at a random moment. What is there then must be the old baseline or the new one, whole, and after
`run` the old one to the byte; and the same command must end as one that nobody disturbed, with the same bytes.
"""

from __future__ import annotations

import io
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from interrupts import Workplace
from kills import contents
from metamer.benchmarks.timing import command, write_json
from metamer.calibration.regression.baseline import MANIFEST, baseline_side
from metamer.cli.main import main as main_of_metamer
from metamer.runtime.files import half_written
from patience import patient

VERBS = ("baseline", "run", "accept")
# Folder beside a run's record whose reviews say when they were made and how long it took.
_TIMED = "reviews/"


class Place:
    """A suite, the baseline of before its scene changed, what rendered it since, and the folders that are worked on."""

    def __init__(self, folder: Path) -> None:
        workplace = Workplace(folder)
        self.catalogue, self.scene = workplace.catalogue, folder / "scene.toml"
        self.old, self.fresh, self.baseline, self.out = (folder / name for name in ("old", "fresh", "kept", "report"))
        self.done(self.words("baseline", self.old))
        text = self.scene.read_text(encoding="utf-8")
        self.scene.write_text(text.replace("[-0.45, 0.46, 0.766]", "[0.45, 0.46, 0.766]"), encoding="utf-8")
        self.restore()
        self.done(self.words("run"))
        shutil.copytree(self.out, self.fresh)

    def words(self, verb: str, into: Path | None = None) -> list[str]:
        """The command line."""
        start, into = [sys.executable, "-m", "metamer.cli.main", "report", verb], into or self.baseline
        if verb == "accept":
            return [*map(str, (*start, into, "--from", self.out, "--all"))]
        where = ["--into", into] if verb == "baseline" else ["--baseline", into, "--out", self.out]
        more = ["--catalogue", self.catalogue, "--renderer", "software", "--jobs", "1"]
        return [*map(str, (*start, self.scene, *where, *more))]

    def restore(self, with_run: bool = False) -> None:
        """The old baseline, and, where it is to be accepted, what was rendered since."""
        for path in (self.baseline, self.out, self.baseline.with_name(f".{self.baseline.name}.unfinished")):
            shutil.rmtree(path, ignore_errors=True)
        shutil.copytree(self.old, self.baseline)
        if with_run:
            shutil.copytree(self.fresh, self.out)

    def done(self, words: list[str]) -> None:
        """Run to the end, in this process: much sooner than in one that has to start."""
        said = io.StringIO()
        with redirect_stdout(said), redirect_stderr(said):
            code = main_of_metamer(words[3:])
        if code not in (0, 1, 2):
            raise RuntimeError(f"{' '.join(words[3:5])} ended with {code}: {said.getvalue()}")

    def state(self) -> dict[str, str]:
        """SHA-256 of all files of the baseline and of the run, but for those that say when."""
        found = {"baseline": contents(self.baseline), "run": contents(self.out) if self.out.exists() else {}}
        return {
            f"{folder}/{name}": digest
            for folder, files in found.items()
            for name, digest in files.items()
            if not name.startswith(_TIMED)
        }


def undisturbed(place: Place, verb: str) -> tuple[dict[str, str], float]:
    """Return what a verb leaves that nobody disturbs, and its seconds."""
    place.restore(with_run=verb == "accept")
    begin = time.perf_counter()
    done = subprocess.run(place.words(verb), capture_output=True, text=True, timeout=patient(600))
    if done.returncode not in (0, 1, 2) or "Traceback" in done.stderr:
        raise RuntimeError(f"{verb} ended with {done.returncode}: {done.stderr}")
    return place.state(), time.perf_counter() - begin


def killed(place: Place, verb: str, moment: float, expected: dict[str, str]) -> dict:
    """Kill a verb so many seconds after its start, look, and give the same command again; what was wrong."""
    place.restore(with_run=verb == "accept")
    old = contents(place.baseline)
    manifests = {old[MANIFEST], expected[f"baseline/{MANIFEST}"]}
    with tempfile.TemporaryFile() as nowhere:
        words = place.words(verb)
        process = subprocess.Popen(words, stdout=nowhere, stderr=nowhere, start_new_session=True)
        time.sleep(moment)
        hit = process.poll() is None
        if hit:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait(timeout=patient(60))
    now = contents(place.baseline)
    wrong = [] if now[MANIFEST] in manifests else ["another baseline.json"]
    if verb == "run" and now != old:
        wrong.append("a baseline that was only to be read is another")
    for row in baseline_side(place.baseline).rows:
        for layer in row.layers.values():
            # Refused where a file is not what its name says.
            layer.load()
    place.done(words)
    wrong += [path.name for path in half_written(place.baseline)]
    wrong += [] if place.state() == expected else ["other files than of an undisturbed command"]
    state = "new" if now[MANIFEST] != old[MANIFEST] else "old"
    return {"verb": verb, "moment": moment, "hit": hit, "left": state, "wrong": wrong}


def main(words: list[str] | None = None) -> int:
    """Kill, print and store; 1 where a kill did harm."""
    parser = command(__doc__)
    parser.add_argument("--kills", type=int, default=30, help="of each verb")
    parser.add_argument("--verbs", default=",".join(VERBS))
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args(words)
    rng, hits = random.Random(args.seed), []
    with tempfile.TemporaryDirectory() as private:
        place = Place(Path(private))
        for verb in args.verbs.split(","):
            expected, seconds = undisturbed(place, verb)
            for _ in range(args.kills):
                hits.append(killed(place, verb, rng.uniform(0.0, 1.1 * seconds), expected))
                if hits[-1]["wrong"]:
                    print(hits[-1], flush=True)
            ours = [one for one in hits if one["verb"] == verb]
            left = Counter(one["left"] if one["hit"] else "done before" for one in ours)
            bad = sum(bool(one["wrong"]) for one in ours)
            print(f"{verb}: {len(ours)} kills in {seconds:.1f} s, left {dict(left)}, {bad} did harm", flush=True)
    write_json(args.json, hits)
    return int(any(one["wrong"] for one in hits))


if __name__ == "__main__":
    sys.exit(main())
