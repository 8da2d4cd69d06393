"""BLAS library of this process: another kernel, or more threads, adds up in another order."""

from __future__ import annotations

import ctypes
import importlib.util
from dataclasses import dataclass

import numpy as np

# The module of numpy that is linked with its BLAS.
_LINKED = "numpy._core._multiarray_umath"
# OpenBLAS in numpy's own wheels has its names lengthened, and those of builds with 64-bit integers end otherwise.
_NAMES = [f"{start}{{}}{end}" for start in ("scipy_openblas_", "openblas_") for end in ("64_", "")]


@dataclass(frozen=True)
class Blas:
    """The BLAS of numpy.

    library : name and version. kernel : that OpenBLAS has chosen for this processor, "" of another library, which does
    not say. threads : at the most, None where it is not said.
    """

    library: str
    kernel: str = ""
    threads: int | None = None

    @property
    def facts(self) -> dict[str, str]:
        """Label and text of each, of what is not known nothing."""
        threads = None if self.threads is None else str(self.threads)
        told = {"BLAS": self.library, "BLAS kernel": self.kernel, "BLAS threads": threads}
        return {label: text for label, text in told.items() if text}


def blas() -> Blas:
    """Describe the BLAS that numpy was built with, as `numpy.show_config` has it, and what the loaded library says of
    itself now.
    """
    built = np.show_config(mode="dicts")["Build Dependencies"]["blas"]
    library = " ".join(str(built.get(key, "")) for key in ("name", "version")).strip()
    loaded = _loaded()
    for name in _NAMES:
        kernel, threads = (getattr(loaded, name.format(asked), None) for asked in ("get_corename", "get_num_threads"))
        if kernel is not None and threads is not None:
            kernel.restype, threads.restype = ctypes.c_char_p, ctypes.c_int
            return Blas(library, (kernel() or b"").decode("ascii", "replace"), int(threads()))
    return Blas(library)


def _loaded() -> ctypes.CDLL | None:
    """Return a handle by which the names in numpy's BLAS are found; None where numpy has no such module."""
    try:
        found = importlib.util.find_spec(_LINKED)
    except ModuleNotFoundError:
        return None
    # It is loaded already: its names, and those of what it is linked with, are looked up in memory.
    return None if found is None or found.origin is None else ctypes.CDLL(found.origin)
