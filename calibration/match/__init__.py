"""Samples against their standard: differences, tolerances, uncertainty, metamerism, and the page for signature.

Begin with `pairs.py`. `spectral/measurement.py` decides which readings are comparable, `tolerance.py` when a pair
passes.
"""
