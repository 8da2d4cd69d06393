"""Measured error of the current view, requested once it is still and discarded when it changes."""

from __future__ import annotations

import time

import numpy as np
from jaxtyping import Float

from .probe_reader import ProbedView
from .view_error import AskedView, ViewError
from .worker import Failed, ReferenceWorker

#: Seconds that a view must be still before it is measured automatically.
PATIENCE_S = 1.0


class Measuring:
    """Measurement of side A of a view against its reference, in the worker's process.

    Attributes
    ----------
    found : latest result of this view. last : result of the previous view, until this one has one.
    problem : reason for a missing result.
    """

    def __init__(self, worker: ReferenceWorker) -> None:
        self._worker = worker
        self._of: ProbedView | None = None
        self._asked: AskedView | None = None
        self.found: ViewError | None = None
        self.problem: str | None = None
        self.measuring = False

    def ask(self, view: ProbedView, asked: AskedView) -> None:
        """Request the measurement of a view's image."""
        self._of, self.found, self.problem, self.measuring = view, None, None, True
        self._asked = asked
        self._worker.ask(asked)

    def is_of(self, view: ProbedView) -> bool:
        """Return whether this view was requested."""
        return self._of is view

    @property
    def reference(self) -> tuple[Float[np.ndarray, "H W 3"], Float[np.ndarray, "H W"]] | None:
        """Complete reference with its coverage, else None."""
        if self.found is None or self.found.xyz is None or self._asked is None:
            return None
        return self.found.xyz, self._asked.coverage

    def forget(self) -> None:
        """Discard the measurement after a change of the view."""
        if self._of is not None:
            self._worker.cancel()
        self._of = self._asked = self.found = self.problem = None
        self.measuring = False

    def poll(self) -> bool:
        """Collect results; return whether there were any."""
        came = self._worker.poll()
        if came is None:
            return False
        if isinstance(came, Failed):
            self.problem, self.measuring = came.words, False
        else:
            self.found, self.measuring = came, came.share < 1.0
        return True

    def words(self) -> str:
        """Describe the measurement."""
        if self.problem is not None:
            return f"not measured: {self.problem}"
        if self.found is None:
            return "being measured" if self.measuring else "not measured"
        return self.found.words(time.time())
