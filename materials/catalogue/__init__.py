"""Catalogues: folders of material records, found by id.

Begin with `catalogue.py`; `material.py` is one of its materials, `compare.py` the difference of two catalogues.
"""
