"""Pictures: drawing, display, reviews and the window; the only package that imports OpenGL and OpenColorIO.

Begin with `api.py`, which scripts call, and `picture.py`, a scene from one camera; `render/` holds the session behind.
"""
