"""Review window, `metamer view`: its state, every change of it, its pictures and probes.

Begin with `state.py`; `commands.py` is every change, `frame.py` the picture. Panels are in `shell/`.
"""
