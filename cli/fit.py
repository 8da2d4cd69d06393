"""`metamer fit`: factor packs for one material of a catalogue, trial by trial, speed beside error."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..materials.intake.progress import share_done
from ..runtime.shutdown import saying
from ..runtime.wording import counted
from .options import add_catalogue_option, add_json_option, catalogue_for, positive_count, positive_delta_e
from .output import figures_file, write_json
from .progress.fit import FitProgress

if TYPE_CHECKING:
    from ..materials.core.fit_error import FitError, LightError
    from ..materials.fitting.fit import Fit, Trial
    from ..materials.records.material import MaterialRecord

# Methods of materials.fitting.lobe_table, repeated so that `--help` need not import it; a test compares them.
METHODS = ("joint", "weighted", "incremental", "refitted")
# A lobe that needs more is none; the work grows with the square.
_MOST_TERMS = 256
_HEADER = (
    f"{'split':6s} {'step':6s} {'frame':7s}  terms  {'seconds':>7}  {'mean':>6}  {'p95':>6}  {'p99':>6}  {'max':>6}"
)


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `fit`."""
    command = subparsers.add_parser(
        "fit",
        help="fit factor packs to a material and show speed against error",
        description="Fit factor packs to a material of a catalogue and say what each number of terms costs and gives. "
        "Exit code 1: the budget is not met.",
        epilog="Each line is a trial. split: the lobes that the material names (lobes), or everything in one frame "
        "first (io: angles of light and view; hd: half and difference angles). step: a lobe's table alone, or "
        "all packs refined together (joint). terms: of that lobe or of all. mean, p95, p99, max: ΔE94 on the "
        "sphere, under the light that shows it most. What is held against the budget is p99, the mean over "
        "0.3, and over 4 each what is lit from behind and the highlight's own pixels.",
    )
    command.add_argument("material", metavar="MATERIAL", help='id in the catalogue, such as "colorchecker/red-gloss"')
    add_catalogue_option(command)
    command.add_argument(
        "--frame",
        choices=("auto", "io", "hd"),
        default="auto",
        help="auto: frames and split are tried and compared; io or hd: everything in one frame",
    )
    aim = command.add_mutually_exclusive_group()
    aim.add_argument("--rank", type=_terms, metavar="N", help="this many terms for each lobe")
    aim.add_argument(
        "--budget", type=positive_delta_e, default=0.5, metavar="D", help="ΔE94 at the 99th percentile (default: 0.5)"
    )
    command.add_argument(
        "--method",
        choices=METHODS,
        default="joint",
        help="joint: all packs refined together on what is seen; weighted: each lobe's table alone; incremental, "
        "refitted: packs of four terms, each fitted to what is left, without (as Schwenk 2010) and with a refit of all",
    )
    command.add_argument("--smooth", action="store_true", help="smooth the tables' factors: fewer ripples, less sharp")
    add_json_option(command, "what was found and all trials, for a program")
    command.set_defaults(run=run)


def _terms(text: str) -> int:
    number = positive_count(text)
    if number > _MOST_TERMS:
        raise argparse.ArgumentTypeError(f"at most {_MOST_TERMS} terms, not {text}")
    return number


def run(args: argparse.Namespace) -> int:
    """Fit and print; 0, or 1 where the budget was not met."""
    with ExitStack() as stack:
        # Before what takes a second to load: nobody waits for a first word.
        return _fitted(args, FitProgress(stack, args.material), stack)


def _fitted(args: argparse.Namespace, watch: FitProgress, watching: ExitStack) -> int:
    from ..materials.core.protocol import LIGHTS
    from ..materials.fitting.fit import RANKS, fit
    from ..runtime.files import check_writable

    for path in figures_file(args.json):
        check_writable(path)
    material = _loaded(args)
    brdf = material.brdf()
    watch.say(f"{material.id}: {material.model}; ΔE94 on the sphere, the worst of {', '.join(LIGHTS)}")
    watch.begins(material.model)
    trials: list[Trial] = []
    with saying(lambda: _so_far(trials)), _shown(args.budget, watch) as show:

        def tried(trial: Trial) -> None:
            trials.append(trial)
            show(trial)

        found = fit(
            brdf,
            budget=args.budget,
            ranks=RANKS if args.rank is None else (args.rank,),
            frame=None if args.frame == "auto" else args.frame,
            method=args.method,
            smooth=args.smooth,
            tried=tried,
            doing=lambda phase: watch.at(phase, share_done(trials, args.budget, phase)),
        )
        found = replace(found, fast=found.fast.with_slices_of(brdf, args.budget))
    watching.close()
    missed = args.rank is None and found.score > args.budget
    print(_summary(found, args, missed))
    if args.json is not None:
        write_json(args.json, _document(material.id, found, args))
    return 1 if missed else 0


def _loaded(args: argparse.Namespace) -> MaterialRecord:
    from ..runtime.errors import InputError, UnknownNameError

    try:
        return catalogue_for(args.catalogue, 1).load(args.material)
    except UnknownNameError:
        if not Path(args.material).is_file():
            raise
        hint = f"import it, which fits it, too: metamer catalogue import {args.material}"
        expected = "the id of a material in a catalogue"
        raise InputError("a file, not a material", file=args.material, expected=expected, hint=hint) from None


@contextmanager
def _shown(budget: float, watch: FitProgress) -> Iterator[Callable[[Trial], None]]:
    """Yield a callback that prints a line per trial, and updates the state of the fit by the best so far."""
    watch.say(_HEADER)
    trials: list[Trial] = []

    def show(trial: Trial) -> None:
        watch.say(_line(trial))
        trials.append(trial)
        best = _best(trials)
        words = f"best so far: {best.rank} in {best.frame}, p99 {best.error.p99:.2f}"
        watch.at(words, share_done(trials, budget))

    yield show


def _line(trial: Trial) -> str:
    error, step = trial.error, "joint" if trial.joint else f"lobe {trial.lobe + 1}"
    return (
        f"{trial.candidate:6s} {step:6s} {trial.frame:7s}  {trial.rank:5d}  {trial.seconds:7.2f}  {error.mean:6.3f}  "
        f"{error.p95:6.3f}  {error.p99:6.3f}  {error.maximum:6.2f}{'' if trial.kept else '  no better'}"
    )


def _figures(error: FitError) -> str:
    return f"mean {error.mean:.2f}, p95 {error.p95:.2f}, p99 {error.p99:.2f}, max {error.maximum:.2f}"


def _under(light: LightError) -> str:
    own = "" if light.highlight is None else f", highlight p99 {light.highlight:.2f}"
    figures = f"mean {light.mean:.2f}, p95 {light.p95:.2f}, p99 {light.p99:.2f}, max {light.maximum:.2f}"
    return f"{light.light:7s} {figures}{own}"


def _so_far(trials: list[Trial]) -> str:
    if not trials:
        return "Nothing was tried yet."
    best = _best(trials)
    return f"Best so far: {counted(best.rank, 'term')} in {best.frame}, {_figures(best.error)}."


def _best(trials: list[Trial]) -> Trial:
    """Find the best joint trial; until there is one, the best of the current lobe."""
    together = [trial for trial in trials if trial.joint]
    return min(together or [it for it in trials if it.lobe == trials[-1].lobe], key=lambda trial: trial.score)


def _summary(found: Fit, args: argparse.Namespace, missed: bool) -> str:
    from ..materials.fitting.bounds import LARGEST, LOWEST, Extremes

    extremes = Extremes(found.error.most_negative, found.error.largest or 0.0)
    beyond = "" if extremes.within else f" Joint fits keep within {LOWEST:g} and {LARGEST:g}; this is beyond."
    frames = " + ".join(f"{pack.rank} in {pack.frame}" for pack in found.fast.packs)
    split = {"lobes": "its own lobes", "io": "everything in io first", "hd": "everything in hd first"}
    lines = [
        f"\nTogether {counted(found.rank, 'term')} ({frames}): {_figures(found.error)}",
        *(f"  {_under(light)}" for light in found.error.lights),
        f"Lowest shading {extremes.lowest:.1e} (a white diffuser facing the light is 1), largest "
        f"{extremes.ratio:.2f} times the original's, anywhere above the horizon; nothing is clipped.{beyond}",
        f"Split: {split[found.candidate]}; {len(found.trials)} trials.",
        f"Storage: {'half' if found.storage.half else 'single'}, {found.stored_bytes / 1024:.0f} KiB; "
        f"{found.storage.reason}.",
    ]
    slices = found.fast.slices
    if slices is not None and slices.error is not None:
        lobes = "matt" if slices.count == 0 else f"{counted(slices.count, 'lobe')} and a cosine"
        lines.append(
            f"Light from all around: {lobes}, {counted(slices.palette.rank, 'term')}: {_figures(slices.error)}."
        )
    if missed:
        lines.append(f"The budget of {args.budget:g} is not met, as exit code 1 says: {found.stopped}.")
    elif args.rank is None:
        lines.append(f"Stopped: {found.stopped}.")
    return "\n".join(lines)


def _document(material: str, found: Fit, args: argparse.Namespace) -> dict:
    from dataclasses import asdict

    return {
        "material": material,
        "method": args.method,
        "smooth": args.smooth,
        "budget": args.budget if args.rank is None else None,
        "met": found.score <= args.budget if args.rank is None else None,
        "split": found.candidate,
        "stopped": found.stopped,
        "packs": [
            {
                "frame": pack.frame,
                "rank": pack.rank,
                "precision": pack.precision,
                "axes": {axis.name: axis.size for axis in pack.axes},
            }
            for pack in found.fast.packs
        ],
        "rank": found.rank,
        "stored_bytes": found.stored_bytes,
        "storage": {"half": found.storage.half, "cost": found.storage.cost, "reason": found.storage.reason},
        "error": asdict(found.error),
        "environment": found.fast.environment_error and asdict(found.fast.environment_error),
        "score": found.score,
        "trials": [asdict(trial) for trial in found.trials],
    }
