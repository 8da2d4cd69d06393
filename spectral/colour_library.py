"""The one door to colour-science: a second of import that the start-up path must not pay."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np


@cache
def colour_science() -> Any:
    """The `colour` module. Its notices about optional packages say nothing about Metamer and are kept quiet, and
    the way it makes numpy print numbers does not reach the rest of the process.
    """
    with warnings.catch_warnings(), np.printoptions():
        warnings.simplefilter("ignore")
        import colour
    return colour
