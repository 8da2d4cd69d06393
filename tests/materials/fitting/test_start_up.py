"""What only a fit needs is imported by a fit alone."""

import subprocess
import sys

_RENDER = """
import sys
import numpy as np
import metamer.cli.main, metamer.viewer.picture
from metamer.materials.records.trial_table import trials_from
trials_from(np.zeros(0, dtype=[("rank", int)]))
print(*(name for name in ("tensorly", "metamer.materials.fitting.fit") if name in sys.modules))
"""


def test_a_picture_and_a_record_do_not_wait_for_the_fit():
    done = subprocess.run([sys.executable, "-c", _RENDER], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.split() == []
