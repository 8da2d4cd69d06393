"""Material records: one HDF5 file each, with a head that suffices for lists and queries.

Begin with `record.py`, which has a row for each fast form; `models.py` has one for each model.
"""
