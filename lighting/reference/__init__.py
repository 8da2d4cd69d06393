"""Reference renderer: every wavelength, float64, the original surfaces, with its noise stated.

Begin with `reference.py`; `geometry.py` finds by rays what each sample of a picture sees.
"""
