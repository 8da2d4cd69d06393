"""Precomputed transfer tensors (Sun et al. 2007), spectrally, as a baseline of interreflection.

Begin with `brdf_tensor.py`, a family of BRDFs as one tensor, then `precomputed.py` and `relighting.py`; `harmonic.py`
has the 2004 paper's transfer in harmonics.
"""
