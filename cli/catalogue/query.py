"""Options that select and order materials, for `list` and `preview`."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ...materials.records.query import SORT_KEYS, Query
from ..options import Added, comma_separated, open_catalogue, positive_delta_e
from ..output import say

if TYPE_CHECKING:
    from ...materials.catalogue.catalogue import Catalogue
    from ...materials.catalogue.head_index import HeadIndex
    from ...materials.records.query import Heads, Summary
    from ...runtime.errors import InputError

_FORMULAS = {"94": "CIE 1994", "2000": "CIE 2000"}


def add_query_options(verb: argparse.ArgumentParser) -> None:
    """Add filters and order."""
    filters = verb.add_argument_group("which")
    for name, example in (
        ("match", 'ids, such as "paint/*"'),
        ("family", "families"),
        ("model", "models, such as lambert"),
        ("kind", "measured, analytic or uplifted"),
        ("quantity", 'such as reflectance, emission, transmittance or "radiance factor"'),
    ):
        filters.add_argument(
            f"--{name}", type=comma_separated, action=Added, default=(), metavar="WORD,WORD", help=example
        )
    filters.add_argument("--max-error", type=positive_delta_e, metavar="D", help="ΔE94 p99 at most")
    filters.add_argument(
        "--near", type=_lab, metavar="L,A,B", help="sort by ΔE from this CIELAB (45:0, D65, 2 degrees)"
    )
    filters.add_argument("--within", type=positive_delta_e, metavar="D", help="maximum ΔE from --near")
    filters.add_argument(
        "--formula", choices=_FORMULAS, default="94", help="ΔE of --near, which is its reference; default: 94"
    )
    order = verb.add_argument_group("in which order")
    order.add_argument("--sort", choices=SORT_KEYS, help="default: id, or near where --near is given")
    order.add_argument("--reverse", action="store_true", help="largest first")
    order.add_argument("--limit", type=_count, metavar="N", help="the first N")


def query_from(args: argparse.Namespace) -> Query:
    """Return the query of the options; raises `UsageError` for contradictory ones."""
    from ...runtime.errors import UsageError

    if args.near is None and (args.within is not None or args.sort == "near"):
        raise UsageError("--within and --sort near need a colour: --near L,A,B")
    return Query(
        ids=args.match,
        families=args.family,
        models=args.model,
        kinds=args.kind,
        quantities=args.quantity,
        max_error=args.max_error,
        near=args.near,
        within=args.within,
        formula=_FORMULAS[args.formula],
        sort=args.sort,
        reverse=args.reverse,
        limit=args.limit,
    )


@dataclass(frozen=True)
class QueryResult:
    """Matching materials of a catalogue, sorted, and one error for each unusable file.

    nearest : to the colour of `--near` among the matches of the other filters, if nothing is within reach of it.
    """

    catalogue: Catalogue
    everything: Heads | HeadIndex
    fitting: tuple[Summary, ...]
    unusable: list[InputError]
    nearest: Summary | None = None

    @property
    def nearest_words(self) -> str:
        """Name the nearest to a colour with nothing within reach; "" otherwise."""
        one = self.nearest
        return "" if one is None else f"nearest is {one.id} at ΔE {one.distance:.1f}"


def found_by(args: argparse.Namespace) -> QueryResult:
    """Query the catalogue of the options."""
    catalogue, query = open_catalogue(args.catalogue), query_from(args)
    everything = catalogue.heads(say)
    fitting, nearest = everything.select(query), None
    if not fitting and query.within is not None:
        beyond = everything.select(replace(query, within=None, sort="near", reverse=False, limit=1))
        nearest = next((one for one in beyond if one.distance is not None), None)
    return QueryResult(catalogue, everything, fitting, list(everything.unusable), nearest)


def _lab(text: str) -> tuple[float, float, float]:
    try:
        first, second, third = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"three numbers such as 50,20,10, not {text}") from None
    if not all(abs(part) < 1000 for part in (first, second, third)):
        raise argparse.ArgumentTypeError(f"a colour, not {text}")
    return first, second, third


def _count(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"a whole number, not {text}")
    return int(text)
