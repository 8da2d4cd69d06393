"""Effect coatings reconstructed from readings at several angles: tilted flakes under a clear coat.

Begin with `flake_tilt.py`, the BRDF; `fit.py` fits it, `stated_error.py` estimates its error.
"""
