"""BTFs in few numbers: published methods and Metamer's, beside the images.

Begin with `benchmark.py`; `cases.py` and `methods.py` list what is compared.
"""
