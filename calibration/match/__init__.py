"""Samples against their standard: differences, tolerances, uncertainty, metamerism, and the page that is signed.

Begin with `pairs.py`. `spectral/measurement.py` says which readings may be compared, `tolerance.py` when a pair passes.
"""
