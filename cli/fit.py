"""`metamer fit`: factor packs for one material of a catalogue, term by term, speed beside error."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from .shared import add_catalogue_option, catalogue_for, positive_count, positive_delta_e

if TYPE_CHECKING:
    from ..materials.fit import Trial


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `fit`."""
    command = subparsers.add_parser("fit", help="fit factor packs to a material and show speed against error")
    command.add_argument("material", metavar="MATERIAL", help='id in the catalogue, such as "colorchecker/red-gloss"')
    add_catalogue_option(command)
    command.add_argument(
        "--frame",
        choices=("auto", "io", "hd"),
        default="auto",
        help="auto: each lobe in the frame that suits it; io or hd: everything in one frame",
    )
    aim = command.add_mutually_exclusive_group()
    aim.add_argument("--rank", type=positive_count, metavar="N", help="this many terms for each lobe")
    aim.add_argument(
        "--budget", type=positive_delta_e, default=0.5, metavar="D", help="ΔE94 at the 99th percentile (default: 0.5)"
    )
    command.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Fit and print; 0, or 1 where the budget was not met."""
    from ..materials.fit import RANKS, fit
    from ..materials.half import half_storage
    from ..materials.protocol import sphere_protocol

    material = catalogue_for(args.catalogue, 1).load(args.material)
    brdf = material.brdf()
    print(f"{material.id}: {material.model}; ΔE94 on the sphere, D65, other lobes exact")
    print(f"{'lobe':>4}  frame  terms  {'seconds':>7}  {'mean':>6}  {'p95':>6}  {'p99':>6}  {'max':>6}")
    found = fit(
        brdf,
        budget=args.budget,
        ranks=RANKS if args.rank is None else (args.rank,),
        frame=None if args.frame == "auto" else args.frame,
        tried=_show,
    )
    stored = half_storage(found.packs, brdf, sphere_protocol(128, brdf.isotropic))
    frames = " + ".join(f"{pack.rank} in {pack.frame}" for pack in found.packs)
    error = found.error
    print(f"\nTogether {found.rank} terms ({frames}): ", end="")
    print(f"mean {error.mean:.2f}, p95 {error.p95:.2f}, p99 {error.p99:.2f}, max {error.maximum:.2f}")
    print(f"Lowest shading {error.most_negative:.1e} (a white diffuser facing the light is 1); nothing is clipped.")
    print(f"Storage: {stored.reason}.")
    if args.rank is None and error.p99 > args.budget:
        print(f"The budget of {args.budget:g} is not met: more terms stopped paying, or none are left to try.")
        return 1
    return 0


def _show(trial: Trial) -> None:
    error = trial.error
    print(
        f"{trial.lobe + 1:4d}  {trial.frame:5s}  {trial.rank:5d}  {trial.seconds:7.2f}  {error.mean:6.3f}  "
        f"{error.p95:6.3f}  {error.p99:6.3f}  {error.maximum:6.2f}{'' if trial.kept else '  no better'}",
        flush=True,
    )
