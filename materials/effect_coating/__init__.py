"""Effect coatings reconstructed from readings at several angles: flakes that lean, under a clear coat.

Begin with `flake_tilt.py`, the BRDF; `fit.py` finds it, `stated_error.py` says what it may be off by.
"""
