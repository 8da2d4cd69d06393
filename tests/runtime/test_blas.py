"""Statements of BLAS: the kernel and the threads that the environment asks for, and nothing that is not known."""

import os
import subprocess
import sys

import pytest
from metamer.runtime import blas as module
from metamer.runtime.blas import Blas, blas

SAY = "from metamer.runtime.blas import blas; found = blas(); print(found.kernel, found.threads)"


def said(**variables):
    done = subprocess.run(
        [sys.executable, "-c", SAY], env={**os.environ, **variables}, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_the_kernel_and_the_threads_are_those_that_were_asked_for():
    if not blas().kernel:
        pytest.skip("numpy's BLAS is not OpenBLAS here")
    # The oldest kernel runs on every processor of this kind; OpenBLAS has its own name for it.
    old, threads = said(OPENBLAS_CORETYPE="Prescott", OPENBLAS_NUM_THREADS="1")
    assert threads == "1"
    new, threads = said(OPENBLAS_CORETYPE="", OPENBLAS_NUM_THREADS="2")
    assert new != old or os.uname().machine not in ("x86_64", "AMD64")
    assert threads == str(min(2, os.cpu_count() or 1))


def test_a_library_that_says_nothing_of_itself_has_its_name_alone(monkeypatch):
    monkeypatch.setattr(module, "_LINKED", "numpy.no_such.module")
    found = blas()
    assert found.library and (found.kernel, found.threads) == ("", None)
    assert set(found.facts) == {"BLAS"}


def test_facts_have_a_label_each():
    assert Blas("OpenBLAS 0.3", "Haswell", 2).facts == {
        "BLAS": "OpenBLAS 0.3",
        "BLAS kernel": "Haswell",
        "BLAS threads": "2",
    }
