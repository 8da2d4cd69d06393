"""OpenGL back end: context, shaders, passes, and canvases in GPU memory.

Begin with `backend.py`; `passes.py` draws, `shaders/` is the GLSL, `side.py` one side of a live comparison.
"""
