"""A surface that the benchmark of factorisation fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...materials.core.brdf import Brdf


@dataclass(frozen=True, eq=False)
class Case:
    """One surface.

    name : for the command line and JSON. title : for people. budget : ΔE94 that the fit is asked for, at p99.
    packs_2010 : packs of four terms that the paper used, or None. make : the BRDF; reading a file may take a while.
    """

    name: str
    title: str
    budget: float
    packs_2010: int | None
    make: Callable[[], Brdf]
