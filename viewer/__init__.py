"""Rendering, display, reviews and the window; the only package that imports OpenGL and OpenColorIO.

Begin with `api.py`, the functions for scripts, and `picture.py`, an image of a scene; `render/` has render sessions.
"""
