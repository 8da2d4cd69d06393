"""Reference renderer: every wavelength, float64, the original surfaces, with an estimate of noise.

Begin with `reference.py`; `geometry.py` ray traces the visible geometry.
"""
