"""Scene files: TOML read, checked key by key, and completed.

Begin with `files.py`; `keys.py` lists every key, `light_tables.py` the kinds of light, `lamps.py` their spectra.
"""
