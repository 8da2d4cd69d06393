"""Scene files: TOML, parsed, checked key by key, and completed with defaults.

Begin with `files.py`; `keys.py` lists every key, `light_tables.py` the kinds of light, `lamps.py` their spectra.
"""
