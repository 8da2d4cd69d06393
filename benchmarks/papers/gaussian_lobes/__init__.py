"""Reflectance as a few spherical Gaussians: Wang, Ren, Gong, Snyder and Guo 2009, as a baseline.

Begin with `brdf.py`; `warp.py` is the paper's change from half vectors to directions.
"""
