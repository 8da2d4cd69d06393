"""Precomputed transfer tensors (Sun et al. 2007), spectrally, as a baseline of interreflection.

Begin with `precomputed.py` and `relighting.py`; `harmonic.py` has the 2004 paper's transfer in harmonics.
"""
