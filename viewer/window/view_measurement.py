"""The measured error of this very view: asked for once it has settled, forgotten as it changes."""

from __future__ import annotations

import time

import numpy as np
from jaxtyping import Float

from .probe_reader import ProbedView
from .view_error import AskedView, ViewError
from .worker import Failed, ReferenceWorker

#: Seconds that a view has to stand still before it is measured by itself.
PATIENCE_S = 1.0


class Measuring:
    """Measures side A of a view against its reference, in the worker's process.

    Attributes
    ----------
    found : the latest of this view. last : what was found of the view before, until this one has something.
    problem : why there is none.
    """

    def __init__(self, worker: ReferenceWorker) -> None:
        self._worker = worker
        self._of: ProbedView | None = None
        self._asked: AskedView | None = None
        self.found: ViewError | None = None
        self.problem: str | None = None
        self.measuring = False

    def ask(self, view: ProbedView, asked: AskedView) -> None:
        """Measure this picture of the view from now on."""
        self._of, self.found, self.problem, self.measuring = view, None, None, True
        self._asked = asked
        self._worker.ask(asked)

    def is_of(self, view: ProbedView) -> bool:
        """Return whether this view was asked for."""
        return self._of is view

    @property
    def reference(self) -> tuple[Float[np.ndarray, "H W 3"], Float[np.ndarray, "H W"]] | None:
        """The reference itself with its coverage, once it is whole."""
        if self.found is None or self.found.xyz is None or self._asked is None:
            return None
        return self.found.xyz, self._asked.coverage

    def forget(self) -> None:
        """The view has changed."""
        if self._of is not None:
            self._worker.cancel()
        self._of = self._asked = self.found = self.problem = None
        self.measuring = False

    def poll(self) -> bool:
        """Take what came; whether anything did."""
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
