"""OpenGL back end: context, shaders, passes, and canvases that stay on the GPU.

Begin with `backend.py`; `passes.py` draws, `shaders/` holds GLSL, `side.py` is one side of a live comparison.
"""
