"""Imports at start-up: what only a fit needs is left to a fit alone, and what only some files need to their readers."""

import subprocess
import sys

from patience import patient

_RENDER = """
import sys
import numpy as np
import metamer.cli.main, metamer.viewer.picture
from metamer.materials.records.trial_table import trials_from
trials_from(np.zeros(0, dtype=[("rank", int)]))
print(*(name for name in ("tensorly", "metamer.materials.fitting.fit") if name in sys.modules))
"""

_READERS = """
import sys
from metamer.materials.formats import registry
assert registry.formats()
print(*(name for name in ("tensorly", "scipy", "colour") if name in sys.modules))
"""


def imported_by(code):
    """Names of the heavy libraries that a program says it holds."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=patient(120)
    )
    return done.stdout.split()


def test_a_picture_and_a_record_do_not_wait_for_the_fit():
    assert imported_by(_RENDER) == []


def test_files_are_recognised_before_anything_heavy_is_there():
    assert imported_by(_READERS) == []
