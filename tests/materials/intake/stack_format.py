"""A format for tests, a reader and a model in one: a stack of texels x pairs of directions x coefficients, as .npy.

It stands for what is larger than memory. The reader gives a handle; the fit is the mean of the stack, taken block by
block, as one matt surface. `register` makes both known; a process that unpickles a source calls it.
"""

import sys
from pathlib import Path

import numpy as np
from metamer.materials.analytic import lambert
from metamer.materials.formats import registry
from metamer.materials.formats.reading_cost import ReadingCost
from metamer.materials.records.material import Provenance
from metamer.materials.records.models import MEASURED, Measured
from metamer.materials.records.source import MaterialSource
from metamer.materials.records.stored_array import StoredArray, chunks_of
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

NAME = "stack"
SUFFIXES = (".npy",)
COEFFICIENTS = 8
# A reader that knows no better: it takes the array into memory.
WHOLE = "whole"


class StackSource(MaterialSource):
    """Unpickled in a worker, it brings its model along."""

    def __reduce__(self):
        return unpickled, (vars(self),)


def recognises(path, head):
    return head.startswith(b"\x93NUMPY")


def reading_cost(path):
    return ReadingCost(1 << 20, path.stat().st_size / 1e9)


def handle(path):
    """The array of a .npy file, which stays there."""
    with path.open("rb") as file:
        np.lib.format.read_magic(file)
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
        assert not fortran
        return StoredArray(path, file.tell(), shape, dtype)


def read_sources(path, uplift):
    stack = np.load(path) if path.stem == WHOLE else handle(path)
    said = Provenance("a test", "none", "measured")
    original = {"texels": np.array(stack.shape[:2])}
    yield StackSource(f"stacks/{path.stem}", "stacks", "stack_mean", {"stack": stack}, said, path, original)


class StackMean(lambert.Lambert):
    """The mean of all texels and directions: what is lit is small beside what was measured."""

    NAME = "stack_mean"

    @classmethod
    def from_parameters(cls, parameters):
        """Make the surface from the stack alone, never the whole of it in memory."""
        total, count = np.zeros(COEFFICIENTS), 0
        for _, block in chunks_of(parameters["stack"]):
            total += block.reshape(-1, COEFFICIENTS).sum(0, dtype=np.float32)
            count += block.size // COEFFICIENTS
        grid = WORKING_WAVELENGTHS_NM
        mean = np.interp(grid, np.linspace(grid[0], grid[-1], COEFFICIENTS), total / count)
        return lambert.Lambert.from_parameters(grid, {"reflectance": mean})


def written(path: Path, shape: tuple[int, ...], seed: int = 0) -> Path:
    """A stack of float32 in [0, 0.9), by a formula, a row of texels at a time."""
    stack = np.lib.format.open_memmap(path, "w+", np.float32, (*shape, COEFFICIENTS))
    noise = np.random.default_rng(seed).random((shape[1], shape[2], COEFFICIENTS), np.float32)
    slope = np.linspace(0.2, 0.9, COEFFICIENTS, dtype=np.float32)
    del stack
    with path.open("r+b") as file:
        np.lib.format.read_magic(file)
        np.lib.format.read_array_header_1_0(file)
        for row in range(shape[0]):
            file.write((noise * (slope * np.float32(1.0 - row / (2 * shape[0])))).tobytes())
    return path


def register():
    """Make reader and model known to this process."""
    lambert.StackMean = StackMean
    MEASURED["stack_mean"] = Measured("analytic.lambert", "StackMean", reads_files=True)
    registry.FORMATS = ("stack", *(name for name in registry.FORMATS if name != "stack"))
    sys.modules["metamer.materials.formats.stack"] = sys.modules[__name__]
    registry.formats.cache_clear()


def unpickled(fields):
    """A source, in a process that may not know its model."""
    register()
    return StackSource(**fields)


def import_one(path, catalogue, copy=""):
    """Import a stack, twice, verify the catalogue, look at the record, and say what came of it."""
    from metamer.materials.catalogue.catalogue import Catalogue
    from metamer.materials.intake.importing import import_sources
    from metamer.materials.records.description import shown_values
    from metamer.materials.records.verification import verify_catalogue

    register()
    for _ in range(2):
        report = import_sources([path], catalogue, jobs=1, apart=True, copy=bool(copy))
        for status in ("imported", "skipped", "failed"):
            if report.count(status):
                print(report.count(status), status, *(one.reason for one in report.outcomes if one.reason))
    found = verify_catalogue(Path(catalogue), jobs=1)
    print(*[one.problem for one in found.damaged] or ["intact"])
    for record in map(Catalogue.open(catalogue).load, Catalogue.open(catalogue)):
        assert str(shown_values(record.parameters)["stack"]) and len(record.lab()) == 3
        print(record.parameters["stack"].shape[:3])
