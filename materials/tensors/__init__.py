"""Families of BRDFs as one tensor: the reflectance of Sun et al. 2007, to be navigated and relit.

Begin with `brdf_tensor.py`; `benchmarks.papers.transfer_tensors` relights scenes with it.
"""
