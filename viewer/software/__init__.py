"""Numpy back end, the twin of `gl/`.

Begin with `backend.py`.
"""
