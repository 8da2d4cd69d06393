"""Waiting in tests: limits on the clock that grow with what else the machine is busy with."""

import os


def patient(seconds):
    """Return these seconds, times the processes for each core now; as they are where nobody can tell."""
    busy = os.getloadavg()[0] / os.cpu_count() if hasattr(os, "getloadavg") else 1.0
    return seconds * max(busy, 1.0)
