"""Samples against their standard: differences, tolerances, uncertainty, metamerism, and the page that is signed.

Begin with `batch.py`; `pairs.py` says what may be compared, `tolerance.py` when it passes.
"""
