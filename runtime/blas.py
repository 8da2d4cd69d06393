"""BLAS library of this process, whose kernel and threads determine the order of summation."""

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

    library : name and version. kernel : chosen by OpenBLAS for this processor, "" for other libraries, which do not
    report it. threads : maximum, None if it is not reported.
    """

    library: str
    kernel: str = ""
    threads: int | None = None

    @property
    def facts(self) -> dict[str, str]:
        """Labels and texts of the known properties."""
        threads = None if self.threads is None else str(self.threads)
        told = {"BLAS": self.library, "BLAS kernel": self.kernel, "BLAS threads": threads}
        return {label: text for label, text in told.items() if text}


def blas() -> Blas:
    """Describe the BLAS of numpy: the build by `numpy.show_config`, and the current state of the loaded library."""
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
    """Return a handle for the symbols of numpy's BLAS; None if numpy has no such module."""
    try:
        found = importlib.util.find_spec(_LINKED)
    except ModuleNotFoundError:
        return None
    # It is loaded already: its names, and those of what it is linked with, are looked up in memory.
    return None if found is None or found.origin is None else ctypes.CDLL(found.origin)
