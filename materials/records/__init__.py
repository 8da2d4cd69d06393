"""Material records: one HDF5 file each, with a head that lists and queries read alone.

Begin with `record.py`; `models.py` and `forms.py` have a row for each model and fast form.
"""
